"""A file that is imported: its numbers and unit, its refusals, and names that a scene can have for those of the file."""

import math
import re
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple, NoReturn

from hpcclear.base.errors import InputError
from hpcclear.base.units import to_si
from hpcclear.scene.named import NAME

GROUND = "ground"
MOST_POINTS = 1000
"""Of a linkage: points are compared in pairs, and a file of more holds something else."""
LONGEST_NUMBER = 100
"""Characters."""
_LISTED = 12
"""Names in a line of the summary."""


class Names:
    """Names that a scene can have, each once, for those of a file.

    `kind`: what they name, in notes, such as "layer"; `prefix`: goes before a name that does not begin with a letter.
    """

    def __init__(self, kind: str, prefix: str) -> None:
        self.kind, self.prefix = kind, prefix
        self._counts = Counter({GROUND: 1, "center": 1})
        self._replaced: dict[str, str] = {}

    def given(self, text: str, default: str = "") -> str:
        """The name for one of the file, or for `default` where it has none: letters, digits and _, and not yet given."""
        text = text.strip()
        plain = re.sub(r"[^A-Za-z0-9_]+", "_", text or default).strip("_")[:30]
        name = made = plain if NAME.fullmatch(plain) else f"{self.prefix}{plain}"
        while self._counts[made]:
            self._counts[name] += 1
            made = f"{name}_{self._counts[name]}"
        self._counts[made] += 1
        if text and made != text:
            self._replaced[text[:60]] = made
        return made

    def notes(self) -> list[str]:
        """A sentence that says which names are replaced; none where all are kept."""
        if not self._replaced:
            return []
        pairs = [f"{old!r} is {new}" for old, new in self._replaced.items()]
        return [f"Names that a scene cannot have, by {self.kind}: {listed(pairs)}"]


def listed(words: Iterable[str]) -> str:
    """Words after each other, the first ones where they are many."""
    every = list(words)
    more = f" and {len(every) - _LISTED} more" if len(every) > _LISTED else ""
    return ", ".join(every[:_LISTED]) + more


def limit(count: int, key: str) -> None:
    """Raise InputError for more points, or parts of another kind, than a linkage has."""
    if count > MOST_POINTS:
        reason = f"has more points or bodies than a linkage: at most {MOST_POINTS}"
        raise InputError(key, count, reason, "Save the mechanism alone")


class File(NamedTuple):
    """A file that is imported, and what it is refused with."""

    path: Path
    data: bytes
    unit: str = ""
    """Of lengths, as the user states it."""
    again: str = "Save the file again"
    """What to do where the file is incomplete."""

    @property
    def key(self) -> str:
        """The file, in errors."""
        return str(self.path)

    def refuse(self, value: object, reason: str, remedy: str = "") -> NoReturn:
        """Raise InputError about a part of the file."""
        raise InputError(self.key, value, reason, remedy or self.again) from None

    def number(self, text: str, what: str) -> float:
        """A finite number; raises InputError where `what` is none."""
        try:
            value = float(text) if len(text) <= LONGEST_NUMBER else math.nan
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            self.refuse(text[:40], f"{what} is no finite number", "Save the file again")
        return value

    def scale(self, stated: float | None, words: str, where: str = "") -> float:
        """The unit of the lengths, m: that which the file states, if any, also in words; `where` it would, in errors.

        Raises InputError if neither the file nor the user says a unit, or they contradict each other.
        """
        given = to_si(f"1 {self.unit}", "m") if self.unit else stated
        if given is None:
            reason, remedy = "the file states no unit of lengths", "Add --unit, such as --unit mm"
            raise InputError(f"{self.key}{where}", "length", reason, remedy)
        if stated is not None and not math.isclose(stated, given, rel_tol=1e-9):
            reason = f"the file states {words}"
            raise InputError("--unit", self.unit, reason, "Leave --unit out, or correct the file")
        return given if stated is None else stated
