"""Figures for print: every figure in every format and theme at sizes that a journal may want, and what users say of them."""

import io
import re
import zlib

import numpy as np
import opened
import pytest
import report_data as data
from click.testing import CliRunner
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from PIL import Image
from test_figures import FIGURES, texts
from test_plot import cells

from hpcclear import report
from hpcclear.base.errors import InputError
from hpcclear.cli import cli
from hpcclear.report.figures import style
from hpcclear.report.figures.printing import printing
from hpcclear.report.figures.theme import THEMES
from hpcclear.results.dataset import dataset

MM = 25.4


def _wear() -> dict[str, np.ndarray]:
    """Plain arrays of the service lives of two joints."""
    cycle, growth = np.linspace(0.0, 1e7, 6), np.linspace(1e-4, 4e-4, 6)
    spread = np.array([0.6, 0.9, 1.0, 1.1, 1.4])
    depths = np.ones((5, 6, 2, 24)) * growth[None, :, None, None] * (1.2 + np.sin(np.arange(24)))
    return {
        "cycle": cycle,
        "joint": np.array(["crank_rod", "a joint with a long name"]),
        "angle": np.linspace(0.0, 6.0, 24),
        "quantile": np.array([0.05, 0.25, 0.5, 0.75, 0.95]),
        "clearance": np.ones((9, 6, 2)) * growth[:, None],
        "clearance_quantile": (spread[:, None] * growth)[..., None] * np.ones(2),
        "objective": np.ones((9, 6)) * growth,
        "objective_quantile": spread[:, None] * growth,
        "bearing_profile": depths,
        "journal_profile": 0.5 * depths,
    }


def _identified() -> dict[str, np.ndarray]:
    """Plain arrays of two unknowns by three records."""
    random = np.random.default_rng(1)
    middle = np.array([3e-4, 3.4e-4, 3.9e-4])[:, None] * np.ones(2)
    return {
        "unknown": np.array(["joints.crank_rod.clearance", "effects.friction.coefficient"]),
        "unit": np.array(["m", "m"]),
        "record": np.array(["2026-01.csv", "2026-02.csv", "2026-03.csv"]),
        "prior_lower": np.full(2, 1e-4),
        "prior_upper": np.full(2, 9e-4),
        "posterior": random.normal(3.5e-4, 4e-5, (3, 200, 2)),
        "interval": np.stack([0.9 * middle, middle, 1.1 * middle], axis=-1),
        "measured": random.normal(size=(3, 12)),
        "predicted": np.zeros((3, 12)),
        "predicted_deviation": np.ones((3, 12)),
        "worst_feature": np.array([1, 2, 3]),
        "explained": np.ones(3, np.int8),
        "elapsed": 86400.0 * np.array([0.0, 31.0, 60.0]),
        "rate": np.ones((3, 2)) * 1e-11,
    }


def _effects() -> object:
    count = 4
    off = np.vstack([np.zeros(3), np.eye(3)]).astype("i1")
    names = ["clearance in crank_rod", "friction in joints", "load on the slider"]
    change = np.array([[0.0], [0.3], [-0.004], [0.02]])
    rows = {"change": change, "limit": np.full((count, 1), 0.01), "off": off}
    rows |= {"decision": np.array([0, 1, 0, 2], "i1"), "recommended": np.array([0, 0, 1, 0], "i1")}
    coords = {"variant": np.arange(count), "effect": names, "response": ["mean"]}
    attributes = {"tolerance": 0.01, "confidence": 0.95}
    work = {"work": np.array([1.0, 0.5, 0.9, 0.95])}
    return dataset("effects", coords, rows | work, attributes, whole=False)


def _two(name: str) -> Figure:
    """A figure of responses of two designs."""
    both = {"baseline": data.response(3), "light rod": data.response(3, clearance=2e-4)}
    figure: Figure = getattr(report, f"{name}_figure")(both)
    return figure


_OF_RESPONSES = ("response", "penetration", "energy", "orbit", "force_polar", "phase", "poincare")
ALL = {
    **FIGURES,
    "map, line": lambda: report.map_figure(cells(6)),
    "map, plane": lambda: report.map_figure(cells(4, 3)),
    "wear": lambda: report.fan_figure(_wear()),
    "wear, profile": lambda: report.profile_figure(_wear()),
    "effects": lambda: report.effects_figure(_effects()),
    **{
        name: lambda name=name: getattr(report, f"{name}_figure")(_identified())
        for name in ("posterior", "features", "growth")
    },
    **{f"two, {name}": lambda name=name: _two(name) for name in _OF_RESPONSES},
}
"""Every figure, by what makes it of made-up results."""


def _cut(figure: Figure) -> list[str]:
    """Texts that the border of a figure cuts."""
    page = figure.bbox.padded(0.5)
    boxes = ((text.get_text(), text.get_window_extent()) for text in texts(figure))
    return [
        words for words, box in boxes
        if not (page.x0 <= box.x0 and box.x1 <= page.x1 and page.y0 <= box.y0 and box.y1 <= page.y1)
    ]  # fmt: skip


def _widths(name: str, count: int) -> list[float]:
    """Widths from half a column to a page, mm, others for each figure and the same again."""
    return list(
        np.random.default_rng(zlib.crc32(name.encode())).uniform(45.0, 180.0, count).round()
    )


def _refused(figure: Figure, kind: str) -> str:
    """Why a figure is not written, "" if it is."""
    try:
        return "" if len(style.render(figure, kind, 100)) > 1000 else "it is empty"
    except InputError as error:
        return str(error)


def _printed(name: str, width: float, theme: str, kinds: tuple[str, ...]) -> None:
    """Draw, write, and look for what is cut; where labels do not fit, the size that the message names has room for them."""
    with printing(size=f"{width:.0f}mm", theme=theme):
        figure = ALL[name]()
    refused = {_refused(figure, kind) for kind in kinds}
    assert len(refused) == 1
    sides = [figure.get_figwidth() * MM, figure.get_figheight() * MM]
    assert sides[0] == pytest.approx(width)
    if message := refused.pop():
        found = re.search(r"Give (\d+)mm x (\d+)mm", message)
        assert found, message
        larger = [float(one) for one in found.groups()]
        assert larger > sides
        figure.set_size_inches(*(side / MM for side in larger))
        assert not _refused(figure, kinds[0])
    figure.draw_without_rendering()
    assert not _cut(figure)


@pytest.mark.parametrize("name", list(ALL)[::3])
def test_no_label_is_cut_at_a_generated_size(name):
    width, theme = _widths(name, 1)[0], ("light", "dark")[zlib.crc32(name.encode()) % 2]
    _printed(name, width, theme, ("png",))


@pytest.mark.nightly
@pytest.mark.parametrize("theme", THEMES)
@pytest.mark.parametrize("name", ALL)
def test_no_label_is_cut_in_any_format_and_theme(name, theme):
    for width in _widths(name, 4)[1:]:
        _printed(name, width, theme, ("png", "svg", "pdf"))


def test_a_size_is_that_of_the_file():
    with printing(size="60mm x 70mm"):
        figure = report.timing_figure(data.timing())
    picture = Image.open(io.BytesIO(style.render(figure, "png", 254)))
    assert picture.size == (600, 700)
    assert b'width="170.078' in style.render(figure, "svg")  # points


def test_a_theme_colours_page_and_text():
    with printing(theme="dark"):
        figure = report.response_figure(data.response())
    picture = Image.open(io.BytesIO(style.render(figure, "png", 60))).convert("RGB")
    paper = tuple(round(255 * one) for one in to_rgb("#14181d"))
    assert picture.getpixel((1, 1)) == paper
    assert max(to_rgb(figure.axes[0].yaxis.label.get_color())) > 0.8
    light = report.response_figure(data.response())
    assert light.axes[0].lines[0].get_color() != figure.axes[0].lines[0].get_color()
    assert min(to_rgb(light.axes[0].get_facecolor())) == 1.0


def test_a_style_sheet_says_size_font_and_colours(tmp_path):
    sheet = tmp_path / "mine.mplstyle"
    sheet.write_text(
        "font.size: 9\nfigure.figsize: 4, 3\naxes.prop_cycle: cycler(color=['123456'])\n"
    )
    with printing(sheet=sheet):
        figure = report.response_figure(data.response())
    assert figure.get_figwidth() == pytest.approx(4.0)
    assert figure.axes[0].yaxis.label.get_fontsize() == 9.0
    assert figure.axes[-1].get_xticklabels()[0].get_fontsize() == 9.0
    assert figure.axes[0].lines[0].get_color() == "#123456"
    with printing(sheet=sheet, size="50mm", font="DejaVu Serif"):
        narrow = report.timing_figure(data.timing())
    assert narrow.get_figwidth() == pytest.approx(50.0 / MM)
    assert narrow.axes[0].xaxis.label.get_fontfamily()[0] == "DejaVu Serif"


@pytest.mark.parametrize("name", ["m2", "rod mass $m_2$", "Rod_mass"])
def test_a_label_is_found_by_its_entry_and_by_its_words_and_keeps_its_unit(name):
    with printing(texts={name: "mass of the rod"}):
        figure = report.samples_figure(data.samples())
    words = [" ".join(one.xaxis.label.get_text().split()) for one in figure.axes]
    assert "mass of the rod (kg)" in words
    assert not [one for one in words if "m_2" in one]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--size", "85"], "no length with a unit"),
        (["--size", "wide"], "no length with a unit"),
        (["--size", "5 N"], "no length with a unit"),
        (["--size", "85mm x 60mm x 3mm"], "20 to 1000 mm"),
        (["--size", "3mm"], "20 to 1000 mm"),
        (["--size", "25mm"], "do not fit this size"),
        (["--font", "No Such Font"], "not installed"),
        (["--style", "none.mplstyle"], "no such file"),
        (["--label", "m9=mass"], "no axis of these figures is called so"),
        (["--label", "m2"], "names no words"),
        (["--theme", "red"], "not one of"),
        (["--design", "alpha"], "no such design"),
    ],
)
def test_what_cannot_be_printed_is_one_message_and_writes_nothing(tmp_path, options, words):
    opened.write(data.samples(), tmp_path / "s.nc")
    asked = ["plot", tmp_path / "s.nc", "--figure", "samples", "-o", tmp_path / "s.pdf", *options]
    done = CliRunner().invoke(cli, list(map(str, asked)))
    assert isinstance(done.exception, InputError) or done.exit_code == 2
    assert words in f"{done.exception} {done.output}"
    assert not (tmp_path / "s.pdf").exists()


def test_a_style_sheet_with_an_unknown_line_is_one_message(tmp_path):
    sheet = tmp_path / "mine.mplstyle"
    sheet.write_text("font.size: 9\nfont.sice: 3\n")
    with pytest.raises(InputError, match=r"Bad key font\.sice.*line 2"), printing(sheet=sheet):
        pass


# -- several designs, and what Python gives and takes -------------------------------------------


def test_files_of_several_designs_are_drawn_beside_each_other(tmp_path):
    for name in "ab":
        (tmp_path / name).mkdir()
        opened.write(data.response(), tmp_path / name / "response.nc")
    words = ["plot", *(tmp_path / name / "response.nc" for name in "ab"), "--format", "svg"]
    done = CliRunner().invoke(cli, list(map(str, [*words, "-o", tmp_path / "figures"])))
    assert done.exit_code == 0, done.exception
    assert {"response", "orbit", "energy"} <= {one.stem for one in (tmp_path / "figures").iterdir()}
    orbit = _two("orbit")
    assert [one.get_title(loc="left").split("\n")[0] for one in orbit.axes[:2]] == [
        "baseline",
        "light rod",
    ]
    assert orbit.axes[0].get_xlim() == orbit.axes[1].get_xlim()  # the same scale
    force = _two("response").axes[0]
    assert len(force.lines) == 2


def test_figures_take_axes_of_the_caller_and_plain_arrays():
    page = Figure()
    axes = page.subplots(2, 2)
    whole = data.response(3)
    arrays = {name: whole[name].to_numpy() for name in (*whole.data_vars, *whole.coords)}
    assert report.orbit_figure(arrays, ax=axes[:, 0]) is page
    report.penetration_figure(arrays, ax=axes[:, 1])
    assert [bool(one.lines) for one in page.axes[:4]] == [True] * 4
    own = report.poincare_figure(arrays, ax=Figure().subplots(1, 3))
    assert own.axes[0].get_xlabel() == "slider position (mm)"
    with pytest.raises(InputError, match="not those of a response"):
        report.orbit_figure({"penetration": np.zeros((5, 2)), "time": np.zeros(4)})
    with pytest.raises(InputError, match="'eccentricity_x' is needed"):
        report.orbit_figure({name: arrays[name] for name in ("time", "penetration", "crank_angle")})
    with pytest.raises(InputError, match="has 3 panels"):
        report.poincare_figure(arrays, ax=Figure().subplots())
