"""`reproduce`: simulations of a result again, bit by bit, and its description for an archive."""

from pathlib import Path

import click

from hpcclear.cli import options as cli
from hpcclear.ranks.stopping import Exit


@cli.command("keep", "Repeat simulations bit by bit; describe results for an archive.")
@click.argument("place", type=cli.PATH)
@cli.option("--samples", "Samples to repeat of each file.", 16, type=click.IntRange(min=1))
@cli.TRUST
@cli.flag("--crate", "Describe results for an archive instead, as a Process Run Crate.")
def run(place: Path, samples: int, trust: bool, crate: bool) -> int:
    """Repeat some simulations of a result from the scene in its file, and compare bit by bit.

    PLACE is a result file or a directory of results. Versions and processors that differ from those of the result are listed.
    Exit code 1 if anything differs or cannot be read.

    With --crate, write a description of the results of a directory and their origin: PLACE/ro-crate-metadata.json.
    Damaged result files are left out and listed, with exit code 1.

    Example: hpcclear reproduce results/quickstart

    Example: hpcclear reproduce results/quickstart --crate
    """
    cli.check_mode("--crate", crate, ("samples", "trust"))
    return _describe(place) if crate else _repeat(place, samples, trust)


def _repeat(place: Path, samples: int, trust: bool) -> int:
    from hpcclear.ensemble.repeating import repeated
    from hpcclear.plugins import trusting

    with trusting(trust):
        found = list(repeated(place, samples))
    for one in found:
        said = ": not the same: " + ", ".join(one.differing) if one.differing else ": the same"
        cli.show(f"{one.file}: {one.extent}{'' if one.extent.startswith('not') else said}")
    for text in dict.fromkeys(text for one in found for text in one.changed):
        cli.show(f"made by another {text}")
    if not found:
        cli.show("no samples and no responses: nothing was simulated again")
    return Exit.FAILED if any(one.differing or one.unread for one in found) else Exit.DONE


def _describe(directory: Path) -> int:
    from hpcclear.results.crate import write_crate

    left_out: list[str] = []
    cli.show(f"crate  {write_crate(directory, left_out.append)}")
    for text in left_out:
        cli.say(f"Error: {text}")
    return Exit.FAILED if left_out else Exit.DONE
