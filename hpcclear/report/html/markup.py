"""What templates are filled with: tables, sections, numbers made readable. Every text is escaped.

Sections of the page are plain content; how it looks is in the folder ``templates`` (jinja2).
"""

import base64
import functools
from collections.abc import Iterable, Sequence
from importlib import resources
from typing import TYPE_CHECKING

import numpy as np

from hpcclear.report.figures import labels

if TYPE_CHECKING:
    import jinja2


class Number(str):
    """A number made readable; tables align it right."""


class PageTable:
    """A table: texts, `Number` and badges (``kind``, ``words``) in rows, the first a heading."""

    def __init__(
        self, header: Sequence[object], rows: Iterable[Sequence[object]], caption: str
    ) -> None:
        self.header, self.rows, self.caption = list(header), [list(row) for row in rows], caption


def preformatted(text: str) -> dict[str, object]:
    """Text whose lines stay as they are."""
    return {"text": text}


def download(name: str, text: str) -> dict[str, object]:
    """A text to save as a file."""
    packed = base64.b64encode(text.encode("utf-8", "replace")).decode()
    return {"name": name, "link": f"data:text/plain;charset=utf-8;base64,{packed}"}


def folded(summary: str, parts: Sequence[object]) -> dict[str, object]:
    """Parts that open on request."""
    return {"summary": summary, "parts": list(parts)}


def render(template: str, **content: object) -> str:
    """A template filled with content; all text in it is escaped."""
    return _templates().get_template(template).render(**content)


@functools.cache
def _templates() -> "jinja2.Environment":
    import jinja2  # once a page is written

    made = jinja2.Environment(
        loader=jinja2.FunctionLoader(lambda name: asset(f"templates/{name}")), autoescape=True,
        undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True,
        finalize=_without_controls,
    )  # fmt: skip
    made.tests["number_text"] = lambda value: isinstance(value, Number)
    # the page's script relies on the order of entries, and NaN is no JSON
    kept = {"ensure_ascii": True, "allow_nan": False, "separators": (",", ":")}
    made.policies["json.dumps_kwargs"] = kept
    return made


def asset(name: str) -> str:
    """The text of a file that belongs to the page."""
    return resources.files(__package__).joinpath(name).read_text(encoding="utf-8")


_CONTROLS = {code: None for code in (*range(32), 127) if chr(code) not in "\n\t"}


def _without_controls(value: object) -> object:
    """A text without control characters, which no page may hold; finished markup as it is."""
    if hasattr(value, "__html__"):
        return value
    return str(value).translate(_CONTROLS)


def number(value: float, digits: int = 4) -> Number:
    """A number, a dash where there is none."""
    return Number(f"{value:.{digits}g}" if np.isfinite(value) else "–")


def quantity(value: float, units: str, digits: int = 4) -> Number:
    """A number with its unit, in a readable size."""
    return Number(labels.quantity(value, units, digits))
