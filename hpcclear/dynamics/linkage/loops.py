"""Constraints of a mechanism as numbers, for Newton's method: errors, rates and Jacobian in Cartesian coordinates.

The terms are those of `closing.Closing`, evaluated by Python or, for many instants at once, by numpy.
"""

from collections.abc import Callable, Mapping, Sequence
from itertools import chain, combinations
from typing import Any, NamedTuple

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.pieces import Pieces
from hpcclear.dynamics.linkage import elements
from hpcclear.dynamics.linkage.closing import Closing
from hpcclear.dynamics.linkage.expression import Rows, Writer
from hpcclear.dynamics.linkage.kinematics import Kinematics, Mover
from hpcclear.dynamics.linkage.mechanism import Mechanism, straight
from hpcclear.dynamics.linkage.numbers import values
from hpcclear.dynamics.linkage.parts import Number, Pair, is_joint
from hpcclear.dynamics.linkage.trees import forest

WORDS: dict[str, Callable[..., object]] = elements.functions() | {
    "sincos": lambda angle: (np.sin(angle), np.cos(angle)),
    "sign_of": lambda value: np.where(value >= 0.0, 1.0, -1.0),
    "saturated": lambda value: np.clip(value, -1.0, 1.0),
}
"""What texts call, for arrays of any shape."""


def on_arrays(
    mechanism: Mechanism, source: str, **functions: Callable[..., object]
) -> Callable[..., None]:
    """The function of a text of terms, evaluated by Python or, for many instants or samples at once, by numpy.

    `functions`: what its loads call besides.
    """
    names: dict[str, Any] = WORDS | words_of(mechanism) | functions
    exec(source, names)
    return names[source[len("def ") : source.index("(")]]


def of_terms(
    mechanism: Mechanism, writer: Writer, lines: list[str], results: str
) -> Callable[..., None]:
    """The function (work, par, *results) of a writer's statements and of lines behind them, as of `on_arrays`."""
    text = "\n    ".join([*writer.lines, *lines, "pass"])
    return on_arrays(mechanism, f"def terms(work, par, {results}, i=0, W=1):\n    {text}")


def words_of(mechanism: Mechanism) -> dict[str, Callable[[Array], list[Array]]]:
    """What texts for numpy call for each table of angles: ``table_of_NAME(time)``, its `curves` at times of any shape, from
    the same pieces that the kernel reads."""

    def reader(pieces: tuple[Pieces, ...]) -> Callable[[Array], list[Array]]:
        return lambda time: [one.at(time) for one in pieces]

    tables = (drive for drive in mechanism.drives if drive.kind == "table")
    return {f"table_of_{drive.name}": reader(drive.pieces) for drive in tables}


class State(NamedTuple):
    """Constraints at poses: errors (rows, ...), rates (rows, ...), Jacobians (..., rows, n)."""

    error: Array
    rate: Array
    jacobian: Array


class Loops:
    """Constraints of a mechanism's bodies, three coordinates each; `closed`: joints with clearance centred, torque drives at
    their initial speed. `trees`: those of the joints that close loops, in the coordinates of the trees.

    `owners`: which joint or drive each row belongs to, "joints.NAME" or "drives.NAME"; `units`: of its error; `scales` (n,):
    what a coordinate's unit step means, a typical length for x, y and along guides, 1 for angles; `row_scales` (rows,): a
    constraint's unit error, likewise.
    """

    def __init__(self, mechanism: Mechanism, closed: bool = False, trees: bool = False) -> None:
        self.mechanism = mechanism = straight(mechanism)  # what bends starts straight
        self.forest = forest(mechanism, cartesian=not trees, closed=closed)
        columns = [Mover(one.kind, one.body) for one in self.forest.coordinates]
        self.size = n = len(columns)
        writer = Writer({}, 0, hoist=False)
        kinematics = Kinematics(self.forest, writer, Rows(coordinates=0, velocities=n, time=2 * n))
        closing = Closing(kinematics, writer)
        owners: list[str] = []
        units: list[str] = []
        texts: list[str] = []
        places: list[tuple[int, int]] = []
        for one in self.forest.closures:
            table = "joints" if is_joint(one) else "drives"
            for row in closing.rows(one):
                r = len(owners)
                owners.append(f"{table}.{one.name}")
                units.append("rad" if row.name.endswith("_angle") else "m")
                texts += [f"error[{r}] = {writer.text(row.error)}"]
                texts += [f"rate[{r}] = {writer.text(row.rate)}"]
                for column, term in row.columns.items():
                    places.append((r, columns.index(column)))
                    texts.append(f"entries[{len(places) - 1}] = {writer.text(term)}")
        self.owners, self.units = tuple(owners), tuple(units)
        self._places = tuple(np.array(places, int).reshape(-1, 2).T)
        self._evaluate = of_terms(mechanism, writer, texts, "error, rate, entries")
        self._rows = {name: writer.rows[name] for name in writer.read}
        self.take(values(mechanism, cartesian=not trees))
        self.length = length = float(typical_length(mechanism))
        self.scales = np.array([1.0 if c.kind == "angle" else length for c in columns])
        self.row_scales = np.where(np.array(units, str) == "rad", 1.0, length)

    def take(self, base: Mapping[str, Number]) -> None:
        """Other numbers of the same mechanism, by names as of `numbers.values`: single ones, or arrays of samples (m,)."""
        self._par = {row: base[name] for name, row in self._rows.items()}

    def scaled(self, jacobian: Array) -> Array:
        """Jacobians (..., rows, n) in units of coordinates and constraints."""
        return jacobian * self.scales / self.row_scales[:, None]

    def at(self, q: Array, v: Array, time: Number) -> State:
        """Constraints of coordinates and velocities (n, ...) at times (...) in s."""
        rows, shape = len(self.owners), np.shape(time)
        error, rate = np.zeros((2, rows, *shape))
        entries = np.zeros((len(self._places[0]), *shape))
        self._evaluate([*q, *v, time], self._par, error, rate, entries)
        jacobian = np.zeros((*shape, rows, self.size))
        jacobian[..., self._places[0], self._places[1]] = np.moveaxis(entries, 0, -1)
        return State(error, rate, jacobian)


def typical_length(mechanism: Mechanism) -> Number:
    """The largest distance between points of a body, or of the ground, m; of samples, (m,)."""
    bodies = ([*body.points.values(), body.center] for body in mechanism.bodies)
    return largest_distance([*mechanism.ground.values()], *bodies)[()]


def largest_distance(*groups: Sequence[Pair]) -> Array:
    """The largest between points of one of the groups, m; of samples, (m,); 1 where all are in one place."""
    largest: Number = 0.0
    for a, b in chain.from_iterable(combinations(points, 2) for points in groups):
        largest = np.maximum(largest, np.hypot(a[0] - b[0], a[1] - b[1]))
    return np.where(largest > 0.0, largest, 1.0)
