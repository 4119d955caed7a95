"""Single responses of variants, shared out: each row is that variant's and that copy's, by `simulate` itself."""

import numpy as np
from running import HUNT_CROSSLEY, scene_with

from hpcclear.dynamics.response import simulate
from hpcclear.ensemble.single import responses_of
from hpcclear.ranks.boundary import alone

VARIANTS = ({"mechanism.slider.mass": 0.1}, {"mechanism.slider.mass": 0.2}, {})


def told(scene, response):
    """Two numbers of a response, and one of its scene."""
    gaps = response["eccentricity_x"].values
    return np.array(
        [[np.nanmax(gaps), np.nanmean(gaps)], [scene.number("mechanism.slider.mass"), np.nan]]
    )


def test_each_row_is_of_its_variant_and_its_copy():
    scene = scene_with({"effects.contact": HUNT_CROSSLEY})
    found = responses_of(scene, VARIANTS, told, (2, 2), alone(), "some responses", copies=2)
    assert found.shape == (3, 2, 2, 2)
    for k, changes in enumerate(VARIANTS):
        for copy in range(2):
            one = scene.with_(changes)
            expected = told(one, simulate(one, one.objective, copy))
            np.testing.assert_array_equal(found[k, copy], expected)
    assert len(np.unique(found[:, :, 0, 0])) == 6  # copies are perturbed, variants differ
