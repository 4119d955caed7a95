"""Do the results of two commits have the same bytes? The quickstart's files and two responses, side by side.

    python analysis/same_bytes.py b7d070e            # that commit against this checkout, about four minutes
    python analysis/same_bytes.py b7d070e HEAD~3

Both run in this environment on two ranks. A line per file says "same" or how large the largest relative difference of a
variable is; exit code 1 if any file differs. timing.nc is what may differ between equal runs and is left out.
"""

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import xarray as xr

ROOT = Path(__file__).resolve().parent.parent
RESPONSES = ("slider_crank", "hunt_crossley")


def sources(commit: str | None, place: Path) -> Path:
    """A checkout of the commit, made below `place`; None: this one as it is."""
    if commit is None:
        return ROOT
    subprocess.run(["git", "clone", "--quiet", "--shared", ROOT, place], check=True)
    subprocess.run(["git", "checkout", "--quiet", commit], cwd=place, check=True)
    return place


def make(root: Path, out: Path) -> None:
    """Run the quickstart's study and the responses with the package below `root`."""
    environment = {**os.environ, "PYTHONPATH": str(root)}
    program = [sys.executable, "-m", "hpcclear"]
    jobs = root / "jobs"
    run = [
        "mpiexec",
        "-n",
        "2",
        *program,
        "run",
        str(jobs / "quickstart.toml"),
        "-o",
        str(out / "run"),
    ]
    commands = [run]
    for name in RESPONSES:
        commands.append(
            [*program, "simulate", str(jobs / f"{name}.toml"), "-o", str(out / f"{name}.nc")]
        )
    for command in commands:
        print("+", " ".join(command[-4:]), flush=True)
        subprocess.run(command, cwd=root, env=environment, check=True, stdout=subprocess.DEVNULL)


def difference(one: Path, other: Path) -> str:
    """What differs between two files, in words."""
    if one.read_bytes() == other.read_bytes():
        return "same"
    with xr.open_dataset(one) as a, xr.open_dataset(other) as b:
        found = [
            f"attribute {k}"
            for k in sorted({*a.attrs, *b.attrs})
            if a.attrs.get(k) != b.attrs.get(k)
        ]
        found += [f"only in one: {name}" for name in sorted(set(a.variables) ^ set(b.variables))]
        for name in sorted(set(a.variables) & set(b.variables)):
            if not a[name].identical(b[name]):
                found.append(f"{name}: {largest(a[name].to_numpy(), b[name].to_numpy())}")
    return "; ".join(found) or "layout of the file only"


def largest(a: np.ndarray, b: np.ndarray) -> str:
    """The largest relative difference, where there is one."""
    if a.shape != b.shape or a.dtype.kind not in "fiu" or b.dtype.kind not in "fiu":
        return "other content"
    if np.array_equal(a, b, equal_nan=True):
        return "other attributes"
    size = np.maximum(np.abs(a), np.abs(b))
    return f"{np.nanmax(np.abs(a - b) / np.where(size > 0, size, 1.0)):.1e}"


def main() -> int:
    """Compare; the exit code says whether all is the same."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("before", metavar="COMMIT")
    parser.add_argument(
        "after", metavar="COMMIT", nargs="?", help="this checkout as it is, if left out"
    )
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        for name, commit in (("before", asked.before), ("after", asked.after)):
            (place / name / "out").mkdir(parents=True)
            make(sources(commit, place / name / "source"), place / name / "out")
        one, other = place / "before" / "out", place / "after" / "out"
        names = sorted({p.relative_to(side) for side in (one, other) for p in side.rglob("*.nc")})
        good = True
        for name in names:
            if name.name == "timing.nc":
                continue
            both = (one / name).exists() and (other / name).exists()
            said = difference(one / name, other / name) if both else "on one side only"
            good &= said == "same"
            print(f"{name!s:40} {said}")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
