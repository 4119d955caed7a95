"""Parts of a law's functions that are the same at every instant of a sample: worked out once, however the law is written.

A quotient, a power or a call of such numbers becomes a number of the law, and dividing by one becomes multiplying by its
inverse; so does dividing by the impact speed, whose inverse the kernel keeps. What a law computes in ``once`` and what it
writes into its formula thus come to the same machine code.
"""

import ast
import inspect
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from types import FunctionType
from typing import Any, TypeVar

from hpcclear.laws.declared import LAW_NUMBERS, VARYING, Function, Law
from hpcclear.laws.formula import function_of
from hpcclear.laws.translate import LawError, definition_of

Own = TypeVar("Own", bound=Law)
COSTLY = (ast.Div, ast.Pow, ast.Call)
LONGEST_PART = 200
"""Nodes of a constant part that is written out for its name: names of names of names double at each step."""
IMPACT, INVERSE = "impact_speed", "inverse_impact_speed"


@cache
def with_constants(law: Own) -> Own:
    """The law with such parts in ``once``; itself where there are none, or more than it has rows for."""
    try:
        known: dict[tuple[str, int], str] = {}
        made = {name: _Parts(law.kind, name, one, known) for name, one in law.functions().items()}
    except (LawError, RecursionError):  # said where its text is written
        return law
    changed: dict[str, Any] = {name: one.function() for name, one in made.items() if one.changed}
    if not changed:
        return law
    kinks = [f"kink_{k}" for k in range(len(getattr(law, "kinks", ())))]
    if kinks:
        changed["kinks"] = tuple(changed.pop(k, made[k].own) for k in kinks)
    once = [one.once() for one in made.values() if one.constants]
    changed["once"] = (*law.worked_out(), *once)
    further = {name: "" for one in made.values() for name in one.constants.values()}
    found = replace(law, **changed, numbers={**law.numbers, **further})
    return found if len(found.read) <= LAW_NUMBERS else law


class _Parts(ast.NodeTransformer):
    """One function without its constant parts, and these; `known`: names of those of the functions before."""

    def __init__(
        self, kind: str, title: str, own: Function, known: dict[tuple[str, int], str]
    ) -> None:
        self.own, self.title, self.known, self.constants = own, title, known, dict[str, str]()
        self.tree = definition_of(own)
        self.arguments = [one.arg for one in self.tree.args.args]
        self.stored = [one.id for one in _words(self.tree) if isinstance(one.ctx, ast.Store)]
        self.fixed = {*self.arguments} - VARYING[kind].keys() - {*self.stored}
        self.locals = dict[str, ast.expr]()
        divisions = _count(self.tree)
        body = [_Short(own).visit(one) for one in self.tree.body]
        self.tree.body = [self.visit(one) for one in body if not self._names(one)]
        self.changed = bool(self.constants) or _count(self.tree) != divisions

    def _names(self, one: ast.stmt) -> bool:
        """Whether a statement only names a constant part; it is written out where the name stands."""
        match one:
            case ast.Assign(targets=[ast.Name(id=name)], value=value):
                value = _Named(self.locals).visit(value)
                short = sum(1 for _ in ast.walk(value)) <= LONGEST_PART
                if self.stored.count(name) == 1 and short and self._constant(value):
                    self.locals[name] = value
                    return True
        return False

    def _constant(self, node: ast.AST) -> bool:
        names = {one.id for one in _words(node)}
        varying = {*self.arguments, *self.stored} - self.fixed
        return bool(names & self.fixed) and not names & varying

    def visit(self, node: ast.AST) -> Any:
        """A node with numbers for its constant parts."""
        if isinstance(node, ast.Name) and node.id in self.locals:
            node = self.locals[node.id]
        if not isinstance(node, ast.expr):
            return self.generic_visit(node)
        node = _Named(self.locals).visit(node)
        if self._constant(node) and any(isinstance(one, COSTLY) for one in ast.walk(node)):
            return self._number(ast.unparse(node))
        match node:
            case ast.BinOp(left=left, op=ast.Div(), right=ast.Name(id=name)) if (
                name == IMPACT and name not in self.stored
            ):
                inverse: ast.expr = ast.Name(INVERSE, ast.Load())
            case ast.BinOp(left=left, op=ast.Div(), right=right) if self._constant(right):
                inverse = self._number(f"1.0 / ({ast.unparse(right)})")
            case _:
                return self.generic_visit(node)
        return ast.BinOp(self.visit(left), ast.Mult(), inverse)

    def _number(self, text: str) -> ast.Name:
        words = {one.id for one in _words(ast.parse(text))}
        where = 0 if words <= self.fixed else id(self.own.__globals__)
        name = self.known.setdefault((text, where), f"once_{len(self.known)}")
        self.constants[text] = name
        return ast.Name(name, ast.Load())

    def _made(self, name: str, names: list[str], body: str) -> Function:
        """A function of the same surroundings."""
        around = {**self.own.__globals__, **inspect.getclosurevars(self.own).nonlocals}
        around.pop("__name__", None)  # its lines are in no module
        return function_of(f"def {name}({', '.join(names)}):\n{body}\n", name, around)

    def function(self) -> Function:
        body = "\n".join(ast.unparse(ast.fix_missing_locations(one)) for one in self.tree.body)
        used = {one.id for one in _words(ast.parse(body))}
        names = dict.fromkeys([*self.arguments, INVERSE, *self.constants.values()])
        indented = "".join(f"    {line}\n" for line in body.splitlines())
        return self._made(self.title, [one for one in names if one in used], indented)

    def once(self) -> Function:
        used = {one.id for text in self.constants for one in _words(ast.parse(text))}
        items = ", ".join(f"{name!r}: {text}" for text, name in self.constants.items())
        names = [one for one in self.arguments if one in used]
        return self._made(f"once_{self.title}", names, f"    return {{{items}}}")


def _words(tree: ast.AST) -> Iterator[ast.Name]:
    return (one for one in ast.walk(tree) if isinstance(one, ast.Name))


def _count(tree: ast.AST) -> int:
    return sum(isinstance(one, ast.Div) for one in ast.walk(tree))


class _Short(ast.NodeTransformer):
    """Writes out calls of other functions that are one formula of what is known here."""

    def __init__(self, own: Function) -> None:
        self.around = own.__globals__

    def visit_Call(self, node: ast.Call) -> ast.expr:
        called = self.around.get(node.func.id) if isinstance(node.func, ast.Name) else None
        simple = all(isinstance(one, ast.Name | ast.Constant) for one in node.args)
        if isinstance(called, FunctionType) and simple and not node.keywords:
            tree = definition_of(called)
            own = [one.arg for one in tree.args.args]
            match [one for one in tree.body if not isinstance(one, ast.Expr)]:
                case [ast.Return(value=ast.expr() as value)] if len(own) == len(node.args):
                    free = {one.id for one in _words(value)} - {*own}
                    if all(self.around.get(k) is called.__globals__.get(k) for k in free):
                        given = dict(zip(own, node.args, strict=True))
                        return _Named(given).visit(value)
        self.generic_visit(node)
        return node


class _Named(ast.NodeTransformer):
    """Writes values for the names that stand for them."""

    def __init__(self, values: dict[str, ast.expr]) -> None:
        self.values = values

    def visit_Name(self, node: ast.Name) -> ast.expr:
        return self.values.get(node.id, node)
