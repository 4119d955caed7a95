"""Tables and lines on the terminal by rich, plain when piped; its import takes a tenth of a second."""

from collections.abc import Iterable, Sequence
from typing import Any

from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from hpcclear.base.plain import plain
from hpcclear.ranks.terminal import WIDTH, clear


class _PlainConsole(Console):
    """Shows texts as they are: nothing in them is markup, and nothing commands the terminal."""

    def render_str(self, text: str, **options: Any) -> Text:
        """Make a text of a string, for lines, titles and cells alike."""
        return super().render_str(plain(text), **{**options, "markup": False, "emoji": False})


def console() -> Console:
    """Standard output; at most 80 columns, colours only on a terminal."""
    clear()
    screen = Console(highlight=False, soft_wrap=False)
    width = min(WIDTH, screen.width) if screen.is_terminal else WIDTH
    return _PlainConsole(highlight=False, width=width)


def table(title: str, rows: Iterable[Iterable[str]], header: Sequence[str] = ()) -> Table:
    """Columns below their headings, as wide as the terminal allows; without these two: what, and its value."""
    made = Table(
        title=title or None, title_justify="left", box=box.SIMPLE_HEAD, show_header=bool(header), pad_edge=False
    )  # fmt: skip
    for k, head in enumerate(header or ("", "")):
        made.add_column(head, overflow="fold", no_wrap=not (header or k))
    for row in rows:
        made.add_row(*row)
    return made
