"""Calls and statements written out, up to whole functions."""

import ast
import copy
from typing import Any

import numpy as np

from hpcclear.base.jit import written_kind
from hpcclear.base.text.expressions import Expressions
from hpcclear.base.text.values import (
    Known,
    Parts,
    Scope,
    Value,
    assignments,
    definition_of,
    returns_in,
    tail_form,
)


class Writer(Expressions):
    """Writes one function."""

    # ---- calls ----------------------------------------------------------------------------------

    def attempt(
        self, function: object, arguments: list[Value], named: dict[str, Value]
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
            writer = Writer(str(written_kind(function)), self.shared)
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
        self, function: object, name: str, arguments: list[Value], named: dict[str, Value]
    ) -> None:
        """Add a function to the module."""
        plain = getattr(function, "py_func", function)
        node = definition_of(plain)
        leaves: list[str] = []
        parameters = [a.arg for a in node.args.args]
        given = [self.opened(v, p, leaves) for v, p in zip(arguments, parameters, strict=False)]
        also = {p: self.opened(value, p, leaves) for p, value in sorted(named.items())}
        scope = self.scope_of(plain, given, also)
        self.several(tail_form(node.body), scope)
        made = ast.parse(f"def {name}({', '.join(leaves)}): pass").body[0]
        assert isinstance(made, ast.FunctionDef)
        made.body = self.block or made.body
        self.shared.functions.append((made, self.kind))

    def write_out(self, function: object, arguments: list[Value], named: dict[str, Value]) -> Value:
        """Write a function's body where its call stands; what it returns."""
        plain = getattr(function, "py_func", function)
        scope = self.scope_of(plain, arguments, named)
        return self.body(tail_form(definition_of(plain).body), scope)

    def scope_of(self, plain: Any, arguments: list[Value], named: dict[str, Value]) -> Scope:
        """A call's names, its parameters bound."""
        node = definition_of(plain)
        scope = Scope(plain.__globals__, plain.__module__, assignments(node))
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

    def body(self, statements: list[ast.stmt], scope: Scope) -> Value:
        """Write a function's statements; what it returns."""
        for statement in statements:
            if isinstance(statement, ast.Return):
                if statement.value is None:
                    return Known(None)
                return self.settled(self.expression(statement.value, scope))
            if isinstance(statement, ast.If) and returns_in([statement]):
                return self.branches(statement, scope)
            self.statement(statement, scope)
        return Known(None)

    def branches(self, node: ast.If, scope: Scope) -> Value:
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

    def statement(self, node: ast.stmt, scope: Scope) -> None:
        """Write a statement."""
        getattr(self, f"_do_{type(node).__name__}")(node, scope)

    def _do_Pass(self, node: ast.Pass, scope: Scope) -> None:
        pass

    def _do_Assert(self, node: ast.Assert, scope: Scope) -> None:
        pass

    def _do_Return(self, node: ast.Return, scope: Scope) -> None:
        value = None if node.value is None else self.text(self.expression(node.value, scope))
        self.emit(ast.Return(value))

    def _do_Break(self, node: ast.Break, scope: Scope) -> None:
        self.emit(ast.Break())

    def _do_Expr(self, node: ast.Expr, scope: Scope) -> None:
        if isinstance(node.value, ast.Constant):
            return  # a docstring
        value = self.expression(node.value, scope)
        if isinstance(value, ast.Call):
            self.emit(ast.Expr(value))

    def _do_AnnAssign(self, node: ast.AnnAssign, scope: Scope) -> None:
        assert isinstance(node.target, ast.Name)
        if isinstance(node.value, ast.Dict):
            scope.values[node.target.id] = {}
        elif node.value is not None:
            self.bind_name(node.target.id, self.expression(node.value, scope), scope)

    def _do_Assign(self, node: ast.Assign, scope: Scope) -> None:
        value = self.expression(node.value, scope)
        (target,) = node.targets
        self.bind(target, value, scope)

    def bind(self, target: ast.expr, value: Value, scope: Scope) -> None:
        """Assign a value to a target of any form."""
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

    def local(self, name: str, scope: Scope) -> str:
        """The text's name of a local."""
        if name not in scope.local:
            scope.local[name] = self.unique(name)
        text = scope.local[name]
        if scope.assigned[name] <= 1:
            self.stable.add(text)
        scope.values[name] = ast.Name(text, ast.Load())
        return text

    def bind_name(self, name: str, value: Value, scope: Scope) -> None:
        """Assign a value to a local, which needs no statement if it stays what it is."""
        if scope.assigned[name] <= 1:
            kept = isinstance(value, ast.Name) and value.id in self.stable
            if kept or isinstance(value, Known | Parts):
                scope.values[name] = self.settled(value, name)
                return
        if isinstance(value, ast.Name) and scope.local.get(name) == value.id:
            return
        text = self.text(value)
        self.emit(ast.Assign([ast.Name(self.local(name, scope), ast.Store())], text))

    def _do_AugAssign(self, node: ast.AugAssign, scope: Scope) -> None:
        value = self.text(self.expression(node.value, scope))
        if isinstance(node.target, ast.Name):
            target: Any = ast.Name(self.local(node.target.id, scope), ast.Store())
        else:
            assert isinstance(node.target, ast.Subscript)
            place = self.expression(node.target, scope)
            assert isinstance(place, ast.Subscript)
            target = ast.Subscript(place.value, place.slice, ast.Store())
        self.emit(ast.AugAssign(target, node.op, value))

    def _do_If(self, node: ast.If, scope: Scope) -> None:
        test = self.expression(node.test, scope)
        if isinstance(test, Known):
            self.several(node.body if test.value else node.orelse, scope)
            return
        yes, _ = self.inside(lambda: self.several(node.body, scope))
        no, _ = self.inside(lambda: self.several(node.orelse, scope))
        if yes or no:
            self.emit(ast.If(self.text(test), yes or [ast.Pass()], no))

    def several(self, statements: list[ast.stmt], scope: Scope) -> None:
        """Write statements in their order."""
        for statement in statements:
            self.statement(statement, scope)

    def _do_While(self, node: ast.While, scope: Scope) -> None:
        self.guarded += 1
        test = self.text(self.expression(node.test, scope))
        self.guarded -= 1
        body, _ = self.inside(lambda: self.several(node.body, scope))
        self.emit(ast.While(test, body, []))

    def _do_For(self, node: ast.For, scope: Scope) -> None:
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

    def whole_numbers(self, nodes: list[ast.expr], scope: Scope) -> list[int]:
        """Numbers that have to be known."""
        return [self.expression(n, scope).value for n in nodes]  # type: ignore[union-attr]

    def bind_item(self, target: ast.expr, item: Any, scope: Scope) -> None:
        """Let a loop's variables be an item of what it runs over."""
        if isinstance(target, ast.Tuple):
            for part, one in zip(target.elts, item, strict=True):
                self.bind_item(part, one, scope)
        else:
            assert isinstance(target, ast.Name)
            scope.values[target.id] = Known(item)

    def items_to_write(self, node: ast.For, scope: Scope) -> Any:
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
        few = called == "range" and len(range(*values)) <= 1  # of one lane
        ends = any(isinstance(n, ast.Break | ast.Continue) for s in node.body for n in ast.walk(s))
        return list(range(*values)) if few and not ends else None
