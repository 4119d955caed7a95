"""Text from files and names as it may be shown on a terminal: no character in it commands the terminal."""

import unicodedata

_KEPT = "\n\t"
_CATEGORIES = ("Cc", "Cf", "Cs", "Zl", "Zp")
"""Of Unicode: control, format (such as those that turn the direction of text), surrogates, separators of lines."""


def plain(text: str) -> str:
    r"""Return a text with its control characters written out, as in ``\x1b``; line feeds and tabs stay."""
    if text.isascii() and text.isprintable():
        return text
    commands = {one for one in set(text) - {*_KEPT} if unicodedata.category(one) in _CATEGORIES}
    return text.translate({ord(o): o.encode("unicode_escape").decode() for o in commands})


def counted(number: int, noun: str, plural: str = "") -> str:
    """Return a number of things in words: "1 row", "2 rows"."""
    return f"{number} {noun if number == 1 else plural or noun + 's'}"
