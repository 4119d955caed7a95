"""Numbers that are allowed and hardly meant: rad/s taken for rpm, Pa for GPa, mm for m, grams for kilograms.

Thresholds lie well beyond built machines, so that a warning is worth reading; each says what would be plausible and what to
write."""

import math
from collections.abc import Iterator

from hpcclear.scene.driving import speed_entry
from hpcclear.scene.mechanism import Mechanism
from hpcclear.scene.tables import SceneTables

FASTEST = 30.0
"""Mean slider speed of the fastest engines that are built, m/s: racing engines reach 26."""
MOST_TURNS = 30_000.0
"""Revolutions a minute: small model engines reach as many."""
SOFTEST, STIFFEST = 1e6, 1.3e12
"""Young's moduli of soft rubber and of diamond, Pa."""
WIDEST = 0.1
"""Clearance over bearing radius; worn bearings reach a hundredth, the mechanisms that publications study a twentieth."""
LONGEST = 5.0
"""Of a crank or rod, m."""
THINNEST, THICKEST = 1e-5, 20.0
"""Viscosities of air and of the thickest gear oil when cold, Pa s."""
STEEL = 7850.0
"""kg/m3."""


def implausible(scene: SceneTables) -> Iterator[str]:
    """A sentence for each number that is likely a slip of units."""
    if isinstance(scene.mechanism, Mechanism):
        yield from _drive(scene)
        yield from _rod(scene)
    yield from _bodies(scene)
    yield from _joints(scene)
    yield from _films(scene)
    if scene.numerics.beta == 0.0 and (
        scene.template is None or scene.numerics.formulation == "baumgarte"
    ):
        yield "numerics.beta = 0 lets loops without clearance drift; use 100 to 1000 1/s"
    effects = scene.effects
    if effects.gravity > 100.0:
        yield f"effects.gravity = {effects.gravity:g} m/s2 is ten times the Earth's; write 9.81"
    for name in ("coefficient", "static_coefficient"):
        if (effects.friction.value(name) or 0.0) > 1.0:
            yield (
                f"effects.friction.{name} = {effects.friction.value(name):g} is above 1; "
                "lubricated bearings have 0.001 to 0.1"
            )


def _drive(scene: SceneTables) -> Iterator[str]:
    drive = scene.drive
    key = speed_entry(drive)
    speed = abs(float(getattr(drive, key)))
    turns = speed / (2.0 * math.pi)
    mean = 4.0 * scene.slider_crank.crank.length * turns
    if mean > FASTEST or 60.0 * turns > MOST_TURNS:
        yield (
            f"drive.{key} = {speed:.6g} rad/s is {60.0 * turns:.0f} rpm, a mean slider speed of {mean:.3g} m/s; engines "
            f'stay below {FASTEST:g} m/s. If rpm are meant, write "{speed:.6g} rpm"'
        )


def _bodies(scene: SceneTables) -> Iterator[str]:
    bodies = [
        (scene.path_in_scene(f"mechanism.bodies.{one.name}"), one) for one in scene.linkage.bodies
    ]
    bars = [(key, bar, bar.length) for key, bar in bodies if bar.length is not None]
    for key, bar, length in bars:
        if length > LONGEST:
            yield f'{key}.length = {length:g} m; if mm are meant, write "{length:g} mm"'
        if (own := bar.own_inertia) > 100.0 * bar.mass * length**2:
            yield (
                f"{key}.inertia = {own:g} kg m2 is {own / (bar.mass * length**2):.2g} times mass times length squared; "
                "check the unit, or give a flywheel as flywheel_inertia of a drive"
            )
    points = [scene.linkage.ground.points, *(body.points for _, body in bodies)]
    places = [one for own in points for one in own]
    sizes = [*(length for _, _, length in bars), *(math.hypot(one.x, one.y) for one in places)]
    heaviest = 5.0 * STEEL * (max(sizes, default=0.0) or math.inf) ** 3
    for key, body in bodies:
        if body.mass > heaviest:
            yield (
                f"{key}.mass = {body.mass:g} kg is more than five steel cubes as long as the mechanism "
                f'({heaviest:.3g} kg); if grams are meant, write "{body.mass:g} g"'
            )


def _rod(scene: SceneTables) -> Iterator[str]:
    """A rod that bends should not buckle under the inertia that its drive gives it."""
    mechanism, drive = scene.slider_crank, scene.drive
    rod = mechanism.rod
    if rod.bending is None:
        return
    speed = getattr(drive, speed_entry(drive))
    inertia = (rod.mass + mechanism.slider.mass) * mechanism.crank.length * speed**2
    buckling = rod.bending.stiffness * (math.pi / rod.length) ** 2
    if inertia > 0.5 * buckling:
        yield (
            f"mechanism.rod.bending.stiffness = {rod.bending.stiffness:g} N m2 buckles under {buckling:.3g} N, and the inertia "
            f"of rod and slider comes to {inertia:.3g} N; deflections are no longer small there"
        )


def _joints(scene: SceneTables) -> Iterator[str]:
    for name in scene.clearance_joints():
        joint, key = scene.clearance_joint(name), scene.materials_key(name)
        for part in ("bearing", "journal"):
            modulus = getattr(joint.materials, part).youngs_modulus
            if not SOFTEST <= modulus <= STIFFEST:
                what = "softer than rubber" if modulus < SOFTEST else "stiffer than diamond"
                yield (
                    f"{key}.{part}.youngs_modulus = {modulus:g} Pa is {what}; "
                    'steel has "206 GPa", bronze "110 GPa", a polymer "2 GPa"'
                )
    for name in scene.pins():
        pin, key = scene.pin(name), scene.joint_key(name)
        if pin.clearance > WIDEST * pin.bearing_radius:
            yield (
                f"{key}.clearance = {pin.clearance:g} m is {pin.clearance / pin.bearing_radius:.0%} of the "
                "bearing's radius; write the radial clearance, half of the difference of the diameters"
            )


def _films(scene: SceneTables) -> Iterator[str]:
    for name, film in scene.films().items():
        key = f"{scene.joint_key(name)}.film"
        if film.viscosity and not THINNEST <= film.viscosity <= THICKEST:
            what = "thinner than air" if film.viscosity < THINNEST else "thicker than any oil"
            yield (
                f"{key}.viscosity = {film.viscosity:g} Pa s is {what}; engine oil has 0.01 Pa s when hot and 0.3 when cold, "
                f'and if mPa s are meant, write "{film.viscosity:g} mPa*s"'
            )
        ratio = 0.5 * film.length / scene.pin(name).bearing_radius
        least, most = film.law.lengths
        if not least <= ratio <= most:
            yield (
                f'{key}.model = "{film.model}" overestimates the load capacity of a bearing {ratio:.2g} diameters long. '
                f'It is for {film.law.valid}; model = "finite" covers all lengths'
            )
