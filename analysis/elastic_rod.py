"""A slider-crank whose rod is rigid, and bends: the picture in docs/how-to/elastic-rod.md, of the scene on that page.

python analysis/elastic_rod.py                    # writes docs/images/elastic_rod.png
"""

import argparse
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from scenes import of_page

from hpcclear import Scene, simulate

IMAGE = Path(__file__).parent.parent / "docs" / "images" / "elastic_rod.png"


def slider_crank() -> Scene:
    """The scene on the page, every step of a revolution in steady motion shown."""
    scene = of_page("how-to/elastic-rod.md", "flexible.toml")
    return scene.with_({"output.instants_per_revolution": 2000})


def draw(scene: Scene, path: Path) -> None:
    """Simulate both and save the picture."""
    scenes = {"bends": scene, "rigid": scene.with_({"mechanism.rod.bending": None})}
    figure, (deflection, force) = plt.subplots(2, 1, figsize=(8, 4.5), sharex=True)
    for name, colour in (("rigid", "grey"), ("bends", "C0")):
        response = simulate(scenes[name])
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
    figure.align_ylabels()
    figure.tight_layout()
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("-o", "--output", type=Path, default=IMAGE)
    draw(slider_crank(), parser.parse_args().output)
