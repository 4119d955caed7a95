"""Measures of impact and noise of one response: by revolution, means with confidence intervals, spectra of its forces."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.response.steps import Steps
from hpcclear.dynamics.stepping import record as rec
from hpcclear.statistics import spectra

FEWEST_INSTANTS = 64
"""Instants a revolution from which on there are spectra."""


def _columns(first: int, size: int = at.MAX_JOINTS) -> slice:
    start = int(np.flatnonzero(first == rec.MEASURES)[0])
    return slice(start, start + size)


@dataclass
class Turns:
    """Integrals of the measures at the ends of revolutions, from steps as they come."""

    ends: dict[int, tuple[float, Array]] = field(default_factory=dict)
    """Time and integrals since the start, by the revolutions finished."""

    def take(self, steps: Steps) -> None:
        """Note the revolutions that end between rows of these steps."""
        closing = np.flatnonzero(np.diff(steps.revolution) > 0)
        for k in closing:
            self.ends[int(steps.revolution[k]) + 1] = (steps.time[k], steps.measures[k].copy())

    def finish(self, steps: Steps) -> None:
        """Note that the last revolution ends with the last of these steps."""
        last = int(steps.revolution[-1]) + 1
        self.ends[last] = (steps.time[-1], steps.measures[-1].copy())

    def averaged(self, transient: int) -> tuple[Array, Array]:
        """Lengths (r,) of the revolutions after the transient, and integrals over them (r, measures)."""
        numbers = [n for n in sorted(self.ends) if n >= transient]
        start = (0.0, np.zeros(len(rec.MEASURES)))
        ends = [self.ends.get(transient, start), *(self.ends[n] for n in numbers if n > transient)]
        times = np.array([time for time, _ in ends])
        return np.diff(times), np.diff(np.array([one for _, one in ends]), axis=0)


def by_revolution(
    periods: Array, integrals: Array, cycle: float, joints: int, *, rigid: bool
) -> dict[str, Array]:
    """Measures of each revolution, (r, joints) or (r,), by the names of `hpcclear.base.outcome.IMPACTS`.

    Lengths (r,) and integrals (r, measures) of revolutions, the angle in rad of one, and how many joints there are. The force
    on the frame is left out where bodies are not `rigid`.
    """
    mean = integrals / periods[:, None]

    def of(row: int) -> Array:
        return np.asarray(integrals[:, _columns(row, joints)])

    found = {
        "impacts": of(at.BEGUN),
        "impact_energy": of(at.IMPACT_POWERS),
        "contact_impulse": of(at.FORCE),
        "contact_loss": of(at.FLIGHTS) / periods[:, None] * cycle,
        "rms_contact_force": np.sqrt(np.maximum(mean[:, _columns(at.FORCE_SQUARES, joints)], 0.0)),
    }
    if rigid:
        frame = mean[:, _columns(at.FRAME_X, 2)]
        square = mean[:, _columns(at.FRAME_SQUARE, 1)][:, 0] - (frame**2).sum(axis=1)
        found["rms_frame_force"] = np.sqrt(np.maximum(square, 0.0))
    return found


def measured(
    periods: Array, integrals: Array, cycle: float, joints: int, *, rigid: bool
) -> dict[str, Array]:
    """What `by_revolution` gives as the file has it: of each revolution (r, joints), of all of them (joints,), and half-widths.

    Arguments as of `by_revolution`.
    """
    each = by_revolution(periods, integrals, cycle, joints, rigid=rigid)
    together = by_revolution(
        periods.mean(keepdims=True),
        integrals.mean(axis=0, keepdims=True),
        cycle,
        joints,
        rigid=rigid,
    )
    result = {}
    for name, values in each.items():
        result[f"{name}_by_revolution"] = values
        result[name] = together[name][0]
        result[f"{name}_limit"] = spectra.half_width(values)
    return result


def spectral(series: Mapping[str, Array], periods: Array, count: int) -> dict[str, Array]:
    """Order spectra and third-octave levels of the forces of the last revolutions of a response, with the bands' middles.

    Series of `contact_force` (t, joints) and, where it is known, `frame_force_x` and `frame_force_y` (t,), that end with an
    instant at the end of the last revolution; `periods` (r,) of the revolutions; `count`: instants a revolution. Nothing of too
    few instants.
    """
    revolutions = len(periods)
    if count < FEWEST_INSTANTS or not revolutions:
        return {}

    def squares(name: str) -> Array:
        values = series[name][-1 - revolutions * count :]
        starts = count * np.arange(revolutions)[:, None]
        values = values.reshape(len(values), -1)[starts + np.arange(count + 1)]
        return np.stack(
            [spectra.orders(values[:, :, j])[:, :most] for j in range(values.shape[2])], axis=-1
        )

    most = spectra.highest(count)
    forces = {"contact_force": squares("contact_force")}
    if "frame_force_x" in series:
        forces["frame_force"] = (squares("frame_force_x") + squares("frame_force_y"))[:, :, 0]
    centres = spectra.band_centres(1.0 / periods.max(), most / periods.max())
    found: dict[str, Array] = {"order": np.arange(1.0, most + 1), "band": centres}
    for name, one in forces.items():
        found[f"{name}_orders"] = np.sqrt(one.mean(axis=0))
        flat = one.reshape(revolutions, most, -1)
        bands = np.stack(
            [spectra.in_bands(flat[..., j], periods, centres) for j in range(flat.shape[2])], -1
        ).reshape(revolutions, len(centres), *one.shape[2:])
        ends = ("", "_lower", "_upper")
        found |= {
            f"{name}_level{end}": level
            for end, level in zip(ends, spectra.levels(bands), strict=True)
        }
    return found
