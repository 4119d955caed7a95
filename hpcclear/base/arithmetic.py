"""Formulas in scenes: the one reader of arithmetic that is written as text.

Python's parser reads a text, and nothing of it is run: parts made of numbers alone are folded here as floats, so a formula of
bounded length takes a bounded time, whatever stands in it. What is left holds names, finite floats and calls of known words.
"""

import ast
import math
import operator
from collections.abc import Callable, Collection, Mapping
from functools import lru_cache

import numpy as np

from hpcclear.base.arrays import Array

LONGEST = 200
"""Characters of a formula of design variables."""
MOST_POWER = 9.0
"""Of a variable in such a formula, and in a law."""
DEEPEST = 60
"""Levels of a formula: whatever visits it later calls itself a few times for each."""

LONGEST_SHOWN = 60
"""Characters of a part of a formula in a message."""

_SIGNS: dict[type[ast.AST], Callable[[float, float], float]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv, ast.Pow: math.pow,
}  # fmt: skip
_FUNCTIONS: dict[str, Callable[..., float]] = {
    "sqrt": math.sqrt, "exp": math.exp, "log": math.log, "tanh": math.tanh, "atan": math.atan, "abs": abs,
    "copysign": math.copysign, "min": min, "max": max, "pow": math.pow,
}  # fmt: skip
SAME = {
    "arctan": "atan", "fabs": "abs", "absolute": "abs", "minimum": "min", "maximum": "max", "power": "pow",
}  # fmt: skip
"""NumPy's words for Python's."""

WORDS = (*_FUNCTIONS, *SAME)
"""Functions that a formula may call, if any."""


class FormulaError(ValueError):
    """A formula, or a law's function, has more in it than it may have, or a fault; `remedy` says what to do."""

    def __init__(self, reason: str, remedy: str = "Write arithmetic of numbers alone") -> None:
        self.reason, self.remedy = reason, remedy
        super().__init__(reason)


def count_of(word: str) -> int:
    """How many numbers a word takes."""
    return 2 if SAME.get(word, word) in ("copysign", "min", "max", "pow") else 1


def check_count(word: str, given: int) -> None:
    """Raise FormulaError unless a word is given as many numbers as it takes."""
    if given != count_of(word):
        numbers = "one number" if count_of(word) == 1 else "two numbers"
        remedy = f"Nest it: {word}(a, {word}(b, c))" if given > 2 else f"Give {numbers}"
        raise FormulaError(f"calls {word} with {given} numbers, which takes {numbers}", remedy)


def read(text: str, most: int, words: Collection[str] = (), example: str = "m2 + m3") -> ast.expr:
    """Read a formula: its names are no words, its numbers are finite, and no operation is left between two numbers.

    It is Python's arithmetic, ``+ - * / **``; where there are `words`, calls of these, comparisons, ``and``, ``or``, ``not``
    and ``a if c else b`` besides. `example`: a formula, for messages. Raises FormulaError if it is none, is too long or
    nested too deeply, or a part of numbers alone has no finite value.
    """
    if len(text) > most:
        raise FormulaError(f"has more than {most} characters", "Shorten it")
    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise FormulaError("cannot be read as a formula", f'Write, say, "{example}"') from None
    level: list[ast.AST] = [tree]
    for _ in range(DEEPEST):
        level = [inner for node in level for inner in ast.iter_child_nodes(node)]
    if level:
        raise FormulaError(f"is nested more than {DEEPEST} levels deep", "Split it into parts")
    return _Reader(frozenset(words), example).number(tree)


class _Reader:
    """Checks a tree, and folds what is made of numbers alone."""

    def __init__(self, words: frozenset[str], example: str) -> None:
        self.words, self.example = words, example

    def number(self, node: ast.expr) -> ast.expr:
        match node:
            case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
                return folded(node, lambda: float(value))
            case ast.Name(id=name) if name not in self.words:
                return node
            case ast.UnaryOp(op=ast.USub() | ast.UAdd() as sign, operand=inner):
                made = self.number(inner)
                if isinstance(sign, ast.UAdd):
                    return made
                known = number_of(made)
                return ast.UnaryOp(sign, made) if known is None else constant(-known)
            case ast.BinOp(left=left, op=op, right=right) if type(op) in _SIGNS:
                return fold(ast.BinOp(self.number(left), op, self.number(right)), node)
            case ast.IfExp(test=test, body=yes, orelse=no) if self.words:
                return ast.IfExp(self.condition(test), self.number(yes), self.number(no))
            case ast.Call(func=ast.Name(id=word), args=given, keywords=[]) if word in self.words:
                check_count(word, len(given))
                word = SAME.get(word, word)
                numbers = [self.number(one) for one in given]
                made = ast.Call(ast.Name(word, ast.Load()), numbers, [])
                values = [number_of(one) for one in numbers]
                if None in values:
                    return made
                return folded(node, lambda: _FUNCTIONS[word](*values))
            case ast.Call(func=called) if self.words:
                listed = ", ".join(one for one in WORDS if one in self.words)
                raise FormulaError(f"calls {_shown(called)}", f"Use one of: {listed}")
            case ast.Compare() | ast.BoolOp() | ast.UnaryOp(op=ast.Not()) if self.words:
                reason = f"has the condition {_shown(node)} where a number is expected"
                raise FormulaError(reason, "Write (a if condition else b)")
        allowed = "arithmetic" if self.words else "numbers, variables and + - * / **"
        remedy = f'Write, say, "{self.example}"'
        raise FormulaError(f"contains more than {allowed}: {_shown(node)}", remedy)

    def condition(self, node: ast.expr) -> ast.expr:
        match node:
            case ast.Compare(left=left, ops=ops, comparators=others):
                if any(isinstance(op, ast.Is | ast.IsNot | ast.In | ast.NotIn) for op in ops):
                    raise FormulaError(f"compares in another way than by size: {_shown(node)}")
                sides = [self.number(one) for one in (left, *others)]
                return ast.Compare(sides[0], ops, sides[1:])
            case ast.BoolOp(op=op, values=values):
                return ast.BoolOp(op, [self.condition(one) for one in values])
            case ast.UnaryOp(op=ast.Not(), operand=inner):
                return ast.UnaryOp(ast.Not(), self.condition(inner))
        raise FormulaError(f"has {_shown(node)} for a condition", "Compare two numbers: d > 0")


@lru_cache(maxsize=64)
def _of_variables(text: str) -> ast.expr:
    tree = read(text, LONGEST)
    for node in ast.walk(tree):
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow):
            power = number_of(node.right)
            if power is None or not 0 <= power <= MOST_POWER:
                raise FormulaError(f"has a power that is not a number from 0 to {MOST_POWER:g}")
    return tree


def names_in(text: str) -> tuple[str, ...]:
    """Variables of a formula such as "m2 + m3", in the order in which they come; raises FormulaError."""
    nodes = [node for node in ast.walk(_of_variables(text)) if isinstance(node, ast.Name)]
    nodes.sort(key=lambda one: (one.lineno, one.col_offset))
    return tuple(dict.fromkeys(one.id for one in nodes))


def divisors(text: str) -> list[str]:
    """What a formula that `names_in` let through divides by."""
    nodes = [node for node in ast.walk(_of_variables(text)) if isinstance(node, ast.BinOp)]
    return [ast.unparse(node.right) for node in nodes if isinstance(node.op, ast.Div)]


def value_of(text: str, variables: Mapping[str, Array | float]) -> Array:
    """A formula that `names_in` let through, of variables that are numbers or arrays of one shape; NaN where it has no finite
    real value."""
    operators = {**_SIGNS, ast.Pow: operator.pow}  # of arrays

    def made(node: ast.expr) -> Array | float:
        match node:
            case ast.Name():
                return np.asarray(variables[node.id], dtype=np.float64)
            case ast.Constant(value=float() as number):
                return number
            case ast.UnaryOp():
                return -made(node.operand)
            case ast.BinOp():
                return operators[type(node.op)](made(node.left), made(node.right))
        raise FormulaError("was not checked")

    with np.errstate(all="ignore"):
        found = np.asarray(made(_of_variables(text)), dtype=np.float64)
    return np.where(np.isfinite(found), found, np.nan)


def number_of(node: ast.expr) -> float | None:
    """The value of a number, with its sign: None for anything else, infinity where no float holds it."""
    match node:
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
            try:
                return float(value)
            except OverflowError:
                return math.inf
        case ast.UnaryOp(op=ast.USub(), operand=ast.Constant() as inner):
            size = number_of(inner)
            return None if size is None else -size
    return None


def constant_of(node: ast.expr, named: Callable[[str], object]) -> float | None:
    """The value of a part of numbers, and names that `named` knows, else None. Raises FormulaError where it is not finite."""
    match node:
        case ast.BinOp(left=left, right=right) if type(node.op) in _SIGNS:
            sides = [constant_of(one, named) for one in (left, right)]
            if None in sides:
                return None
            first, second = (constant(one) for one in sides if one is not None)
            return number_of(fold(ast.BinOp(first, node.op, second), node))
        case ast.UnaryOp(op=ast.USub() | ast.UAdd() as sign, operand=inner):
            value = constant_of(inner, named)
            return -value if value is not None and isinstance(sign, ast.USub) else value
        case ast.Name(id=name):
            return number_of(ast.Constant(named(name)))  # type: ignore[arg-type]
    return number_of(node)


def constant(value: float) -> ast.expr:
    """A float as a number without sign, and the sign before it."""
    made = ast.Constant(abs(value))
    return ast.UnaryOp(ast.USub(), made) if math.copysign(1.0, value) < 0.0 else made


def fold(node: ast.BinOp, written: ast.expr) -> ast.expr:
    """The number of an operation on two numbers, else the operation. Raises FormulaError of `written` if it is not finite."""
    left, right = number_of(node.left), number_of(node.right)
    if isinstance(node.op, ast.Div) and right == 0.0:
        raise FormulaError(f"divides by zero: {_shown(written)}", "Correct it")
    if left is None or right is None:
        return node
    return folded(written, lambda: _SIGNS[type(node.op)](left, right))


def folded(node: ast.expr, made: Callable[[], float]) -> ast.expr:
    """The number that `made` returns for a part of a formula; raises FormulaError where it is not finite."""
    try:
        value = made()
    except OverflowError:
        value = math.inf
    except ValueError:  # such as the root of a negative number
        value = math.nan
    if math.isinf(value):
        raise FormulaError(f"has a number too large: {_shown(node)}", "Write one below 1.8e308")
    if math.isnan(value):
        raise FormulaError(f"has a part without a real value: {_shown(node)}", "Correct it")
    return constant(value)


def _shown(node: ast.expr) -> str:
    try:
        text = repr(ast.unparse(node))
    except ValueError:  # of a whole number of more digits than Python prints
        return "a number of very many digits"
    return text if len(text) <= LONGEST_SHOWN else text[: LONGEST_SHOWN - 4] + " ...'"
