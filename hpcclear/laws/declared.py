"""What a law declares: its parameters, and plain functions of numbers.

Each function names what it needs by its arguments, and gets it: first what varies (below), then numbers of its own that
`once` works out for each sample, then the law's parameters, then the joint's numbers (`JOINT`). All in SI units. The functions
are arithmetic, so that one and the same source is compiled into the lanes, runs on arrays, and is checked with units.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from inspect import signature
from typing import Any

Function = Callable[..., Any]

LAW_NUMBERS = 8
"""Rows of a joint for the numbers of its law of contact, and as many for friction's: which is which, the law says."""

JOINT = {
    "stiffness": "N/m**1.5",
    "compliance": "1/Pa",
    "bearing_radius": "m",
    "journal_radius": "m",
    "clearance": "m",
    "length": "m",
    "dundurs_alpha": "",
    "dundurs_beta": "",
}
"""A joint's numbers and their units: Hertz's stiffness of a sphere, (1 - nu^2)/E of both surfaces together, radii, radial
clearance, length of the bearing (NaN where the scene gives none), and Dundurs' parameters of journal against bearing."""

VARYING = {
    "contact": {"depth": "m", "rate": "m/s", "impact_speed": "m/s", "inverse_impact_speed": "s/m"},
    "friction": {"speed": "m/s", "force": "N", "deflection": "m", "deflection_rate": "m/s"},
}
"""What varies from instant to instant, by the kind of law, with units: penetration, its rate, the rate at the start of this
contact (a law that requires it is `latched`) and one over it; the sliding speed, the normal force, and the deflection of
bristles with its rate."""


@dataclass(frozen=True)
class Parameter:
    """An entry of the law's table in the scene; a design variable by its path, unless it is a list."""

    name: str
    unit: str = ""
    words: str = ""
    default: Any = None
    """None: has to be given."""
    least: float | None = None
    above: float | None = None
    most: float | None = None
    below: float | None = None
    example: str = ""
    """What to write where it is missing."""
    called: str = ""
    """In messages: "fixed damping factor"; its name, if empty."""
    count: int = 1
    """How many numbers: one, or a list of so many."""

    def bounds(self) -> str:
        """The bounds in words."""
        words = ("above", "at least", "below", "at most")
        limits = zip(words, (self.above, self.least, self.below, self.most), strict=True)
        return " and ".join(f"{word} {one:g}" for word, one in limits if one is not None)

    @property
    def title(self) -> str:
        """As messages call it."""
        return self.called or self.name


@dataclass(frozen=True, eq=False)
class Described:
    """What laws and geometries declare alike."""

    words: str
    """One sentence: what it is."""
    source: str = ""
    """Where it was published, with DOI; "" for one's own."""
    formula: str = ""
    valid: str = ""
    """The range it was made for, in words."""
    parameters: tuple[Parameter, ...] = ()
    once: Function | tuple[Function, ...] | None = None
    """From parameters and the joint's numbers to a mapping of further numbers, worked out once a sample; or several."""
    numbers: Mapping[str, str] = field(default_factory=dict)
    """Names and units of what `once` gives."""
    name: str = field(default="", kw_only=True)

    def worked_out(self) -> tuple[Function, ...]:
        """The functions of ``once``."""
        if self.once is None:
            return ()
        return self.once if isinstance(self.once, tuple) else (self.once,)


@dataclass(frozen=True, eq=False)
class Law(Described):
    """What laws of all kinds declare. Raises TypeError: a function requires an unknown quantity."""

    check: Function | None = None
    """From the table's values to (reason, remedy, parameter) where they do not fit together, else None."""
    simpler: Function | None = None
    """From the table's values to pairs (words, table): laws that this one may be replaced by, with less effect or less cost."""
    elsewhere: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    """Parameters of other laws that a user might write here: reason and remedy."""

    kind = ""

    @staticmethod
    @cache
    def arguments(function: Function) -> tuple[str, ...]:
        """Names of what a function requires."""
        return tuple(signature(function).parameters)

    def functions(self) -> dict[str, Function]:
        """Those that run in the lanes, by name."""
        raise NotImplementedError

    @cached_property
    def read(self) -> tuple[str, ...]:
        """Numbers of a sample that they require, in the order of their rows."""
        varying = VARYING[self.kind]
        functions = [*self.functions().values(), *self.afterwards()]
        asked = [name for one in functions for name in self.arguments(one)]
        return tuple(dict.fromkeys(name for name in asked if name not in varying))

    def afterwards(self) -> list[Function]:
        """Functions that read the same numbers after a run."""
        return []

    def parameter(self, name: str) -> Parameter | None:
        """That of a name."""
        return next((one for one in self.parameters if one.name == name), None)


@dataclass(frozen=True, eq=False, kw_only=True)
class Geometry(Described):
    """The elastic part of a normal force by the shapes that touch; laws that damp by a `ContactLaw.factor` go with any."""

    elastic: Function
    """N, of depth."""
    energy: Function | None = None
    swing: Function | None = None
    exponent: Function | None = None
    deepest: Function | None = None
    """These as of `ContactLaw`."""
    pressure: Function | None = None
    """Peak pressure, Pa, of depth and force."""
    half_angle: Function | None = None
    """Half of the angle over which the surfaces touch, rad, of depth and force."""
    has_length: bool = False
    """Whether the bearing's length is needed."""
    of_rows: Function | None = None
    """From the rows of a table (depth in m, force in N) in the scene to the geometry that they make; None: it has no table."""


@dataclass(frozen=True, eq=False)
class ContactLaw(Law):
    """A normal force of a joint, of depth, its rate and perhaps the impact speed. It never pulls: what is negative is cut."""

    force: Function = lambda depth: 0.0 * depth
    """N."""
    factor: Function | None = None
    """Instead of ``force``: 1 + damping, by which ``elastic`` is multiplied, so that the law goes with any `Geometry`."""
    geometry: Geometry | None = None
    """That of ``elastic``, where it is not the law's own."""
    elastic: Function | None = None
    """Its part that stores energy, N; by default the force at a rate of 0."""
    energy: Function | None = None
    """What that stores at a depth, J; by default integrated."""
    swing: Function | None = None
    """Stiffness dF/dd, N/m, where the elastic part is ``force`` (an argument of it); by default by differences."""
    kink: Function | None = None
    """A function that changes its sign where the cut begins; by default the force before the cut over its elastic part."""
    exponent: Function | None = None
    """Of the depth in the elastic part, near a depth; by default by differences."""
    damping: Function | None = None
    """Factor of the rate (`latched`: of the rate over the impact speed), s/m or 1; by default by differences."""
    deepest: Function | None = None
    """Depth beyond which a result is flagged, m; by default where theories of small contacts end (`Shape.deepest`)."""
    without_loss: str = ""
    """Name of the law that is left without damping."""
    lossless: Function | None = None
    """Whether the table's values leave no damping."""

    kind = "contact"

    def functions(self) -> dict[str, Function]:
        """Those that run in the lanes."""
        product = self.factor is not None
        found = {"force": None if product else self.force, "factor": self.factor}
        found |= {"elastic": self.elastic, "kink": self.kink}
        return {name: one for name, one in found.items() if one is not None}

    def on(self, geometry: Geometry) -> "ContactLaw":
        """This law, which has a ``factor``, on the elastic part of other shapes."""
        g = geometry
        return replace(
            self, geometry=g, elastic=g.elastic, energy=g.energy, swing=g.swing, exponent=g.exponent,
            deepest=g.deepest, parameters=self.parameters + g.parameters,
            numbers={**self.numbers, **g.numbers},
            once=self.worked_out() + g.worked_out(),
        )  # fmt: skip

    def afterwards(self) -> list[Function]:
        """The stored energy."""
        return [] if self.energy is None else [self.energy]

    @property
    def latched(self) -> bool:
        """Whether it requires the impact speed."""
        asked = {name for one in self.functions().values() for name in self.arguments(one)}
        return bool(asked & {"impact_speed", "inverse_impact_speed"})


@dataclass(frozen=True, eq=False)
class FrictionLaw(Law):
    """Tangential over normal force of a joint, signed like the sliding speed; perhaps with bristles, which have a state."""

    ratio: Function = lambda speed: 0.0 * speed
    """Tangential over normal force."""
    kinks: tuple[Function, ...] = ()
    """Two functions, or none, that change their signs where the ratio has kinks, of order 1 between them."""
    inverse_ramp: Function | None = None
    """One over the sliding speed within which friction changes most, s/m, which steps resolve; by default by differences."""
    steepness: Function | None = None
    """Largest slope of the ratio, s/m; by default by differences."""
    deflection: Function | None = None
    """Rate of the bristles' deflection, m/s; a law that has it takes a coordinate for each joint with clearance."""
    largest: Function | None = None
    """Of a law with bristles: their largest deflection in steady sliding, m, what its tolerance goes by."""

    kind = "friction"

    def functions(self) -> dict[str, Function]:
        """Those that run in the lanes."""
        found = {"ratio": self.ratio, "deflection": self.deflection}
        kinks = {f"kink_{k}": one for k, one in enumerate(self.kinks)}
        return {name: one for name, one in found.items() if one is not None} | kinks

    @property
    def bristled(self) -> bool:
        """Whether it has a state."""
        return self.deflection is not None


@dataclass(frozen=True, eq=False)
class FilmLaw(Law):
    """An oil film between journal and bearing: Reynolds' equation, solved in some way. Its forces are compiled as they are."""

    force: Any = None
    """Lane function (par, row, scale, place, w, s2, i, W): force on the journal, N; `place`: the eccentricity over the
    clearance, 1 - `s2` its square, `w` as of `laws.reynolds`, `row` the first of the ``further`` numbers."""
    scale: Function = lambda viscosity: 0.0 * viscosity
    """Factor of the force, N s/m, of viscosity, film_length, bearing_radius and clearance."""
    lengths: tuple[float, float] = (0.0, math.inf)
    """Lengths over diameters that it is for."""
    further: Function | None = None
    """More numbers, of length over diameter: a film that has them is solved for the ``lengths`` alone."""

    kind = "film"
