"""Checks of a law that nobody here wrote, before anything runs: what it uses, its units, its numbers, its energy."""

import keyword
from collections.abc import Mapping
from dataclasses import fields
from functools import lru_cache
from typing import Any

import numpy as np

from hpcclear.base.arrays import Array, Booleans
from hpcclear.base.unit_names import UNITS, parts
from hpcclear.laws import declared
from hpcclear.laws.declared import ContactLaw, FrictionLaw, Function, Law, Parameter
from hpcclear.laws.numbers import elastic_at, evaluate, force_of, sample_numbers, stored, with_words
from hpcclear.laws.sources import text_of
from hpcclear.laws.translate import LawError

MOST_PARAMETERS = 32
MEND = "Correct the formula, or the parameters"

TYPICAL = dict(zip(declared.JOINT, (9e8, 1.7e-9, 0.02, 0.0197, 3e-4, 0.02, 0.0, 0.0), strict=True))
"""A joint of the paper's: what laws are tried on."""

DEPTHS = np.logspace(-9, -3.5, 45)
RATES = np.array([-10.0, -1.0, -0.1, -1e-3, 0.0, 1e-3, 0.1, 1.0, 10.0])
IMPACT_SPEEDS = np.array([1e-3, 0.1, 1.0, 10.0])
SPEEDS = np.concatenate([-np.logspace(2, -7, 40), [0.0], np.logspace(-7, 2, 40)])

TOUCHING = 1e-6  # force at no depth, as a part of that at the largest depth tried, up to which it counts as none

ROUNDING = 1e-9  # relative, of a force at opposite rates that counts as the same
SAME = 1e-4  # relative, of slopes by differences


_PAIRS = {
    "contact": ("factor", "elastic", "factor multiplies the elastic part of the force"),
    "friction": ("deflection", "largest", "the largest deflection, m, sets the tolerance of bristles"),
}  # fmt: skip
"""What a law declares, what belongs to it, and why."""


def _check_declared(law: Law) -> None:
    own, other, why = _PAIRS[law.kind]
    if getattr(law, own) and not getattr(law, other):
        geometry = ", or name a geometry in the scene" if other == "elastic" else ""
        raise LawError(f"declares {own} without {other}: {why}", f"Declare {other}{geometry}")
    main = "force" if law.kind == "contact" else "ratio"
    plain = next(one.default for one in fields(law) if one.name == main)
    own_main = getattr(law, main) is not plain
    if not own_main and getattr(law, "factor", None) is None:
        other = " (or factor and elastic)" if law.kind == "contact" else ""
        raise LawError(f"declares no {main}", f"Declare {main}{other}")
    if own_main and getattr(law, "factor", None) is not None:
        raise LawError("declares both force and factor", "Declare force, or factor and elastic")
    if len(getattr(law, "kinks", ())) not in (0, 2):
        raise LawError(f"declares {len(law.kinks)} kinks", "Declare two, or none")  # type: ignore[attr-defined]
    if law.numbers and law.once is None:
        listed = ", ".join(law.numbers)
        reason = f"declares the numbers {listed} without once"
        raise LawError(reason, "Declare once, which returns them")


@lru_cache(maxsize=256)
def check_parameters(law: Law) -> None:
    """LawError unless a law's parameters are parameters, of names that a function may have, in units that are known."""
    if len(law.parameters) > MOST_PARAMETERS:
        reason = f"has {len(law.parameters)} parameters, more than {MOST_PARAMETERS}"
        raise LawError(reason, "Compute some of them from others")
    names = [getattr(one, "name", None) for one in law.parameters]
    for one, name in zip(law.parameters, names, strict=True):
        if not isinstance(one, Parameter):
            raise LawError(f"has the parameter {one!r}", "Write Parameter(name, unit)")
        if not isinstance(name, str) or not name.isidentifier() or keyword.iskeyword(name):
            reason = f"has a parameter {name!r}, which is not a name"
            raise LawError(reason, "Write letters, digits and _")
        if names.count(name) > 1:
            raise LawError(f"declares the parameter {name!r} twice", "Give one another name")
        unit_of(one.unit, name)
    for name, unit in law.numbers.items():
        unit_of(unit, name)


def check_shape(law: Law) -> None:
    """LawError unless the law's functions require known quantities, are arithmetic, and fit their rows."""
    _check_declared(law)
    own = {one.name for one in law.parameters}
    given = own | declared.JOINT.keys() | law.numbers.keys() | declared.VARYING[law.kind].keys()
    for name in own & (declared.JOINT.keys() | declared.VARYING[law.kind].keys()):
        reason = f"has a parameter {name!r}, a name reserved for numbers of the joint"
        raise LawError(reason, "Give it another name")
    functions = {**law.functions(), **{f.__name__: f for f in law.afterwards()}}
    for title, function in functions.items():
        for name in law.arguments(function):
            if name not in given:
                known = ", ".join(sorted(given))
                remedy = f"Declare it as a parameter, or in numbers. Known are {known}"
                raise LawError(f"{title} uses {name!r}, which is not defined", remedy)
    if len(law.read) > declared.LAW_NUMBERS:
        reason = f"reads {len(law.read)} numbers, more than {declared.LAW_NUMBERS}"
        raise LawError(reason, "Compute more of them in once")
    if isinstance(law, ContactLaw) and law.elastic is not None:
        for name in declared.VARYING["contact"].keys() - {"depth"} & {*law.arguments(law.elastic)}:
            raise LawError(f"elastic uses {name!r}, but stored energy depends on the depth alone")
    text_of(law)


# ---- numbers with units, as Pint has them: what functions are run on to check their units ----------
Quantity = Any  # of Pint, which has no types here, or a plain number


@lru_cache(maxsize=1)
def registry() -> Any:
    """Pint's units."""
    from pint import UnitRegistry

    return UnitRegistry()


def _pure(x: Quantity) -> Quantity:
    return x.to("").magnitude if hasattr(x, "magnitude") else x


def _size_and_sign(x: Quantity, y: Quantity) -> Quantity:
    size = y.magnitude if hasattr(y, "magnitude") else y
    return -abs(x) if size < 0 else abs(x)


def _of_pure(function: Function) -> Function:
    def of(x: Quantity) -> Quantity:
        if np.iscomplexobj(pure := _pure(x)):
            raise ValueError("complex number")
        return registry().Quantity(float(function(pure)), "")

    return of


WORDS = {
    "sqrt": lambda x: x**0.5, "fabs": abs, "absolute": abs, "copysign": _size_and_sign, "minimum": min, "maximum": max,
    **dict.fromkeys(("pow", "power"), lambda x, y: x ** _pure(y)),
    **{name: _of_pure(getattr(np, name)) for name in ("exp", "log", "tanh", "arctan")},
    "atan": _of_pure(np.arctan),
}  # fmt: skip
"""What functions may call, for such numbers."""

_NAMED = {
    frozenset(dimensions.items()): name
    for name, dimensions in (
        ("newton", UNITS["N"][1]), ("pascal", UNITS["Pa"][1]), ("joule", UNITS["J"][1]), ("watt", UNITS["W"][1]),
    )
}  # fmt: skip
"""Pint's names of units, so that fractional powers of one cancel to the last digit."""


def unit_of(unit: str, name: str) -> Quantity:
    """One of a unit, as pint has it; LawError says of which number it is not known."""
    made = registry().Quantity(1.0, "")
    if not isinstance(unit, str):
        raise LawError(f"the unit of {name} is {unit!r}", 'Write it in quotes, "s/m"')
    try:
        for _, (size, own), power in parts(unit) if unit else ():
            known = _NAMED.get(frozenset(own.items()))
            powers = {known: 1.0} if known else {base: float(one) for base, one in own.items()}
            scale = size if known is None else size / 1000
            one = registry().Quantity(float(scale), registry().UnitsContainer(powers))
            made = made * one ** float(power)
    except ValueError:
        raise LawError(f"the unit {unit!r} of {name} is not known", "Write, say, s/m") from None
    return made


# ---- units ----------------------------------------------------------------------------------------
def check_units(law: Law, values: Mapping[str, object]) -> None:
    """LawError unless each function, run on quantities, returns one of its own unit; `values` of the parameters, SI."""
    import pint

    given = _quantities(law, values)

    def run(title: str, function: Function, unit: str) -> Quantity:
        asked = (given[name] for name in law.arguments(function))
        try:
            with np.errstate(all="ignore"):
                return _in_unit(law, with_words(function, WORDS, {})(*asked), title, unit)
        except (ZeroDivisionError, OverflowError):
            raise LawError(f"{title} is not finite", MEND) from None
        except (pint.DimensionalityError, pint.OffsetUnitCalculusError) as error:
            reason = f"{title} does not fit its units: {error}"
            raise LawError(reason, "Correct the formula, or the unit of a parameter") from None
        except LawError:
            raise
        except (TypeError, ValueError, ArithmeticError, LookupError, NameError) as error:
            said = f"raised {type(error).__name__}: {error}"
            if "Cannot compare" in str(error):  # of pint, whose classes nobody here knows
                said = "does not fit its units: it compares a quantity with a plain number"
            elif "complex" in str(error):
                said = "has no real value"
            raise LawError(f"{title} {said}", "Correct the formula") from None

    for made_once in law.worked_out():
        given |= run("once", made_once, "")
    wanted = {"force": "N", "elastic": "N", "ratio": "", "deflection": "m/s"}
    for title, function in law.functions().items():
        run(title, function, wanted.get(title, ""))
    if isinstance(law, ContactLaw) and law.energy is not None:
        run("energy", law.energy, "J")


def _quantities(law: Law, values: Mapping[str, Any]) -> dict[str, Quantity]:
    """What a law's functions may require, with units."""
    made = registry().Quantity
    given = {name: made(TYPICAL[name], unit) for name, unit in declared.JOINT.items()}
    given |= {name: made(0.1, unit) for name, unit in declared.VARYING[law.kind].items()}
    given["depth"] = made(1e-5, "m")
    for one in law.parameters:
        value, unit = values[one.name], unit_of(one.unit, one.name)
        several = isinstance(value, tuple)
        given[one.name] = tuple(v * unit for v in value) if several else value * unit
    return given


def _in_unit(law: Law, found: Quantity, title: str, unit: str) -> Quantity:
    """What a function returned, in its unit; of ``once`` each number in its own."""
    if isinstance(found, Mapping):
        missing = found.keys() - law.numbers.keys()
        if len(law.worked_out()) == 1:
            missing |= law.numbers.keys() - found.keys()
        if missing:
            reason = f"once returns {', '.join(found)}, but numbers declares {', '.join(law.numbers) or 'none'}"
            raise LawError(reason, "Declare each with its unit: numbers={...}")
        return {
            name: _in_unit(law, value, f"{title}: {name}", law.numbers[name])
            for name, value in found.items()
        }
    own = unit_of(unit, title).units
    if not hasattr(found, "magnitude"):
        if isinstance(found, complex):
            raise LawError(f"{title} has no real value", "Correct the formula")
        if isinstance(found, bool) or not isinstance(found, int | float):
            reason = f"{title} returns {type(found).__name__}, which is no number"
            raise LawError(reason, "Correct it")
        found = registry().Quantity(found, own if found == 0 else "")
    return found.to(own)


# ---- numbers --------------------------------------------------------------------------------------
def check_numbers(law: Law, values: Mapping[str, object]) -> None:
    """LawError unless the law is finite, of the right sign, and stores the energy it says, over depths, rates and speeds."""
    given = sample_numbers(law, {**TYPICAL, **values})
    for name in law.numbers:
        if not np.isfinite(np.asarray(given[name], float)).all():
            reason = f"{name}, computed once, is not finite"
            raise LawError(reason, "Correct once, or the parameters")
    if isinstance(law, ContactLaw):
        _check_contact(law, given)
    else:
        assert isinstance(law, FrictionLaw)
        _check_friction(law, given)


def _check_contact(law: ContactLaw, given: Mapping[str, object]) -> None:
    depth, rate, impact = DEPTHS[:, None, None], RATES[None, :, None], IMPACT_SPEEDS[None, None]
    quantities = (depth, rate, impact, 1.0 / impact)
    varying = dict(zip(declared.VARYING["contact"], quantities, strict=True))
    shape = (len(DEPTHS), len(RATES), len(IMPACT_SPEEDS))
    force = np.broadcast_to(force_of(law, {**given, **varying}), shape)

    def where(bad: Booleans) -> str:
        i, j, k = np.argwhere(np.broadcast_to(bad, shape))[0]
        at_speed = f", impact speed {IMPACT_SPEEDS[k]:g} m/s" if law.latched else ""
        return f"at depth {DEPTHS[i]:.3g} m, rate {RATES[j]:g} m/s{at_speed}"

    bad = ~np.isfinite(force)
    if bad.any():
        raise LawError(f"the force is not finite {where(bad)}", MEND)
    pulls = (force < 0.0) & (rate >= 0.0)
    if pulls.any():
        reason = f"the contact force pulls, F =  {force[pulls][0]:.3g} N, {where(pulls)}"
        raise LawError(reason, "A contact under compression must not pull")
    # what counts is the force that the kernel applies: it does not pull
    applied = np.maximum(force, 0.0)
    creates = (rate > 0.0) & (applied[:, ::-1] > (1.0 + ROUNDING) * applied)
    if creates.any():
        raise LawError(
            "an impact gains energy: the force is larger while bodies part than while they approach, "
            f"{where(creates)}",
            "Damping must add to the force at positive rates: write (1 + b * rate), not (1 - b * rate)",
        )
    _check_stored(law, given, force[:, list(RATES).index(0.0)])
    nothing = {**given, **varying, "depth": 0.0 * depth[:1]}
    touching = np.abs(np.broadcast_to(force_of(law, nothing), (1, *shape[1:]))).max()
    if not law.latched and not touching <= TOUCHING * elastic_at(law, DEPTHS, given).max():
        remedy = "Make it vanish with the depth: multiply the damping by the elastic part"
        raise LawError(f"its force is {touching:.3g} N without contact (depth 0)", remedy)


def _check_stored(law: ContactLaw, given: Mapping[str, object], at_rest: Array) -> None:
    """LawError unless the force at rest (depths, impact speeds), N, is the elastic part, and that the slope of the energy."""
    if np.ptp(at_rest, axis=1).max() > SAME * at_rest.max():
        reason = "the force at rest depends on the impact speed, but stored energy depends on the depth alone"
        raise LawError(reason, "Let the impact speed scale the damping only")
    elastic = np.broadcast_to(elastic_at(law, DEPTHS, given), DEPTHS.shape)
    if not np.allclose(elastic, at_rest[:, 0], rtol=SAME, atol=0.0):
        reason = "elastic differs from the force at a rate of 0"
        raise LawError(reason, "Correct one of the two, or leave elastic out")
    if not (elastic > 0.0).all() or not (np.diff(elastic) > 0.0).all():
        reason = "the elastic part does not increase with the depth"
        raise LawError(reason, "The stiffness must be above 0")
    step = 1e-4 * DEPTHS
    slope = (stored(law, DEPTHS + step, given) - stored(law, DEPTHS - step, given)) / (2.0 * step)
    off = ~np.isclose(slope, elastic, rtol=SAME, atol=1e-12 * elastic.max())
    if off.any():
        k = int(np.argmax(off))
        both = f"the energy's slope is {slope[k]:.6g} N and the force at rest {elastic[k]:.6g} N"
        reason = f"the energy does not match the force: at depth {DEPTHS[k]:.3g} m {both}"
        raise LawError(reason, "Correct energy, or leave it out; it is then integrated")


def _check_friction(law: FrictionLaw, given: Mapping[str, object]) -> None:
    quantities = (SPEEDS, np.ones_like(SPEEDS), 0.0 * SPEEDS, 0.0 * SPEEDS)
    varying = dict(zip(declared.VARYING["friction"], quantities, strict=True))
    ratio = np.broadcast_to(evaluate(law.ratio, {**given, **varying}), SPEEDS.shape)
    bad = ~np.isfinite(ratio)
    if bad.any():
        raise LawError(f"the ratio is not finite at {SPEEDS[bad][0]:.3g} m/s", MEND)
    drives = ratio * SPEEDS < -1e-12 * np.abs(ratio * SPEEDS).max()
    if drives.any():
        place = f"ratio {ratio[drives][0]:.3g} at {SPEEDS[drives][0]:.3g} m/s"
        remedy = "Give the ratio the sign of the sliding speed"
        raise LawError(f"friction drives sliding on: {place}", remedy)
    if law.deflection is not None:
        rate = np.broadcast_to(evaluate(law.deflection, {**given, **varying}), SPEEDS.shape)
        if not np.isfinite(rate).all():
            raise LawError("the rate of deflection is not finite", MEND)


@lru_cache(maxsize=256)
def check(law: Law, values: tuple[tuple[str, object], ...]) -> None:
    """All of them, once for each law and values of its parameters. Raises LawError: the first that fails."""
    check_shape(law)
    check_units(law, dict(values))
    check_numbers(law, dict(values))
