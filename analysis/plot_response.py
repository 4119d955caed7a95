"""Draw everything this field looks at in one response: motion, orbits, forces, phase space, spectrum, energies.

python analysis/plot_response.py results/response.nc -o results/figures
"""

from functools import partial

from drawing import figure_options, save_figures

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
    options = figure_options(__doc__, "response", "file written by hpcclear simulate")
    response = dataset.read(options.response, "response")
    save_figures({name: partial(draw, response) for name, draw in FIGURES.items()}, options)


if __name__ == "__main__":
    main()
