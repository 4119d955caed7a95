"""Surrogates and searches of a user: from a file beside the scene and from an installed package, on ranks, resumed, refused."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import opened
import pytest
from commands import MPIEXEC, contents
from formula_study import PROGRAMS, formula
from refusals import refused

from hpcclear.base.errors import InputError
from hpcclear.ranks.boundary import alone
from hpcclear.report.figures import fits
from hpcclear.scene import load_scene
from hpcclear.statistics.random.moments import RobustObjective
from hpcclear.statistics.search import asking
from hpcclear.statistics.search.asking import SearchTask, SwarmSettings
from hpcclear.statistics.surrogate.piecewise import Piecewise
from hpcclear.statistics.surrogate.regression import RegressionMethod
from hpcclear.statistics.surrogate.stored import models_in
from hpcclear.study import run_study

FOREST = """
from sklearn.ensemble import ExtraTreesRegressor
Model = ExtraTreesRegressor(n_estimators=20)
"""
RANDOM = """
class Random:
    def __init__(self, task):
        self.task = task

    def ask(self):
        low, high = self.task.bounds.T
        return low + (high - low) * self.task.rng.random((self.task.particles, len(low)))

    def tell(self, designs, objectives, constraints):
        assert len(designs) == len(objectives) == len(constraints)
"""
SMALL = """
[study.sensitivity]
groups = []
[study.surrogate]
model = "mymodels:Model"
models = []
optimisation = ["m2", "m3", "u2", "I2", "C"]
r2 = 0.5
rmae = 2.0
cuts = 0
[study.swarm]
algorithm = "mysearch:Random"
"""
SQUARE = np.array([[-1.0, 3.0], [0.0, 1e-4]])


@pytest.fixture(autouse=True)
def _dynamics(monkeypatch):
    formula.replace_dynamics(monkeypatch.setattr)


def written(folder: Path, model: str = FOREST, search: str = RANDOM) -> Path:
    """A scene file with a surrogate and a search beside it."""
    head, rest = formula.STUDY.split("[study.sensitivity]")
    swarm = rest.split("[study.swarm]")[1]
    study = head + SMALL + swarm.replace("infill_rounds = 1", "infill_rounds = 0")
    folder.mkdir(exist_ok=True)
    (folder / "mymodels.py").write_text(model)
    (folder / "mysearch.py").write_text(search)
    (folder / "scene.toml").write_text(formula.PHYSICS + study)
    return folder / "scene.toml"


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    patch = pytest.MonkeyPatch()
    formula.replace_dynamics(patch.setattr)
    place = tmp_path_factory.mktemp("own")
    run_study(load_scene(written(place)), place / "out", alone(), progress_style="quiet")
    patch.undo()
    return place


def test_quality_is_reported_and_the_file_is_read_back(results):
    found = opened.read(results / "out" / "kriging.nc", "kriging")
    assert found["surrogate"].to_numpy().tolist() == ["mymodels:Model"]
    assert "mymodels:Model" in found.attrs["title"]
    assert 0.3 < float(found["r2"][0]) < 1.0
    (model,) = models_in(found.variables).values()
    (leaf,) = model.leaves
    assert leaf.leave_one_out().tolist() == found["cross_validated"][0].to_numpy().tolist()
    apart = np.corrcoef(leaf.leave_one_out(), leaf.values)[0, 1]
    assert 0.5 < apart < 0.999  # forests of whole depth know their own points
    with pytest.raises(InputError, match="no model that predicts"):
        model.predict(leaf.inputs[:1])
    found["r2"][0] = 0.6
    assert fits.warnings("kriging", found)[0].startswith("surrogate in m2, m3")
    front = opened.read(results / "out" / "front.nc", "front")
    assert np.isfinite(front["deviation"]).any()


@pytest.mark.mpi
@pytest.mark.timeout(300)
def test_two_ranks_give_the_same_bytes(results, tmp_path):
    command = [MPIEXEC, "-n", "2", sys.executable, PROGRAMS / "formula.py"]
    subprocess.run([*command, results / "scene.toml", tmp_path / "out"], check=True, timeout=280)
    assert contents(tmp_path / "out") == contents(results / "out")


def test_an_edited_file_is_another_run(results, tmp_path):
    edited = load_scene(written(tmp_path / "edited", FOREST.replace("20", "21")))
    with pytest.raises(InputError, match="mymodels"):
        run_study(edited, results / "out", alone(), progress_style="quiet")


SEARCH = "class Random:\n    def __init__(self, task): pass\n    def ask(self): pass\n"


@pytest.mark.parametrize(
    ("kind", "source", "said"),
    [
        ("model", "class Model:\n    def fit(self, X, y): pass\n", "has no predict"),
        ("model", "class Model:\n    def predict(self, X): pass\n", "has no fit"),
        ("model", "Model = 3\n", "no class, no function and has no predict"),
        ("model", "class Model:\n    def __init__(self, size): pass\n", "not be made: TypeError"),
        ("search", SEARCH, "no tell"),
        ("search", "class Random:\n    pass\n", "could not be made of a task: TypeError"),
    ],
)
def test_what_is_none_is_refused_before_anything_is_simulated(tmp_path, kind, source, said):
    scene = load_scene(written(tmp_path / "scene", **{kind: source}))
    entry = {"model": "study.surrogate.model", "search": "study.swarm.algorithm"}[kind]
    with refused(entry, match=said):
        run_study(scene, tmp_path / "out", alone(), progress_style="quiet")
    assert not (tmp_path / "out").exists()


class Constant:
    """Predicts whatever it is told to."""

    def __init__(self, answer):
        self.answer = answer

    def fit(self, X, y):
        assert X.min() >= 0.0
        assert X.max() <= 1.0
        assert len(y) < 30 or abs(y.mean()) < 1e-12  # of all points; a fifth is left out in turn

    def predict(self, X):
        return self.answer(X)


def fitted(source):
    rng = np.random.default_rng(1)
    points = SQUARE[:, 0] + rng.random((30, 2)) * np.ptp(SQUARE, axis=1)
    values = 1e-4 * points[:, 0] + points[:, 1]
    return RegressionMethod(source, "mine").fit(points, values, SQUARE, rng=rng)


def fails(_):
    raise ZeroDivisionError("of mine")


@pytest.mark.parametrize(
    ("answer", "said"),
    [
        (lambda X: np.full(len(X), np.nan), "30 of 30 numbers that are not finite"),
        (lambda X: np.zeros((len(X), 1)), r"shape \(30, 1\), not \(30,\)"),
        (lambda X: "many", "predict returned str"),
        (fails, r"failed in predict: ZeroDivisionError: of mine \(.*test_own_models.py, line"),
    ],
)
def test_predictions_that_are_none_are_refused(answer, said):
    leaf = fitted(lambda: Constant(answer))
    with refused("study.surrogate.model", match=said):
        leaf.predict(leaf.inputs)


def test_units_are_taken_off_and_put_on_again():
    leaf = fitted(lambda: Constant(lambda X: X[:, 0]))
    mean, scale = leaf.values.mean(), leaf.values.std()
    expected = mean + scale * (leaf.inputs[:, 0] + 1.0) / 4.0
    np.testing.assert_allclose(leaf.predict(leaf.inputs), expected, rtol=1e-12)
    assert leaf.steepest() == 0
    with pytest.raises(InputError, match="does not extrapolate"):
        leaf.predict([[4.0, 0.0]])


def test_moments_are_averages_of_predictions_or_its_own():
    draws = {"x2": np.linspace(0.0, 1e-4, 64)[None]}
    linear = fitted(lambda: Constant(lambda X: X[:, 0] + X[:, 1]))
    own = fitted(lambda: Own(lambda X: X[:, 0]))
    from hpcclear.base.quantiles import Uniform
    from hpcclear.statistics.random.inputs import RandomVariable

    found = []
    for leaf in (linear, own):
        model = Piecewise((leaf,), np.ones(1, bool))
        random = [RandomVariable("x2", Uniform(5e-5, 5e-5))]
        found.append(
            RobustObjective(model, ("x1",), random, draws=lambda _: draws)(np.array([[1.0]]))[0]
        )
    mean, scale = linear.values.mean(), linear.values.std()
    unit = np.linspace(0.0, 1.0, 64)
    np.testing.assert_allclose(found[0], [mean + scale, scale * unit.std(ddof=1)], rtol=1e-9)
    np.testing.assert_allclose(found[1], [mean + 7.0 * scale, 2.0 * scale], rtol=1e-12)


class Own(Constant):
    """One with moments of its own."""

    def moments(self, X):
        assert X.shape == (1, 64, 2)
        return np.array([[7.0, 2.0]])


# -- searches ---------------------------------------------------------------------------------------


class Fixed:
    """Asks for what it is given."""

    def __init__(self, designs):
        self.designs, self.met = designs, []

    def ask(self):
        return self.designs() if callable(self.designs) else self.designs

    def tell(self, designs, objectives, constraints):
        self.met.append((designs, objectives, constraints))


def task() -> SearchTask:
    return SearchTask(SQUARE, 2, np.random.default_rng(0), 3, SwarmSettings(particles=4))


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        (np.zeros((2, 3)), r"shape \(2, 3\), not \(n, 2\)"),
        (np.array([[0.0, 1.0]]), "requested 1 in variable 2, outside"),
        (np.array([[np.nan, 0.0]]), "requested nan in variable 1"),
        (lambda: fails(0), "failed in ask: ZeroDivisionError: of mine"),
    ],
)
def test_what_is_no_design_is_refused(asked, said):
    with refused("study.swarm.algorithm", match=said):
        asking.minimise(Fixed(asked), lambda points: points, task(), 10, "mine")


@pytest.mark.nightly  # algorithms of pymoo by name are in test_foreign
def test_an_algorithm_of_pymoo_with_settings_of_ones_own_is_a_search(tmp_path):
    text = "from pymoo.algorithms.moo.nsga2 import NSGA2\nRandom = NSGA2(pop_size=10)\n"
    scene = load_scene(written(tmp_path / "scene", search=text))
    run_study(scene, tmp_path / "out", alone(), progress_style="quiet")
    front = opened.read(tmp_path / "out" / "front.nc", "front")
    assert np.isfinite(front["mean"]).sum() > 4
