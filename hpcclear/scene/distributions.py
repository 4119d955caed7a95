"""Distributions of random inputs by their names: ours, any continuous one of scipy.stats, and plug-ins."""

from collections.abc import Callable, Mapping
from functools import partial
from math import inf
from typing import Any, NamedTuple

import numpy as np

from hpcclear.base import quantiles
from hpcclear.base.errors import InputError, at, nearest
from hpcclear.plugins import DISTRIBUTIONS
from hpcclear.plugins.sources import SCIPY
from hpcclear.scene.fields import Quantity, invalid
from hpcclear.scene.fits import law_of
from hpcclear.scene.plugged import as_invalid

OF_LIMITS = frozenset({"range", "about_design"})
"""Entries that every distribution from elsewhere may have; all others are its own parameters."""

_TESTED = np.array([1e-9, 1e-3, 0.5, 1 - 1e-3, 1 - 1e-9])
"""Probabilities whose quantiles a distribution must have."""


class Form(NamedTuple):
    """One of our distributions: entries that it needs, those that it may have, and its quantiles made of them."""

    needs: frozenset[str]
    may_have: frozenset[str]
    law: Callable[[Mapping[str, Any]], quantiles.Quantiles]


def _ends(entries: Mapping[str, Any]) -> tuple[float, float]:
    return entries.get("range", (-inf, inf))


def _middle_and_reach(entries: Mapping[str, Any]) -> tuple[float, float]:
    if "range" in entries:
        lower, upper = entries["range"]
        return (lower + upper) / 2, (upper - lower) / 2
    return entries.get("mean", 0.0), entries.get("half_width", inf)


def _normal(entries: Mapping[str, Any]) -> quantiles.Quantiles:
    middle, reach = _middle_and_reach(entries)
    return quantiles.Normal(middle, entries["deviation"], reach)


def _beta(entries: Mapping[str, Any]) -> quantiles.Quantiles:
    middle, reach = _middle_and_reach(entries)
    return quantiles.beta(
        entries["shapes"], *entries.get("range", (middle - reach, middle + reach))
    )


def _lognormal(entries: Mapping[str, Any]) -> quantiles.Quantiles:
    return quantiles.lognormal(entries["mean"], entries["deviation"], *_ends(entries))


def _weibull(entries: Mapping[str, Any]) -> quantiles.Quantiles:
    location = entries.get("location", 0.0)
    return quantiles.weibull(entries["scale"], entries["shape"], location, *_ends(entries))


def _worn(entries: Mapping[str, object]) -> quantiles.Quantiles:
    raise InputError(
        f"study.random.{entries['name']}.distribution", "wear",
        "is known only after the wear simulation of [wear], which `hpcclear run` does first",
        'Use `hpcclear run`, or give clearances of your own: distribution = "samples", values = [...]',
    )  # fmt: skip


def _ours() -> dict[str, Form]:
    made = {
        "uniform": ("half_width", "mean", lambda e: quantiles.Uniform(*_middle_and_reach(e))),
        "normal": ("deviation", "mean", _normal),
        "truncated-normal": ("deviation half_width", "mean", _normal),
        "lognormal": ("mean deviation", "range about_design", _lognormal),
        "beta": ("shapes half_width", "mean", _beta),
        "weibull": ("scale shape", "location range about_design", _weibull),
        "samples": ("values", "about_design", lambda e: quantiles.Samples(e["values"])),
        "fit": ("", "fit bore pin range", law_of),
        "wear": ("cycles", "half_width", _worn),
    }
    return {
        name: Form(frozenset(needs.split()), frozenset(others.split()), law)
        for name, (needs, others, law) in made.items()
    }


OURS = _ours()
for _name, _form in OURS.items():
    DISTRIBUTIONS.add(_name, _form)


def is_ours(name: object) -> bool:
    """Whether a distribution is one of ours, or none at all; others have parameters of their own."""
    return not isinstance(name, str) or name in OURS


def form_of(name: str, parameters: Mapping[str, float]) -> Form:
    """Return the requirements of a distribution; raise an error for validators if the name is not known."""
    if name in OURS:
        return OURS[name]
    module, _, own = name.partition(":")
    if module == SCIPY:
        law: Any = partial(_of_scipy, own, parameters)
    else:
        with as_invalid("distribution"):
            factory = DISTRIBUTIONS.get(name)
        law = partial(_of_plugin, name, factory, parameters)
    return Form(frozenset(), OF_LIMITS | {"parameters"}, law)


def converted(name: str, parameters: Mapping[str, object], unit: str) -> dict[str, float]:
    """Parameters of a distribution from elsewhere as numbers: texts in the unit of its input, scipy's shapes in none."""
    found = {}
    for key, value in parameters.items():
        bare = name.startswith(f"{SCIPY}:") and key not in ("loc", "scale")
        with at(str(key), value):
            own = Quantity("" if bare or not isinstance(value, str) else unit)
            found[str(key)] = own.number(value)
    return found


def _of_scipy(
    own: str, parameters: Mapping[str, float], entries: Mapping[str, object]
) -> quantiles.Cut:
    from scipy import stats

    one = getattr(stats, own, None)
    if not isinstance(one, stats.rv_continuous):
        known = [n for n, d in vars(stats).items() if isinstance(d, stats.rv_continuous)]
        raise invalid(
            f"scipy.stats has no continuous distribution {own!r}",
            nearest(own, known),
            "distribution",
        )
    shapes = tuple((one.shapes or "").replace(" ", "").split(",")) if one.shapes else ()
    for key in parameters:
        if key not in (*shapes, "loc", "scale"):
            raise invalid(
                f"is not a parameter of scipy's {own}", nearest(key, (*shapes, "loc", "scale")), key
            )
    for key in shapes:
        if key not in parameters:
            raise invalid(f"the distribution 'scipy:{own}' needs it", "Add it", key, None)
    law = quantiles.Named(own, tuple(parameters.items()), *_ends(entries))
    _check(law, f"scipy:{own}", parameters)
    return law


def _of_plugin(
    name: str, factory: Any, parameters: Mapping[str, float], entries: Mapping[str, Any]
) -> quantiles.Cut:
    try:
        whole = factory(**parameters)
    except Exception as error:
        reason = f"{name} could not be made of its parameters: {type(error).__name__}: {error}"
        raise invalid(reason, "Give the parameters that it takes", "distribution") from error
    law = quantiles.Foreign(whole, *_ends(entries))
    if "range" in entries and not hasattr(whole, "cdf"):
        raise invalid(f"{name} has no cdf, so it cannot be cut off", "Remove it", "range")
    _check(law, name, parameters)
    return law


def _check(law: quantiles.Cut, name: str, parameters: Mapping[str, float]) -> None:
    """An error for validators unless quantiles are finite and rise, and the range holds some of them."""
    given = ", ".join(f"{key} = {value:g}" for key, value in parameters.items()) or "no parameters"
    try:
        with np.errstate(all="ignore"):
            found = np.asarray(law.whole.ppf(_TESTED), float)
    except Exception as error:
        reason = f"ppf of {name} raised {type(error).__name__}: {error}"
        raise invalid(
            reason, "Mend it: it takes arrays of probabilities", "distribution"
        ) from error
    fine = found.shape == _TESTED.shape and np.isfinite(found).all() and (np.diff(found) >= 0).all()
    if not fine or not found[0] < found[-1]:
        raise invalid(
            f"{name} with {given} has no finite, increasing quantiles",
            "Correct its parameters", "distribution",
        )  # fmt: skip
