"""Study variables, random inputs and cases: which numbers of a scene vary, and how."""

import re
from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import model_validator
from pydantic_core import PydanticCustomError

from hpcclear.base.errors import InputError
from hpcclear.base.normal import TAIL
from hpcclear.base.outcome import JUDGED, ON_REQUEST
from hpcclear.scene.fields import Quantity, Table, invalid, nearest
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
    )
)
"""Names of dimensions and results in the datasets."""

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,39}")
Range = tuple[float, float]


def _resolve_paths(data: Mapping[str, Any]) -> tuple[str, ...]:
    """The paths a named row drives, from `paths`, `path` or its name."""
    name = data.get("name")
    if not isinstance(name, str) or not _NAME.fullmatch(name) or name in RESERVED:
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
    return lower, upper


def _values(found: Any, quantity: Quantity) -> tuple[float, ...]:
    """Two numbers or more, in rising order."""
    if not isinstance(found, (list, tuple)) or len(found) < 2:
        raise invalid(
            "two values or more are expected here", "Write [first, second, ...]", key="values"
        )
    return tuple(sorted(_number(value, quantity, "values") for value in found))


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


class RandomInput(NamedInput):
    """A random number of the scene: about the design's value, or wherever the design is
    (`absolute`)."""

    distribution: Literal["uniform", "normal", "truncated-normal", "samples", "wear"]
    range: Range | None = None
    """Bounds of an absolute uniform distribution, SI."""
    mean: float | None = None
    """Centre, SI; left out, the distribution lies about the value of the design."""
    half_width: float | None = None
    """Of "uniform" and "truncated-normal", SI; of "wear", how far clearances lie about the scene's when new, uniform."""
    deviation: float | None = None
    """Standard deviation of "normal", and of "truncated-normal" before it is cut, SI."""
    values: tuple[float, ...] | None = None
    """Of "samples": each with equal chance, SI, kept in rising order."""
    cycles: Annotated[float, Quantity("", least=0)] | None = None
    """Of "wear": the age in revolutions at which clearances of the lives in [wear] are taken."""

    @classmethod
    def _in_si(cls, row: dict[str, Any], paths: tuple[str, ...]) -> dict[str, Any]:
        quantity = quantities()[paths[0]]
        if "range" in row:
            row["range"] = _range(row["range"], quantity, "range")
        if "mean" in row:
            row["mean"] = _number(row["mean"], quantity, "mean")
        for key in ("half_width", "deviation"):
            if key in row:
                row[key] = _number(row[key], Quantity(quantity.unit, above=0), key)
        if "values" in row:
            row["values"] = _values(row["values"], quantity)
        return row

    @model_validator(mode="after")
    def _parameters_fit(self) -> "RandomInput":
        needed = {
            "uniform": {"range"} if self.range is not None else {"half_width"},
            "normal": {"deviation"},
            "truncated-normal": {"deviation", "half_width"},
            "samples": {"values"},
            "wear": {"cycles"},
        }[self.distribution]
        further = {"samples": set(), "wear": {"half_width"}}.get(self.distribution, {"mean"})
        allowed = needed if "range" in needed else needed | further
        for key in ("range", "mean", "half_width", "deviation", "values", "cycles"):
            value = getattr(self, key)
            if key in needed and value is None:
                raise invalid(
                    f"the distribution {self.distribution!r} needs it", "Add it", key, None
                )
            if key not in allowed and value is not None:
                raise invalid(
                    f"does not belong to this {self.distribution!r} distribution", "Remove it", key
                )
        return self

    @property
    def absolute(self) -> bool:
        """Whether the distribution stays where it is when the design moves."""
        return self.worn or any(one is not None for one in (self.range, self.mean, self.values))

    @property
    def worn(self) -> bool:
        """Whether lives of worn joints have to be followed before its values are known."""
        return self.distribution == "wear"

    @property
    def ends(self) -> Range | None:
        """Least and largest value of a distribution that is given by them, SI.

        Raises
        ------
        InputError
            Only lives of worn joints can tell.
        """
        if self.worn:
            raise InputError(
                f"study.random.{self.name}.distribution", self.distribution,
                "is known once the lives of [wear] have been followed, which `hpcclear run` does first",
                'Use `hpcclear run`, or give clearances of your own: distribution = "samples", values = [...]',
            )  # fmt: skip
        return self.range if self.values is None else (self.values[0], self.values[-1])

    @property
    def centre(self) -> float | None:
        """Middle of an absolute distribution, SI; None when it follows the design."""
        return self.mean if self.ends is None else (self.ends[0] + self.ends[1]) / 2

    @property
    def reach(self) -> float:
        """How far from its centre values count, SI: the half-width, or six standard deviations of a
        normal."""
        if self.ends is not None:
            return (self.ends[1] - self.ends[0]) / 2
        if self.half_width is not None:
            return self.half_width
        assert self.deviation is not None  # by validation
        return TAIL * self.deviation


class Case(Table):
    """One optimisation: which of the random inputs are random in it."""

    name: str
    random: tuple[str, ...]

    @model_validator(mode="after")
    def _named(self) -> "Case":
        if not _NAME.fullmatch(self.name):  # it stands in names of files, figures and pages
            raise invalid("is not a name", "Use a letter, then letters, digits or _", key="name")
        return self

    @model_validator(mode="after")
    def _some_random(self) -> "Case":
        if not self.random:
            raise invalid(
                "a case without random inputs has no deviation to minimise", "Name some", "random"
            )
        if len(set(self.random)) < len(self.random):
            raise invalid("a random input is named twice", "Remove one", key="random")
        return self
