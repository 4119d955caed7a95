"""Files of other programs that hold a linkage: one file here for each format.

To add one: a module with `drawing_of(file)`, which returns a `Drawing` or refuses with the cause, and its line in `FORMATS`.
"""

from pathlib import Path
from types import ModuleType
from typing import NamedTuple

from hpcclear.base.errors import at, content_of
from hpcclear.base.units import to_si
from hpcclear.scene.importers import dxf, linkage2, pmks, table
from hpcclear.scene.importers.file import File
from hpcclear.scene.importers.points import Drawing, scene_of, summary, text_of

__all__ = ["FORMATS", "Drawing", "drawing_of", "scene_of", "summary", "text_of"]

LARGEST_FILE = 20_000_000


class Format(NamedTuple):
    """A kind of file."""

    name: str
    module: ModuleType
    """With `drawing_of`, and `begins`: whether a file is of this kind, by its first bytes."""
    again: str = "Save the drawing again"
    """What to do where it is incomplete."""


FORMATS = (
    Format("PMKS+ project or link", pmks, "Copy the whole link, or save the project again"),
    Format("Linkage document (.linkage2)", linkage2, "Save the document again"),
    Format("DXF drawing", dxf),
    Format("table of points", table),
)
"""Formats, in the order in which they are tried; the last takes what is left."""


def drawing_of(path: Path, unit: str = "") -> Drawing:
    """The linkage that a file holds, in any of `FORMATS`; `unit`: of lengths, where the file states none.

    A unit that contradicts the file is refused; of a drawing it is used and noted, since drawings often state that of a
    template. Raises InputError if no format fits the file, or the file has parts that a scene cannot have.
    """
    if unit:
        with at("--unit", unit):
            to_si(f"1 {unit}", "m")
    remedies = "Check the file", "Save the mechanism alone"
    data = content_of(path, "file", LARGEST_FILE, *remedies) if path.is_file() else b""
    found = next(one for one in FORMATS if one.module.begins(data[:4096]))
    made: Drawing = found.module.drawing_of(File(path, data, unit, found.again))
    return made
