"""From a scene and its points to the numbers the kernel reads: parameters, start states, effects, tolerances."""

from typing import Any

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.explicit.tableau import DORMAND_PRINCE, TABLEAUS, Tableau
from hpcclear.dynamics.implicit.stiff import STEEP
from hpcclear.dynamics.lanes import Problem
from hpcclear.dynamics.physics import contact
from hpcclear.dynamics.stepping.lifecycle import STATE
from hpcclear.scene import Scene
from hpcclear.scene.points import Points

LEAST_AVERAGED = 10
"""Revolutions before an automatic average may end: fewer say nothing about its standard error."""

IMPLICIT_METHODS = {"switching": "stiff", "radau": "always"}
TIGHT = 1e-9
"""Relative tolerance from which "auto" integrates a single response by collocation: two methods agree to about this."""
STIFF_RAMP = STEEP
"""Friction coefficient over ramp speed, s/m, from which "auto" compiles the implicit method: the steeper, the stiffer."""
STIFF_DAMPING = 10.0
"""Fixed damping factor in s/m, or coefficient of a law with restitution, from which it does."""
"""Methods that may take implicit steps, and when.

Not yet "auto": the implicit steps' energy balance is looser than the explicit method's at the same tolerance.
"""

CELLS = 2048
"""Cells of a tabulated torque or load over one turn."""


class Numbers:
    """The scene's numbers, a column of the points where one drives the entry: ``numbers("drive.speed")``."""

    def __init__(self, scene: Scene, points: Points | None) -> None:
        self.scene = scene
        self.points = points
        self.size = 1 if points is None else len(points)
        self._columns = {}
        if points is not None:
            for k, paths in enumerate(points.paths):
                self._columns.update(dict.fromkeys(paths, points.values[:, k]))

    def __call__(self, path: str) -> Array:
        """Values of an entry, shape (size,), SI."""
        column = self._columns.get(path)
        return np.full(self.size, self.scene.number(path)) if column is None else column


def topology(scene: Scene) -> tuple[bool, bool, bool]:
    """Whether O12 is open, O23 is open, and the crank is free."""
    open_joints = scene.clearance_joints()
    return "crank_rod" in open_joints, "rod_slider" in open_joints, scene.drive.kind == "torque"


def coordinate_count(scene: Scene) -> int:
    """Coordinates that are integrated; 0 leaves closed-form kinematics."""
    if scene.numerics.formulation == "baumgarte":
        return at.MAX_COORDINATES
    first, second, free = topology(scene)
    return {0: 0, 1: 2, 2: 4}[first + second] + free


def effects_of(scene: Scene, *, series: bool = False, ledger: bool | None = None) -> at.Effects:
    """Which branches of the kernel are compiled for this scene."""
    first, second, free = topology(scene)
    e = scene.effects
    law = None if e.contact is None else e.contact.law
    is_table = lambda x: isinstance(x, tuple)  # noqa: E731
    on = {
        "crank_rod": first,
        "rod_slider": second,
        "fixed": law == "hunt-crossley",
        "latched": law in contact.LATCHED_LAWS,
        "coulomb": e.friction.law == "coulomb",
        "ambrosio": e.friction.law == "ambrosio",
        "torque": free,
        "torque_table": free and is_table(scene.drive.torque),  # type: ignore[union-attr]
        "gravity": e.gravity > 0.0,
        "load": e.slider_load is not None and not is_table(e.slider_load),
        "load_table": is_table(e.slider_load),
        "guide": e.guide_friction is not None,
        "baumgarte": scene.numerics.formulation == "baumgarte",
        "ledger": scene.numerics.energy if ledger is None else ledger,
        "series": series,
        "responses": scene.responses_asked(),
    }
    if not (first or second):
        on.update(dict.fromkeys(("fixed", "latched", "coulomb", "ambrosio"), False))
    return at.Effects(**{name: 1 if is_on else None for name, is_on in on.items()})


def tableau_of(scene: Scene) -> Tableau:
    """The embedded pair of ``numerics.method``: Dormand and Prince's unless another one is named."""
    return TABLEAUS.get(scene.numerics.method, DORMAND_PRINCE)


def absolute_tolerances(scene: Scene) -> tuple[float, ...]:
    """Absolute tolerances of coordinates, then velocities: a, 10 a/m, 1000 a/s, 50000 a/(m s) with a for lengths.

    With the default a = rtol times 1 mm they stand for 1 mm, 0.01 rad, 1 m/s and 50 rad/s. Where the crank pin moves
    slower than 25 m/s the velocities' are less in proportion: what is small is set by the mechanism's own speed.
    """
    first, second, free = topology(scene)
    a = scene.numerics.absolute_tolerance
    if scene.numerics.formulation == "baumgarte":
        lengths, free = [True, True, True, True, False, True, True, False], True
    elif first and second:
        lengths = [True, True, False, True]
    elif first or second:
        lengths = [False, True]
    else:
        lengths = []
    lengths += [False] * free
    coordinates = [a if length else 10.0 * a for length in lengths]
    drive = scene.drive
    speed = drive.initial_speed if drive.kind == "torque" else drive.speed
    rate = 1e3 * min(1.0, scene.mechanism.crank.length * abs(speed) / 25.0)
    velocities = [rate * a if length else 50.0 * rate * a for length in lengths]
    return (*coordinates, *velocities)


def periodic_cells(curve: tuple[tuple[float, float], ...], cells: int = CELLS) -> Array:
    """A tabulated curve over one turn as cubic cells on a uniform grid, 4 coefficients each (flat).

    Monotone cubic between the given pairs (Fritsch and Carlson 1980, doi:10.1137/0717021): through every pair,
    no overshoot, and smooth enough not to stop the integrator at each of them.
    """
    from scipy.interpolate import PchipInterpolator

    angles = np.array([a for a, _ in curve])
    values = np.array([v for _, v in curve])
    if angles[-1] - angles[0] > at.TURN * (1.0 - 1e-12):
        angles, values = angles[:-1], values[:-1]
    # three turns side by side, so that the middle one sees its neighbours
    turns = np.concatenate([angles - at.TURN, angles, angles + at.TURN])
    smooth = PchipInterpolator(turns, np.tile(values, 3))
    grid = angles[0] + np.mod(np.arange(cells + 1) * (at.TURN / cells) - angles[0], at.TURN)
    height = smooth(grid)
    slope = smooth.derivative()(grid) * (at.TURN / cells)
    height[-1], slope[-1] = height[0], slope[0]
    d0, d1, m0, m1 = height[:-1], height[1:], slope[:-1], slope[1:]
    return np.column_stack([d0, m0, 3 * (d1 - d0) - 2 * m0 - m1, 2 * (d0 - d1) + m0 + m1]).ravel()


def implicit_method(scene: Scene) -> str:
    """When the kernel takes implicit steps: "never", "stiff" (where a lane's motion calls for it), "always".

    The automatic choice goes by the scene's numbers, so that a scene that is not stiff pays nothing for the other method.
    It is the same for a single response and for an ensemble.
    """
    method = scene.numerics.method
    if method != "auto" or not scene.clearance_joints():
        return IMPLICIT_METHODS.get(method, "never")
    par = parameters(scene)[0]
    joints = {"crank_rod": at.JOINT_12, "rod_slider": at.JOINT_23}
    friction, contact_law = (
        scene.effects.friction.law,
        getattr(scene.effects.contact, "law", "hertz"),
    )
    for joint in scene.clearance_joints():
        p = par[joints[joint] :]
        ramp = p[at.FRICTION] * p[at.INVERSE_RAMP] if friction != "none" else 0.0
        damping = p[at.DAMPING] if contact_law != "hertz" else 0.0
        if ramp >= STIFF_RAMP or damping >= STIFF_DAMPING:
            return "stiff"
    return "never"


def takes_collocation(scene: Scene, single: bool) -> bool:
    """Whether samples are integrated one by one, by collocation: where it is named, or for a tight single response.

    Looser than `TIGHT` the pair is kept, so that a response is the ensemble's sample to the last digits that either
    knows. A tabulated curve is smooth only twice over at every cell, and Baumgarte's nine coordinates do not fit;
    where the motion may be stiff, implicit steps are called for.

    Raises
    ------
    InputError
        If it is named and cannot be had.
    """
    minimal = scene.numerics.formulation == "minimal"
    if scene.numerics.method == "lobatto":
        if not minimal:
            raise InputError(
                "numerics.method",
                "lobatto",
                "works in minimal coordinates only",
                'set numerics.formulation = "minimal" or another method',
            )
        return True
    curves = (getattr(scene.drive, "torque", None), scene.effects.slider_load)
    smooth = minimal and not any(isinstance(curve, tuple) for curve in curves)
    automatic = scene.numerics.method == "auto" and implicit_method(scene) == "never"
    return single and automatic and smooth and scene.numerics.rtol <= TIGHT


def problem_of(
    scene: Scene, *, series: bool = False, ledger: bool | None = None, single: bool = False
) -> Problem:
    """What is common to all samples of a scene; `single`: it is for one response, not for an ensemble."""
    e = scene.effects
    torque = getattr(scene.drive, "torque", None)
    averaged: Any = scene.numerics.averaged_revolutions
    auto = averaged == "auto"
    return Problem(
        effects=effects_of(scene, series=series, ledger=ledger),
        coordinates=coordinate_count(scene),
        tableau=tableau_of(scene),
        rtol=scene.numerics.rtol,
        atol=absolute_tolerances(scene),
        impact_floor=1e-3 if e.contact is None else e.contact.minimum_impact_speed,
        transient=scene.numerics.transient_revolutions,
        averaged=LEAST_AVERAGED if auto else averaged,
        averaged_cap=scene.numerics.max_averaged_revolutions if auto else averaged,
        objective_tolerance=scene.numerics.objective_tolerance if auto else 0.0,
        max_steps=scene.numerics.max_steps,
        torque_table=periodic_cells(torque) if isinstance(torque, tuple) else None,  # type: ignore[arg-type]
        load_table=periodic_cells(e.slider_load) if isinstance(e.slider_load, tuple) else None,  # type: ignore[arg-type]
        implicit=implicit_method(scene),
        collocation=takes_collocation(scene, single),
    )


def integrator_of(scene: Scene, *, single: bool = False) -> str:
    """Name of the method that a scene's samples, or its single response, are integrated by."""
    if coordinate_count(scene) == 0:
        return "closed form"
    if takes_collocation(scene, single):
        return "lobatto"
    name = tableau_of(scene).name
    return {"never": name, "stiff": f"{name} and radau", "always": "radau"}[implicit_method(scene)]


def parameters(scene: Scene, points: Points | None = None) -> Array:
    """Kernel parameters of each sample, shape (samples, PARAMETERS)."""
    get = Numbers(scene, points)
    p = np.ones((get.size, at.PARAMETERS))
    body = {
        name: get(f"mechanism.{name}") for name in ("crank.length", "rod.length", "slider.mass")
    }
    free = scene.drive.kind == "torque"
    speed = get("drive.initial_speed" if free else "drive.speed")
    p[:, at.SPEED] = speed
    p[:, at.PERIOD] = at.TURN / speed
    p[:, at.FIRST_STEP] = 1e-3 * p[:, at.PERIOD]
    p[:, at.CRANK_LENGTH] = body["crank.length"]
    p[:, at.ROD_LENGTH] = body["rod.length"]
    near = get("mechanism.rod.mass_center")
    p[:, at.ROD_NEAR], p[:, at.ROD_FAR] = near, body["rod.length"] - near
    mass, inertia = get("mechanism.rod.mass"), get("mechanism.rod.inertia")
    p[:, at.ROD_MASS], p[:, at.INV_ROD_MASS] = mass, 1.0 / mass
    p[:, at.ROD_INERTIA], p[:, at.INV_ROD_INERTIA] = inertia, 1.0 / inertia
    p[:, at.SLIDER_MASS], p[:, at.INV_SLIDER_MASS] = body["slider.mass"], 1.0 / body["slider.mass"]
    m1, u1 = get("mechanism.crank.mass"), get("mechanism.crank.mass_center")
    own = get("mechanism.crank.inertia") + (get("drive.flywheel_inertia") if free else 0.0)
    p[:, at.CRANK_MASS], p[:, at.CRANK_NEAR], p[:, at.CRANK_OWN_INERTIA] = m1, u1, own
    p[:, at.CRANK_MOMENT] = m1 * u1
    p[:, at.CRANK_INERTIA] = own + m1 * u1**2
    p[:, at.GRAVITY] = get("effects.gravity")
    p[:, at.BAUMGARTE_ALPHA2] = 2.0 * scene.numerics.alpha
    p[:, at.BAUMGARTE_BETA2] = scene.numerics.beta**2
    _outside_parameters(scene, get, p)
    for joint, base in (("crank_rod", at.JOINT_12), ("rod_slider", at.JOINT_23)):
        if joint in scene.clearance_joints():
            _joint_parameters(scene, get, joint, p[:, base:])
    return p


def _outside_parameters(scene: Scene, get: Numbers, p: Array) -> None:
    """Drive torque, slider load and guide friction; tables are multiplied by 1."""
    if isinstance(scene.effects.slider_load, float):
        p[:, at.LOAD] = get("effects.slider_load")
    if isinstance(getattr(scene.drive, "torque", None), float):
        p[:, at.TORQUE] = get("drive.torque")
    if scene.effects.guide_friction is not None:
        p[:, at.GUIDE_COEFFICIENT] = get("effects.guide_friction.coefficient")
        p[:, at.GUIDE_INVERSE_RAMP] = 1.0 / get("effects.guide_friction.ramp_speed")


def _joint_parameters(scene: Scene, get: Numbers, joint: str, p: Array) -> None:
    """Fill one joint's block of parameters (a view, first column its first entry)."""
    key = f"joints.{joint}"
    clearance, bearing = get(f"{key}.clearance"), get(f"{key}.bearing_radius")
    h_bearing, h_journal = (
        contact.reduced_compliance(
            get(f"{key}.{part}.youngs_modulus"), get(f"{key}.{part}.poisson_ratio")
        )
        for part in ("bearing", "journal")
    )
    p[:, at.CLEARANCE] = clearance
    p[:, at.CONTACT_STIFFNESS] = contact.contact_stiffness(h_bearing, h_journal, bearing, clearance)
    p[:, at.BEARING_RADIUS] = bearing
    p[:, at.JOURNAL_RADIUS] = bearing - clearance
    law: Any = scene.effects.contact
    if law.law == "hunt-crossley":
        p[:, at.DAMPING] = get("effects.contact.damping")
    elif law.law in contact.LATCHED_LAWS:
        p[:, at.DAMPING] = contact.LATCHED_LAWS[law.law](get("effects.contact.restitution"))
    friction = scene.effects.friction
    if friction.law != "none":
        p[:, at.FRICTION] = get("effects.friction.coefficient")
    if friction.law == "coulomb":
        p[:, at.INVERSE_RAMP] = 1.0 / get("effects.friction.ramp_speed")
    elif friction.law == "ambrosio" and friction.speeds is not None:
        p[:, at.DEAD_SPEED] = friction.speeds[0]
        p[:, at.INVERSE_RAMP] = 1.0 / (friction.speeds[1] - friction.speeds[0])


def start_states(scene: Scene, p: Array) -> Array:
    """Start of each sample, shape (samples, STATE): crank and rod outstretched, velocities of the ideal mechanism.

    Journals are centred, or where ``start_eccentricity`` puts them.
    """
    first, second, free = topology(scene)
    crank, length, omega = p[:, at.CRANK_LENGTH], p[:, at.ROD_LENGTH], p[:, at.SPEED]
    e12, e23 = (_start_eccentricity(scene, joint) for joint in ("crank_rod", "rod_slider"))
    angle = np.arcsin((e12[1] - e23[1]) / length)
    spin = -crank * omega / (length * np.cos(angle))
    pin_x, pin_y = crank - e12[0], np.full(len(p), -e12[1])  # rod's first bearing centre
    slider = pin_x + length * np.cos(angle) + e23[0]
    slider_speed = -length * np.sin(angle) * spin
    near = p[:, at.ROD_NEAR]
    q, v = [angle, slider], [spin, slider_speed]
    baumgarte = scene.numerics.formulation == "baumgarte"
    if baumgarte or (first and second):
        q = [pin_x + near * np.cos(angle), pin_y + near * np.sin(angle), *q]
        v = [-near * np.sin(angle) * spin, crank * omega + near * np.cos(angle) * spin, *v]
    if baumgarte:
        zero = np.zeros(len(p))
        q = [p[:, at.CRANK_NEAR], zero, *q, zero, zero]
        v = [zero, p[:, at.CRANK_NEAR] * omega, *v, zero, zero]
    elif not (first or second):
        q, v = [], []
    if free or baumgarte:
        q, v = [*q, np.zeros(len(p))], [*v, omega]
    state = np.zeros((len(p), STATE))
    for k, (coordinate, velocity) in enumerate(zip(q, v, strict=True)):
        state[:, k], state[:, at.MAX_COORDINATES + k] = coordinate, velocity
    _start_contacts(scene, p, state)
    return state


def _start_eccentricity(scene: Scene, joint: str) -> tuple[float, float]:
    return getattr(getattr(scene.joints, joint), "start_eccentricity", (0.0, 0.0))


def _start_contacts(scene: Scene, p: Array, state: Array) -> None:
    """A journal that starts on or beyond its contact circle starts in contact, at the least impact speed."""
    law = scene.effects.contact
    if law is None or not law.latched:
        return
    for k, (joint, base) in enumerate((("crank_rod", at.JOINT_12), ("rod_slider", at.JOINT_23))):
        if joint in scene.clearance_joints():
            distance = np.hypot(*_start_eccentricity(scene, joint))
            touching = distance >= p[:, base + at.CLEARANCE]
            state[:, 2 * at.MAX_COORDINATES + k] = touching
            state[:, 2 * at.MAX_COORDINATES + 2 + k] = touching / law.minimum_impact_speed
