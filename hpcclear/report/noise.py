"""Impact and noise in one response, in words: what a revolution has of impacts in each joint, and how loud its forces are."""

import numpy as np

from hpcclear.report import bearings
from hpcclear.report.figures import labels
from hpcclear.results.content import Results, texts_in

HEADER = ("joint", "impacts", "energy lost", "in flight", "RMS force")
"""Columns of the rows of `joints`."""

TITLE = "Impacts, mean per revolution"

LOUDEST = 3
"""Third-octave bands that are named, the loudest first."""


def joints(response: Results) -> list[list[str]]:
    """Return a row of `HEADER` for each joint with clearance; none where the response has no measures of impact."""
    if "impact_energy" not in response:
        return []
    names, found = texts_in(response, "joint"), []
    for joint in (one.joint for one in bearings.bearings(response)):
        at = names.index(joint)
        ends = (response[name].values[at] for name in ("contact_loss", "contact_loss_limit"))
        loss, reach = (float(np.degrees(one)) for one in ends)
        flown = _with(loss, reach, "deg")
        impacts, lost, force = (
            _mean(response, name, at) for name in ("impacts", "impact_energy", "rms_contact_force")
        )
        found.append([joint, impacts, lost, flown, force])
    return found


def frame(response: Results) -> list[tuple[str, str]]:
    """Return what the force on the frame is, and its loudest third octaves, each with its name."""
    if "rms_frame_force" not in response:
        return []
    found = [("RMS force on the frame", _mean(response, "rms_frame_force"))]
    if "frame_force_level" in response:
        level = response["frame_force_level"].values
        order = np.argsort(-np.nan_to_num(level, nan=-np.inf))[:LOUDEST]
        loudest = zip(level[order], response["band"].values[order], strict=True)
        known = [f"{one:.1f} dB at {band_name(at)}" for one, at in loudest if np.isfinite(one)]
        found.append(("highest third octaves", f"{', '.join(known)} (re 1 µN)"))
    return found


def band_name(centre: float) -> str:
    """Return the nominal frequency of a third-octave band, IEC 61260-1: 1.25 kHz of 1259 Hz."""
    nominal = (1.0, 1.25, 1.6, 2.0, 2.5, 3.15, 4.0, 5.0, 6.3, 8.0)
    tenths = round(10.0 * np.log10(centre))
    value = nominal[tenths % 10] * 10.0 ** (tenths // 10)
    return f"{value / 1e3:g} kHz" if value >= 1e3 else f"{value:g} Hz"


def _mean(response: Results, name: str, at: int | tuple[()] = ()) -> str:
    value, reach = (float(response[one].values[at]) for one in (name, f"{name}_limit"))
    return _with(value, reach, str(response[name].attrs["units"]))


def _with(value: float, reach: float, unit: str) -> str:
    """A mean with its half-width; three digits where there are too few revolutions for one."""
    if not np.isfinite(reach):
        return labels.quantity(value, unit, 3)
    if reach <= 1e-3 * abs(value):
        return labels.quantity(value, unit, 4)
    return labels.with_half_width(value, reach, unit)
