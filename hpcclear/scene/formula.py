"""Formulas of design variables, such as "m2 + m3": read by Python's own parser, of which only arithmetic is let through."""

import ast
import operator
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from hpcclear.base.arrays import Array

LONGEST = 200
MOST_POWER = 9.0

_TWO: Mapping[type[ast.AST], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}


class FormulaError(ValueError):
    """A text that is no formula; the message says why."""


@lru_cache(maxsize=64)
def _parsed(text: str) -> ast.expr:
    if len(text) > LONGEST:
        raise FormulaError(f"has more than {LONGEST} characters")
    try:
        return ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise FormulaError("cannot be read as a formula") from None


def names_in(text: str) -> tuple[str, ...]:
    """Variables of a formula, in the order in which they come; raises FormulaError."""
    found: list[str] = []

    def walk(node: ast.expr) -> None:
        match node:
            case ast.Name():
                found.append(node.id)
            case ast.Constant(value=int() | float() as number) if not isinstance(number, bool):
                if not np.isfinite(float(number)):
                    raise FormulaError("has a number that is not finite")
            case ast.UnaryOp(op=ast.USub() | ast.UAdd()):
                walk(node.operand)
            case ast.BinOp(op=ast.Pow()):
                power = node.right
                if not (
                    isinstance(power, ast.Constant)
                    and isinstance(power.value, int | float)
                    and 0 <= power.value <= MOST_POWER
                ):
                    raise FormulaError(f"has a power that is not a number from 0 to {MOST_POWER:g}")
                walk(node.left)
            case ast.BinOp() if type(node.op) in _TWO:
                walk(node.left)
                walk(node.right)
            case _:
                raise FormulaError("contains more than numbers, variables and + - * / **")

    try:
        walk(_parsed(text))
    except (OverflowError, RecursionError):
        raise FormulaError("has a number that is too large or is nested too deeply") from None
    return tuple(dict.fromkeys(found))


def value_of(text: str, variables: Mapping[str, Array | float]) -> Array:
    """A formula that `names_in` let through, of variables that are numbers or arrays of one shape."""

    def made(node: ast.expr) -> Any:
        match node:
            case ast.Name():
                return variables[node.id]
            case ast.Constant():
                return float(node.value)  # type: ignore[arg-type]
            case ast.UnaryOp():
                return -made(node.operand) if isinstance(node.op, ast.USub) else made(node.operand)
            case ast.BinOp():
                return _TWO[type(node.op)](made(node.left), made(node.right))
        raise FormulaError("was not checked")

    with np.errstate(all="ignore"):  # what comes to no number is seen by who asked
        return np.asarray(made(_parsed(text)), dtype=np.float64)
