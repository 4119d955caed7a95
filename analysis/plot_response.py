"""Draw everything this field looks at in one response: motion, orbits, forces, phase space, spectrum, energies.

python analysis/plot_response.py results/response.nc -o results/figures
"""

import argparse
from pathlib import Path

from hpcclear import report
from hpcclear.results import dataset

FIGURES = {
    "response": report.response_figure,
    "orbit": report.orbit_figure,
    "force_polar": report.force_polar_figure,
    "penetration": report.penetration_figure,
    "phase": report.phase_figure,
    "poincare": report.poincare_figure,
    "spectrum": report.spectrum_figure,
    "energy": report.energy_figure,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("response", type=Path, help="file written by hpcclear simulate")
    parser.add_argument("-o", "--output", type=Path, default=Path("figures"), help="directory")
    parser.add_argument("--format", choices=["png", "svg", "pdf"], default="png")
    options = parser.parse_args()
    response = dataset.read(options.response, "response")
    options.output.mkdir(parents=True, exist_ok=True)
    for name, draw in FIGURES.items():
        print(report.save(draw(response), options.output / f"{name}.{options.format}"))


if __name__ == "__main__":
    main()
