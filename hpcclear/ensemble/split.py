"""Parts of a design that know nothing of each other, one a job of an array.

A part is an interval of the design's samples, with a file, a checkpoint and a lock of its own. What merging writes has the
bytes that one run would have written."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from hpcclear.base.errors import InputError
from hpcclear.ensemble.identity import sample_key
from hpcclear.scene import Scene
from hpcclear.scene.points import Points

MOST_PARTS = 100_000
_FORM = re.compile(r"(\d{1,6})/(\d{1,6})")


@dataclass(frozen=True)
class Part:
    """Part `number` of `count`, counted from 1."""

    number: int
    count: int

    @classmethod
    def parse(cls, words: str) -> Self:
        """From "3/20"; raises InputError."""
        found = _FORM.fullmatch(words.strip())
        number, count = (int(group) for group in found.groups()) if found else (0, 0)
        if not 1 <= number <= count <= MOST_PARTS:
            reason = "a part is its number and how many there are, as in 3/20"
            raise InputError("--part", words, reason, f"Write 1/N to N/N, N at most {MOST_PARTS}")
        return cls(number, count)

    def rows(self, samples: int) -> range:
        """Numbers of its samples, of so many; raises InputError if there are more parts than samples."""
        if samples < self.count:
            reason = f"the design has {samples} samples only"
            raise InputError("--part", str(self), reason, "Request fewer parts")
        return range(samples * (self.number - 1) // self.count, samples * self.number // self.count)

    def place(self, output: Path) -> Path:
        """Its file: beside the whole one, such as ``samples.part-03-of-20.nc``."""
        digits = len(str(self.count))
        number = f"part-{self.number:0{digits}}-of-{self.count}"
        return output.with_name(f"{output.stem}.{number}{output.suffix}")

    def key(self, scene: Scene, points: Points) -> dict[str, str]:
        """What makes a run of it what it is."""
        return {**sample_key(scene, points), "part": str(self)}

    def __str__(self) -> str:
        return f"{self.number}/{self.count}"


def whole(output: Path) -> list[Part]:
    """All parts of a result, by the names of the files that are there.

    Raises InputError: there is none, some are missing, or they are of different divisions.
    """
    escaped = (re.escape(word) for word in (output.stem, output.suffix))
    form = re.compile(r"{}\.part-(\d+)-of-(\d+){}".format(*escaped))
    found = filter(None, (form.fullmatch(path.name) for path in output.parent.glob("*")))
    counts = sorted({int(one[2]) for one in found})
    if not counts:
        reason = f"no part of it exists, such as {Part(1, 20).place(output).name}"
        remedy = "Run hpcclear sample with --part 1/20, 2/20, ..."
        raise InputError("output", str(output), reason, remedy)
    if len(counts) > 1:
        reason = f"parts of different divisions exist, by {' and by '.join(map(str, counts))}"
        raise InputError("output", str(output), reason, "Move the parts of one division away")
    every = [Part(number, counts[0]) for number in range(1, counts[0] + 1)]
    missing = [part for part in every if not part.place(output).exists()]
    if missing:
        shown = ", ".join(map(str, missing[:20])) + (", ..." if len(missing) > 20 else "")
        reason = f"of {counts[0]} parts {len(missing)} are missing"
        remedy = "Run hpcclear sample with each of these, then merge again"
        raise InputError("--part", shown, reason, remedy)
    return every
