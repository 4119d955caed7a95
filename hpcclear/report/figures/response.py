"""Figures of responses (kind ``response``) over the crank angle, frequency and clearance, and of their energies."""

from collections.abc import Mapping
from typing import cast

from hpcclear.report.figures import designs, labels, motion, style
from hpcclear.results.content import Results, texts_in


@style.drawn
def response_figure(responses: Results | Mapping[str, Results]) -> "style.Figure":
    """Slider motion, contact forces and drive torque over two revolutions; of several responses `comparison_figure`."""
    if every := style.several(responses):
        return designs.comparison_figure(every)
    shown = motion.latest(cast(Results, responses))
    moved = (f"slider_{word}" for word in ("position", "velocity", "acceleration"))
    names = [name for name in (*moved, "contact_force", "crank_moment") if name in shown]
    figure, axes = style.grid(len(names), 1, 28.0 * len(names), sharex=True)
    for panel, name in zip(axes[:, 0], names, strict=True):
        word = "torque of the drive" if name == "crank_moment" else name.replace("_", " ")
        unit = labels.of(shown[name])
        if "joint" in shown[name].dims:
            for row, joint in enumerate(texts_in(shown, "joint")):
                force, width = unit(shown[name].sel(joint=joint)), max(0.8 - 0.2 * row, 0.4)
                look: style.Look = {"color": style.colour(row), "lw": width}  # later ones on top
                panel.plot(motion.turns(shown), force, label=joint, **look)
            style.key(panel, "above", borderaxespad=0.1)
        else:
            panel.plot(motion.turns(shown), unit(shown[name]), color=style.colour("blue"))
        panel.set_ylabel(unit.label(word))
    axes[-1, 0].set_xlabel(motion.turns_label(shown))
    figure.align_ylabels()
    return figure


@style.figure("penetration", 30)
def penetration_figure(response: Results) -> "style.Figure":
    """Penetration of the joints over the last two revolutions of a response (kind ``response``)."""
    shown = motion.latest(response)
    joints = texts_in(shown, "joint")
    figure, axes = style.grid(len(joints), 1, 40.0 * len(joints), sharex=True, sharey=True)
    unit = labels.of(shown["penetration"])
    for row, (panel, joint) in enumerate(zip(axes[:, 0], joints, strict=True)):
        colour = style.colour(row)
        depth = unit(shown["penetration"].sel(joint=joint))
        panel.fill_between(motion.turns(shown), depth, color=colour, alpha=0.35, lw=0.0)
        panel.plot(motion.turns(shown), depth, color=colour, lw=0.7)
        panel.set_title(f"{joint}\n{motion.contact(shown, joint)}")
        panel.set_ylabel(unit.label("penetration"))
    axes[0, 0].set_ylim(bottom=0.0)  # at last, as a limit ends the automatic scale that they share
    axes[-1, 0].set_xlabel(motion.turns_label(shown))
    return figure


@style.figure("energy balance", 90)
def energy_figure(response: Results) -> "style.Figure":
    """Energy balance: work of drive and loads and dissipated energy since the start, stored energy, and the residual."""
    figure, axes = style.grid(3, 1, 120.0, sharex=True, height_ratios=[1.2, 1.2, 0.8])
    turn = motion.turns(response)
    balances = {
        "exchanged": ("driving_work", "load_work", "dissipated_energy"),
        "stored": ("kinetic_energy", "elastic_energy", "potential_energy"),
    }
    for panel, (kind, names) in zip(axes[:2, 0], balances.items(), strict=True):
        present = [n for n in names if n in response and response[n].values.any()]
        unit = labels.scale("J", [float(abs(response[n].values).max()) for n in present])
        for row, name in enumerate(present):
            label = name.replace("_", " ").removesuffix(" energy")
            look = {**style.look(row), "marker": ""}
            panel.plot(turn, unit(response[name]), lw=0.8, label=label, **look)
        panel.set_ylabel(unit.label(f"energy {kind}"))
        if present:  # a response that failed at once has none
            style.key(panel, "above", borderaxespad=0.1)
    residual = abs(response["energy_residual"].values)
    unit = labels.scale("J", residual)
    axes[2, 0].plot(turn, residual * unit.factor, color=style.colour("ink"), lw=0.7)
    if (residual > 0.0).any():
        axes[2, 0].set_yscale("log")
        axes[2, 0].set_ylim(bottom=1e-5 * unit.factor * residual.max())
    axes[2, 0].set_ylabel(unit.label("|residual|"))
    axes[2, 0].set_xlabel(motion.turns_label(response))
    return figure
