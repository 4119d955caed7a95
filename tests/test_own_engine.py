"""What results say of an engine of one's own: its own numbers, its own names, the objective that was asked for."""

import sys
import tomllib
from pathlib import Path
from types import SimpleNamespace

import pytest
from own_engine import engine

from hpcclear.results import dataset
from hpcclear.scene import load_scene
from hpcclear.study import responses
from hpcclear.study.optimisation import Choice

sys.path.insert(0, str(Path(__file__).parent / "mpi_programs"))
import formula  # noqa: E402

JOBS = Path(__file__).parent.parent / "jobs"
PLAYS = ("joints.crank_rod.clearance", "joints.rod_slider.clearance")


def compared(scene, **design):
    """The scene that a design of a study of that scene is compared in."""
    run = SimpleNamespace(scene=scene, study=scene.study)
    return responses.scene_of(run, Choice("worn alpha", "worn", design), 1)


def test_responses_are_compared_at_the_plays_of_the_scene():
    assert [compared(engine(), shank=0.4).number(path) for path in PLAYS] == [30e-6, 15e-6]
    assert compared(engine(), play=4e-5).number(PLAYS[0]) == 4e-5


def test_responses_are_compared_at_the_play_the_study_names():
    scene = engine("study.verification.response_clearance=20 um")
    assert [compared(scene, play=4e-5).number(path) for path in PLAYS] == [20e-6, 20e-6]


@pytest.mark.parametrize("job", ["quickstart", "robust_slider_crank"])
def test_the_papers_jobs_name_the_play_their_responses_are_compared_at(job):
    assert load_scene(JOBS / f"{job}.toml").study.verification.response_clearance == 3e-4


def test_a_response_says_what_was_simulated(tmp_path, monkeypatch):
    """Its scene is that of its design, and simulating that scene again gives the response again."""
    formula.replace_dynamics(monkeypatch.setattr)
    from hpcclear.ranks.boundary import alone
    from hpcclear.study import run_study

    run_study(engine(), tmp_path / "out", alone(), progress_style="quiet")
    front = dataset.read(tmp_path / "out" / "verification.nc")
    for path in (tmp_path / "out" / "responses").glob("*.nc"):
        found = dataset.read(path)
        scene = load_scene(tomllib.loads(found.attrs["scene"]))
        assert scene.hash == found.attrs["scene_hash"]
        assert [scene.number(play) for play in PLAYS] == [30e-6, 15e-6]
        name = found.attrs["design"]
        design = front.sel(design="worn original" if name == "original" else name)
        assert scene.number("mechanism.rod.mass") == pytest.approx(float(design["shank"]))
