"""`report`: figures and a page of results."""

from pathlib import Path

import click

from hpcclear.cli import options as cli
from hpcclear.cli.terminal import print_remark


@cli.command("look", "Write figures and an HTML page.")
@click.argument("places", type=cli.PATH, nargs=-1, required=True, metavar="DIRECTORY | FILE...")
@cli.option("-o --output", "Page to write. Default: report.html beside the results.", type=cli.PATH)
@cli.flag("--sheet", "Write one sheet of A4 to sign (sheet.pdf) instead of the page.")
@cli.TRUST
def run(places: tuple[Path, ...], output: Path | None, sheet: bool, trust: bool) -> None:
    """Write figures and a self-contained HTML page from a directory of results, or from chosen files.

    Examples: hpcclear report results/quickstart, hpcclear report results/quickstart --sheet
    """
    from hpcclear.plugins import trusting
    from hpcclear.report.html.page import write_report
    from hpcclear.report.sheet import write_sheet

    write, troubles = write_sheet if sheet else write_report, list[str]()
    with trusting(trust):
        place = write(*places, output=output and cli.place_of(output), troubles=troubles)
    for text in troubles:
        print_remark("Warning", text)
    cli.show(f"{'sheet' if sheet else 'report'}  {place}")
