"""HTML that is safe by construction: every text is escaped unless it was built here."""

import base64
import html
import json
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from hpcclear.report.figures import labels

_VOID = frozenset({"img", "input", "meta", "br", "hr"})


class Html(str):
    """Finished markup; plain strings are text."""


def text(content: object) -> Html:
    """A text as markup: escaped, without control characters."""
    if isinstance(content, Html):
        return content
    plain = "".join(c for c in str(content) if c in "\n\t" or (c >= " " and c != "\x7f"))
    return Html(html.escape(plain, quote=True))


def join(parts: Iterable[object]) -> Html:
    """Several pieces one after the other."""
    return Html("".join(text(part) for part in parts))


def tag(name: str, /, *content: object, **attributes: object) -> Html:
    """An element; attribute names as keywords (``class_``, ``aria_label``), None leaves one out."""
    words = [name]
    for key, value in attributes.items():
        if value is not None and value is not False:
            plain = key.rstrip("_").replace("_", "-")
            words.append(plain if value is True else f'{plain}="{text(value)}"')
    start = f"<{' '.join(words)}>"
    return Html(start if name in _VOID else f"{start}{join(content)}</{name}>")


def table(header: Sequence[object], rows: Iterable[Sequence[object]], caption: str) -> Html:
    """A table that scrolls by itself when the page is narrow; numbers (`Number`) are aligned right."""
    head = tag("tr", *(tag("th", cell, scope="col") for cell in header))
    body = []
    for row in rows:
        first = tag("th", row[0], scope="row")
        rest = (
            tag("td", cell, class_="number" if isinstance(cell, Number) else None)
            for cell in row[1:]
        )
        body.append(tag("tr", first, *rest))
    content = (tag("caption", caption), tag("thead", head), tag("tbody", *body))
    return tag(
        "div",
        tag("table", *content),
        class_="scroll",
        tabindex="0",
        role="region",
        aria_label=caption,
    )


class Number(str):
    """A number made readable."""


def number(value: float, digits: int = 4) -> Number:
    """A number, a dash where there is none."""
    return Number(f"{value:.{digits}g}" if np.isfinite(value) else "–")


def quantity(value: float, units: str, digits: int = 4) -> Number:
    """A number with its unit, in a readable size."""
    if not np.isfinite(value):
        return Number("–")
    scale = labels.scale(units, value)
    unit = "" if scale.unit == "–" else f" {scale.unit}"
    return Number(f"{value * scale.factor:.{digits}g}{unit}")


def image(png: bytes, words: str, width: int) -> Html:
    """A figure, inside the page."""
    source = "data:image/png;base64," + base64.b64encode(png).decode("ascii")
    return tag("img", src=source, alt=words, width=width, loading="lazy")


def data(content: Any, name: str) -> Html:
    """Content for the page's script: JSON that cannot end its element."""
    plain = json.dumps(content, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    safe = plain.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
    return Html(f'<script type="application/json" id="{name}">{safe}</script>')
