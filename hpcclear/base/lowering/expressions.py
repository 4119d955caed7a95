"""Expressions of a text as LLVM's instructions: the same as Numba would emit, in the order in which Python evaluates them."""

import ast
import math
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from llvmlite import ir

from hpcclear.base.lowering.values import (
    DOUBLE,
    NUMBA,
    TRUTH,
    VECTOR,
    WHOLE,
    Array,
    rebuilt,
    whole,
    wider,
)

_ARITHMETIC = {ast.Add: "add", ast.Sub: "sub", ast.Mult: "mul", ast.Div: "div"}
_BITS = {
    ast.BitAnd: "and_",
    ast.BitOr: "or_",
    ast.BitXor: "xor",
    ast.LShift: "shl",
    ast.RShift: "ashr",
}
_COMPARED = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="}
_INTRINSICS = {
    math.sqrt: "llvm.sqrt",
    np.sqrt: "llvm.sqrt",
    math.copysign: "llvm.copysign",
    abs: "llvm.fabs",
}


class _NoValues:
    """What the code of an emitted function takes of Numba's context."""

    def make_array(self, kind: Any) -> Callable[..., Any]:
        return lambda context, builder, value: value

    def get_dummy_value(self) -> None:
        return None


class Expressions:
    """Expressions of one function; `hpcclear.base.lowering.statements.Function` has the rest of it."""

    builder: ir.IRBuilder
    names: dict[str, Any]

    def read(self, name: str) -> Any:
        """The value of a local, or of a name of the module."""
        raise NotImplementedError

    def called(self, function: Any, arguments: list[Any]) -> Any:
        """What a compiled function returns."""
        raise NotImplementedError

    # ---- numbers --------------------------------------------------------------------------------

    def value(self, known: Any) -> Any:
        """Something of Python as a value."""
        if isinstance(known, bool | np.bool_):
            return ir.Constant(TRUTH, int(known))
        if isinstance(known, int | np.integer):
            return whole(int(known))
        if isinstance(known, float):
            return ir.Constant(DOUBLE, float(known))
        if isinstance(known, np.ndarray):
            return self.constant_array(known)
        if isinstance(known, tuple):
            return rebuilt(type(known), map(self.value, known))
        return known

    def constant_array(self, known: np.ndarray) -> Array:
        """An array of the module's, as part of the code."""
        kind = DOUBLE if known.dtype == np.float64 else WHOLE
        content = ir.Constant(ir.ArrayType(kind, known.size), known.ravel().tolist())
        module = self.builder.module
        place = ir.GlobalVariable(module, content.type, module.get_unique_name("constant"))
        place.initializer, place.global_constant, place.linkage = content, True, "internal"
        return Array(self.builder.gep(place, [whole(0), whole(0)]), tuple(map(whole, known.shape)))

    def cast(self, value: Any, kind: ir.Type) -> Any:
        """A number as one of a type that holds it."""
        b = self.builder
        if value.type == kind:
            return value
        if kind == VECTOR:
            one = b.insert_element(
                ir.Constant(VECTOR, ir.Undefined),
                self.cast(value, DOUBLE),
                ir.Constant(ir.IntType(32), 0),
            )
            mask = ir.Constant(ir.VectorType(ir.IntType(32), VECTOR.count), None)
            return b.shuffle_vector(one, ir.Constant(VECTOR, ir.Undefined), mask)
        if kind == WHOLE:
            return b.zext(value, WHOLE)
        if isinstance(value, ir.Constant):
            return ir.Constant(DOUBLE, float(value.constant))
        return b.uitofp(value, DOUBLE) if value.type == TRUTH else b.sitofp(value, DOUBLE)

    def both(self, one: Any, other: Any) -> tuple[Any, Any, ir.Type]:
        """Two numbers as of one type, and the type."""
        kind = wider(one.type, other.type)
        return self.cast(one, kind), self.cast(other, kind), kind

    def truth(self, value: Any) -> Any:
        """Whether a number is not zero."""
        if value.type == TRUTH:
            return value
        if value.type == WHOLE:
            return self.builder.icmp_signed("!=", value, whole(0))
        return self.builder.fcmp_unordered("!=", value, ir.Constant(DOUBLE, 0.0))

    def binary(self, op: type[ast.operator], one: Any, other: Any) -> Any:
        """One number combined with another."""
        b = self.builder
        one, other, kind = self.both(one, other)
        if op in _BITS:
            return getattr(b, _BITS[op])(one, other)
        if kind == TRUTH or (kind == WHOLE and op is ast.Div):
            kind = DOUBLE if op is ast.Div else WHOLE
            one, other = self.cast(one, kind), self.cast(other, kind)
        if op in _ARITHMETIC:
            if kind == WHOLE:
                return getattr(b, _ARITHMETIC[op])(one, other)
            return getattr(b, f"f{_ARITHMETIC[op]}")(one, other)
        if op is ast.Pow:
            return self.intrinsic("llvm.pow", [self.cast(one, DOUBLE), self.cast(other, DOUBLE)])
        assert kind == WHOLE, "// and % are of whole numbers"
        rest = b.srem(one, other)
        signs = b.icmp_signed("<", b.xor(rest, other), whole(0))
        less = b.and_(b.icmp_signed("!=", rest, whole(0)), signs)
        if op is ast.Mod:
            return b.add(rest, b.select(less, other, whole(0)))
        assert op is ast.FloorDiv
        return b.sub(b.sdiv(one, other), b.zext(less, WHOLE))

    def compared(self, op: type[ast.cmpop], one: Any, other: Any) -> Any:
        """Whether one number compares so with another."""
        one, other, kind = self.both(one, other)
        if kind != DOUBLE:
            return self.builder.icmp_signed(_COMPARED[op], one, other)
        kept = self.builder.fcmp_unordered if op is ast.NotEq else self.builder.fcmp_ordered
        return kept(_COMPARED[op], one, other)

    def intrinsic(self, name: str, arguments: list[Any]) -> Any:
        """A function of LLVM, of doubles."""
        kind = ir.FunctionType(DOUBLE, [DOUBLE] * len(arguments))
        function = self.builder.module.declare_intrinsic(name, [DOUBLE], kind)
        return self.builder.call(function, arguments)

    def place(self, array: Array, index: list[Any]) -> Any:
        """The address of what an index names, or where a row begins."""
        offset = index[0]
        for length, one in zip(array.shape[1:], index[1:], strict=False):
            offset = self.builder.add(self.builder.mul(offset, length), one)
        for length in array.shape[len(index) :]:
            offset = self.builder.mul(offset, length)
        return self.builder.gep(array.data, [offset])

    # ---- expressions ----------------------------------------------------------------------------

    def expression(self, node: ast.expr) -> Any:
        """The value of an expression."""
        return getattr(self, f"_of_{type(node).__name__}")(node)

    def _of_Constant(self, node: ast.Constant) -> Any:
        return self.value(node.value)

    def _of_Name(self, node: ast.Name) -> Any:
        return self.read(node.id)

    def _of_Tuple(self, node: ast.Tuple) -> Any:
        return tuple(map(self.expression, node.elts))

    def _of_Attribute(self, node: ast.Attribute) -> Any:
        return self.value(getattr(self.expression(node.value), node.attr))

    def _of_BinOp(self, node: ast.BinOp) -> Any:
        one = self.expression(node.left)
        return self.binary(type(node.op), one, self.expression(node.right))

    def _of_UnaryOp(self, node: ast.UnaryOp) -> Any:
        value = self.expression(node.operand)
        if isinstance(node.op, ast.Not):
            return self.builder.not_(self.truth(value))
        assert isinstance(node.op, ast.USub)
        if isinstance(value, ir.Constant):
            return ir.Constant(value.type, -value.constant)
        if value.type == WHOLE:
            return self.builder.neg(value)
        return self.builder.fsub(self.cast(self.value(-0.0), value.type), value)

    def _of_Compare(self, node: ast.Compare) -> Any:
        one = self.expression(node.left)
        if len(node.ops) == 1:
            return self.compared(type(node.ops[0]), one, self.expression(node.comparators[0]))

        def link(k: int, one: Any) -> Any:
            other = self.expression(node.comparators[k])
            found = self.compared(type(node.ops[k]), one, other)
            if k + 1 == len(node.ops):
                return found
            return self.either(found, lambda: link(k + 1, other), lambda: found)

        return link(0, one)

    def _of_BoolOp(self, node: ast.BoolOp) -> Any:
        def link(k: int) -> Any:
            found = self.expression(node.values[k])
            if k + 1 == len(node.values):
                return found
            ways = (lambda: link(k + 1)), (lambda: found)
            return self.either(
                self.truth(found), *(ways if isinstance(node.op, ast.And) else ways[::-1])
            )

        return link(0)

    def _of_IfExp(self, node: ast.IfExp) -> Any:
        return self.either(
            self.truth(self.expression(node.test)),
            lambda: self.expression(node.body),
            lambda: self.expression(node.orelse),
        )

    def either(self, test: Any, yes: Callable[[], Any], no: Callable[[], Any]) -> Any:
        """The value of one of two branches."""
        b, ends = self.builder, []
        blocks = [b.append_basic_block() for _ in range(2)]
        last = b.append_basic_block()
        b.cbranch(test, *blocks)
        for block, branch in zip(blocks, (yes, no), strict=True):
            b.position_at_end(block)
            ends.append((branch(), b.block))
        joined = self._joined([value for value, _ in ends])
        for k, (value, block) in enumerate(ends):
            b.position_at_end(block)
            ends[k] = (self._as(value, joined), block)
            b.branch(last)
        b.position_at_end(last)
        return self._chosen(ends)

    def _joined(self, values: list[Any]) -> Any:
        """Types that hold values of two branches."""
        if isinstance(values[0], tuple):
            return [self._joined(list(pair)) for pair in zip(*values, strict=True)]
        return wider(values[0].type, values[1].type)

    def _as(self, value: Any, kinds: Any) -> Any:
        if isinstance(value, tuple):
            return tuple(map(self._as, value, kinds))
        return self.cast(value, kinds)

    def _chosen(self, ends: list[tuple[Any, ir.Block]]) -> Any:
        first = ends[0][0]
        if isinstance(first, tuple):
            return tuple(
                self._chosen([(value[k], block) for value, block in ends])
                for k in range(len(first))
            )
        chosen = self.builder.phi(first.type)
        for value, block in ends:
            chosen.add_incoming(value, block)
        return chosen

    def _of_Subscript(self, node: ast.Subscript) -> Any:
        owner, index = self.expression(node.value), node.slice
        if isinstance(index, ast.Slice):
            low, high = self.expression(index.lower), self.expression(index.upper)  # type: ignore[arg-type]
            return Array(self.builder.gep(owner.data, [low]), (self.builder.sub(high, low),))
        return self.item(owner, self.index(index))

    def index(self, node: ast.expr) -> list[Any]:
        """The numbers of an index."""
        return list(map(self.expression, node.elts if isinstance(node, ast.Tuple) else [node]))

    def item(self, owner: Any, index: list[Any]) -> Any:
        """What an index names: a number, a row, a part of a tuple."""
        if isinstance(owner, Array):
            place = self.place(owner, index)
            left = owner.shape[len(index) :]
            return Array(place, left) if left else self.builder.load(place)
        if not isinstance(owner, tuple):  # a place in memory
            return self.builder.load(self.builder.gep(owner, index))
        (one,) = index
        if isinstance(one, ir.Constant):
            return owner[one.constant]
        chosen = owner[0]
        for k, other in enumerate(owner[1:], 1):
            chosen = self.builder.select(
                self.builder.icmp_signed("==", one, whole(k)), other, chosen
            )
        return chosen

    def _of_Call(self, node: ast.Call) -> Any:
        function = self.expression(node.func)
        arguments = list(map(self.expression, node.args))
        if function in _INTRINSICS and arguments[0].type != WHOLE:
            return self.intrinsic(
                _INTRINSICS[function], [self.cast(one, DOUBLE) for one in arguments]
            )
        name = getattr(function, "__name__", "")
        own = getattr(self, f"_call_{name}", None)
        if own is not None:
            return own(*arguments)
        if isinstance(function, type):  # a named tuple
            return function(*arguments)
        if hasattr(function, "py_func"):
            return self.called(function, arguments)
        return self.emitted(function._defn, arguments)

    def emitted(self, define: Any, arguments: list[Any]) -> Any:
        """A function that emits its code."""
        numbers = [not isinstance(one, tuple | Array) for one in arguments]
        kinds = [
            NUMBA[one.type] if is_number else None
            for one, is_number in zip(arguments, numbers, strict=True)
        ]
        signature, code = define(None, *kinds)
        wanted = {kind: own for own, kind in NUMBA.items()}
        given = [
            self.cast(one, wanted[kind]) if is_number and kind in wanted else one
            for one, is_number, kind in zip(arguments, numbers, signature.args, strict=True)
        ]
        return code(_NoValues(), self.builder, signature, given)

    # ---- functions of Python, and those that views of memory are made with ----------------------

    def _call_max(self, *values: Any) -> Any:
        return self._extreme(ast.Gt, values)

    def _call_min(self, *values: Any) -> Any:
        return self._extreme(ast.Lt, values)

    def _extreme(self, op: type[ast.cmpop], values: Iterable[Any]) -> Any:
        first, *others = values
        for one in others:
            first, one, _ = self.both(first, one)
            first = self.builder.select(self.compared(op, one, first), one, first)
        return first

    def _call_abs(self, value: Any) -> Any:
        negative = self.builder.icmp_signed("<", value, whole(0))
        return self.builder.select(negative, self.builder.neg(value), value)

    def _call_int(self, value: Any) -> Any:
        return (
            self.builder.fptosi(value, WHOLE) if value.type == DOUBLE else self.cast(value, WHOLE)
        )

    def _call_float(self, value: Any) -> Any:
        return self.cast(value, DOUBLE)

    def _call_floor(self, value: Any) -> Any:
        return self._call_int(self.intrinsic("llvm.floor", [value]))

    def _call_isfinite(self, value: Any) -> Any:
        none = self.builder.fsub(value, value)
        return self.builder.fcmp_ordered("ord", none, none)

    def _call_sign(self, value: Any) -> Any:
        nothing = self.value(0.0)
        below = self.builder.select(self.compared(ast.Lt, value, nothing), self.value(-1.0), value)
        return self.builder.select(self.compared(ast.Gt, value, nothing), self.value(1.0), below)

    def _call_len(self, value: Any) -> Any:
        return value.shape[0] if isinstance(value, Array) else whole(len(value))

    def _call_carray(self, place: Any, shape: Any) -> Any:
        return Array(place, shape if isinstance(shape, tuple) else (shape,))

    def _call_beyond(self, array: Array, offset: Any) -> Any:
        return Array(self.builder.gep(array.data, [offset]), array.shape)

    def _call_borrowed(self, array: Any) -> Any:
        return array

    def _call_call_at(self, address: Any, arrays: tuple[Array, ...]) -> None:
        places = [one.data for one in arrays]
        function = ir.FunctionType(ir.VoidType(), [place.type for place in places])
        self.builder.call(self.builder.inttoptr(address, function.as_pointer()), places)
