"""Cases of a study: what is random in an optimisation, which statistics are minimised, and what designs must keep to."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Annotated, Literal, get_args

import numpy as np
from pydantic import PrivateAttr, WithJsonSchema

from hpcclear.base.arithmetic import names_in, value_of
from hpcclear.base.arrays import Array
from hpcclear.base.errors import at, nearest
from hpcclear.base.objectives import ENDS, OURS, Objective, Usual
from hpcclear.plugins import OBJECTIVES
from hpcclear.scene.fields import NUMBER, Number, Quantity, Table, hint, invalid
from hpcclear.scene.named import NAME
from hpcclear.scene.plugged import PluginName, as_invalid
from hpcclear.scene.variables import StudyVariable

Level = Annotated[float, Quantity("", above=0, below=1)]
Statistic = Literal["mean", "deviation", "quantile", "exceedance", "cost"]
NO_LESS = "no design has less"


class ObjectiveName(PluginName):
    """An entry that names an objective."""

    def convert(self, value: object) -> str:
        """The name of one that is there and without fault; an error for validators where it is none."""
        name = super().convert(value)
        found = self.registry.get(name)
        if not isinstance(found, Objective):
            raise invalid("is no objective", "Make it a hpcclear.Objective, see docs/extending.md")
        if not self.registry.is_ours(name):  # slow to load: for objectives of users alone
            from hpcclear.laws.objectives import check_objective

            with at(""):
                check_objective(found)
        return name


class Goal(Table):
    """A statistic of f over the random inputs of a case, or a formula of its design variables."""

    statistic: Statistic | None = None
    """Statistic of f: "mean", "deviation" (standard deviation), "quantile" (value that a fraction `level` of all machines stays
    below) or "exceedance" (fraction of machines above `limit`). "cost": sum of the costs of the study variables."""
    of: str | None = None
    """Response that the statistic refers to, such as "peak-contact-force"; default: the objective of the study."""
    formula: str | None = None
    """Instead of a statistic: a formula of numbers and nominal design variables (SI) with + - * / **, such as "m2 + m3"."""
    level: Level | None = None
    """For "quantile": fraction of machines below the value; default 0.95."""
    limit: Number = None
    """For "exceedance": threshold of f, SI."""

    def _check(self) -> None:
        if (self.statistic is None) == (self.formula is None):
            reason = "either a statistic or a formula is expected here"
            raise invalid(reason, 'Write statistic = "mean", say')
        if self.formula is not None:
            with at("formula", self.formula[:80]):
                names_in(self.formula)
        if self.statistic == "exceedance" and self.limit is None:
            raise invalid("the threshold is missing", "Add limit, the threshold of f", "limit")
        if self.of is not None and (self.statistic is None or self.statistic == "cost"):
            raise invalid("belongs to a statistic of a response", "Remove it", "of")
        for key, owner in (("level", "quantile"), ("limit", "exceedance")):
            if getattr(self, key) is not None and self.statistic != owner:
                raise invalid(f"belongs to {owner!r} alone", "Remove it", key)

    _priced: tuple[StudyVariable, ...] = PrivateAttr(())
    _place: int = PrivateAttr(0)

    def placed(self, place: int) -> None:
        """Take the place of its response among what is simulated of designs, from the study; 0 is f."""
        self._place = place

    @property
    def place(self) -> int:
        """Where its response stands among what is simulated of designs (`hpcclear.study.truth`)."""
        return self._place

    def priced_by(self, variables: tuple[StudyVariable, ...]) -> None:
        """Take the study variables that say what a design costs."""
        self._priced = variables

    @property
    def exact(self) -> bool:
        """Whether the design alone says what it is."""
        return self.formula is not None or self.statistic == "cost"

    def of_design(self, design: Mapping[str, Array | float]) -> Array:
        """Its value for a design, or for designs (n,), SI by name; of what is `exact`."""
        if self.formula is not None:
            return value_of(self.formula, design)
        return np.asarray(sum(one.costs(design[one.name]) for one in self._priced), dtype=float)

    @property
    def order(self) -> float:
        """Of a quantile: the share that stays below."""
        return 0.95 if self.level is None else self.level

    def alike(self, objective: str) -> tuple[object, ...]:
        """What it has in common with those that are the same for every design, as far as their spelling shows; `objective` of
        the study."""
        formula = "".join((self.formula or "").split())
        return self.statistic, self.limit, self.of or objective, formula, self.order

    def words(self, unit: str, shown: Callable[[float, str], str] = "{:g} {}".format) -> str:
        """What it is, for people: "95th percentile of f", "probability of f above 0.3 mm" by the `unit` of f; `shown`: how a
        limit in a unit is written."""
        if self.formula is not None:
            return self.formula
        what, unit = self._response(unit)
        if self.statistic == "quantile":
            number = f"{100 * self.order:.12g}"  # 0.9999999 is not the 100th
            place = "" if "." in number or number[:-1] == "1" else number[-1]
            end = {"1": "st", "2": "nd", "3": "rd"}.get(place, "th")
            return f"{number}{end} percentile of {what}"
        if self.statistic == "exceedance":
            return f"probability of {what} above {shown(self.limit or 0.0, unit)}"
        if self.statistic == "deviation":
            return f"standard deviation of {what}"
        return "cost" if self.statistic == "cost" else f"{self.statistic} of {what}"

    @property
    def usual(self) -> Usual:
        """Which of the statistics it is that are reported of every design."""
        if self.of is not None or (self.statistic == "quantile" and self.order != 0.95):
            return Usual.OTHER
        known = {"mean": Usual.MEAN, "deviation": Usual.DEVIATION, "quantile": Usual.PERCENTILE}
        return known.get(self.statistic or "", Usual.OTHER)

    def _response(self, unit: str) -> tuple[str, str]:
        """What it is of, "f" by the `unit` of f, and the unit."""
        if self.of is None:
            return "f", unit
        found = OBJECTIVES.get(self.of)
        return found.words.partition(",")[0], found.unit

    def unit(self, unit: str) -> str:
        """Its unit, "" for none known, by the `unit` of f."""
        own = self._response(unit)[1]
        return own if self.statistic in ("mean", "deviation", "quantile") else ""


class Constraint(Goal):
    """A constraint on the designs of a case."""

    most: Annotated[float, WithJsonSchema(NUMBER)]
    """Largest allowed value, SI; for "exceedance" a probability."""


MEAN, DEVIATION = Goal(statistic="mean"), Goal(statistic="deviation")


def in_si(case: object, objective: object, key: str) -> object:
    """A case's row, of a list one with these random inputs, with objectives for their words, and `limit` and `most` in SI by
    the unit of the study's objective.

    An error for validators where a limit is no number of that unit, or a word that decides the unit is not known; the key of
    a row begins with `key`.
    """
    if isinstance(case, (list, tuple)):
        return {"random": case}
    if not isinstance(case, Mapping):
        return case
    own = _quantity_of(objective, "objective")
    made = dict(case)
    for table in ("objectives", "constraints"):
        if isinstance(rows := made.get(table), (list, tuple)):
            made[table] = [_goal(row, own, f"{key}.{table}.{k}") for k, row in enumerate(rows)]
    return made


def _quantity_of(response: object, key: str) -> Quantity:
    """What values of a response are; plain numbers of what cannot be one, as its entry says; an error for validators where it
    is not known."""
    if not isinstance(response, str):
        return Quantity()
    with as_invalid(key):
        unit = getattr(OBJECTIVES.get(response), "unit", "")
    return Quantity(unit, least=0.0, why=NO_LESS) if response in OURS else Quantity(unit)


def _goal(row: object, own: Quantity, key: str) -> object:
    made = {"statistic": row} if isinstance(row, str) else row
    if not isinstance(made, Mapping):
        return row
    made, word = dict(made), made.get("statistic")
    if isinstance(word, str) and word not in (known := get_args(Statistic)):
        remedy = hint(word) + nearest(word, known)
        raise invalid("is not one of the known values", remedy, f"{key}.statistic", word)
    if isinstance(made.get("of"), str):
        own = _quantity_of(made["of"], f"{key}.of")
    most = own if word in ("mean", "quantile") else Quantity()
    if word == "deviation":
        most = replace(own, least=0.0, why=NO_LESS)
    if word == "exceedance":
        most = Quantity("", above=0, below=1, why="it is a probability")
    for name, its in (("limit", own), ("most", most)):
        if name in made:
            made[name] = its.convert(made[name], f"{key}.{name}")
    return made


class Case(Table):
    """One optimisation, with the random inputs that vary in it."""

    name: str
    random: tuple[str, ...]
    """Names of the inputs in `[study.random]` that are random. All others have the value of the design."""
    objectives: tuple[Goal, ...] | None = None
    """Objectives to minimise, one to five; default "mean" and "deviation" of f. The name of a statistic alone suffices
    if it needs no further entry."""
    constraints: tuple[Constraint, ...] | None = None
    """Constraints on the designs of the case."""

    def _check(self) -> None:
        if not NAME.fullmatch(self.name):  # it stands in names of files, figures and pages
            raise invalid("is not a name", "Use a letter, then letters, digits or _", key="name")
        if not self.random:
            raise invalid("without random inputs f does not scatter", "Name some", "random")
        if len(set(self.random)) < len(self.random):
            raise invalid("a random input is named twice", "Remove one", key="random")
        rows = self.goals
        if not rows:
            remedy = 'Add one, such as "mean" or { formula = "m2 + m3" }'
            raise invalid("a case needs an objective", remedy, "objectives")
        if len(rows) > len(ENDS):
            reason = f"with more than {len(ENDS)} objectives nearly every design is on the front"
            raise invalid(reason, "Use constraints, or combine some in one formula", "objectives")

    @property
    def goals(self) -> tuple[Goal, ...]:
        """The things that are made small."""
        return (MEAN, DEVIATION) if self.objectives is None else self.objectives

    @property
    def ends(self) -> tuple[str, ...]:
        """Names of the designs with the least of each: alpha of the first, beta of the second, and so on."""
        return tuple(f"{self.name} {end}" for end in ENDS[: len(self.goals)])

    @property
    def kept(self) -> tuple[Constraint, ...]:
        """What designs must keep to."""
        return self.constraints or ()

    @property
    def rows(self) -> dict[str, Goal]:
        """Objectives, then constraints, by their keys: "objectives.0"."""
        tables = {"objectives": self.goals, "constraints": self.kept}
        return {f"{name}.{k}": one for name, rows in tables.items() for k, one in enumerate(rows)}

    @property
    def plain(self) -> bool:
        """Whether mean and standard deviation are the only objectives."""
        return self.goals == (MEAN, DEVIATION) and not self.kept
