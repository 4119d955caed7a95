"""Table 4 of a finished study, beside the paper's: python analysis/table4.py results/robust."""

import sys
from pathlib import Path

import numpy as np
import xarray as xr

from hpcclear.base.verdict import Verdict
from hpcclear.results import dataset

COLUMNS = {"m2": 1.0, "m3": 1.0, "u2": 1.0, "I2": 1e4}
"""Design variables and the power of ten that makes them readable."""


def main(directory: Path) -> None:
    """Print designs, true and predicted moments, the paper's values, claims and readings."""
    table = dataset.read(directory / "verification.nc", "verification").to_xarray()
    print(f"{'design':28}  m2 kg  m3 kg   u2 m  I2 1e-4 |    mean 1e-4 (95 % limits)  surrogate"
          "   paper | deviation 1e-5  surrogate")  # fmt: skip
    for one in (table.isel(design=k) for k in range(table.sizes["design"])):
        print(row(one))
    print("\nsurrogate:", table.attrs["remarks"])
    claims = dataset.read(directory / "claims.nc", "claims").to_xarray()
    for number, claim in enumerate(claims["text"].to_numpy()):
        print(f"\n{number + 1}. {claim}: {Verdict(int(claims['verdict'][number])).name}")
        print(f"   {claims['figure'].to_numpy()[number]}")
    if (directory / "readings.nc").exists():
        print("\nThe paper's designs, read so (distance of the means from the printed ones):")
        readings = dataset.read(directory / "readings.nc", "readings").to_xarray()
        for k in np.argsort(readings["distance"].to_numpy()):
            print(f"{float(readings['distance'][k]):8.2f}  {readings['reading'].to_numpy()[k]}")


def row(one: xr.Dataset) -> str:
    """One design as a line."""
    design = " ".join(f"{float(one[name]) * scale:7.4f}" for name, scale in COLUMNS.items())
    mean, low, high, guess, paper = (
        float(one[f"mean_{key}"]) * 1e4 for key in ("true", "lower", "upper", "surrogate", "paper")
    )
    spread, guessed = (float(one[f"deviation_{key}"]) * 1e5 for key in ("true", "surrogate"))
    printed = f"{paper:7.3f}" if np.isfinite(paper) else "      -"
    return (
        f"{one['design'].item():28} {design} | {mean:6.3f} ({low:.3f} to {high:.3f}) {guess:10.3f} "
        f"{printed} | {spread:14.2f} {guessed:10.2f}"
    )


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(Path(sys.argv[1]))
