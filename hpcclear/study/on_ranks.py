"""The study that a file describes, on the ranks of this job; `hpcclear.study.launched` starts it."""

import json
import sys
from pathlib import Path

from hpcclear.plugins import trusting
from hpcclear.ranks.boundary import run_on_ranks
from hpcclear.ranks.team import Ranks
from hpcclear.scene.loading import scene_of_text
from hpcclear.study import run_study
from hpcclear.study.launched import DONE


def main(job: str) -> int:
    """Return the exit code."""
    content = json.loads(Path(job).read_text(encoding="utf-8"))

    def program(ranks: Ranks) -> None:
        scene = scene_of_text(content["text"], "scene")
        scene._text = content["text"]
        place = run_study(
            scene, content["directory"], ranks, fresh=content["fresh"],
            progress_style=content["style"], notify=lambda text: sys.stderr.write(f"{text}\n"),
        )  # fmt: skip
        sys.stdout.write(f"{DONE}{place}\n")
        sys.stdout.flush()

    with trusting(True):  # the scene was loaded by who started this
        return run_on_ranks(program)
