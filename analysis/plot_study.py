"""Draw the paper's figures 5 to 10 from the directory that a study wrote.

python analysis/plot_study.py results/robust -o results/robust/figures
"""

import argparse
from pathlib import Path

from hpcclear import report
from hpcclear.base.errors import InputError
from hpcclear.results import dataset


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("directory", type=Path, help="what hpcclear run wrote")
    parser.add_argument("-o", "--output", type=Path, default=Path("figures"), help="directory")
    parser.add_argument("--format", choices=["png", "svg", "pdf"], default="png")
    options = parser.parse_args()
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
    options.output.mkdir(parents=True, exist_ok=True)
    for name, draw in figures.items():
        try:
            print(report.save(draw(), options.output / f"{name}.{options.format}"))
        except InputError as error:  # a small study has not all that a figure needs
            print(f"no {name}: {error}")


if __name__ == "__main__":
    main()
