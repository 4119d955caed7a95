"""Simulate a scene at many clearances and draw the objective of every revolution as a bifurcation picture.

python analysis/plot_bifurcation.py jobs/slider_crank.toml -o results/bifurcation.png
"""

import argparse
from pathlib import Path

import numpy as np

from hpcclear import load_scene, report, simulate


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", type=Path, help="scene file")
    parser.add_argument("--first", type=float, default=0.05e-3, help="smallest clearance, m")
    parser.add_argument("--last", type=float, default=1e-3, help="largest clearance, m")
    parser.add_argument("--count", type=int, default=80, help="number of clearances")
    parser.add_argument("--transient", type=int, default=40, help="revolutions left out")
    parser.add_argument("--revolutions", type=int, default=40, help="revolutions drawn")
    parser.add_argument("-o", "--output", type=Path, default=Path("bifurcation.png"))
    options = parser.parse_args()
    scene = load_scene(options.scene).with_(
        {
            "numerics.transient_revolutions": options.transient,
            "numerics.averaged_revolutions": options.revolutions,
        }
    )
    joints = [f"joints.{joint}.clearance" for joint in scene.clearance_joints()]
    clearances = np.linspace(options.first, options.last, options.count)
    responses = [simulate(scene.with_(dict.fromkeys(joints, float(c)))) for c in clearances]
    finished = [response for response in responses if int(response["status"]) == 0]
    print(report.save(report.bifurcation_figure(finished, options.revolutions), options.output))


if __name__ == "__main__":
    main()
