"""Draw what a design gave: objective, spread and failures against every design variable.

python analysis/plot_samples.py results/quickstart.nc -o results/quickstart.png
"""

import argparse
from pathlib import Path

from hpcclear import report
from hpcclear.results import dataset


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("samples", type=Path, help="file written by hpcclear sample")
    parser.add_argument(
        "-o", "--output", type=Path, help="png, svg or pdf; beside the file by default"
    )
    options = parser.parse_args()
    output = options.output or options.samples.with_suffix(".png")
    print(report.save(report.samples_figure(dataset.read(options.samples, "samples")), output))


if __name__ == "__main__":
    main()
