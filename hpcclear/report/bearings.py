"""Loads of the bearings in one response: forces with their angles, contact, pressure, torque, and warnings."""

from collections.abc import Callable, Sequence
from operator import attrgetter
from typing import NamedTuple

import numpy as np

from hpcclear.base.arrays import Array, Booleans
from hpcclear.base.outcome import Flag
from hpcclear.report.figures import labels, motion
from hpcclear.report.html.content import scene_of
from hpcclear.results.content import Results, texts_in
from hpcclear.scene.points import Numbers

ROUNDING = 1e-12
"""Of the largest torque: a smaller mean is zero but for rounding."""

SENSITIVE = 0.01
"""Half-width over f beyond which f is reported as sensitive to initial conditions."""

REMARKS = labels.FLAGS | {Flag.TARGET_MISSED: "f is not known to numerics.target_error"}
WARNED = tuple(flag for flag in REMARKS if flag is not Flag.STIFF)
"""Flags that are warnings: all but notes."""


class Bearing(NamedTuple):
    """Loads of one joint with clearance over the averaged revolutions; NaN where unknown."""

    joint: str
    peak: float
    """Peak contact force, N; between the stored instants too."""
    angle: float
    """Crank angle of the peak, rad, 0 to 2 pi."""
    mean: float
    """Time mean of the contact force, N; from the impulse that every step adds to, where the response has it."""
    pressure: float
    """Mean force over the projected area 2 R_B L, Pa; the scene gives L for a film or for wear."""
    peak_pressure: float
    """Largest contact pressure at the peak force, Pa; the geometry of contact has it for lines and liners."""
    half_angle: float
    """Half of the angle over which the surfaces touch there, rad."""
    contact: float
    """Share of the time in contact."""
    gap: float
    """Mean distance of the journal centre from the clearance circle, m."""


class Torque(NamedTuple):
    """Torque of the drive over the averaged revolutions, N m."""

    peak: float
    """Of its absolute value, at the stored instants."""
    mean: float
    """Work of the drive over the angle that it turned; NaN where there are several drives, or one that swings."""


def bearings(response: Results) -> list[Bearing]:
    """Return the loads of each joint with clearance of a response (kind ``response``), in its order."""
    inside = averaged(response)
    areas = _projected_areas(response)
    found = []
    for k, joint in enumerate(texts_in(response, "joint")):
        peak, gap = (_known(response, name, k) for name in ("peak_contact_force", "mean_gap"))
        if gap == peak == 0.0:
            continue  # an ideal joint of a slider-crank
        mean, touching = _means(response, k, inside)
        names = ("peak_angle", "peak_contact_pressure", "contact_half_angle")
        angle, largest, half = (_known(response, name, k) for name in names)
        pressure = mean / areas.get(joint, np.nan)
        found.append(Bearing(joint, peak, angle, mean, pressure, largest, half, touching, gap))
    return found


def outside(result: Results) -> str:
    """Return what puts the contact model outside its range: the depth, of a response how deep, and the limit of Hertz theory;
    "" of a contact with a limit of its own (`hpcclear.laws.declared.Geometry.deepest`)."""
    scene = scene_of(result)
    if scene is None or not (law := scene.effects.contact) or law.declared.deepest is not None:
        return ""
    if "penetration" not in result:
        return "indentation above 25 % of clearance, Hertz' limit"
    deepest = np.nanmax(result["penetration"].values[averaged(result)], axis=0)
    get = Numbers(scene, None)
    limits = {one: scene.shape(one, get).deepest.item() for one in scene.contact_labels()}
    depths = dict(zip(limits, deepest[list(scene.open_places)].tolist(), strict=True))
    worst = max(limits, key=lambda name: depths[name] / limits[name])
    depth, limit = (labels.quantity(one[worst], "m") for one in (depths, limits))
    return f"indentation {depth} at stored instants in {worst}, Hertz' limit is {limit}"


def torque(response: Results) -> Torque:
    """Return the torque of the drive; NaN if no averaged revolution is stored."""
    inside = averaged(response)
    if not inside.any():
        return Torque(np.nan, np.nan)
    peak = float(np.abs(response["crank_moment"].values[inside]).max())
    # impacts fall between the stored instants of the torque; the work has each of them
    both = (response[name].values[inside] for name in ("driving_work", "crank_angle"))
    work, angle = (float(one[-1] - one[0]) for one in both)
    swings = abs(angle) < 0.5 * np.ptp(motion.phase(response)[inside])
    single = "drive_phase" not in response  # a slider-crank has one drive
    if not single and (scene := scene_of(response)):
        single = len(scene.linkage.drives) == 1
    if swings or angle == 0.0 or not single:
        return Torque(peak, np.nan)
    mean = work / angle
    return Torque(peak, mean if abs(mean) > ROUNDING * peak else 0.0)


def _means(response: Results, k: int, inside: Booleans) -> tuple[float, float]:
    """Time mean of the contact force of joint k, N, and its share of contact: of integrals over steps, else of instants."""
    if "contact_impulse" in response and "revolution" in response.sizes:
        time, turned = (one[inside] for one in (response["time"].values, motion.phase(response)))
        count = min(response.sizes["revolution"], response.attrs.get("keep_revolutions", np.inf))
        period, cycle = (float(np.ptp(one)) / count for one in (time, turned))
        flown = _known(response, "contact_loss", k) / cycle
        return _known(response, "contact_impulse", k) / period, min(max(1.0 - flown, 0.0), 1.0)
    weight = _weights(response["time"].values[inside])
    if not len(weight):
        return np.nan, np.nan
    touching = response["penetration"].values[inside, k] > 0.0
    return float(weight @ response["contact_force"].values[inside, k]), float(weight @ touching)


def remarks(response: Results) -> list[tuple[str, str]]:
    """Return every remark on a response as terminal and page print it: "Warning" or "Note", and its text."""
    found = []
    f, half_width = float(response["objective"]), float(response["objective_uncertainty"])
    if "regime" not in response and half_width > SENSITIVE * abs(f) > 0.0:
        found.append(("Warning", sensitive_words(half_width / abs(f), response)))
    found += [("Warning", text) for text in _gaining(response)]
    found += [("Warning", text) for text in str(response.attrs.get("cautions", "")).splitlines()]
    flags = int(response["flags"])
    kinds = [*(("Warning", flag) for flag in WARNED), ("Note", Flag.STIFF)]
    return [*found, *((label, REMARKS[flag]) for label, flag in kinds if flags & flag)]


def _gaining(response: Results) -> list[str]:
    """A sentence for each joint whose impacts gain energy, beyond the half-width of what they lose."""
    if "impact_energy" not in response:
        return []
    lost, reach = (response[name].values for name in ("impact_energy", "impact_energy_limit"))
    return [
        f"the impacts in {joint} gain energy, {labels.quantity(-float(lost[k]), 'J')} in a revolution: "
        "the contact law is not physical. Check the sign of its damping"
        for k, joint in enumerate(texts_in(response, "joint"))
        if lost[k] + reach[k] < 0.0
    ]


def share(contact: float) -> str:
    """Return a share of the time in words; a share that is not 0 or 1 is never rounded to it."""
    if not np.isfinite(contact):
        return "–"
    return f"{100 * contact:.0f} %" if contact in (0.0, 1.0) else motion.part(contact)


def pressures(found: Sequence[Bearing]) -> list[tuple[str, Callable[[Bearing], str]]]:
    """Return headings and cells of further columns of the bearings' table, of what some bearing has."""
    columns: list[tuple[str, str, Callable[[Bearing], str]]] = [
        ("mean pressure", "pressure", lambda one: labels.quantity(one.pressure, "Pa", 3)),
        ("half angle of contact", "half_angle", lambda one: _in_degrees(one.half_angle)),
        ("peak pressure", "peak_pressure", lambda one: labels.quantity(one.peak_pressure, "Pa", 3)),
    ]  # fmt: skip
    known = {entry for _, entry, _ in columns if any(np.isfinite(getattr(b, entry)) for b in found)}
    return [(title, shown) for title, entry, shown in columns if entry in known]


def _in_degrees(angle: float) -> str:
    return f"{np.degrees(angle):.0f} deg" if np.isfinite(angle) else "–"


def degrees(one: Bearing) -> str:
    """Return the crank angle of the peak in words, a dash where it is not known."""
    return _in_degrees(one.angle if one.peak > 0.0 else np.nan)


def sensitive_words(relative: float, content: Results) -> str:
    """Return the warning of a half-width of f that is so large, relative to f, of a response or samples."""
    remedy = "Set numerics.target_error for a mean with a confidence interval"
    # as files have of other objectives only; these have no steady means
    if "objective" in content.attrs:
        remedy = "Raise numerics.averaged_revolutions, and compare results of equal numbers of them"
    half_width = f"From replicas with other starts its half-width is {100 * relative:.0f} % of f"
    return f"f is sensitive to initial conditions or to the tolerance. {half_width}. {remedy}"


def averaged(response: Results) -> Booleans:
    """Return which instants (time,) lie in the averaged revolutions; all where the file does not say."""
    turned = motion.turns(response)
    first = int(response.attrs.get("transient_turns", 0))
    return turned - turned[:1] > first - 1e-6


def _known(response: Results, name: str, k: int) -> float:
    """A number of joint k; NaN where the response has none."""
    return float(response[name].values[k]) if name in response else np.nan


def _weights(time: Array) -> Array:
    """Weights of a time mean by the trapezoidal rule, shape (time,)."""
    if len(time) < 2:
        return np.ones(len(time))
    steps = np.diff(time)
    weights = 0.5 * (np.append(steps, 0.0) + np.append(0.0, steps))
    return weights / weights.sum()


def _projected_areas(response: Results) -> dict[str, float]:
    """2 R_B L of each joint whose length the scene gives, m^2."""
    if (scene := scene_of(response)) is None:
        return {}
    return {
        joint: 2.0 * one.bearing_radius * float(attrgetter(one.length_path)(one))
        for joint in scene.pins()
        if (one := scene.pin(joint)).length_path is not None
    }
