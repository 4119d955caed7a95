"""A scene in words: the effects that are on, what deserves a look, and how two scenes differ."""

from collections.abc import Iterator
from typing import Any

from hpcclear.plugins.sources import digest
from hpcclear.scene.driving import TorqueDrive
from hpcclear.scene.mechanism import slender_inertia
from hpcclear.scene.paths import flatten
from hpcclear.scene.planar import Planar
from hpcclear.scene.plausibility import implausible
from hpcclear.scene.tables import SceneTables

NAMES = {"crank_rod": "O12", "rod_slider": "O23"}


def effects_on(scene: SceneTables) -> Iterator[str]:
    """What is on, in words."""
    for name in scene.clearance_joints():
        clearance = scene.number(f"{scene.joint_key(name)}.clearance")
        size = f"{clearance * 1e6:g} um" if clearance < 1e-4 else f"{clearance * 1e3:g} mm"
        joint: Any = scene.clearance_joint(name)
        kind = {"slide": "guide", "slot": "slot"}.get(joint.kind, "joint")
        where = "the guide" if kind == name == "guide" else f"{kind} {name}"
        yield f"clearance {size} in {where}" + (f" ({NAMES[name]})" if name in NAMES else "")
        if joint.out_of_round is not None:
            yield f"joint {name} out of round"
    for name in scene.worn_joints():
        yield f"wear of joint {name}"
    for name, film in scene.films().items():
        yield f"{film.model} oil film of {film.viscosity:g} Pa s in joint {name}"
    for key, bar in scene.bending().items():
        number = f"{bar.modes} modes" if bar.modes > 1 else "one mode"
        yield f"bending of {key.rpartition('.')[2]} in {number}, {bar.stiffness:g} N m2"
    effects = scene.effects
    if scene.clearance_joints() and effects.contact is not None:
        yield f"contact law {effects.contact.law}"
    if effects.friction.law != "none":
        coefficient = effects.friction.value("coefficient")
        size = "" if coefficient is None else f", coefficient {coefficient:g}"
        yield f"friction {effects.friction.law}{size}"
    if isinstance(scene.drive, TorqueDrive):
        falls = "" if scene.drive.no_load_speed is None else ", torque falling with speed"
        rest = ", from rest" if scene.drive.initial_speed == 0.0 else ""
        yield f"torque-driven crank{falls}{rest}"
    if isinstance(scene.mechanism, Planar):
        for row in (*scene.mechanism.drives, *scene.mechanism.loads):
            yield f"{row.kind} {row.name}"
    if effects.gravity != 0:
        yield f"gravity {effects.gravity:g} m/s2"
    if effects.slider_load is not None:
        shape = "constant" if isinstance(effects.slider_load, float) else "against crank angle"
        yield f"slider load, {shape}"
    for words, coefficient in scene.joint_frictions().values():
        yield f"{words}, coefficient {coefficient:g}"
    if scene.numerics.formulation == "baumgarte":
        yield "Lagrange multipliers with Baumgarte feedback"
    if scene.numerics.energy:
        yield "energy balance of each sample"
    if scene.responses_asked():
        yield "mean contact forces, torque of the drive and slider acceleration of each sample"


def warnings(scene: SceneTables) -> Iterator[str]:
    """What is allowed and still deserves a look."""
    yield from implausible(scene)
    for bar in scene.linkage.bodies:
        if bar.length is None:
            continue
        key, least = (
            scene.path_in_scene(f"mechanism.bodies.{bar.name}"),
            slender_inertia(bar.mass, bar.length),
        )
        if 0.0 < bar.own_inertia < least * (1 - 1e-12):
            yield (
                f"{key}.inertia = {bar.own_inertia:g} kg m2 is less than a thin uniform "
                f"rod of that mass and length has ({least:g} kg m2)"
            )
        if not 0 <= (0.0 if bar.mass_center is None else bar.mass_center) <= bar.length:
            yield (
                f"{key}.mass_center = {bar.mass_center:g} m lies beyond the pins, "
                f"which are at 0 and {bar.length:g} m"
            )
    for name in scene.pins():
        joint: Any = scene.clearance_joint(name)
        start = joint.start_eccentricity
        if start.x**2 + start.y**2 > joint.clearance**2 * (1 + 1e-12):
            yield (
                f"{scene.joint_key(name)}.start_eccentricity lies outside the clearance, "
                "so the run starts in contact"
            )
    for variable in scene.study.variables if scene.study is not None else ():
        own = [scene.number(path) for path in variable.paths]
        if variable.range is not None and not all(
            variable.range[0] <= value <= variable.range[1] for value in own
        ):
            yield (
                f"study.variables.{variable.name} runs from {variable.range[0]:g} to "
                f"{variable.range[1]:g} {variable.unit}, and the scene's own value {own[0]:g} "
                "lies outside"
            )
    yield from unused(scene)


def unused(scene: SceneTables) -> Iterator[str]:
    """What a study states and nothing of it reads."""
    study = scene.study
    if study is not None and study.accuracy is not None and study.verification.draws is not None:
        yield "study.accuracy is not used: study.verification names how many draws a design gets"
    if study is None or study.groups or study.sensitivity.groups == ():
        return
    if study.sensitivity.model_fields_set - {"parameter"}:  # which has a default of the scene's own
        yield (
            "study.sensitivity is not used: no group of variables is named, and these variables have no usual groups. "
            "Name them in study.sensitivity.groups, and the fixed one in study.sensitivity.parameter"
        )


def differences(first: SceneTables, second: SceneTables) -> list[str]:
    """Dotted keys in which two scenes differ, each with both values; empty when their hashes are
    equal."""
    ours, theirs = (
        {k: f"SHA-256 {digest(v)}" if k.startswith("plugins.files.") else v for k, v in entries}
        for entries in (flatten(first.resolved()), flatten(second.resolved()))
    )
    lines = [
        f"{key}: {ours.get(key, '(not set)')!r} -> {theirs.get(key, '(not set)')!r}"
        for key in {**ours, **theirs}
        if ours.get(key) != theirs.get(key)
    ]
    if not lines and first.hash != second.hash:
        lines.append("study: the order of variables or random inputs")
    return lines
