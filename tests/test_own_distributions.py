"""Distributions from elsewhere: any continuous one of scipy.stats, a file's beside the scene, an installed package's."""

import json
from pathlib import Path

import numpy as np
import opened
import pytest
from commands import CHEAP, overrides, run
from scipy import stats

from hpcclear.base.errors import InputError
from hpcclear.ensemble.identity import run_key
from hpcclear.scene import load_scene
from hpcclear.scene.loading import scene_of_text
from hpcclear.scene.plugged import UntrustedSource
from hpcclear.scene.sampling import monte_carlo
from hpcclear.statistics.random import rules

QUICKSTART = Path("jobs/quickstart.toml")
TRIANGLE = '''
"""A triangle that falls from its lowest value on."""
import numpy as np


class Falling:
    def __init__(self, start, width):
        self.start, self.width = start, width

    def ppf(self, chance):
        return self.start + self.width * (1 - np.sqrt(1 - chance))

    def cdf(self, x):
        return 1 - (1 - np.clip((x - self.start) / self.width, 0, 1)) ** 2


class Downward(Falling):
    def ppf(self, chance):
        return -super().ppf(chance)


def half(chance):
    return 0.5
'''
FALLING = 'study.random.C={distribution="mylaws:Falling", start="0.4 mm", width="300 um"}'


@pytest.fixture
def scene_file(tmp_path: Path) -> Path:
    """A study's scene with a file of distributions beside it."""
    (tmp_path / "mylaws.py").write_text(TRIANGLE)
    file = tmp_path / "scene.toml"
    file.write_text(QUICKSTART.read_text())
    return file


def _law(file: Path, entry: str):
    return load_scene(file, [f"study.random.C={entry}"]).required_study.random_input("C")


@pytest.mark.parametrize(
    ("entry", "exact"),
    [
        ('{distribution="scipy:gamma", a=4, loc="0.3 mm", scale="15 um"}', stats.gamma(4, 3e-4, 1.5e-5)),
        ('{distribution="scipy:triang", c="30 %", loc=4e-4, scale=2e-4}', stats.triang(0.3, 4e-4, 2e-4)),
        ('{distribution="scipy:norm", parameters={loc="0.6 mm", scale="20 um"}}', stats.norm(6e-4, 2e-5)),
        ('{distribution="mylaws:Falling", start="0.4 mm", width="300 um"}', stats.triang(0, 4e-4, 3e-4)),
    ],
)  # fmt: skip
def test_quantiles_are_those_of_the_distribution_that_is_named(scene_file, entry, exact):
    row = _law(scene_file, entry)
    chance = np.array([1e-6, 0.05, 0.5, 0.95, 1 - 1e-6])
    np.testing.assert_allclose(row.law(chance), exact.ppf(chance), rtol=1e-12)
    assert row.absolute
    nodes, weights = rules.rule(row.law, 5)  # what moments of surrogates take
    assert weights @ nodes == pytest.approx(exact.mean(), rel=1e-6)
    assert weights @ (nodes - exact.mean()) ** 2 == pytest.approx(exact.var(), rel=1e-3)


def test_a_range_cuts_them_and_about_design_moves_them_along(scene_file):
    entry = '{distribution="mylaws:Falling", start=4e-4, width=3e-4, range=["0.5 mm", "0.6 mm"]}'
    cut, whole = _law(scene_file, entry), stats.triang(0, 4e-4, 3e-4)
    below, above = whole.cdf([5e-4, 6e-4])
    chance = np.array([0.01, 0.5, 0.99])
    np.testing.assert_allclose(cut.law(chance), whole.ppf(below + chance * (above - below)))
    moved = _law(
        scene_file, '{distribution="scipy:uniform", loc=-1e-5, scale=2e-5, about_design=true}'
    )
    assert not moved.absolute
    assert moved.span == pytest.approx((-1e-5, 1e-5), rel=1e-6)


@pytest.mark.parametrize(
    ("entry", "said"),
    [
        ('{distribution="scipy:weibul_min", c=2, loc="3 N"}', "Did you mean 'weibull_min'?"),
        ('{distribution="scipy:poisson", mu=2}', "no continuous distribution 'poisson'"),
        ('{distribution="scipy:gamma", scale=1e-5}', r"C\.a = None: the distribution 'scipy:gamma'"),
        ('{distribution="scipy:gamma", a=2, shape=3}', r"C\.shape = 3: is not a parameter of scipy's"),
        ('{distribution="scipy:gamma", a=-2}', "a = -2 has no finite, increasing quantiles"),
        ('{distribution="scipy:gamma", a="2 kg"}', "without a unit"),
        ('{distribution="scipy:norm", loc=5e-4, scale=1e-5, range=[1e-3, 2e-3]}', "less than 1e-09"),
        ('{distribution="scipy:gamma", a=4, parameters={a=4}}', r"C\.a = 4: is not a known key"),
        ('{distribution="unform", half_width="3 %"}', "Did you mean 'uniform'.*lognormal"),
        ('{distribution="mylaws:Faling", start=1, width=2}', r"mylaws\.py has no Faling.*'Falling'"),
        ('{distribution="mylaws:Falling", start=1}', "TypeError: .*missing.*'width'"),
        ('{distribution="mylaws:half"}', "has no ppf: a distribution needs ppf"),
        ('{distribution="mylaws:Downward", start=1, width=2}', "no finite, increasing quantiles"),
        ('{distribution="other:Falling"}', r"there is no other\.py beside the scene file"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said_with_the_entry(scene_file, entry, said):
    with pytest.raises(InputError, match=said) as error:
        load_scene(scene_file, [f"study.random.C={entry}"])
    assert error.value.key.startswith("study.random.C")


def test_the_file_is_part_of_the_scene_and_needed_no_more(scene_file):
    scene = load_scene(scene_file, [FALLING])
    before = run_key(scene, "sample")
    points = monte_carlo(scene, 64, first=5)
    (scene_file.parent / "mylaws.py").write_text(TRIANGLE + "# changed\n")
    after = run_key(load_scene(scene_file, [FALLING]), "sample")
    assert {k for k in before if before[k] != after[k]} == {"plugins.files.mylaws.source"}
    (scene_file.parent / "mylaws.py").unlink()
    sent = load_scene(json.loads(json.dumps(scene.resolved())), trust=True)  # as ranks get it
    np.testing.assert_array_equal(monte_carlo(sent, 64, first=5).values, points.values)
    assert scene.text.startswith("# set: study.random.C=")
    with pytest.raises(UntrustedSource):
        scene_of_text(scene.text, "samples.nc")


@pytest.mark.mpi
@pytest.mark.timeout(600)
def test_results_carry_the_source_and_reproduce_runs_it_only_when_trusted(scene_file, tmp_path):
    results = {ranks: tmp_path / f"of_{ranks}" / "samples.nc" for ranks in (0, 2)}
    sets = overrides(FALLING, "study.method=monte-carlo", "study.samples=50", *CHEAP)
    for ranks, result in results.items():
        code, told = run(["sample", str(scene_file), "-o", str(result), *sets], ranks)
        assert code == 0, told
    assert results[0].read_bytes() == results[2].read_bytes()
    clearance = opened.read(results[0])["C"].to_numpy()
    assert ((clearance > 4e-4) & (clearance < 7e-4)).all()
    (tmp_path / "mylaws.py").unlink()
    code, told = run(["reproduce", str(results[0].parent)], 0)
    assert code == 1
    assert "mylaws.py (SHA-256" in told
    assert "--trust" in told
    code, told = run(["reproduce", str(results[0].parent), "--trust"], 0)
    assert code == 0, told
    assert "16 of 50 samples: the same" in told
