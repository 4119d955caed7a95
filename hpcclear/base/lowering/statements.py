"""Functions of a text as functions of LLVM, each optimised on its own before those that call it, as Numba does it."""

import ast
import builtins
from collections.abc import Callable, Sequence
from typing import Any

from llvmlite import ir

from hpcclear.base.lowering.expressions import Expressions
from hpcclear.base.lowering.values import (
    DOUBLE,
    WHOLE,
    Array,
    Kind,
    flat,
    gathered,
    kind_of,
    types_of,
    whole,
    wider,
    wider_kind,
)  # fmt: skip
from hpcclear.base.text.values import definition_of


class _Wider(Exception):
    """A name holds numbers of more types than was known when its function was begun."""


class Function(Expressions):
    """One function for arguments of given kinds, lowered into a module of its own."""

    def __init__(
        self, function: Any, kinds: Sequence[Kind], name: str, flags: Any, call: Any
    ) -> None:
        self.node = definition_of(function)
        self.names = getattr(function, "py_func", function).__globals__
        self.flags = tuple(sorted(flags))
        self.kinds = kinds
        self.name, self._call = name, call
        self.types: dict[str, ir.Type] = {}  # of locals that are numbers
        self.result = Kind(None)
        while not self._lowered():
            pass
        for block in self.function.blocks:
            for one in block.instructions:
                _allow(one, self.flags)

    def _lowered(self) -> bool:
        """Lower the function; False where a type was found too narrow, which is known the next time."""
        self.module = ir.Module(self.name)
        self.function = declared(self.module, self.name, self.kinds, self.result)
        self.slots: dict[str, Any] = {}
        self.bound: dict[str, Any] = {}
        self.ends: list[ir.Block] = []
        self.first = self.function.append_basic_block("first")
        self.builder = ir.IRBuilder(self.function.append_basic_block("body"))
        passed = iter(self.function.args)
        try:
            for argument, kind in zip(self.node.args.args, self.kinds, strict=True):
                value = gathered(kind, passed)
                for part in flat((value,)):
                    part.name = argument.arg
                self.bind(argument.arg, value)
            self.several(self.node.body)
            if not self.builder.block.is_terminated:
                self.give(None)
        except _Wider:
            return False
        ir.IRBuilder(self.first).branch(self.function.blocks[1])
        return True

    # ---- names ----------------------------------------------------------------------------------

    def read(self, name: str) -> Any:
        """Value of a name: of a local, of the text's own names, or a builtin."""
        if name in self.slots:
            return self.builder.load(self.slots[name])
        if name in self.bound:
            return self.bound[name]
        known = self.names[name] if name in self.names else getattr(builtins, name)
        return self.value(known)

    def bind(self, name: str, value: Any) -> None:
        """Let a local have a value."""
        if not isinstance(value, ir.Value) or isinstance(value.type, ir.PointerType):
            assert name not in self.slots
            self.bound[name] = value
            return
        assert name not in self.bound, name
        kind = wider(self.types.get(name), value.type)
        if kind != self.types.setdefault(name, kind):
            self.types[name] = kind
            raise _Wider
        if name not in self.slots:
            self.slots[name] = ir.IRBuilder(self.first).alloca(kind, name=name)
        self.builder.store(self.cast(value, kind), self.slots[name])

    def called(self, function: Any, arguments: list[Any]) -> Any:
        """What another function of the text returns for these values."""
        kinds = tuple(map(kind_of, arguments))
        name, result = self._call(function, kinds)
        callee = self.module.globals.get(name) or declared(self.module, name, kinds, result)
        found = self.builder.call(callee, list(flat(tuple(arguments))))
        if isinstance(found.type, ir.LiteralStructType):
            parts = [self.builder.extract_value(found, k) for k in range(len(found.type.elements))]
            return gathered(result, iter(parts))
        return None if result.of is None else found

    # ---- statements -----------------------------------------------------------------------------

    def several(self, statements: list[ast.stmt]) -> None:
        """Lower statements in their order, up to one that leaves."""
        for statement in statements:
            if self.builder.block.is_terminated:
                return
            getattr(self, f"_do_{type(statement).__name__}")(statement)

    def _do_Pass(self, node: ast.Pass) -> None:
        pass

    def _do_Expr(self, node: ast.Expr) -> None:
        if not isinstance(node.value, ast.Constant):
            self.expression(node.value)

    def _do_Assign(self, node: ast.Assign) -> None:
        value = self.expression(node.value)
        self.assign(node.targets[0], value)

    def assign(self, target: ast.expr, value: Any) -> None:
        """Assign a value to a target of any form."""
        if isinstance(target, ast.Name):
            self.bind(target.id, value)
        elif isinstance(target, ast.Tuple):
            for part, one in zip(target.elts, value, strict=True):
                self.assign(part, one)
        else:
            assert isinstance(target, ast.Subscript)
            owner = self.expression(target.value)
            self.store(value, self.address(owner, self.index(target.slice)))

    def address(self, owner: Any, index: list[Any]) -> Any:
        """Where an entry of an array stands."""
        return (
            self.place(owner, index) if isinstance(owner, Array) else self.builder.gep(owner, index)
        )

    def store(self, value: Any, place: Any) -> None:
        """Put a number into memory."""
        kind = place.type.pointee
        if value.type == DOUBLE and kind == WHOLE:
            value = self.builder.fptosi(value, WHOLE)
        self.builder.store(self.cast(value, kind), place)

    def _do_AugAssign(self, node: ast.AugAssign) -> None:
        if isinstance(node.target, ast.Name):
            before = self.read(node.target.id)
            self.bind(
                node.target.id, self.binary(type(node.op), before, self.expression(node.value))
            )
            return
        assert isinstance(node.target, ast.Subscript)
        owner = self.expression(node.target.value)
        place = self.address(owner, self.index(node.target.slice))
        before = self.builder.load(place)
        self.store(self.binary(type(node.op), before, self.expression(node.value)), place)

    def _do_If(self, node: ast.If) -> None:
        b = self.builder
        yes, last = b.append_basic_block(), b.append_basic_block()
        no = b.append_basic_block() if node.orelse else last
        b.cbranch(self.truth(self.expression(node.test)), yes, no)
        for block, statements in ((yes, node.body), (no, node.orelse)):
            if block is not last:
                b.position_at_end(block)
                self.several(statements)
                if not b.block.is_terminated:
                    b.branch(last)
        b.position_at_end(last)
        if not any(_leads(block, last) for block in self.function.blocks):
            b.unreachable()

    def _do_While(self, node: ast.While) -> None:
        b = self.builder
        test, body, last = (b.append_basic_block() for _ in range(3))
        b.branch(test)
        b.position_at_end(test)
        b.cbranch(self.truth(self.expression(node.test)), body, last)
        self.loop(body, test, last, lambda: self.several(node.body))

    def loop(
        self, body: ir.Block, again: ir.Block, last: ir.Block, lower: Callable[[], None]
    ) -> None:
        """The body of a loop, and where it goes on."""
        self.builder.position_at_end(body)
        self.ends.append(last)
        lower()
        self.ends.pop()
        if not self.builder.block.is_terminated:
            self.builder.branch(again)
        self.builder.position_at_end(last)

    def _do_Break(self, node: ast.Break) -> None:
        self.builder.branch(self.ends[-1])

    def _do_For(self, node: ast.For) -> None:
        b = self.builder
        if not (isinstance(node.iter, ast.Call) and self.expression(node.iter.func) is range):
            for item in self.expression(node.iter):
                self.assign(node.target, item)
                self.several(node.body)
            return
        bounds = list(map(self.expression, node.iter.args))
        start, stop, step = (*(bounds if len(bounds) > 1 else (whole(0), *bounds)), whole(1))[:3]
        down = (
            isinstance(step, ir.Constant) and step.constant < 0
        )  # a step that comes at run time leads upward
        order = ">" if down else "<"
        counter = ir.IRBuilder(self.first).alloca(WHOLE)
        b.store(start, counter)
        test, body, last = (b.append_basic_block() for _ in range(3))
        b.branch(test)
        b.position_at_end(test)
        here = b.load(counter)
        b.cbranch(b.icmp_signed(order, here, stop), body, last)

        def lower() -> None:
            b.store(b.add(here, step, flags=("nsw",)), counter)
            self.assign(node.target, here)
            self.several(node.body)

        self.loop(body, test, last, lower)

    def _do_Return(self, node: ast.Return) -> None:
        self.give(None if node.value is None else self.expression(node.value))

    def give(self, value: Any) -> None:
        """Leave with a value."""
        if isinstance(value, ir.Value):  # a bit alone has no place in what a caller is given
            value = self.cast(value, wider(WHOLE, value.type))
        kind = kind_of(value)
        wanted = kind if self.result.of is None else wider_kind(self.result, kind)
        if wanted != self.result:
            self.result = wanted
            raise _Wider
        values = [
            self.cast(one, one_kind)
            for one, one_kind in zip(flat(value), types_of(wanted), strict=True)
        ]
        if value is None:
            self.builder.ret_void()
        elif not isinstance(value, tuple):
            self.builder.ret(values[0])
        else:
            together = ir.Constant(self.function.function_type.return_type, ir.Undefined)
            for k, one in enumerate(values):
                together = self.builder.insert_value(together, one, k)
            self.builder.ret(together)


_FLAGGED = {"fadd", "fsub", "fmul", "fdiv", "fcmp"}


def _allow(one: ir.Instruction, flags: tuple[str, ...]) -> None:
    """Allow rewrites of an instruction, if it is of doubles and does not say otherwise."""
    if one.opname in _FLAGGED and not one.flags:
        one.flags.extend(flags)
    elif isinstance(one, ir.CallInstr) and one.type == DOUBLE:
        one.fastmath.update(flags)


def declared(module: ir.Module, name: str, kinds: Sequence[Kind], result: Kind) -> ir.Function:
    """A function by its arguments and its result: nothing, a number, or a structure of a tuple's numbers."""
    returned = list(types_of(result))
    kind = (
        ir.LiteralStructType(returned)
        if isinstance(result.of, type)
        else (*returned, ir.VoidType())[0]
    )
    return ir.Function(
        module, ir.FunctionType(kind, [one for kind in kinds for one in types_of(kind)]), name
    )


def _leads(block: ir.Block, to: ir.Block) -> bool:
    end = block.terminator
    return end is not None and to in end.operands
