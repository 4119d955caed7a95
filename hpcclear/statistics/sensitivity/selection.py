"""Ranking of the design variables and the choice of those with great influence, X_G-I.

Section 4.2 of the paper, step 4, leaves "greater impact" open. The rule here:

1. The effect of a variable is its derivative's magnitude times the length of its global interval:
   the change of f over that interval if the slope held. Effects share the unit of f, so kilograms
   compare with metres.
2. At each clearance the effects are measured against the largest one that differs significantly from 0 (by
   more than z standard errors, z being the normal quantile of the stated confidence). A variable is
   influential there if its own differs significantly from 0 and reaches the stated fraction of the largest.

3. A variable is selected if it is influential at no less than the stated share of the clearances
   that have an estimate of it. So one clearance alone neither brings a variable in nor throws it
   out.

A variable may stand in several surfaces, with different variables held fixed. Each is a column of
its own, and being selected in one is enough.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtri

from hpcclear.base.arrays import Array, Booleans

CONFIDENCE = 0.99
"""Of each comparison, which is two-sided."""
SHARE = 0.5
"""Of the clearances at which a variable that is selected is influential, at least."""


class Selection(NamedTuple):
    """Ranking and selection; m columns, each a variable in a surface."""

    effect: Array
    """Shape (c, m): magnitude of the derivative times the interval length, in the unit of f."""
    selected: tuple[str, ...]
    """X_G-I, each name once, the largest mean relative effect first."""


def select_influential(
    names: Sequence[str], effects: ArrayLike, errors: ArrayLike, *, fraction: float = 0.1
) -> Selection:
    """Rank the variables and select those with great influence (rule: module text).

    `names`: variable of each of m columns, a name may come more than once; `effects` (c, m): derivatives at each clearance
    times the lengths of the global intervals, NaN for no estimate, and their standard `errors`. `fraction`: of the largest
    effect, in (0, 1].
    """
    effect, effect_error = np.abs(np.asarray(effects, float)), np.asarray(errors, float)
    known = np.isfinite(effect) & np.isfinite(effect_error)
    effect, effect_error = np.where(known, effect, np.nan), np.where(known, effect_error, np.nan)
    margin = float(ndtri(0.5 + CONFIDENCE / 2.0)) * effect_error
    distinct = effect > margin
    largest = np.max(effect, axis=1, where=distinct, initial=0.0)[:, np.newaxis]
    threshold = np.where(largest > 0.0, fraction * largest, np.nan)  # all comparisons then fail
    reached = _mean_known(distinct & (effect >= threshold), known)
    relative = _mean_known(effect / np.where(largest > 0.0, largest, np.nan), known)
    order = [j for j in np.argsort(-relative, kind="stable") if reached[j] >= SHARE]
    return Selection(effect, tuple(dict.fromkeys(names[j] for j in order)))


def _mean_known(quantity: NDArray[np.generic], known: Booleans) -> Array:
    """Mean over the clearances with an estimate, shape (m,); NaN without any."""
    counts = np.count_nonzero(known, axis=0)
    usable = np.where(known & np.isfinite(quantity), quantity, 0.0)
    return np.asarray(usable.sum(axis=0) / np.where(counts > 0, counts, np.nan))
