"""Simulate a scene at many values of an entry and draw the objective of every revolution as a bifurcation picture.

python analysis/plot_bifurcation.py jobs/slider_crank.toml -o results/bifurcation.png
python analysis/plot_bifurcation.py jobs/slider_crank.toml --path drive.speed --first "500 rpm" --last "6000 rpm"
"""

import argparse
from pathlib import Path

from hpcclear import load_scene, report, simulate
from hpcclear.ensemble.maps import axis


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", type=Path, help="scene file")
    parser.add_argument(
        "--path", help="dotted path to vary; by default the clearances of all joints"
    )
    parser.add_argument("--first", default="0.05 mm", help="smallest value, in SI or with a unit")
    parser.add_argument("--last", default="1 mm", help="largest value, likewise")
    parser.add_argument("--count", type=int, default=80, help="number of values")
    parser.add_argument("--transient", type=int, default=40, help="revolutions left out")
    parser.add_argument("--revolutions", type=int, default=40, help="revolutions drawn")
    parser.add_argument("-o", "--output", type=Path, default=Path("bifurcation.png"))
    options = parser.parse_args()
    scene = load_scene(options.scene).with_(
        {
            "study": None,
            "numerics.transient_revolutions": options.transient,
            "numerics.averaged_revolutions": options.revolutions,
        }
    )
    joints = [f"{scene.joint_key(joint)}.clearance" for joint in scene.clearance_joints()]
    paths = joints if options.path is None else [options.path]
    _, _, values = axis(scene, f"{paths[0]}={options.first}:{options.last}:{options.count}")
    responses = [simulate(scene.with_(dict.fromkeys(paths, float(value)))) for value in values]
    finished = [response for response in responses if int(response["status"]) == 0]
    if len(finished) < len(responses):
        print(
            f"{len(responses) - len(finished)} of {len(responses)} simulations failed, and are not drawn"
        )
    print(report.save(report.bifurcation_figure(finished, options.revolutions), options.output))


if __name__ == "__main__":
    main()
