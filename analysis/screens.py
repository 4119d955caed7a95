"""The first screen of every kind of page as pictures: 1280, 768 and 400 pixels wide, light, dark and printed; and its words.

    python analysis/screens.py                        # carries out what is missing in results/screens, pictures beside it
    python analysis/screens.py life map -o somewhere

A study, one without a feasible design, a response, service lives, a map, an identification: as commands of users make them, on
one rank. It takes minutes, and Chromium with its driver, as the browser tests do.
"""

import argparse
import base64
import subprocess
import sys
from pathlib import Path

from recorded import record
from scenes import ROOT

sys.path.insert(0, str(ROOT / "tests"))
from browser import Browser

from hpcclear import load_scene
from hpcclear.identify.made import write_made
from hpcclear.report.html.page import write_report

JOBS = ROOT / "jobs"
INFEASIBLE = """study.cases={
    robust = { random = ["C", "m2"], objectives = ["mean"], constraints = [{ statistic = "mean", most = "1 nm" }] } }
""".replace("\n", "")
MADE = {
    "quickstart": ["run", JOBS / "quickstart.toml"],
    "infeasible": ["run", JOBS / "quickstart.toml", "--set", INFEASIBLE],
    "response": ["simulate", JOBS / "quickstart.toml"],
    "life": ["wear", JOBS / "wear.toml", "--set", "wear.lives=6"],
    "map": ["map", JOBS / "quickstart.toml", "--x", "C=0.3mm:1mm:4", "--y", "m3=0.1:0.2:3"],
    "identification": [
        *("identify", JOBS / "identify.toml", "--signal", "january.csv", "--signal", "march.csv"),
        *("--unknown", "joints.crank_rod.clearance=10um:150um"),
        *("--date", "2026-01-10", "--date", "2026-03-12", "--limit", "100um"),
    ],
}
"""Commands, without where they write."""

CLEARANCES = {"january": 50e-6, "march": 60e-6}
"""Of the measured machine, as on the page that explains it."""

WORDS = """
return [...document.querySelectorAll("header, .tiles, #table, .trust")].map(e => e.innerText).join(" ").split(/\\s+/).length;
"""
"""Words of headline, figures, design and verdicts."""

ALL_WORDS = """
document.querySelectorAll("details").forEach(e => { e.open = true; });
return document.body.innerText.split(/\\s+/).filter(w => w).length;
"""


def made(name: str, place: Path) -> None:
    """Carry out the command of a screen, unless its results are there."""
    if list(place.glob("*.nc")):
        return
    place.mkdir(parents=True, exist_ok=True)
    if name == "identification":
        for record, clearance in CLEARANCES.items():
            machine = load_scene(JOBS / "identify.toml").with_(
                {"joints.crank_rod.clearance": clearance}
            )
            write_made(machine, place / f"{record}.csv", ["crank_moment"], noise=0.1)
    command = MADE[name]
    output = "." if command[0] == "run" else f"{name}.nc"
    words = [sys.executable, "-m", "hpcclear", *map(str, command), "-o", output]
    subprocess.run(words, cwd=place, check=True)


def pictures(browser: Browser, place: Path, folder: Path) -> tuple[int, int, int]:
    """Write a page and its pictures; words of its first screen and of all, and how high it is before what is folded."""
    page = write_report(place)
    for width in (1280, 768, 400):
        for scheme in ("light", "dark"):
            browser.open(page, width, scheme)
            shot = browser.command("Page.captureScreenshot", format="png")
            name = f"{place.name}-{width}-{scheme}.png"
            (folder / name).write_bytes(base64.b64decode(shot["data"]))
    browser.open(page, 1280)
    first = browser.run(WORDS)
    height = browser.run("return document.querySelector('.folds').getBoundingClientRect().top;")
    sheet = browser.command("Page.printToPDF", preferCSSPageSize=True)
    (folder / f"{place.name}-print.pdf").write_bytes(base64.b64decode(sheet["data"]))
    return first, browser.run(ALL_WORDS), round(height)


def main() -> None:
    """Carry out, show, count."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(MADE))
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "results" / "screens")
    options = parser.parse_args()
    for name in options.names or MADE:
        made(name, options.output / name)
    browser, rows = Browser(), [("page", "first screen", "whole page", "height")]
    try:
        for name in options.names or MADE:
            rows.append((name, *pictures(browser, options.output / name, options.output)))
            print(*rows[-1])
    finally:
        browser.close()
    if not options.names:
        record("screens", rows)


if __name__ == "__main__":
    main()
