"""The sheet to be signed: it holds what the first screen says, on one page, and no text runs off it or over another."""

import itertools
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import opened
import pytest
import report_data as data
from matplotlib.backends.backend_agg import FigureCanvasAgg

from hpcclear import load_scene
from hpcclear.base.verdict import Verdict
from hpcclear.report import sheet as sheets
from hpcclear.report.figures import style
from hpcclear.report.html.content import read
from hpcclear.report.html.page import write_report
from hpcclear.report.screen import Level, Screen, ScreenRow, Span, Tile, Trust, trusted
from hpcclear.report.screens import screen_of
from hpcclear.report.sheet import SheetContent

QUICKSTART = Path(__file__).parents[1] / "jobs" / "quickstart.toml"

WORDS = (
    "Pleuelstange", "für", "größte", "Kräfte", "Lagerspiel", "W" * 90, "1\N{NO-BREAK SPACE}000", "\u6f22", "$x_1$", "a\tb",
)  # fmt: skip


def text_of(rng: np.random.Generator, words: int) -> str:
    return " ".join(rng.choice(WORDS, words))


def generated(seed: int, most: int) -> SheetContent:
    """A sheet of words that are long, with up to so many verdicts, columns and rows."""
    rng = np.random.default_rng(seed)

    def some(count: int) -> list[str]:
        return [text_of(rng, int(rng.integers(1, 12))) for _ in range(count)]

    count, columns = int(rng.integers(0, most + 1)), int(rng.integers(2, 9))
    header = ("design", "today", "better") if seed % 2 else tuple(some(columns))
    cells = len(header) - 1
    rows = [ScreenRow(one, tuple(some(cells)), Span(0.1, 0.0, "lower")) for one in some(count)]
    trust = [Trust(Level(int(rng.integers(0, 3))), one) for one in some(count)]
    tiles = [Tile(*some(5)) for _ in range(int(rng.integers(0, 9)))]
    first = Screen(
        *some(1),
        tuple(some(2)),
        *some(1),
        tuple(tiles),
        header,
        tuple(rows),
        *some(1),
        trusted(trust),
    )
    picture = np.zeros((int(rng.integers(20, 300)), int(rng.integers(20, 300))))
    figure, axes = style.grid(1, 1, 60.0)
    axes[0, 0].imshow(picture)
    png = style.render(figure, dpi=50)
    origin = zip(("machine", "author", "inputs", "software"), some(4), strict=True)
    return SheetContent(
        replace(first, title=text_of(rng, 14)), tuple(origin), tuple(some(3)), tuple(some(6)),
        tuple((png, one) for one in some(int(rng.integers(0, 3)))),
    )  # fmt: skip


def boxes(figure) -> list[tuple[str, np.ndarray]]:
    """Texts and pictures with their ends in mm: left, lower, right, upper."""
    renderer = FigureCanvasAgg(figure).get_renderer()
    every = [*figure.texts, *figure.axes]
    scale = 25.4 / figure.dpi
    return [
        (
            getattr(one, "get_text", lambda: "picture")(),
            scale * np.ravel(one.get_window_extent(renderer).get_points()),
        )
        for one in every
    ]


def check_laid_out(figure) -> None:
    """All within the margins, and none over another."""
    found = boxes(figure)
    for text, (left, low, right, high) in found:
        assert left >= 0.85 * sheets.MARGIN, text
        assert right <= sheets.WIDTH - 0.85 * sheets.MARGIN, text
        assert low >= 0.5 * sheets.MARGIN, text
        assert high <= sheets.HEIGHT - 0.85 * sheets.MARGIN, text
    for (one, a), (other, b) in itertools.combinations(found, 2):
        across = min(a[2], b[2]) - max(a[0], b[0])
        above = min(a[3], b[3]) - max(a[1], b[1])
        assert min(across, above) < 0.3, (one, other)


@pytest.mark.parametrize("most", [3, 40])
@pytest.mark.parametrize("seed", range(6))
@pytest.mark.shortened(2)
def test_no_text_runs_off_the_sheet_or_over_another(seed: int, most: int) -> None:
    check_laid_out(sheets.draw(generated(seed, most)))


def written(directory: Path, kind: str) -> Path:
    """A directory with results of a kind."""
    if kind == "study":
        return data.write_study(directory)
    if kind == "infeasible study":
        one = data.verification()
        columns = data.constrained([Verdict.FAILS] * one.sizes["design"])
        lacking = {name: (("design", "constraint"), values) for name, values in columns.items()}
        opened.write(one.assign(lacking), directory / "verification.nc")
    elif kind == "response":
        opened.write(data.response(3), directory / "response.nc")
    elif kind == "failed samples":
        opened.write(data.samples(20, failed=20), directory / "samples.nc")
    else:
        opened.write(getattr(data, kind)(), directory / f"{kind}.nc")
    return directory


@pytest.mark.parametrize(
    "kind", ["study", "infeasible study", "response", "samples", "failed samples", "accuracy"]
)
def test_the_sheet_holds_what_the_first_screen_says(tmp_path: Path, monkeypatch, kind: str) -> None:
    drawn = []
    draw = sheets.draw
    monkeypatch.setattr(sheets, "draw", lambda sheet: drawn.append(draw(sheet)) or drawn[-1])
    place = written(tmp_path, kind)
    path = sheets.write_sheet(place)
    assert path.name == "sheet.pdf"
    content = path.read_bytes()
    assert content.startswith(b"%PDF")
    assert content.count(b"/Type /Page ") == 1
    assert sheets.write_sheet(place).read_bytes() == content
    said = " ".join(one.get_text() for one in drawn[0].texts).replace("\N{NO-BREAK SPACE}", " ")
    first = screen_of(read(place))
    assert first is not None
    for text in (
        first.headline,
        first.doubt,
        *(one.text for one in first.trust),
        *(one.value for one in first.tiles),
    ):
        assert " ".join(text.split()) in said
    assert "Signature" in said
    assert "0" * 64 in said
    check_laid_out(drawn[0])


ABOUT = {
    "title": "Verdichter K12",
    "author": "J. Müller",
    "revision": "B <2>",
    "machine": "K12, 0815",
}


def test_what_a_scene_is_about_stands_on_page_and_sheet(tmp_path: Path) -> None:
    scene = load_scene(QUICKSTART).with_({f"about.{key}": text for key, text in ABOUT.items()})
    one = data.samples().assign_attrs(scene.origin)
    opened.write(one, tmp_path / "samples.nc")
    page = write_report(tmp_path).read_text(encoding="utf-8")
    content = read(tmp_path)
    sheet = sheets.sheet_of(content, screen_of(content))
    texts = [one.get_text() for one in sheets.draw(sheet).texts]
    for text in ABOUT.values():
        assert text.replace("<", "&lt;").replace(">", "&gt;") in page
        assert any(text in line for line in texts)
    assert screen_of(content).title == ABOUT["title"]
    assert any("C uniform" in text for text in sheet.assumptions)
    opened.write(data.verification().assign_attrs(scene.origin), tmp_path / "verification.nc")
    limits = " ".join(sheets._limits(read(tmp_path)))
    assert "within m2 0.105 to 0.42 kg; m3 0.07 to 0.28 kg; u2 0 to 120 mm; I2_ratio 1" in limits
    content = SimpleNamespace(scene=load_scene(QUICKSTART.with_name("tolerances.toml")))
    assert "m3 uniform, -0.01 to 0.01 of the design." in " ".join(sheets._assumptions(content))
