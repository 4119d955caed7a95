"""Pages of every kind of result in a browser: first screen, accessibility by axe-core (WCAG A and AA), nothing sideways."""

import re
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple

import commands
import formula_study
import numpy as np
import opened
import pytest
import report_data as data
from browser import Browser, needed

from hpcclear.report.html.page import write_report
from hpcclear.report.sheet import write_sheet
from hpcclear.results.dataset import dataset

JOBS = Path(__file__).parents[1] / "jobs"
RULES = "{runOnly: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa']}"
WORDS, WHOLE = 180, 2050
"""Most words of a first screen, and of the page of a study unfolded."""
SHORT = ("numerics.transient_revolutions=2", "numerics.averaged_revolutions=2")
INFEASIBLE = """
[random]
m2 = { distribution = "uniform", half_width = 0.005 }
[cases.robust]
random = ["C", "m2"]
objectives = ["mean"]
constraints = [{ statistic = "mean", most = "1 nm" }]
"""


class Seen(NamedTuple):
    """What the page of a kind of result has."""

    shown: tuple[str, ...]
    """Selectors of what its first screen holds."""
    folds: tuple[str, ...]
    """Some of its subjects."""


STUDY = ("h1", ".tiles > div", ".first tbody tr", ".trust li")
KINDS = {
    "study": Seen(STUDY, ("designs", "sensitivities", "paper")),
    "infeasible": Seen((*STUDY, ".red", ".span"), ("designs",)),
    "response": Seen(STUDY, ("bearings",)),
    "life": Seen(STUDY, ("lives",)),
    "map": Seen(STUDY, ("reproduce",)),
    "identification": Seen(("h1", ".tiles > div", ".trust li"), ("identify",)),
}


def _identified() -> Any:
    """A clearance by two records of one signal."""
    random, middle = np.random.default_rng(1), np.array([3e-4, 3.4e-4])[:, None]
    low, high = np.full(1, 1e-4), np.full(1, 9e-4)
    values = {
        "unit": np.array(["m"]), "prior_lower": low, "prior_upper": high,
        "posterior": random.normal(middle[..., None], 4e-6, (2, 200, 1)),
        "interval": np.stack([0.97 * middle, middle, 1.03 * middle], axis=-1),
        "measured": random.normal(size=(2, 12)), "predicted": np.zeros((2, 12)),
        "predicted_deviation": np.ones((2, 12)), "worst_feature": np.ones(2, int),
        "explained": np.ones(2, np.int8), "coverage": np.full((2, 1), 0.95), "widening": np.ones((2, 1)),
        "correlation": np.zeros(2), "doubt": np.zeros(2), "input": np.array(["joints.crank_rod.clearance"]),
        "feature": np.array([f"order {k}" for k in range(12)]), "end": np.array(["lower", "median", "upper"]),
    }  # fmt: skip
    values["particle"] = np.arange(200)
    names = ("input", "feature", "end", "particle")
    coords = {"unknown": values["input"], "record": np.array(["1.csv", "2.csv"])}
    coords |= {name: values.pop(name) for name in names}
    return dataset("identify", coords, values, data.ATTRIBUTES, whole=False)


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory, carried_out: Any) -> dict[str, Path]:
    """A page of each kind: of real runs as far as these are short, made data of a whole study and of an identification."""
    root = tmp_path_factory.mktemp("pages")
    places = {kind: root / kind for kind in KINDS}
    for place in places.values():
        place.mkdir()
    data.write_study(places["study"])
    places["infeasible"] = carried_out(formula_study.scene_of(INFEASIBLE))
    opened.write(_identified(), places["identification"] / "identify.nc")
    short, quickstart = commands.overrides(*SHORT), JOBS / "quickstart.toml"
    for kind, *words in (
        ("response", "simulate", quickstart, *short),
        ("map", "map", quickstart, "--x", "C=0.3mm:1mm:2", "--y", "m3=0.1:0.2:2", *short),
        ("life", "wear", JOBS / "wear.toml", *commands.overrides("wear.lives=3"), *short),
    ):
        code, printed = commands.warm_command(*words, "-o", places[kind] / f"{kind}.nc")
        assert code == 0, printed
    return {kind: write_report(place) for kind, place in places.items()}


def test_the_headline_of_lives_names_their_limit(pages: dict[str, Path]) -> None:
    assert re.search(r"<h1>.* reach a clearance of 0\.5.mm ", pages["life"].read_text("utf-8"))


def unfold(browser: Browser) -> None:
    browser.run("document.querySelectorAll('details').forEach(e => { e.open = true; });")


def violations(browser: Browser) -> tuple[list[str], int]:
    """What axe-core finds on the page that is open, and how many rules found something to pass."""
    source = (resources.files("axe_core_python") / "axe.min.js").read_text(encoding="utf-8")
    browser.run(f"{source}; window.axe = axe;")
    browser.run(
        f"window.found = null; axe.run(document, {RULES}).then(f => {{ window.found = f; }});"
    )
    browser.wait("window.found")
    texts, passed = browser.run(
        "return [found.violations.flatMap(v => v.nodes.map(n => v.id + ': ' + n.html.slice(0, 120))), found.passes.length];"
    )
    return texts, passed


@needed
@pytest.mark.parametrize("kind", KINDS)
def test_the_first_screen_holds_all_and_nothing_scrolls_sideways(
    browser: Browser, pages: dict[str, Path], kind: str
) -> None:
    for width in (1280, 768, 400):
        browser.open(pages[kind], width)
        for selector in KINDS[kind].shown:
            ends = browser.run(
                f"return [...document.querySelectorAll({selector!r})].map(e => e.getBoundingClientRect().bottom);"
            )
            assert ends, selector
            assert width < 1280 or max(ends) <= 900, selector
        assert browser.run("return scrollY;") == 0
        if width == 1280:
            words = browser.run(
                "return [...document.querySelectorAll('header, .tiles, #table, .trust')].map(e => e.innerText).join(' ')"
                ".split(/\\s+/).length;"
            )
            assert 20 < words <= WORDS
        unfold(browser)
        assert browser.run("return document.documentElement.scrollWidth;") <= width
        if width == 1280:
            assert (
                200 < browser.run("return document.body.innerText.split(/\\s+/).length;") <= WHOLE
            )


@needed
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1280, 400])
@pytest.mark.shortened(6)
def test_no_page_violates_wcag_aa(
    browser: Browser, pages: dict[str, Path], kind: str, scheme: str, width: int
) -> None:
    browser.open(pages[kind], width, scheme)
    unfold(browser)
    found, passed = violations(browser)
    assert found == []
    assert passed > 10


@needed
def test_a_page_that_violates_it_is_found(browser: Browser, tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    page.write_text("<html><body><img src=''><p style='color: #aaa'>pale</p></body></html>")
    browser.open(page, 1280)
    found, _ = violations(browser)
    names = {text.partition(":")[0] for text in found}
    assert {"image-alt", "color-contrast", "html-has-lang"} <= names


@needed
@pytest.mark.parametrize("kind", KINDS)
def test_the_keyboard_reaches_all(browser: Browser, pages: dict[str, Path], kind: str) -> None:
    """Tab goes through every link, fold, control and scrolled part of the page, in its order."""
    browser.open(pages[kind], 1280)
    wanted = browser.run(
        "window.wanted = [...document.querySelectorAll('a[href], summary, button, select, input, [tabindex=\"0\"]')]"
        ".filter(e => e.checkVisibility() && e.getClientRects().length); return wanted.length;"
    )
    folds = browser.run("return [...document.querySelectorAll('.folds > details')].map(e => e.id);")
    assert set(KINDS[kind].folds) <= set(folds)
    reached = []
    for _ in range(wanted + 3):
        browser.press("Tab")
        reached.append(browser.run("return wanted.indexOf(document.activeElement);"))
    assert wanted > len(folds)
    assert set(range(wanted)) <= set(reached)


def test_the_sheet_of_a_real_infeasible_study_says_so(pages: dict[str, Path]) -> None:
    text = pages["infeasible"].read_text(encoding="utf-8")
    assert "No simulated design" in text
    assert ">nearest<" in text
    assert "Recommended design" not in text
    assert write_sheet(pages["infeasible"].parent).read_bytes().count(b"/Type /Page ") == 1
