"""Random scenes far outside of what anybody builds: a valid outcome or a clear refusal, each time."""

import math

import numpy as np
import pytest
from hard_case_runs import hard_cases
from hypothesis import HealthCheck, event, given, settings, strategies as st

from hpcclear.base.errors import InputError
from hpcclear.scene import Scene, load_scene

CI = settings(
    max_examples=200,
    deadline=None,
    derandomize=True,
    suppress_health_check=list(HealthCheck),
    database=None,
)
NIGHTLY = settings(max_examples=2000, deadline=None, suppress_health_check=list(HealthCheck))
LAWS = ("flores", "gonthier", "herbert-mcwhannell", "hu-guo", "lankarani-nikravesh", "lee-wang")


def uniform(low: float, high: float) -> st.SearchStrategy[float]:
    """Numbers on a grid about the middle: hypothesis likes floats such as 1e-200, which a scene refuses at once."""
    half = 500_000
    return st.integers(-half, half).map(lambda k: 0.5 * (low + high + (high - low) * k / half))


def log_uniform(low: float, high: float) -> st.SearchStrategy[float]:
    """Sizes over many decades."""
    return uniform(math.log10(low), math.log10(high)).map(lambda x: 10.0**x)


materials = st.fixed_dictionaries(
    {"youngs_modulus": log_uniform(1e6, 1e12), "poisson_ratio": uniform(-0.9, 0.5)}
)
shares = uniform(0.0, 1.0)


@st.composite
def clearance_joints(draw) -> dict:
    """A joint with play; now and then the journal starts on its contact circle or beyond."""
    radius = draw(log_uniform(1e-3, 1e-1))
    clearance = radius * draw(log_uniform(1e-6, 0.9))
    angle, share = draw(uniform(0.0, 6.3)), draw(st.sampled_from([0.0, 0.3, 1.0, 1.2]))
    return {
        "kind": "clearance",
        "clearance": clearance,
        "bearing_radius": radius,
        "bearing": draw(materials),
        "journal": draw(materials),
        "start_eccentricity": [
            share * clearance * math.cos(angle),
            share * clearance * math.sin(angle),
        ],
    }


@st.composite
def mechanisms(draw) -> dict:
    """Links of any proportion; now and then the rod is shorter than the crank."""
    crank = draw(log_uniform(1e-3, 1.0))
    rod = crank * draw(log_uniform(1.0001, 20.0) | log_uniform(0.99, 1.01))
    mass = draw(log_uniform(1e-3, 1e2))
    return {
        "kind": "slider-crank",
        "crank": {
            "length": crank,
            "mass": draw(log_uniform(1e-3, 1e2)),
            "inertia": draw(log_uniform(1e-8, 1.0)),
            "mass_center": crank * draw(uniform(-0.5, 1.5)),
        },
        "rod": {
            "length": rod,
            "mass": mass,
            "inertia": mass * rod**2 / 12.0 * draw(log_uniform(1e-3, 1e3)),
            "mass_center": rod * draw(uniform(-0.5, 1.5)),
        },
        "slider": {"mass": draw(log_uniform(1e-3, 1e2))},
    }


latched_laws = st.fixed_dictionaries(
    {
        "law": st.sampled_from(LAWS),
        "restitution": shares,
        "minimum_impact_speed": log_uniform(1e-9, 1e-1),
    }
)
fixed_laws = st.fixed_dictionaries(
    {"law": st.just("hunt-crossley"), "damping": log_uniform(1e-3, 1e4)}
)
coulomb = st.fixed_dictionaries(
    {"law": st.just("coulomb"), "coefficient": shares, "ramp_speed": log_uniform(1e-6, 1.0)}
)
speeds = st.fixed_dictionaries({"kind": st.just("constant-speed"), "speed": log_uniform(1e-1, 1e4)})
numerics = st.fixed_dictionaries(
    {
        "rtol": log_uniform(1e-12, 1e-2),
        "transient_revolutions": st.integers(0, 1),
        "averaged_revolutions": st.integers(1, 2),
        "max_steps": st.just(100_000),
    }
)
torques = st.fixed_dictionaries(
    {
        "kind": st.just("torque"),
        "torque": uniform(-10.0, 100.0),
        "flywheel_inertia": log_uniform(1e-6, 10.0),
        "initial_speed": log_uniform(1e-1, 1e3),
    }
)
ambrosio = st.fixed_dictionaries(
    {"law": st.just("ambrosio"), "coefficient": shares, "speeds": st.just([1e-3, 1e-2])}
)
guides = st.fixed_dictionaries({"coefficient": uniform(0.0, 0.5)})
LOAD_TABLE = [[0.0, 0.0], [1.5, 900.0], [3.0, -400.0], [5.0, 100.0]]
HERTZ = st.just({"law": "hertz"})
NONE = st.just({"law": "none"})
IDEAL = st.just({"kind": "ideal"})
PLAY = clearance_joints()
GRAVITY = st.just(9.81)

# Each combination of effects is a kernel of its own, which takes its time to compile: so not every effect turns up
# beside every other.
KINDS = (
    (PLAY, PLAY, speeds, {"contact": HERTZ, "friction": NONE}),
    (PLAY, PLAY, speeds, {"contact": latched_laws, "friction": ambrosio, "gravity": GRAVITY}),
    (PLAY, PLAY, torques, {"contact": latched_laws, "friction": coulomb, "guide_friction": guides}),
    (
        PLAY,
        PLAY,
        torques,
        {"contact": fixed_laws, "gravity": GRAVITY, "slider_load": st.just(LOAD_TABLE)},
    ),
    (PLAY, IDEAL, speeds, {"contact": latched_laws, "friction": coulomb, "guide_friction": guides}),
    (
        PLAY,
        IDEAL,
        torques,
        {"contact": fixed_laws, "friction": coulomb, "slider_load": uniform(-1e4, 1e4)},
    ),
    (
        IDEAL,
        PLAY,
        speeds,
        {"contact": fixed_laws, "friction": ambrosio, "slider_load": uniform(-1e4, 1e4)},
    ),
    (IDEAL, PLAY, torques, {"contact": latched_laws, "friction": coulomb, "gravity": GRAVITY}),
    (IDEAL, IDEAL, speeds, {"gravity": GRAVITY, "guide_friction": guides}),
    (IDEAL, IDEAL, torques, {"slider_load": st.just(LOAD_TABLE), "guide_friction": guides}),
)


def scenes_of_kind(first, second, drive, effects) -> st.SearchStrategy[dict]:
    """Scenes with these joints, drive and effects."""
    return st.fixed_dictionaries(
        {
            "mechanism": mechanisms(),
            "drive": drive,
            "joints": st.fixed_dictionaries({"crank_rod": first, "rod_slider": second}),
            "effects": st.fixed_dictionaries(effects),
            "numerics": numerics,
        }
    )


plain_scenes = scenes_of_kind(
    PLAY, PLAY, speeds, {"contact": latched_laws | fixed_laws, "friction": coulomb}
)
all_scenes = st.one_of(plain_scenes, *(scenes_of_kind(*kind) for kind in KINDS))


def valid_outcome_or_clear_refusal(content: dict) -> None:
    """What every scene must come to."""
    try:
        scene = load_scene(content)
    except InputError as error:
        refusal = error
    else:
        check_outcome(scene)
        return
    event("refused")
    assert refusal.key
    assert refusal.reason
    assert refusal.remedy


def check_outcome(scene: Scene) -> None:
    """Numbers if and only if the run came to its end."""
    run = hard_cases.run(scene)
    event(run.status.name)
    for name in ("objective", "mean_gap", "peak_contact_force"):
        values = run.outcome[name]
        if run.status.valid:
            assert np.isfinite(values).all()
            assert (values >= 0.0).all()
        else:
            assert np.isnan(values).all()
    spread = run.outcome["objective_spread"]
    several = scene.numerics.averaged_revolutions > 1
    assert np.isfinite(spread) if run.status.valid and several else np.isnan(spread)
    assert run.outcome["rhs_evaluations"] < 2 * 20 * 100_000


@pytest.mark.nightly
@CI
@given(plain_scenes)
def test_random_scene(content: dict):
    valid_outcome_or_clear_refusal(content)


@pytest.mark.full
@pytest.mark.timeout(3600)
@NIGHTLY
@given(all_scenes)
def test_random_scene_of_any_kind(content: dict):
    """All kinds of joints, drives and effects; each kernel is compiled when it first turns up."""
    valid_outcome_or_clear_refusal(content)
