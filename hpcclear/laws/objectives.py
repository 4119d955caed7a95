"""Objectives with a rate of their own: it is written into the lanes like a law, and checked before anything runs."""

from collections.abc import Callable, Mapping

import numpy as np

from hpcclear.base.objectives import MADE, OF_ALL, OF_JOINTS, RECORDED, Objective, arguments
from hpcclear.base.outcome import FIELDS
from hpcclear.laws.checks import TYPICAL, WORDS, Quantity, registry, unit_of
from hpcclear.laws.numbers import evaluate, with_words
from hpcclear.laws.sources import HEAD
from hpcclear.laws.translate import LawError, written


def text_of_rate(objective: Objective) -> str:
    """The text of an objective's rate, as ``rate``: of a joint, None for one that is of the whole mechanism, and of direction
    and speed of the drive's body; it reads the other rates. A root mean square integrates its square.

    Raises LawError if it has more in it than arithmetic.
    """
    assert objective.rate is not None
    call = f"own_rate({', '.join(_READ[name][0] for name in arguments(objective.rate))})"
    parts = [
        HEAD.format(title=f"The rate of {objective.name}"),
        "from hpcclear.dynamics import layout as at\n",
        *written(objective.rate, "own_rate", "rate"),
        f"@lane_function\ndef joint_rate(work, par, joint, cosine, sine, speed, i, W):\n    own = {call}\n"
        f"    return own{' * own' if objective.made == 'rms' else ''}\n",
    ]
    return "\n\n".join(parts)


def _rate(row: str) -> str:
    return f"work[(at.RATE_NOW + {row}) * W + i]"


_READ: dict[str, tuple[str, float, float]] = {
    "gap": (_rate("joint.gap"), -3e-4, 1e-5),
    "depth": (f"no_less({_rate('joint.gap')}, 0.0)", 0.0, 1e-5),
    "gap_rate": (_rate("joint.rate"), -10.0, 10.0),
    "normal_force": (_rate("joint.force"), 0.0, 1e4),
    "friction_force": (_rate("joint.friction"), -1e3, 1e3),
    "sliding_speed": (_rate("joint.sliding_speed"), -10.0, 10.0),
    "direction_x": (_rate("joint.normal_x"), -1.0, 1.0),
    "direction_y": (_rate("joint.normal_y"), -1.0, 1.0),
    "drive_cosine": ("cosine", -1.0, 1.0),
    "drive_sine": ("sine", -1.0, 1.0),
    "drive_speed": ("speed", -500.0, 500.0),
    "drive_torque": (_rate("at.DRIVE_MOMENT"), -100.0, 100.0),
    "acceleration_x": (_rate("at.FOLLOWED_ACCELERATION"), -1e4, 1e4),
    "acceleration_y": (_rate("at.FOLLOWED_ACROSS"), -1e4, 1e4),
    **{
        name: (f"par[(joint.block + at.{name.upper()}) * W + i]", TYPICAL[name], TYPICAL[name])
        for name in ("clearance", "bearing_radius", "journal_radius")
    },
}
"""Where what an objective's rate requires stands, and between what numbers rates are tried."""


def check_objective(objective: Objective) -> None:
    """LawError unless an objective requires known quantities, is finite, and has its units."""
    if objective.rate is None and objective.value is None:
        raise LawError("has neither a rate nor a value", "Declare one of them, or both")
    if objective.made not in MADE:
        raise LawError(f"made is {objective.made!r}", f"Use one of: {', '.join(MADE)}")
    of_value = RECORDED | ({"rate": ""} if objective.rate else {})
    given = {"rate": OF_JOINTS | OF_ALL, "value": of_value}
    for title, known in given.items():
        function = getattr(objective, title)
        for name in () if function is None else arguments(function):
            if name not in known:
                reason = f"{title} uses {name!r}, which is not known"
                raise LawError(reason, f"There are {', '.join(sorted(known))}")
    numbers = {name: np.array([1.0, 2.0]) if FIELDS[name].per else 1.5 for name in RECORDED}
    if objective.rate is not None:
        text_of_rate(objective)
        numbers["rate"] = 1.5 if objective.whole else np.array([1.0, 2.0])
        _check_rate(objective)
    _check_value(objective, numbers)


def _check_rate(objective: Objective) -> None:
    """LawError unless the rate is finite, in flight as well, and what is made of it has its unit."""
    between = np.linspace(0.0, 1.0, 7)
    shares = np.array(np.meshgrid(between, between)).reshape(2, -1)
    rows = enumerate(_READ.items())
    given = {name: low + (high - low) * shares[k % 2] for k, (name, (_, low, high)) in rows}
    assert objective.rate is not None
    found = np.asarray(evaluate(objective.rate, given), float)
    if not np.isfinite(found).all():
        reason = "its rate is not finite everywhere: in flight depth and forces are 0, at rest speeds are"
        raise LawError(reason, "Mend the formula")
    units = OF_JOINTS | OF_ALL
    quantities = {name: registry().Quantity(0.1, units[name]) for name in arguments(objective.rate)}
    made = _with_unit(objective.rate, quantities, "rate")
    if objective.made == "revolution":
        made = made * registry().Quantity(1.0, "s")
    _fits(made, objective.unit_of_rate, f"what is made of its rate ({objective.made})")


def _check_value(objective: Objective, numbers: Mapping[str, object]) -> None:
    units = {**RECORDED, "rate": objective.unit_of_rate}
    if objective.value is None:
        _fits(registry().Quantity(1.0, objective.unit_of_rate), objective.unit, "its rate")
        return
    names = arguments(objective.value)
    try:
        found = float(objective.value(*(numbers[name] for name in names)))
    except Exception as error:  # noqa: BLE001 - of a function that nobody here wrote
        reason = f"its value raised {type(error).__name__}: {error}"
        raise LawError(reason, "Return one number") from None
    if not np.isfinite(found):
        raise LawError("its value is not finite", "Mend the formula")
    quantities = {name: registry().Quantity(numbers[name], units[name]) for name in names}
    made = _with_unit(objective.value, quantities, "value")
    if made is not None:
        _fits(made, objective.unit, "its value")


def _with_unit(
    function: Callable[..., object], given: Mapping[str, object], title: str
) -> Quantity:
    """A function of quantities; None where it is no arithmetic of these."""
    import pint

    words = {**WORDS, "float": lambda x: x, "max": max, "min": min}
    try:
        return with_words(function, words, {})(*given.values())
    except pint.DimensionalityError as error:
        raise LawError(f"{title} does not fit its units: {error}", "Mend the formula") from None
    except Exception:  # noqa: BLE001 - what NumPy knows of quantities has gaps
        return None


def _fits(found: Quantity, unit: str, what: str) -> None:
    try:
        expected = unit_of(unit, what).units
    except LawError:
        raise LawError(f"the unit {unit!r} is not known", "Write, say, N m") from None
    quantity = found if hasattr(found, "magnitude") else registry().Quantity(float(found), "")
    if not quantity.is_compatible_with(expected):
        own, said = f"{quantity.to_base_units().units:~P}", unit or "a plain number"
        reason = f"{what} is in {own}, and its unit says {said}"
        raise LawError(reason, "Mend the formula, or the unit")
