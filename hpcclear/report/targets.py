"""Total error of f of one design against run time: measured settings, the cheapest for a target, and the scene's own."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.report.html.content import scene_of
from hpcclear.results.content import Results

TARGETS = (1e-2, 1e-3, 1e-4)
"""Relative errors of f that are put in words."""

MARGIN = 100.0
"""The reference must be this many times better than what is measured against it; smaller errors are not resolved."""

REPLICAS = 32
"""Of a mean over replicas; each has a transient of its own."""

DOUBLINGS = 21
"""Of the 10 revolutions of the shortest mean over replicas: up to ten millions."""


class Way(NamedTuple):
    """Settings, what they cost and what they reach."""

    seconds: float
    """Core time of one design."""
    error: float
    """Relative error of f: the bias of the tolerance and the error of averaging, squares added."""
    words: str
    """The settings."""


def ways(found: Results) -> list[Way]:
    """Return every measured pair of tolerance and revolutions whose bias is known well enough (kind ``accuracy``, with its
    panel of tolerance and revolutions at least), the cheapest first.

    Means over `REPLICAS` replicas, by their formula; single runs too, where the panel of averaging is there.
    """
    bias = _largest_bias(found)
    made = [way for k in range(len(bias)) for way in _ways_of(found, k, float(bias[k]))]
    return sorted(way for way in made if np.isfinite(way[:2]).all() and way.error > 0.0)


def front(found: Results) -> list[Way]:
    """Return the ways than which none that is cheaper has a smaller error."""
    kept: list[Way] = []
    for way in ways(found):
        if not kept or way.error < kept[-1].error:
            kept.append(way)
    return kept


def cheapest(found: Results, target: float) -> Way | None:
    """Return the cheapest way to a relative error; None if none that was measured reaches it."""
    return next((way for way in front(found) if way.error <= target), None)


def sentences(found: Results) -> list[str]:
    """Return a sentence for each of `TARGETS`, and one for the scene's own settings."""
    words = []
    for target in TARGETS:
        text = "no measured setting reaches it. Try numerics.target_error."
        if way := cheapest(found, target):
            text = f"{way.words}; {seconds(way.seconds)} of one core per design."
        words.append(f"For an error of f of {target * 100:g} %: {text}")
    if own := settings(found):
        text = f"error of at most {own.error * 100:.2g} %, {seconds(own.seconds)} of one core per design."
        words.append(f"Your settings ({own.words}): {text}")
    return words


def caption(found: Results) -> str:
    """Return what the line and the marks of the figure of total errors are, of the panels that are there."""
    if "averaging_error" not in found:
        return (
            f"Line: the cheapest means over {REPLICAS} replicas. Error: bias of the integration tolerance and standard error "
            "of the mean, squares added. Single runs and your settings follow when averaging is measured. Black marks: the "
            "cheapest for an error."
        )
    return (
        f"Line: the cheapest of the measured settings, single runs and means over {REPLICAS} replicas. Error: bias of the "
        "integration tolerance and error of averaging with its transient, squares added; of your settings that of the "
        "measured ones just below. Black marks: the cheapest for an error."
    )


def seconds(value: float) -> str:
    """Return a time in words."""
    return f"{value:.2g} s" if value >= 0.1 else f"{1e3 * value:.2g} ms"


def settings(found: Results) -> Way | None:
    """Return what the scene's own settings cost and reach.

    The error of a single run is that of the next looser tolerance, shorter transient and shorter average that were measured: no
    more is known, and so it is not below the cheapest of these. None if the file does not have the settings as numbers, the
    panel of averaging is not there, or their tolerance is not between those that were measured.
    """
    scene = scene_of(found)
    if scene is None:
        return None
    numerics, tolerance = scene.numerics, found["tolerance"].values
    if numerics.target_error is not None:
        way = cheapest(found, numerics.target_error)
        return way and way._replace(words=f"target_error {_short(numerics.target_error)}")
    waited, averaged = numerics.transient_revolutions, numerics.averaged_revolutions
    near = 1.0 + 1e-9  # as it was written and as it was measured
    looser = np.flatnonzero(tolerance * near >= numerics.rtol)
    if "averaging_error" not in found or not len(looser) or numerics.rtol * near < tolerance.min():
        return None
    order = np.argsort(tolerance)
    known = np.log(tolerance[order]), found["tolerance_seconds"].values[order]
    price = np.interp(np.log(numerics.rtol), *known)
    bias = _largest_bias(found)[looser[np.argmin(tolerance[looser])]]
    row = int((found["transient"].values <= waited).sum()) - 1
    column = int((found["averaged"].values <= averaged).sum()) - 1
    words = f"rtol {_short(numerics.rtol)}, {waited} transient and {averaged} averaged revolutions"
    error = float(np.hypot(bias, _averaging(found)[row, column]))
    return Way(float(price) * (waited + averaged), error, words)


def _averaging(found: Results) -> Array:
    """Errors of averages by transient and revolutions: at least those of every longer run, as less would be luck."""
    error = found["averaging_error"].values[::-1, ::-1]
    return np.asarray(np.maximum.accumulate(np.maximum.accumulate(error, 0), 1)[::-1, ::-1])


def _largest_bias(found: Results) -> Array:
    """Largest bias of each tolerance by two standard errors; a value below that of a tighter one would be luck."""
    bias = np.abs(found["tolerance_bias"].values) + 2.0 * found["tolerance_bias_error"].values
    known = np.where(np.isfinite(bias), bias, np.nanmin(bias) if np.isfinite(bias).any() else 0.0)
    order = np.argsort(found["tolerance"].values)
    largest = np.empty_like(known)
    largest[order] = np.maximum.accumulate(known[order])
    return largest


def _ways_of(found: Results, k: int, bias: float) -> Iterator[Way]:
    """Ways at one tolerance: means over replicas, and single runs."""
    rtol, price = _short(float(found["tolerance"][k])), float(found["tolerance_seconds"][k])
    wait, variance = REPLICAS * float(found["spin_up"]), float(found["turn_variance"][k])
    for count in (10 * 2 ** np.arange(DOUBLINGS)).tolist():
        words = f"rtol {rtol} and {count} averaged revolutions over {REPLICAS} replicas"
        yield Way(price * (count + wait), float(np.hypot(bias, np.sqrt(variance / count))), words)
    if "averaging_error" not in found:
        return
    transients, averages = (found[name].values.tolist() for name in ("transient", "averaged"))
    for (row, column), one in np.ndenumerate(_averaging(found)):
        transient, averaged = transients[row], averages[column]
        words = f"rtol {rtol}, {transient} transient and {averaged} averaged revolutions"
        yield Way(price * (transient + averaged), float(np.hypot(bias, one)), words)


def _short(value: float) -> str:
    return f"{value:.0e}".replace("e-0", "e-")
