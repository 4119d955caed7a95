"""The lines of the package, by the feature that they serve and by package.

    python analysis/lines.py [COMMIT]    # also against another commit

A module belongs to the first feature one of whose patterns it matches; what no pattern names is the core: scenes, mechanisms,
kernel, sampling, statistics, surrogates, the search and its verification, ranks, files, the report's frame.
"""

import argparse
import tempfile
from collections import Counter
from fnmatch import fnmatch
from pathlib import Path

from structure import PACKAGE, ROOT, checkout

FEATURES = {
    "unknowns of a machine from measured signals":
        "identify/* */identified.py cli/commands/identify.py",
    "laws, objectives, distributions, searches of a user":
        "plugins/* laws/checks.py laws/quantities.py laws/translate.py laws/formula.py "
        "laws/constant.py scene/plugged.py base/arithmetic.py statistics/search/foreign.py "
        "statistics/search/asking.py",
    "wear and service lives":
        "dynamics/wear/* ensemble/wear.py ensemble/lives.py scene/surfaces.py cli/wear.py cli/commands/wear.py "
        "report/figures/wear.py study/lives.py statistics/random/survival.py dynamics/stepping/profile.py",
    "steady means to a target error, chaos, maps":
        "dynamics/evaluation/steady/* dynamics/steady/* ensemble/maps.py ensemble/bifurcation.py "
        "report/figures/maps.py report/figures/portraits.py study/chaos.py base/asking.py",
    "which effects can be neglected":
        "ensemble/certificate.py ensemble/trial.py ensemble/effects.py cli/effects.py cli/commands/effects.py "
        "study/certificate.py scene/switches.py report/figures/effects.py statistics/random/paired.py",
    "the paper's study: its numbers and claims":
        "study/paper/* study/claims.py study/printed.py study/readings.py",
    "rare failures, worst cases, constraints tested":
        "statistics/random/importance.py statistics/random/tail.py study/rare.py study/verdicts.py "
        "study/worst.py ensemble/corners.py",
    "curves, tables and workbooks in; tables out":
        "scene/sheets.py scene/delimited.py "
        "scene/workbook.py scene/clock.py scene/file_curves.py scene/points.py "
        "report/tables.py report/export.py cli/commands/export.py",
    "comparison with measurements":
        "report/compare.py report/merit.py report/alike.py report/figures/compared.py "
        "report/scatter.py",
    "fits of ISO 286, catalogues, costs":
        "scene/fits.py scene/fitted.py scene/choices.py scene/contacts/pin_in_bearing.py "
        "report/html/designs.py",
    "oil films":
        "laws/film/* laws/reynolds.py dynamics/contacts/lubrication.py scene/surfaces.py "
        "report/bearings.py dynamics/lubrication/*",
    "bars that bend":
        "dynamics/linkage/bending.py scene/planar.py dynamics/planar/tolerances.py dynamics/bending.py",
    "guides with clearance, friction of other joints":
        "dynamics/contacts/wall.py scene/contacts/guide.py dynamics/linkage/rubbing.py "
        "dynamics/linkage/guides.py report/figures/guides.py scene/study_tables.py",
    "shapes of contact, roundness":
        "laws/geometry/* dynamics/contacts/roundness.py scene/surfaces.py",
    "impact and noise, loads on bearings":
        "dynamics/evaluation/recorded/impacts.py dynamics/evaluation/recorded/sounding.py "
        "dynamics/evaluation/recorded/spectral.py statistics/spectra.py report/html/loads.py "
        "study/simulations.py scene/loads.py",
    "implicit steps of stiff samples":
        "dynamics/stepping/implicit/* dynamics/implicit/* base/eight.py",
    "compiling, its cache and widths":
        "base/lowering/* base/generated.py base/cached.py base/code_folder.py base/width.py base/bits.py "
        "base/jit.py base/unrolled.py base/numbered.py ensemble/compiling.py base/hashing.py",
    "error against run time, plans of jobs":
        "accuracy/* cli/accuracy.py cli/plan.py cli/commands/accuracy.py "
        "report/figures/accuracy.py study/forecast.py study/tolerance.py "
        "study/launched.py base/host.py",
    "statistics of millions of samples, parts of arrays":
        "statistics/streams.py ensemble/statistics.py ensemble/split.py "
        "scene/sampling.py",
    "killed runs, lost ranks, damaged files":
        "ranks/watch.py ranks/mailbox.py base/lock.py results/faults.py results/checkpoint.py base/private.py",
    "surrogates beside Kriging":
        "statistics/surrogate/regression.py statistics/surrogate/leaf.py statistics/surrogate/piecewise.py "
        "statistics/surrogate/response_surface.py statistics/surrogate/surface_search.py "
        "statistics/surrogate/term_choice.py statistics/surrogate/polynomial.py",
    "sensitivities":
        "statistics/sensitivity/* study/sensitivities.py study/contributions.py",
    "distributions of random inputs":
        "scene/random_inputs.py scene/correlation.py scene/random_inputs.py base/quantiles.py statistics/random/rules.py",
    "a front searched by simulations, judged with intervals":
        "statistics/search/improvement.py statistics/search/certainty.py study/search.py "
        "study/truth.py study/verification.py",
    "contact and friction laws, built in":
        "laws/normal/* laws/friction/* laws/hertz_contact.py scene/laws.py "
        "dynamics/physics/contact.py",
    "linkages from drawings, points and other programs; templates":
        "scene/importers/* scene/points_of_linkage.py scene/slider_crank.py",
    "figures and animation":
        "report/figures/*",
    "the page and its gallery":
        "report/html/* report/answer.py report/targets.py report/spread.py report/failures.py",
    "archives, citation, schema, other units":
        "results/crate.py results/provenance.py scene/describing.py cli/commands/reproduce.py scene/schema.py "
        "base/units.py base/unit_names.py scene/describing.py",
}  # fmt: skip


def feature_of(path: str) -> str:
    """The feature of a module, by its path within the package; "" of the core."""
    return next(
        (
            name
            for name, patterns in FEATURES.items()
            if any(fnmatch(path, pattern) for pattern in patterns.split())
        ),
        "",
    )


def lines_of(root: Path) -> dict[str, int]:
    """Lines of every module, by its path within the package."""
    package = root / PACKAGE
    return {
        str(path.relative_to(package)): len(path.read_text(encoding="utf-8").splitlines())
        for path in sorted(package.rglob("*.py"))
    }


def by(sizes: dict[str, int], key: object) -> Counter[str]:
    """Lines summed up by what `key` makes of a path."""
    total: Counter[str] = Counter()
    for path, size in sizes.items():
        total[key(path)] += size  # type: ignore[operator]
    return total


def package_of(path: str) -> str:
    """Package of a module; packages with packages of their own by these."""
    return "/".join(path.split("/")[:-1][:2]) or "(modules outside the packages)"


def table(title: str, before: Counter[str] | None, now: Counter[str]) -> list[str]:
    """Rows of a table, the largest first, and their sum."""
    rows = [f"| {title} | lines |" + (" change |" if before is not None else "")]
    rows.append("| --- | ---: |" + (" ---: |" if before is not None else ""))
    names = sorted((before or Counter()) | now, key=lambda one: (-now[one], one))
    every = [*((name or "core: all the rest", name) for name in names), ("**all**", None)]
    for words, name in every:
        size = now.total() if name is None else now[name]
        row = f"| {words} | {size} |"
        if before is not None:
            row += f" {size - (before.total() if name is None else before[name]):+d} |"
        rows.append(row)
    return rows


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("commit", nargs="?", help="to compare with")
    commit, now, before = parser.parse_args().commit, lines_of(ROOT), None
    if commit is not None:
        with tempfile.TemporaryDirectory() as place:
            before = lines_of(checkout(commit, Path(place)))
    for title, key in (("feature", feature_of), ("package", package_of)):
        then = None if before is None else by(before, key)
        print("\n".join([*table(title, then, by(now, key)), ""]))


if __name__ == "__main__":
    main()
