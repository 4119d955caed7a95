"""What modules of the report declare of the results that they show: figures, sections of the page, lines of the answer.

Each stands beside its code, in a tuple `PARTS` of its module or, of a figure, above its function
(`hpcclear.report.figures.style.figure`), and `declared` finds it there. What a file of a kind holds is declared in
`hpcclear.results.kinds`.
"""

import pkgutil
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache, partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, TypeVar

from hpcclear.report.html.content import Content
from hpcclear.report.spread import Line
from hpcclear.results.content import Results, text_in
from hpcclear.results.names import KINDS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Files = Mapping[str, Results]
"""Result files by their kinds."""


class FigureOf(NamedTuple):
    """A figure of one file, by the name that `hpcclear plot` gives it."""

    kind: str
    """Of the file; "map" for samples on a grid."""
    name: str
    draw: "Callable[..., Figure]"
    """From the file, and the one `beside` it or None."""
    caption: str | Callable[..., str]
    """On the page, or what makes it from the same files."""
    order: int = 0
    """Place among the figures of the kind."""
    beside: str = ""
    """Kind of another file that it takes; "" for none."""
    along: str = ""
    """A dimension that the file must have; "" for none."""

    @property
    def place(self) -> tuple[int, int]:
        """Place among all figures."""
        return KINDS["samples" if self.kind == "map" else self.kind].order, self.order

    def of(self, files: Files) -> "Callable[[], Figure]":
        """What draws it of these files, which its kind is among."""
        return partial(self.draw, *self._taken(files))

    def captioned(self, files: Files) -> str:
        """Its caption for these files."""
        return self.caption if isinstance(self.caption, str) else self.caption(*self._taken(files))

    def _taken(self, files: Files) -> list[Results | None]:
        return [files[self.kind], *([files.get(self.beside)] if self.beside else [])]


class SectionOf(NamedTuple):
    """A section of the page, which commands print with ``--details``."""

    place: int
    """Among all sections."""
    subject: str
    """Of the page, under which it is folded."""
    name: str
    title: str
    """name and title: its anchor, and its heading."""
    make: "Callable[..., Sequence[object] | None]"
    """From the file of its kind, if it names one, and all results to texts, tables and lines; None where nothing is to show."""
    kind: str = ""
    """Of the file without which there is nothing to show."""
    each: bool = False
    """Whether each of several samples has one by itself."""

    def parts(self, content: Content) -> Sequence[object]:
        """Its parts; none where there is nothing to show."""
        if not self.kind:
            return self.make(content) or ()
        return (self.kind in content.files and self.make(content.files[self.kind], content)) or ()


class Recommended(NamedTuple):
    """A verified study, to be put in words."""

    files: Files
    ours: Results
    """Designs of the case that the answer is about, of kind ``verification``."""
    best: Results
    """The recommended one of them."""

    def of_best(self, kind: str) -> Results | None:
        """What a file with a row for each design says of the recommended one; None where it says nothing."""
        found, name = self.files.get(kind), text_in(self.best, "design")
        known = found is not None and name in found["design"].values
        return found.sel(design=name) if found is not None and known else None


class LinesOf(NamedTuple):
    """Lines of the answer of a study, and what it advises to do next."""

    place: int
    """Among all lines."""
    lines: Callable[[Recommended], Iterable[Line]]
    steps: Callable[[Recommended], Iterable[str]] = lambda of: ()


Part = TypeVar("Part", FigureOf, SectionOf, LinesOf)


@cache
def _all() -> tuple[object, ...]:
    found = pkgutil.walk_packages([str(Path(__file__).parent)], f"{__package__}.")
    modules = [vars(import_module(one.name)) for one in found]
    figures = (getattr(one, "declared", None) for own in modules for one in own.values())
    return (*(part for own in modules for part in own.get("PARTS", ())), *figures)


def declared(sort: type[Part]) -> list[Part]:
    """All parts of a sort, in their order."""
    return sorted((one for one in _all() if isinstance(one, sort)), key=lambda one: one.place)
