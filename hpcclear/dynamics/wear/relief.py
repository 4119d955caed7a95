"""Where around its surfaces a joint is worn: from sliding work by the contact's angle to depths by the angle.

Work dW done at the angle x of a surface takes k/(2 pi R L) (1 + 2 sum of l_n cos n (a - x)) dW off at the angle a, n to H: the
mean around is Archard's, and all that is to be known of the work beside it are its moments, integrals of cos n x and sin n x.
With l_n = 1 the sum of so few waves would put material on elsewhere. The l_n are those of the narrowest sum that nowhere does
(P. P. Korovkin's kernel; of all of degree H that are never negative it has the largest l_1 = cos(pi/(H + 2))): a contact wears
a patch of the surface, the narrower the more waves there are.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.dynamics.wear.law import Joints

LOOKED_AT = np.linspace(0.0, 2.0 * np.pi, 180, endpoint=False)
"""Angles, rad, that depths are compared at."""


def kernel(waves: int) -> Array:
    """l_1 to l_H of the narrowest sum of H waves that is never negative, shape (waves,)."""
    a = np.sin(np.pi * np.arange(1, waves + 2) / (waves + 2))
    every = np.correlate(a, a, mode="full")[waves:]
    return every[1:] / every[0]


@dataclass(frozen=True)
class Relief:
    """How many waves around bearings and journals profiles have: 0 of surfaces that wear evenly.

    Moments and waves have shape (..., joints, size): of the bearing cosine and sine of one wave, of two and so on, then of the
    journal.
    """

    bearing: int = 0
    journal: int = 0

    @property
    def size(self) -> int:
        """Numbers of a joint."""
        return 2 * (self.bearing + self.journal)

    @cached_property
    def _weights(self) -> Array:
        return 2.0 * np.repeat(np.concatenate([kernel(self.bearing), kernel(self.journal)]), 2)

    @cached_property
    def _numbers(self) -> Array:
        """Of the wave that each number is of."""
        both = [np.arange(1, count + 1) for count in (self.bearing, self.journal)]
        return np.repeat(np.concatenate(both), 2)

    def waves(self, joints: Joints, moments: Array) -> Array:
        """Waves of worn surfaces, m, for moments in J as of `Joints.counted`."""
        slopes = [np.repeat(one[..., None], 2 * count, axis=-1) for one, count in
                  ((joints.bearing, self.bearing), (joints.journal, self.journal))]  # fmt: skip
        return np.concatenate(slopes, axis=-1) * self._weights * moments

    def around(self, waves: Array, angles: Array = LOOKED_AT) -> Array:
        """Depths beside the mean at angles, m, shape (..., joints, 2, angles): of bearing and journal."""
        turned = self._numbers[:, None] * angles
        odd = np.arange(self.size) % 2 == 1
        shapes = np.where(odd[:, None], np.sin(turned), np.cos(turned))
        half = 2 * self.bearing
        both = waves[..., :half] @ shapes[:half], waves[..., half:] @ shapes[half:]
        return np.stack(both, axis=-2)

    def deepest(self, waves: Array, angles: Array = LOOKED_AT) -> Array:
        """By how much both surfaces together are deeper than on the mean where each is deepest, m, (..., joints)."""
        if not self.size:
            return np.zeros(waves.shape[:-1])
        return self.around(waves, angles).max(axis=-1).sum(axis=-1)

    def sharpest(self, waves: Array, clearance: Array) -> float:
        """Curvature of grooves over that of the clearance circle there at most: from 1 on a journal touches their edges."""
        if not self.size:
            return 0.0
        both = self.around(waves), self.around(waves * self._numbers**2)
        # whichever places face each other
        deep, curved = (one[..., 0, :, None] + one[..., 1, None, :] for one in both)
        return float((curved / (clearance[..., None, None] + deep)).max())


FLAT = Relief()
