"""What the writer knows of a value, of a call and of a function's definition."""

import ast
import builtins
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Known:
    """A value that is known when the text is written, and the module and name it comes from."""

    value: Any
    source: tuple[str, str] | None = None


@dataclass(frozen=True)
class Parts:
    """A tuple whose parts are followed one by one; of a named tuple, its class."""

    items: tuple[Any, ...]
    maker: Known | None = None


Value = Known | Parts | ast.expr
"""What an expression stands for: known, a tuple of such, or text."""


@dataclass
class Scope:
    """One call being written out: its names, and how often each is assigned."""

    names: dict[str, Any]  # the function's globals
    module: str
    assigned: Counter[str]
    values: dict[str, Any] = field(default_factory=dict)
    local: dict[str, str] = field(default_factory=dict)


@cache
def _definitions(path: str) -> dict[str, ast.FunctionDef]:
    """Functions at the top of a file."""
    tree = ast.parse(Path(path).read_text(encoding="utf-8"))
    return {node.name: node for node in tree.body if isinstance(node, ast.FunctionDef)}


def definition_of(function: Any) -> ast.FunctionDef:
    """The syntax tree of a function at the top of its module (compiled or not)."""
    function = getattr(function, "py_func", function)
    return _definitions(function.__code__.co_filename)[function.__name__]


def assignments(node: ast.FunctionDef) -> Counter[str]:
    """How often each name is bound."""
    found = (n for n in ast.walk(node) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store))
    return Counter(n.id for n in found)


def returns_in(statements: Iterable[ast.stmt]) -> bool:
    """Whether a return stands in any of them."""
    return any(isinstance(n, ast.Return) for s in statements for n in ast.walk(s))


def tail_form(body: list[ast.stmt]) -> list[ast.stmt]:
    """The same statements with every return at the end of a branch: what follows an early one goes into the other branch."""
    for k, statement in enumerate(body):
        if isinstance(statement, ast.If) and returns_in([statement]):
            rest = body[k + 1 :]
            yes, no = statement.body, statement.orelse
            yes = yes if _always_returns(yes) else yes + rest
            no = no if _always_returns(no) else no + rest
            new = ast.If(statement.test, tail_form(yes), tail_form(no))
            return [*body[:k], new]
    return body


def _always_returns(body: list[ast.stmt]) -> bool:
    if not body:
        return False
    last = body[-1]
    if isinstance(last, ast.If):
        return _always_returns(last.body) and _always_returns(last.orelse)
    return isinstance(last, ast.Return)


def can_be_written(node: ast.FunctionDef) -> bool:
    """Whether no return stands inside a loop."""
    loops = (n for n in ast.walk(node) if isinstance(n, ast.For | ast.While))
    return not any(returns_in(loop.body) for loop in loops)


@dataclass
class Module:
    """What the functions of a text share."""

    used: set[str] = field(default_factory=lambda: set(dir(builtins)))
    imports: dict[tuple[str, str], str] = field(default_factory=dict)
    names: dict[tuple[Any, str], str] = field(default_factory=dict)  # of functions beside the first
    functions: list[tuple[ast.FunctionDef, str]] = field(default_factory=list)
