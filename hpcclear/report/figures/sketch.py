"""A drawing of the mechanism that a scene describes: to scale, with names, axes, the crank's angle and signs."""

import textwrap
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.report.figures import labels, linkage_sketch, style
from hpcclear.report.figures.linkage_sketch import arrow, word
from hpcclear.scene import Scene
from hpcclear.scene.mechanism import ClearanceJoint, Link, TorqueDrive

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ANGLE = np.radians(50.0)
"""Crank angle that is drawn."""

_DRAWING, _LINKAGE, _LINE = (
    38.0,
    75.0,
    3.7,
)  # mm of a drawing, of a linkage's, and of a line of the key
_COLUMNS = 58  # letters of a line
Pair = tuple[float, float]


@style.drawn
def sketch_figure(scene: Scene, poses: Mapping[str, linkage_sketch.Pose] | None = None) -> "Figure":
    """The mechanism at a crank angle of 50 degrees, a linkage at its start; and a key with every number's place.

    Lengths are to scale; clearances are not, since they would be invisible. `poses`: of a linkage, where its bodies are
    (`hpcclear.dynamics.planar.problem.poses_at_start`).
    """
    key = linkage_sketch.key(scene, poses) if poses is not None else _key(scene)
    lines = [part for line in key for part in textwrap.wrap(line, _COLUMNS)]
    drawing = _DRAWING if poses is None else _LINKAGE
    height = drawing + _LINE * len(lines)
    figure = style.page(height)
    figure.set_layout_engine("none")
    below = _LINE * len(lines) / height
    axes = figure.add_axes((0.0, below, 1.0, 1.0 - below))
    if poses is not None:
        linkage_sketch.draw(axes, scene, poses)
    else:
        _mechanism(axes, scene)
    text = "\n".join(labels.literal(line) for line in lines)
    figure.text(0.02, below, text, va="top", fontsize=style.SMALL, linespacing=1.35)
    return figure


def _mechanism(axes: "Axes", scene: Scene) -> None:
    crank, rod = scene.slider_crank.crank, scene.slider_crank.rod
    pin = crank.length * np.array([np.cos(ANGLE), np.sin(ANGLE)])
    slider = np.array([pin[0] + np.sqrt(rod.length**2 - pin[1] ** 2), 0.0])
    size = (
        0.35 * crank.length + 0.12 * rod.length
    )  # of arrows and the slider: lengths alone are to scale
    axes.plot(slider[0] + size * np.array([-1.2, 1.2]), [-0.42 * size] * 2, color="#888888", lw=2)
    box = 0.55 * size * np.array([-1, 1, 1, -1, -1]), 0.35 * size * np.array([-1, -1, 1, 1, -1])
    axes.fill(slider[0] + box[0], box[1], facecolor="white", edgecolor="black", lw=1.0, zorder=1)
    axes.plot([0.0], [0.0], "k^", ms=6.0, zorder=4)
    word(axes, (0.0, 0.0), "O", "black", (-9, -7))
    for end, name, offset in (((2.4, 0.0), "x", (6, 0)), ((0.0, 2.4), "y", (0, 6))):
        end = (end[0] * size, end[1] * size)
        arrow(axes, (0.0, 0.0), end, "#555555")
        word(axes, end, name, "#555555", offset)
    turn = np.linspace(0.0, ANGLE, 40)
    axes.plot(*0.55 * crank.length * np.array([np.cos(turn), np.sin(turn)]), color="black", lw=0.8)
    middle = 0.55 * crank.length * np.array([np.cos(0.5 * ANGLE), np.sin(0.5 * ANGLE)])
    word(axes, middle, r"$\varphi$", "black", (7, 2))
    _link(axes, np.zeros(2), pin, crank, style.CYCLE[1])
    _link(axes, pin, slider, rod, style.CYCLE[0])
    word(axes, 0.5 * pin, "crank", style.CYCLE[1], (-33, 3))
    word(axes, pin + 0.5 * (slider - pin), "rod", style.CYCLE[0], (4, 9))
    word(axes, slider - [0.0, 0.42 * size], "slider", "black", (0, -8))
    for place, joint, name in (
        (pin, scene.joints.crank_rod, "O12"),
        (slider, scene.joints.rod_slider, "O23"),
    ):
        axes.plot(*place, "o", color="black", ms=3.2, zorder=6)
        if isinstance(joint, ClearanceJoint):
            axes.plot(*place, "o", mfc="none", mec="black", mew=0.8, ms=8.5, zorder=6)
        word(axes, place, name, "black", (0, 14))
    _actions(axes, scene, slider, size)
    right = slider[0] + (3.0 if scene.effects.slider_load is not None else 1.6) * size
    axes.set(
        xlim=(-3.2 * size, right),
        ylim=(-3.2 * size, max(pin[1] + 2.2 * size, 3.3 * size)),
        aspect="equal",
    )
    axes.set_axis_off()


def _link(axes: "Axes", first: Array, second: Array, link: Link, colour: str) -> None:
    """A bar, and its mass centre on its line."""
    ends = np.transpose([first, second])
    axes.plot(*ends, color=colour, lw=3.0, solid_capstyle="round", zorder=2)
    centre = first + link.mass_center / link.length * (second - first)
    axes.plot(*centre, "o", color="white", mec="black", mew=0.8, ms=4.0, zorder=5)


def _actions(axes: "Axes", scene: Scene, slider: Array, size: float) -> None:
    """What acts on it, in its positive direction."""
    green = style.CYCLE[2]
    options: dict[str, Any] = {"arrowstyle": "->", "color": green, "lw": 1.1}
    options["connectionstyle"] = "arc3,rad=0.45"
    start, end = (-1.5 * size, -0.9 * size), (1.5 * size, -0.9 * size)
    axes.annotate("", end, start, arrowprops=options)
    word(axes, (0.0, -1.6 * size), r"$M,\ \dot\varphi$", green, (0, -10))
    if scene.effects.slider_load is not None:
        first = (slider[0] + 0.7 * size, slider[1])
        second = (slider[0] + 2.4 * size, slider[1])
        arrow(axes, first, second, green)
        word(axes, second, "$F$", green, (6, 0))
    if scene.effects.gravity > 0.0:
        first = (0.6 * slider[0], -0.9 * size)
        second = (0.6 * slider[0], -2.4 * size)
        arrow(axes, first, second, green)
        word(axes, second, "$g$", green, (8, 4))


def _key(scene: Scene) -> list[str]:
    """A line for each body, joint and action."""
    mechanism, effects = scene.slider_crank, scene.effects
    lines = ["\u03c6 from x to the crank, counter-clockwise; \u25cb mass centre"]
    for name in ("crank", "rod"):
        link = getattr(mechanism, name)
        lines.append(
            f"{name}: {_q(link.length, 'm')}, {_q(link.mass, 'kg')}, {_q(link.inertia, 'kg m^2')}, "
            f"mass centre at {_q(link.mass_center, 'm')}"
        )
    lines.append(f"slider: {_q(mechanism.slider.mass, 'kg')}")
    for name, label in style.JOINT_NAMES.items():
        joint = getattr(scene.joints, name)
        if isinstance(joint, ClearanceJoint):
            lines.append(
                f"{label}, {name}: radial clearance {_q(joint.clearance, 'm')}, "
                f"bearing R {_q(joint.bearing_radius, 'm')}"
            )
        else:
            lines.append(f"{label}, {name}: ideal, no clearance")
    drive = scene.drive
    if isinstance(drive, TorqueDrive):
        lines.append(f"crank: {_rpm(drive.initial_speed)} at the start, torque M")
    else:
        lines.append(f"crank: {_rpm(drive.speed)}, constant speed")
    if effects.slider_load is not None:
        lines.append(f"F on the slider, along x: {_range(effects.slider_load)}")
    if effects.gravity > 0.0:
        lines.append(f"gravity {effects.gravity:g} m/s², towards -y")
    return lines


def _rpm(speed: float) -> str:
    return f"{60.0 * speed / (2.0 * np.pi):.5g} rpm" if speed else "at rest"


def _range(curve: Any) -> str:
    if not isinstance(curve, tuple):
        return _q(curve, "N")
    values = [value for _, value in curve]
    return f"{_q(min(values), 'N')} to {_q(max(values), 'N')} by angle"


def _q(value: float, unit: str) -> str:
    return labels.quantity(value, unit)
