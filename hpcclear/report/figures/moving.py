"""The mechanism in motion: its bodies by their points, and where they are at an instant."""

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.outcome import JOINTS
from hpcclear.report.figures import motion
from hpcclear.report.figures.placed import Pose
from hpcclear.results.content import Results, text_in, texts_in
from hpcclear.scene import Scene

Drawn = tuple[list[list[int]], Array, Array]
"""Which points each body has, where these are (t, points, 2), and the bodies' angles (t, bodies)."""


_OF_GUIDE = ("guide_offset", "guide_tilt")


def bodies(shown: Results) -> Drawn:
    """Return the bodies of a response (kind ``response``) at each instant."""
    return _slider_crank(shown, eccentricities(shown)) if "rod_x" in shown else _linkage(shown)


def eccentricities(shown: Results) -> Array:
    """Return journal centres from bearing centres, m, shape (t, joints, 2)."""
    return np.stack([shown[f"eccentricity_{axis}"].values for axis in "xy"], axis=-1)


def pairs(points: Array, e: Array) -> list[list[int]]:
    """Return the points of journal and bearing of each joint, which are always its eccentricity (t, joints, 2) apart."""
    count, found = points.shape[1], []
    for joint in range(e.shape[1]):
        off = points[:, :, None] - points[:, None, :] - e[:, joint, None, None]
        worst = np.abs(off).max(axis=(0, 3)) + np.where(np.eye(count) > 0, np.inf, 0.0)
        found.append([int(k) for k in np.unravel_index(int(worst.argmin()), worst.shape)])
    return found


def poses(scene: Scene, shown: Results, k: int) -> dict[str, Pose]:
    """Return where the bodies of a scene are at instant k of its response."""
    one = shown.isel(time=k)
    if "rod_x" not in shown:
        held = [one.isel(body=b) for b in range(shown.sizes["body"])]
        entries = ("body_x", "body_y", "body_angle")
        return {text_in(b, "body"): tuple(float(b[n]) for n in entries) for b in held}  # type: ignore[misc]
    phi, crank = float(one["crank_angle"]), scene.linkage.bodies[0].own_center[0]
    aside, tilt = (float(one[n].values[0]) if n in shown else 0.0 for n in _OF_GUIDE)
    height = aside + float(getattr(scene.mechanism, "offset", None) or 0.0)
    return {
        "crank": (crank * np.cos(phi), crank * np.sin(phi), phi),
        "rod": (float(one["rod_x"]), float(one["rod_y"]), float(one["rod_angle"])),
        "slider": (float(one["slider_position"]), height, tilt),
    }


def _slider_crank(shown: Results, e: Array) -> Drawn:
    """Points of crank, rod and slider.

    The length of the crank follows from the motion itself: the way to the crank pin is that to the rod's mass
    centre, back to the first bearing, plus the eccentricity; two equations an instant, linear in two lengths. So does the
    height of the slider, from the rod's other end.
    """
    rod = np.column_stack([shown["rod_x"].values, shown["rod_y"].values])
    phi, theta = shown["crank_angle"].values, shown["rod_angle"].values
    crank, along = (np.column_stack([np.cos(a), np.sin(a)]) for a in (phi, theta))
    known = {name: e[:, k] for k, name in enumerate(texts_in(shown, "joint"))}
    near_pin, far_pin = (known.get(name, np.zeros_like(rod)) for name in JOINTS)
    # crank length * crank = rod - u2 * along + e12
    both = np.column_stack([crank.ravel(), along.ravel()])
    pin = float(np.linalg.lstsq(both, (rod + near_pin).ravel(), rcond=None)[0][0]) * crank
    # from here along the rod to the slider's pin, which stays at one height but for clearance
    far = rod + far_pin
    slides = shown["slider_position"].values
    length = float((slides - far[:, 0]) @ along[:, 0] / (along[:, 0] @ along[:, 0]))
    aside, tilt = (shown[n].values[:, 0] if n in shown else np.zeros_like(phi) for n in _OF_GUIDE)
    height = float(np.mean(far[:, 1] + length * along[:, 1] - aside))
    slider = np.column_stack([slides, height + aside])
    points = np.stack([np.zeros_like(pin), pin, pin - near_pin, slider - far_pin, slider], axis=1)
    return [[0, 1], [2, 3], [4]], points, np.column_stack([phi, theta, tilt])


def _linkage(shown: Results) -> Drawn:
    owners = np.array([str(point).partition(".")[0] for point in shown["point"].values])
    bodies = [np.flatnonzero(owners == body).tolist() for body in texts_in(shown, "body")]
    points = np.stack([shown["point_x"].values, shown["point_y"].values], axis=-1)
    angles = shown["body_angle"].values
    # without the whole turns before, which would cost digits
    return bodies, points, angles - motion.TURN * np.floor(angles[0] / motion.TURN)
