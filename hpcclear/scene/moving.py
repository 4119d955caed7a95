"""Random inputs whose distributions depend on the design: variables drive their entries, or they are shares of its value."""

import itertools
import math
from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import TYPE_CHECKING

from hpcclear.base import quantiles
from hpcclear.scene.choices import input_entry
from hpcclear.scene.fields import check_known, invalid
from hpcclear.scene.named import Range
from hpcclear.scene.random_inputs import RandomInput
from hpcclear.scene.variables import Variable

MOST_EXTREMES = 1024
"""Designs at most at which a distribution that depends on the design is looked at."""


class Moving:
    """What a study knows of its random inputs at a design."""

    if TYPE_CHECKING:
        variables: tuple[Variable, ...]
        random: tuple[RandomInput, ...]

    def own_entries(self, variable: Variable) -> tuple[str, ...]:
        """Numbers of the scene that rows of a variable have, but for clearances of fits that a random input draws."""
        drawn = {
            path
            for row in self.random
            if any(path == f"random.{row.name}.fit" for path in variable.input_paths)
            for path in row.paths
        }
        return tuple(path for path in variable.entry_paths if path not in drawn)

    @cached_property
    def _drivers(self) -> dict[str, tuple[Variable, ...]]:
        """Variables that drive each random input."""
        return {
            row.name: tuple(
                one
                for one in self.variables
                if any(input_entry(path)[0] == row.name for path in one.input_paths)
            )
            for row in self.random
        }

    def drivers(self, row: RandomInput) -> tuple[str, ...]:
        """Names of the variables that drive entries of a random input."""
        return tuple(one.name for one in self._drivers[row.name])

    def moves(self, row: RandomInput) -> bool:
        """Whether the distribution of a random input depends on the design."""
        return bool(row.relative or self._drivers[row.name])

    def law(self, row: RandomInput, design: Mapping[str, float]) -> quantiles.Quantiles:
        """Distribution of a random input at a design (SI, by name): of its value where it is absolute, else of its difference
        from the design. What the design leaves out is as in the scene.

        Raises
        ------
        InputError
            Only a wear simulation gives its values.
        """
        if not self.moves(row):
            return row.law
        entries: dict[str, object] = {}
        for one in self._drivers[row.name]:
            if one.name in design:
                for path, value in one.drives(float(design[one.name])).items():
                    name, entry = input_entry(path)
                    if name == row.name:
                        entries[entry] = value
        found = self._changed(row, entries) if entries else row.law
        if row.relative and row.name in design:
            return quantiles.Scaled(found, abs(float(design[row.name])))
        return found

    @cached_property
    def _made(self) -> dict[tuple[object, ...], quantiles.Quantiles]:
        """Distributions that were made: those of fits are tables."""
        return {}

    def _changed(self, row: RandomInput, entries: Mapping[str, object]) -> quantiles.Quantiles:
        key = (row.name, *entries.items())
        if key not in self._made:
            if len(self._made) >= MOST_EXTREMES:
                self._made.clear()
            self._made[key] = row.changed(entries)
        return self._made[key]

    def reach(self, row: RandomInput) -> Range:
        """Least and largest value that counts of a random input, over all designs; of the difference from the design at the
        lower and at the upper bound of its variable, where it follows that."""
        spans = [self.law(row, design).span for design in self._extremes(row)] or [row.law.span]
        low, high = min(span[0] for span in spans), max(span[1] for span in spans)
        if row.relative:
            own = next(one for one in self.variables if one.name == row.name)
            return low * abs(own.bounds[0]), high * abs(own.bounds[1])
        return low, high

    def _extremes(self, row: RandomInput) -> Iterator[dict[str, float]]:
        """Designs between which the distribution of a random input changes; none where nothing drives it."""
        own = self._drivers[row.name]
        ends = [one.options if one.rows else one.bounds for one in own]
        if math.prod(len(one or ()) for one in ends) > MOST_EXTREMES:
            ends = [one and (one[0], one[-1]) for one in ends]
        if own:
            for values in itertools.product(*(one or () for one in ends)):
                yield dict(zip((one.name for one in own), values, strict=True))

    def check_laws(self) -> None:
        """An error for validators unless random inputs that variables drive are there, and make distributions at all their
        values."""
        owner: dict[str, str] = {}
        for variable in self.variables:
            for path in variable.input_paths:
                self._check_driven(variable, path)
                if owner.setdefault(path, variable.name) != variable.name:
                    raise invalid(
                        f"{variable.name} and {owner[path]} both drive {path}",
                        "Remove one",
                        f"variables.{variable.name}",
                    )
        for row in self.random:
            self._check_moving(row)

    def _check_driven(self, variable: Variable, path: str) -> None:
        name, entry = input_entry(path)
        key, known = f"variables.{variable.name}", {row.name: row for row in self.random}
        check_known(name, known, "is not a random input of this study", key)
        if "." not in entry and getattr(known[name], entry) is None:
            raise invalid(
                f"the random input {name} has no {entry}",
                f"Give study.random.{name}.{entry} the value of the design in this file",
                key,
            )

    def _check_moving(self, row: RandomInput) -> None:
        own = next((one for one in self.variables if one.name == row.name), None)
        if row.relative and (own is None or own.ratio is not None):
            raise invalid(
                "is a share of a number that no variable of this study has",
                f"Add study.variables.{row.name} with a range or values, or write it in SI",
                key=f"random.{row.name}.half_width",
            )
        if own is not None and not own.paths:
            raise invalid(
                "its variable has no numbers to scatter about",
                "Name another entry",
                key=f"random.{row.name}",
            )
        for design in self._extremes(row):
            try:
                self.law(row, design)
            except (ValueError, OverflowError) as error:
                shown = ", ".join(f"{name} = {value:g}" for name, value in design.items())
                raise invalid(
                    f"makes no distribution with {shown}: {getattr(error, 'reason', error)}",
                    "Narrow what drives it",
                    key=f"random.{row.name}",
                ) from None
