"""A scene's linkage as the kernel takes it: its texts and rows, parameters and starts of its samples."""

from dataclasses import replace
from functools import lru_cache

import numpy as np

from hpcclear.base import errors
from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.base.outcome import Status
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.linkage.assembly import Assembly, assemble, check_redundant, placed
from hpcclear.dynamics.linkage.expression import On
from hpcclear.dynamics.linkage.kinematics import CENTER
from hpcclear.dynamics.linkage.linkage import Linkage
from hpcclear.dynamics.linkage.loops import largest_distance
from hpcclear.dynamics.linkage.mechanism import Mechanism, freedom, massless, turning
from hpcclear.dynamics.linkage.parts import GROUND, split
from hpcclear.dynamics.linkage.trees import forest
from hpcclear.dynamics.planar.tables import mechanism_of, with_columns
from hpcclear.dynamics.planar.turning import Walk, changes, passage, refused
from hpcclear.scene import Scene
from hpcclear.scene.planar import turns_of
from hpcclear.scene.points import Numbers, Points

PLACEHOLDER = 1e-3
"""Stands for a number that is zero in the scene and varied by its study: zeros are left out of the generated source."""

NOT_GEOMETRY = ("mass", "inertia", "inertia_ratio", "clearance", "bearing_radius", "youngs_modulus", "poisson_ratio",
                "torque", "no_load_speed", "flywheel_inertia", "stiffness", "damping",
                "coefficient", "radius", "ramp_speed")  # fmt: skip
"""Entries that no sample's start depends on, nor on any of a load."""

NOT_OF_MOTION = (".out_of_round.", ".start_eccentricity.")
"""Parts of paths of entries that may be zero and have no term of their own in a motion."""


@lru_cache(maxsize=16)
def linkage_of(scene: Scene) -> Linkage:
    """The structure of a scene's linkage. Raises InputError if the tables make no mechanism, or its drives no period."""
    zeros = [path for path in _may_vary(scene) if scene.number(path) == 0.0]
    shown = scene.with_(dict.fromkeys(zeros, PLACEHOLDER)) if zeros else scene
    mechanism = mechanism_of(shown.linkage)
    with errors.at("mechanism"):
        check_redundant(mechanism)
    cartesian = scene.numerics.formulation == "baumgarte"
    if cartesian:
        check_inertias(mechanism)
    follow = scene.linkage.followed or guided(mechanism)
    _check_followed(scene, follow)
    _check_room(scene, len(forest(mechanism, cartesian).coordinates))
    on = On(
        friction=scene.effects.friction.law != "none" or bool(scene.films()),
        gravity=scene.effects.gravity > 0.0,
        follow=follow,
        objective=scene.objective.rate_of,
        waves=any(scene.waves().values()),
    )
    places = scene.open_places
    return Linkage(mechanism, on, cartesian=cartesian, bristles=scene.bristles, places=places)


def _check_followed(scene: Scene, follow: str) -> None:
    """InputError where the objective is of something that is not followed."""
    asks, point = scene.objective.asks, "." in follow
    of_slider = "slider_acceleration_deviation" in asks
    of_points = {"point_acceleration_deviation", "peak_point_acceleration", "acceleration_y"} & asks
    for wrong, reason, remedy in (
        (of_slider and point, "this linkage has a followed point", 'Use "point-acceleration-deviation"'),
        (of_slider and not follow, "no body of this linkage slides along a line of the ground",
         'Use another one, such as "peak-contact-force"'),
        ("acceleration_x" in asks and not follow, "no body or point is followed, so there is no acceleration",
         'Name a point: mechanism.followed = "body.point"'),
        (of_points and not point, "no point is followed", 'Name it: mechanism.followed = "body.point"'),
    ):  # fmt: skip
        if wrong:
            raise InputError(scene.objective_key, scene.objective.name, reason, remedy)


def _check_room(scene: Scene, others: int) -> None:
    """InputError if the kernel cannot hold so many coordinates, and the bristles beside them."""
    count = others + scene.bristles
    if count <= at.MAX_COORDINATES:
        return
    most = f"{count} coordinates, of {at.MAX_COORDINATES} at most"
    if others <= at.MAX_COORDINATES:
        reason = f"needs one for each joint with clearance: {most}"
        remedy = 'Write law = "coulomb", or make some of the joints ideal'
        raise InputError("effects.friction.law", scene.effects.friction.law, reason, remedy)
    if scene.numerics.formulation == "baumgarte":
        reason = f"has three for each body: {most}"
        remedy = 'Write formulation = "minimal", or use fewer bodies'
        raise InputError("numerics.formulation", "baumgarte", reason, remedy)
    remedy = "Use fewer bodies, joints with clearance or modes of bending"
    raise InputError("mechanism.bodies", len(scene.linkage.bodies), f"have {most}", remedy)


def guided(mechanism: Mechanism) -> str:
    """The first body that a guide on the ground holds: what stands for the slider; "" for none."""
    slides = (joint for joint in mechanism.joints if joint.kind == "slide")
    held = [split(joint.point)[0] for joint in slides if split(joint.line)[0] == GROUND]
    return next((body.name for body in mechanism.bodies if body.name in held), "")


def check_inertias(m: Mechanism) -> None:
    """InputError where a body by itself would need an inertia that it does not have: its angle does not grow evenly."""
    found = massless(m) & turning(m, ("constant-speed",))
    for body in m.bodies:
        if body.name in found:
            raise InputError(
                f"mechanism.bodies.{body.name}.inertia", body.inertia,
                'the formulation "baumgarte" turns each body by itself, and needs an inertia for that',
                'Write the moment of inertia about its mass centre in kg m2, or numerics.formulation = "minimal"',
            )  # fmt: skip


def _varied(scene: Scene) -> set[str]:
    if scene.study is None:
        return set()
    rows = (*scene.study.variables, *scene.study.random)
    return {path for row in rows for path in row.paths if _in_tables(scene, path)}


def _in_tables(scene: Scene, path: str) -> bool:
    return scene.path_in_linkage(path).startswith("mechanism.")


def _may_vary(scene: Scene) -> set[str]:
    """Entries that may be zero in the scene and not in a sample: what the study varies, and all that a template reads."""
    if scene.template is None:
        return _varied(scene)
    found = {path for path in scene.numeric_paths() if _in_tables(scene, path)}
    return {path for path in found if not any(part in path for part in NOT_OF_MOTION)}


def is_prescribed(scene: Scene) -> bool:
    """Whether nothing is left to integrate: no clearance, and the drives hold all that moves."""
    mechanism = linkage_of(scene).mechanism
    return not (mechanism.clearances or scene.modes) and freedom(mechanism) == 0


def check_columns(scene: Scene, points: Points | None) -> None:
    """InputError where a column drives a number that is zero in the scene and not of its study."""
    if points is None:
        return
    known = _may_vary(scene)
    for name, paths in zip(points.names, points.paths, strict=True):
        for path in paths:
            if ".out_of_round." in path:
                continue  # zeros of a round surface may be varied
            if path not in known and _in_tables(scene, path) and scene.number(path) == 0.0:
                reason = f"drives {path}, which is zero in this scene and cannot be varied"
                remedy = "Give it a small value in the scene, or make it a variable of the study"
                raise InputError(name, 0.0, reason, remedy)


def parameters_of(scene: Scene, get: Numbers, points: Points | None) -> Array:
    """Kernel parameters of each sample but for those of the joints, shape (samples, PARAMETERS)."""
    check_columns(scene, points)
    linkage = linkage_of(scene)
    sample = sample_of(scene, points)
    p = np.ones((get.size, linkage.parameter_rows))
    p[:, at.WRAPS : at.OWN] = 0.0
    for k, one in enumerate(linkage.forest.coordinates, at.WRAPS + scene.bristles):
        p[:, k] = linkage.gained(one.body, sample) if one.kind == "angle" else 0.0
    period = sample.period.seconds
    turns = turns_of(scene.linkage)
    p[:, at.PERIOD] = period
    p[:, at.SPEED] = at.TURN * turns / period
    p[:, at.FIRST_STEP] = 1e-3 * period / turns
    driven = sample.period.body  # whose angle begins there as a coordinate
    start = sample.body(driven).start_angle - forest(sample, linkage.cartesian).offsets[driven]
    p[:, at.TURN_END] = start + at.TURN * turns
    p[:, at.DRIVEN_LENGTH] = driven_length(sample)
    n = scene.numerics
    linkage.fill(p, sample, get("effects.gravity"), (n.alpha, n.beta))
    return p


def sample_of(scene: Scene, points: Points | None) -> Mechanism:
    """The mechanisms of samples with the scene's structure; of the scene itself without points.

    Those of the last points are kept, since parameters, starts and contacts of samples are made from the same object.
    """
    if points is None:
        return with_columns(scene, linkage_of(scene).mechanism, Points((), np.empty((1, 0)), ()))
    for known, its, made in _LAST:
        if known is scene and its is points:
            return made
    _LAST[:] = [(scene, points, with_columns(scene, linkage_of(scene).mechanism, points))]
    return _LAST[0][2]


_LAST: list[tuple[Scene, Points, Mechanism]] = []


def driven_length(mechanism: Mechanism) -> Array:
    """The largest distance between points of the body that gives the period, m, of samples (m,): how fast the mechanism is
    goes by it."""
    body = mechanism.body(mechanism.period.body)
    return largest_distance([*body.points.values(), body.center])


@lru_cache(maxsize=64)
def refused_of(scene: Scene) -> tuple[Status, InputError] | None:
    """The status of a scene whose own linkage cannot turn, and what to say; None for one that can, or is not to be judged.

    Raises InputError if it cannot be put together.
    """
    return refused(_walk_of(scene))


@lru_cache(maxsize=2)
def _walk_of(scene: Scene) -> Walk | None:
    with errors.at("mechanism"):
        return passage(mechanism_of(scene.linkage), scene.effects.gravity, rounds_of(scene))


@lru_cache(maxsize=64)
def cautions_of(scene: Scene) -> tuple[str, ...]:
    """What a user should know of the motion of a linkage that turns, a sentence each."""
    if refused_of(scene) is not None:
        return ()
    mechanism = mechanism_of(scene.linkage)
    at_angles = [f"{angle:.0f}" for angle in changes(mechanism, _walk_of(scene))]
    if not at_angles:
        return ()
    return (
        f"without clearance the linkage passes a change point at {' and '.join(at_angles)} deg of the {mechanism.period.body}. "
        "With clearance the contact decides which way it moves on: forces near there change with the smallest change of "
        "the design",
    )


def rounds_of(scene: Scene) -> int:
    """Revolutions that a linkage without clearance goes through."""
    return scene.numerics.transient_revolutions + scene.numerics.averaged_revolutions


def moves_start(path: str) -> bool:
    """Whether samples' starts may depend on an entry of the linkage's tables."""
    entry = path.split(".")[-1]
    shaped = path.startswith("mechanism.") and ".out_of_round." not in path
    return shaped and not path.startswith("mechanism.loads.") and entry not in NOT_GEOMETRY


def moves_geometry(path: str) -> bool:
    """Whether it also changes whether a sample can turn: a mass centre moves coordinates, but no joint."""
    return moves_start(path) and not path.endswith(".mass_center") and ".center." not in path


def varies_geometry(scene: Scene) -> bool:
    """Whether a study varies what samples' starts and passages depend on."""
    return any(moves_start(scene.path_in_linkage(path)) for path in _varied(scene))


def scene_of(scene: Scene, points: Points, row: int) -> Scene:
    """The scene of one sample."""
    columns = zip(points.paths, points.values[row].tolist(), strict=True)
    return scene.with_({path: value for paths, value in columns for path in paths})


def put_together(mechanism: Mechanism) -> Assembly:
    """`assemble`, its InputError below ``mechanism``."""
    with errors.at("mechanism"):
        return assemble(mechanism)


def poses_at_start(scene: Scene, turned: float = 0.0) -> dict[str, tuple[float, float, float]]:
    """Mass centre (x, y in m) and angle (rad) of each body of a linkage as it was put together, its driven body `turned` by an
    angle (rad)."""
    mechanism = mechanism_of(scene.linkage)
    if turned:
        driven = mechanism.period.body
        bodies = tuple(
            replace(one, start_angle=one.start_angle + turned) if one.name == driven else one
            for one in mechanism.bodies
        )
        mechanism = replace(mechanism, bodies=bodies)
    made, found = put_together(mechanism), {}
    for body in mechanism.bodies:
        centre, _, angle, _ = placed(made, f"{body.name}.{CENTER}", body.center)
        found[body.name] = (float(centre.real), float(centre.imag), float(angle))
    return found
