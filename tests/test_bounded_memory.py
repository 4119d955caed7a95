"""The memory of a response goes with the instants of its output, not with its steps."""

import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from running import HUNT_CROSSLEY, scene_with

from hpcclear.base.errors import InputError
from hpcclear.base.outcome import Status
from hpcclear.dynamics import response
from hpcclear.dynamics.evaluation.recorded import steps as recorded
from hpcclear.dynamics.evaluation.recorded.steps import StepInstants, Steps
from hpcclear.dynamics.response import simulate
from hpcclear.dynamics.stepping import record as rec
from hpcclear.scene import load_scene

LIGHT = Path(__file__).parent / "data" / "light_coupler.toml"
SMOOTH = {"effects.contact": HUNT_CROSSLEY, "numerics.method": "tsitouras"}


def peak_of(scene) -> int:
    """Bytes that a response takes at most, its compilation left out."""
    tracemalloc.start()
    try:
        simulate(scene)
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def test_ten_times_the_steps_take_no_more_memory():
    few = {"output.instants_per_revolution": 10}
    scenes = [scene_with(SMOOTH | few, revolutions, 1e-6) for revolutions in (30, 300)]
    simulate(scenes[0])
    short, long = map(peak_of, scenes)
    assert long < 1.5 * short


def test_a_light_body_ends_with_a_status_within_bounded_memory():
    """Its coupler of 0.3 mg takes steps of 7 ns: what was kept of 40 000 of them was 50 MB, of all that are allowed 23 GB."""
    steps = [load_scene(LIGHT, [f"numerics.max_steps={count}"]) for count in (4000, 40_000)]
    found = simulate(steps[0])
    assert int(found["status"]) == Status.STEP_CAP
    assert np.isnan(float(found["objective"]))
    assert found.sizes["time"] == 721
    assert (np.diff(found["time"]) > 0.0).all()
    short, long = map(peak_of, steps)
    assert long < 1.5 * short + recorded.LEAST_KEPT * 8 * rec.columns(12)


def steps_of_a_wave(lengths: np.ndarray, chunk: int):
    """Rows of the record of q = sin t over steps of these lengths, one unfinished revolution, in chunks."""
    time = np.concatenate([[0.0], np.cumsum(lengths)])
    rows = np.zeros((len(time), rec.columns(1)))
    rows[:, rec.TIME] = rows[:, rec.TURN_TIME] = time
    rows[:, rec.STATE] = np.sin(time)
    rows[:, rec.STATE + 1] = np.cos(time)
    rows[:, rec.STATE + 2] = -np.sin(time)
    yield rows[:1]
    yield from (rows[k : k + chunk] for k in range(1, len(rows), chunk))


@pytest.mark.parametrize("kind", ["even", "rattling"])
def test_dropped_steps_change_no_instant_s_state(monkeypatch, kind: str):
    """Of a revolution with 200 times the steps that are held: every instant still lies in a step that was taken."""
    monkeypatch.setattr(recorded, "LEAST_KEPT", 1000)
    lengths = np.full(200_000, 1e-4)
    if kind == "rattling":  # 50 stretches of tiny steps between long ones
        lengths = np.tile(np.concatenate([np.full(3990, 1e-6), np.full(10, 0.04)]), 50)
    (piece,) = pieces(steps_of_a_wave(lengths, 500), 100)
    steps: Steps = piece.steps
    assert len(steps.time) <= 1500
    assert len(piece.times) == 101
    even = np.linspace(0.0, lengths.sum(), 101)
    assert (np.diff(piece.times) > 0.0).all()
    assert np.abs(piece.times - even).max() < 0.5 * even[1]  # some eight rows are held for each
    q, v, _, s = recorded._state(piece, 0.0)
    assert ((s >= 0.0) & (s <= 1.0)).all()
    np.testing.assert_allclose(q[:, 0], np.sin(piece.times), atol=1e-9)
    np.testing.assert_allclose(v[:, 0], np.cos(piece.times), atol=1e-8)


@pytest.mark.parametrize("count", [0, 1000])
def test_time_series_that_do_not_fit_are_refused(monkeypatch, count: int):
    monkeypatch.setattr(response, "MOST", 1e-9)
    scene = scene_with(SMOOTH | {"output.instants_per_revolution": count}, 10**6, 1e-6)
    with pytest.raises(InputError, match="fewer instants per revolution"):
        simulate(scene)


def pieces(chunks, count):
    """All pieces of the steps of a sample."""
    made = StepInstants(count)
    return [*(piece for chunk in chunks for piece in made.take(chunk)), made.finish()]


def test_pieces_are_the_whole():
    """Chunks of any size distribute the same instants over the same steps."""
    scene = scene_with(SMOOTH, 3, 1e-6)
    recording = recorded.Recording(scene)
    rows = np.concatenate(list(recording.chunks()))

    def instants(size: int, count: int) -> np.ndarray:
        parts = (rows[k : k + size] for k in range(1, len(rows), size))
        found = pieces((rows[:1], *parts), count)
        return np.concatenate([np.column_stack([p.times, p.steps.time[p.k]]) for p in found])

    for count in (0, 720):
        whole = instants(len(rows), count)
        assert len(whole) == (3 * count + 1 if count else len(rows))
        for size in (1, 7, 1000):
            np.testing.assert_array_equal(instants(size, count), whole)
