"""`report`: figures and a page of results."""

from pathlib import Path

import click

from hpcclear.cli import options as cli
from hpcclear.ranks.stopping import Exit


@cli.command("look", "Write figures and an HTML page.")
@click.argument("places", type=cli.PATH, nargs=-1, required=True, metavar="DIRECTORY | FILE...")
@click.option(
    "-o", "--output", type=cli.PATH, help="Page to write. Default: report.html beside the results."
)
@cli.TRUST
def run(places: tuple[Path, ...], output: Path | None, trust: bool) -> int:
    """Write figures and a self-contained HTML page from a directory of results, or from chosen files.

    Example: hpcclear report results/quickstart
    """
    from hpcclear.plugins import trusting
    from hpcclear.report.html.page import write_report

    with trusting(trust):
        cli.show(f"report  {write_report(*places, output=output and cli.place_of(output))}")
    return Exit.DONE
