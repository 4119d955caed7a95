"""One text of many functions: calls are written out where they stand, before anything is compiled.

Numba compiles every function on its own, and again wherever it is inlined: a stepper of a hundred lane functions took 25 s,
its text written out takes four. What is known beforehand (which effects are on, how many lanes) is put in, and branches that it
decides are dropped, so the text holds what is on and nothing else. It is a file of plain Python beside Numba's cache, to be
read; a second process imports it as it is.

Only functions that `lane_function` or `scalar_function` has marked are written out, each kind in a text of its own: the two
are compiled with different rules of arithmetic.
"""

import ast
import builtins
import copy
import hashlib
import importlib
import math
import operator
import os
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numba import config

from hpcclear.base.alike import written_once
from hpcclear.base.jit import source_key, stands_apart, written_kind

_OPERATORS: dict[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv, ast.Mod: operator.mod, ast.Pow: operator.pow,
    ast.USub: operator.neg, ast.Not: operator.not_, ast.BitOr: operator.or_, ast.BitAnd: operator.and_,
    ast.Eq: operator.eq, ast.NotEq: operator.ne, ast.Lt: operator.lt, ast.LtE: operator.le,
    ast.Gt: operator.gt, ast.GtE: operator.ge, ast.Is: operator.is_, ast.IsNot: operator.is_not,
}  # fmt: skip
_FOLDED = (len, int, min, max, abs, getattr)


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
class _Scope:
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


def _assignments(node: ast.FunctionDef) -> Counter[str]:
    """How often each name is bound."""
    found = (n for n in ast.walk(node) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store))
    return Counter(n.id for n in found)


def _returns(statements: Iterable[ast.stmt]) -> bool:
    return any(isinstance(n, ast.Return) for s in statements for n in ast.walk(s))


def _tail_form(body: list[ast.stmt]) -> list[ast.stmt]:
    """The same statements with every return at the end of a branch: what follows an early one goes into the other branch."""
    for k, statement in enumerate(body):
        if isinstance(statement, ast.If) and _returns([statement]):
            rest = body[k + 1 :]
            yes, no = statement.body, statement.orelse
            yes = yes if _always_returns(yes) else yes + rest
            no = no if _always_returns(no) else no + rest
            new = ast.If(statement.test, _tail_form(yes), _tail_form(no))
            return [*body[:k], new]
    return body


def _always_returns(body: list[ast.stmt]) -> bool:
    if not body:
        return False
    last = body[-1]
    if isinstance(last, ast.If):
        return _always_returns(last.body) and _always_returns(last.orelse)
    return isinstance(last, ast.Return)


def _can_be_written(node: ast.FunctionDef) -> bool:
    """Whether no return stands inside a loop."""
    loops = (n for n in ast.walk(node) if isinstance(n, ast.For | ast.While))
    return not any(_returns(loop.body) for loop in loops)


@dataclass
class _Module:
    """What the functions of a text share."""

    used: set[str] = field(default_factory=lambda: set(dir(builtins)))
    imports: dict[tuple[str, str], str] = field(default_factory=dict)
    names: dict[tuple[Any, str], str] = field(default_factory=dict)  # of functions beside the first
    functions: list[tuple[ast.FunctionDef, str]] = field(default_factory=list)


class _Writer:
    """Writes one function."""

    def __init__(self, kind: str, shared: _Module) -> None:
        self.kind = kind
        self.shared = shared
        self.stable: set[str] = set()
        self.block: list[ast.stmt] = []
        self.guarded = 0

    # ---- names ----------------------------------------------------------------------------------

    def unique(self, base: str) -> str:
        name, k = base, 1
        while name in self.shared.used:
            k += 1
            name = f"{base}_{k}"
        self.shared.used.add(name)
        return name

    def put(self, value: Value, base: str = "t") -> ast.expr:
        """Give an expression a name of its own."""
        name = self.unique(base)
        self.emit(ast.Assign([ast.Name(name, ast.Store())], self.text(value)))
        self.stable.add(name)
        return ast.Name(name, ast.Load())

    def settled(self, value: Value, base: str = "t") -> Value:
        """The same value as names that will not change."""
        if isinstance(value, Known):
            return value
        if isinstance(value, Parts):
            return Parts(tuple(self.settled(item, base) for item in value.items), value.maker)
        if isinstance(value, ast.Constant):
            return value
        if isinstance(value, ast.Name) and value.id in self.stable:
            return value
        return self.put(value, base)

    def emit(self, statement: ast.stmt) -> None:
        self.block.append(statement)

    def inside(self, work: Callable[[], Any]) -> tuple[list[ast.stmt], Any]:
        """What `work` emits, and what it returns."""
        outer, self.block = self.block, []
        try:
            result = work()
            return self.block, result
        finally:
            self.block = outer

    # ---- values to text -------------------------------------------------------------------------

    def text(self, value: Value) -> ast.expr:
        if isinstance(value, ast.expr):
            return value
        if isinstance(value, Parts):
            items = [self.text(item) for item in value.items]
            if value.maker is None:
                return ast.Tuple(items, ast.Load())
            return ast.Call(self.text(value.maker), items, [])
        constant = value.value
        if isinstance(constant, np.generic):
            constant = constant.item()
        plain = constant is None or isinstance(constant, bool | int | str)
        if plain or (isinstance(constant, float) and math.isfinite(constant)):
            return ast.Constant(constant)
        if value.source is None:
            if type(constant) is tuple:
                return ast.Tuple([self.text(Known(item)) for item in constant], ast.Load())
            raise TypeError(f"{constant!r} comes from no module and cannot be written down")
        if value.source[0] == "builtins":
            return ast.Name(value.source[1], ast.Load())
        if value.source not in self.shared.imports:
            self.shared.imports[value.source] = self.unique(value.source[1].lstrip("_"))
        return ast.Name(self.shared.imports[value.source], ast.Load())

    # ---- expressions ----------------------------------------------------------------------------

    def expression(self, node: ast.expr, scope: _Scope) -> Value:
        return getattr(self, f"on_{type(node).__name__}")(node, scope)  # type: ignore[no-any-return]

    def on_Constant(self, node: ast.Constant, scope: _Scope) -> Value:
        return Known(node.value)

    def on_Name(self, node: ast.Name, scope: _Scope) -> Value:
        if node.id in scope.values:
            return scope.values[node.id]  # type: ignore[no-any-return]
        if node.id in scope.names:
            return Known(scope.names[node.id], (scope.module, node.id))
        return Known(getattr(builtins, node.id), ("builtins", node.id))

    def on_Attribute(self, node: ast.Attribute, scope: _Scope) -> Value:
        owner = self.expression(node.value, scope)
        if isinstance(owner, Known):
            inside = isinstance(owner.value, ModuleType)
            source = (owner.value.__name__, node.attr) if inside else None
            return Known(getattr(owner.value, node.attr), source)
        if isinstance(owner, Parts):
            assert owner.maker is not None
            return owner.items[owner.maker.value._fields.index(node.attr)]  # type: ignore[no-any-return]
        return ast.Attribute(self.text(owner), node.attr, ast.Load())

    def on_Subscript(self, node: ast.Subscript, scope: _Scope) -> Value:
        owner = self.expression(node.value, scope)
        if isinstance(owner, dict):
            return owner[self.expression(node.slice, scope).value]  # type: ignore[union-attr, no-any-return]
        index = self.expression(node.slice, scope)
        if isinstance(index, Known):
            if isinstance(owner, Known):
                return Known(owner.value[index.value])
            if isinstance(owner, Parts):
                return owner.items[index.value]  # type: ignore[no-any-return]
        return ast.Subscript(self.text(owner), self.text(index), ast.Load())

    def on_Slice(self, node: ast.Slice, scope: _Scope) -> Value:
        ends = (node.lower, node.upper, node.step)
        return ast.Slice(
            *(None if e is None else self.text(self.expression(e, scope)) for e in ends)
        )  # type: ignore[return-value]

    def on_Tuple(self, node: ast.Tuple, scope: _Scope) -> Value:
        items: tuple[Value, ...] = ()
        for item in node.elts:
            if isinstance(item, ast.Starred):
                held = self.expression(item.value, scope)
                assert isinstance(held, Parts)
                items += held.items
            else:
                items += (self.expression(item, scope),)
        if all(isinstance(item, Known) for item in items):
            return Known(tuple(item.value for item in items))  # type: ignore[union-attr]
        return Parts(items)

    def on_UnaryOp(self, node: ast.UnaryOp, scope: _Scope) -> Value:
        value = self.expression(node.operand, scope)
        if isinstance(value, Known):
            return Known(_OPERATORS[type(node.op)](value.value))
        return ast.UnaryOp(node.op, self.text(value))

    def on_BinOp(self, node: ast.BinOp, scope: _Scope) -> Value:
        left, right = self.expression(node.left, scope), self.expression(node.right, scope)
        if isinstance(left, Known) and isinstance(right, Known):
            return Known(_OPERATORS[type(node.op)](left.value, right.value))
        return ast.BinOp(self.text(left), node.op, self.text(right))

    def on_Compare(self, node: ast.Compare, scope: _Scope) -> Value:
        values = [self.expression(part, scope) for part in (node.left, *node.comparators)]
        if all(isinstance(v, Known) for v in values):
            pairs = zip(values[:-1], node.ops, values[1:], strict=True)
            return Known(all(_OPERATORS[type(op)](a.value, b.value) for a, op, b in pairs))  # type: ignore[union-attr]
        if len(values) == 2:
            right = values[1]
            op = _OPERATORS[type(node.ops[0])]
            if isinstance(right, Known) and right.value is None:
                return Known(op is operator.is_not)  # text is never None
        return ast.Compare(self.text(values[0]), node.ops, [self.text(v) for v in values[1:]])

    def on_BoolOp(self, node: ast.BoolOp, scope: _Scope) -> Value:
        ends = isinstance(node.op, ast.Or)  # the value that decides all
        parts: list[ast.expr] = []
        for k, operand in enumerate(node.values):
            self.guarded += k > 0
            value = self.expression(operand, scope)
            self.guarded -= k > 0
            if isinstance(value, Known):
                if bool(value.value) == ends:
                    if not parts:
                        return Known(ends)
                    parts.append(ast.Constant(ends))
                    break
                continue
            parts.append(self.text(value))
        if not parts:
            return Known(not ends)
        return parts[0] if len(parts) == 1 else ast.BoolOp(node.op, parts)

    def on_IfExp(self, node: ast.IfExp, scope: _Scope) -> Value:
        test = self.expression(node.test, scope)
        if isinstance(test, Known):
            return self.expression(node.body if test.value else node.orelse, scope)
        self.guarded += 1
        yes, no = self.expression(node.body, scope), self.expression(node.orelse, scope)
        self.guarded -= 1
        return ast.IfExp(self.text(test), self.text(yes), self.text(no))

    def on_Call(self, node: ast.Call, scope: _Scope) -> Value:
        called = self.expression(node.func, scope)
        arguments = [self.expression(a, scope) for a in node.args]
        named = {str(k.arg): self.expression(k.value, scope) for k in node.keywords}
        if isinstance(called, Known):
            function = called.value
            if (
                isinstance(function, type)
                and issubclass(function, tuple)
                and hasattr(function, "_fields")
            ):
                return Parts(tuple(arguments), called)
            if function in _FOLDED and all(isinstance(a, Known) for a in arguments):
                return Known(function(*(a.value for a in arguments)))  # type: ignore[union-attr]
            if function is getattr:
                return self.on_Attribute(ast.Attribute(node.args[0], arguments[1].value), scope)  # type: ignore[union-attr]
            if function is len and isinstance(arguments[0], Parts):
                return Known(len(arguments[0].items))
            kind = written_kind(function)
            inside = kind == self.kind and not stands_apart(function)
            if inside and _can_be_written(definition_of(function)):
                written = self.attempt(function, arguments, named)
                if written is not None:
                    return written
            if kind is not None:
                return self.beside(function, arguments, named)
        return ast.Call(
            self.text(called), [self.text(a) for a in arguments],
            [ast.keyword(k, self.text(v)) for k, v in named.items()],
        )  # fmt: skip

    # ---- calls ----------------------------------------------------------------------------------

    def attempt(
        self, function: Any, arguments: list[Value], named: dict[str, Value]
    ) -> Value | None:
        """Write a call out; None where it has to stay a call."""
        if not self.guarded:
            return self.write_out(function, arguments, named)
        guarded, self.guarded = self.guarded, 0
        emitted, value = self.inside(lambda: self.write_out(function, arguments, named))
        self.guarded = guarded
        return None if emitted else value  # type: ignore[no-any-return]

    def beside(self, function: Any, arguments: list[Value], named: dict[str, Value]) -> ast.expr:
        """Call a function of the other kind, or with returns inside loops: written down beside this one, once for each set of
        known arguments."""
        leaves: list[ast.expr] = []
        shapes = [self.shape(value, leaves) for value in arguments]
        shapes += [(name, self.shape(value, leaves)) for name, value in sorted(named.items())]
        key = (function, repr(shapes))
        if key not in self.shared.names:
            self.shared.names[key] = self.unique(function.py_func.__name__.lstrip("_"))
            writer = _Writer(str(written_kind(function)), self.shared)
            writer.function(function, self.shared.names[key], arguments, named)
        return ast.Call(ast.Name(self.shared.names[key], ast.Load()), leaves, [])

    def shape(self, value: Value, leaves: list[ast.expr]) -> Any:
        """What is known of an argument; what is not is collected."""
        if isinstance(value, Known):
            return value.source if isinstance(value.value, np.ndarray) else repr(value.value)
        if isinstance(value, Parts):
            return [self.shape(item, leaves) for item in value.items]
        leaves.append(value)
        return None

    def opened(self, value: Value, name: str, leaves: list[str]) -> Value:
        """An argument as the function beside sees it: its own parameters in place of what is not known."""
        if isinstance(value, Known):
            return value
        if isinstance(value, Parts):
            fields = [name] * len(value.items) if value.maker is None else value.maker.value._fields
            items = zip(value.items, fields, strict=True)
            return Parts(tuple(self.opened(v, f, leaves) for v, f in items), value.maker)
        leaves.append(self.unique(name))
        self.stable.add(leaves[-1])
        return ast.Name(leaves[-1], ast.Load())

    def function(
        self, function: Any, name: str, arguments: list[Value], named: dict[str, Value]
    ) -> None:
        """Add a function to the module."""
        plain = getattr(function, "py_func", function)
        node = definition_of(plain)
        leaves: list[str] = []
        parameters = [a.arg for a in node.args.args]
        given = [self.opened(v, p, leaves) for v, p in zip(arguments, parameters, strict=False)]
        also = {p: self.opened(value, p, leaves) for p, value in sorted(named.items())}
        scope = self.scope_of(plain, given, also)
        self.several(_tail_form(node.body), scope)
        holder = ast.arguments([], [ast.arg(a) for a in leaves], None, [], [], None, [])
        made = ast.FunctionDef(name, holder, self.block or [ast.Pass()], [], None, None)
        if sys.version_info >= (3, 12):
            made.type_params = []
        self.shared.functions.append((made, self.kind))

    def write_out(self, function: Any, arguments: list[Value], named: dict[str, Value]) -> Value:
        plain = getattr(function, "py_func", function)
        scope = self.scope_of(plain, arguments, named)
        return self.body(_tail_form(definition_of(plain).body), scope)

    def scope_of(self, plain: Any, arguments: list[Value], named: dict[str, Value]) -> _Scope:
        """A call's names, its parameters bound."""
        node = definition_of(plain)
        scope = _Scope(plain.__globals__, plain.__module__, _assignments(node))
        parameters = [a.arg for a in node.args.args]
        given = dict(zip(parameters, arguments, strict=False)) | named
        defaults = node.args.defaults
        for name, default in zip(
            parameters[len(parameters) - len(defaults) :], defaults, strict=True
        ):
            if name not in given:
                given[name] = self.expression(default, scope)
        for name in parameters:
            value = given[name]
            if scope.assigned[name]:
                scope.assigned[name] += 1
                self.bind_name(name, value, scope)
            else:
                scope.values[name] = self.settled(value, name)
        return scope

    def body(self, statements: list[ast.stmt], scope: _Scope) -> Value:
        """Write a function's statements; what it returns."""
        for statement in statements:
            if isinstance(statement, ast.Return):
                if statement.value is None:
                    return Known(None)
                return self.settled(self.expression(statement.value, scope))
            if isinstance(statement, ast.If) and _returns([statement]):
                return self.branches(statement, scope)
            self.statement(statement, scope)
        return Known(None)

    def branches(self, node: ast.If, scope: _Scope) -> Value:
        """An `if` whose branches return."""
        test = self.expression(node.test, scope)
        if isinstance(test, Known):
            return self.body(node.body if test.value else node.orelse, scope)
        yes, one = self.inside(lambda: self.body(node.body, scope))
        no, other = self.inside(lambda: self.body(node.orelse, scope))
        value = self.joined(one, other, yes, no)
        self.emit(ast.If(self.text(test), yes or [ast.Pass()], no))
        return value

    def joined(self, one: Value, other: Value, yes: list[ast.stmt], no: list[ast.stmt]) -> Value:
        """One name for what two branches return."""
        if isinstance(one, Known) and isinstance(other, Known) and one.value is other.value:
            return one
        pair = [
            Parts(tuple(Known(x) for x in v.value))
            if isinstance(v, Known) and isinstance(v.value, tuple)
            else v
            for v in (one, other)
        ]
        if all(isinstance(v, Parts) for v in pair):
            items = zip(pair[0].items, pair[1].items, strict=True)  # type: ignore[union-attr]
            return Parts(tuple(self.joined(a, b, yes, no) for a, b in items), pair[0].maker)  # type: ignore[union-attr]
        name = self.unique("t")
        self.stable.add(name)
        for block, value in ((yes, one), (no, other)):
            block.append(ast.Assign([ast.Name(name, ast.Store())], self.text(value)))
        return ast.Name(name, ast.Load())

    # ---- statements -----------------------------------------------------------------------------

    def statement(self, node: ast.stmt, scope: _Scope) -> None:
        getattr(self, f"do_{type(node).__name__}")(node, scope)

    def do_Pass(self, node: ast.Pass, scope: _Scope) -> None:
        pass

    def do_Assert(self, node: ast.Assert, scope: _Scope) -> None:
        pass

    def do_Return(self, node: ast.Return, scope: _Scope) -> None:
        value = None if node.value is None else self.text(self.expression(node.value, scope))
        self.emit(ast.Return(value))

    def do_Break(self, node: ast.Break, scope: _Scope) -> None:
        self.emit(ast.Break())

    def do_Expr(self, node: ast.Expr, scope: _Scope) -> None:
        if isinstance(node.value, ast.Constant):
            return  # a docstring
        value = self.expression(node.value, scope)
        if isinstance(value, ast.Call):
            self.emit(ast.Expr(value))

    def do_AnnAssign(self, node: ast.AnnAssign, scope: _Scope) -> None:
        assert isinstance(node.target, ast.Name)
        if isinstance(node.value, ast.Dict):
            scope.values[node.target.id] = {}
        elif node.value is not None:
            self.bind_name(node.target.id, self.expression(node.value, scope), scope)

    def do_Assign(self, node: ast.Assign, scope: _Scope) -> None:
        value = self.expression(node.value, scope)
        (target,) = node.targets
        self.bind(target, value, scope)

    def bind(self, target: ast.expr, value: Value, scope: _Scope) -> None:
        if isinstance(target, ast.Name):
            self.bind_name(target.id, value, scope)
        elif isinstance(target, ast.Subscript):
            owner = self.expression(target.value, scope)
            index = self.expression(target.slice, scope)
            if isinstance(owner, dict):
                owner[index.value] = self.settled(value)  # type: ignore[union-attr]
                return
            place = ast.Subscript(self.text(owner), self.text(index), ast.Store())
            self.emit(ast.Assign([place], self.text(value)))
        else:
            assert isinstance(target, ast.Tuple)
            if isinstance(value, Known):
                value = Parts(tuple(Known(item) for item in value.value))
            if isinstance(value, Parts):
                items = self.settled(value).items  # type: ignore[union-attr]
                for part, item in zip(target.elts, items, strict=True):
                    self.bind(part, item, scope)
                return
            names = []
            for part in target.elts:
                assert isinstance(part, ast.Name)
                names.append(self.local(part.id, scope))
            self.emit(
                ast.Assign(
                    [ast.Tuple([ast.Name(n, ast.Store()) for n in names], ast.Store())], value
                )
            )

    def local(self, name: str, scope: _Scope) -> str:
        """The text's name of a local."""
        if name not in scope.local:
            scope.local[name] = self.unique(name)
        text = scope.local[name]
        if scope.assigned[name] <= 1:
            self.stable.add(text)
        scope.values[name] = ast.Name(text, ast.Load())
        return text

    def bind_name(self, name: str, value: Value, scope: _Scope) -> None:
        if scope.assigned[name] <= 1:
            kept = isinstance(value, ast.Name) and value.id in self.stable
            if kept or isinstance(value, Known | Parts):
                scope.values[name] = self.settled(value, name)
                return
        if isinstance(value, ast.Name) and scope.local.get(name) == value.id:
            return
        text = self.text(value)
        self.emit(ast.Assign([ast.Name(self.local(name, scope), ast.Store())], text))

    def do_AugAssign(self, node: ast.AugAssign, scope: _Scope) -> None:
        value = self.text(self.expression(node.value, scope))
        if isinstance(node.target, ast.Name):
            target: Any = ast.Name(self.local(node.target.id, scope), ast.Store())
        else:
            assert isinstance(node.target, ast.Subscript)
            place = self.expression(node.target, scope)
            assert isinstance(place, ast.Subscript)
            target = ast.Subscript(place.value, place.slice, ast.Store())
        self.emit(ast.AugAssign(target, node.op, value))

    def do_If(self, node: ast.If, scope: _Scope) -> None:
        test = self.expression(node.test, scope)
        if isinstance(test, Known):
            self.several(node.body if test.value else node.orelse, scope)
            return
        yes, _ = self.inside(lambda: self.several(node.body, scope))
        no, _ = self.inside(lambda: self.several(node.orelse, scope))
        if yes or no:
            self.emit(ast.If(self.text(test), yes or [ast.Pass()], no))

    def several(self, statements: list[ast.stmt], scope: _Scope) -> None:
        for statement in statements:
            self.statement(statement, scope)

    def do_While(self, node: ast.While, scope: _Scope) -> None:
        self.guarded += 1
        test = self.text(self.expression(node.test, scope))
        self.guarded -= 1
        body, _ = self.inside(lambda: self.several(node.body, scope))
        self.emit(ast.While(test, body, []))

    def do_For(self, node: ast.For, scope: _Scope) -> None:
        items = self.items_to_write(node, scope)
        if items is not None:
            for item in items:
                self.bind_item(node.target, item, scope)
                self.several(node.body, scope)
            return
        source = self.text(self.expression(node.iter, scope))
        targets = [n for n in ast.walk(node.target) if isinstance(n, ast.Name)]
        names = {t.id: self.local(t.id, scope) for t in targets}
        target = copy.deepcopy(node.target)
        for part in ast.walk(target):
            if isinstance(part, ast.Name):
                part.id = names[part.id]
        body, _ = self.inside(lambda: self.several(node.body, scope))
        if body:
            self.emit(ast.For(target, source, body, []))

    def whole_numbers(self, nodes: list[ast.expr], scope: _Scope) -> list[int]:
        return [self.expression(n, scope).value for n in nodes]  # type: ignore[union-attr]

    def bind_item(self, target: ast.expr, item: Any, scope: _Scope) -> None:
        if isinstance(target, ast.Tuple):
            for part, one in zip(target.elts, item, strict=True):
                self.bind_item(part, one, scope)
        else:
            assert isinstance(target, ast.Name)
            scope.values[target.id] = Known(item)

    def items_to_write(self, node: ast.For, scope: _Scope) -> Any:
        """What a loop runs over, where its body is to stand once for each; None where it stays a loop."""
        if not isinstance(node.iter, ast.Call):
            return None
        called = ast.unparse(node.iter.func)
        (first, *_) = node.iter.args
        if called == "written_out" and isinstance(first, ast.Call):  # range(...)
            return list(range(*self.whole_numbers(first.args, scope)))
        arguments = [self.expression(a, scope) for a in node.iter.args]
        if not all(isinstance(a, Known) for a in arguments):
            return None
        values = [a.value for a in arguments]  # type: ignore[union-attr]
        if called == "written_out":
            return list(values[0])
        return None


_DECORATORS = {
    "lane": '@njit(forceinline=True, error_model="numpy", fastmath=FASTMATH, no_cpython_wrapper=True, no_cfunc_wrapper=True)',
    "scalar": '@njit(error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True)',
}


def text_of(function: Any, name: str, known: dict[str, Any]) -> str:
    """The text of a module that holds `function` as `name`, everything written out."""
    plain = getattr(function, "py_func", function)
    shared = _Module()
    shared.used |= {name, "njit", "FASTMATH"}
    parameters = [a.arg for a in definition_of(plain).args.args]
    arguments: list[Value] = [
        Known(known[p]) if p in known else ast.Name(p, ast.Load()) for p in parameters
    ]
    _Writer(written_kind(function) or "lane", shared).function(plain, name, arguments, {})
    functions = written_once(shared.functions)
    lines = [f'"""{plain.__module__}.{plain.__name__}, all calls written out."""', ""]
    if len(functions) > 1:
        lines += ["from numba import njit", "from hpcclear.base.jit import FASTMATH"]
    for (module, attribute), text in sorted(shared.imports.items()):
        renamed = f" as {text}" if text != attribute else ""
        lines.append(f"from {module} import {attribute}{renamed}")
    for made, kind in functions:
        lines += ["", ""] + ([_DECORATORS[kind]] if made.name != name else [])
        lines.append(ast.unparse(ast.fix_missing_locations(made)))
    return "\n".join([*lines, ""])


def _folder() -> Path:
    folder = Path(config.CACHE_DIR) / f"texts-{source_key()}"
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    return folder


def one_text(function: Any, label: str, **known: Any) -> Callable[..., Any]:
    """A function with all its calls written out, to be compiled: what stands beside it in its module Python cannot call.

    Parameters
    ----------
    function : callable
        At the top of a module; made by `lane_function` or `scalar_function`, whose kind of calls is written out.
    label : str
        The first part of the text's name.
    **known
        Parameters that are known: numbers, None, tuples of them. The text has the others.

    Returns
    -------
    callable
        From a module of its own, whose file stands beside Numba's cache and is kept for the next process.
    """
    plain = getattr(function, "py_func", function)
    asked = f"{plain.__module__}.{plain.__qualname__} {sorted(known.items())!r}"
    name = f"{label}_{hashlib.sha256(asked.encode()).hexdigest()[:12]}"
    return getattr(module_of(name, lambda: text_of(function, name, known)), name)  # type: ignore[no-any-return]


def module_of(name: str, write: Callable[[], str]) -> ModuleType:
    """The module of a text that is kept for the next process; `write` is called where there is none yet."""
    path = _folder() / f"{name}.py"
    if not path.exists():
        _keep(path, write())
    return text_named(name)


def text_named(name: str) -> ModuleType:
    """The module of a text that is there."""
    if _TEXTS not in sys.modules:  # a package, so that one text can import from another
        package = ModuleType(_TEXTS)
        package.__path__ = [str(_folder())]
        sys.modules[_TEXTS] = package
    importlib.invalidate_caches()  # the folder may have changed within its date's resolution
    return importlib.import_module(f"{_TEXTS}.{name}")


_TEXTS = "hpcclear_texts"


def _keep(path: Path, text: str) -> None:
    """Write a file whole or not at all, and never a second time: Numba's cache goes by its date."""
    with tempfile.NamedTemporaryFile("w", dir=path.parent, suffix=".part", delete=False) as part:
        part.write(text)
    try:
        os.link(part.name, path)
    except FileExistsError:
        pass  # another rank was faster
    finally:
        os.unlink(part.name)
