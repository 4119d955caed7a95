"""Figures of one response (kind ``response``) without a time axis: orbits, forces by direction, phase space."""

from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from hpcclear.base.arrays import Array, Booleans
from hpcclear.report.figures import labels, motion, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


_FLIGHT, _CONTACT = style.PALETTE["sky"], style.PALETTE["vermilion"]


@style.drawn
def orbit_figure(response: xr.Dataset, revolutions: int | None = None) -> "Figure":
    """Orbit of the journal centres in the clearance circle, contact told from free flight.

    Parameters
    ----------
    response : xarray.Dataset
        Kind ``response``.
    revolutions : int, optional
        The last ones are drawn; half of all by default.
    """
    shown = motion.steady(response, revolutions)
    figure, axes = style.grid(2, 1, 170.0)
    unit = labels.scale("m", motion.eccentricity(shown))
    clearances = motion.clearances(shown) * unit.factor
    for row, (joint, panel) in enumerate(zip(style.JOINT_NAMES, axes[:, 0], strict=True)):
        x, y = (shown[f"eccentricity_{c}"].sel(joint=joint).to_numpy() * unit.factor for c in "xy")
        contact = shown["penetration"].sel(joint=joint).to_numpy() > 0.0
        panel.plot(x, y, color=_FLIGHT, lw=0.7, label="free flight")
        panel.plot(*_only(x, y, contact), color=_CONTACT, lw=0.7, label="contact")
        _circle(panel, clearances[row])
        _arcs(panel, clearances[row], x, y, contact)
        panel.set_title(f"{style.JOINT_NAMES[joint]}: in contact {contact.mean():.0%} of the time")
        _equal(panel, unit)
    handles, words = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, words, loc="outside lower center", ncols=2)
    style.settle(axes)
    return figure


@style.drawn
def force_polar_figure(response: xr.Dataset, revolutions: int | None = None) -> "Figure":
    """Contact force over its direction in the fixed frame; parameters as for `orbit_figure`."""
    shown = motion.steady(response, revolutions)
    figure, axes = style.grid(2, 1, 165.0, subplot_kw={"projection": "polar"})
    force = labels.of(shown["contact_force"])
    turn = motion.turns(shown)
    for joint, panel in zip(style.JOINT_NAMES, axes[:, 0], strict=True):
        x, y = (shown[f"eccentricity_{c}"].sel(joint=joint).to_numpy() for c in "xy")
        radius = shown["contact_force"].sel(joint=joint).to_numpy() * force.factor
        contact = radius > 0.0
        colour = np.mod(turn, 1.0)[contact] * 360.0
        options: dict[str, Any] = {"cmap": _cyclic(), "vmin": 0.0, "vmax": 360.0, "linewidths": 0}
        drawn = panel.scatter(
            np.arctan2(y, x)[contact], radius[contact], c=colour, s=3.0, **options
        )
        panel.set_title(style.JOINT_NAMES[joint])
        panel.set_rlabel_position(112.5)
        panel.set_ylabel(force.label("contact force"), labelpad=22.0)
        panel.set_xlabel("direction of the force on the bearing (°)")
    bar = figure.colorbar(
        drawn, ax=axes[:, 0].tolist(), location="bottom", aspect=40, pad=0.02, shrink=0.8
    )
    bar.set_label("crank angle (°)")
    bar.set_ticks([0, 90, 180, 270, 360])
    style.settle([*axes[:, 0], bar.ax])
    return figure


@style.drawn
def phase_figure(response: xr.Dataset, revolutions: int | None = None) -> "Figure":
    """Phase portraits of the slider: velocity over position, acceleration over velocity.

    Parameters as for `orbit_figure`.
    """
    from matplotlib.collections import LineCollection

    shown = motion.steady(response, revolutions)
    figure, axes = style.grid(2, 1, 125.0)
    pairs = (("slider_position", "slider_velocity"), ("slider_velocity", "slider_acceleration"))
    turn = motion.turns(shown)
    for panel, names in zip(axes[:, 0], pairs, strict=True):
        x, y = (labels.of(shown[name]) for name in names)
        points = np.column_stack(
            [shown[n].to_numpy() * u.factor for n, u in zip(names, (x, y), strict=True)]
        )
        parts = np.stack([points[:-1], points[1:]], axis=1)
        line = LineCollection(list(parts), array=turn[1:], cmap=style.COLOURS, linewidths=0.6)
        panel.add_collection(line)
        panel.autoscale_view()
        panel.set_xlabel(x.label(labels.words(shown[names[0]])))
        panel.set_ylabel(y.label(labels.words(shown[names[1]])))
    bar = figure.colorbar(line, ax=axes[:, 0].tolist(), location="bottom", aspect=50, pad=0.02)
    bar.set_label("crank angle (revolutions)")
    style.settle([*axes[:, 0], bar.ax])
    return figure


@style.drawn
def poincare_figure(
    response: xr.Dataset, phase: float = 0.0, revolutions: int | None = None
) -> "Figure":
    """Poincaré section: slider and journal centres once a revolution, at one crank angle.

    A periodic motion is one point, a motion of period n is n points, anything else a cloud; the more revolutions
    the response has, the more it says.

    Parameters
    ----------
    response : xarray.Dataset
        Kind ``response``.
    phase : float
        Crank angle of the section, rad.
    revolutions : int, optional
        The last ones are used; half of all by default.
    """
    shown = motion.steady(response, revolutions)
    figure = style.page(118.0)
    cells = figure.add_gridspec(2, 2, height_ratios=[1.1, 1.0])
    top = figure.add_subplot(cells[0, :])
    x, y = labels.of(shown["slider_position"]), labels.of(shown["slider_velocity"])
    position = motion.section(shown, "slider_position", phase) * x.factor
    velocity = motion.section(shown, "slider_velocity", phase) * y.factor
    order = np.arange(1, len(position) + 1)
    options: dict[str, Any] = {
        "c": order,
        "cmap": style.COLOURS,
        "s": 10.0,
        "linewidths": 0,
        "zorder": 3,
    }
    drawn = top.scatter(position, velocity, **options)
    top.set_xlabel(x.label("slider position"))
    top.set_ylabel(y.label("slider velocity"))
    top.set_title(f"{len(order)} crossings of crank angle {np.degrees(phase):g}°")
    unit = labels.scale("m", motion.eccentricity(shown))
    clearances = motion.clearances(shown) * unit.factor
    across, up = (motion.section(shown, f"eccentricity_{c}", phase) * unit.factor for c in "xy")
    panels = [figure.add_subplot(cells[1, joint]) for joint in range(2)]
    reach = 1.08 * np.nanmax([*clearances, *np.abs(np.ravel([across, up]))])
    for joint, panel in enumerate(panels):
        panel.scatter(across[:, joint], up[:, joint], **options)
        _circle(panel, clearances[joint])
        panel.set_title(list(style.JOINT_NAMES.values())[joint])
        _equal(panel, unit, reach)
        panel.tick_params(labelleft=joint == 0)
    panels[1].set_ylabel("")
    top.ticklabel_format(useOffset=False)
    bar = figure.colorbar(drawn, ax=[top, *panels], location="bottom", aspect=50, pad=0.02)
    bar.set_label("crossing (number)")
    style.settle([top, *panels, bar.ax], 4)
    return figure


def _only(x: Array, y: Array, shown: Booleans) -> tuple[Array, Array]:
    """A line with gaps where it is not shown."""
    return np.where(shown, x, np.nan), np.where(shown, y, np.nan)


def _circle(axes: "Axes", radius: float) -> None:
    """The clearance circle; nothing for a joint without clearance."""
    if np.isfinite(radius):
        angle = np.linspace(0.0, 2.0 * np.pi, 361)
        axes.plot(
            radius * np.cos(angle), radius * np.sin(angle), "k--", lw=0.7, label="clearance circle"
        )


def _arcs(axes: "Axes", radius: float, x: Array, y: Array, contact: Booleans) -> None:
    """Where on the circle there was contact."""
    angle = np.arctan2(y, x)
    shown = _only(radius * np.cos(angle), radius * np.sin(angle), contact)
    axes.plot(*shown, color=style.PALETTE["black"], lw=2.4, label="contact arc")


def _cyclic() -> Any:
    """Colours for an angle: the ends meet, and none is as light as the page."""
    from matplotlib.colors import ListedColormap

    return ListedColormap(style.matplotlib().colormaps["twilight"](np.linspace(0.13, 0.87, 256)))


def _equal(axes: "Axes", unit: labels.Scale, reach: float | None = None) -> None:
    """Equal scales, the bearing centre in the middle."""
    if reach is None:
        reach = 1.05 * float(np.abs(axes.dataLim.get_points()).max())
    axes.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal")
    axes.set_xlabel(unit.label("eccentricity x"))
    axes.set_ylabel(unit.label("eccentricity y"))
