"""Objectives of a user, made of the record and of rates that are integrated: against closed forms, the recorded series and what
the kernel integrates itself; on ranks, in files, refused where they are at fault."""

import shutil
from pathlib import Path

import commands
import numpy as np
import opened
import pytest
import tomli_w
from refusals import refused
from running import RIGID
from scipy.integrate import simpson

from hpcclear import evaluate, load_scene, simulate
from hpcclear.base.errors import InputError
from hpcclear.ensemble.identity import run_key

ROOT = Path(__file__).parents[1]
GOALS = Path(__file__).parent / "data" / "mygoals.py"
WEARS = {"length": 0.02, "journal": {"coefficient": 1e-15}}
HEAVIER = {"mechanism.rod.mass": [0.2, 0.25]}


def file_with(
    folder: Path, objective: str, source: str = "", study: dict | None = None, **numerics
) -> Path:
    """A scene file of the paper's slider-crank with friction, and the objectives' file beside it."""
    content = load_scene(ROOT / "jobs" / "slider_crank.toml").with_({"study": None}).resolved()
    content["effects"] |= {
        "contact": {"law": "hunt-crossley", "damping": 0.5},
        "friction": {"law": "coulomb", "coefficient": 0.05, "ramp_speed": 0.05},
    }
    content["numerics"] |= {"rtol": 1e-9, "transient_revolutions": 1, "averaged_revolutions": 1}
    content["numerics"] |= numerics
    if study is None:
        content["numerics"]["objective"] = objective
    else:
        content["study"] = {"objective": objective, **study}
    shutil.copy(GOALS, folder / "mygoals.py")
    if source:
        (folder / "bad.py").write_text(HEAD + source, encoding="utf-8")
    path = folder / "scene.toml"
    path.write_text(tomli_w.dumps(content), encoding="utf-8")
    return path


# ---- against what is known otherwise ------------------------------------------------------------------------
def test_a_rate_of_the_whole_mechanism_has_its_mean_in_closed_form(tmp_path):
    """The mean of w (1 + cos)^2 over turns at the speed w is 1.5 w."""
    scene = load_scene(file_with(tmp_path, "mygoals:Wave"))
    found = evaluate(scene, HEAVIER)
    expected = 1.5 * scene.number("drive.speed")
    np.testing.assert_allclose(found["objective"], expected, rtol=1e-12)
    assert found["objective"].attrs["units"] == "rad/s"
    assert found["objective"].attrs["long_name"] == "objective f, a rate whose mean is known"


def test_a_rate_of_joints_agrees_with_the_recorded_series(tmp_path):
    """Root mean square of the contact force, from 20 000 instants by Simpson's rule."""
    scene = load_scene(file_with(tmp_path, "mygoals:RmsForce"))
    found = simulate(scene.with_({"output.instants_per_revolution": 20_000}))
    force = found["contact_force"].to_numpy()[20_000:]
    time = found["time"].to_numpy()[20_000:]
    expected = np.sqrt(simpson(force**2, x=time, axis=0) / np.ptp(time))
    assert float(found["objective"]) == pytest.approx(expected.max(), rel=1e-6)
    assert float(found["objective_uncertainty"]) < 1e-6 * expected.max()
    assert found.attrs["objective"] == "root mean square contact force"


def test_a_rate_is_the_one_that_the_kernel_integrates_itself(tmp_path):
    """Sliding work of joints that wear; the value adds up the joints. A largest value at the ends of steps is below the peak
    between them."""
    wear = {f"joints.{joint}.wear": WEARS for joint in ("crank_rod", "rod_slider")}
    scene = load_scene(file_with(tmp_path, "mygoals:SlidingWork")).with_(wear)
    found = evaluate(scene, HEAVIER)
    np.testing.assert_array_equal(found["rate_of_objective"], found["sliding_work"])
    np.testing.assert_array_equal(found["objective"], found["sliding_work"].sum("joint"))
    assert found["rate_of_objective"].attrs["units"] == found["objective"].attrs["units"] == "J"
    one = evaluate(scene.with_({"numerics.objective_joints": ("rod_slider",)}), HEAVIER)
    np.testing.assert_array_equal(one["objective"], found["sliding_work"].sel(joint="rod_slider"))


def test_a_largest_value_is_that_at_the_ends_of_steps(tmp_path):
    found = evaluate(load_scene(file_with(tmp_path, "mygoals:PeakForce")), HEAVIER)
    peaks = found["peak_contact_force"].max("joint")
    assert ((0.995 * peaks <= found["objective"]) & (found["objective"] <= peaks)).all()


def test_an_objective_of_the_record_needs_no_rate(tmp_path):
    """It asks for mean forces, which are recorded for it."""
    found = evaluate(load_scene(file_with(tmp_path, "mygoals:Ratio")), HEAVIER)
    ratio = (found["peak_contact_force"] / found["mean_contact_force"]).max("joint")
    np.testing.assert_array_equal(found["objective"], ratio)
    assert found["objective"].attrs["units"] == "1"
    assert "rate_of_objective" not in found


@pytest.mark.full  # pytest tests/test_own_objectives.py -k linkage
@pytest.mark.parametrize("name", ["crank_rocker", "v_twin"])
def test_a_rate_in_a_linkage_and_by_implicit_steps(name, tmp_path):
    """The drive's work by its rate is that of the energy balance."""
    shutil.copy(GOALS, tmp_path / "mygoals.py")
    content = (
        load_scene(ROOT / "jobs" / "linkages" / f"{name}.toml").with_({"study": None}).resolved()
    )
    content["numerics"] |= {"objective": "mygoals:DrivePower", "rtol": 1e-8, "energy": True}
    content["numerics"] |= {"transient_revolutions": 0, "averaged_revolutions": 1}
    (tmp_path / "scene.toml").write_text(tomli_w.dumps(content), encoding="utf-8")
    scene = load_scene(tmp_path / "scene.toml")
    for method in ("auto", "radau"):
        found = simulate(scene.with_({"numerics.method": method}))
        work = float(found["driving_work"][-1] - found["driving_work"][0])
        assert float(found["objective"]) == pytest.approx(work / float(found["time"][-1]), rel=1e-9)


# ---- in scenes, files and studies ---------------------------------------------------------------------------
STUDY = {
    "samples": 4,
    "variables": {"m": {"path": "mechanism.rod.mass", "range": [0.2, 0.3]}},
    "random": {"m": {"distribution": "uniform", "half_width": 0.01}},
    "cases": {
        "one": {
            "random": ["m"],
            "objectives": ["mean", "deviation"],
            "constraints": [{"statistic": "quantile", "level": 0.9, "most": "0.6 kJ"}],
        }
    },
}


def test_a_study_takes_it_as_objective_and_constraint_with_its_unit(tmp_path):
    scene = load_scene(file_with(tmp_path, "mygoals:SlidingWork", study=STUDY))
    assert scene.objective.unit == "J"
    (case,) = scene.study.cases
    assert case.kept[0].most == 600.0
    assert case.kept[0].unit(scene.objective.unit) == "J"
    assert "plugins.files.mygoals.source" in run_key(scene, "run")
    with pytest.raises(InputError, match="a study names its objective itself"):
        scene.with_({"numerics.objective": "mygoals:Wave"})
    wrong = {**STUDY["cases"]["one"]["constraints"][0], "most": "3 N"}
    with pytest.raises(InputError, match="does not fit"):
        scene.with_({"study.cases.one.constraints": [wrong]})


def test_samples_on_two_ranks_have_the_same_bytes(tmp_path):
    path = file_with(tmp_path, "mygoals:SlidingWork", study=STUDY, rtol=1e-6)
    written = []
    for ranks in (0, 2):
        output = tmp_path / f"samples_{ranks}.nc"
        code, said = commands.run(["sample", str(path), "-o", str(output)], ranks)
        assert code == 0, said
        assert "sliding distance" in said
        written.append(output.read_bytes())
    assert written[0] == written[1]
    assert b"def loss(" in written[0]
    found = opened.read(output, "samples")
    np.testing.assert_array_equal(found["objective"], found["rate_of_objective"].sum("joint"))


# ---- refused where they are at fault ------------------------------------------------------------------------
HEAD = """
import math
from hpcclear import Objective
def load(normal_force): return normal_force
def largest(rate): return rate.max()
"""
FAULTS = {
    "neither": ("Bad = Objective('')", "neither a rate nor a value"),
    "another kind": ("Bad = load", "is no objective"),
    "what nobody gives": (
        "def f(normal_forc): return normal_forc\nBad = Objective('', 'N', rate=f)",
        "uses 'normal_forc', which is not known",
    ),
    "what no record has": (
        "def f(sound): return sound\nBad = Objective('', 'N', f)", "uses 'sound'",
    ),
    "a value of no rate": ("Bad = Objective('', 'N', largest)", "uses 'rate'"),
    "made of nothing": ("Bad = Objective('', 'N', rate=load, made='median')", "made is 'median'"),
    "a wrong unit": ("Bad = Objective('', 'J', rate=load)", "its unit says J"),
    "a work that is a mean": (
        "def f(normal_force, sliding_speed): return normal_force * sliding_speed\n"
        "Bad = Objective('', 'J', rate=f)",
        "its unit says J",
    ),
    "no unit": ("Bad = Objective('', 'Nn', rate=load)", "'Nn' is not known"),
    "a sum of apples and pears": (
        "def f(gap, normal_force): return gap + normal_force\nBad = Objective('', 'N', rate=f)",
        "does not fit its units",
    ),
    "a value of another unit": (
        "def f(rate): return rate.max()**2\nBad = Objective('', 'N', f, load)", "its unit says N",
    ),
    "not finite in flight": (
        "def f(normal_force, depth): return normal_force / depth\nBad = Objective('', 'N/m', rate=f)",
        "not finite",
    ),
    "a loop": (
        "def f(normal_force):\n    for _ in range(2): normal_force += normal_force\n    return normal_force\n"
        "Bad = Objective('', 'N', rate=f)",
        "more than arithmetic",
    ),
    "a value that is an array": (
        "def f(rate): return rate\nBad = Objective('', 'N', f, load)", "its value raised TypeError",
    ),
}  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS)
def test_an_objective_with_a_fault_is_refused_with_the_reason(fault, tmp_path):
    source, reason = FAULTS[fault]
    path = file_with(tmp_path, "bad:Bad", source)
    with refused("numerics.objective", reason=reason) as caught:
        load_scene(path)
    assert caught.value.value == "bad:Bad"


def test_a_rate_without_a_motion_to_be_of_is_refused(tmp_path):
    scene = load_scene(file_with(tmp_path, "mygoals:Wave")).with_(RIGID)
    with refused("numerics.objective", match="this motion is prescribed"):
        simulate(scene)
    of_joints = scene.with_({"numerics.objective": "mygoals:PeakForce"})
    assert (evaluate(of_joints, HEAVIER)["objective"] == 0.0).all()  # as forces of ours
