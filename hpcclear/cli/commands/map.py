"""`map`: periodic and chaotic motion over parameters, and bifurcation diagrams."""

from pathlib import Path

import click

from hpcclear.cli import loaded, options as cli


@cli.command("compute", "Map periodic and chaotic motion over one or two parameters.", ranks=True)
@cli.with_scene
@cli.output_option("NetCDF file to write.")
@cli.option("--x PATH=LO:HI:N", "First parameter: entry, bounds, number of cells.", required=True)
@cli.option("--y PATH=LO:HI:N", "Second parameter.")
@cli.flag(
    "--bifurcation", "Observe one value of each revolution instead, for a bifurcation diagram."
)
@cli.option(
    "--observe SERIES", shown="objective", name="name",
    words='With --bifurcation, series of a response, taken at the section: "contact_force crank_rod". With max, min or mean '
          'before it, that value of each revolution: "max contact_force crank_rod".',
)  # fmt: skip
@cli.option("--section ANGLE", "Crank angle of the section, in rad or with a unit.", "0 deg")
@cli.option("--transient", "Revolutions before the first observed one.", 60, type=click.IntRange(0))
@cli.option("--revolutions", "Observed revolutions.", 60, type=click.IntRange(1, 1_000_000))
@cli.with_how
def run(
    written: cli.Written,
    output: Path,
    x: str,
    y: str | None,
    bifurcation: bool,
    name: str,
    section: str,
    transient: int,
    revolutions: int,
    how: cli.How,
) -> None:
    """Map periodic and chaotic motion over one or two entries of the scene.

    Each cell has the largest Lyapunov exponent per revolution, the period, the number of different
    motions reached from several starts, and f with its half-width.

    With --bifurcation, one value of each revolution is observed over a range of one entry. If the motion repeats every
    n revolutions, the diagram has n dots at that value. hpcclear plot draws it.

    Example: mpiexec -n 2 hpcclear map jobs/hunt_crossley.toml --x C=0.1mm:1mm:40 -o results/map.nc

    Example: mpiexec -n 2 hpcclear map jobs/hunt_crossley.toml --bifurcation --x drive.speed="500 rpm:6000 rpm:12"
    -o results/b.nc
    """
    observing = ("name", "section", "transient", "revolutions")
    cli.check_mode("--bifurcation", bifurcation, ("y",), observing)
    with cli.on_ranks(how.time_limit) as ranks:
        scene = loaded(written)
        from hpcclear.cli.printing import describe_run
        from hpcclear.ensemble.bifurcation import Observation, run_bifurcation
        from hpcclear.ensemble.maps import number_of, run_map

        place = cli.place_of(output)
        if bifurcation:
            seen = Observation(name, number_of("--section", section, "rad"), transient, revolutions)
            found = run_bifurcation(scene, x, place, ranks, seen, how.options())
            describe_run(found, "bifurcation")
        else:
            axes = (x,) if y is None else (x, y)
            describe_run(run_map(scene, axes, place, ranks, how.options()), "map")
