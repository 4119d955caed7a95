"""Laws on arrays: their numbers for each sample, and what is worked out from them outside the lanes.

A law's functions are plain Python, written for numbers. On arrays they run with the functions of `math` replaced by NumPy's;
where that does not do (an ``if``), number by number.
"""

import math
from collections.abc import Mapping
from types import FunctionType, ModuleType, SimpleNamespace
from typing import Any

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.laws.declared import LAW_NUMBERS, ContactLaw, FrictionLaw, Function, Law
from hpcclear.laws.translate import LawError

_ARRAYS = {
    "sqrt": np.sqrt, "exp": np.exp, "log": np.log, "tanh": np.tanh, "atan": np.arctan, "fabs": np.abs,
    "copysign": np.copysign, "pow": np.power, "pi": math.pi,
}  # fmt: skip
_BUILT_IN = {"min": np.minimum, "max": np.maximum}

NODES, WEIGHTS = np.polynomial.legendre.leggauss(24)


def with_words(
    function: Function, words: Mapping[str, object], own: Mapping[str, object]
) -> Function:
    """The same function, and those of its module that it calls, with other functions for those of `math` and of Python."""
    if not isinstance(function, FunctionType):
        return function
    made: dict[str, object] = {}
    names = dict(function.__globals__)
    code = function.__code__
    for name in code.co_names:
        value = names.get(name)
        known = value is None or getattr(value, "__module__", "") in ("math", "numpy")
        if isinstance(value, ModuleType) and value.__name__ in ("math", "numpy"):
            made[name] = SimpleNamespace(**{**vars(value), **words})
        elif name in words and known:
            made[name] = words[name]
        elif isinstance(value, FunctionType) and value is not function:
            made[name] = with_words(value, words, own)
    around, defaults = {**names, **own, **made}, function.__defaults__
    result = FunctionType(code, around, function.__name__, defaults, function.__closure__)
    result.__kwdefaults__ = function.__kwdefaults__
    return result


def evaluate(function: Function, given: Mapping[str, object]) -> Any:
    """A function of arrays that broadcast, of any shape: an array, or a dict of such."""
    names = function.__code__.co_varnames[: function.__code__.co_argcount]
    values = [given[name] for name in names]
    with np.errstate(all="ignore"):
        try:
            found = with_words(function, _ARRAYS, _BUILT_IN)(*values)
            return _one_by_one(function, values) if _is_complex(found) else found
        except (TypeError, ValueError, ZeroDivisionError, OverflowError):
            return _one_by_one(function, values)


def _one_by_one(function: Function, values: list[Any]) -> Any:
    shape = np.broadcast_shapes(*(np.shape(one) for one in values))
    flat = [np.broadcast_to(np.asarray(one, float), shape).ravel() for one in values]
    rows = [_safely(function, list(row)) for row in zip(*flat, strict=True)]
    if rows and isinstance(rows[0], Mapping):
        return {name: np.array([row[name] for row in rows]).reshape(shape) for name in rows[0]}
    return np.array(rows, float).reshape(shape)


def _safely(function: Function, row: list[float]) -> Any:
    """A value; infinite or NaN where Python's own arithmetic gives no real one."""
    numbers = [np.float64(one) for one in row]
    try:
        found = function(*numbers)
    except _UNREAL:  # of Python's own floats
        found = None
    if found is None or _is_complex(found):
        try:
            found = with_words(_with_numpy(function), _ARRAYS, _BUILT_IN)(*numbers)
        except _UNREAL:
            return math.nan
    return found


_UNREAL = (ZeroDivisionError, OverflowError, ValueError, TypeError)


def _with_numpy(function: Function) -> Function:
    """The same function with NumPy's floats for its constants: dividing by 0 gives infinity, a root of -1 NaN."""
    if not isinstance(function, FunctionType):
        return function
    code = function.__code__
    constants = tuple(np.float64(one) if type(one) is float else one for one in code.co_consts)
    changed = code.replace(co_consts=constants)
    around = function.__globals__
    return FunctionType(changed, around, function.__name__, None, function.__closure__)


def _is_complex(found: object) -> bool:
    parts = found.values() if isinstance(found, Mapping) else (found,)
    return any(map(np.iscomplexobj, parts))


def sample_numbers(law: Law, given: Mapping[str, object]) -> dict[str, Any]:
    """All numbers of samples, (m,) each: the joint's, the parameters, and what the law works out once."""
    found = dict(given)
    for one in law.worked_out():
        made = evaluate(one, found)
        if not isinstance(made, Mapping):
            raise LawError("once gives no numbers", "Correct once, or the parameters")
        found |= made
    return found


def force_of(law: ContactLaw, given: Mapping[str, object]) -> Array:
    """Normal force before the cut, N; arrays that broadcast, of any shape."""
    if law.factor is None:
        return evaluate(law.force, given)
    assert law.elastic is not None
    return evaluate(law.elastic, given) * evaluate(law.factor, given)


def rows_of(law: Law, found: Mapping[str, Any], size: int) -> Array:
    """Those of `sample_numbers` that its functions read in lanes, (m, at most `LAW_NUMBERS`), in the order of ``law.read``."""
    assert len(law.read) <= LAW_NUMBERS
    columns = [np.broadcast_to(np.asarray(found[name], float), size) for name in law.read]
    return np.stack(columns, axis=-1) if columns else np.empty((size, 0))


def read_from(law: Law, rows: Array) -> dict[str, Array]:
    """The numbers of `rows_of` by name; rows of shape (..., LAW_NUMBERS)."""
    return {name: rows[..., k] for k, name in enumerate(law.read)}


def elastic_at(law: ContactLaw, depth: Array, numbers: Mapping[str, object]) -> Array:
    """Elastic part of the force at a depth, N; arrays that broadcast, of any shape."""
    at_rest = {**numbers, "depth": depth, "rate": 0.0 * depth}
    if law.elastic is not None:
        return evaluate(law.elastic, at_rest)
    one = np.ones_like(np.asarray(depth, float))
    return force_of(law, {**at_rest, "impact_speed": one, "inverse_impact_speed": one})


def stored(law: ContactLaw, depth: Array, numbers: Mapping[str, object]) -> Array:
    """Energy stored at a depth >= 0, J, of its shape: declared, or the integral of the elastic part."""
    if law.energy is not None:
        return evaluate(law.energy, {**numbers, "depth": depth})
    total = 0.0 * depth
    for node, weight in zip(NODES, WEIGHTS, strict=True):
        # depths as squares, so that a root at 0 does no harm
        share = (0.5 * (1.0 + node)) ** 2
        total = total + weight * math.sqrt(share) * depth * elastic_at(law, share * depth, numbers)
    return total


def swing(law: ContactLaw, force: Array, numbers: Mapping[str, object]) -> Array:
    """Stiffness dF/dd where the elastic part is `force` (m,), N/m."""
    if law.swing is not None:
        return evaluate(law.swing, {**numbers, "force": force})
    return _slope(law, depth_at(law, force, numbers), numbers)


def _slope(law: ContactLaw, depth: Array, numbers: Mapping[str, object]) -> Array:
    step = 1e-5 * depth
    low, high = (elastic_at(law, depth + sign * step, numbers) for sign in (-1, 1))
    return (high - low) / (2.0 * step)


def depth_at(law: ContactLaw, force: Array, numbers: Mapping[str, object]) -> Array:
    """Depth at which the elastic part is `force`, shape (m,), by halving on a scale of logarithms; at most 1 m."""
    low, high = np.full(np.shape(force), -30.0), np.zeros(np.shape(force))
    for _ in range(60):
        middle = 0.5 * (low + high)
        beyond = ~(elastic_at(law, 10.0**middle, numbers) < force)
        low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
    return 10.0 ** (0.5 * (low + high))


def shape_near(law: ContactLaw, force: Array, numbers: Mapping[str, object]) -> tuple[Array, Array]:
    """Exponent of the depth and factor of the rate (`latched`: over the impact speed), as F ~ d^n (1 + c d') where the elastic
    part is `force` (m,): what peaks between steps are found by."""
    if law.exponent is not None and law.damping is not None:
        return evaluate(law.exponent, numbers), evaluate(law.damping, numbers)
    depth = depth_at(law, force, numbers)
    elastic = elastic_at(law, depth, numbers)
    one = np.ones_like(depth)
    exponent = _slope(law, depth, numbers) * depth / elastic
    rates = {**numbers, "depth": depth, "impact_speed": one, "inverse_impact_speed": one}
    low, high = (force_of(law, {**rates, "rate": rate * one}) for rate in (-1e-4, 1e-4))
    return exponent, (high - low) / (2e-4 * elastic)


def steepness_of(law: FrictionLaw, numbers: Mapping[str, Any], size: int) -> tuple[Array, Array]:
    """One over the sliding speed within which friction changes most, and its largest slope, s/m, (m,) each."""
    if law.inverse_ramp is not None and law.steepness is not None:
        found = (evaluate(one, numbers) for one in (law.inverse_ramp, law.steepness))
        return tuple(np.broadcast_to(np.asarray(one, float), size) for one in found)  # type: ignore[return-value]
    if law.bristled:  # which hold at any speed
        return np.zeros(size), np.zeros(size)
    speeds = np.concatenate([[0.0], np.logspace(-9, 2, 2200)])
    flat = [(name, np.asarray(one, float)) for name, one in numbers.items() if np.ndim(one) < 2]
    columns = {name: one.reshape(-1, 1) for name, one in flat}
    ratio = evaluate(law.ratio, {**columns, "speed": speeds[None], "force": np.ones((1, 1))})
    ratio = np.broadcast_to(ratio, (size, len(speeds)))
    slope = np.abs(np.diff(ratio) / np.diff(speeds)).max(axis=1)
    return slope / np.maximum(np.abs(ratio).max(axis=1), 1e-300), slope
