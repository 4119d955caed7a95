"""Text from files and names as it may be shown on a terminal: no character in it commands the terminal."""

import unicodedata

_KEPT = "\n\t"
_CATEGORIES = ("Cc", "Cf", "Cs", "Zl", "Zp")
"""Of Unicode: control, format (such as those that turn the direction of text), surrogates, separators of lines."""


def plain(text: str) -> str:
    r"""Return a text with its control characters written out, as in ``\x1b``; line feeds and tabs stay."""
    if text.isascii() and text.isprintable():
        return text
    return "".join(
        character.encode("unicode_escape").decode()
        if character not in _KEPT and unicodedata.category(character) in _CATEGORIES
        else character
        for character in text
    )
