"""The page of machines with plain bearings: a sketch of each, numbers by hand beside those of its simulation, and an answer.

    python analysis/machines.py

Simulates the scenes of ``jobs/machines`` and the compressor, draws them into ``docs/images/machines`` and writes the tables
to `analysis/results/machine_*.csv`. Half a minute of processor time.
"""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from recorded import record

from hpcclear import load_scene, simulate
from hpcclear.base.outcome import Flag
from hpcclear.dynamics.planar.problem import poses_at_start
from hpcclear.report import sketch_figure
from hpcclear.report.figures.labels import quantity
from hpcclear.report.figures.style import render

ROOT = Path(__file__).parent.parent
PICTURES = ROOT / "docs" / "images" / "machines"


class Check(NamedTuple):
    """A number by hand and by simulation, and how far they may differ, relative."""

    words: str
    by_hand: float
    simulated: float
    unit: str
    within: float


def engine_by_hand(scene, found):
    """The gas force less the inertia of piston and rod, at the dead centre."""
    m, w = scene.mechanism, scene.drive.speed
    r, length = m.crank.length, m.rod.length
    gas = -scene.effects.slider_load[0][1]
    piston = gas - m.slider.mass * r * w**2 * (1.0 + r / length)
    crank = piston - m.rod.mass * r * w**2 * (1.0 + r / length * m.rod.mass_center / length)
    force = found["peak_contact_force"].sel
    yield Check("peak force in the piston pin", piston, float(force(joint="rod_slider")), "N", 0.01)
    yield Check("peak force in the crank pin", crank, float(force(joint="crank_rod")), "N", 0.01)


def compressor_by_hand(scene, found):
    """The first order of the force on the frame, of a rod whose mass is shared between its ends."""
    m, w = scene.mechanism, scene.drive.speed
    at_pin = m.rod.mass * m.rod.mass_center / m.rod.length
    turning = m.rod.mass - at_pin
    sizes = m.slider.mass + at_pin + turning, turning
    first = np.hypot(*sizes) / np.sqrt(2.0) * m.crank.length * w**2
    simulated = float(found["frame_force_orders"].sel(order=1.0))
    yield Check("RMS of the first order of the force on the frame", first, simulated, "N", 0.03)


def johnson(scene, joint, force):
    """Depth of a small contact by Johnson's formula, m."""
    pin = getattr(scene.joints, joint)
    compliance = sum(
        (1.0 - one.poisson_ratio**2) / one.youngs_modulus for one in (pin.bearing, pin.journal)
    )
    ratio = force * compliance / (pin.length * pin.clearance)
    return pin.clearance * ratio / np.pi * (np.log(4.0 * np.pi / ratio) - 1.0)


def above_bottom(scene, found):
    """How far above the bottom of a press without clearance the ram is at a crank angle of 0, m."""
    at_bottom = found.isel(time=scene.output.instants_per_revolution)
    lowest = scene.mechanism.crank.length + scene.mechanism.rod.length
    return lowest - float(at_bottom["slider_position"])


def press_by_hand(scene, found):
    """Clearances and depths of both pins; the contacts are wider than Johnson's formula is for."""
    force = -scene.effects.slider_load[0][1]
    joints = ("crank_rod", "rod_slider")
    rest = sum(getattr(scene.joints, one).clearance + johnson(scene, one, force) for one in joints)
    yield Check("ram above its bottom", rest, above_bottom(scene, found), "m", 0.1)


def pump_by_hand(scene, found):
    """The force across the guide where the rod is steepest, with the friction of guide and crank pin; the largest offset."""
    m, guide, friction = scene.mechanism, scene.joints.guide, scene.effects.friction.coefficient
    last = found.isel(time=slice(-scene.output.instants_per_revolution - 1, None))
    angle = np.mod(last["crank_angle"].to_numpy(), 2.0 * np.pi)
    k = int(np.abs(angle - 1.5 * np.pi).argmin())
    force = last["contact_force"].isel(time=k)
    left, right = (
        sum(float(force.sel(joint=f"guide.{end}_{side}")) for end in ("front", "back"))
        for side in ("left", "right")
    )
    gas = -dict(scene.effects.slider_load)[1.5 * np.pi]
    angle = np.arcsin(m.crank.length / m.rod.length)
    lever = friction * scene.joints.crank_rod.bearing_radius / m.rod.length / np.cos(angle)
    across = gas * (np.tan(angle) + lever) / (1.0 - friction * np.tan(angle))
    yield Check("force across the guide at 270 deg", across, abs(left - right), "N", 0.03)
    simulated = float(np.abs(last["guide_offset"]).max())
    yield Check("largest offset of the plunger", guide.clearance, simulated, "m", 0.1)


def swing_of(found):
    """Angle over which the arm swings, rad."""
    angle = found["body_angle"].sel(body="arm").to_numpy()
    return float(np.ptp(angle[found.sizes["time"] // 4 :]))


def wiper_by_hand(scene, found):
    """The angles of two triangles."""
    lengths = {one.name: one.length for one in scene.mechanism.bodies}
    ground = 0.31
    ends = [
        np.arccos((arm**2 + ground**2 - reach**2) / (2.0 * arm * ground))
        for arm in (lengths["arm"],)
        for reach in (lengths["coupler"] - lengths["crank"], lengths["coupler"] + lengths["crank"])
    ]
    yield Check("swing of the arm", float(np.diff(ends)[0]), swing_of(found), "rad", 0.01)


Row = tuple[str, ...]


def engine_answer(scene):
    """Peak pressure in the crank pin against its clearance."""
    yield ("clearance of the crank pin", "peak pressure", "half angle of contact")
    for clearance in (25e-6, 50e-6, 75e-6):
        found = simulate(scene.with_({"joints.crank_rod.clearance": clearance}))
        at_pin = found.sel(joint="crank_rod")
        angle = np.degrees(float(at_pin["contact_half_angle"]))
        pressure = quantity(float(at_pin["peak_contact_pressure"]), "Pa", 3)
        yield (quantity(clearance, "m", 3), pressure, f"{angle:.0f} deg")


def compressor_answer(scene):
    """Level of the force on the frame at 1 kHz against the clearance of both pins."""
    yield ("clearance of both pins", "force level at 1 kHz, dB re 1 µN", "95 % CI, dB")
    for clearance in (None, 5e-5, 1e-4):
        changes = {f"joints.{one}.clearance": clearance for one in ("crank_rod", "rod_slider")}
        found = simulate(scene if clearance is None else scene.with_(changes))
        level, low, high = (
            float(found[f"frame_force_level{end}"].sel(band=1000.0, method="nearest"))
            for end in ("", "_lower", "_upper")
        )
        name = "new" if clearance is None else quantity(clearance, "m", 3)
        yield (name, f"{level:.1f}", f"{low:.1f} to {high:.1f}")


def press_answer(scene):
    """Height of the ram at the bottom, new and worn."""
    yield ("clearance of both pins", "ram above its bottom under 250 kN")
    for clearance in (None, 1.5e-4):
        changes = {f"joints.{one}.clearance": clearance for one in ("crank_rod", "rod_slider")}
        one = scene if clearance is None else scene.with_(changes)
        name = "new" if clearance is None else quantity(clearance, "m", 3)
        yield (name, quantity(above_bottom(one, simulate(one)), "m", 3))


def pump_answer(scene):
    """Impacts and pressure of the corners against the clearance of the guide."""
    yield (
        "clearance of the guide",
        "energy lost in impacts of the corners, a revolution",
        "peak pressure at a corner",
    )
    for clearance in (15e-6, 30e-6, 60e-6):
        found = simulate(scene.with_({"joints.guide.clearance": clearance}))
        corners = [str(one) for one in found["joint"].to_numpy() if str(one).startswith("guide")]
        own = found.sel(joint=corners)
        energy = quantity(float(own["impact_energy"].sum()), "J", 3)
        yield (
            quantity(clearance, "m", 3),
            energy,
            quantity(float(own["peak_contact_pressure"].max()), "Pa", 3),
        )


def wiper_answer(scene):
    """Swing of the arm against the clearance of both pins."""
    yield ("clearance of both pins", "swing of the arm")
    pins = ("crank_pin", "arm_pin")
    for clearance in (5e-5, 1.5e-4, 3e-4):
        changes = {f"mechanism.joints.{one}.clearance": clearance for one in pins}
        swing = np.degrees(swing_of(simulate(scene.with_(changes))))
        yield (quantity(clearance, "m", 3), f"{swing:.2f} deg")


class Machine(NamedTuple):
    """A scene, its numbers by hand, and the rows of its answer, headings first."""

    file: str
    by_hand: Callable[..., Iterator[Check]]
    answer: Callable[..., Iterator[Row]]


MACHINES = {
    "engine": Machine("machines/engine", engine_by_hand, engine_answer),
    "compressor": Machine("compressor", compressor_by_hand, compressor_answer),
    "press": Machine("machines/press", press_by_hand, press_answer),
    "pump": Machine("machines/pump", pump_by_hand, pump_answer),
    "wiper": Machine("machines/wiper", wiper_by_hand, wiper_answer),
}


def scene_of(name):
    """The scene of a machine."""
    return load_scene(ROOT / "jobs" / f"{MACHINES[name].file}.toml")


def shown(value, unit):
    """A number with its unit, angles in degrees or mrad."""
    if unit == "rad":
        return f"{np.degrees(value):.1f} deg" if value > 0.1 else f"{value * 1e3:.2f} mrad"
    return quantity(value, unit, 4)


def measure(name):
    """Record the tables of a machine."""
    scene = scene_of(name)
    found = simulate(scene)
    rows = [("quantity", "by hand", "simulated")]
    for one in MACHINES[name].by_hand(scene, found):
        rows.append((one.words, shown(one.by_hand, one.unit), shown(one.simulated, one.unit)))
    assert not int(found["flags"]) & Flag.BEYOND_HERTZ
    record(f"machine_{name}", rows)
    record(f"machine_{name}_answer", MACHINES[name].answer(scene))


def main():
    """Draw, simulate, record."""
    PICTURES.mkdir(exist_ok=True)
    for name in MACHINES:
        scene = scene_of(name)
        turned = 0.0 if scene.template is None else 1.0
        figure = sketch_figure(scene, poses_at_start(scene, turned))
        (PICTURES / f"{name}.png").write_bytes(render(figure, dpi=150))
        measure(name)


if __name__ == "__main__":
    main()
