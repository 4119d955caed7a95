"""Commands about many simulations: `sample`, `merge`, `map`, `wear`, `effects`."""

import sys
from pathlib import Path

import click

from hpcclear.base.errors import InputError
from hpcclear.cli.options import (
    PATH,
    POINTS,
    How,
    Written,
    check_free,
    command,
    flag,
    of_one_process,
    on_ranks,
    output_option,
    place_of,
    remarked,
    with_how,
    with_scene,
)
from hpcclear.ranks.stopping import Exit


def _check_kind(
    points: Path | None, statistics: bool, raw: Path | None, part: str | None, fresh: bool,
    thresholds: tuple[str, ...],
) -> None:  # fmt: skip
    """Raise InputError where options name two kinds of sampling at once."""
    if part is not None and (statistics or fresh):
        reason = "a part of a job array writes its samples for a later merge"
        raise InputError("--part", part, reason, "Drop --statistics and --fresh")
    if statistics and points is not None:
        reason = "--statistics generates the study's Monte Carlo points itself"
        raise InputError("--points", str(points), reason, "Drop one of the two")
    if thresholds and statistics:
        reason = "--statistics keeps a histogram and no samples"
        raise InputError("--beyond", ", ".join(thresholds), reason, "Drop one of the two")
    if raw is not None and not statistics:
        reason = "without --statistics the samples are written anyway"
        raise InputError("--raw", str(raw), reason, "Drop it, or add --statistics")


@command(short_help="Simulate many designs.")
@with_scene
@output_option("NetCDF file to write.")
@POINTS
@flag(
    "--statistics",
    "Keep mean, standard deviation and histogram of Monte Carlo samples instead of the samples.",
)
@click.option(
    "--raw",
    type=PATH,
    help="With --statistics: keep the samples too, in this directory. Open its samples.nc to read all of them.",
)
@click.option(
    "--part",
    metavar="K/N",
    help="Simulate part K of N, for a job array. Each part has its own file; merge joins them.",
)
@click.option(
    "--beyond",
    "thresholds",
    multiple=True,
    metavar="[RESULT=]VALUE",
    help='Print the share of samples above this value of f, or of a result: "peak_contact_force=3 kN". Repeatable.',
)
@with_how
def sample(
    written: Written,
    output: Path,
    points: Path | None,
    thresholds: tuple[str, ...],
    statistics: bool,
    raw: Path | None,
    part: str | None,
    how: How,
) -> int:
    """Simulate the designs of the study, or those of a table (--points).

    Example: mpiexec -n 2 hpcclear sample jobs/quickstart.toml -o results/samples.nc
    """

    with on_ranks(how.time_limit) as ranks:
        _check_kind(points, statistics, raw, part, how.fresh, thresholds)
        from hpcclear.cli.printing import describe_samples, describe_statistics
        from hpcclear.ensemble.samples import run_sample
        from hpcclear.ensemble.split import Part
        from hpcclear.ensemble.statistics import run_statistics
        from hpcclear.report.spread import beyond, units_of
        from hpcclear.scene import load_scene

        chosen = None if part is None else Part.parse(part)
        scene, place = remarked(load_scene(*written)), place_of(output)
        units, joints = units_of(scene.objective), scene.joint_labels
        levels = [beyond(units, words, joints) for words in thresholds]
        if statistics:
            kept = None if raw is None else place_of(raw)
            describe_statistics(
                run_statistics(scene, place, ranks, raw=kept, options=how.options())
            )
        else:
            found = run_sample(
                scene, place, ranks, table=points, part=chosen, options=how.options()
            )
            describe_samples(found, levels)
    return Exit.DONE


@command(short_help="Merge partial result files.")
@with_scene
@output_option("NetCDF file to write: the name that was given with each part.")
@POINTS
@of_one_process
def merge(written: Written, output: Path, points: Path | None) -> int:
    """Merge the files of sample --part 1/N to N/N into one, equal to the file of a single run.

    Use the same scene, --set and --points as for the parts. The parts are kept; missing parts are listed.

    Example: hpcclear merge jobs/quickstart.toml -o results/samples.nc
    """
    from hpcclear.cli.printing import describe_samples
    from hpcclear.ensemble.samples import design, run_merge
    from hpcclear.ranks.boundary import alone
    from hpcclear.scene import load_scene

    scene = remarked(load_scene(*written))
    describe_samples(run_merge(scene, design(scene, points), output, alone()))
    return Exit.DONE


@command("map", short_help="Map periodic and chaotic motion over one or two parameters.")
@with_scene
@output_option("NetCDF file to write.")
@click.option(
    "--x",
    "x",
    required=True,
    metavar="PATH=LO:HI:N",
    help="First parameter: scene entry, bounds, number of cells.",
)
@click.option("--y", "y", metavar="PATH=LO:HI:N", help="Second parameter.")
@with_how
def map_command(written: Written, output: Path, x: str, y: str | None, how: How) -> int:
    """Map periodic and chaotic motion over one or two entries of the scene.

    Each cell has the largest Lyapunov exponent per revolution, the period, the number of different
    motions reached from several starts, and f with its half-width.

    Example: mpiexec -n 2 hpcclear map jobs/hunt_crossley.toml --x C=0.1mm:1mm:40 -o results/map.nc
    """

    with on_ranks(how.time_limit) as ranks:
        from hpcclear.cli.printing import describe_map
        from hpcclear.ensemble.maps import run_map
        from hpcclear.scene import load_scene

        axes = (x,) if y is None else (x, y)
        scene = remarked(load_scene(*written))
        describe_map(run_map(scene, axes, place_of(output), ranks, how.options()))
    return Exit.DONE


@command(short_help="Observe each revolution over a range of one parameter.")
@with_scene
@output_option("NetCDF file to write.")
@click.option(
    "--x",
    "x",
    required=True,
    metavar="PATH=LO:HI:N",
    help="Parameter: scene entry, bounds, number of values.",
)
@click.option(
    "--observe",
    "name",
    default="objective",
    show_default=True,
    metavar="SERIES",
    help='Series of a response, taken at the section: "contact_force crank_rod". With max, min or mean before it, '
    'that value of each revolution: "max contact_force crank_rod".',
)
@click.option(
    "--section",
    default="0 deg",
    show_default=True,
    metavar="ANGLE",
    help="Crank angle at which the series is taken, in rad or with a unit.",
)
@click.option(
    "--transient",
    type=click.IntRange(min=0),
    default=60,
    show_default=True,
    help="Revolutions before the first one that is observed.",
)
@click.option(
    "--revolutions",
    type=click.IntRange(min=1),
    default=60,
    show_default=True,
    help="Revolutions that are observed.",
)
@with_how
def bifurcation(
    written: Written,
    output: Path,
    x: str,
    name: str,
    section: str,
    transient: int,
    revolutions: int,
    how: How,
) -> int:
    """Observe one value of each revolution over a range of an entry of the scene, for a bifurcation figure.

    If the motion repeats every n revolutions, the figure has n dots at that value. hpcclear plot draws it.

    Example: mpiexec -n 2 hpcclear bifurcation jobs/hunt_crossley.toml --x drive.speed="500 rpm:6000 rpm:12" -o results/b.nc
    """

    with on_ranks(how.time_limit) as ranks:
        from hpcclear.cli.printing import describe_bifurcation
        from hpcclear.ensemble.bifurcation import Observation, run_bifurcation
        from hpcclear.ensemble.maps import number_of
        from hpcclear.scene import load_scene

        angle = number_of("--section", section, "rad")
        seen = Observation(name, angle, transient, revolutions)
        scene, place = remarked(load_scene(*written)), place_of(output)
        describe_bifurcation(run_bifurcation(scene, x, place, ranks, seen, how.options()))
    return Exit.DONE


@command(short_help="Simulate wear over the service life.")
@with_scene
@output_option("NetCDF file to write.")
@with_how
def wear(written: Written, output: Path, how: How) -> int:
    """Simulate wear over the service life, for many mechanisms with random inputs.

    Results are clearance, f and peak force against revolutions, and the survival curve with confidence intervals.

    Exit code 1 if every service life failed; the file is written all the same.

    Example: mpiexec -n 2 hpcclear wear jobs/wear.toml -o results/wear.nc --set wear.lives=8
    """

    with on_ranks(how.time_limit) as ranks:
        from hpcclear.cli.wear import describe
        from hpcclear.ensemble.wear import run_wear
        from hpcclear.scene import load_scene

        scene = remarked(load_scene(*written))
        sys.exit(describe(run_wear(scene, place_of(output), ranks, how.options())))
    return Exit.DONE


@command(short_help="Find effects that can be neglected.")
@with_scene
@output_option("NetCDF file to write; by default NAME-effects.nc here.", required=False)
@click.option(
    "--tolerance",
    default="1%",
    show_default=True,
    metavar="CHANGE",
    help="Largest relative change of the results that counts as negligible.",
)
@click.option(
    "--samples",
    type=click.IntRange(min=64),
    metavar="N",
    help="Largest number of samples of a variant. By default a twentieth of the study's simulations is spent.",
)
@flag(
    "--forces", "Apply the tolerance to peak contact forces too. Without it they are only reported."
)
@click.option(
    "--scene",
    "reduced",
    type=PATH,
    metavar="FILE",
    help="Write the recommended scene to this file.",
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
    """Find effects that can be neglected: clearance in each joint, friction, gravity, loads and others.

    Each effect is disabled in turn. The command measures how results and run time change, with confidence intervals.

    Example: mpiexec -n 2 hpcclear effects jobs/quickstart.toml --tolerance 2% -o results/effects.nc
    """

    with on_ranks(how.time_limit) as ranks:
        from hpcclear.cli.effects import describe, tolerance_of
        from hpcclear.ensemble.effects import run_effects
        from hpcclear.ensemble.trial import Wanted
        from hpcclear.scene import load_scene
        from hpcclear.study.extent import certificate_extent

        allowed = tolerance_of(tolerance)
        scene = remarked(load_scene(*written))
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
        sys.exit(code)
    return Exit.DONE
