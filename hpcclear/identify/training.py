"""The ensemble over the prior: machines as they may be, each simulated once, with the spectra of all signals."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.ensemble.single import responses_of
from hpcclear.identify.inputs import Inputs
from hpcclear.identify.signals import INSTANTS, ORDERS, PARTS, Spectrum, spectra
from hpcclear.ranks.team import Ranks
from hpcclear.ranks.terminal import Style, announce
from hpcclear.results.checkpoint import Checkpoint
from hpcclear.scene import Scene
from hpcclear.scene.planar import turns_of
from hpcclear.scene.streams import generator, sobol

CHUNK = 64
"""Members that are simulated together, and reported."""

LEAST_REVOLUTIONS = 10
"""Revolutions that a member is averaged over at least: chaos takes some to be seen."""

LARGEST_FAILURE = 0.1
"""Share of members that may fail."""


@dataclass(frozen=True)
class Ensemble:
    """Members that were simulated, without those that `failed`.

    `places` (n, size + 2): in the unit cube; the last two columns are those of the sensor's own errors. `names`: of the
    signals; `spectra` (n, signals, PARTS, orders).
    """

    inputs: Inputs
    places: Array
    names: tuple[str, ...]
    spectra: Array
    revolutions: int
    failed: int = 0

    def spectrum(self, name: str) -> Spectrum:
        """Return the spectra (n, orders) of a signal."""
        return Spectrum.unpacked(self.spectra[:, self.names.index(name)], self.revolutions)


def prepared_scene(scene: Scene) -> Scene:
    """Return the scene as its members are simulated: without a study, with enough instants and revolutions."""
    averaged = max(scene.numerics.averaged_revolutions, LEAST_REVOLUTIONS)
    return scene.with_({
        "study": None, "numerics.target_error": None, "numerics.averaged_revolutions": averaged,
        "output.instants_per_revolution": INSTANTS * turns_of(scene.linkage),
    })  # fmt: skip


def ensemble_of(
    scene: Scene, inputs: Inputs, names: Sequence[str], members: int, seed: int, ranks: Ranks,
    checkpoint: Checkpoint | None = None, style: Style = "quiet",
) -> Ensemble:  # fmt: skip
    """Simulate so many members of an ensemble, a power of two, on all ranks; on root. The checkpoint keeps finished ones.

    Raises InputError: more than `LARGEST_FAILURE` of the members fail. Raises Stopped, RankFailed, StorageError.
    """
    places = sobol(inputs.size + 2, generator(seed, "identify"), 0, members)
    variants = inputs.variants(places)
    shape = (len(names), PARTS, ORDERS + 1)
    parts = []
    for first in range(0, members, CHUNK):
        rows, reduced = variants[first : first + CHUNK], partial(spectra, names=tuple(names))
        found = responses_of(
            scene, rows, reduced, shape, ranks, "ensemble",
            checkpoint=checkpoint, kept=f"members-{first:06d}",
        )  # fmt: skip
        parts.append(found[:, 0])
        announce(f"ensemble: {first + len(parts[-1])} of {members} members", style)
    whole = np.concatenate(parts)
    good = np.isfinite(whole[:, :, 0]).all(axis=(1, 2))
    if good.mean() < 1.0 - LARGEST_FAILURE:
        reason = f"{int((~good).sum())} of {members} simulations over the bounds failed"
        raise InputError("--unknown", members, reason, "Narrow the bounds, or run hpcclear check")
    count = scene.numerics.averaged_revolutions
    return Ensemble(inputs, places[good], tuple(names), whole[good], count, int((~good).sum()))
