"""`sample`: many designs of a scene, in parts as well."""

from pathlib import Path

from hpcclear.base.errors import InputError
from hpcclear.cli import loaded, options as cli


@cli.command("compute", "Simulate many designs.", ranks=True)
@cli.with_scene
@cli.output_option("NetCDF file to write.")
@cli.option(
    "--points", "CSV table of designs, used instead of the designs of the study.", type=cli.PATH
)
@cli.flag(
    "--statistics",
    "Keep mean, standard deviation and histogram of Monte Carlo samples instead of the samples.",
)
@cli.option(
    "--raw", "With --statistics: keep the samples too, in this directory, a file for every 4096.",
    type=cli.PATH,
)  # fmt: skip
@cli.option(
    "--part K/N",
    "Simulate part K of N, for a job array. Each part has its own file; --merge joins them.",
)
@cli.flag("--merge", "Merge the files of all parts into one, equal to the file of a single run.")
@cli.option(
    "--beyond [RESULT=]VALUE", name="thresholds",
    words='Print the share of samples above this value of f, or of a result: "peak_contact_force=3 kN". Repeatable.',
)  # fmt: skip
@cli.with_how
def run(
    written: cli.Written,
    output: Path,
    points: Path | None,
    thresholds: tuple[str, ...],
    statistics: bool,
    raw: Path | None,
    part: str | None,
    merge: bool,
    how: cli.How,
) -> None:
    """Simulate the designs of the study, or those of a table (--points).

    With --merge, give the same scene, --set, --points and -o as for the parts. The parts are kept; missing parts are listed.

    Example: mpiexec -n 2 hpcclear sample jobs/quickstart.toml -o results/samples.nc
    """
    if merge:
        simulating = ("thresholds", "statistics", "raw", "part", *cli.How._fields)
        cli.check_mode("--merge", True, simulating)
        return _merge(written, output, points) if cli.is_root() else None
    with cli.on_ranks(how.time_limit) as ranks:
        _check_kind(points, statistics, raw, part, how.fresh, thresholds)
        scene = loaded(written)
        from hpcclear.cli.printing import describe_run
        from hpcclear.ensemble.session import run_sample
        from hpcclear.ensemble.split import Part
        from hpcclear.ensemble.statistics import run_statistics
        from hpcclear.report.spread import beyond, shares, units_of

        chosen, place = None if part is None else Part.parse(part), cli.place_of(output)
        units, joints = units_of(scene.objective), scene.joint_labels
        levels = [beyond(units, words, joints) for words in thresholds]
        if statistics:
            kept = None if raw is None else cli.place_of(raw)
            found = run_statistics(scene, place, ranks, raw=kept, options=how.options())
            describe_run(found, "statistics")
        else:
            found = run_sample(
                scene, place, ranks, table=points, part=chosen, options=how.options()
            )
            describe_run(found, "samples", shares(found.content, levels))


def _merge(written: cli.Written, output: Path, points: Path | None) -> None:
    scene = loaded(written)
    from hpcclear.cli.printing import describe_run
    from hpcclear.ensemble.session import design, run_merge
    from hpcclear.ranks.boundary import alone

    describe_run(run_merge(scene, design(scene, points), output, alone()), "samples")


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
