"""What a directory of results holds, by kind."""

from dataclasses import dataclass, field
from pathlib import Path

import xarray as xr

from hpcclear.base.errors import InputError
from hpcclear.results import dataset


@dataclass(frozen=True)
class Content:
    """Results to report."""

    directory: Path
    files: dict[str, xr.Dataset]
    """By kind; responses are apart."""
    names: dict[str, str]
    """The file each came from, by kind."""
    responses: dict[str, xr.Dataset] = field(default_factory=dict)
    """By the name of the design."""
    troubles: tuple[str, ...] = ()
    """What could not be read or does not belong together, a sentence each."""

    def get(self, kind: str) -> xr.Dataset | None:
        """The dataset of a kind, or None."""
        return self.files.get(kind)

    @property
    def is_compared(self) -> bool:
        """Whether values that a publication prints stand beside our designs."""
        return "mean_paper" in self.files.get("verification", ())

    def attribute(self, name: str) -> str:
        """A global attribute of the first file that has it."""
        every = [*self.files.values(), *self.responses.values()]
        return next((str(one.attrs[name]) for one in every if name in one.attrs), "")


def read(directory: str | Path) -> Content:
    """Read every result file of a directory and of its folder ``responses``.

    Raises
    ------
    InputError
        There is no such directory, or no result in it.
    """
    place = Path(directory)
    files: dict[str, xr.Dataset] = {}
    names: dict[str, str] = {}
    responses: dict[str, xr.Dataset] = {}
    troubles = []
    for path, one in dataset.each_in(place):
        if isinstance(one, InputError):
            troubles.append(f"{path.relative_to(place)} was left out: {one.reason}.")
            continue
        kind = str(one.attrs["hpcclear_kind"])
        if kind == "response":
            responses[str(one.attrs.get("design", path.stem))] = one
        elif kind in files and path.stem != kind:
            troubles.append(f"{path.name} was left out: {names[kind]} holds {kind} already.")
        else:
            files[kind], names[kind] = one, path.name
    if not files and not responses:
        reason = "there is no result file in it"
        raise InputError("directory", str(place), reason, "Name the directory a run wrote to")
    return Content(place, files, names, responses, (*troubles, *_strangers(files)))


def _strangers(files: dict[str, xr.Dataset]) -> list[str]:
    """Files that were made from different scenes."""
    hashes = {str(one.attrs["scene_hash"]) for one in files.values() if "scene_hash" in one.attrs}
    if len(hashes) > 1:
        return ["The files in this directory were made from different scenes: do not compare them."]
    return []
