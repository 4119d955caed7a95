"""Lines on global sensitivities: first-order and total Sobol indices (kind ``sensitivity``)."""

from collections.abc import Iterator

import numpy as np

from hpcclear.report.parts import LinesOf, Recommended
from hpcclear.report.scatter import HALF_WIDTH, share
from hpcclear.report.spread import Line

LITTLE = 0.01
"""Share of the variance of f, with its half-width, below which a variable is called negligible."""

COARSE = 0.1
"""Half-width of a Sobol index above which more samples are advised."""


def _lines(of: Recommended) -> Iterator[Line]:
    """First-order and total Sobol indices with their errors, the largest total first; none where they are not known."""
    found = of.files.get("sensitivity")
    if found is None or "sobol_total" not in found:
        return
    indices = {
        kind: [found[f"sobol_{kind}{end}"].to_numpy() for end in ("", "_error")]
        for kind in ("first", "total")
        if f"sobol_{kind}" in found
    }
    total, error = indices["total"]
    if not total.size or not np.isfinite([total, error]).all():
        return
    names = [str(name) for name in found["parameter"].to_numpy()]
    order = np.argsort(-total, kind="stable")
    little = total + HALF_WIDTH * error < LITTLE
    texts = {
        kind: ", ".join(
            share(names[k], value[k], HALF_WIDTH * error[k]) for k in order if not little[k]
        )
        for kind, (value, error) in indices.items()
    }
    own = "first-order Sobol indices, the share of the variance of f that a variable explains alone (± 95 % half-width)"
    if texts["total"] and "first" in texts:
        yield Line("sensitivity", f"{own}: {texts['first']}")
    if texts["total"]:
        words = "total Sobol indices, with all interactions (their sum may exceed 100 %)"
        yield Line("interactions", f"{words}: {texts['total']}")
    noise, doubt = (float(found.get(f"sobol_noise{end}", np.nan)) for end in ("", "_error"))
    if noise > HALF_WIDTH * doubt and noise > LITTLE:
        text = f"{share('chaotic scatter', noise, HALF_WIDTH * doubt)} of the variance over the study's ranges, "
        yield Line("chaotic scatter", text + "by perturbed runs; the total indices are without it")
    if little.any():
        hardly = ", ".join(names[k] for k in order if little[k])
        yield Line("negligible", f"{hardly} (total Sobol index below {LITTLE:.0%}, error included)")
    if any(HALF_WIDTH * float(np.nanmax(error)) > COARSE for _, error in indices.values()):
        text = f"Sobol indices are known to ± {COARSE:.0%} or worse: raise study.sensitivity.sobol_samples"
        yield Line("warning", text)


PARTS = (LinesOf(40, ("sensitivity",), _lines),)
