"""What README and the start page of the documentation begin with: a film of a press, and a sentence of its study.

    python analysis/start_page.py

Simulates jobs/linkages/press.toml, films its last revolution into docs/images/press.gif, and fills the sentence of both pages
from analysis/results/gallery_press.csv, which `python analysis/gallery.py` measures.
"""

import csv
import re
from pathlib import Path

from recorded import RESULTS

ROOT = Path(__file__).parent.parent
PAGES = (ROOT / "README.md", ROOT / "docs" / "index.md")
FILM = ROOT / "docs" / "images" / "press.gif"
PLACE = re.compile(r"(?<=<!-- result -->).*?(?=<!-- end -->)", re.DOTALL)
"""Where the sentence stands on a page."""


def sentence() -> str:
    """What the study of the press answers, with the numbers of its file."""
    with (RESULTS / "gallery_press.csv").open(newline="", encoding="utf-8") as file:
        found = {label: text for label, text, *_ in csv.reader(file)}
    return (
        f"The [study of this press](PAGE): {found['answer'].partition(': ')[2]} with {found['values']}. "
        f"Mean gap f {found['mean of f']}; standard deviation {found['standard deviation of f']}."
    )


def filled(page: Path) -> str:
    """The text of a page with the sentence."""
    gallery = (ROOT / "docs" / "how-to" / "gallery.md").relative_to(page.parent)
    return PLACE.sub(
        lambda _: sentence().replace("PAGE", str(gallery)), page.read_text(encoding="utf-8")
    )


def main() -> None:
    """Film, and fill both pages."""
    from hpcclear import load_scene, simulate
    from hpcclear.report.figures.animation import animate
    from hpcclear.results.content import Results

    response = Results.of(simulate(load_scene(ROOT / "jobs" / "linkages" / "press.toml")))
    animate(response, FILM, 3.0, 1)
    for page in PAGES:
        page.write_text(filled(page), encoding="utf-8")


if __name__ == "__main__":
    main()
