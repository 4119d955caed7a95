"""Quantities as their user wrote them: the text of each number that was read, and others in the units of such texts."""

import re
from collections import Counter
from contextlib import AbstractContextManager
from math import isfinite
from typing import NamedTuple

from hpcclear.base.holding import holding
from hpcclear.base.plain import plain
from hpcclear.base.units import TEXTS, factor, is_written_in, spelled

Texts = dict[tuple[float, str], str]
"""What was written for numbers, by their values and units in SI."""


class Reading(NamedTuple):
    """How an entry of a scene was read: its path, what was written there, and what that means; as a text a sentence."""

    entry: str
    written: str
    read: str

    def __str__(self) -> str:
        text = f"{self.entry}: {self.written!r} is read as {self.read}"
        return plain(" ".join(text.split()))


_SCALED = re.compile(r"[num\u00b5\u03bckMG]?(?:m|N|J|W|Pa|s|Hz)|k?g|rad")
"""Units that are shown in a size that is read well, whichever of them was written."""


def reading(texts: Texts) -> AbstractContextManager[None]:
    """Within it, texts of quantities that are read are kept in `texts`, and `shown` knows them."""
    return holding(TEXTS, texts)


def text_of(value: float, target: str) -> str:
    """What was written, with a unit, for a number (SI) of an entry in `target`; "" for another."""
    text = (TEXTS.get() or {}).get((value, spelled(target)), "")
    return text if is_written_in(text) else ""


def unit_for(target: str) -> str:
    """The unit in which most quantities in `target` were written; `target` itself where none was."""
    own = (one for (_, of), one in (TEXTS.get() or {}).items() if of == spelled(target))
    units = Counter(filter(None, map(is_written_in, own))).most_common(1)
    return units[0][0] if units else target


def other_unit(target: str) -> str:
    """The same, "" for a unit of SI with or without a prefix: that is shown in a size that is read well."""
    unit = unit_for(target)
    return "" if unit == target or _SCALED.fullmatch(unit) else unit


def shown(value: float, target: str, unit: str = "") -> str:
    """A number (SI) as it was written, any other with six digits in a unit, by default `unit_for`."""
    if text := text_of(value, target):
        return text
    plain = (TEXTS.get() or {}).get((value, spelled(target)), "")
    unit = target if plain else unit or unit_for(target)
    if unit == target or not isfinite(value):
        return f"{plain or f'{value:.6g}'} {target.replace('**', '').replace('*', ' ')}".rstrip()
    return f"{value / float(factor(unit, target)):.6g} {unit}"
