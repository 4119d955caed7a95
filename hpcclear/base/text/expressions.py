"""Expressions written out: folded where everything is known, names that no other function of the text has."""

import ast
import builtins
import math
import operator
from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np

from hpcclear.base.jit import stands_apart, written_kind
from hpcclear.base.text.values import (
    Known,
    Module,
    Parts,
    Scope,
    Value,
    can_be_written,
    definition_of,
)

_OPERATORS: dict[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv, ast.Mod: operator.mod, ast.Pow: operator.pow,
    ast.USub: operator.neg, ast.Not: operator.not_, ast.BitOr: operator.or_, ast.BitAnd: operator.and_,
    ast.Eq: operator.eq, ast.NotEq: operator.ne, ast.Lt: operator.lt, ast.LtE: operator.le,
    ast.Gt: operator.gt, ast.GtE: operator.ge, ast.Is: operator.is_, ast.IsNot: operator.is_not,
}  # fmt: skip
_FOLDED = (len, int, min, max, abs, getattr)


class Expressions:
    """The expressions of one function; calls are left to who knows statements as well."""

    def __init__(self, kind: str, shared: Module) -> None:
        self.kind = kind
        self.shared = shared
        self.stable: set[str] = set()
        self.block: list[ast.stmt] = []
        self.guarded = 0

    # ---- names ----------------------------------------------------------------------------------

    def unique(self, base: str) -> str:
        """A name that nothing else in the text has."""
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
        """Put a statement at the end of the block that is being written."""
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
        """A value as it stands in the text."""
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

    def expression(self, node: ast.expr, scope: Scope) -> Value:
        """What an expression stands for."""
        return getattr(self, f"_on_{type(node).__name__}")(node, scope)  # type: ignore[no-any-return]

    def _on_Constant(self, node: ast.Constant, scope: Scope) -> Value:
        return Known(node.value)

    def _on_Name(self, node: ast.Name, scope: Scope) -> Value:
        if node.id in scope.values:
            return scope.values[node.id]  # type: ignore[no-any-return]
        if node.id in scope.names:
            return Known(scope.names[node.id], (scope.module, node.id))
        return Known(getattr(builtins, node.id), ("builtins", node.id))

    def _on_Attribute(self, node: ast.Attribute, scope: Scope) -> Value:
        owner = self.expression(node.value, scope)
        if isinstance(owner, Known):
            inside = isinstance(owner.value, ModuleType)
            source = (owner.value.__name__, node.attr) if inside else None
            return Known(getattr(owner.value, node.attr), source)
        if isinstance(owner, Parts):
            assert owner.maker is not None
            return owner.items[owner.maker.value._fields.index(node.attr)]  # type: ignore[no-any-return]
        return ast.Attribute(self.text(owner), node.attr, ast.Load())

    def _on_Subscript(self, node: ast.Subscript, scope: Scope) -> Value:
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

    def _on_Slice(self, node: ast.Slice, scope: Scope) -> Value:
        ends = (node.lower, node.upper, node.step)
        return ast.Slice(
            *(None if e is None else self.text(self.expression(e, scope)) for e in ends)
        )  # type: ignore[return-value]

    def _on_Tuple(self, node: ast.Tuple, scope: Scope) -> Value:
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

    def _on_UnaryOp(self, node: ast.UnaryOp, scope: Scope) -> Value:
        value = self.expression(node.operand, scope)
        if isinstance(value, Known):
            return Known(_OPERATORS[type(node.op)](value.value))
        return ast.UnaryOp(node.op, self.text(value))

    def _on_BinOp(self, node: ast.BinOp, scope: Scope) -> Value:
        left, right = self.expression(node.left, scope), self.expression(node.right, scope)
        if isinstance(left, Known) and isinstance(right, Known):
            return Known(_OPERATORS[type(node.op)](left.value, right.value))
        if isinstance(node.op, ast.Add | ast.Mult):
            # of one lane, or of a first row: less to read for the compiler
            nothing = 0 if isinstance(node.op, ast.Add) else 1
            for one, other in ((left, right), (right, left)):
                if isinstance(one, Known) and type(one.value) is int and one.value == nothing:
                    return other
        return ast.BinOp(self.text(left), node.op, self.text(right))

    def _on_Compare(self, node: ast.Compare, scope: Scope) -> Value:
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

    def _on_BoolOp(self, node: ast.BoolOp, scope: Scope) -> Value:
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

    def _on_IfExp(self, node: ast.IfExp, scope: Scope) -> Value:
        test = self.expression(node.test, scope)
        if isinstance(test, Known):
            return self.expression(node.body if test.value else node.orelse, scope)
        self.guarded += 1
        yes, no = self.expression(node.body, scope), self.expression(node.orelse, scope)
        self.guarded -= 1
        return ast.IfExp(self.text(test), self.text(yes), self.text(no))

    def _on_Call(self, node: ast.Call, scope: Scope) -> Value:
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
                return self._on_Attribute(ast.Attribute(node.args[0], arguments[1].value), scope)  # type: ignore[union-attr]
            if function is len and isinstance(arguments[0], Parts):
                return Known(len(arguments[0].items))
            kind = written_kind(function)
            inside = kind == self.kind and not stands_apart(function)
            if inside and can_be_written(definition_of(function)):
                written = self.attempt(function, arguments, named)
                if written is not None:
                    return written
            if kind is not None:
                return self.beside(function, arguments, named)
        return ast.Call(
            self.text(called), [self.text(a) for a in arguments],
            [ast.keyword(k, self.text(v)) for k, v in named.items()],
        )  # fmt: skip

    def attempt(
        self, function: object, arguments: list[Value], named: dict[str, Value]
    ) -> Value | None:
        """Write a call out; None where it has to stay a call."""
        raise NotImplementedError

    def beside(self, function: object, arguments: list[Value], named: dict[str, Value]) -> ast.expr:
        """Call a function that stands beside this one."""
        raise NotImplementedError
