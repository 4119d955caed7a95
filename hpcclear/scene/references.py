"""References to cells of a sheet, such as C5."""

import re
from functools import lru_cache

_PLACE = re.compile(r"\$?([A-Z]{1,3})\$?([0-9]{1,7})")


@lru_cache(2**14)
def place(reference: str) -> tuple[int, int]:
    """Row and column, from 1 on, of a reference such as C5."""
    found = _PLACE.fullmatch(reference)
    if found is None:
        raise ValueError(f"{reference[:20]!r} is no cell")
    column = 0
    for letter in found[1]:
        column = 26 * column + ord(letter) - 64
    return int(found[2]), column


def letters(column: int) -> str:
    """Name of a column by its number: C of 3."""
    made = ""
    while column:
        column, rest = divmod(column - 1, 26)
        made = chr(65 + rest) + made
    return made
