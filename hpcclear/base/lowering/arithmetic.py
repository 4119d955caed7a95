"""What compiled code computes with numbers: operators, functions of Python and of the kernel, vectors of eight."""

import ast
import operator
from collections.abc import Callable
from functools import partialmethod

import numpy as np
from llvmlite import ir

from hpcclear.base.lowering import values as val
from hpcclear.base.lowering.values import DOUBLE, TRUTH, VECTOR, WHOLE, Array, Value

_ARITHMETIC = {ast.Add: "add", ast.Sub: "sub", ast.Mult: "mul", ast.Div: "div"}
_BITS = {
    ast.BitAnd: "and_", ast.BitOr: "or_", ast.BitXor: "xor", ast.LShift: "shl", ast.RShift: "ashr"
}  # fmt: skip
_COMPARED = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="}
_OPERATORS: dict[type[ast.AST], Callable[..., Value]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv, ast.Mod: operator.mod, ast.Pow: operator.pow,
    ast.BitOr: operator.or_, ast.BitAnd: operator.and_, ast.LShift: operator.lshift,
    ast.Eq: operator.eq, ast.NotEq: operator.ne, ast.Lt: operator.lt, ast.LtE: operator.le,
    ast.Gt: operator.gt, ast.GtE: operator.ge, ast.Is: operator.is_, ast.IsNot: operator.is_not,
}  # fmt: skip
_ALIGNED = 8  # bytes that a row's address is known to be a multiple of


class Arithmetic:
    """Numbers of one function, and what is done with them."""

    builder: ir.IRBuilder

    # ---- numbers --------------------------------------------------------------------------------

    def value(self, known: Value) -> Value:
        """Something of Python as a value."""
        if isinstance(known, bool | np.bool_):
            return ir.Constant(TRUTH, int(known))
        if isinstance(known, int | np.integer):
            return val.whole(int(known))
        if isinstance(known, float):
            return ir.Constant(DOUBLE, float(known))
        if isinstance(known, np.ndarray):
            return self.constant_array(known)
        if isinstance(known, tuple):
            return val.rebuilt(type(known), map(self.value, known))
        return known

    def constant_array(self, known: np.ndarray) -> Array:
        """An array of the module's, as part of the code."""
        kind = DOUBLE if known.dtype == np.float64 else WHOLE
        content = ir.Constant(ir.ArrayType(kind, known.size), known.ravel().tolist())
        module = self.builder.module
        place = ir.GlobalVariable(module, content.type, module.get_unique_name("constant"))
        place.initializer, place.global_constant, place.linkage = content, True, "internal"
        first = self.builder.gep(place, [val.whole(0), val.whole(0)])
        return Array(first, tuple(map(val.whole, known.shape)))

    def cast(self, value: Value, kind: ir.Type) -> Value:
        """A number as one of a type that holds it."""
        b, value = self.builder, self.value(value)
        if value.type == kind:
            return value
        if kind == VECTOR:
            nothing, first = ir.Constant(VECTOR, ir.Undefined), ir.Constant(ir.IntType(32), 0)
            mask = ir.Constant(ir.VectorType(ir.IntType(32), VECTOR.count), None)
            one = b.insert_element(nothing, self.cast(value, DOUBLE), first)
            return b.shuffle_vector(one, nothing, mask)
        if kind == WHOLE:
            return b.zext(value, WHOLE)
        if isinstance(value, ir.Constant):
            return ir.Constant(DOUBLE, float(value.constant))
        return b.uitofp(value, DOUBLE) if value.type == TRUTH else b.sitofp(value, DOUBLE)

    def both(self, one: Value, other: Value) -> tuple[Value, Value, ir.Type]:
        """Two numbers as of one type, and the type."""
        one, other = self.value(one), self.value(other)
        kind = val.wider(one.type, other.type)
        return self.cast(one, kind), self.cast(other, kind), kind

    def truth(self, value: Value) -> Value:
        """Whether a number is not zero."""
        if val.is_known(value):
            return bool(value)
        if value.type == TRUTH:
            return value
        if value.type == WHOLE:
            return self.builder.icmp_signed("!=", value, val.whole(0))
        return self.builder.fcmp_unordered("!=", value, ir.Constant(DOUBLE, 0.0))

    def binary(self, op: type[ast.operator], one: Value, other: Value) -> Value:
        """One number combined with another."""
        if val.is_known((one, other)):
            return _OPERATORS[op](one, other)
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
        signs = b.icmp_signed("<", b.xor(rest, other), val.whole(0))
        less = b.and_(b.icmp_signed("!=", rest, val.whole(0)), signs)
        if op is ast.Mod:
            return b.add(rest, b.select(less, other, val.whole(0)))
        assert op is ast.FloorDiv
        return b.sub(b.sdiv(one, other), b.zext(less, WHOLE))

    def compared(self, op: type[ast.cmpop], one: Value, other: Value) -> Value:
        """Whether one number compares so with another."""
        if val.is_known((one, other)) or op in (ast.Is, ast.IsNot):
            return _OPERATORS[op](one, other)
        one, other, kind = self.both(one, other)
        if kind != DOUBLE:
            return self.builder.icmp_signed(_COMPARED[op], one, other)
        kept = self.builder.fcmp_unordered if op is ast.NotEq else self.builder.fcmp_ordered
        return kept(_COMPARED[op], one, other)

    def intrinsic(self, name: str, arguments: list[Value]) -> Value:
        """A function of LLVM, of doubles."""
        kind = ir.FunctionType(DOUBLE, [DOUBLE] * len(arguments))
        function = self.builder.module.declare_intrinsic(name, [DOUBLE], kind)
        return self.builder.call(function, arguments)

    def place(self, array: Array, index: list[Value]) -> Value:
        """The address of what an index names, or where a row begins."""
        offset, *others = map(self.value, index)
        for length, one in zip(array.shape[1:], others, strict=False):
            offset = self.builder.add(self.builder.mul(offset, length), one)
        for length in array.shape[len(index) :]:
            offset = self.builder.mul(offset, length)
        return self.builder.gep(array.data, [offset])

    # ---- functions of Python, and those that views of memory are made with ----------------------

    def _extreme(self, op: type[ast.cmpop], first: Value, *others: Value) -> Value:
        for one in others:
            first, one, _ = self.both(first, one)
            first = self.builder.select(self.compared(op, one, first), one, first)
        return first

    _call_max, _call_min = partialmethod(_extreme, ast.Gt), partialmethod(_extreme, ast.Lt)
    _call_float = partialmethod(cast, kind=DOUBLE)

    def _call_abs(self, value: Value) -> Value:
        negative = self.builder.icmp_signed("<", value, val.whole(0))
        return self.builder.select(negative, self.builder.neg(value), value)

    def _call_int(self, value: Value) -> Value:
        if value.type == DOUBLE:
            return self.builder.fptosi(value, WHOLE)
        return self.cast(value, WHOLE)

    def _call_floor(self, value: Value) -> Value:
        return self._call_int(self.intrinsic("llvm.floor", [value]))

    def _call_isfinite(self, value: Value) -> Value:
        none = self.builder.fsub(value, value)
        return self.builder.fcmp_ordered("ord", none, none)

    def _call_sign(self, value: Value) -> Value:
        nothing = self.value(0.0)
        below = self.builder.select(self.compared(ast.Lt, value, nothing), self.value(-1.0), value)
        return self.builder.select(self.compared(ast.Gt, value, nothing), self.value(1.0), below)

    def _call_len(self, value: Value) -> Value:
        return value.shape[0] if isinstance(value, Array) else len(value)

    def _call_carray(self, place: Value, shape: Value) -> Value:
        return Array(place, shape if isinstance(shape, tuple) else (shape,))

    def _call_beyond(self, array: Array, offset: Value) -> Value:
        return Array(self.builder.gep(array.data, [offset]), array.shape)

    def _call_call_at(self, address: Value, arrays: tuple[Array, ...]) -> None:
        places = [one.data for one in arrays]
        function = ir.FunctionType(ir.VoidType(), [place.type for place in places])
        self.builder.call(self.builder.inttoptr(address, function.as_pointer()), places)

    # ---- what `bits` and `jit` have --------------------------------------------------------------

    def _call_bits_of(self, value: Value) -> Value:
        return self.builder.bitcast(value, WHOLE)

    def _call_double_of(self, value: Value) -> Value:
        return self.builder.bitcast(value, DOUBLE)

    def _call_no_less(self, value: Value, least: Value) -> Value:
        return self._call_max(self.cast(value, DOUBLE), least)

    def _call_no_more(self, value: Value, most: Value) -> Value:
        return self._call_min(self.cast(value, DOUBLE), most)

    def _call_narrow_vectors(self) -> None:
        # llvmlite's own `add` lets only those pass that it knows
        set.add(self.builder.function.attributes, '"prefer-vector-width"="256"')

    # ---- vectors of eight -----------------------------------------------------------------------

    def _row(self, array: Array, row: Value) -> Value:
        """Address of a row of a flat array, as that of a vector."""
        start = self.builder.mul(row, val.whole(VECTOR.count))
        return self.builder.bitcast(self.builder.gep(array.data, [start]), VECTOR.as_pointer())

    def _call_fetch(self, array: Array, row: Value) -> Value:
        return self.builder.load(self._row(array, row), align=_ALIGNED)

    def _call_put(self, array: Array, row: Value, vector: Value) -> None:
        place = self._row(array, row)
        self.builder.store(self.cast(vector, VECTOR), place, align=_ALIGNED)

    _call_spread = partialmethod(cast, kind=VECTOR)

    def _call_above(self, vector: Value, yes: Value, no: Value) -> Value:
        is_above = self.builder.fcmp_ordered(">", vector, self.cast(0.0, VECTOR))
        return self.builder.select(is_above, self.cast(yes, VECTOR), self.cast(no, VECTOR))

    def _call_size(self, vector: Value) -> Value:
        bits = self.builder.bitcast(vector, ir.VectorType(WHOLE, VECTOR.count))
        mask = ir.Constant(bits.type, [val.whole((1 << 63) - 1)] * VECTOR.count)
        return self.builder.bitcast(self.builder.and_(bits, mask), VECTOR)
