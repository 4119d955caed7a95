"""Arithmetic that writes itself down: terms of names and numbers, and the text that computes them, statement by statement.

Zeros disappear, signs move outwards, and nothing else is rearranged: the text adds and multiplies in the order
in which the generator did, which decides the last bits. Names are read where they are first needed. `On` and `Rows` say what a
text has in it, and where it finds and leaves its numbers.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from hpcclear.base.errors import InputError
from hpcclear.base.terms import Term, named
from hpcclear.dynamics import layout as at


class On(NamedTuple):
    """Which effects and outputs a text has, besides the mechanism's own loads and drives."""

    friction: bool = False  # in the joints with clearance: of contact or of a film
    gravity: bool = False
    energies: bool = False  # energy balance
    series: bool = False  # drive moment, for time series
    responses: bool = False  # drive moment and what is followed
    impacts: bool = False  # force on the frame
    pins: bool = False  # forces of ideal pins
    follow: str = ""  # a guided body, or body.point
    objective: str = ""  # its rate: "joints", or "whole" of the mechanism
    waves: bool = False  # surfaces of the joints with clearance are out of round


@dataclass(frozen=True)
class Rows:
    """Where a text finds and leaves its numbers: first rows of `work`, rows of parameters, first row that is free."""

    coordinates: int = at.QS
    velocities: int = at.VS
    accelerations: int = at.ACC
    rates: int = at.RATE_NOW
    time: int = at.STAGE_TIME
    holds: int | None = None  # first of the multipliers, where they are asked for
    parameters: Mapping[str, int] = field(default_factory=dict)
    free: int = 0
    curves: Mapping[str, int] = field(default_factory=dict)  # tabulated values, by drive or load
    # on straight tables; rates MAX_CURVES behind
    places: Mapping[str, int] = field(default_factory=dict)

    def behind(self, bristles: int) -> "Rows":
        """The same of a motion whose coordinates come after so many of bristles."""
        moved = ("coordinates", "velocities", "accelerations")
        return replace(self, **{name: getattr(self, name) + bristles for name in moved})


_BINDS = {"+": 1, "*": 2, "/": 2, "name": 3}  # how tightly


def onto(factor: Term, product: Term) -> Term:
    """`factor` times a product, from the left: f p a and not f (p a), where p holds what is of parameters alone."""
    if product.op == "*" and not product.fixed:
        result = onto(factor, product.args[0]) * product.args[1]
        return -result if product.negative else result
    return factor * product


class Writer:
    """Statements of a text, in the order in which their values are first needed.

    `rows`: of parameters that have one, derived ones by their texts; others get the rows of `par` from `free` on. With
    `hoist`, what holds parameters alone is worked out once a sample, as a derived parameter. No value gets a name that is
    `taken`, whatever a load or drive is called.
    """

    def __init__(
        self, rows: Mapping[str, int], free: int, hoist: bool, taken: Iterable[str] = ()
    ) -> None:
        self.lines: list[str] = []
        self.rows = dict(rows)
        self.free = free
        self.hoist = hoist
        self.derived: dict[str, str] = {}  # name: text in parameters
        self.read: set[str] = set()  # parameters that a line reads, each of which has a row
        self.functions: dict[str, Callable[..., object]] = {}  # of loads, which lines call
        self._derived_names: dict[str, str] = {}
        self._pending: dict[str, tuple[tuple[str, ...], str, tuple[Term, ...]]] = {}
        self._values: dict[str, Term] = {}
        self._taken: set[str] = set(taken)

    def parameter(self, name: str) -> Term:
        """A parameter of the sample."""
        return named(name, fixed=True)

    def when_needed(self, text: str, *names: str, needs: tuple[Term, ...] = ()) -> tuple[Term, ...]:
        """Names whose statement is written down before the first that uses one of them."""
        for name in names:
            self._pending[name] = (names, f"{', '.join(names)} = {text}", needs)
            self._taken.add(name)
        return tuple(map(named, names))

    def let(self, name: str, term: Term, *, whole: bool = False) -> Term:
        """Give a term a name, unless it has one (or is zero, or one) or its text is known already.

        `whole`: whatever it is, with its sign; else the sign stays outside, where it may cancel another.
        """
        if not whole and (not term or term.op in ("name", "1") or (term.fixed and self.hoist)):
            return term
        outside = term.negative and not whole
        text = self.text(abs(term) if outside else term)
        if text not in self._values:
            name = self.fresh(name)
            self.lines.append(f"{name} = {text}")
            self._values[text] = named(name)
        return -self._values[text] if outside else self._values[text]

    def fresh(self, name: str) -> str:
        """A name that nothing has yet."""
        candidate, count = name, 2
        while candidate in self._taken:
            candidate, count = f"{name}_{count}", count + 1
        self._taken.add(candidate)
        return candidate

    def call(
        self, function: Callable[..., object] | str, terms: Iterable[Term], results: Iterable[str]
    ) -> tuple[Term, ...]:
        """A statement that calls a function, one of `elements` by its name; what it returns, by names like these."""
        texts = [self.text(term) for term in terms]
        made = [self.fresh(name) for name in results]
        if not isinstance(function, str):
            known = (name for name, one in self.functions.items() if one is function)
            name = next(known, None) or self.fresh(function.__name__)
            self.functions[name] = function
            function = name
        self.line(f"{', '.join(made)} = {function}({', '.join(texts)})")
        return tuple(map(named, made))

    def store(self, row: int, term: Term) -> None:
        """A statement that leaves a value in a row of the lanes."""
        self.line(f"work[{row} * W + i] = {self.text(term)}")

    def table(self, name: str, count: int, where: Term, row: int | None) -> Term:
        """The value at a place of a table of so many rows that runs straight from row to row and stays level beyond.

        A sum of hinges, which lanes evaluate without a branch: its parameters are those of `base.pieces.hinges`, as rows may
        differ from sample to sample. The place is left in a `row` of the lanes if there is one for it: steps end at the table's
        rows (`stepping.rows`).
        """
        total = self.parameter(f"{name}_first")
        place = self.let(f"at_{name}", where, whole=True)
        if row is not None:
            self.store(row, place)
        for k in range(count):
            start, bend = (self.parameter(f"{name}_{entry}_{k}") for entry in ("start", "bend"))
            total = total + self.hinge(f"{name}_{k}", place, start, bend)
        return total

    def hinge(self, name: str, place: Term, start: Term, bend: Term) -> Term:
        """A line of slope `bend` beyond `start`, 0 before."""
        (made,) = self.call("hinge", (place, start, bend), (name,))
        return made

    def line(self, text: str) -> None:
        """A statement as it stands; its names must have been written already (see `text`)."""
        self.lines.append(text)

    def text(self, term: Term, *, within: int = 0, plain: bool = False) -> str:
        """A term as Python; what it needs is written down first.

        `within`: how tightly the surroundings bind; `plain`: for a derived parameter, so that nothing is written down.
        """
        if not term:
            return "0.0"
        if term.op == "1":
            return "-1.0" if term.negative else "1.0"
        if self.hoist and not plain and term.fixed and term.op != "name":
            term = self._hoisted(term)
        if term.negative and term.op == "+" and term.args[0].negative:
            term = Term("+", tuple(-part for part in term.args), False, term.fixed)
        binds = 1 if term.negative else _BINDS[term.op]
        text = self._body(term, plain)
        if term.negative:
            text = "-" + (f"({text})" if term.op == "+" else text)
        return f"({text})" if binds <= within else text

    def _body(self, term: Term, plain: bool) -> str:
        if term.op == "name":
            if not plain:
                self._need(term)
            return term.name
        parts = [self.text(abs(part), within=1, plain=plain) for part in term.args[:1]]
        if term.op != "+":
            return f"{parts[0]} {term.op} {self.text(term.args[1], within=2, plain=plain)}"
        parts += [self.text(abs(part), within=1, plain=plain) for part in term.args[1:]]
        text = ("-" if term.args[0].negative else "") + parts[0]
        for part, written in zip(term.args[1:], parts[1:], strict=True):
            text += (" - " if part.negative else " + ") + written
        return text

    def _need(self, term: Term) -> None:
        """Write down what a name stands for, if that is not done yet."""
        name = term.name
        if name in self._pending:
            names, line, needs = self._pending[name]
            for one in names:
                self._pending.pop(one)
            for needed in needs:
                self._need(needed)
            self.lines.append(line)
        elif term.fixed and name not in self.read:
            self.read.add(name)
            row = self.rows.setdefault(name, self.free)
            self.free = max(self.free, row + 1)
            if self.free > at.WAVES:  # said at once: the rest of such a text takes minutes
                count = f"more than {at.WAVES - at.OWN}"
                reason = f"need too many products of lengths and masses: {count}"
                remedy = "Use fewer bodies, or shorter chains of them"
                remedy = f"{remedy}: each is coupled with all others"
                raise InputError("mechanism.bodies", None, reason, remedy)
            comment = f"  # {self.derived[name]}" if name in self.derived else ""
            self.lines.append(f"{name} = par[{row} * W + i]{comment}")

    def _hoisted(self, term: Term) -> Term:
        text = self.text(abs(term), plain=True)
        if text not in self._derived_names:
            name = f"fixed_{len(self.derived) + 1}"
            self._derived_names[text] = name
            self.derived[name] = text
            if text in self.rows:
                self.rows[name] = self.rows[text]
        result = named(self._derived_names[text], fixed=True)
        return -result if term.negative else result
