"""Study variables, random inputs and cases: which numbers of a scene vary, and how."""

import re
from collections.abc import Mapping
from functools import cached_property
from typing import Annotated, Any, ClassVar

from pydantic import model_validator
from pydantic_core import PydanticCustomError

from hpcclear.base import quantiles
from hpcclear.base.outcome import JUDGED, ON_REQUEST
from hpcclear.scene.distributions import OF_LIMITS, converted, form_of, is_ours
from hpcclear.scene.fields import LONGEST_CURVE, Quantity, Table, invalid, nearest
from hpcclear.scene.fits import Tolerance
from hpcclear.scene.paths import described, quantities

SHORT_NAMES: Mapping[str, tuple[str, ...]] = {
    "m1": ("mechanism.crank.mass",),
    "u1": ("mechanism.crank.mass_center",),
    "I1": ("mechanism.crank.inertia",),
    "m2": ("mechanism.rod.mass",),
    "u2": ("mechanism.rod.mass_center",),
    "I2": ("mechanism.rod.inertia",),
    "m3": ("mechanism.slider.mass",),
    "C": ("joints.crank_rod.clearance", "joints.rod_slider.clearance"),
    "C12": ("joints.crank_rod.clearance",),
    "C23": ("joints.rod_slider.clearance",),
}
"""Names that stand for scene entries where no path is given; nothing else depends on a name."""

LINK_INERTIAS = ("mechanism.crank.inertia", "mechanism.rod.inertia")

RESERVED = frozenset(
    (
        *("sample", "joint", "objective", "objective_spread", "objective_uncertainty", "mean_gap"),
        *(
            "peak_contact_force",
            "latched",
            "rhs_evaluations",
            "status",
            "flags",
            *ON_REQUEST,
            *JUDGED,
        ),
        *("case", "run", "solution", "design", "model", "mean", "deviation"),
        "label",
        *("searched", "searched_first", "searched_second", "constraints"),
    )
)
"""Names of dimensions and results in the datasets."""

_COMMON = ("name", "paths", "distribution")
_SHAPE = Quantity("", least=1e-2, most=1e4)
NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,39}")
"""What variables, random inputs and cases may be called."""
Range = tuple[float, float]


def _resolve_paths(data: Mapping[str, Any]) -> tuple[str, ...]:
    """The paths a named row drives, from `paths`, `path` or its name."""
    name = data.get("name")
    if not isinstance(name, str) or not NAME.fullmatch(name) or name in RESERVED:
        reason = "is taken by a result" if name in RESERVED else "is not a name"
        raise invalid(
            reason, "Use a letter, then letters, digits or _, and give the path as path = ..."
        )
    if "path" in data and "paths" in data:
        raise invalid("path and paths contradict each other", "Keep one of them", key="path")
    given = data.get("paths", data.get("path"))
    key = "path" if "path" in data else "paths"
    if given is None:
        if name not in SHORT_NAMES:
            raise invalid(
                "is not one of the known names, so it needs a path",
                f'Add path = "drive.speed", say; known names are {", ".join(SHORT_NAMES)}',
            )
        return SHORT_NAMES[name]
    paths = (given,) if isinstance(given, str) else given
    if (
        not isinstance(paths, (list, tuple))
        or not paths
        or any(not isinstance(p, str) for p in paths)
    ):
        raise invalid(
            "a dotted path, or a list of them, is expected here", "Write it in quotes", key=key
        )
    for path in paths:
        if path not in quantities():
            raise invalid(
                f"{path!r} is not a physical number of a scene",
                nearest(path, tuple(quantities())),
                key=key,
            )
    if len(set(paths)) < len(paths):
        raise invalid("a path stands there twice", "Remove one", key=key)
    if len({quantities()[path].unit for path in paths}) > 1:
        raise invalid("the paths have different units", "Use a variable for each unit", key=key)
    return tuple(paths)


def _number(value: Any, quantity: Quantity, key: str) -> float:
    """`Quantity.convert` with the key in its error."""
    try:
        return quantity.convert(value)
    except PydanticCustomError as error:
        context = error.context or {}
        raise invalid(context["reason"], context["remedy"], key=key) from None


def _range(value: Any, quantity: Quantity, key: str) -> Range:
    """A pair in rising order."""
    if not isinstance(value, (list, tuple)) or len(value) != 2:
        raise invalid("two bounds are expected here", "Write [lower, upper]", key=key)
    lower, upper = (_number(bound, quantity, key) for bound in value)
    if not lower < upper:
        reason = "the bounds are equal" if lower == upper else "the bounds are crossed"
        raise invalid(reason, "Write the smaller bound first; leave a constant out", key=key)
    if quantity.nonzero and lower < 0.0 < upper:
        raise invalid(
            "0 is between the bounds", "Keep to one sign: there would be no motion at 0", key=key
        )
    return lower, upper


def _list(value: Any, quantity: Quantity, key: str, least: int, most: int) -> tuple[float, ...]:
    """Numbers, at least and at most so many."""
    if not isinstance(value, (list, tuple)) or not least <= len(value) <= most:
        count = f"{least}" if least == most else f"from {least} to {most}"
        raise invalid(f"{count} numbers are expected here", "Write [first, second]", key=key)
    return tuple(_number(one, quantity, key) for one in value)


class NamedInput(Table):
    """A named row of the study and the scene entries that get its value."""

    name: str
    paths: tuple[str, ...]
    """Scene entries that all get its value."""

    @model_validator(mode="before")
    @classmethod
    def _resolve(cls, data: Any) -> Any:
        if not isinstance(data, Mapping):
            return data
        paths = _resolve_paths(data)
        row = {key: value for key, value in data.items() if key != "path"} | {"paths": paths}
        return cls._in_si(row, paths)

    @classmethod
    def _in_si(cls, row: dict[str, Any], paths: tuple[str, ...]) -> dict[str, Any]:
        """The row with the entries whose unit follows from its paths in SI."""
        raise NotImplementedError


class Variable(NamedInput):
    """One column of a design: a name, the scene entries it drives, and its bounds in SI."""

    range: Range | None = None
    """Bounds, SI."""
    ratio: Range | None = None
    """For an inertia: bounds of r = I / (m L^2 / 12), sampled in place of I."""

    @classmethod
    def _in_si(cls, row: dict[str, Any], paths: tuple[str, ...]) -> dict[str, Any]:
        if ("range" in row) == ("ratio" in row):
            raise invalid(
                "a variable needs either a range or, for an inertia, a ratio",
                "Add range = [lower, upper]",
            )
        if "range" in row:
            row["range"] = _range(row["range"], quantities()[paths[0]], "range")
            for path in paths[1:]:
                _range(row["range"], quantities()[path], "range")
        else:
            if len(paths) != 1 or not is_link_inertia(paths[0]):
                raise invalid(
                    "only the inertia of crank or rod can be given as a ratio to m L^2/12",
                    "Write range = [lower, upper] instead",
                    key="ratio",
                )
            row["ratio"] = _range(row["ratio"], Quantity("", above=0), "ratio")
        return row

    @property
    def unit(self) -> str:
        """SI unit of its value, "" for none."""
        return quantities()[self.paths[0]].unit

    @property
    def words(self) -> str:
        """What it drives, in words: "mass of the rod"."""
        return described(self.paths)

    @property
    def ratio_words(self) -> str:
        """The same of the ratio that an inertia is given as."""
        link = self.paths[0].split(".")[1]
        number = {"crank": 1, "rod": 2}[link]
        return f"inertia of the {link} over that of a slender rod, m{number} L{number}^2/12"

    @property
    def bounds(self) -> Range:
        """Bounds of what is sampled: the range in SI, or the ratio."""
        bounds = self.range if self.ratio is None else self.ratio
        assert bounds is not None  # one of the two is there, by validation
        return bounds


def is_link_inertia(path: str) -> bool:
    """Whether the path is the inertia of crank or rod, which scales with m L^2/12."""
    return path in LINK_INERTIAS


_LEAST_SHARE = 1e-9
"""Least probability that a range may leave of a distribution it cuts."""


class RandomInput(NamedInput):
    """A random number of the scene: about the design's value, or wherever the design is
    (`about_design = false`)."""

    elsewhere: ClassVar[Mapping[str, tuple[str, str]]] = {
        "file": ("files are read only where a scene is loaded from a file",
                 "Give values = [...]"),
        "column": ("names a column, but there is no file", "Add file = ..."),
    }  # fmt: skip

    distribution: str
    """The distribution. "samples" are measured values; "wear" uses the clearances of the service lives of `[wear]`. Further
    ones: any continuous one of scipy.stats, such as "scipy:weibull_min", one of an installed package, or "module:Name" of a
    file."""
    range: Range | None = None
    """Bounds of a "uniform" or "beta" distribution; truncation of others. SI."""
    mean: float | None = None
    """Centre of "uniform", "normal", "truncated-normal" and "beta", SI; default: the value of the
    design. Of "lognormal" its mean, before truncation."""
    half_width: float | None = None
    """Of "uniform", "truncated-normal" and "beta", SI, or a share such as "3 %" of the number it is about, where the study
    does not vary that; of "wear", that of the uniform distribution of new clearances about the scene's."""
    deviation: float | None = None
    """Standard deviation of "normal", and of "truncated-normal" and "lognormal" before they are cut, SI."""
    shapes: tuple[float, float] | None = None
    """Of "beta": a and b of its density x^(a-1) (1-x)^(b-1), x from 0 to 1 over its range."""
    shape: float | None = None
    """Of "weibull": k of exp(-((x - location)/scale)^k), the share above x."""
    scale: float | None = None
    """Of "weibull", SI."""
    location: float | None = None
    """Of "weibull": where it begins, SI; default 0."""
    values: tuple[float, ...] | None = None
    """Of "samples": measured values, each with equal chance, SI; in their place `file`, a CSV table beside the scene file, and
    `column`, as its first row has it."""
    fit: str | None = None
    """Of "fit", the clearance of a bore and a pin that are made apart: a fit by ISO 286; left out, that of the joint."""
    bore: Tolerance | None = None
    """Of "fit": how the bore is made; left out, normal within the limits of size of the fit, with cp = 1."""
    pin: Tolerance | None = None
    """Of "fit": how the pin is made; left out, normal within the limits of size of the fit, with cp = 1."""
    cycles: Annotated[float, Quantity("", least=0)] | None = None
    """Of "wear": the age in revolutions at which clearances of the lives in [wear] are taken."""
    parameters: dict[str, float] | None = None
    """Of distributions from elsewhere, which may stand beside the other entries, too: shapes, loc and scale of one of scipy's;
    whatever a plug-in takes. Texts are converted to the unit of the input."""
    about_design: bool | None = None
    """Of all but "uniform", "normal", "truncated-normal", "beta", "fit" and "wear": whether what scatters is the
    difference from the design's value."""

    @classmethod
    def _in_si(cls, row: dict[str, Any], paths: tuple[str, ...]) -> dict[str, Any]:
        quantity = quantities()[paths[0]]
        if not is_ours(row.get("distribution")):
            row = _gathered(row, quantity.unit)
        offset = quantity if row.get("about_design") is not True else Quantity(quantity.unit)
        if "range" in row:
            row["range"] = _range(row["range"], offset, "range")
        for key in ("mean", "location"):
            if key in row:
                row[key] = _number(
                    row[key], Quantity(quantity.unit) if key == "location" else offset, key
                )
        for key in ("half_width", "deviation", "scale"):
            if key in row:
                row[key] = _number(row[key], Quantity(quantity.unit, above=0), key)
        if "shape" in row:
            row["shape"] = _number(row["shape"], _SHAPE, "shape")
        if "shapes" in row:
            row["shapes"] = _list(row["shapes"], _SHAPE, "shapes", 2, 2)
        if "values" in row:
            row["values"] = tuple(sorted(_list(row["values"], offset, "values", 2, LONGEST_CURVE)))
        return row

    @model_validator(mode="after")
    def _parameters_fit(self) -> "RandomInput":
        form = form_of(self.distribution, self.parameters or {})
        needed, further = form.needs, form.may_have
        if self.range is not None and self.distribution in ("uniform", "beta"):
            needed, further = (needed - {"half_width"}) | {"range"}, frozenset()
        for key in (name for name in type(self).model_fields if name not in _COMMON):
            value = getattr(self, key)
            if key in needed and value is None:
                raise invalid(
                    f"the distribution {self.distribution!r} needs it", "Add it", key, None
                )
            if key not in needed | further and value not in (None, False):
                raise invalid(
                    f"does not belong to this {self.distribution!r} distribution", "Remove it", key
                )
        self._check_cut()
        return self

    def _check_cut(self) -> None:
        if self.distribution == "lognormal" and (self.mean or 0.0) <= 0.0:
            raise invalid(
                "a lognormal has a mean above 0", "Correct it, or use another distribution", "mean"
            )
        if self.distribution == "fit" and any(not p.endswith(".clearance") for p in self.paths):
            raise invalid(
                "a fit gives clearances of joints only", "Correct its path", "distribution"
            )
        if self.worn:
            return
        law = self.law  # of a plug-in found now, while it is known where its file is
        if isinstance(law, quantiles.Uniform | quantiles.Normal):
            low, high = law.span
            cut = isinstance(law, quantiles.Normal) and law.reach < _LEAST_SHARE * law.deviation
            if cut or not low < high:
                reason = "is too narrow for numbers of 16 digits, or holds next to nothing of the distribution"
                raise invalid(
                    reason, "Widen it", "range" if self.range is not None else "half_width"
                )
        if (
            isinstance(law, quantiles.Cut)
            and self.range is not None
            and self.distribution != "beta"
        ):
            below, above = law.chances
            if above - below < _LEAST_SHARE:
                raise invalid(
                    f"contains less than {_LEAST_SHARE:g} of the distribution",
                    "Choose bounds around its values",
                    "range",
                )

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
        """Its quantile function: of its value where it is absolute, else of its difference from the design, SI.

        Raises
        ------
        InputError
            Only a wear simulation gives its values.
        """
        form = form_of(self.distribution, self.parameters or {})
        return form.law(self.model_dump(exclude_none=True))

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


def _gathered(row: dict[str, Any], unit: str) -> dict[str, Any]:
    """The row of a distribution from elsewhere, its own parameters in one table."""
    if "parameters" in row:
        own, kept = row["parameters"], row
        if not isinstance(own, Mapping):
            return row
    else:
        rest = {*_COMMON, *OF_LIMITS}
        own = {key: value for key, value in row.items() if key not in rest}
        kept = {key: value for key, value in row.items() if key in rest}
    return {**kept, "parameters": converted(row["distribution"], own, unit)}
