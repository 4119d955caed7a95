"""What a directory of results holds, by kind."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from hpcclear.base.errors import InputError
from hpcclear.results import dataset
from hpcclear.results.content import Results
from hpcclear.results.grids import SHAPE
from hpcclear.scene import Scene
from hpcclear.scene.loading import scene_of_text


@dataclass(frozen=True)
class Content:
    """Results to report."""

    directory: Path
    files: dict[str, Results]
    """By kind; responses are apart."""
    responses: dict[str, Results] = field(default_factory=dict)
    """By the name of the design."""
    troubles: tuple[str, ...] = ()
    """What could not be read or does not belong together, a sentence each."""
    whole: bool = True
    """Whether this is all of a directory, not files that were chosen."""
    samples: dict[str, dict[str, Results]] = field(default_factory=dict)
    """Where several samples are all that there is, each with its run times, by the name of its file; `files` has the first."""
    dated: float = np.nan
    """Time at which the newest of these files was written, s since 1970."""

    @property
    def response(self) -> Results | None:
        """The response of the baseline design, else the first; None if there is none."""
        return self.responses.get("original", next(iter(self.responses.values()), None))

    @property
    def scene(self) -> Scene | None:
        """The scene of the results; None where that is not known."""
        return scene_in(self.attribute("scene"))

    def attribute(self, name: str) -> str:
        """A global attribute of the first file that has it."""
        every = [*self.files.values(), *self.responses.values()]
        return next((str(one.attrs[name]) for one in every if name in one.attrs), "")

    def each_of_samples(self) -> Iterator[tuple[str, "Content"]]:
        """The results with one of several samples at a time, by the name of its file."""
        for name, files in self.samples.items():
            yield name, replace(self, files=files, responses={}, samples={})


def read(*places: str | Path) -> Content:
    """Read the result files of a directory and of its ``responses``, or named files. Raises InputError where there are none."""
    chosen = [Path(place) for place in places]
    whole = len(chosen) == 1 and not chosen[0].is_file()
    place = chosen[0] if whole else chosen[0].parent
    files: dict[str, Results] = {}
    names: dict[str, str] = {}
    responses: dict[str, Results] = {}
    several: dict[str, dict[str, Results]] = {}
    troubles: list[str] = []
    others: list[str] = []
    found = dataset.each_in(place) if whole else ((one, dataset.read(one)) for one in chosen)
    dated = np.nan
    for path, one in found:
        if isinstance(one, InputError):
            troubles.append(f"{path.relative_to(place)} was left out: {one.reason}.")
            continue
        dated = np.fmax(dated, path.stat().st_mtime)
        kind = "map" if SHAPE in one.attrs else str(one.attrs["hpcclear_kind"])
        if kind in ("samples", "timing"):
            own = several.setdefault(str(path.with_suffix("")).removesuffix(".timing"), {})
            own[kind] = one
        if kind == "response":
            name = str(one.attrs.get("design", path.stem))
            responses[str(path.with_suffix("")) if name in responses else name] = one
        elif kind == "timing" and kind in files:
            continue  # of another result beside the first
        elif kind in files and (not whole or path.stem != kind):
            text = f"{path.name} was left out: {names[kind]} holds {kind} already."
            (others if kind == "samples" else troubles).append(text)
        else:
            files[kind], names[kind] = one, path.name
    stems = {name: Path(name).name for name in several}
    twice = [stem for stem in stems.values() if [*stems.values()].count(stem) > 1]
    named = {name if stem in twice else stem: several[name] for name, stem in stems.items()}
    samples = {name: own for name, own in named.items() if "samples" in own}
    if len(samples) < 2 or not files.keys() <= {"samples", "timing"}:
        samples, troubles = {}, [*troubles, *others]  # a study's own samples, or the only ones
    if not files and not responses:
        reason = "there is no result file in it"
        raise InputError("directory", str(place), reason, "Name the directory a run wrote to")
    scenes = {one.attrs["scene_hash"] for one in files.values() if "scene_hash" in one.attrs}
    if len(scenes) > 1:
        text = "The files in this directory were made from different scenes: do not compare them."
        troubles = [*troubles, text]
    return Content(place, files, responses, tuple(troubles), whole, samples, float(dated))


_loaded = lru_cache(maxsize=4)(scene_of_text)


def scene_in(text: str) -> Scene | None:
    """Return the scene of a file; None without it, or of another version."""
    try:
        return _loaded(text, "scene")
    except InputError:
        return None


def scene_of(content: Results) -> Scene | None:
    """Return the scene that results were made of; None where that is not known."""
    return scene_in(str(content.attrs.get("scene", "")))
