"""Random numbers of a study: each follows from its seed, a purpose ("train", "test", ...) and, for Monte Carlo, an index."""

import hashlib

import numpy as np

from hpcclear.base.arrays import Array


def generator(seed: int, *labels: str) -> np.random.Generator:
    """A stream of random numbers of its own for each purpose, from the study's seed."""
    return np.random.default_rng(_seed(seed, *labels))


def _seed(seed: int, *labels: str) -> np.random.SeedSequence:
    digests = b"".join(hashlib.sha256(label.encode()).digest() for label in labels)
    return np.random.SeedSequence(seed, spawn_key=tuple(np.frombuffer(digests, "<u4").tolist()))


def uniform(seed: int, purpose: str, name: str, first: int, count: int) -> Array:
    """Numbers `first` to `first + count` of one stream, strictly between 0 and 1, shape (count,)."""
    # Philox is counter-based: it can start anywhere. One step of its counter gives four numbers.
    bits = np.random.Philox(_seed(seed, purpose, name))
    bits.advance(first // 4)
    numbers = np.random.Generator(bits).random(first % 4 + count)[first % 4 :]
    # multiples of 2^-53 from 0 on, moved off 0, where quantiles are infinite
    return numbers + 2.0**-54


SOBOL_BITS = 30
"""Digits of a point of a Sobol sequence; a sequence has as many points as they can represent."""


def sobol(dimensions: int, rng: np.random.Generator, first: int, count: int) -> Array:
    """Points `first` to `first + count` of a scrambled Sobol sequence, strictly between 0 and 1, shape (count, dimensions)."""
    from scipy.stats import qmc  # most of a second to import; a single response needs none of it

    if dimensions == 0:
        return np.empty((count, 0))
    sequence = qmc.Sobol(dimensions, scramble=True, bits=SOBOL_BITS, rng=rng)
    if first:
        sequence.fast_forward(first)
    whole = count if first else 2 ** (count - 1).bit_length()  # SciPy warns of other beginnings
    return sequence.random(whole)[:count] + 0.5 * 2.0**-SOBOL_BITS  # as in `uniform`, off 0


def unit_lhs(samples: int, dimensions: int, rng: np.random.Generator) -> Array:
    """A Latin hypercube in the unit cube (samples, dimensions): each of `samples` equal strata of each axis holds one point.

    Source: McKay, Beckman, Conover (1979), doi:10.1080/00401706.1979.10489755.
    """
    from scipy.stats import qmc  # most of a second to import; a single response needs none of it

    return qmc.LatinHypercube(dimensions, rng=rng).random(samples)
