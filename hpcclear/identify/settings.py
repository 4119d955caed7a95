"""What is to be identified, and from what: the words of the command and of the Python function."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hpcclear.base.errors import InputError
from hpcclear.ensemble.maps import number_of, range_of
from hpcclear.identify.signals import Sensor

MEMBERS = 256
"""Members for one unknown; each further one doubles them, to `MOST` at most."""

MOST = 1024


@dataclass(frozen=True)
class Settings:
    """Settings of `hpcclear.identify`; the command has an option for each."""

    unknown: str | Sequence[str]
    """``"PATH=LO:HI"``, such as ``"joints.crank_rod.clearance=10um:150um"``; uniform within the bounds beforehand."""
    signal: str | Path | Sequence[str | Path] = ()
    """A table for each date, with time or crank angle first; none for advice alone."""
    of: str | Sequence[str] = "crank_moment"
    """Columns that are used together: series of a response, ``frame_force_x``, ``acceleration_x BODY.POINT`` or
    ``impacts JOINT``."""
    date: str | Sequence[str] = ()
    """ISO dates of the tables, for the rate of growth."""
    limit: float | str | None = None
    """Of the unknowns, SI or with a unit: the time until it is reached."""
    band: str | None = None
    """``"LO:HI"``: frequencies that the sensor passes, Hz; the upper one is that of its anti-aliasing filter."""
    resonance: str | None = None
    """``"HZ:Q"``: mounting resonance and its quality factor, 10 without it."""
    gain_error: float = 0.0
    """Standard deviation of the sensor's calibration factor, relative."""
    angle_error: float | str = 0.0
    """Standard deviation of the crank-angle reference, rad or with a unit."""
    noise: float | None = None
    """Standard deviation of the sensor's noise in a sample over the RMS of the signal. With it, the scatter between
    revolutions is a feature."""
    pressure: str = ""
    """``"COLUMN=AREA"``: a measured pressure in the first table as a known load on the slider of a slider-crank."""
    advise: bool = False
    """Whether other signals are compared: expected half-widths by signal and number of revolutions."""
    members: int | None = None
    """Simulations, a power of two; 256 for one unknown by default, doubled by each further one."""

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Unknowns and their bounds."""
        return _several(self.unknown)

    @property
    def signals(self) -> tuple[Path, ...]:
        """Measured tables."""
        return tuple(map(Path, _several(self.signal)))

    @property
    def names(self) -> tuple[str, ...]:
        """Signals that are used together."""
        return tuple(dict.fromkeys(_several(self.of)))

    @property
    def dates(self) -> tuple[str, ...]:
        """Dates of the tables."""
        return _several(self.date)

    @property
    def sensor(self) -> Sensor:
        """The sensor; raises InputError where a word is no such number."""
        if self.noise is not None:
            number_of("--noise", str(self.noise), "", above=0.0)
        low, high = (self.band or "").partition(":")[::2]
        place, quality = (self.resonance or "").partition(":")[::2]
        return Sensor(
            range_of("--band", self.band or ":", (low or "0", high or "1e12"), "Hz", least=0.0),
            number_of("--resonance", place or "1e12", "Hz", above=0.0),
            number_of("--resonance", quality or "10", "", above=0.0),
            number_of("--gain-error", str(self.gain_error), "", least=0.0),
            number_of("--angle-error", str(self.angle_error), "rad", least=0.0),
        )

    def limit_in(self, unit: str) -> float | None:
        """Return the limit, SI, of unknowns of a unit."""
        return None if self.limit is None else number_of("--limit", str(self.limit), unit)

    def size(self) -> int:
        """Return the number of members, a power of two."""
        asked = self.members or min(MEMBERS * 2 ** (len(self.unknowns) - 1), MOST)
        return int(2 ** np.ceil(np.log2(max(asked, 32))))

    def key(self) -> dict[str, str]:
        """Return what makes its result, for the key of a run."""
        digests = [hashlib.sha256(read_bytes(one)).hexdigest()[:16] for one in self.signals]
        return {
            "unknowns": "; ".join(self.unknowns), "signals": ", ".join(self.names), "tables": ", ".join(digests),
            "dates": ", ".join(self.dates), "limit": repr(self.limit), "sensor": repr(self.sensor),
            "noise": repr(self.noise), "pressure": self.pressure, "advise": repr(self.advise), "members": repr(self.size()),
        }  # fmt: skip


def _several(words: Any) -> tuple[Any, ...]:
    """One or more words as a tuple."""
    return (words,) if isinstance(words, str | Path) else tuple(words)


def read_bytes(path: Path) -> bytes:
    """Return the content of a table; raises InputError where it cannot be read."""
    try:
        return path.read_bytes()
    except OSError as error:
        reason = f"cannot be read: {error.strerror}"
        raise InputError("--signal", str(path), reason, "Name a table of the signal") from None
