"""The page of linkages: a sketch of each scene in jobs/linkages, and what its small study answers.

    python analysis/gallery.py [RESULTS [NAME ...]]

Of all scenes of the page, or those that are named: runs the studies that are not in RESULTS yet (a directory a scene;
``results/gallery`` by default), draws the sketches into ``docs/images/gallery`` and writes the answers to
``analysis/results/gallery_*.csv``.
"""

import re
import subprocess
import sys
from pathlib import Path

from recorded import record

from hpcclear.dynamics.planar.problem import poses_at_start
from hpcclear.report import sketch_figure
from hpcclear.report.figures.style import render
from hpcclear.report.html.content import read
from hpcclear.report.screens import screen_of
from hpcclear.scene import load_scene

ROOT = Path(__file__).parent.parent
PAGE = ROOT / "docs" / "how-to" / "gallery.md"
LINES = {
    "four_stroke": {"big_end": "24 mm", "small_end": "22 mm"},
    "three_rrr": dict.fromkeys(("knee0", "knee1", "knee2"), "16 mm"),
}
"""Lengths of bearings in studies that leave the range of Hertz contact, which are repeated with line contact."""


def run(name: str, place: Path, *sets: str) -> None:
    """A study, unless it is there."""
    if not (place / "verification.nc").exists():
        file = ROOT / "jobs" / "linkages" / f"{name}.toml"
        words = [word for one in sets for word in ("--set", one)]
        subprocess.run(
            [sys.executable, "-m", "hpcclear", "run", file, "-o", place, *words], check=True
        )


def lines_of(place: Path) -> dict[str, str]:
    """What the first screen of a study says: headline, figures with their intervals, values of the design."""
    first = screen_of(read(place))
    assert first is not None
    values = ", ".join(f"{row.label.partition(',')[0]} = {row.cells[-1]}" for row in first.rows)
    shown = {"answer": first.headline, "doubt": first.doubt, "values": values}
    for tile in first.tiles:
        moved = f", {tile.change} from {tile.before}" if tile.change else ""
        shown[tile.label] = f"{tile.value} {tile.within}{moved}"
    return shown


def table_of(columns: dict[str, dict[str, str]]) -> list[tuple[str, ...]]:
    """Answers beside each other, by their headings."""
    labels = dict.fromkeys(label for one in columns.values() for label in one)
    rows = [(label, *(one.get(label, "") for one in columns.values())) for label in labels]
    return [("line", *columns), *rows]


def main(results: Path, *names: str) -> None:
    """Run what is missing, draw, record."""
    for name in names or re.findall(r"run jobs/linkages/(\w+)\.toml", PAGE.read_text()):
        run(name, results / name)
        scene = load_scene(ROOT / "jobs" / "linkages" / f"{name}.toml")
        picture = PAGE.parent.parent / "images" / "gallery" / f"{name}.png"
        picture.parent.mkdir(exist_ok=True)
        picture.write_bytes(render(sketch_figure(scene, poses_at_start(scene)), dpi=150))
        columns = {"answer": lines_of(results / name)}
        if name in LINES:
            place = results / f"{name}_line"
            lengths = (
                f"mechanism.joints.{joint}.length={length}" for joint, length in LINES[name].items()
            )
            run(name, place, "effects.contact.geometry=line", *lengths)
            columns = {"contact of a sphere": columns["answer"], "line contact": lines_of(place)}
        record(f"gallery_{name}", table_of(columns))


if __name__ == "__main__":
    place, *names = sys.argv[1:] or [ROOT / "results" / "gallery"]
    main(Path(place), *names)
