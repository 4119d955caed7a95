"""The page of a report: complete, honest about what is missing, safe with hostile text, and usable in a browser."""

import base64
import hashlib
import json
import re
import shutil
import sys
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import opened
import pytest
import report_data as data
from browser import Browser

from hpcclear.base.errors import InputError
from hpcclear.report.html import picture
from hpcclear.report.html.content import read
from hpcclear.report.html.page import write_report


class Tree(HTMLParser):
    """Elements, balance of tags, and text outside scripts."""

    def __init__(self, page: str) -> None:
        super().__init__(convert_charrefs=True)
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self.content: dict[str, str] = {}
        self._open: list[str] = []
        self.feed(page)
        assert self._open == [], "elements left open"

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        assert len(dict(attrs)) == len(attrs), f"attribute twice in {tag}"
        if tag not in ("img", "input", "meta", "br", "hr"):
            self._open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop() == tag

    def handle_data(self, text: str) -> None:
        if self._open and self._open[-1] in ("script", "style"):
            kind, attrs = next(e for e in reversed(self.elements) if e[0] == self._open[-1])
            self.content[attrs.get("id") or kind] = text
        else:
            self.text += text


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_report(data.write_study(tmp_path_factory.mktemp("study")))


@pytest.fixture(scope="module")
def tree(page: Path) -> Tree:
    return Tree(page.read_text(encoding="utf-8"))


def test_the_page_is_one_file_that_asks_nothing_of_the_network(page: Path, tree: Tree) -> None:
    assert page.name == "report.html"
    for tag, attrs in tree.elements:
        for name in ("src", "href", "srcset", "action", "data", "poster"):
            value = attrs.get(name)
            assert value is None or value.startswith(
                ("#", "data:image/png;base64,", "data:text/plain;")
            ), (tag, value)
    assert not re.search(
        r"url\(|@import|fetch\(|XMLHttpRequest|import\(",
        tree.content["style"] + tree.content["script"],
    )


def test_only_the_pages_own_script_may_run(tree: Tree) -> None:
    policy = next(
        a["content"] for t, a in tree.elements if a.get("http-equiv") == "Content-Security-Policy"
    )
    digest = base64.b64encode(hashlib.sha256(tree.content["script"].encode()).digest()).decode()
    assert f"script-src 'sha256-{digest}'" in str(policy)
    assert "default-src 'none'" in str(policy)


def test_hostile_text_stays_text(page: Path, tree: Tree) -> None:
    raw = page.read_text(encoding="utf-8")
    for hostile in ("<script>window.hostile", "<img src=x", "<img src=y", "<i>x</i>"):
        assert hostile not in raw
    assert "<i>x</i>" in tree.text
    assert [t for t, _ in tree.elements].count("script") == 2
    assert not any(name.startswith("on") for _, attrs in tree.elements for name in attrs)


def test_structure_can_be_walked_without_eyes(tree: Tree) -> None:
    ids = [a["id"] for _, a in tree.elements if a.get("id")]
    assert len(set(ids)) == len(ids)
    for tag, attrs in tree.elements:
        if tag == "img":
            assert attrs["alt"]
        if "aria-labelledby" in attrs:
            assert attrs["aria-labelledby"] in ids
        if tag == "a" and "download" not in attrs:
            assert str(attrs["href"]).removeprefix("#") in ids
    assert [t for t, _ in tree.elements].count("h1") == 1
    assert [a for t, a in tree.elements if t == "html"] == [{"lang": "en"}]


def test_every_figure_leads_to_itself_enlarged_and_back(tree: Tree) -> None:
    figures = [a["id"] for tag, a in tree.elements if tag == "figure"]
    assert len(figures) == len(set(figures)) > 3
    links = [a for tag, a in tree.elements if tag == "a"]
    for figure in figures:
        (larger,) = [a for a in links if a["href"] == f"#{figure}"]
        assert [a["class"] for a in links if a["href"] == f"#{larger['id']}"] == ["close"]


def test_sampled_results_alone_make_a_report(tmp_path: Path) -> None:
    opened.write(data.samples(), tmp_path / "quickstart.nc")
    opened.write(data.timing(), tmp_path / "timing.nc")
    (tmp_path / "broken.nc").write_bytes(b"not a NetCDF file")
    tree = Tree(write_report(tmp_path, troubles=(left := [])).read_text(encoding="utf-8"))
    assert [t for t, _ in tree.elements].count("img") == 2
    assert [one.partition(" was")[0] for one in left] == ["broken.nc"]
    for kind in ("sensitivity", "kriging", "front", "verification", "accuracy"):
        assert f"{kind}.nc:" in tree.text
    assert "Not all files are here: broken.nc was left out" in tree.text
    assert "no animation" in tree.text


def test_one_response_makes_a_report(tmp_path: Path) -> None:
    opened.write(data.response(3), tmp_path / "mine.nc")
    tree = Tree(write_report(tmp_path).read_text(encoding="utf-8"))
    assert "Peak force" in tree.text
    assert "not available" not in tree.text  # that command lacks nothing
    assert list(json.loads(tree.content["content"])["motions"]) == ["mine"]


def test_all_samples_failed_is_reported(tmp_path: Path) -> None:
    opened.write(data.samples(20, failed=20), tmp_path / "samples.nc")
    tree = Tree(write_report(tmp_path).read_text(encoding="utf-8"))
    assert "Every simulation failed" in tree.text
    assert "20 of 20 samples step_cap" in tree.text
    assert "nan" not in tree.text.lower().replace("nanj", "")


@pytest.mark.parametrize("scene", ["[effects]\n", "[effects\n", "effects = 3\n"])
def test_a_scene_is_kept_whatever_it_is(tmp_path: Path, scene: str) -> None:
    opened.write(data.claims().assign_attrs(scene=scene), tmp_path / "claims.nc")
    tree = Tree(write_report(tmp_path).read_text(encoding="utf-8"))
    (link,) = [str(a["href"]) for tag, a in tree.elements if tag == "a" and "download" in a]
    assert base64.b64decode(link.partition("base64,")[2]).decode() == scene


def test_results_of_different_scenes_are_not_mixed_silently(tmp_path: Path) -> None:
    opened.write(data.samples(), tmp_path / "samples.nc")
    opened.write(data.claims().assign_attrs(scene_hash="1" * 64), tmp_path / "claims.nc")
    assert any("different scenes" in trouble for trouble in read(tmp_path).troubles)


def test_equal_results_give_equal_pages(tmp_path: Path) -> None:
    opened.write(data.samples(), tmp_path / "samples.nc")
    first = write_report(tmp_path).read_bytes()
    assert write_report(tmp_path).read_bytes() == first


def test_refusals(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match="no such directory"):
        write_report(tmp_path / "nowhere")
    with pytest.raises(InputError, match="no result file"):
        write_report(tmp_path)
    opened.write(data.samples(), tmp_path / "samples.nc")
    with pytest.raises(InputError, match=r"End the name in \.html"):
        write_report(tmp_path, output="page.txt")
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(InputError, match=r"pip install 'matplotlib>=3\.9'"):
        write_report(tmp_path)
    assert not (tmp_path / "report.html").exists()


def test_the_crank_is_found_from_the_motion() -> None:
    response = data.response(2, clearance=3e-4)
    rod = np.column_stack([response["rod_x"].to_numpy(), response["rod_y"].to_numpy()])
    angle, along = response["crank_angle"].to_numpy(), response["rod_angle"].to_numpy()
    crank = 0.05 * np.column_stack([np.cos(angle), np.sin(angle)])
    bearing = rod - 0.06 * np.column_stack([np.cos(along), np.sin(along)])
    response["eccentricity_x"][:, 0] = crank[:, 0] - bearing[:, 0]
    response["eccentricity_y"][:, 0] = crank[:, 1] - bearing[:, 1]
    points = np.array(picture.frames(response, response)["points"])
    np.testing.assert_allclose(np.hypot(points[:, 2], points[:, 3]), 0.05, rtol=1e-5)  # six digits


# -----------------------------------------------------------------------------------------------
# In a real browser


def _panel(browser: Browser) -> str:
    return str(browser.run("return document.getElementById('front-panel').innerText;"))


@pytest.mark.full
@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1280, 400])
def test_loads_cleanly_and_fits_the_screen(
    browser: Browser, page: Path, width: int, scheme: str
) -> None:
    browser.log()
    browser.open(page, width, scheme)
    browser.wait("document.querySelectorAll('#front .point').length > 2")
    assert browser.run("return document.querySelectorAll('#front path.hollow').length;") == 0
    assert browser.log() == []
    assert browser.run("return document.documentElement.scrollWidth;") <= width
    overflow = browser.run(
        "document.querySelectorAll('details').forEach(e => { e.open = true; });"
        "return [...document.querySelectorAll('body *')].filter(e => !e.closest('.scroll, pre, svg, .skip')"
        " && e.getBoundingClientRect().right > innerWidth + 1).map(e => e.outerHTML.slice(0, 80));"
    )
    assert overflow == []
    sideways = browser.run(
        "return [...document.querySelectorAll('.scroll, pre')].filter(e => e.scrollWidth > e.clientWidth + 1)"
        ".map(e => e.outerHTML.slice(0, 120));"
    )
    assert sideways == [] or width > 400
    assert browser.run("return window.hostile;") is None
    small = browser.run(
        "return [...document.querySelectorAll('p, td, th, dd, dt, li, a, figcaption, button, label')]"
        ".filter(e => e.innerText && parseFloat(getComputedStyle(e).fontSize) < 12).length;"
    )
    assert small == 0
    text = browser.run(
        "const s = document.querySelector('#front svg'), f = s.getBoundingClientRect().width /"
        " s.viewBox.baseVal.width; return f * parseFloat(getComputedStyle(s.querySelector('text')).fontSize);"
    )
    assert text >= 11.0


@pytest.mark.full
@pytest.mark.parametrize(("scheme", "dark"), [("light", False), ("dark", True)])
def test_both_schemes_are_followed(browser: Browser, page: Path, scheme: str, dark: bool) -> None:
    browser.open(page, 1280, scheme)
    back = browser.run("return getComputedStyle(document.documentElement).backgroundColor;")
    assert (max(map(int, re.findall(r"\d+", back)[:3])) < 60) == dark
    figure = browser.run("return getComputedStyle(document.querySelector('figure img')).filter;")
    assert ("invert" in figure) == dark  # figures are drawn on white


@pytest.mark.full
def test_a_warning_leads_to_its_place_by_keyboard(browser: Browser, page: Path) -> None:
    """The links of what to trust are reached by Tab, and open the fold that they lead to; `test_screens` reaches all else."""
    browser.open(page, 1280)
    browser.press("Tab", "Tab", "Tab")
    assert browser.run("return document.activeElement.closest('.trust') !== null;")
    browser.press("Enter")
    browser.wait("document.querySelector(location.hash).open")


@pytest.mark.full
def test_hover_shows_and_click_changes_the_panel(browser: Browser, page: Path) -> None:
    browser.open(page, 1280)
    browser.wait("document.querySelector('#front .point.selected')")
    browser.run("document.getElementById('front-more').open = true;")
    first = _panel(browser)
    assert "By simulation" in first
    assert browser.run("return document.querySelectorAll('#front-responses svg').length;") == 4
    stored = json.loads(browser.run("return document.getElementById('content').textContent;"))
    points = stored["front"]["points"]
    browser.run(
        "const s = document.getElementById('front-view'); s.value = 'all'; s.dispatchEvent(new Event('change'));"
    )
    assert browser.run("return document.querySelectorAll('#front .point').length;") == len(points)
    index = next(
        k for k, p in enumerate(points) if p["kind"] == "printed" and p["case"] == "robust"
    )
    browser.point(f"[data-index='{index}']", press=False)
    browser.wait("document.getElementById('front-panel').innerText.includes('robust paper alpha')")
    assert "By simulation" not in _panel(browser)
    browser.point("h1", press=False)
    assert _panel(browser) == first
    browser.point(f"[data-index='{index}']", press=True)
    browser.point("h1", press=False)
    assert "robust paper alpha" in _panel(browser)
    assert "No response was stored" in _panel(browser)
    assert browser.log() == []


@pytest.mark.full
def test_the_front_is_walked_by_keyboard(browser: Browser, page: Path) -> None:
    browser.open(page, 1280)
    browser.wait("document.querySelector('#front .point.selected')")
    browser.run("document.getElementById('front-more').open = true;")
    assert (
        browser.run("return document.querySelectorAll('#front .point[tabindex=\"0\"]').length;")
        == 1
    )
    for _ in range(40):
        browser.press("Tab")
        if browser.run("return document.activeElement.classList.contains('point');"):
            break
    here = "return Number(document.activeElement.dataset.index);"
    start, before = browser.run(here), _panel(browser)
    browser.press("ArrowRight", "ArrowRight", "ArrowRight", "ArrowLeft")
    assert browser.run(here) == start + 2
    assert _panel(browser) == before
    browser.press("Enter")
    assert _panel(browser) != before
    assert browser.run("return document.activeElement.getAttribute('aria-pressed');") == "true"
    assert browser.run("return Boolean(document.activeElement.getAttribute('aria-label'));")
    browser.press("Tab")
    assert not browser.run("return document.activeElement.classList.contains('point');")


@pytest.mark.full
def test_the_mechanism_moves_when_asked(browser: Browser, page: Path) -> None:
    browser.open(page, 1280)
    text = "return document.getElementById('motion-text').textContent;"
    rod = "return document.querySelectorAll('#mechanism polygon')[1].getAttribute('points');"
    still = browser.run(text)
    # reduced motion
    assert browser.run("return document.getElementById('motion-play').textContent;") == "Play"
    browser.run("document.getElementById('motion-play').focus();")
    browser.press("Enter")
    browser.wait(f"(() => {{ {text} }})() !== {json.dumps(still)}")
    browser.press("Enter")
    assert browser.run("return document.getElementById('motion-play').textContent;") == "Play"
    before = browser.run(rod)
    browser.run("document.getElementById('motion-gain').focus();")
    browser.press(*["ArrowRight"] * 10)
    assert browser.run(rod) != before
    browser.run(
        "const s = document.getElementById('motion-name'); s.value = 'robust beta';"
        "s.dispatchEvent(new Event('change'));"
    )
    assert browser.log() == []


@pytest.mark.full
def test_without_scripts_the_tables_remain(browser: Browser, page: Path, tmp_path: Path) -> None:
    copy = tmp_path / "report.html"
    shutil.copy(page, copy)
    browser.command("Emulation.setScriptExecutionDisabled", value=True)
    try:
        browser.open(copy, 1280)
        text: Any = browser.command("DOM.getDocument", depth=0)
        node = text["root"]["nodeId"]
        notes = browser.command(
            "DOM.querySelectorAll", nodeId=node, selector="noscript .note, noscript img"
        )
        assert len(notes["nodeIds"]) == 2
    finally:
        browser.command("Emulation.setScriptExecutionDisabled", value=False)
