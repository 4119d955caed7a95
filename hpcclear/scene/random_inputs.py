"""Random inputs of a study, about the design or wherever it is, and their distributions by name: ours, any continuous one of
scipy.stats, and plug-ins."""

from collections.abc import Callable, Mapping, Set
from functools import cached_property, partial
from math import inf, log1p, sqrt
from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np

from hpcclear.base import quantiles
from hpcclear.base.errors import InputError, at, nearest
from hpcclear.plugins import DISTRIBUTIONS
from hpcclear.plugins.sources import SCIPY
from hpcclear.scene import fields
from hpcclear.scene.fields import LONGEST_CURVE, Content, Entries, Quantity, invalid
from hpcclear.scene.fits import Tolerance, law_of
from hpcclear.scene.named import NamedInput, Range, with_paths
from hpcclear.scene.paths import quantities
from hpcclear.scene.plugged import as_invalid

OF_LIMITS = frozenset({"range", "about_design"})
"""Entries that every distribution from elsewhere may have; all others are its own parameters."""

_TESTED = np.array([1e-9, 1e-3, 0.5, 1 - 1e-3, 1 - 1e-9])
"""Probabilities whose quantiles a distribution must have."""


class Form(NamedTuple):
    """One of our distributions: its quantiles made of entries, those that it needs, and those that it may have."""

    law: Callable[[Content], quantiles.Quantiles]
    needs: Set[str] = frozenset()
    may_have: Set[str] = frozenset()


def _ends(entries: Content) -> tuple[float, float]:
    return entries.get("range", (-inf, inf))


def _middle_and_reach(entries: Content) -> tuple[float, float]:
    if "range" in entries:
        lower, upper = entries["range"]
        return (lower + upper) / 2, (upper - lower) / 2
    return entries.get("mean", 0.0), entries.get("half_width", inf)


def _normal(entries: Content) -> quantiles.Quantiles:
    middle, reach = _middle_and_reach(entries)
    return quantiles.Normal(middle, entries["deviation"], reach)


def _beta(entries: Content) -> quantiles.Quantiles:
    middle, reach = _middle_and_reach(entries)
    lower, upper = entries.get("range", (middle - reach, middle + reach))
    a, b = entries["shapes"]
    over = ("a", a), ("b", b), ("loc", lower), ("scale", upper - lower)
    return quantiles.Named("beta", over, lower, upper)


def _lognormal(entries: Content) -> quantiles.Quantiles:
    """By mean and standard deviation of all of it, before it is cut off."""
    square = (entries["deviation"] / entries["mean"]) ** 2
    over = ("s", sqrt(log1p(square))), ("scale", entries["mean"] / sqrt(1.0 + square))
    return quantiles.Named("lognorm", over, *_ends(entries))


def _weibull(entries: Content) -> quantiles.Quantiles:
    begin = entries.get("location", 0.0)
    over = ("c", entries["shape"]), ("loc", begin), ("scale", entries["scale"])
    return quantiles.Named("weibull_min", over, *_ends(entries))


def _worn(entries: Content) -> quantiles.Quantiles:
    raise InputError(
        f"study.random.{entries['name']}.distribution", "wear",
        "is known only after the wear simulation of [wear], which `hpcclear run` does first",
        'Use `hpcclear run`, or give clearances of your own: distribution = "samples", values = [...]',
    )  # fmt: skip


OURS = {
    "uniform": Form(
        lambda own: quantiles.Uniform(*_middle_and_reach(own)), {"half_width"}, {"mean"}
    ),
    "normal": Form(_normal, {"deviation"}, {"mean"}),
    "truncated-normal": Form(_normal, {"deviation", "half_width"}, {"mean"}),
    "lognormal": Form(_lognormal, {"mean", "deviation"}, {*OF_LIMITS}),
    "beta": Form(_beta, {"shapes", "half_width"}, {"mean"}),
    "weibull": Form(_weibull, {"scale", "shape"}, {"location", *OF_LIMITS}),
    "samples": Form(lambda own: quantiles.Empirical(own["values"]), {"values"}, {"about_design"}),
    "fit": Form(law_of, may_have={"fit", "bore", "pin", "range"}),
    "wear": Form(_worn, {"cycles"}, {"half_width"}),
}
for _name, _form in OURS.items():
    DISTRIBUTIONS.add(_name, _form)


def form_of(name: str, parameters: Mapping[str, float]) -> Form:
    """Return the requirements of a distribution; raise an error for validators if the name is not known."""
    if name in OURS:
        return OURS[name]
    module, _, own = name.partition(":")
    if module == SCIPY:
        _check_scipy(own)
        law: Any = partial(_of_scipy, own, parameters)
    else:
        with as_invalid("distribution"):
            factory = DISTRIBUTIONS.get(name)
        law = partial(_of_plugin, name, factory, parameters)
    return Form(law, may_have=OF_LIMITS | {"parameters"})


def _check_scipy(own: str) -> None:
    from scipy import stats

    if not isinstance(getattr(stats, own, None), stats.rv_continuous):
        known = [n for n, d in vars(stats).items() if isinstance(d, stats.rv_continuous)]
        reason = f"scipy.stats has no continuous distribution {own!r}"
        raise invalid(reason, nearest(own, known), "distribution")


def _of_scipy(own: str, parameters: Mapping[str, float], entries: Content) -> quantiles.Cut:
    from scipy import stats

    one = getattr(stats, own)
    shapes = tuple((one.shapes or "").replace(" ", "").split(",")) if one.shapes else ()
    for key in parameters:
        if key not in (*shapes, "loc", "scale"):
            reason = f"is not a parameter of scipy's {own}"
            raise invalid(reason, nearest(key, (*shapes, "loc", "scale")), key)
    for key in shapes:
        if key not in parameters:
            raise invalid(f"the distribution 'scipy:{own}' needs it", "Add it", key)
    law = quantiles.Named(own, tuple(parameters.items()), *_ends(entries))
    _check(law, f"scipy:{own}", parameters)
    return law


def _of_plugin(
    name: str, factory: Any, parameters: Mapping[str, float], entries: Content
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
        raise invalid(reason, "Let it take arrays of probabilities", "distribution") from error
    fine = found.shape == _TESTED.shape and np.isfinite(found).all() and (np.diff(found) >= 0).all()
    if not fine or not found[0] < found[-1]:
        reason = f"{name} with {given} has no finite, increasing quantiles"
        raise invalid(reason, "Correct its parameters", "distribution")


_COMMON = ("name", "paths", "distribution")
_SHAPE = Quantity("", least=1e-2, most=1e4)
_LEAST_SHARE = 1e-9
"""Least probability that a range may leave of a distribution it cuts."""


class RandomInput(NamedInput):
    """A random input: distributed around the value of the design, or absolute, the same for all designs (`about_design
    = false`)."""

    elsewhere: ClassVar[Mapping[str, tuple[str, str]]] = {
        "file": ("files are read only where a scene is loaded from a file",
                 "Give values = [...]"),
        "column": ("names a column, but there is no file", "Add file = ..."),
    }  # fmt: skip

    distribution: str
    """The distribution. "samples": measured values. "wear": clearances after the service lives of `[wear]`. Also any continuous
    distribution of scipy.stats, such as "scipy:weibull_min", one of an installed package, or "module:Name" of a file."""
    range: fields.Bounds = None
    """Bounds of a "uniform" or "beta" distribution, truncation of the others, SI."""
    mean: fields.Number = None
    """Centre of "uniform", "normal", "truncated-normal" and "beta", SI; default: the value of the design. For
    "lognormal": mean before truncation."""
    half_width: fields.Number = None
    """Half-width of "uniform", "truncated-normal" and "beta", SI, or a percentage such as "3 %": of the value that each
    design has if the study varies it, else of the nominal value. For "wear": half-width of the uniform distribution of
    new clearances around the value of the scene."""
    deviation: fields.Number = None
    """Standard deviation of "normal", SI, or a percentage as of `half_width`; of "truncated-normal" and "lognormal" before
    truncation."""
    shapes: tuple[float, float] | None = None
    """For "beta": a and b of the density x^(a-1) (1-x)^(b-1), with x from 0 to 1 over the range."""
    shape: float | None = None
    """For "weibull": k in the probability exp(-((x - location)/scale)^k) of exceeding x."""
    scale: fields.Number = None
    """For "weibull": scale in that probability, SI."""
    location: fields.Number = None
    """For "weibull": smallest value, SI; default 0."""
    values: fields.Numbers = None
    """For "samples": measured values with equal probability, SI. Alternatively `file`, a CSV table beside the scene
    file, and `column`, its heading."""
    fit: str | None = None
    """For "fit", the clearance of an independent bore and pin: an ISO 286 fit; default: that of the joint."""
    bore: Tolerance | None = None
    """For "fit": distribution of the bore; default: normal within the tolerance of the fit, with cp = 1."""
    pin: Tolerance | None = None
    """For "fit": distribution of the pin; default: normal within the tolerance of the fit, with cp = 1."""
    cycles: Annotated[float, Quantity("", least=0)] | None = None
    """For "wear": age in revolutions at which the clearances of the service lives are taken."""
    parameters: dict[str, float] | None = None
    """Parameters of a distribution of scipy (shapes, loc, scale) or of a plug-in. They may also be written beside the
    other entries. Text with a unit is converted to the unit of the input."""
    relative: bool | None = None
    """Whether `half_width` and `deviation` are fractions of the design's value. `half_width = "3 %"` enables it if the
    study varies that value."""
    about_design: bool | None = None
    """Whether the distribution is that of the difference from the design's value. Not for "uniform", "normal",
    "truncated-normal", "beta", "fit" and "wear"."""

    @classmethod
    def _of_file(cls, row: Entries) -> Entries:
        """The row with its paths, and numbers in the unit of these."""
        row, paths = with_paths(row)
        quantity = quantities()[paths[0]]
        named = row.get("distribution")
        if isinstance(named, str) and named not in OURS:  # which has parameters of its own
            form_of(named, {})  # refuses an unknown one first
            row = _gathered(row, quantity.unit)
        offset = quantity if row.get("about_design") is not True else Quantity(quantity.unit)
        if "range" in row:
            row["range"] = offset.range(row["range"], "range")
        share = Quantity("" if row.get("relative") else quantity.unit, above=0)
        for key, own in {
            "mean": offset, "location": Quantity(quantity.unit), "half_width": share, "deviation": share,
            "scale": Quantity(quantity.unit, above=0), "shape": _SHAPE,
        }.items():  # fmt: skip
            if key in row:
                row[key] = own.convert(row[key], key)
        if "shapes" in row:
            row["shapes"] = _SHAPE.several(row["shapes"], "shapes", 2, 2)
        if "values" in row:
            row["values"] = tuple(sorted(offset.several(row["values"], "values", 2, LONGEST_CURVE)))
            if row["values"][0] == row["values"][-1]:
                raise invalid("all values are the same", "Remove it, or give others", "values")
        return row

    def _check(self) -> None:
        form = form_of(self.distribution, self.parameters or {})
        needed, further = form.needs, form.may_have
        if self.range is not None and self.distribution in ("uniform", "beta"):
            needed, further = (needed - {"half_width"}) | {"range"}, frozenset()
        for key in (name for name in type(self).model_fields if name not in _COMMON):
            value = getattr(self, key)
            if key in needed and value is None:
                raise invalid(f"the distribution {self.distribution!r} needs it", "Add it", key)
            if key not in needed | further | {"relative"} and value is not None:
                raise invalid(f"does not belong to {self.distribution!r}", "Remove it", key)
        self._check_cut()

    def _check_cut(self) -> None:
        if self.distribution == "lognormal" and (self.mean or 0.0) <= 0.0:
            raise invalid("a lognormal has a mean above 0", "Correct mean or distribution", "mean")
        if self.distribution == "fit" and any(not p.endswith(".clearance") for p in self.paths):
            raise invalid("a fit gives clearances of joints", "Correct its path", "distribution")
        if self.worn:
            return
        law = self.law  # of a plug-in found now, while it is known where its file is
        if isinstance(law, quantiles.Uniform | quantiles.Normal):
            low, high = law.span
            cut = isinstance(law, quantiles.Normal) and law.reach < _LEAST_SHARE * law.deviation
            if cut or not low < high:
                reason = "is too narrow for numbers of 16 digits, or holds next to nothing of the distribution"
                raise invalid(reason, "Widen it", "range" if self.range else "half_width")
        if isinstance(law, quantiles.Cut) and self.range and self.distribution != "beta":
            below, above = law.chances
            if above - below < _LEAST_SHARE:
                reason = f"contains less than {_LEAST_SHARE:g} of the distribution"
                raise invalid(reason, "Choose bounds around its values", "range")

    @property
    def absolute(self) -> bool:
        """Whether the distribution stays where it is when the design moves."""
        if self.distribution in ("uniform", "normal", "truncated-normal", "beta"):
            return self.range is not None or self.mean is not None
        return not self.about_design

    @property
    def worn(self) -> bool:
        """Whether its values are known only after a wear simulation."""
        return self.distribution == "wear"

    @cached_property
    def law(self) -> quantiles.Quantiles:
        """Its distribution, SI: of its value if `absolute`, else of its difference from the design. InputError if `worn`."""
        return self.changed({})

    def changed(self, entries: Mapping[str, object]) -> quantiles.Quantiles:
        """Its quantile function with other entries, such as {"half_width": 1e-5, "bore.cp": 1.3}; errors for validators."""
        own = self.model_dump(exclude_none=True)
        for key, value in entries.items():
            table, _, leaf = key.rpartition(".")
            if table:
                own[table] = {**own.get(table, {}), leaf: value}
            else:
                own[key] = value
        return form_of(self.distribution, self.parameters or {}).law(own)

    @property
    def shape_words(self) -> str:
        """The distribution with its parameters, in words."""
        given = ", ".join(f"{key} = {value:g}" for key, value in (self.parameters or {}).items())
        given = self.fit or given
        return f"{self.distribution}({given})" if given else self.distribution

    @property
    def span(self) -> Range:
        """Least and largest value that counts, SI: of the difference from the design, where it follows it."""
        return self.law.span


def _gathered(row: Content, unit: str) -> Content:
    """The row of a distribution from elsewhere, its own parameters as numbers in one table: texts in the unit of its input,
    scipy's shapes in none."""
    if "parameters" in row:
        own, kept = row["parameters"], row
        if not isinstance(own, Mapping):
            return row
    else:
        rest = {*_COMMON, *OF_LIMITS}
        own = {key: value for key, value in row.items() if key not in rest}
        kept = {key: value for key, value in row.items() if key in rest}
    found = {}
    for key, value in own.items():
        bare = row["distribution"].startswith(f"{SCIPY}:") and key not in ("loc", "scale")
        with at(str(key), value):
            quantity = Quantity("" if bare or not isinstance(value, str) else unit)
            found[str(key)] = quantity.number(value)
    return {**kept, "parameters": found}
