"""Where a run puts what is unfinished, and where one that starts anew puts its results."""

import os
from pathlib import Path

from hpcclear.base.errors import refused


def parts_of(output: Path) -> Path:
    """Where the finished samples of a single result file are kept until it is written."""
    return output.with_name(f".{output.name}.parts")


def fresh_sibling(path: Path) -> Path:
    """The first free name beside `path`: DIR-2, DIR-3, ... or OUT-2.nc, OUT-3.nc, ...

    A directory is made at once, so that two runs never get the same one; for a file (a name with
    a suffix) the lock of the run decides.
    """
    path = path.absolute()  # "." has no name
    number = 2
    while True:
        sibling = path.with_name(f"{path.stem}-{number}{path.suffix}")
        if path.is_dir() or path.suffix == "":
            sibling = path.with_name(f"{path.name}-{number}")
            try:
                sibling.mkdir()
                return sibling
            except FileExistsError:
                pass
            except OSError as error:
                raise refused(sibling, error) from None
        elif not any(os.path.lexists(place) for place in (sibling, parts_of(sibling))):
            return sibling
        number += 1
