"""What the figures of a response need beyond its variables: turns, steady part, clearances, f of each turn."""

from __future__ import annotations

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.results.content import Results, Variable, text_in, texts_in

TURN = 2.0 * np.pi


def phase(response: Results) -> Array:
    """Progress of the drive, rad, 2 pi a turn or swing, shape (time,); of a slider-crank the crank angle, which rises."""
    if "drive_phase" in response:
        return response["drive_phase"].values
    angle = response["crank_angle"].values
    return -angle if angle[-1] < angle[0] else angle


def turns(response: Results) -> Array:
    """The same in revolutions, shape (time,)."""
    return phase(response) / TURN


def turns_label(response: Results) -> str:
    """The label of an axis of `turns`."""
    return f"{'turns of the drive' if 'drive_phase' in response else 'crank angle'} (revolutions)"


def crank_angle(response: Results) -> tuple[Array, int]:
    """Crank angle times its sense (time,), rad, which rises, and the sense, -1 clockwise; of a drive that swings its phase."""
    angle, gone = response["crank_angle"].values, phase(response)
    sense = -1 if angle[-1] < angle[0] else 1
    # a body that a torque drives may be thrown back a little; one that swings gains nothing
    if "drive_phase" in response and abs(angle[-1] - angle[0]) < 0.5 * (gone[-1] - gone[0]):
        return gone, 1
    return sense * angle, sense


def whole_turns(response: Results) -> int:
    """How many whole revolutions, from one passage of phase 0 to the last, a response holds."""
    first, last = _passages(response)
    return last - first


def _passages(response: Results) -> tuple[int, int]:
    """Number of the first and of the last revolution's border; an instant that is missing there is forgiven."""
    angle = turns(response)
    slack = min(1.5 * float(np.max(np.diff(angle[:2]), initial=1e-6)), 0.02)
    return int(np.ceil(angle[0] - slack)), int(np.floor(angle[-1] + slack))


def latest(response: Results, revolutions: int = 2) -> Results:
    """The last whole revolutions; all there is of a response that ended in the first."""
    whole = whole_turns(response)
    return steady(response, min(revolutions, whole)) if whole > 0 else response


def steady(response: Results, revolutions: int | None = None) -> Results:
    """The last whole revolutions of a response, both ends included: half of them by default, what stands before counts as the
    transient. Raises InputError if the response holds fewer revolutions."""
    angle = turns(response)
    first, last = _passages(response)
    whole = last - first
    count = max(1, (whole + 1) // 2) if revolutions is None else revolutions
    if count < 1 or count > whole:
        reason = f"the response has {whole} whole revolutions"
        raise InputError("revolutions", count, reason, "Simulate more revolutions, or draw fewer")
    inside = (angle >= last - count - 1e-6) & (angle <= last + 1e-6)
    return response.isel(time=np.flatnonzero(inside))


def pins(response: Results) -> list[str]:
    """Labels of the joints of a response that are no corners of sliders in guides."""
    return [label for label in texts_in(response, "joint") if "." not in label]


def of_pins(response: Results) -> Results:
    """A response without the corners of sliders in guides; raises InputError where no other joint is left."""
    if not pins(response):
        reason = "no pin of this mechanism has clearance"
        raise InputError("joint", "", reason, "Draw the figure named guide")
    return response.sel(joint=pins(response))


def quantities(response: Results) -> list[tuple[str, str, str]]:
    """What responses are compared by: variable, joint or "", words."""
    named = enumerate(texts_in(response, "joint"), 1)
    found = [("contact_force", label, f"contact force {k} ({label})") for k, label in named]
    found.append(("crank_moment", "", "torque of the drive"))
    if "slider_acceleration" in response:
        found.append(("slider_acceleration", "", "slider acceleration"))
    return found


def followed(response: Results) -> tuple[Variable, Variable]:
    """Place and speed of the output: the slider, or a linkage's last body by its angle, or x or y if it does not turn."""
    if "slider_position" in response:
        return response["slider_position"], response["slider_velocity"]
    last = response.isel(body=-1)
    word, speed = "angle", last["body_spin"]
    if not speed.values.any():
        word = max("xy", key=lambda axis: float(np.ptp(last[f"body_{axis}"].values)))
        speed = last[f"body_v{word}"]
    name, place = text_in(last, "body"), last[f"body_{word}"]
    place.attrs["long_name"], speed.attrs["long_name"] = f"{word} of {name}", f"speed of {name}"
    return place, speed


def clearances(response: Results) -> Array:
    """Radial clearance of each pin, m, shape (joints,); NaN where there is none, or where it was never reached."""
    found = reaches(response)
    found[~np.isin(response["joint"].values, pins(response))] = np.nan
    return found


def reaches(response: Results) -> Array:
    """Eccentricity |e| at which each joint touches, m, shape (joints,): |e| less penetration in contact; NaN without any."""
    depth = response["penetration"].values
    reach, touching = eccentricity(response) - depth, depth > 0.0
    found = np.full(depth.shape[1], np.nan)
    for joint in np.flatnonzero(touching.any(axis=0)):
        found[joint] = np.median(reach[touching[:, joint], joint])
    return found


def contact(response: Results, joint: str) -> str:
    """Return how long a joint is in contact, in words: a share of the time, never rounded to 0 or 1."""
    touching = response["penetration"].sel(joint=joint).values > 0.0
    if touching.all() or not touching.any():
        return f"in {'contact' if touching.all() else 'flight'} at all instants stored"
    time = response["time"].values
    weight = np.gradient(time) if len(time) > 1 else np.ones(1)
    return f"in contact {part(float(weight @ touching / weight.sum()))} of the time"


def part(share: float) -> str:
    """Return a share of the time that is neither 0 nor 1 in words, which say neither."""
    return "> 99.9 %" if share > 0.999 else "< 0.1 %" if share < 0.001 else f"{100.0 * share:.1f} %"


def eccentricity(response: Results) -> Array:
    """Distance of journal centre and bearing centre, m, shape (time, 2)."""
    return np.hypot(response["eccentricity_x"].values, response["eccentricity_y"].values)


def objective_by_turn(response: Results) -> Array:
    """Objective f of every whole revolution, m, shape (revolutions,): time means over the instants of the file."""
    time, angle = response["time"].values, turns(response)
    first, last = _passages(response)
    borders = np.arange(first, last + 1)
    gap = np.abs(eccentricity(response) - reaches(response))
    squares = np.zeros(max(len(borders) - 1, 0))
    at = np.interp(borders, angle, time)
    for own in gap.T[~np.isnan(gap).any(axis=0)]:  # of joints with clearance
        steps = np.diff(time) * 0.5 * (own[1:] + own[:-1])
        total = np.interp(at, time, np.concatenate([[0.0], np.cumsum(steps)]))
        squares += (np.diff(total) / np.diff(at)) ** 2
    return np.sqrt(squares)


def section(response: Results, name: str | Variable | Array, phase: float = 0.0) -> Array:
    """A variable, by name or itself (t, ...), once a revolution, at the crank angle `phase` (rad): shape (revolutions, ...)."""
    angle, sense = crank_angle(response)
    phase = sense * phase
    first = np.ceil((angle[0] - phase) / TURN - 1e-6)
    last = np.floor((angle[-1] - phase) / TURN + 1e-6)
    at = phase + TURN * np.arange(first, last + 1)
    values = np.asarray(response[name] if isinstance(name, str) else name)
    columns = values.reshape(len(angle), -1).T
    found = np.column_stack([np.interp(at, angle, column) for column in columns])
    return found.reshape(len(at), *values.shape[1:])
