"""`run`: a whole study."""

from pathlib import Path
from typing import Any

from hpcclear.cli.options import (
    FRESH,
    LIMIT,
    PROGRESS,
    STUDYING,
    Written,
    command,
    directory_option,
    on_ranks,
    place_of,
    remarked,
    say,
    with_scene,
)  # fmt: skip
from hpcclear.ranks.stopping import Exit


@command("compute", "Run a complete study.", ranks=True)
@with_scene
@directory_option("Directory for the results.")
@FRESH
@LIMIT
@PROGRESS
def run(
    written: Written,
    output: Path,
    fresh: bool,
    time_limit: float | None,
    progress: Any,
) -> int:
    """Run a complete study: sensitivity analysis, surrogates, robust optimisation, verification of the designs.

    Example: mpiexec -n 2 hpcclear run jobs/quickstart.toml -o results/quickstart
    """

    with on_ranks(time_limit, STUDYING) as ranks:
        from hpcclear.cli.printing import describe_study
        from hpcclear.scene import load_scene
        from hpcclear.study import run_study

        place = run_study(
            remarked(load_scene(*written)),
            place_of(output),
            ranks,
            fresh=fresh,
            progress_style=progress,
            notify=lambda text: say(text),
        )
        describe_study(place)
    return Exit.DONE
