"""An installed package with a plug-in of each kind: listed, and each used in a small run."""

import formula
import numpy as np
import opened
import pytest
from click.testing import CliRunner
from test_own_models import RANDOM, written
from test_plugins import install
from test_user_laws import file_with

from hpcclear import evaluate, load_scene
from hpcclear.cli import cli
from hpcclear.plugins import KINDS
from hpcclear.ranks.boundary import alone
from hpcclear.study import run_study

SOURCE = '''
"""Plug-ins of a package: one of each kind."""
import math
import numpy as np
from sklearn.linear_model import LinearRegression
from hpcclear import ContactLaw, FrictionLaw, Objective, Parameter


def force(depth, rate, stiffness, loss):
    return stiffness * depth**1.5 * (1 + loss * rate)


Elastic = ContactLaw(
    words="Hertz with a factor of the rate", force=force, parameters=(Parameter("loss", "s/m", "factor", 0.5, least=0),)
)


def ratio(speed, coefficient, ramp):
    return coefficient * math.tanh(speed / ramp)


Smooth = FrictionLaw(
    words="a smooth ramp", ratio=ratio, parameters=(
    Parameter("coefficient", "", "far from rest", 0.1, least=0), Parameter("ramp", "m/s", "its width", 0.05, above=0),
))


def power(friction_force, sliding_speed):
    return abs(friction_force * sliding_speed)


Loss = Objective(words="largest friction power of a joint", unit="W", rate=power)


class Straight:
    """A uniform density."""

    def __init__(self, start, width):
        self.start, self.width = start, width

    def ppf(self, chance):
        return self.start + self.width * chance


class Plane(LinearRegression):
    """A plane."""


''' + RANDOM.replace("Random", "Anywhere")
OFFERED = {
    "hpcclear.contact_laws": ("elastic", "Elastic"),
    "hpcclear.friction_laws": ("smooth", "Smooth"),
    "hpcclear.objectives": ("friction-loss", "Loss"),
    "hpcclear.distributions": ("straight", "Straight"),
    "hpcclear.surrogates": ("plane", "Plane"),
    "hpcclear.searches": ("anywhere", "Anywhere"),
}
FROM = {"their-shapes": {"version": "1.2"}}


@pytest.fixture
def package(tmp_path, monkeypatch):
    """The folder of an installed package that offers all."""
    folder = tmp_path / "site"
    for group, (name, target) in OFFERED.items():
        if not folder.exists():
            install(folder, group, name, f"all_kinds:{target}")
            continue
        points = folder / "their_shapes-1.2.dist-info" / "entry_points.txt"
        with points.open("a") as file:
            file.write(f"[{group}]\n{name} = all_kinds:{target}\n")
    (folder / "all_kinds.py").write_text(SOURCE)
    monkeypatch.syspath_prepend(folder)
    return folder


def test_there_is_one_of_each_kind():
    assert {kind.group for kind in KINDS} == OFFERED.keys()


def test_laws_and_objective_of_a_package_are_simulated(package, tmp_path):
    path = file_with(
        tmp_path, {"law": "elastic"}, {"law": "smooth"}, objective="friction-loss", rtol=1e-6
    )
    scene = load_scene(path)
    found = evaluate(scene, {"C": [3e-4, 3.1e-4]})
    assert scene.resolved()["plugins"]["packages"] == FROM
    assert (found["status"] == 0).all()
    assert (found["objective"] > 0).all()
    np.testing.assert_array_equal(found["objective"], found["rate_of_objective"].max("joint"))
    assert found["objective"].attrs["units"] == "W"


def test_distribution_surrogate_and_search_of_a_package_make_a_study(
    package, tmp_path, monkeypatch
):
    formula.replace_dynamics(monkeypatch.setattr)
    path = written(tmp_path / "scene")
    uniform = '[study.random]\nC = { distribution = "uniform", range = ["0.3 mm", "1 mm"] }'
    straight = (
        '[study.random]\nC = { distribution = "straight", start = "0.3 mm", width = "0.7 mm" }'
    )
    text = path.read_text()
    assert uniform in text
    path.write_text(text.replace(uniform, straight))
    scene = load_scene(path, ["study.surrogate.model=plane", "study.swarm.algorithm=anywhere"])
    run_study(scene, tmp_path / "out", alone(), progress_style="quiet")
    found = opened.read(tmp_path / "out" / "kriging.nc", "kriging")
    assert found["surrogate"].to_numpy().tolist() == ["plane"]
    front = opened.read(tmp_path / "out" / "front.nc", "front")
    assert np.isfinite(front["mean"]).sum() > 2
    assert load_scene(path).resolved()["plugins"]["packages"] == FROM


def test_all_of_them_are_listed_with_their_package(package):
    done = CliRunner().invoke(cli, ["show", "laws", "--details"])
    assert done.exit_code == 0, done.output
    for name, _ in OFFERED.values():
        assert name in done.output
    assert done.output.count("their-shapes 1.2") == 6
