"""A scene in words: effects that are on, numbers that are hardly meant, differences of scenes, cited work."""

import math
import re
from collections.abc import Iterator, Mapping

from hpcclear.base.units import is_written_in, to_si
from hpcclear.base.written import reading, shown, text_of, unit_for
from hpcclear.plugins.sources import digest
from hpcclear.scene.about import inputs_of
from hpcclear.scene.driving import CrankTorque, speed_entry
from hpcclear.scene.fields import Content
from hpcclear.scene.paths import curve_at, flatten, replace
from hpcclear.scene.planar import Planar, slender_inertia
from hpcclear.scene.slider_crank import SliderCrank
from hpcclear.scene.tables import SceneTables

FASTEST = 30.0
"""Mean slider speed of the fastest engines that are built, m/s: racing engines reach 26."""
MOST_TURNS = 30_000.0
"""Revolutions a minute: small model engines reach as many."""
WIDEST = 0.1
"""Clearance over bearing radius; worn bearings reach a hundredth, the mechanisms that publications study a twentieth."""
STEEL = 7850.0
"""kg/m3."""
PLAUSIBLE = (
    (r"mechanism\.(crank|rod|bodies\.[^.]+)\.length", 0.0, 5.0, "", "long for a bar", 'if mm are meant, write "{:g} mm"'),
    (r".*\.youngs_modulus", 1e6, 1.3e12, "softer than rubber", "stiffer than diamond",
     'steel has "206 GPa", bronze "110 GPa", a polymer "2 GPa"'),
    (r".*\.film\.viscosity", 1e-5, 20.0, "thinner than air", "thicker than any oil",
     'engine oil has 0.01 Pa s when hot and 0.3 when cold, and if mPa s are meant, write "{:g} mPa*s"'),
    (r"effects\.gravity", 0.0, 100.0, "", "ten times the Earth's", "write 9.81"),
    (r"effects\.friction\.(static_)?coefficient", 0.0, 1.0, "", "above 1", "lubricated bearings have 0.001 to 0.1"),
)  # fmt: skip
"""Entries by their paths, the smallest and largest number (SI) that is likely meant, what one beyond these is, and a remedy."""


def implausible(scene: SceneTables) -> Iterator[str]:
    """A sentence for each number that is likely a slip of units."""
    if isinstance(scene.mechanism, SliderCrank):
        yield from _drive(scene)
        yield from _rod(scene)
    for path in scene.numeric_paths():
        for pattern, least, most, below, above, remedy in PLAUSIBLE:
            number = scene.number(path)
            if re.fullmatch(pattern, path) and number and not least <= number <= most:
                what = below if number < least else above
                yield f"{path} = {scene.shown(path)} is {what}; {remedy.format(number)}"
    yield from _bodies(scene)
    yield from _joints(scene)
    if scene.study is not None and scene.objective.of_joints and not scene.clearance_joints():
        remedy = 'name one of the motion, or set a joint\'s kind = "clearance"'
        yield f'study.objective = "{scene.objective.name}" is 0 where all joints are ideal; {remedy}'
    loops = scene.template is None or scene.numerics.formulation == "baumgarte"
    if loops and scene.numerics.beta == 0.0:
        yield "numerics.beta = 0 lets loops without clearance drift; use 100 to 1000 1/s"


def _drive(scene: SceneTables) -> Iterator[str]:
    drive = scene.drive
    key = speed_entry(drive)
    speed = abs(float(getattr(drive, key)))
    turns = speed / (2.0 * math.pi)
    mean = 4.0 * scene.slider_crank.crank.length * turns
    if mean > FASTEST or 60.0 * turns > MOST_TURNS:
        size = f"{60.0 * turns:.0f} rpm, a mean slider speed of {mean:.3g} m/s"
        remedy = f'engines stay below {FASTEST:g} m/s. If rpm are meant, write "{speed:.6g} rpm"'
        yield f"drive.{key} = {scene.shown(f'drive.{key}')} is {size}; {remedy}"


def _bodies(scene: SceneTables) -> Iterator[str]:
    bodies = {scene.path_in_scene(f"mechanism.bodies.{b.name}"): b for b in scene.linkage.bodies}
    lengths = {key: body.length for key, body in bodies.items() if body.length is not None}
    for key, length in lengths.items():
        own, share = bodies[key].own_inertia, bodies[key].own_inertia / bodies[key].mass / length**2
        if share > 100.0:
            size = f"{scene.in_unit(own, 'kg*m**2')} is {share:.2g} times mass times length squared"
            remedy = "check the unit, or give a flywheel as flywheel_inertia of a drive"
            yield f"{key}.inertia = {size}; {remedy}"
    places = [*scene.linkage.ground.points, *(one for b in bodies.values() for one in b.points)]
    sizes = [*lengths.values(), *(math.hypot(one.x, one.y) for one in places)]
    heaviest = 5.0 * STEEL * (max(sizes, default=0.0) or math.inf) ** 3
    for key, body in bodies.items():
        if body.mass > heaviest:
            size = f"more than five steel cubes as long as the mechanism ({heaviest:.3g} kg)"
            remedy = f'if grams are meant, write "{body.mass:g} g"'
            yield f"{key}.mass = {scene.shown(f'{key}.mass')} is {size}; {remedy}"


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
        key = "mechanism.rod.bending.stiffness"
        size = f"{key} = {scene.shown(key)} buckles under {buckling:.3g} N"
        load = f"the inertia of rod and slider comes to {inertia:.3g} N"
        yield f"{size}, and {load}; deflections are large there"


def _joints(scene: SceneTables) -> Iterator[str]:
    for name in scene.pins():
        pin, key = scene.pin(name), f"{scene.joint_key(name)}.clearance"
        if (share := pin.clearance / pin.bearing_radius) > WIDEST:
            size = f"{scene.shown(key)} is {100 * share:.0f} % of the bearing's radius"
            remedy = "write the radial clearance, half of the difference of the diameters"
            yield f"{key} = {size}; {remedy}"
    for name, film in scene.films().items():
        key = f"{scene.joint_key(name)}.film"
        ratio = 0.5 * film.length / scene.pin(name).bearing_radius
        least, most = film.law.lengths
        if not least <= ratio <= most:
            what = f"the load capacity of a bearing {ratio:.2g} diameters long"
            remedy = f'It is for {film.law.valid}; model = "finite" covers all lengths'
            yield f'{key}.model = "{film.model}" overestimates {what}. {remedy}'


TITLE = (
    "Robust Optimization of Planar Constrained Mechanical System with Varying Joint Clearance "
    "Size Based on Sensitivity Analysis"
)

BIBTEX = f"""@article{{ShockVibration6079249,
  title   = {{{TITLE}}},
  journal = {{Shock and Vibration}},
  volume  = {{2020}},
  pages   = {{6079249}},
  year    = {{2020}},
  url     = {{https://www.hindawi.com/journals/sv/2020/6079249/}},
  note    = {{Add the authors from the journal's page}},
}}"""
"""The same work for BibTeX; the text used for this program does not name its authors."""

_LENGTHS = {"crank.length": 0.05, "rod.length": 0.12}  # m
_JOINT = {
    "bearing_radius": 0.02,  # m
    "bearing.youngs_modulus": 0.5e9,  # Pa
    "bearing.poisson_ratio": 0.38,
    "journal.youngs_modulus": 206.8e9,  # Pa
    "journal.poisson_ratio": 0.29,
}


def cited_by(scene: SceneTables) -> str:
    """Title of the work the mechanism of a scene is taken from, "" for one of its user's own."""
    expected = {f"mechanism.{name}": value for name, value in _LENGTHS.items()}
    for joint in scene.clearance_joints():
        expected |= {f"joints.{joint}.{name}": value for name, value in _JOINT.items()}
    known = len(expected) > len(_LENGTHS) and expected.keys() <= {*scene.numeric_paths()}
    numbers = expected.items() if known else ()
    same = all(math.isclose(scene.number(path), one, rel_tol=1e-9) for path, one in numbers)
    return TITLE if known and same else ""


def effects_on(scene: SceneTables) -> Iterator[str]:
    """What is on, in words."""
    for name in scene.clearance_joints():
        size = scene.shown(f"{scene.joint_key(name)}.clearance")
        joint = scene.clearance_joint(name)
        where = f"the {name}" if joint.noun == name else f"{joint.noun} {name}"
        yield f"clearance {size} in {where}"
        if joint.out_of_round is not None:
            yield f"joint {name} out of round"
    for name in scene.worn_joints():
        yield f"wear of joint {name}"
    for name, film in scene.films().items():
        viscosity = scene.shown(f"{scene.joint_key(name)}.film.viscosity")
        yield f"{film.model} oil film of {viscosity} in joint {name}"
    for key, bar in scene.bending().items():
        number = f"{bar.modes} modes" if bar.modes > 1 else "one mode"
        stiffness = scene.shown(f"{key}.bending.stiffness")
        yield f"bending of {key.rpartition('.')[2]} in {number}, {stiffness}"
    effects = scene.effects
    if scene.clearance_joints() and effects.contact is not None:
        yield f"contact law {effects.contact.law}"
    if effects.friction.law != "none":
        coefficient = effects.friction.value("coefficient")
        size = "" if coefficient is None else f", coefficient {coefficient:g}"
        yield f"friction {effects.friction.law}{size}"
    if isinstance(scene.drive, CrankTorque):
        falls = "" if scene.drive.no_load_speed is None else ", torque falling with speed"
        rest = ", from rest" if scene.drive.initial_speed == 0.0 else ""
        yield f"torque-driven crank{falls}{rest}"
    if isinstance(scene.mechanism, Planar):
        for row in (*scene.mechanism.drives, *scene.mechanism.loads):
            yield f"{row.kind} {row.name}"
    if effects.gravity != 0:
        yield f"gravity {scene.shown('effects.gravity')}"
    if effects.slider_load is not None:
        shape = "constant" if isinstance(effects.slider_load, float) else "against crank angle"
        yield f"slider load, {shape}"
    yield from scene.joint_effects().values()
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
        key = scene.path_in_scene(f"mechanism.bodies.{bar.name}")
        least = slender_inertia(bar.mass, bar.length)
        if 0.0 < bar.own_inertia < least * (1 - 1e-12):
            given, thin = (scene.in_unit(one, "kg*m**2") for one in (bar.own_inertia, least))
            rod = f"a thin uniform rod of that mass and length has ({thin})"
            yield f"{key}.inertia = {given} is less than {rod}"
        if not 0 <= (bar.mass_center or 0.0) <= bar.length:
            place, end = (scene.shown(f"{key}.{entry}") for entry in ("mass_center", "length"))
            yield f"{key}.mass_center = {place} lies beyond the pins, which are at 0 and {end}"
    for name in scene.pins():
        joint, entry = scene.pin(name), f"{scene.joint_key(name)}.start_eccentricity"
        start = joint.start_eccentricity
        if start.x**2 + start.y**2 > joint.clearance**2 * (1 + 1e-12):
            yield f"{entry} lies outside the clearance, so the run starts in contact"
    for variable in scene.study.variables if scene.study is not None else ():
        own = [scene.number(path) for path in variable.paths]
        low, high = variable.range or (-math.inf, math.inf)
        if not all(low <= value <= high for value in own):
            path, key = variable.paths[0], f"study.variables.{variable.name}"
            ends = " to ".join(scene.shown(path, end) for end in (low, high))
            outside = f"the scene's own value {scene.shown(path)} lies outside"
            yield f"{key} runs from {ends}, and {outside}"
    yield from unused(scene)


def unused(scene: SceneTables) -> Iterator[str]:
    """What a scene and its study state and nothing reads."""
    numerics, study = scene.numerics, scene.study
    default = type(numerics).model_fields["target_revolutions"].default
    if numerics.target_error is None and numerics.target_revolutions != default:
        yield "numerics.target_revolutions is not used: there is no numerics.target_error"
    if study is None:
        return
    draws, algorithm = study.verification.draws is not None, study.swarm.algorithm
    asked = {goal.statistic for case in study.cases for goal in (*case.goals, *case.kept)}
    for table, entries, idle, why in (
        ("verification", "least_samples most_samples contest", draws, "a design gets `samples` draws"),
        ("verification", "infill_designs infill_samples", not study.verification.infill_rounds, "infill_rounds is 0"),
        ("swarm", "c1 c2 inertia", algorithm not in (None, "swarm"), f"{algorithm} has settings of its own"),
        ("accuracy", "quantile", "quantile" not in asked, "no case has a quantile"),
        ("accuracy", "exceedance", "exceedance" not in asked, "no case has an exceedance"),
    ):  # fmt: skip
        own = getattr(study, table)
        for entry in entries.split() if own is not None and idle else ():
            if getattr(own, entry) != type(own).model_fields[entry].default:
                yield f"study.{table}.{entry} is not used: {why}"
    used = {name for case in study.cases for name in case.random}
    for row in study.random if used and scene.wear is None else ():  # which draws them all
        if row.name not in used:
            yield f"study.random.{row.name} is in no case, so hpcclear run does not use it; add it to one of study.cases"
    if study.accuracy is not None and draws:
        yield "study.accuracy is not used: study.verification names how many draws a design gets"
    if study.groups or study.sensitivity.groups == ():
        return
    if study.sensitivity.model_fields_set - {"parameter"}:  # which has a default of the scene's own
        why = "no group of variables is named, and these variables have no usual groups"
        remedy = "Name them in study.sensitivity.groups, and the fixed one in study.sensitivity.parameter"
        yield f"study.sensitivity is not used: {why}. {remedy}"


def _entry(scene: SceneTables, key: str, entries: Mapping[str, object]) -> str:
    if key not in entries:
        return "(not set)"
    return scene.shown(key) if key in scene.numeric_paths() else repr(entries[key])


def differences(first: SceneTables, second: SceneTables) -> list[str]:
    """Dotted keys in which two scenes differ, each with both values; empty when their hashes are equal."""
    ours, theirs = (dict(flatten(inputs_of(one.resolved()))) for one in (first, second))
    for entries in (ours, theirs):
        for key in entries:
            if key.startswith("plugins.files."):
                entries[key] = f"SHA-256 {digest(entries[key])}"
    keys = [key for key in {**ours, **theirs} if ours.get(key) != theirs.get(key)]
    lines = [f"{k}: {_entry(first, k, ours)} -> {_entry(second, k, theirs)}" for k in keys]
    if not lines and first.hash != second.hash:
        lines.append("study: the order of variables or random inputs")
    return lines


def as_written(scene: SceneTables) -> Content:
    """The resolved content of a scene, quantities as they were written."""
    content = scene.resolved()
    for path, value in flatten(content):
        pairs = curve_at(path)
        units = _unit_of(scene, path) if pairs is None else (pairs.x, pairs.unit)
        if units:
            content = replace(content, path, _as_written(scene, value, units))
    return content


def _unit_of(scene: SceneTables, path: str) -> str:
    """The SI unit of an entry of the resolved content, "" for one without or of which it is not known."""
    if path in scene.numeric_paths():
        return scene.unit(path)
    top, table, name, *_ = (*path.split("."), "", "")
    rows = () if scene.study is None or top != "study" else getattr(scene.study, table, ())
    if table not in ("variables", "random"):
        return ""
    return next((scene.unit(one.paths[0]) for one in rows if one.name == name and one.paths), "")


def _as_written(scene: SceneTables, value: object, unit: str | tuple[str, str]) -> object:
    """A number (SI) as a text of the unit that was written, where that reads the same; lists and pairs likewise."""
    if isinstance(value, list):
        pair = isinstance(unit, tuple) and value and isinstance(value[0], float)
        units = unit if pair else [unit] * len(value)
        return [_as_written(scene, one, its) for one, its in zip(value, units, strict=True)]
    unit = unit if isinstance(unit, str) else unit[1]
    if not isinstance(value, float):
        return value
    with reading(scene._texts):
        text = text_of(value, unit) or (unit_for(unit) != unit and shown(value, unit))
    same = text and is_written_in(text) and to_si(text, unit, decided=True) == value
    return text if same else value
