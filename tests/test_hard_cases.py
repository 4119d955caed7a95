"""The library of hard scenes: each ends as its file says, at every tolerance, with numbers or without, never with both.

Here over a few revolutions; `tests/run.sh --full` runs whole files and tighter tolerances.
"""

import math
import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from hard_case_runs import hard_cases, long_run
from refusals import refused
from running import BOUNDS

from hpcclear.base.errors import InputError
from hpcclear.base.outcome import Flag, Status
from hpcclear.dynamics.layout.views import Parameters, Start
from hpcclear.dynamics.setup.parameters import parameters
from hpcclear.dynamics.setup.problem import effects_of, problem_of
from hpcclear.dynamics.setup.start import start_states
from hpcclear.dynamics.stepping.lanes import Lanes
from hpcclear.scene import Scene, load_scene
from hpcclear.scene.points import Points, check_points

CASES = sorted((Path(__file__).parent / "hard_cases").glob("*.toml"))
# one open joint is a kernel of its own each, which takes long to compile
LONG_ONLY = ("ideal_crank_rod", "ideal_rod_slider")
NUMBERS = ("objective", "mean_gap", "peak_contact_force")
BAD = (math.nan, math.inf, -math.inf)


@dataclass(frozen=True)
class Expectation:
    """What a scene file says of itself."""

    refused: str | None
    status: Status | None
    flags: frozenset[Flag]


def word(member) -> str:
    return member.name.lower().replace("_", "-")


def expectation(path: Path) -> Expectation:
    """The line that starts with ``# expect:``, read strictly."""
    (line,) = re.findall(r"^# expect: (.*)$", path.read_text(), re.MULTILINE)
    if line.startswith("refused at "):
        return Expectation(line.removeprefix("refused at "), None, frozenset())
    status, _, flags = line.partition("; flags may include ")
    names = set(filter(None, flags.split(", ")))
    by_word = {word(flag): flag for flag in Flag}
    (ends,) = [s for s in Status if f"status = {word(s)}" == status]
    flags = frozenset(by_word[name] for name in names)
    return Expectation(None, ends, flags)


SIMULATED = [path for path in CASES if expectation(path).refused is None]


def check(run, rtol: float, expected: Expectation) -> None:
    """No number without a valid status, no valid status without numbers; at 1e-6 and below, the status promised."""
    valid = run.status.valid
    for number in NUMBERS:
        values = run.outcome[number]
        assert np.isfinite(values).all() if valid else np.isnan(values).all(), number
    assert math.isfinite(run.residual)
    if rtol <= 1e-6:
        assert run.status is expected.status
        assert run.flags <= expected.flags
    if rtol in BOUNDS and valid:
        assert run.residual < BOUNDS[rtol]


@pytest.mark.parametrize(
    ("path", "rtol"),
    [
        pytest.param(
            path,
            rtol,
            id=f"{path.stem}-{rtol:g}",
            marks=[] if rtol == 1e-6 else pytest.mark.nightly,
        )
        for path in SIMULATED
        for rtol in (1e-3, 1e-6, 1e-8)
        if path.stem not in LONG_ONLY
    ],
)
def test_hard_case(path: Path, rtol: float):
    scene = hard_cases.cut(load_scene(path), rtol, 4)
    fewer = {"numerics.max_steps": min(scene.numerics.max_steps, 1_000_000)}
    check(hard_cases.run(scene.with_(fewer)), rtol, expectation(path))


@pytest.mark.full
@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-8, 1e-10, 1e-13])
@pytest.mark.parametrize("path", SIMULATED, ids=lambda path: path.stem)
def test_hard_case_over_ten_revolutions(path: Path, rtol: float):
    check(hard_cases.run(hard_cases.cut(load_scene(path), rtol, 10)), rtol, expectation(path))


@pytest.mark.full
def test_ten_thousand_revolutions():
    path = Path(__file__).parent / "hard_cases" / "ten_thousand_revolutions.toml"
    scene = load_scene(path)
    run = hard_cases.run(scene.with_({"numerics.rtol": 1e-8, "numerics.max_steps": 10**8}))
    assert run.status is Status.OK
    assert run.residual < 1e-5
    early = hard_cases.run(hard_cases.cut(scene, 1e-8, 100))
    assert run.outcome["objective"] == pytest.approx(early.outcome["objective"], rel=0.01)


@pytest.mark.full
@pytest.mark.timeout(1800)
def test_nothing_drifts_in_ten_thousand_revolutions():
    result = long_run.measure(10_000)
    early = result.isel(revolution=slice(100)).max()
    late = result.isel(revolution=slice(100, None)).max()
    assert float(early.energy_residual) < 1e-7  # measured 7.9e-9
    assert (late.energy_residual <= early.energy_residual).all()
    assert 0.0 < float(late.constraint_violation) <= 2.0 * float(early.constraint_violation)


@pytest.mark.parametrize(
    "path", [p for p in CASES if p not in SIMULATED], ids=lambda path: path.stem
)
def test_refused(path: Path):
    with refused(expectation(path).refused):
        load_scene(path)


@pytest.fixture(scope="module")
def latched() -> Scene:
    """The paper's case over one revolution."""
    path = Path(__file__).parent / "hard_cases" / "centred_start.toml"
    return load_scene(path).with_(
        {
            "numerics.transient_revolutions": 0,
            "numerics.averaged_revolutions": 1,
            "numerics.max_steps": 3000,
        }
    )


@pytest.mark.parametrize("bad", BAD)
def test_every_number_that_is_not_finite_is_refused(latched: Scene, bad: float):
    for path in latched.numeric_paths():
        with pytest.raises(InputError) as caught:
            latched.with_({path: bad})
        assert caught.value.key.startswith(path.rpartition(".")[0])
        points = Points(("x",), np.array([[latched.number(path)], [bad]]), ((path,),))
        with pytest.raises(InputError, match="finite"):
            check_points(latched, points)


@pytest.mark.parametrize("bad", BAD)
def test_kernel_survives_every_number_that_is_not_finite(latched: Scene, bad: float):
    """Behind the validation: each parameter and each part of the start state in turn, one sample each."""
    problem = replace(problem_of(latched), effects=effects_of(latched, recorded=True))
    par = np.repeat(parameters(latched), Parameters.size + Start.size, axis=0)
    start = start_states(latched, par)
    for k in range(Parameters.size):
        par[k, k] = bad
    for k in range(Start.size):
        start.rows[Parameters.size + k, k] = bad
    lanes = Lanes(problem, 1, np.zeros((4096, hard_cases.rec.columns(problem.coordinates))))
    lanes.queue(par, start, np.arange(len(par)))
    for _ in hard_cases.chunks(lanes):
        pass
    outcomes = hard_cases.outcome_records(*lanes.collect(), hard_cases.record_of(latched))
    assert len(outcomes) == len(par)
    good = hard_cases.run(latched).outcome
    for outcome in outcomes:
        for name in NUMBERS:
            if Status(outcome["status"]).valid:
                assert np.isfinite(outcome[name]).all()
            else:
                assert np.isnan(outcome[name]).all()
    # what does not act on the motion may be anything; most numbers do
    unmoved = outcomes["objective"] == good["objective"]
    failed = np.isnan(outcomes["objective"])
    assert failed.sum() >= 20
    assert unmoved.any()
