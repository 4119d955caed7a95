"""Figures of responses (kind ``response``) over the crank angle, frequency and clearance, and of their energies."""

from typing import TYPE_CHECKING, Any

import numpy as np

from hpcclear.report.figures import labels, motion, style
from hpcclear.report.parts import FigureOf
from hpcclear.results.content import Results

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def _joints(axes: "Axes", response: Results, name: str, unit: labels.Scale) -> None:
    """One curve for each joint against the revolution of the crank."""
    for row, (joint, label) in enumerate(motion.joints(response).items()):
        values = response[name].sel(joint=joint).to_numpy() * unit.factor
        axes.plot(motion.turns(response), values, label=label, **_curve(row))


def _curve(row: int) -> dict[str, Any]:
    """Style of a joint's curve; later ones are thinner, since they lie on top."""
    return {"color": style.CYCLE[row % 7], "lw": max(0.8 - 0.2 * row, 0.4)}


@style.drawn
def response_figure(response: Results, revolutions: int = 2) -> "Figure":
    """Slider motion, where there is a slider, contact forces and torque of the drive over the last revolutions.

    Parameters
    ----------
    response : xarray.Dataset
        Kind ``response``.
    revolutions : int
        How many; fewer if the response has fewer.
    """
    shown = motion.latest(response, revolutions)
    every = (
        "slider_position",
        "slider_velocity",
        "slider_acceleration",
        "contact_force",
        "crank_moment",
    )
    names = [name for name in every if name in shown]
    figure, axes = style.grid(len(names), 1, 28.0 * len(names), sharex=True)
    for panel, name in zip(axes[:, 0], names, strict=True):
        word = "torque of\nthe drive" if name == "crank_moment" else name.replace("_", "\n")
        unit = labels.of(shown[name])
        if "joint" in shown[name].dims:
            _joints(panel, shown, name, unit)
            panel.set_ylim(top=1.35 * panel.get_ylim()[1])
            panel.legend(loc="upper right", ncols=2, borderaxespad=0.1)
        else:
            panel.plot(
                motion.turns(shown),
                shown[name].to_numpy() * unit.factor,
                color=style.PALETTE["blue"],
            )
        panel.set_ylabel(unit.label(word))
    axes[-1, 0].set_xlabel(motion.turns_label(shown))
    style.settle(axes, 4)
    figure.align_ylabels()
    return figure


@style.drawn
def penetration_figure(response: Results, revolutions: int = 2) -> "Figure":
    """Penetration of the joints over the last revolutions; parameters as for `response_figure`."""
    shown = motion.latest(response, revolutions)
    joints = motion.joints(shown)
    figure, axes = style.grid(len(joints), 1, 40.0 * len(joints), sharex=True, sharey=True)
    unit = labels.of(shown["penetration"])
    for row, (panel, joint) in enumerate(zip(axes[:, 0], joints, strict=True)):
        colour = style.CYCLE[row % 7]
        depth = shown["penetration"].sel(joint=joint).to_numpy() * unit.factor
        panel.fill_between(motion.turns(shown), depth, color=colour, alpha=0.35, lw=0.0)
        panel.plot(motion.turns(shown), depth, color=colour, lw=0.7)
        panel.set_title(f"{joints[joint]}: {motion.contact(shown, joint)}")
        panel.set_ylabel(unit.label("penetration"))
    axes[0, 0].set_ylim(
        bottom=0.0
    )  # after both are drawn: a limit ends the automatic scale of the axis they share
    axes[-1, 0].set_xlabel(motion.turns_label(shown))
    style.settle(axes)
    return figure


@style.drawn
def spectrum_figure(
    response: Results, revolutions: int | None = None, orders: float = 100.0
) -> "Figure":
    """Amplitude spectra of slider acceleration (linkage: torque of the drive) and contact forces over orders of the crank
    frequency.

    `orders`: right end of the axis, multiples of the crank frequency; else as for `bifurcation_figure`, of one response.
    """
    shown = motion.steady(response, revolutions)
    figure, axes = style.grid(2, 1, 90.0, sharex=True)
    first = "slider_acceleration" if "slider_acceleration" in shown else "crank_moment"
    unit = labels.of(shown[first])
    order, amplitude = motion.spectrum(shown, shown[first].to_numpy() * unit.factor)
    inside = (order > 0.0) & (order <= orders)
    axes[0, 0].semilogy(order[inside], amplitude[inside], color=style.PALETTE["blue"], lw=0.7)
    axes[0, 0].set_ylabel(unit.label(first.replace("_", " ")))
    unit = labels.of(shown["contact_force"])
    for row, (joint, label) in enumerate(motion.joints(shown).items()):
        force = shown["contact_force"].sel(joint=joint).to_numpy() * unit.factor
        _, amplitude = motion.spectrum(shown, force)
        axes[1, 0].semilogy(order[inside], amplitude[inside], label=label, **_curve(row))
    axes[1, 0].legend(loc="upper right", ncols=2)
    axes[1, 0].set_ylabel(unit.label("contact force"))
    axes[1, 0].set_xlabel("order (multiples of the crank frequency)")
    axes[0, 0].set_title("amplitudes")
    for panel in axes[:, 0]:
        highest = max(float(np.max(line.get_ydata())) for line in panel.lines)
        panel.set_ylim(1e-6 * highest, 3.0 * highest)  # what is below is the window's own
    style.settle(axes)
    return figure


@style.drawn
def energy_figure(response: Results) -> "Figure":
    """Energy balance: work of drive and loads and dissipated energy since the start, stored energy, and the residual.

    Of a dataset of kind ``response``.
    """
    figure, axes = style.grid(3, 1, 120.0, sharex=True, height_ratios=[1.2, 1.2, 0.8])
    turn = motion.turns(response)
    balances = (
        ("driving_work", "load_work", "dissipated_energy"),
        ("kinetic_energy", "elastic_energy", "potential_energy"),
    )
    kinds = ("exchanged", "stored")
    for panel, names, kind in zip(axes[:2, 0], balances, kinds, strict=True):
        present = [n for n in names if n in response and response[n].to_numpy().any()]
        unit = labels.scale("J", [float(abs(response[n].to_numpy()).max()) for n in present])
        for row, name in enumerate(present):
            values = response[name].to_numpy() * unit.factor
            label = name.replace("_", " ").removesuffix(" energy")
            panel.plot(turn, values, style.DASHES[row], color=style.CYCLE[row], lw=0.8, label=label)
        panel.set_ylabel(unit.label(f"energy {kind}"))
        if present:  # a response that failed at once has none
            place = {"bbox_to_anchor": (1.0, 0.98), "borderaxespad": 0.0}
            panel.legend(loc="lower right", ncols=len(present), **place)
    residual = abs(response["energy_residual"].to_numpy())
    unit = labels.scale("J", residual)
    axes[2, 0].plot(turn, residual * unit.factor, color=style.PALETTE["black"], lw=0.7)
    if (residual > 0.0).any():
        axes[2, 0].set_yscale("log")
        axes[2, 0].set_ylim(bottom=1e-5 * unit.factor * residual.max())
    axes[2, 0].set_ylabel(unit.label("|residual|"))
    axes[2, 0].set_xlabel(motion.turns_label(response))
    style.settle(axes)
    return figure


PARTS = (
    FigureOf("response", "penetration", penetration_figure, "penetration", 30),
    FigureOf("response", "spectrum", spectrum_figure, "spectra", 70),
    FigureOf("response", "energy", energy_figure, "energy balance", 90),
)
