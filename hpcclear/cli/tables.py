"""Tables and lines on the terminal by rich, plain when piped; its import takes a tenth of a second."""

from collections.abc import Iterable, Sequence
from typing import Any

from rich import box
from rich.cells import cell_len
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
    return _PlainConsole(highlight=False, width=_room())


def _room() -> int:
    screen = Console(highlight=False, soft_wrap=False)
    return min(WIDTH, screen.width) if screen.is_terminal else WIDTH


def table(title: str, rows: Iterable[Sequence[str]], header: Sequence[str] = ()) -> Table:
    """Columns below their headings, as wide as the terminal allows; without these two: what, and its value.

    Where the columns are too narrow for their words, the rows stand beside each other if these are not; where both are, an
    interval may be broken.
    """
    made = Table(
        title=title or None, title_justify="left", box=box.SIMPLE_HEAD, show_header=bool(header), pad_edge=False
    )  # fmt: skip
    cells: Sequence[Sequence[str]] = [header or ("", ""), *rows]
    ties = ("_±_", " ± ") if header else ()
    ways = [(one, tie) for tie in ties for one in (cells, [*zip(*cells, strict=True)])]
    fitting = ((one, widths) for one, tie in ways if (widths := _widths(one, tie)))
    cells, widths = next(fitting, (cells, None))
    for k, head in enumerate(cells[0]):
        width = widths[k] if widths else None
        made.add_column(head, overflow="fold", no_wrap=not (header or k), width=width)
    for row in cells[1:]:
        made.add_row(*row)
    return made


def _widths(cells: Sequence[Sequence[str]], tie: str) -> list[int] | None:
    """Widths of columns that break no word, the widest narrowed alike; None if none fit. `tie`: in place of " ± "."""
    columns = [[one.replace(" ± ", tie) for one in column] for column in zip(*cells, strict=True)]
    natural, least = (
        [max(cell_len(part) for one in column for part in split(one) or [""]) for column in columns]
        for split in (str.splitlines, str.split)
    )
    room = _room() - 3 * len(columns) + 1  # between two columns stand three blanks, one at each end
    for most in range(max(natural), 0, -1):
        found = [max(word, min(whole, most)) for whole, word in zip(natural, least, strict=True)]
        if sum(found) <= room:
            return found
    return None
