"""Expressions as LLVM's instructions, in the order in which Python evaluates them; what is known is computed at once.

A value is LLVM's, or one of Python's that is known: a number, a function, an effect's flag, None. A tuple holds either.
"""

import ast
import math
from collections.abc import Callable
from functools import partial, reduce

import numpy as np
from llvmlite import ir

from hpcclear.base.lowering import values as val
from hpcclear.base.lowering.arithmetic import Arithmetic
from hpcclear.base.lowering.values import DOUBLE, WHOLE, Array, Value
from hpcclear.base.unrolled import written_out

_INTRINSICS = {
    math.sqrt: "llvm.sqrt", np.sqrt: "llvm.sqrt", math.copysign: "llvm.copysign", abs: "llvm.fabs"
}  # fmt: skip
_FOLDED = (len, int, float, min, max, abs, range, written_out)
"""What is called at once, if its arguments are known."""


_AT_HAND = (ast.Name, ast.Constant)
"""Expressions that take no instruction."""


class Expressions(Arithmetic):
    """Expressions of one function; `hpcclear.base.lowering.statements.Function` has the rest of it."""

    def read(self, name: str) -> Value:
        """The value of a local, or of a name of the module."""
        raise NotImplementedError

    def called(self, function: Value, arguments: list[Value], named: dict[str, Value]) -> Value:
        """What a function of the kernel returns."""
        raise NotImplementedError

    # ---- expressions ----------------------------------------------------------------------------

    def expression(self, node: ast.expr) -> Value:
        """The value of an expression."""
        return getattr(self, f"_of_{type(node).__name__}")(node)

    def _of_Constant(self, node: ast.Constant) -> Value:
        return node.value

    def _of_Name(self, node: ast.Name) -> Value:
        return self.read(node.id)

    def _of_Tuple(self, node: ast.Tuple) -> Value:
        items: tuple[Value, ...] = ()
        for one in node.elts:
            if isinstance(one, ast.Starred):
                items += self.expression(one.value)
            else:
                items += (self.expression(one),)
        return items

    def _of_Attribute(self, node: ast.Attribute) -> Value:
        return getattr(self.expression(node.value), node.attr)

    def _of_BinOp(self, node: ast.BinOp) -> Value:
        return self.binary(type(node.op), self.expression(node.left), self.expression(node.right))

    def _of_UnaryOp(self, node: ast.UnaryOp) -> Value:
        value = self.expression(node.operand)
        if isinstance(node.op, ast.Not):
            test = self.truth(value)
            return not test if val.is_known(test) else self.builder.not_(test)
        assert isinstance(node.op, ast.USub)
        if val.is_known(value):
            return -value
        if value.type == WHOLE:
            return self.builder.neg(value)
        return self.builder.fsub(self.cast(self.value(-0.0), value.type), value)

    def _of_Compare(self, node: ast.Compare) -> Value:
        def link(k: int, one: Value) -> Value:
            other = self.expression(node.comparators[k])
            found = self.compared(type(node.ops[k]), one, other)
            if k + 1 == len(node.ops):
                return found
            return self.either(found, lambda: link(k + 1, other), lambda: found)

        return link(0, self.expression(node.left))

    def _of_BoolOp(self, node: ast.BoolOp) -> Value:
        def link(k: int) -> Value:
            found = self.expression(node.values[k])
            if k + 1 == len(node.values):
                return found
            further, done = (lambda: link(k + 1)), (lambda: found)
            ways = (further, done) if isinstance(node.op, ast.And) else (done, further)
            return self.either(self.truth(found), *ways)

        return link(0)

    def _of_IfExp(self, node: ast.IfExp) -> Value:
        test = self.truth(self.expression(node.test))
        ways = node.body, node.orelse
        if not val.is_known(test) and all(isinstance(one, _AT_HAND) for one in ways):
            chosen = [self.expression(one) for one in ways]
            if all(isinstance(one, float | int | ir.Value) for one in chosen):
                # into a branch the compiler may move their loads, and vectorises no loop around it
                one, other, _ = self.both(*chosen)
                return self.builder.select(test, one, other)
        yes, no = (partial(self.expression, one) for one in ways)
        return self.either(test, yes, no)

    def either(self, test: Value, yes: Callable[[], Value], no: Callable[[], Value]) -> Value:
        """The value of one of two branches; of the one that is taken, where that is known."""
        if val.is_known(test):
            return yes() if test else no()
        b, ends = self.builder, []
        blocks = [b.append_basic_block() for _ in range(2)]
        b.cbranch(test, *blocks)
        for block, branch in zip(blocks, (yes, no), strict=True):
            b.position_at_end(block)
            ends.append((branch(), b.block))
        return self.merged(ends)

    def merged(self, ends: list[tuple[Value, ir.Block]]) -> Value:
        """The value that comes out of the ends of blocks, behind which it goes on."""
        b = self.builder
        if len(ends) == 1:
            ((value, block),) = ends
            b.position_at_end(block)
            return value
        values, blocks = zip(*ends, strict=True)
        cast = [[] for _ in ends]  # type: list[list[Value]]
        shape = self._cast(values, blocks, cast)
        last = b.append_basic_block()
        for block in blocks:
            b.position_at_end(block)
            b.branch(last)
        b.position_at_end(last)
        chosen = []
        for column in zip(*cast, strict=True):
            chosen.append(b.phi(column[0].type))
            for value, block in zip(column, blocks, strict=True):
                chosen[-1].add_incoming(value, block)
        return shape(iter(chosen))

    def _cast(
        self, values: Value, blocks: Value, cast: list[list[Value]]
    ) -> Callable[[Value], Value]:
        """Put numbers that differ by block into `cast`, as of one type; what makes one value of those that are chosen."""
        first = values[0]
        if all(value is first for value in values):
            return lambda chosen: first
        if isinstance(first, tuple):
            parts = [self._cast(one, blocks, cast) for one in zip(*values, strict=True)]
            return lambda chosen: val.rebuilt(type(first), [part(chosen) for part in parts])
        kind = reduce(val.wider, [self.value(value).type for value in values])
        for value, block, column in zip(values, blocks, cast, strict=True):
            self.builder.position_at_end(block)
            column.append(self.cast(value, kind))
        return next

    def _of_Subscript(self, node: ast.Subscript) -> Value:
        owner, index = self.expression(node.value), node.slice
        if isinstance(index, ast.Slice):
            low, high = (self.value(self.expression(end)) for end in (index.lower, index.upper))  # type: ignore[arg-type]
            return Array(self.builder.gep(owner.data, [low]), (self.builder.sub(high, low),))
        known = self.expression(index)
        if val.is_known((known, owner)):
            found = owner[known]
            return found.item() if isinstance(found, np.generic) else found
        return self.item(owner, list(known) if isinstance(known, tuple) else [known])

    def item(self, owner: Value, index: list[Value]) -> Value:
        """What an index names: a number, a row, a part of a tuple."""
        owner = self.value(owner) if isinstance(owner, np.ndarray) else owner
        if isinstance(owner, Array):
            place = self.place(owner, index)
            left = owner.shape[len(index) :]
            return Array(place, left) if left else self.builder.load(place)
        if not isinstance(owner, tuple):  # a place in memory
            return self.builder.load(self.builder.gep(owner, list(map(self.value, index))))
        (one,) = index
        if val.is_known(one):
            return owner[one]
        chosen, *others = map(self.value, owner)
        for k, other in enumerate(others, 1):
            here = self.builder.icmp_signed("==", one, val.whole(k))
            chosen = self.builder.select(here, other, chosen)
        return chosen

    def _of_Call(self, node: ast.Call) -> Value:
        function = self.expression(node.func)
        arguments = list(map(self.expression, node.args))
        named = {str(one.arg): self.expression(one.value) for one in node.keywords}
        if function is getattr or (isinstance(function, type) and issubclass(function, tuple)):
            return function(*arguments, **named)
        if function in _FOLDED and all(map(val.is_known, arguments)):
            return function(*arguments)
        if hasattr(function, "py_func"):
            return self.called(function, arguments, named)
        arguments = list(map(self.value, arguments))
        if function in _INTRINSICS and arguments[0].type != WHOLE:
            doubles = [self.cast(one, DOUBLE) for one in arguments]
            return self.intrinsic(_INTRINSICS[function], doubles)
        return getattr(self, f"_call_{function.__name__}")(*arguments)
