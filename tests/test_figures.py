"""Every figure is readable in print: axes labelled with units, 7 pt and more, nothing cut off or overlapping."""

import re
from collections.abc import Callable, Iterator
from itertools import combinations

import numpy as np
import pytest
import report_data as data
import xarray as xr
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.text import Text
from matplotlib.transforms import Bbox

from hpcclear import report
from hpcclear.report.figures import accuracy as accuracy_figures, labels, motion, style

DESIGNS = ("original", "deterministic alpha", "robust alpha", "deterministic beta", "robust beta")


def _odd_samples() -> xr.Dataset:
    """Design variables that are scene paths, one sample of two failed, no clearance."""
    made = data.samples(4, failed=2).rename(m2="effects_friction_coefficient", C="joints_gap")
    made = made.drop_vars(["m3", "u2", "I2"])
    made["effects_friction_coefficient"].attrs.update(
        scene_path="effects.friction.a_very_long_name_with_$igns_$.coefficient", units="1"
    )
    made["joints_gap"].attrs["scene_path"] = "mechanism.rod.length"
    return made


PLAIN = {
    data.samples: ("samples",),
    data.sensitivity: ("sensitivity", "fit", "sobol"),
    data.kriging: ("surfaces", "parity"),
    data.front: ("front",),
    data.response: (
        *("response", "penetration", "energy"),
        *("orbit", "force_polar", "phase", "poincare"),
    ),
    data.timing: ("timing",),
}
"""Figures of one dataset alone, by what makes it."""


def _loaded() -> xr.Dataset:
    """Every entry of the energy balance is there."""
    made = data.response()
    for name in ("load_work", "potential_energy"):
        made[name] = made[name].copy(data=made["kinetic_energy"].to_numpy())
    return made


def _many_stages() -> xr.Dataset:
    made = data.timing().isel(stage=[0, 1] * 15)
    return made.assign_coords(stage=[f"infill-{k}: simulations" for k in range(30)])


def _guided() -> xr.Dataset:
    """A linkage whose last body does not turn but slides along y."""
    made = data.response()
    names = {"x": "position", "y": "position", "vx": "velocity", "vy": "velocity"}
    gone = {f"body_{to}": 0.0 * made[f"slider_{of}"] for to, of in names.items()}
    still = {f"body_{word}": 0.0 * made["rod_angle"] for word in ("angle", "spin")}
    moved = {"body_y": made["slider_position"], "body_vy": made["slider_velocity"]}
    bodies = {name: one.expand_dims(body=["ram"], axis=1) for name, one in {**gone, **still, **moved}.items()}  # fmt: skip
    return made.drop_vars(["slider_position", "slider_velocity"]).assign(bodies)


def test_what_slides_is_drawn_by_its_place() -> None:
    place, speed = motion.followed(_guided())
    assert (labels.words(place), labels.words(speed)) == ("y of ram", "speed of ram")
    assert float(np.ptp(place.to_numpy())) > 0.09


def _ask(front: xr.Dataset, asked: dict[str, tuple[str, str]]) -> None:
    """Write goals of the first case and their units into a front."""
    for name, row in asked.items():
        for end, text in zip(("goal", "unit"), row, strict=True):
            front[f"searched_{name}_{end}"] = ("case", np.array([text, ""]))


def _other_goals() -> tuple[xr.Dataset, xr.Dataset]:
    """The first case asks for a quantile and a formula, the second for mean and deviation."""
    front, verified = data.front(), data.verification()
    _ask(front, {"first": ("95th percentile of f", "m"), "second": ("m2 + m3", "")})
    first = np.arange(2)[:, None, None] == 0
    for name, moment, value in (
        ("first", "mean", 1.5 * front["mean"]),
        ("second", "deviation", front["m2"] + front["m3"]),
    ):
        front[f"searched_{name}"] = value.where(first, front[moment])
        front[f"searched_{name}"].attrs = {}
    ours = verified["case"] == str(front["case"][0].item())
    for name, moment, value in (
        ("first", "mean", 1.5 * verified["mean_true"]),
        ("second", "deviation", verified["m2"] + verified["m3"]),
    ):
        verified[f"{name}_true"] = value.where(ours, verified[f"{moment}_true"])
        for end in ("lower", "upper"):
            verified[f"{name}_{end}"] = verified[f"{name}_true"]
    return front, verified


def _three_goals() -> tuple[xr.Dataset, xr.Dataset]:
    """The first case asks for three things, the least of the third where also the mean is least; the second for two."""
    front, verified = _other_goals()
    words = "((m2 - 0.21)/0.21)**2 + ((m3 - 0.14)/0.14)**2"
    moments = {"first": ("mean of f", "m"), "second": ("standard deviation of f", "m")}
    _ask(front, {**moments, "third": (words, "")})
    first = np.arange(2)[:, None, None] == 0
    far = (front["m2"] / 0.21 - 1) ** 2 + (front["m3"] / 0.14 - 1) ** 2
    for name, value in zip(
        ("first", "second", "third"),
        (front["mean"], front["deviation"], far.where(first)),
        strict=True,
    ):
        front[f"searched_{name}"] = value
        front[f"searched_{name}"].attrs = {}
    for name, moment in (("first", "mean_true"), ("second", "deviation_true")):
        verified[f"{name}_true"] = verified[moment]
    verified["third_true"] = (verified["m2"] / 0.21 - 1) ** 2 + (verified["m3"] / 0.14 - 1) ** 2
    for name in ("first", "second", "third"):
        for end in ("lower", "upper"):
            verified[f"{name}_{end}"] = verified[f"{name}_true"]
    names = [str(name) for name in verified["design"].to_numpy()]
    names[1] = f"{names[0].removesuffix('alpha')}gamma"
    again = verified.isel(design=[0, 0, *range(2, len(names))])  # gamma lies on alpha
    return front, again.assign_coords(design=names)


FIGURES: dict[str, Callable[[], Figure]] = {
    **{
        name: lambda make=make, name=name: getattr(report, f"{name}_figure")(make())  # type: ignore[misc]
        for make, names in PLAIN.items()
        for name in names
    },
    **{
        f"accuracy, {draw.__name__}": lambda draw=draw: draw(data.accuracy())  # type: ignore[misc]
        for draw in accuracy_figures.SHOWN
    },
    "samples, two variables": lambda: report.samples_figure(_odd_samples()),
    "samples, one variable": lambda: report.samples_figure(
        data.samples(failed=1).drop_vars(["m2", "m3", "u2", "I2"])
    ),
    "front, other goals": lambda: report.front_figure(*_other_goals()),
    "front, three goals": lambda: report.front_figure(*_three_goals()),
    "front, verified": lambda: report.front_figure(data.front(), data.verification()),
    "comparison": lambda: report.comparison_figure({name: data.response(2) for name in DESIGNS}),
    "comparison, one": lambda: report.comparison_figure({"mine": data.response(2)}),
    "energy, all entries": lambda: report.energy_figure(_loaded()),
    "phase, guided": lambda: report.phase_figure(_guided()),
    "timing, many stages": lambda: report.timing_figure(_many_stages()),
    "timing, one rank": lambda: report.timing_figure(data.timing(1)),
}


@pytest.fixture(scope="module", params=FIGURES)
def figure(request: pytest.FixtureRequest) -> Figure:
    made = FIGURES[request.param]()
    FigureCanvasAgg(made).draw()
    return made


def _drawn_ticks(axis: Axis) -> Iterator[Text]:
    """Tick labels that are on the page: inside the limits and switched on."""
    low, high = sorted(axis.get_view_interval())
    slack = 1e-9 * (high - low)
    for tick in (*axis.get_major_ticks(), *axis.get_minor_ticks()):
        if low - slack <= tick.get_loc() <= high + slack:
            yield from (label for label in (tick.label1, tick.label2) if label.get_visible())


def texts(figure: Figure) -> list[Text]:
    """Every piece of text that is drawn."""
    found = [*figure.texts, *([figure._suptitle] if figure._suptitle else [])]
    legends: list[Legend] = list(figure.legends)
    for axes in figure.axes:
        if axes.axison:
            found += [axes.title, axes._left_title, axes._right_title]
            found += axes.texts
            for axis in (axes.xaxis, axes.yaxis):
                found += [axis.label, axis.get_offset_text(), *_drawn_ticks(axis)]
        legends += [axes.get_legend()] if axes.get_legend() else []
    for legend in legends:
        found += [*legend.get_texts(), legend.get_title()]
    return [text for text in dict.fromkeys(found) if text.get_visible() and text.get_text().strip()]


def test_type_is_at_least_7_pt_at_one_column(figure: Figure) -> None:
    width = figure.get_figwidth() * 25.4
    sizes = {text.get_text(): text.get_fontsize() * 85.0 / width for text in texts(figure)}
    assert len(sizes) > 3
    assert min(sizes.values()) >= 7.0, min(sizes, key=sizes.__getitem__)


def test_text_lies_inside_the_page(figure: Figure) -> None:
    page = figure.bbox.padded(0.5)
    for text in texts(figure):
        box = text.get_window_extent()
        assert page.x0 <= box.x0 <= box.x1 <= page.x1, text
        assert page.y0 <= box.y0 <= box.y1 <= page.y1, text


def test_texts_do_not_overlap(figure: Figure) -> None:
    boxes = [(text.get_text(), text.get_window_extent()) for text in texts(figure)]
    for (first, a), (second, b) in combinations(boxes, 2):
        common = Bbox.intersection(a, b)
        if common is not None:
            assert min(common.width, common.height) < 2.0, (first, second)


def test_every_axis_has_a_label_with_its_unit(figure: Figure) -> None:
    checked = 0
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            if axes.axison and any(text.get_text() for text in _drawn_ticks(axis)):
                assert re.search(r"\(.+\)$", axis.get_label_text()), axis.get_label_text()
                checked += 1
    assert checked >= 2


CUT_ON_PURPOSE = {
    "energy": "a residual of a hundred-thousandth of the largest is round-off, on an axis of decades",
    "fit": "an R2 far below 0 or an error of twice the scatter says no more than that the fit failed",
}


def test_no_axis_cuts_its_data(request: pytest.FixtureRequest, figure: Figure) -> None:
    for axes in figure.axes:
        for line in axes.lines:
            if line.get_transform() != axes.transData:
                continue  # stands at a place of the panel, not of its data
            points = np.array([np.asarray(values, float) for values in line.get_data()])
            drawn = points[:, np.isfinite(points).all(axis=0)]
            for values, limits in zip(drawn, (axes.get_xlim(), axes.get_ylim()), strict=True):
                low, high = sorted(limits)
                slack = 1e-9 * (high - low)
                inside = (values >= low - slack) & (values <= high + slack)
                assert (
                    inside.all()
                    or request.node.callspec.params["figure"].partition(",")[0] in CUT_ON_PURPOSE
                )


def test_no_panel_is_empty(figure: Figure) -> None:
    for axes in figure.axes:
        assert not axes.axison or axes.has_data() or axes.get_label() == "<colorbar>"


def test_figures_are_bytewise_reproducible() -> None:
    for kind in ("png", "svg", "pdf"):
        first, second = (
            style.render(report.timing_figure(data.timing()), kind, 60) for _ in range(2)
        )
        assert first == second, kind


def test_the_users_settings_are_left_alone() -> None:
    import matplotlib

    with matplotlib.rc_context({"font.size": 3.0, "axes.facecolor": "red"}):
        made = report.timing_figure(data.timing())
        assert matplotlib.rcParams["font.size"] == 3.0
        assert made.axes[0].get_facecolor()[:3] == (1.0, 1.0, 1.0)


def test_objective_of_each_turn_is_the_time_mean() -> None:
    response = data.response(5, clearance=2e-4, instants=1000)
    # |e| - c is half a clearance for a tenth of the turn and a fifth for the rest, in both joints
    expected = np.sqrt(2.0) * 2e-4 * (0.1 * 0.5 + 0.9 * 0.2)
    np.testing.assert_allclose(motion.objective_by_turn(response)[:4], expected, rtol=1e-3)
    np.testing.assert_allclose(motion.clearances(response), 2e-4, rtol=1e-12)


def test_a_steady_response_that_starts_late_keeps_its_revolutions() -> None:
    late = motion.steady(data.response(6), 2)
    assert motion.whole_turns(late) == 2
    assert motion.whole_turns(motion.latest(late, 5)) == 2
    np.testing.assert_allclose(motion.section(late, "slider_position"), 0.17)
