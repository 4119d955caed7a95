"""The limits of `margins` against distributions whose answer is known."""

import margins
import numpy as np
import pytest
from scipy import stats


@pytest.mark.parametrize(("trials", "share"), [(32, 0.9), (200, 0.95), (1000, 0.5)])
def test_fewest_and_most_are_passed_wrongly_at_most_once_in_a_thousand(trials, share):
    fewest, most = margins.fewest(trials, share), margins.most(trials, share)
    assert stats.binom.cdf(fewest - 1, trials, share) <= margins.FALSE_RED
    assert stats.binom.sf(most, trials, share) <= margins.FALSE_RED
    # and no weaker than that: one further would be passed more often
    assert stats.binom.cdf(fewest, trials, share) > margins.FALSE_RED
    assert stats.binom.sf(most - 1, trials, share) > margins.FALSE_RED


def test_bootstrap_of_a_mean_is_the_normal_limit():
    values = stats.norm.ppf((np.arange(400) + 0.5) / 400)
    sd = np.std(values) / np.sqrt(len(values))
    limit = stats.norm.isf(margins.FALSE_RED) * sd
    assert margins.bootstrap(np.mean, values, side="upper") == pytest.approx(limit, rel=0.08)
    assert margins.bootstrap(np.mean, values, side="lower") == pytest.approx(-limit, rel=0.08)


def test_bootstrap_of_a_ratio_of_medians_holds_the_true_ratio():
    """10 samples of a known ratio: none of the limits passes it, and all tell it from twice the ratio."""
    rng = np.random.default_rng(1)
    for _ in range(10):
        above, below = 3.0 * rng.lognormal(0.0, 1.0, 600), rng.lognormal(0.0, 1.0, 600)
        lower = margins.bootstrap(margins.ratio_of_medians, above, below, side="lower")
        assert 1.5 < lower < 3.0
