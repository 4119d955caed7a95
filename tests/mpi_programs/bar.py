"""Shows progress for half a second on root: bar.py."""

import sys

from synthetic import design, make_sleeping

from hpcclear.ranks.boundary import run_on_ranks
from hpcclear.ranks.leading import run_points
from hpcclear.ranks.progress import Progress
from hpcclear.ranks.schedule import Task
from hpcclear.ranks.team import Ranks


def program(ranks: Ranks) -> None:
    progress = Progress("sampling", interval=0.1)
    run_points(ranks, Task("sleep", make_sleeping, {"cost": 5e-3}), design(150), progress=progress)


if __name__ == "__main__":
    sys.exit(run_on_ranks(program))
