"""A law that is a formula in the scene: read by Python's parser, which lets arithmetic through alone, and made a function."""

import ast
import hashlib
import linecache
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

from hpcclear.dynamics.laws.declared import JOINT, VARYING, ContactLaw, FrictionLaw, Law, Parameter
from hpcclear.dynamics.laws.translate import WORDS, LawError

LONGEST = 500

SHORT = {
    "contact": {"d": "depth", "v": "rate", "v0": "impact_speed", "K": "stiffness"},
    "friction": {"v": "speed", "F": "force"},
}
"""Short names that a formula may use, by the kind of law, for what they stand for."""

_LET_THROUGH = (
    ast.Expression, ast.BinOp, ast.UnaryOp, ast.Compare, ast.IfExp, ast.BoolOp, ast.Call, ast.Name, ast.Load, ast.Constant,
    ast.operator, ast.unaryop, ast.cmpop, ast.boolop,
)  # fmt: skip


def law_of(kind: str, formula: str, units: Mapping[str, str]) -> Law:
    """The law of a formula, whose parameters have these units.

    Raises
    ------
    LawError
        If it is none.
    """
    return _made(kind, formula, tuple(units.items()))


@lru_cache(maxsize=64)
def _made(kind: str, formula: str, units: tuple[tuple[str, str], ...]) -> Law:
    short = SHORT[kind]
    parameters = tuple(Parameter(name, unit, "a parameter of the formula") for name, unit in units)
    entry = "force" if kind == "contact" else "ratio"
    known = {name: name for name in (*VARYING[kind], *JOINT)} | short
    known |= {name: name for name, _ in units}
    tree = _parsed(formula)
    used: list[str] = []
    for node in ast.walk(tree):
        if not isinstance(node, _LET_THROUGH):
            raise LawError(f"contains more than arithmetic: {ast.unparse(node)!r}")
        if isinstance(node, ast.Call):
            if not (isinstance(node.func, ast.Name) and node.func.id in WORDS) or node.keywords:
                raise LawError(
                    f"calls {ast.unparse(node.func)!r}", f"Use one of: {', '.join(WORDS)}"
                )
        elif isinstance(node, ast.Name) and node.id not in WORDS:
            if node.id not in known:
                others = ", ".join(sorted({*short, *JOINT}))
                raise LawError(
                    f"contains {node.id!r}, which is not a parameter",
                    f'Give it a unit, units = {{ {node.id} = "m" }}, and a value; known are {others}',
                )
            node.id = known[node.id]
            used.append(node.id)
    names = list(dict.fromkeys(used))
    text = f"from math import *\n\n\ndef {entry}({', '.join(names)}):\n    return {ast.unparse(tree)}\n"
    function = function_of(text, entry)
    named: dict[str, Any] = {
        "name": "expression",
        "words": "a formula in the scene",
        "formula": formula,
    }
    if kind == "contact":
        return ContactLaw(**named, parameters=parameters, force=function)
    return FrictionLaw(**named, parameters=parameters, ratio=function)


def _parsed(formula: str) -> ast.Expression:
    if len(formula) > LONGEST:
        raise LawError(f"has more than {LONGEST} characters", "Write the law in a file")
    try:
        return ast.parse(formula.strip(), mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise LawError(
            "cannot be read as a formula", 'Write, say, "K * d**1.5 * (1 + b * v)"'
        ) from None


def function_of(text: str, name: str, around: Mapping[str, Any] | None = None) -> Any:
    """The function `name` of a text, whose lines `inspect` finds; `around`: what it may use."""
    path = f"<formula {hashlib.sha256(text.encode()).hexdigest()[:12]}>"
    linecache.cache[path] = (len(text), None, text.splitlines(keepends=True), path)
    names: dict[str, Any] = {**(around or {})}
    exec(compile(text, path, "exec"), names)
    return names[name]
