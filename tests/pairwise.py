"""Tables of choices in which every pair of levels of any two factors stands at least once."""

import itertools
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

CONTACTS = {
    "hertz": {"law": "hertz"},
    "hunt-crossley": {"law": "hunt-crossley", "damping": 0.5},
    "latched": {"law": "flores", "restitution": 0.5},
}
FRICTIONS = {
    "none": {"law": "none"},
    "coulomb": {"law": "coulomb", "coefficient": 0.05},
    "ambrosio": {"law": "ambrosio", "coefficient": 0.05, "speeds": [0.001, 0.01]},
    "lugre": {
        "law": "lugre",
        "coefficient": 0.05,
        "static_coefficient": 0.08,
        "stribeck_speed": 0.01,
        "bristle_stiffness": 1e5,
        "bristle_damping": 0.1,
    },
}

Row = dict[str, Any]
Factors = dict[str, list[Any]]


def pairs_of(factors: Factors, row: Row) -> Iterator[tuple]:
    """The pairs of levels, by number, that a (partial) row holds."""
    names = [name for name in factors if name in row]
    for a, b in itertools.combinations(names, 2):
        yield a, factors[a].index(row[a]), b, factors[b].index(row[b])


def all_pairs(factors: Factors, allowed: Callable[[Row], bool]) -> Iterator[tuple]:
    """Every pair that may stand in a row."""
    for a, b in itertools.combinations(factors, 2):
        for x, y in itertools.product(factors[a], factors[b]):
            if allowed({a: x, b: y}):
                yield a, factors[a].index(x), b, factors[b].index(y)


def pairwise_table(factors: Factors, allowed: Callable[[Row], bool]) -> list[Row]:
    """Rows that hold every allowed pair of levels at least once; greedy, the same at every call."""
    left = dict.fromkeys(all_pairs(factors, allowed))
    rng = np.random.default_rng(1)
    rows = []
    while left:
        a, i, b, j = next(iter(left))
        best: Row = {}
        most = -1
        for _ in range(60):
            row = {a: factors[a][i], b: factors[b][j]}
            for name in rng.permutation([n for n in factors if n not in row]):
                levels = [x for x in factors[name] if allowed({**row, name: x})]
                gains = [
                    sum(p in left for p in pairs_of(factors, {**row, name: x})) for x in levels
                ]
                row[name] = levels[int(np.argmax(gains))]
            gain = sum(p in left for p in pairs_of(factors, row))
            if gain > most and allowed(row):
                best, most = row, gain
        rows.append({name: best[name] for name in factors})
        for pair in pairs_of(factors, best):
            left.pop(pair, None)
    return rows
