"""Do the results of two versions agree? In bytes, or, for regular motions, in the values of all variables.

    python analysis/same_bytes.py b7d070e                        # that commit against this checkout, about four minutes
    python analysis/same_bytes.py b7d070e HEAD~3
    python analysis/same_bytes.py 2e8158b --regular results/same # values of regular motions, about five minutes

A version is a commit or a directory with its source. All run in this environment.

Without `--regular` the quickstart and two responses run on two ranks, and files must have the same bytes. A line per file
says "same" or how large the largest relative difference of a variable is. timing.nc may differ and is left out.

With `--regular` a response, samples, a map, service lives and effect screening of a motion that repeats itself
run at rtol 1e-9, and variables must agree within `TOLERANCE`. Former names of variables must still be readable.
Exit code 1 if anything else differs.
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

TOLERANCE = 1e-9
"""Largest difference of two values of a regular motion at rtol 1e-9, relative to the largest value of the variable. Series are
interpolated between the ends of steps."""

ACCURATE = ("--set", "numerics.rtol=1e-9", "--set", "numerics.method=tsitouras")
DESIGNS = "m2 [kg], C [mm]\n0.21, 0.2\n0.21, 0.3\n0.15, 0.3\n0.3, 0.4\n"
REGULAR = {
    "response.nc": ("simulate", "hunt_crossley.toml", *ACCURATE),
    "samples.nc": ("sample", "hunt_crossley.toml", "--points", "designs.csv", *ACCURATE),
    "map.nc": ("map", "hunt_crossley.toml", "--x", "C=0.2mm:0.4mm:3"),
    "wear.nc": ("wear", "wear.toml", "--set", "wear.lives=2", "--set", "wear.cycles=1e5", *ACCURATE),
    "effects.nc": ("effects", "hunt_crossley.toml", "--samples", "64", "--set", "effects.gravity=9.81", *ACCURATE),
}  # fmt: skip
"""Commands of the regular motions, by the file that they write."""

INTENDED = {
    "rhs_evaluations": "a cost, not a result",
    "evaluations": "a cost, not a result",
    "work": "a cost, not a result",
    "energy_residual": "an error, not a result",
    "constraint_violation": "an error, not a result",
    "objective_uncertainty": "nine replicas instead of three",
    "objective_spread": "below the tolerance of the integration",
    "lyapunov_exponent": "an estimate with a half-width of its own",
    "lyapunov_exponent_limit": "a half-width",
    "objective_limit": "a half-width",
    "clearance_limit": "a half-width",
    "clearance_error": "an error, not a result",
    "effect": "play is called clearance",
}
"""Variables that may differ by more than the tolerance, with the reason."""


def sources(version: str | None, place: Path) -> Path:
    """The source of a version: a directory, or a commit that is checked out at `place`; None: this checkout as it is."""
    if version is None:
        return ROOT
    if Path(version).is_dir():
        return Path(version)
    subprocess.run(["git", "clone", "--quiet", "--shared", ROOT, place], check=True)
    subprocess.run(["git", "checkout", "--quiet", version], cwd=place, check=True)
    return place


def run(root: Path, words: list[str], ranks: int = 1) -> None:
    """Start a command of the package below `root`."""
    environment = {**os.environ, "PYTHONPATH": str(root)}
    start = ["mpiexec", "-n", str(ranks)] if ranks > 1 else []
    print("+", *words[-4:], flush=True)
    command = [*start, sys.executable, "-m", "hpcclear", *words]
    subprocess.run(command, cwd=root, env=environment, check=True, stdout=subprocess.DEVNULL)


def make(root: Path, out: Path) -> None:
    """Run the quickstart's study and the responses with the package below `root`."""
    run(root, ["run", str(root / "jobs" / "quickstart.toml"), "-o", str(out / "run")], 2)
    for name in RESPONSES:
        run(root, ["simulate", str(root / "jobs" / f"{name}.toml"), "-o", str(out / f"{name}.nc")])


def make_regular(root: Path, out: Path) -> None:
    """Run `REGULAR` with the scenes of this checkout; results that are there already are kept."""
    points = out / "designs.csv"
    points.write_text(DESIGNS)
    for name, (command, scene, *options) in REGULAR.items():
        if not (out / name).exists():
            words = [str(points) if word == points.name else word for word in options]
            run(root, [command, str(ROOT / "jobs" / scene), "-o", str(out / name), *words])


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


def values(one: Path, other: Path) -> bool:
    """Print how the variables of two files differ, a row of a table each; whether all agree that should."""
    good = True
    with xr.open_dataset(one) as a, xr.open_dataset(other) as b:
        a, b = damped(a), damped(b)
        for name in map(str, a.variables):
            former = str(a[name].attrs.get("long_name", ""))
            if name not in b.variables and former.startswith("deprecated"):
                text = f"left out: {former}"
            elif name not in b.variables:
                good, text = False, "**missing**"
            elif name in INTENDED:
                text = (
                    f"{apart(a[name].to_numpy(), b[name].to_numpy())}, intended: {INTENDED[name]}"
                )
            else:
                text = apart(a[name].to_numpy(), b[name].to_numpy())
                good &= text == "equal" or (text[0].isdigit() and float(text) <= TOLERANCE)
            if text != "equal":
                print(f"| {one.name} | `{name}` | {text} |")
        renamed = [
            n
            for n in map(str, b.variables)
            if str(b[n].attrs.get("long_name", "")).startswith("deprecated")
        ]
        for name in renamed:
            print(
                f"| {one.name} | `{name}` | former name, readable: {b[name].attrs['long_name']} |"
            )
        added = sorted(set(map(str, b.variables)) - set(map(str, a.variables)) - set(renamed))
        print(
            f"| {one.name} | {len(a.variables)} variables, {len(added)} new ones | {', '.join(added) or '-'} |"
        )
    return good


def damped(found: xr.Dataset) -> xr.Dataset:
    """A file without the variants of effect screening that have no contact damping: their motion is chaotic."""
    if "off" not in found:
        return found
    undamped = found["off"].isel(effect=found["effect"] == "contact damping").any("effect")
    return found.isel(variant=~undamped)


def apart(a: np.ndarray, b: np.ndarray) -> str:
    """The largest difference of two arrays over their largest value, "equal", or what is wrong."""
    if a.dtype.kind not in "fiu" or b.dtype.kind not in "fiu":
        return (
            "equal" if [str(x) for x in a.ravel()] == [str(x) for x in b.ravel()] else "other text"
        )
    if a.shape != b.shape:
        return f"shape {a.shape} to {b.shape}"
    if np.array_equal(a, b, equal_nan=True):
        return "equal"
    if not np.array_equal(np.isfinite(a), np.isfinite(b)):
        return "NaN or infinite in one only"
    fine = np.isfinite(a)
    return f"{np.abs(a - b)[fine].max() / np.abs(a)[fine].max():.1e}"


def compare_regular(before: str, after: str | None, place: Path) -> bool:
    """Run and compare the regular motions; results are kept at `place`."""
    for name, version in (("before", before), ("after", after)):
        (place / name).mkdir(parents=True, exist_ok=True)
        make_regular(sources(version, place / f"{name}-source"), place.resolve() / name)
    print(
        "| file | variable | largest difference, relative to the largest value |\n| --- | --- | --- |"
    )
    agree = [values(place / "before" / name, place / "after" / name) for name in REGULAR]
    return all(agree)


def compare_bytes(before: str, after: str | None) -> bool:
    """Run the quickstart and compare its files."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        for name, version in (("before", before), ("after", after)):
            (place / name / "out").mkdir(parents=True)
            make(sources(version, place / name / "source"), place / name / "out")
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
    return good


def main() -> int:
    """Compare; the exit code says whether all is the same."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("before", metavar="VERSION")
    parser.add_argument(
        "after", metavar="VERSION", nargs="?", help="this checkout as it is, if left out"
    )
    parser.add_argument("--regular", type=Path, metavar="DIRECTORY", help="keep results here")
    words = parser.parse_args()
    if words.regular:
        return int(not compare_regular(words.before, words.after, words.regular))
    return int(not compare_bytes(words.before, words.after))


if __name__ == "__main__":
    sys.exit(main())
