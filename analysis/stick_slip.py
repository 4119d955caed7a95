"""A pendulum on a turning shaft that sticks and slips: the picture in docs/how-to/stick-slip.md, of the scene on that page.

python analysis/stick_slip.py                    # writes docs/images/stick_slip.png
"""

import argparse
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from scenes import of_page

from hpcclear import Scene, simulate

IMAGE = Path(__file__).parent.parent / "docs" / "images" / "stick_slip.png"


def pendulum() -> Scene:
    """The scene on the page."""
    scene = of_page("how-to/stick-slip.md", "pendulum.toml")
    return scene.with_({"output.instants_per_revolution": 1000})


def draw(scene: Scene, path: Path) -> None:
    """Simulate it and save the picture."""
    response = simulate(scene)
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
    figure.align_ylabels()
    figure.tight_layout()
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("-o", "--output", type=Path, default=IMAGE)
    draw(pendulum(), parser.parse_args().output)
