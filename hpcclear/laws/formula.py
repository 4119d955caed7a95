"""A law that is a formula in the scene, made a function."""

import ast
import hashlib
from collections.abc import Mapping
from fractions import Fraction
from functools import lru_cache
from typing import Any

from hpcclear.base.arithmetic import WORDS, read
from hpcclear.base.generated import run_text
from hpcclear.base.unit_names import dimensions
from hpcclear.laws.declared import JOINT, VARYING, ContactLaw, FrictionLaw, Function, Law, Parameter
from hpcclear.laws.translate import LawError

LONGEST = 500

SHORT = {
    "contact": {"d": "depth", "v": "rate", "v0": "impact_speed", "K": "stiffness"},
    "friction": {"v": "speed", "F": "force"},
}
"""Short names that a formula may use, by the kind of law, for what they stand for."""


@lru_cache(maxsize=64)
def law_of(kind: str, formula: str, units: tuple[tuple[str, str], ...]) -> Law:
    """The law of a formula; `units`: its parameters, each with its unit. Raises LawError if it is none."""
    short = SHORT[kind]
    parameters = tuple(Parameter(name, unit, "a parameter of the formula") for name, unit in units)
    entry = "force" if kind == "contact" else "ratio"
    known = {name: name for name in (*VARYING[kind], *JOINT)} | short
    for name, unit in units:
        if name in WORDS or name in known:
            reason = f"the parameter {name!r} has a name that formulas use"
            raise LawError(reason, "Give it another name")
        _check_si(name, unit)
    known |= {name: name for name, _ in units}
    tree = read(formula, LONGEST, WORDS, "K * d**1.5 * (1 + b * v)")
    called = {id(one.func) for one in ast.walk(tree) if isinstance(one, ast.Call)}
    used: list[str] = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and id(node) not in called:
            if node.id not in known:
                others = ", ".join(sorted({*short, *JOINT}))
                unit = f'Give it a unit, units = {{ {node.id} = "m" }}, and a value'
                reason = f"contains {node.id!r}, which is not a parameter"
                raise LawError(reason, f"{unit}; known are {others}")
            node.id = known[node.id]
            used.append(node.id)
    names = list(dict.fromkeys(used))
    text = f"from math import *\n\n\ndef {entry}({', '.join(names)}):\n    return {ast.unparse(tree)}\n"
    function = function_of(text, entry)
    maker: Any = ContactLaw if kind == "contact" else FrictionLaw
    named = {"name": "expression", "words": "a formula in the scene", entry: function}
    return maker(formula=formula, parameters=parameters, **named)


def _check_si(name: str, unit: str) -> None:
    """LawError if a unit is known and not of the SI: a formula takes its numbers as they are."""
    try:
        size, powers = dimensions(unit)
    except ValueError:
        return  # said of all laws alike
    if size != Fraction(1000) ** powers.get("gram", Fraction(0)):
        reason = f"the unit {unit!r} of {name} is not an SI unit, in which a formula is computed"
        raise LawError(reason, f'Write, say, "s/m"; the value of {name} may have any unit')


def function_of(text: str, name: str, around: Mapping[str, object] | None = None) -> Function:
    """The function `name` of a text, whose lines `inspect` finds; `around`: what it may use."""
    path = f"<formula {hashlib.sha256(text.encode()).hexdigest()[:12]}>"
    names: dict[str, Any] = {**(around or {})}
    run_text(text, path, names)
    return names[name]
