"""The numbers of a mechanism by the names that generated texts use: base parameters, and derived ones from their texts."""

import math

import numpy as np

from hpcclear.base.pieces import hinges
from hpcclear.dynamics.linkage import bending
from hpcclear.dynamics.linkage.generator import Motion
from hpcclear.dynamics.linkage.kinematics import CENTER
from hpcclear.dynamics.linkage.mechanism import Mechanism
from hpcclear.dynamics.linkage.parts import Number, is_pin, split
from hpcclear.dynamics.linkage.trees import Forest, forest


def values(
    mechanism: Mechanism, cartesian: bool = False, *, gravity: Number = 0.0,
    feedback: tuple[float, float] = (0.0, 0.0),
) -> dict[str, Number]:  # fmt: skip
    """Base parameters by name, SI; `feedback`: alpha and beta in 1/s (paper eq. 11)."""
    trees = forest(mechanism, cartesian)
    alpha, beta = feedback
    found: dict[str, Number] = {"gravity": gravity, "alpha2": 2.0 * alpha, "beta2": beta * beta}
    for name, (x, y) in mechanism.ground.items():
        found |= {f"ground_{name}_x": x, f"ground_{name}_y": y}
    _bodies(trees, found)
    for joint in mechanism.joints:
        if not is_pin(joint):
            angle = trees.offsets[split(joint.line)[0]] + joint.angle
            found |= {f"{joint.name}_cos": np.cos(angle), f"{joint.name}_sin": np.sin(angle)}
        rubs = getattr(joint, "friction", None)
        if rubs is not None:
            radius = getattr(rubs, "radius", 1.0)  # of a pin, which makes torques of forces
            found[f"{joint.name}_coefficient"] = rubs.coefficient * radius
            found[f"{joint.name}_inverse_ramp"] = radius / rubs.ramp_speed
    _outside(trees, found)
    return found


def _bodies(trees: Forest, found: dict[str, Number]) -> None:
    mechanism = trees.mechanism
    for body in mechanism.bodies:
        drive = mechanism.drive_of(body.name)
        inertia = body.inertia + getattr(drive, "flywheel_inertia", 0.0)
        some = inertia + 1.0 * (np.asarray(inertia) == 0.0)[()]  # what is divided by
        inertia = some if trees.cartesian else inertia  # there 1 for what does not turn
        places = {**body.points, CENTER: body.center}
        for a, (ax, ay) in places.items():
            for b, (bx, by) in places.items():
                found |= {f"{body.name}_{a}_{b}_x": bx - ax, f"{body.name}_{a}_{b}_y": by - ay}
        angle = trees.offsets[body.name]
        found |= {
            f"{body.name}_mass": body.mass,
            f"{body.name}_inverse_mass": 1.0 / body.mass,
            f"{body.name}_inertia": inertia,
            f"{body.name}_inverse_inertia": 1.0 / some,
            f"{body.name}_offset": angle,
            f"{body.name}_offset_cos": np.cos(angle),
            f"{body.name}_offset_sin": np.sin(angle),
        }
        if body.bending is not None:
            bent = bending.numbers(body)
            found |= {f"{body.name}_bend_{entry}": value for entry, value in bent.items()}
        if trees.on_ground(body.name):
            own = body.points[split(trees.hangs[body.name].own)[1]]
            x, y = body.center[0] - own[0], body.center[1] - own[1]
            pivoted = inertia + body.mass * (x * x + y * y)
            found |= {
                f"{body.name}_pivot_inertia": pivoted,
                f"{body.name}_pivot_inverse_inertia": 1.0
                / np.where(pivoted == 0.0, 1.0, pivoted)[()],
                f"{body.name}_moment_x": body.mass * x,
                f"{body.name}_moment_y": body.mass * y,
            }


def _outside(trees: Forest, found: dict[str, Number]) -> None:
    """Drives and loads."""
    for drive in trees.mechanism.drives:
        frame = trees.frames[drive.body]
        start = trees.mechanism.body(drive.body).start_angle - trees.offsets[drive.body]
        found |= {f"{frame}_start": start, f"{drive.name}_drive_start": start}
        match drive.kind:
            case "constant-speed":
                found[f"{drive.name}_speed"] = drive.speed
            case "harmonic":
                found[f"{drive.name}_mean"] = drive.mean - trees.offsets[drive.body]
                found[f"{drive.name}_amplitude"] = drive.amplitude
                found[f"{drive.name}_rate"] = 2 * math.pi * drive.frequency
                found[f"{drive.name}_phase"] = drive.phase
            case "table":
                found[f"{drive.name}_rate"] = drive.advance / drive.seconds
                found[f"{drive.name}_shift"] = trees.offsets[drive.body]
            case _:
                found[f"{drive.name}_speed"] = drive.initial_speed
        if drive.kind == "torque":
            known = drive.torque is not None and not drive.table
            found[f"{drive.name}_torque"] = drive.torque if known else 1.0  # type: ignore[assignment]
            for name, rows in drive.straight.items():
                found |= hinges(name, rows)
            if drive.no_load_speed is not None:
                found[f"{drive.name}_fall"] = 1.0 / drive.no_load_speed
    for acting in (*trees.mechanism.loads, *trees.mechanism.clearances):
        found |= acting.numbers()


def row_of(motion: Motion, base: dict[str, Number]) -> dict[int, Number]:
    """Values by row of `par`: base parameters as they are, derived ones worked out from their texts."""
    found = {}
    for name, row in motion.parameters.items():
        text = motion.derived.get(name)
        # the text is the generator's own arithmetic of names
        found[row] = base[name] if text is None else eval(text, {"__builtins__": {}}, base)
    return found
