"""`effects`: which effects of a scene can be neglected."""

from pathlib import Path

import click

from hpcclear.base.errors import InputError
from hpcclear.cli import loaded, options as cli


@cli.command("compute", "Find effects that can be neglected.", ranks=True)
@cli.with_scene
@cli.output_option("NetCDF file to write; by default NAME-effects.nc here.", required=False)
@cli.option(
    "--tolerance CHANGE", "Largest relative change of the results that counts as negligible.", "1%",
    type=cli.Share(0.0, 1.0, min_open=True, max_open=True),
)  # fmt: skip
@cli.option(
    "--samples N",
    "Largest number of samples of a variant. By default a twentieth of the study's simulations is spent.",
    type=click.IntRange(min=64),
)
@cli.flag(
    "--forces", "Apply the tolerance to peak contact forces too. Without it they are only reported."
)
@cli.option("--scene FILE", "File for the recommended scene.", name="reduced", type=cli.PATH)
@cli.with_how
def run(
    written: cli.Written,
    output: Path | None,
    tolerance: float,
    samples: int | None,
    forces: bool,
    reduced: Path | None,
    how: cli.How,
) -> None:
    """Find effects that can be neglected: clearance in each joint, friction, gravity, loads and others.

    Each effect is disabled in turn. The command measures how results and run time change, with confidence intervals.

    Example: mpiexec -n 2 hpcclear effects jobs/quickstart.toml --tolerance 2% -o results/effects.nc
    """

    with cli.on_ranks(how.time_limit) as ranks:
        scene = loaded(written)
        from hpcclear.cli.printing import describe_run
        from hpcclear.ensemble.effects import run_effects
        from hpcclear.ensemble.trial import Wanted
        from hpcclear.study.stages import certificate_extent

        output = output or Path(f"{written.file.stem}-effects.nc")
        if reduced is not None:
            cli.check_free(reduced)
            if reduced.resolve() == output.resolve():
                reason = "--output names this file too"
                raise InputError("--scene", str(reduced), reason, "Choose another name")
        wanted = Wanted(tolerance, *certificate_extent(scene, samples), forces)
        found = run_effects(scene, cli.place_of(output), ranks, how.options(), wanted)
        describe_run(found, "effects")
        if reduced is not None:
            from hpcclear.results import files

            files.write_bytes(cli.place_of(reduced), found.content.attrs["reduced_scene"].encode())
