"""`simulate`: one response of one design."""

from pathlib import Path

import click

from hpcclear.cli import loaded, options as cli
from hpcclear.ranks.stopping import Exit


@cli.command("compute", "Simulate one design.")
@cli.with_scene
@cli.output_option("NetCDF file to write.")
@cli.option("--keep N", "Store the series of the last N revolutions only.", type=click.IntRange(1))
def run(written: cli.Written, output: Path, keep: int | None) -> int:
    """Simulate one design: objective, and time series of bearing forces, torque, motion and energies.

    Exit code 1 if the simulation failed, 4 if f was not as accurate as numerics.target_error. The file is written all the same.

    Example: hpcclear simulate jobs/slider_crank.toml -o results/response.nc
    """
    if keep is not None:
        overrides = (*written.overrides, f"output.keep_revolutions={keep}")
        written = written._replace(overrides=overrides)
    scene = loaded(written)
    from hpcclear.base.outcome import Flag, Status
    from hpcclear.cli.printing import describe
    from hpcclear.dynamics import sizing
    from hpcclear.dynamics.evaluation.steady.wording import why_missed
    from hpcclear.dynamics.response import simulated
    from hpcclear.ensemble.session import Options, Session
    from hpcclear.ranks.boundary import alone
    from hpcclear.report.html.content import Content
    from hpcclear.results import dataset
    from hpcclear.results.places import Place

    if sizing.stored_bytes(scene) > sizing.LARGE:
        cli.say(f"Time series: {sizing.words(scene)}. Shorter with --keep N")
    place = Place.of_response(cli.place_of(output))
    with Session(place, {"command": "simulate"}, alone(), Options()):
        if output.exists():
            dataset.read(output, "response")  # an earlier response is replaced, and nothing else
        response = simulated(scene)
        dataset.write(response, output)
    describe(Content(output.parent, {}, {"response": response}), output)
    status = Status(int(response["status"]))
    if status.valid and int(response["flags"]) & Flag.TARGET_MISSED:
        cli.say(f"Target missed: {why_missed(response, scene.numerics.target_error)}")
        return Exit.TARGET_MISSED
    if status.valid:
        return Exit.DONE
    said = response.attrs.get("ended", status.message)
    cli.say(f"Error: {status.name.lower()}: {said}")  # its remedy stands on the screen above
    return Exit.FAILED
