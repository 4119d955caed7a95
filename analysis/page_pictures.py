"""Pictures on pages of docs/how-to, each of the scene that its page has readers write.

python analysis/page_pictures.py                            # all, into docs/images
python analysis/page_pictures.py stick-slip -o somewhere
"""

import argparse
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from scenes import ROOT, of_page

from hpcclear import simulate


def elastic_rod() -> Figure:
    """A slider-crank whose rod is rigid, and bends: every step of a revolution in steady motion."""
    scene = of_page("how-to/elastic-rod.md", "flexible.toml")
    scene = scene.with_({"output.instants_per_revolution": 2000})
    scenes = {"rigid": scene.with_({"mechanism.rod.bending": None}), "bends": scene}
    figure, (deflection, force) = plt.subplots(2, 1, figsize=(8, 4.5), sharex=True)
    for (name, chosen), colour in zip(scenes.items(), ("grey", "C0"), strict=True):
        response = simulate(chosen)
        turn = response["crank_angle"] / (2.0 * np.pi)
        shown = response.where(turn >= 3.0, drop=True)
        turn = shown["crank_angle"] / (2.0 * np.pi)
        pressed = 1e-3 * shown["contact_force"].sel(joint="rod_slider")
        force.plot(turn, pressed, color=colour, lw=1, label=name)
        if name == "bends":
            for mode, style in (("rod.1", "-"), ("rod.2", ":")):
                amplitude = 1e3 * shown["mode_amplitude"].sel(mode=mode)
                deflection.plot(turn, amplitude, style, color=colour, label=mode)
    deflection.set_ylabel("amplitude, mm")
    force.set_ylabel("force in the\nslider's pin, kN")
    force.set_xlabel("revolutions")
    for axes in (deflection, force):
        axes.legend(loc="upper right", fontsize="small")
    return figure


def stick_slip() -> Figure:
    """A pendulum on a turning shaft that sticks and slips."""
    scene = of_page("how-to/stick-slip.md", "pendulum.toml")
    response = simulate(scene.with_({"output.instants_per_revolution": 1000}))
    bob, time = response.sel(body="bob"), response["time"]
    with np.errstate(invalid="ignore"):  # in flight
        ratio = (response["friction_force"] / response["contact_force"]).isel(joint=0)
    figure, (angle, speed, force) = plt.subplots(3, 1, figsize=(8, 6), sharex=True)
    angle.plot(time, np.degrees(bob["body_angle"]) + 90.0)
    angle.set_ylabel("angle, degrees")
    speed.plot(time, response["crank_speed"], color="grey", lw=1, label="shaft")
    speed.plot(time, bob["body_spin"], label="pendulum")
    speed.set_ylabel("speed, rad/s")
    speed.legend(loc="lower left", fontsize="small")
    force.plot(time, ratio)
    friction = scene.effects.friction
    for level in (friction.coefficient, friction.static_coefficient):
        force.axhline(level, color="grey", lw=0.7, ls=":")
    force.set_ylabel("friction over\nnormal force")
    force.set_xlabel("time, s")
    return figure


PICTURES = {"elastic-rod": elastic_rod, "stick-slip": stick_slip}


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("page", nargs="?", choices=["all", *PICTURES], default="all")
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "docs" / "images")
    options = parser.parse_args()
    for name in PICTURES if options.page == "all" else [options.page]:
        figure = PICTURES[name]()
        figure.align_ylabels()
        figure.tight_layout()
        figure.savefig(options.output / f"{name.replace('-', '_')}.png", dpi=110)
