"""Draw the paper's figures 5 to 10 from the directory that a study wrote.

python analysis/plot_study.py results/robust -o results/robust/figures
"""

from drawing import figure_options, save_figures

from hpcclear import report
from hpcclear.results import dataset


def main() -> None:
    options = figure_options(__doc__, "directory", "what hpcclear run wrote")
    place = options.directory
    sensitivity = dataset.read(place / "sensitivity.nc", "sensitivity")
    kriging = dataset.read(place / "kriging.nc", "kriging")
    front = dataset.read(place / "front.nc", "front")
    verification = dataset.read(place / "verification.nc", "verification")
    responses = {
        path.stem: dataset.read(path, "response") for path in (place / "responses").glob("*.nc")
    }
    figures = {
        "figure_5_surfaces": lambda: report.surfaces_figure(kriging),
        "figure_5_sensitivities": lambda: report.sensitivity_figure(sensitivity),
        "figure_6_and_8_surrogates": lambda: report.parity_figure(kriging),
        "figure_7_fit": lambda: report.fit_figure(sensitivity),
        "figure_9_fronts": lambda: report.front_figure(front, verification),
        "figure_10_responses": lambda: report.comparison_figure(responses),
    }
    save_figures(figures, options)  # a small study has not all that a figure needs


if __name__ == "__main__":
    main()
