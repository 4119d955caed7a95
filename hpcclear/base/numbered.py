"""Rows of a flat buffer, numbered one behind the other as they are declared: what each holds, its unit, who requires it."""

from typing import NamedTuple


class NumberedRow(NamedTuple):
    """What was declared: so many rows from the first on."""

    first: int
    size: int
    unit: str
    """SI, "" of a plain number, of a flag, and of rows that hold several things."""
    words: str
    asked_by: str
    """The effect that has a rate integrated; "" for none."""


class RowNumbers:
    """Numbers rows: each call declares some and returns the first of them."""

    def __init__(self) -> None:
        self.end = 0
        self.declared: list[NumberedRow] = []

    def __call__(self, words: str, unit: str = "", size: int = 1, asked_by: str = "") -> int:
        """Declare `size` rows behind those that there are."""
        row = NumberedRow(self.end, size, unit, words, asked_by)
        self.declared.append(row)
        self.end += size
        return row.first
