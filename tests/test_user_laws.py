"""Laws that nobody here wrote, from files beside the scene and from formulas: against an integration of its own, in the
lanes, on ranks, and refused where they are at fault."""

import math
import shutil
from pathlib import Path

import commands
import numpy as np
import pytest
import tomli_w
from oracle import SliderCrank
from refusals import refused
from running import run

from hpcclear.base.errors import InputError
from hpcclear.dynamics.contacts.laws import in_lanes
from hpcclear.dynamics.physics import powers
from hpcclear.scene import Scene, load_scene
from hpcclear.scene.laws import ENTRIES
from hpcclear.scene.paths import quantities

ROOT = Path(__file__).parents[1]


LAWS = Path(__file__).parent / "data" / "mylaws.py"
NO_FRICTION = {"law": "none"}
ZHIYING = {"law": "mylaws:ZhiyingQishao", "restitution": 0.2}
POWER = {"law": "mylaws:Power", "force_at": "300 N", "exponent": 1.2}
EXPONENTIAL = {"law": "mylaws:Exponential", "force_at": "500 N"}
STRIBECK = {
    "law": "mylaws:MyStribeck",
    "coefficient": 0.05,
    "static_coefficient": 0.1,
    "stribeck_speed": "0.5 m/s",
    "ramp_speed": 0.05,
}
FORMULA = {
    "law": "expression",
    "force": "K * d**1.5 * (1 + b * v)",
    "units": {"b": "s/m"},
    "b": "0.5 s/m",
}


def file_with(folder: Path, contact: dict, friction: dict = NO_FRICTION, **more) -> Path:
    """A scene file of the paper's slider-crank with these laws, and the laws' file beside it."""
    scene = load_scene(ROOT / "jobs" / "slider_crank.toml").with_({"study": None})
    content = scene.resolved()
    content["effects"] |= {"contact": contact, "friction": friction}
    for joint in ("crank_rod", "rod_slider"):
        content["joints"][joint] = {**content["joints"]["crank_rod"], "clearance": 3e-4}
    content["numerics"] |= {"rtol": 1e-8, "transient_revolutions": 0, "averaged_revolutions": 1}
    content["numerics"] |= {"energy": True} | more
    shutil.copy(LAWS, folder / "mylaws.py")
    path = folder / "scene.toml"
    path.write_text(tomli_w.dumps(content), encoding="utf-8")
    return path


def oracle_of(scene: Scene, contact, friction=None) -> SliderCrank:
    """The integration of its own, with other laws: of (depth, rate, impact speed, Hertz' stiffness); of the sliding speed."""
    content = scene.resolved()
    latched = scene.effects.contact.latched
    content["effects"]["contact"] = {"law": "lankarani-nikravesh", "restitution": 1.0}
    content["effects"]["friction"] = NO_FRICTION
    made = SliderCrank(content)
    for joint in made.joints:
        stiffness = joint.stiffness
        joint.latched = latched
        joint.law = lambda d, v, v0, k=stiffness: contact(d, v, v0, k)
        joint.rubs = friction
    return made


def zhiying(d, v, v0, k):
    e = 0.2
    return k * d**1.5 * (1 + 3 * (1 - e**2) * math.exp(2 * (1 - e)) * v / (4 * v0))


CASES = {
    "Zhiying and Qishao": (ZHIYING, NO_FRICTION, zhiying, None),
    "exponent 1.2": (
        POWER, NO_FRICTION, lambda d, v, v0, k: 300 * (d / 1e-5) ** 1.2 * (1 + 0.3 * v), None,
    ),
    "exponential": (
        EXPONENTIAL, NO_FRICTION, lambda d, v, v0, k: 500 * math.expm1(min(d / 5e-5, 99.0)) * (1 + 0.3 * v), None,
    ),
    "a Stribeck curve": (
        FORMULA, STRIBECK, lambda d, v, v0, k: k * d**1.5 * (1 + 0.5 * v),
        lambda v: (0.05 + 0.05 * math.exp(-abs(v) / 0.5)) * math.tanh(v / 0.05),
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
@pytest.mark.shortened(2)
def test_a_user_s_law_gives_what_an_independent_solver_gives(case, tmp_path):
    """A revolution from rest in the clearance, to 1e-8 in f and 1e-12 m at its end; scipy's order 8 at its tightest."""
    contact, friction, force, ratio = CASES[case]
    scene = load_scene(file_with(tmp_path, contact, friction, rtol=1e-12))
    state, expected = oracle_of(scene, force, ratio).run(0, 1, method="DOP853", rtol=1e-13)
    result = run(scene)
    assert result.out.status == 0
    assert float(result.out.objective) == pytest.approx(expected, rel=1e-8)
    np.testing.assert_allclose(result.q[-1], state[:4], rtol=0.0, atol=1e-12)


# ---- refused where they are at fault ------------------------------------------------------------------------
HEAD = """
import math
from hpcclear import ContactLaw, FrictionLaw, Parameter
def hertz(depth, stiffness): return stiffness * depth**1.5
"""


def faulty(body: str, arguments: str = "depth, rate, stiffness, b", unit: str = "s/m", default=0.5):
    """Source of a contact law `Bad` with a force, and a parameter b if it takes one."""
    own = f'Parameter("b", "{unit}", default={default}),' if "b" in arguments.split(", ") else ""
    force = f"def force({arguments}):\n    {body}\n"
    return f'{force}Bad = ContactLaw(words="", parameters=({own}), force=force)\n'


HERTZ = "return stiffness * depth**1.5"
FAULTS = {
    "a wrong unit": (faulty(f"{HERTZ} * (1 + b * rate)", unit="s**2/m"), "force does not fit its units"),
    "pulls": (faulty(f"{HERTZ} * (1 - b * rate)"), "the contact force pulls"),
    "creates energy at a small damping": (
        faulty(f"{HERTZ} * (1 - b * rate)", default=1e-4), "an impact gains energy",
    ),
    "not finite": (faulty(f"{HERTZ} * (1 + b / (rate - rate))", unit="m/s"), "not finite"),
    "energy of another force": (
        "def energy(depth, stiffness):\n    return 0.5 * stiffness * depth**2.5\n"
        'Bad = ContactLaw(words="", force=hertz, energy=energy)',
        "the energy does not match",
    ),
    "a force where nothing touches": (
        faulty(f"{HERTZ} + b * rate", unit="N*s/m", default=50.0), "without contact",
    ),
    "a loop": (
        faulty(f"for _ in range(3):\n        depth = depth * 1.0\n    {HERTZ}", "depth, stiffness"),
        "more than arithmetic",
    ),
    "a word that lanes have not": (
        faulty(f"{HERTZ} * math.erf(1.0)", "depth, stiffness"), "which the kernel does not provide",
    ),
    "what nobody gives": (
        faulty("return stiffnes * depth**1.5", "depth, stiffnes"), "uses 'stiffnes', which is not defined",
    ),
    "stored energy by the impact speed": (
        faulty(f"{HERTZ} * (1 + b * impact_speed)", "depth, impact_speed, stiffness, b"),
        "depends on the impact speed",
    ),
    "a law of another kind": (
        "def ratio(speed, b):\n    return b * speed\n"
        'Bad = FrictionLaw(words="", parameters=(Parameter("b", "s/m", default=0.5),), ratio=ratio)',
        "is no contact law",
    ),
}  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS)
def test_a_law_with_a_fault_is_refused_with_the_reason(fault, tmp_path):
    source, reason = FAULTS[fault]
    path = file_with(tmp_path, {"law": "bad:Bad"})
    (tmp_path / "bad.py").write_text(HEAD + source, encoding="utf-8")
    with refused("effects.contact.law", reason=reason) as caught:
        load_scene(path)
    assert caught.value.value == "bad:Bad"


ONE_PARAMETER = """
def force(depth, rate, stiffness, {name}):
    return stiffness * depth**1.5 * (1 + {factor} * {name} * rate)
Bad = ContactLaw(words="", parameters=(Parameter("{name}", "{unit}", default=0.5, least=0),), force=force)
"""


@pytest.mark.parametrize("name", ["damping", "only_here"])
def test_a_unit_is_that_of_the_scene_s_own_law(name, tmp_path):
    """One of our laws has a damping in s/m. Where laws of one process disagree, a design variable has no known unit."""
    scenes = {}
    for unit, factor in (("s/m", 1), ("ms/m", 1e-3)):
        folder = tmp_path / unit.partition("/")[0]
        folder.mkdir()
        path = file_with(folder, {"law": "bad:Bad"})
        text = HEAD + ONE_PARAMETER.format(name=name, unit=unit, factor=factor)
        (folder / "bad.py").write_text(text, encoding="utf-8")
        scenes[unit] = load_scene(path)
    entry = f"effects.contact.{name}"
    assert {unit: scene.unit(entry) for unit, scene in scenes.items()} == {
        "s/m": "s/m",
        "ms/m": "ms/m",
    }
    with refused(entry, match="in ms/m and s/m"):
        quantities()[entry]
    del ENTRIES[entry]["ms/m"]
    assert quantities()[entry].unit == "s/m"


@pytest.mark.parametrize("name", ["law", "units", "force", "minimum_impact_speed"])
def test_a_parameter_is_not_called_like_an_entry_of_every_law(name, tmp_path):
    path = file_with(tmp_path, {"law": "bad:Bad"})
    text = HEAD + ONE_PARAMETER.format(name=name, unit="s/m", factor=1)
    (tmp_path / "bad.py").write_text(
        text.replace("def force(", "def its(").replace("force=force", "force=its")
    )
    with pytest.raises(InputError, match="an entry of every law's table"):
        load_scene(path)


def test_friction_that_drives_sliding_on_is_refused(tmp_path):
    path = file_with(
        tmp_path,
        ZHIYING,
        {"law": "expression", "ratio": "0.1 - v * b", "units": {"b": "s/m"}, "b": 0.1},
    )
    with pytest.raises(InputError, match="drives sliding on"):
        load_scene(path)


def test_parameters_have_units_bounds_and_defaults(tmp_path):
    scene = load_scene(file_with(tmp_path, POWER))
    assert scene.number("effects.contact.force_at") == 300.0
    assert scene.unit("effects.contact.force_at") == "N"
    assert scene.effects.contact.value("chi") == 0.3
    for wrong, said in (
        ({"force_at": "3 m"}, "does not fit"),
        ({"force_at": -1.0}, "must be above 0 N"),
        ({"forces_at": 1.0}, "is not a known key"),
    ):
        with refused(reason=said):
            scene.with_({"effects.contact": POWER | wrong})
    bare = {"law": "mylaws:Power"}
    with pytest.raises(InputError, match="needs a force_at"):
        scene.with_({"effects.contact": bare})


def test_a_formula_is_the_law_it_writes_out(tmp_path):
    """Hunt and Crossley's, to the rounding of the motion."""
    scene = load_scene(file_with(tmp_path, FORMULA))
    ours = scene.with_({"effects.contact": {"law": "hunt-crossley", "damping": 0.5}})
    one, other = run(scene), run(ours)
    assert float(one.out.objective) == pytest.approx(float(other.out.objective), rel=1e-9)
    assert one.out.peak_force[:2] == pytest.approx(other.out.peak_force[:2], rel=1e-5)


# ---- the words that laws may use --------------------------------------------------------------------------------
def test_words_of_laws_are_as_good_as_the_library_s():
    x = np.concatenate([np.linspace(-30, 30, 4001), np.logspace(-12, 2, 400)])
    positive = np.abs(x) + 1e-300
    for ours, theirs, at_ in (
        (powers.exponential, np.exp, x),
        (powers.logarithm, np.log, positive),
        (powers.tanh, np.tanh, x),
        (powers.arctan, np.arctan, x),
    ):
        got = np.array([ours(one) for one in at_])
        np.testing.assert_allclose(got, theirs(at_), rtol=1e-14, atol=4e-16)
    raised = np.array([powers.power(one, 1.37) for one in positive])
    np.testing.assert_allclose(raised, positive**1.37, rtol=2e-13, atol=1e-300)
    assert powers.power(0.0, 1.37) == 0.0
    assert math.isnan(powers.logarithm(math.nan))


def test_a_law_may_branch(tmp_path):
    """Branches become choices, and the law stays one of arithmetic."""
    source = """
def force(depth, rate, stiffness):
    grown = stiffness * depth**1.5
    if rate > 0 and depth > 0:
        factor = 1 + 0.5 * rate / ONE
    elif rate < -2 * ONE:
        return 0.0 * grown
    else:
        factor = 1 + 0.25 * rate / ONE
    return grown * factor
Bad = ContactLaw(words="", parameters=(Parameter("ONE", "m/s", default=1.0),), force=force)
"""
    path = file_with(tmp_path, {"law": "bad:Bad"})
    text = source.replace("stiffness):", "stiffness, ONE):")
    (tmp_path / "bad.py").write_text(HEAD + text, encoding="utf-8")
    law = in_lanes(load_scene(path).effects.contact.declared)
    par = np.array([1e9, 1.0, 1.0])  # stiffness, ONE and its inverse
    for rate, factor in ((1.0, 1.5), (-1.0, 0.75), (-3.0, 0.0), (0.0, 1.0)):
        found = law.force(par, 0, 1e-4, rate, 0.0, 0.0, 0, 1)
        assert found == pytest.approx(1e3 * factor, rel=1e-14)


# ---- on ranks, in files -------------------------------------------------------------------------------------------


def test_laws_are_listed_with_their_sources():
    code, said = commands.run(["show", "laws", "--details"], 0)
    assert code == 0
    for word in ("hunt-crossley", "flores", "lugre", "doi:10.1007/s11044-010-9237-4", "s/m"):
        assert word in said


def test_a_parameter_of_a_fractional_unit_takes_text_in_others(tmp_path):
    law = """
def force(depth, rate, k, chi):
    return k * depth**1.4 * (1 + chi * rate)
Own = ContactLaw(words="", parameters=(Parameter("k", "N/m^1.4"), Parameter("chi", "s/m")), force=force)
"""
    (tmp_path / "own.py").write_text(HEAD + law, encoding="utf-8")
    path = file_with(tmp_path, {"law": "own:Own", "k": "3e4 N/mm^(7/5)", "chi": 0.1})
    assert load_scene(path).effects.contact.value("k") == pytest.approx(3e4 * 10.0**4.2, rel=1e-14)
