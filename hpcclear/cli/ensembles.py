"""Commands about many simulations: `sample`, `merge`, `map`, `wear`, `effects`."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from hpcclear.base.errors import InputError
from hpcclear.cli.options import (
    PATH,
    POINTS,
    How,
    Written,
    check_free,
    flag,
    of_one_process,
    on_ranks,
    output_option,
    place_of,
    with_how,
    with_scene,
)
from hpcclear.ranks.stopping import Exit

if TYPE_CHECKING:
    from hpcclear.ranks.team import Ranks


def _check_kind(
    points: Path | None, statistics: bool, raw: Path | None, part: str | None, fresh: bool
) -> None:
    """Raise InputError where options name two kinds of sampling at once."""
    if part is not None and (statistics or fresh):
        reason = "parts of samples are merged, under the names they were given"
        raise InputError("--part", part, reason, "Drop --statistics and --fresh")
    if statistics and points is not None:
        reason = "--statistics makes the study's Monte Carlo points on demand"
        raise InputError("--points", str(points), reason, "Drop one of the two")
    if raw is not None and not statistics:
        reason = "without --statistics the samples are what is written"
        raise InputError("--raw", str(raw), reason, "Drop it, or add --statistics")


@click.command(short_help="Simulate many designs.")
@with_scene
@output_option("NetCDF file to write.")
@POINTS
@flag(
    "--statistics",
    "Keep mean, deviation and histogram of Monte Carlo samples, not the samples.",
)
@click.option(
    "--raw",
    type=PATH,
    help="With --statistics: directory for the samples themselves; samples.nc in it opens as all of them.",
)
@click.option(
    "--part",
    metavar="K/N",
    help="Only part K of N, into a file of its own beside the output: for job arrays; see merge.",
)
@with_how
def sample(
    written: Written,
    output: Path,
    points: Path | None,
    statistics: bool,
    raw: Path | None,
    part: str | None,
    how: How,
) -> int:
    """Send the study's points, or a table of yours, through the dynamics.

    Example: mpiexec -n 2 hpcclear sample jobs/quickstart.toml -o results/samples.nc
    """

    def program(ranks: "Ranks") -> None:
        _check_kind(points, statistics, raw, part, how.fresh)
        from hpcclear.cli.printing import describe_samples, describe_statistics
        from hpcclear.ensemble.samples import run_sample
        from hpcclear.ensemble.split import Part
        from hpcclear.ensemble.statistics import run_statistics

        chosen = None if part is None else Part.parse(part)
        scene, place = written.scene(), place_of(output)
        if statistics:
            kept = None if raw is None else place_of(raw)
            describe_statistics(
                run_statistics(scene, place, ranks, raw=kept, options=how.options())
            )
        else:
            found = run_sample(
                scene, place, ranks, table=points, part=chosen, options=how.options()
            )
            describe_samples(found)

    return on_ranks(program, how.time_limit)


@click.command(short_help="Put parts of a design together.")
@with_scene
@output_option("NetCDF file to write: the name that was given with each part.")
@POINTS
@of_one_process
def merge(written: Written, output: Path, points: Path | None) -> int:
    """Write what sample --part 1/N to N/N made as one file: the bytes that a single run would have written.

    Scene, --set and --points are those of the parts, which stay; parts that are missing are named.

    Example: hpcclear merge jobs/quickstart.toml -o results/samples.nc
    """
    from hpcclear.cli.printing import describe_samples
    from hpcclear.ensemble.samples import design
    from hpcclear.ensemble.split import run_merge
    from hpcclear.ranks.boundary import alone

    scene = written.scene()
    describe_samples(run_merge(scene, design(scene, points), output, alone()))
    return Exit.DONE


@click.command("map", short_help="Show where the motion does what.")
@with_scene
@output_option("NetCDF file to write.")
@click.option(
    "--x", "x", required=True, metavar="PATH=LO:HI:N", help="First entry, its limits, its cells."
)
@click.option("--y", "y", metavar="PATH=LO:HI:N", help="Second entry.")
@with_how
def map_command(written: Written, output: Path, x: str, y: str | None, how: How) -> int:
    """Judge the motion over a line or a grid of one or two entries of the scene: growth of a kick (largest Lyapunov
    exponent, per revolution), period, kinds of motion from several starts, f and its limit.

    Example: mpiexec -n 2 hpcclear map jobs/hunt_crossley.toml --x C=0.1mm:1mm:40 -o results/map.nc
    """

    def program(ranks: "Ranks") -> None:
        from hpcclear.cli.printing import describe_map
        from hpcclear.ensemble.maps import run_map

        axes = (x,) if y is None else (x, y)
        describe_map(run_map(written.scene(), axes, place_of(output), ranks, how.options()))

    return on_ranks(program, how.time_limit)


@click.command(short_help="Follow lives of joints that wear.")
@with_scene
@output_option("NetCDF file to write.")
@with_how
def wear(written: Written, output: Path, how: How) -> int:
    """Follow lives of a mechanism whose joints wear: clearance, f and peak force against revolutions, how long lives last and
    how sure that is.

    Exit code 1 if every life failed; what there is of them is written.

    Example: mpiexec -n 2 hpcclear wear jobs/wear.toml -o results/wear.nc --set wear.lives=8
    """

    def program(ranks: "Ranks") -> int:
        from hpcclear.cli.wear import describe
        from hpcclear.ensemble.wear import run_wear

        return describe(run_wear(written.scene(), place_of(output), ranks, how.options()))

    return on_ranks(program, how.time_limit)


@click.command(short_help="Say which effects a scene can do without.")
@with_scene
@output_option("NetCDF file to write; by default NAME-effects.nc here.", required=False)
@click.option(
    "--tolerance",
    default="1%",
    show_default=True,
    metavar="CHANGE",
    help="Relative change of what the study asks that is allowed.",
)
@click.option(
    "--samples",
    type=click.IntRange(min=64),
    metavar="N",
    help="Samples of a variant at most; by default as many as a twentieth of the study allows.",
)
@flag("--forces", "Hold peak contact forces to the tolerance, too, not only tell them.")
@click.option(
    "--scene",
    "reduced",
    type=PATH,
    metavar="FILE",
    help="Write the cheapest scene there, whole.",
)
@with_how
def effects(
    written: Written,
    output: Path | None,
    tolerance: str,
    samples: int | None,
    forces: bool,
    reduced: Path | None,
    how: How,
) -> int:
    """Measure what each effect of a scene changes and costs (play in each joint, friction, gravity, loads, ...), and print
    the cheapest scene that stays within the tolerance.

    Example: mpiexec -n 2 hpcclear effects jobs/quickstart.toml --tolerance 2% -o results/effects.nc
    """

    def program(ranks: "Ranks") -> int:
        from hpcclear.cli.effects import describe, tolerance_of
        from hpcclear.ensemble.effects import run_effects
        from hpcclear.ensemble.trial import Wanted
        from hpcclear.study.extent import certificate_extent

        allowed = tolerance_of(tolerance)
        scene = written.scene()
        if reduced is not None:
            check_free(reduced)
        most, budget = certificate_extent(scene, samples)
        found = run_effects(
            scene,
            place_of(output or Path(f"{written.file.stem}-effects.nc")),
            ranks,
            how.options(),
            Wanted(allowed, most, budget, forces),
        )
        code = describe(found, scene, written.file)
        if reduced is not None:
            from hpcclear.results import files

            files.write_bytes(place_of(reduced), found.content.attrs["reduced_scene"].encode())
        return code

    return on_ranks(program, how.time_limit)
