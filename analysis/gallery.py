"""The page of linkages: a sketch of each scene in jobs/linkages, and what its small study answers.

    python analysis/gallery.py [RESULTS]

Runs the studies that are not in RESULTS yet (a directory a scene; ``results/gallery`` by default), draws the sketches into
``docs/images/gallery`` and writes the answers into ``docs/how-to/gallery.md``, below the commands.
"""

import re
import subprocess
import sys
from pathlib import Path

from hpcclear.dynamics.planar.problem import poses_at_start
from hpcclear.report import save, sketch_figure
from hpcclear.report.answer import answer
from hpcclear.results import dataset
from hpcclear.scene import load_scene

ROOT = Path(__file__).parent.parent
PAGE = ROOT / "docs" / "how-to" / "gallery.md"
SHOWN = (
    "recommended",
    "values",
    "mean",
    "std. deviation",
    "equivalent",
    "active bounds",
    "contact model",
)
"""Lines of the answer that the page repeats."""


def main(results: Path) -> None:
    """Run what is missing, draw, write."""
    page = PAGE.read_text()
    for name in re.findall(r"run jobs/linkages/(\w+)\.toml", page):
        file = ROOT / "jobs" / "linkages" / f"{name}.toml"
        place = results / name
        if not (place / "verification.nc").exists():
            subprocess.run([sys.executable, "-m", "hpcclear", "run", file, "-o", place], check=True)
        scene = load_scene(file)
        picture = PAGE.parent.parent / "images" / "gallery" / f"{name}.png"
        picture.parent.mkdir(exist_ok=True)
        save(sketch_figure(scene, poses_at_start(scene)), picture)
        found = {
            kind: dataset.read(place / f"{kind}.nc", kind) for kind in ("samples", "verification")
        }
        lines = [line for line in answer(found, "") if line.label in SHOWN]
        table = "\n".join(
            ["| | |", "| --- | --- |", *(f"| {line.label} | {line.text} |" for line in lines)]
        )
        command, _, rest = page.partition(f"results/gallery/{name}\n```\n")
        after = rest[rest.find("\n## ") :] if "\n## " in rest else ""
        page = f"{command}results/gallery/{name}\n```\n\n{table}\n{after}"
    PAGE.write_text(page)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "results" / "gallery")
