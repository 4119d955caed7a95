"""What the page's script draws: the front with its designs, responses, and the moving mechanism, as plain content."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from hpcclear.report.figures import labels, motion, moving, sketch
from hpcclear.report.html.content import Content
from hpcclear.report.merit import goals_of, leading_goals, recommended, role
from hpcclear.report.screens.study import simulated
from hpcclear.results.content import Results, text_in, texts_in

_WORDS = {"mean": "mean", "deviation": "standard deviation"}
_USUAL = tuple(f"{words} of f" for words in _WORDS.values())
_LEGEND = {"design": "simulated", "original": "baseline design", "printed": "design of the paper"}
FRAMES = 180  # of a revolution
POINTS = 720  # of a curve, about


def picture(content: Content) -> dict[str, Any]:
    """Everything the script needs; parts without data are empty."""
    return {
        "front": front(content),
        "responses": {name: series(one) for name, one in content.responses.items()},
        "motions": {
            name: frames(one, content.responses.get("original", one))
            for name, one in content.responses.items()
        },
    }


def front(content: Content) -> dict[str, Any]:
    """Axes and points of the interactive front: the designs that were simulated, where the simulation puts them.

    At first the axes are the two objectives of the case that the answer is about; where a case has others than mean and
    standard deviation of f, the reader may choose the axes. Points have no place along an axis that is no objective of their
    case."""
    verified = content.files.get("verification")
    if verified is None:
        return {"points": []}
    points = [_design(verified.isel(design=k)) for k in range(verified.sizes["design"])]
    points = [p for p in points if all(np.isfinite(p["goals"][word][1]) for word in _USUAL)]
    if not points:
        return {"points": []}
    asked = leading_goals(verified)
    axes = _placed(points, asked[:2] if len(asked) > 1 else _USUAL)
    points.sort(key=lambda point: [np.inf if point[k] is None else point[k] for k in "xy"])
    kinds = {point["kind"] for point in points}
    return {
        "x": axes[0],
        "y": axes[1],
        **({"axes": axes} if len(axes) > 2 else {}),
        "recommended": recommended(verified),
        "role": role(verified),
        "cases": sorted({point["case"] for point in points}),
        "points": points,
        "legend": {kind: text for kind, text in _LEGEND.items() if kind in kinds},
    }


def _placed(points: list[dict[str, Any]], leading: Sequence[str]) -> list[str]:
    """Labels of all axes, the leading two first; then points know where they are along each as ``at``, along the first two as
    ``x`` and ``y``, None where it is no objective of their case."""
    goals = [point.pop("goals") for point in points]
    units = {words: one[0] for own in goals for words, one in own.items()}
    names = list(dict.fromkeys([*(words for words in leading if words in units), *units]))
    known = {words: [own[words][1] for own in goals if words in own] for words in names}
    scales = {words: labels.scale(units[words], values) for words, values in known.items()}
    for point, own in zip(points, goals, strict=True):
        at: list[float | None] = []
        ends: list[list[float] | None] = []
        for words, scale in scales.items():
            _, *numbers = own.get(words, ("", np.nan, np.nan, np.nan))
            value, *both = (float(f"{one * scale.factor:.6g}") for one in numbers)
            at.append(value if np.isfinite(value) else None)
            ends.append(both if np.isfinite(both).all() else None)
        point["x"], point["y"] = at[:2]
        if any(ends):
            point["intervals"] = ends
        if len(names) > 2:
            point["at"] = at
    return [s.label(words) if s.unit != "–" else words for words, s in scales.items()]


Goal = tuple[str, float, float, float]
"""Unit and value of an objective, and the ends of its confidence interval, NaN where that is not known."""


def _goals(one: Results) -> dict[str, Goal]:
    """Mean and standard deviation of f, and objectives of the case, by simulation, by their words."""
    units = {name: str(one[f"{name}_true"].attrs["units"]) for name in _WORDS}
    every = dict(zip(_USUAL, units.items(), strict=True))
    for name in goals_of(one):
        every[text_in(one, f"{name}_goal")] = name, text_in(one, f"{name}_unit") or "1"
    return {words: (unit, *labels.estimate(one, name)) for words, (name, unit) in every.items()}


def _design(one: Results) -> dict[str, Any]:
    """A design that was simulated directly."""
    name, is_original = text_in(one, "design"), labels.is_baseline(one)
    return {
        "kind": "printed" if labels.is_printed(one) else "original" if is_original else "design",
        "name": name,
        "case": text_in(one, "case"),
        "design": _values(one),
        "surrogate": [
            [words, str(labels.value(one[f"{stem}_surrogate"]))] for stem, words in _WORDS.items()
        ],
        "direct": simulated(one),
        "response": "original" if is_original else name,
        "goals": _goals(one),
    }


def _values(one: Results) -> list[list[str]]:
    """Design variables with units; those the case does not have are left out."""
    rows = [(labels.words(v), labels.value(v)) for v in labels.design_variables(one)]
    return [[name, str(value)] for name, value in rows if value != "–"]


def series(response: Results) -> list[dict[str, object]]:
    """Curves of the last two revolutions: turns of the drive from 0, values in readable units."""
    shown = motion.latest(response, 2)
    every = max(1, shown.sizes["time"] // POINTS)
    shown = shown.isel(time=slice(None, None, every))
    turn = motion.turns(shown) - motion.turns(shown)[0]
    found = []
    for name, joint, word in motion.quantities(shown):
        one = shown[name].sel(joint=joint) if joint else shown[name]
        curve = {"x": _digits(turn), "y": _digits(np.nan_to_num(one.values))}
        found.append({"label": word, "unit": str(one.attrs["units"]), **curve})
    return found


def frames(response: Results, before: Results) -> dict[str, object]:
    """Bodies and joints by their points over two revolutions; which bodies differ from those of the response before."""
    shown = motion.latest(response, 2)
    every = max(1, int(shown.sizes["time"] / max(motion.whole_turns(shown), 1) / FRAMES))
    shown = shown.isel(time=slice(None, None, every))
    held = response.sel(joint=motion.pins(response))  # joints that are circles
    e = moving.eccentricities(shown.sel(joint=motion.pins(shown)))
    bodies, points, angles = moving.bodies(shown)
    still = np.ptp(points, axis=0).max(axis=-1) < 1e-9 * max(float(np.ptp(points)), 1e-12)
    names = ["crank", "rod", "slider"] if "rod_x" in shown else shown["body"].values.tolist()
    different = sketch.differences(response, before)
    return {
        "bodies": bodies,
        "changed": [k for k, name in enumerate(names) if name in different],
        "points": _digits(points.reshape(len(points), -1)),
        "angles": _digits(angles),
        "still": [bool(one) for one in still],
        "pairs": moving.pairs(points, e),
        "joints": texts_in(held, "joint"),
        "clearance": np.nan_to_num(motion.clearances(held)).tolist(),
        "turn": _digits(motion.turns(shown)),
        "e": _digits(e.reshape(len(e), -1)),
        "force": _digits(shown["contact_force"].sel(joint=motion.pins(shown)).values),
    }


def _digits(values: np.ndarray) -> object:
    """Numbers for the page: six digits."""
    flat = [float(f"{value:.6g}") for value in np.ravel(values)]
    return np.reshape(flat, np.shape(values)).tolist()
