"""Formulas of design variables, such as "m2 + m3"."""

import ast
import operator
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from hpcclear.base.arithmetic import FormulaError as FormulaError
from hpcclear.base.arithmetic import number_of, read
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


@lru_cache(maxsize=64)
def _parsed(text: str) -> ast.expr:
    tree = read(text, LONGEST)
    for node in ast.walk(tree):
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow):
            power = number_of(node.right)
            if power is None or not 0 <= power <= MOST_POWER:
                reason = f"has a power that is not a number from 0 to {MOST_POWER:g}"
                raise FormulaError(reason)
    return tree


def names_in(text: str) -> tuple[str, ...]:
    """Variables of a formula, in the order in which they come; raises FormulaError."""
    nodes = [node for node in ast.walk(_parsed(text)) if isinstance(node, ast.Name)]
    nodes.sort(key=lambda one: (one.lineno, one.col_offset))
    return tuple(dict.fromkeys(one.id for one in nodes))


def value_of(text: str, variables: Mapping[str, Array | float]) -> Array:
    """A formula that `names_in` let through, of variables that are numbers or arrays of one shape."""

    def made(node: ast.expr) -> Any:
        match node:
            case ast.Name():
                return variables[node.id]
            case ast.Constant():
                return node.value
            case ast.UnaryOp():
                return -made(node.operand)
            case ast.BinOp():
                return _TWO[type(node.op)](made(node.left), made(node.right))
        raise FormulaError("was not checked")

    with np.errstate(all="ignore"):  # what comes to no number is seen by who asked
        return np.asarray(made(_parsed(text)), dtype=np.float64)
