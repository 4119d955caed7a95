"""Settings for an error of f, from what the accuracy command measured."""

import numpy as np
import pytest
import report_data as data
import xarray as xr

from hpcclear.report import targets
from hpcclear.scene import load_scene

SCENE = load_scene("jobs/slider_crank.toml").to_toml()


@pytest.fixture
def found():
    content = data.accuracy()
    return content.assign_attrs(scene=SCENE)


def test_the_cheapest_settings_reach_their_target_and_cheaper_ones_do_not(found):
    ways = targets.ways(found)
    for target in (0.1, 3e-2, 1e-2):
        best = targets.cheapest(found, target)
        assert best is not None
        assert best.error <= target
        assert min(way.seconds for way in ways if way.error <= target) == best.seconds
    errors = [way.error for way in targets.front(found)]
    assert errors == sorted(errors, reverse=True)


def test_a_bias_is_never_taken_for_less_than_that_of_a_tighter_tolerance(found):
    """By chance the loosest tolerance agrees with the reference; what a tighter one is off by holds for it too."""
    lucky = found.assign(tolerance_bias=("tolerance", [0.0, 0.05, np.nan, np.nan]))
    lucky["tolerance_bias_error"] = ("tolerance", [0.0, 0.0, np.nan, np.nan])
    best = targets.cheapest(lucky, 0.02)
    assert best is None or not best.words.startswith("rtol 1e-3")
    unknown = found.assign(tolerance_bias=("tolerance", np.full(4, 0.05)))
    assert targets.cheapest(unknown, 1e-2) is None
    assert "no measured setting reaches it" in targets.sentences(unknown)[0]


def test_the_scenes_own_settings_are_placed_at_the_measured_ones_below(found):
    own = targets.settings(found)
    assert own is not None
    assert "rtol 1e-6" in own.words
    price = float(found["tolerance_seconds"][3])
    assert own.seconds == pytest.approx(10 * price)
    assert own.error >= min(way.error for way in targets.ways(found) if way.seconds <= own.seconds)
    loose = targets.settings(
        found.assign_attrs(scene=SCENE.replace("rtol = 1e-06", "rtol = 1e-03"))
    )
    assert loose is not None
    assert loose.error > own.error
    assert loose.error > 0.19  # the bias of that tolerance
    for beyond in ("1e-02", "1e-12"):
        other = SCENE.replace("rtol = 1e-06", f"rtol = {beyond}")
        assert targets.settings(found.assign_attrs(scene=other)) is None, beyond
    assert targets.settings(found.assign_attrs(scene="[effects")) is None


def generated(rng) -> xr.Dataset:
    """Measured numbers of no regular order, and settings of a scene between them."""
    content = data.accuracy()
    drawn = {
        "averaging_error": 1e-5,
        "tolerance_bias": 1e-6,
        "tolerance_seconds": 1e-3,
        "turn_variance": 1e-6,
    }
    for name, least in drawn.items():
        values = least * 10.0 ** rng.uniform(0.0, 4.0, content[name].shape)
        content[name] = content[name].copy(data=values)
    rtol = 10.0 ** rng.uniform(*np.log10([content["tolerance"].min(), content["tolerance"].max()]))
    lines = {
        "rtol = 1e-06": f"rtol = {rtol!r}",
        "transient_revolutions = 5": f"transient_revolutions = {rng.integers(0, 40)}",
        "averaged_revolutions = 5": f"averaged_revolutions = {rng.integers(1, 40)}",
    }
    text = SCENE
    for line, other in lines.items():
        assert line in text, line
        text = text.replace(line, other)
    return content.assign_attrs(scene=text)


@pytest.mark.parametrize("seed", range(12))
def test_no_settings_lie_below_what_is_cheapest_and_none_are_placed_without_averaging(seed):
    """Whatever was measured: a setting as cheap with as small an error is on the line."""
    content = generated(np.random.default_rng(seed))
    own, best = targets.settings(content), targets.front(content)
    assert own is not None
    assert any(way.seconds <= own.seconds and way.error <= own.error for way in best)
    first = content.drop_vars(
        ["averaging_error", "averaging_floor", "turn_seconds", "transient", "averaged"]
    )
    assert targets.settings(first) is None
    assert len(targets.sentences(first)) == len(targets.TARGETS)
