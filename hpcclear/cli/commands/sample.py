"""`sample`: many designs of a scene, in parts as well."""

from pathlib import Path

from hpcclear.cli import loaded, options as cli


@cli.command("compute", "Simulate many designs.", ranks=True)
@cli.with_scene
@cli.output_option("NetCDF file to write.")
@cli.option(
    "--points", "Table of designs (CSV, xlsx) instead of those of the study.", type=cli.PATH
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
    cli.check_mode("--statistics", statistics, ("points", "thresholds", "part"), ("raw",))
    cli.check_mode("--part", part is not None, ("fresh",))
    with cli.on_ranks(how.time_limit) as ranks:
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
