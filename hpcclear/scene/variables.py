"""Study variables: which numbers of a scene a design chooses, and what they may be."""

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Annotated, Literal

import numpy as np
from pydantic import PrivateAttr

from hpcclear.base.arrays import Array
from hpcclear.base.errors import at, nearest
from hpcclear.scene import choices
from hpcclear.scene.choices import OF_INPUT, OF_RANDOM, CatalogueRow, Cost
from hpcclear.scene.fields import Bounds, Content, Entries, Number, Numbers, Quantity, invalid
from hpcclear.scene.named import NamedInput, Range, texts_in, with_paths
from hpcclear.scene.paths import described, quantities

LINK_INERTIAS = ("mechanism.crank.inertia", "mechanism.rod.inertia")
"""Entries that scale with m L^2/12."""
WEIGHT = Quantity("", least=0)
"""Of a load case."""


class StudyVariable(NamedInput):
    """A study variable: its name, the scene entries that it sets, and its bounds in SI or its allowed values."""

    range: Bounds = None
    """Lower and upper bound, SI."""
    ratio: Bounds = None
    """For an inertia: bounds of r = I / (m L^2 / 12), which is sampled instead of I."""
    step: Number = None
    """With `range`: designs have the lower bound plus whole multiples of this step, SI."""
    values: Numbers = None
    """Instead of a range: the allowed values, SI."""
    fits: tuple[str, ...] | None = None
    """Instead of a range: ISO 286 fits, such as "20 H7/f7", for the joints in `path` and for random inputs with the
    distribution "fit": `path = ["joints.crank_rod.fit", "random.C12.fit"]`."""
    catalogue: tuple[CatalogueRow, ...] | None = None
    """Instead of a range: rows of a catalogue. Each has a name, the same entries by their paths, and optionally a cost:
    `{ name = "6204", cost = 3, "joints.crank_rod.bearing_radius" = "10 mm" }`."""
    follows: tuple[str, ...] = ()
    """Entries it sets that are not numbers of the mechanism: fits of joints, and entries of random inputs such as
    "random.C12.half_width". Written as `path` or `paths`."""
    like: str | None = None
    """Entry that determines its unit if it sets random inputs. The study determines it."""
    over: Literal["worst"] | tuple[Annotated[float, WEIGHT], ...] | None = None
    """For load cases: each design is simulated at all values or rows of this variable. f is the largest result
    ("worst"), or the mean with these weights, one for each row."""
    cost: Cost | None = None
    """Cost of a design as a function of this value, for the statistic "cost" of a case."""

    _unit: str = PrivateAttr("")

    def _check(self) -> None:
        if not self.rows:  # while the kinds of the scene's loads are known
            own = quantities()[self.paths[0]] if self.paths else _of_input(self.__dict__)
            self._unit = own.unit
        if self.cost is not None:
            self._check_cost(self.cost)
        if self.over is not None:
            self._check_load_cases()
        if self.catalogue is not None:
            self._check_rows(self.catalogue)

    @staticmethod
    def _without_numbers(data: Mapping[str, object]) -> Mapping[str, object]:
        """The row with what it drives that is no number of the mechanism elsewhere, and ``paths`` of () if nothing is left."""
        if "catalogue" in data and "path" not in data:
            return {**data, "paths": texts_in(data.get("paths"))}
        given = texts_in(data.get("paths", data.get("path", ())))
        if data.get("follows") and not given:  # read before
            given = texts_in(data["follows"])
            if not given:
                raise invalid("holds no paths", "Write them as path or paths", key="follows")
        fits = [p for p in given if "fits" in data and p.endswith(".fit")]
        of_rows = [p for p in given if p.startswith(OF_RANDOM) or p in fits]
        if not of_rows:
            return data
        if len(of_rows) < len(given):
            odd = next(p for p in given if p not in of_rows)
            reason = f"{odd} is not of the same kind as {of_rows[0]}"
            raise invalid(reason, "Give it a variable of its own", "paths")
        for path in of_rows:
            if path.startswith(OF_RANDOM):
                _, entry = choices.input_entry(path)
                if (entry == "fit") != ("fits" in data):
                    reason = f"{path} is {'a fit' if entry == 'fit' else 'no fit'}"
                    raise invalid(reason, "Use fits = [...] for fits, else range or values", "path")
            elif f"{path.removesuffix('.fit')}.clearance" not in quantities():
                raise invalid(f"{path} is no fit of a joint", 'Write "joints.NAME.fit"', "path")
        kept = {key: value for key, value in data.items() if key != "path"}
        return {**kept, "paths": (), "follows": tuple(of_rows)}

    @classmethod
    def _of_file(cls, row: Entries) -> Entries:
        """The row with its paths, and numbers in the unit of these."""
        row, paths = with_paths(cls._without_numbers(row))
        kinds = [key for key in _KINDS if key in row]
        fields = tuple(cls.model_fields)
        for key in () if kinds else row:  # what is missing may be misspelt
            if key not in fields:
                raise invalid("is not a known key", nearest(key, fields), key)
        if len(kinds) != 1:
            raise invalid(
                "a variable needs a range or values, fits, a catalogue or, for an inertia, a ratio",
                "Add range = [lower, upper]" if not kinds else f"Keep one of {', '.join(kinds)}",
            )
        kind, over = kinds[0], row.get("over")
        if isinstance(over, list | tuple):
            row["over"] = [WEIGHT.convert(one, f"over.{k}") for k, one in enumerate(over)]
        elif over not in (None, "worst"):
            raise invalid("is no list of weights", 'Write over = "worst", or weights', "over")
        if "step" in row and kind != "range":
            raise invalid("belongs to a range", "Remove it, or give a range", "step")
        if kind in ("fits", "catalogue"):
            return cls._of_rows(row, kind, paths)
        if kind == "ratio":
            if len(paths) != 1 or paths[0] not in LINK_INERTIAS:
                reason = "only the inertia of crank or rod can be given as a ratio to m L^2/12"
                raise invalid(reason, "Write range = [lower, upper] instead", "ratio")
            return row | {"ratio": Quantity("", above=0).range(row["ratio"], "ratio")}
        known = [quantities()[path] for path in paths] or [_of_input(row)]
        if kind == "range":
            row["range"] = [one.range(row["range"], "range") for one in reversed(known)][-1]
            if "step" in row:
                row["step"] = Quantity(known[0].unit, above=0).convert(row["step"], "step")
                choices.grid(row["range"][0], row["range"][1], row["step"])
        else:
            read = [one.several(row["values"], "values", 2, choices.MOST) for one in known[::-1]]
            found = read[-1]
            if len(set(found)) < len(found):
                raise invalid("a value stands there twice", "Remove one", "values")
            row["values"] = tuple(sorted(found))
            if isinstance(weights := row.get("over"), list | tuple) and len(weights) == len(found):
                row["over"] = [one for _, one in sorted(zip(found, weights, strict=True))]
            if isinstance(cost := row.get("cost"), list | tuple):
                _same_length(cost, found)  # costs stay with their values
                row["cost"] = [one for _, one in sorted(zip(found, cost, strict=True))]
        if "cost" in row:
            row["cost"] = Cost.in_si(row["cost"], known[0].unit)
        return row

    @classmethod
    def _of_rows(cls, row: Content, kind: str, paths: tuple[str, ...]) -> Content:
        given, follows = row[kind], texts_in(row.get("follows"))
        if not isinstance(given, (list, tuple)):
            raise invalid("a list is expected here", "Write it in [ ]", kind)
        if kind == "catalogue" and (paths or follows):
            raise invalid("has paths in its rows", "Remove it", "path")
        if kind == "fits":
            odd = [path for path in (*paths, *follows) if not path.endswith(".fit")]
            if odd or not follows:
                reason = f"{odd[0]} is no fit of a joint" if odd else "does not say which joint"
                raise invalid(reason, 'Add path = "joints.NAME.fit"', "path")
            for k, one in enumerate(given):
                with at(f"fits.{k}", one):
                    choices.rows_of_fits([one], ())
            choices.checked_names(given, "fits")
        if "cost" in row:
            if isinstance(row["cost"], list | tuple):
                _same_length(row["cost"], given)
            row["cost"] = Cost.in_si(row["cost"], "", given if kind == "fits" else ())
        return row

    def _check_cost(self, cost: Cost) -> None:
        options = self.options
        if cost.options is not None and options is None:
            remedy = 'Write cost = { law = "reciprocal", at = ..., cost = ... }'
            raise invalid("names options, but the variable has none", remedy, "cost")
        if cost.options is not None:
            _same_length(cost.options, options or ())
        elif self.rows:
            reason = "is a law of a number, but the variable has rows"
            raise invalid(reason, "Write cost = [...], one for each", "cost")
        if cost.law == "reciprocal" and self.bounds[0] <= 0.0:
            raise invalid("has no value at 0 or below", "Give bounds above 0", "cost")

    def _check_load_cases(self) -> None:
        if self.options is None or self.step is not None:
            remedy = "Write values = [...] or catalogue = [...] in place of the range"
            raise invalid("load cases are values or rows of a catalogue", remedy, "over")
        if self.silent or self.cost is not None:
            reason = "load cases change the mechanism, and no design chooses them"
            raise invalid(reason, "Remove it", "over")
        weights = () if self.over == "worst" else self.over
        if weights and (len(weights) != len(self.options) or not sum(weights) > 0.0):
            reason = f"{len(self.options)} load cases need as many weights, some of them above 0"
            raise invalid(reason, 'Give each a weight, or write over = "worst"', "over")

    def _check_rows(self, rows: tuple[CatalogueRow, ...]) -> None:
        choices.checked_names([row.name for row in rows], "catalogue")
        for row in rows:
            if odd := sorted(row.entries.keys() ^ rows[0].entries.keys()):
                reason = f"row {row.name!r} and row {rows[0].name!r} differ in {odd[0]}"
                raise invalid(reason, "Give each row the same entries", "catalogue", row.name)
        priced = [row.cost is not None for row in rows]
        if any(priced) and (not all(priced) or self.cost is not None):
            reason = "some rows have a cost and others have none, or there is a cost besides"
            raise invalid(reason, "Give each row a cost", "catalogue")

    @cached_property
    def rows(self) -> tuple[CatalogueRow, ...]:
        """Rows of a catalogue or of fits; empty for other variables."""
        if self.fits is not None:
            return choices.rows_of_fits(self.fits, self.follows)
        return self.catalogue or ()

    @cached_property
    def entry_paths(self) -> tuple[str, ...]:
        """Numbers of the scene that its rows have."""
        own = self.rows[0].entries if self.rows else {}
        return tuple(path for path in own if not path.startswith(OF_RANDOM))

    @property
    def input_paths(self) -> tuple[str, ...]:
        """Entries of random inputs that it drives."""
        own = self.rows[0].entries if self.rows else self.follows
        return tuple(path for path in own if path.startswith(OF_RANDOM))

    @property
    def silent(self) -> bool:
        """Whether it drives random inputs alone, so that f knows nothing of it."""
        return not self.paths and not self.entry_paths

    @cached_property
    def options(self) -> tuple[float, ...] | None:
        """All that its column may be, in rising order; None for a continuous variable."""
        if self.rows:
            return tuple(map(float, range(len(self.rows))))
        if self.step is not None:
            assert self.range is not None  # by validation
            return choices.grid(*self.range, self.step)
        return self.values

    def entries(self, value: float) -> dict[str, float]:
        """Numbers of the scene where its column is a value, SI."""
        if not self.rows:
            return dict.fromkeys(self.paths, value)
        own = self.rows[int(value)].entries
        return {path: float(own[path]) for path in self.entry_paths}

    def drives(self, value: float) -> dict[str, float | str]:
        """Entries of random inputs where its column is a value."""
        own = self.rows[int(value)].entries if self.rows else {}
        return {path: own.get(path, value) for path in self.input_paths}

    def costs(self, values: Array | float) -> Array | float:
        """What designs cost by its column, a number or (n,); 0 where it says nothing."""
        if self.cost is not None:
            return self.cost.of(values, self.options)
        if self.rows and self.rows[0].cost is not None:
            return np.array([row.cost for row in self.rows])[np.asarray(values, dtype=int)]
        return 0.0 * values

    @property
    def priced(self) -> bool:
        """Whether it says what designs cost."""
        return self.cost is not None or bool(self.rows and self.rows[0].cost is not None)

    @property
    def unit(self) -> str:
        """SI unit of its value, "" for none."""
        return self._unit

    @property
    def words(self) -> str:
        """What it drives, in words: "mass of the rod"."""
        if self.rows:
            return "fit" if self.fits is not None else "row of the catalogue"
        if not self.paths:
            return " and ".join(
                "{1} of the random input {0}".format(*choices.input_entry(path)).replace("_", " ")
                for path in self.input_paths
            )
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
        if self.rows:  # as much for the first and the last row as for the others
            return -0.5, len(self.rows) - 0.5
        if self.values is not None:
            return self.values[0], self.values[-1]
        bounds = self.range if self.ratio is None else self.ratio
        assert bounds is not None  # one of them is there, by validation
        return bounds


_KINDS = ("range", "ratio", "values", "fits", "catalogue")


def _of_input(row: Content) -> Quantity:
    """Unit and bounds of a variable that drives entries of random inputs."""
    entries = {choices.input_entry(path)[1] for path in row.get("follows") or ()}
    if len({OF_INPUT[entry] for entry in entries}) > 1:
        raise invalid("the paths have different units", "Use a variable for each unit", key="path")
    like = str(row.get("like"))
    unit = quantities()[like].unit if like in quantities() and OF_INPUT[min(entries)] else ""
    signed = entries & {"mean", "location", "bore.cpk", "pin.cpk"}
    return Quantity(unit) if signed else Quantity(unit, above=0)


def _same_length(cost: Sequence[object], options: Sequence[object]) -> None:
    if len(cost) != len(options):
        raise invalid(f"{len(cost)} costs for {len(options)} options", "Give each a cost", "cost")
