"""Functions of the kernel as functions of LLVM: calls written out, branches that are known left out.

Functions that `hpcclear.base.jit` marks are written out where they are called by one of their kind. The others, and those that
return from inside a loop, become functions of their own, each optimised before those that call it.
"""

import ast
import builtins
import linecache
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from functools import cache

import numpy as np
from llvmlite import ir

from hpcclear.base.lowering import values as val
from hpcclear.base.lowering.expressions import Expressions
from hpcclear.base.lowering.values import DOUBLE, WHOLE, Array, Flags, Kind, Value


@cache
def _definitions(path: str) -> dict[str, ast.FunctionDef]:
    """Functions at the top of a file, or of a generated source."""
    tree = ast.parse("".join(linecache.getlines(path)))
    return {node.name: node for node in tree.body if isinstance(node, ast.FunctionDef)}


def definition_of(function: Value) -> ast.FunctionDef:
    """The syntax tree of a function at the top of its module (compiled or not)."""
    function = getattr(function, "py_func", function)
    return _definitions(function.__code__.co_filename)[function.__name__]


@cache
def _returns_inside_a_loop(function: Value) -> bool:
    loops = (n for n in ast.walk(definition_of(function)) if isinstance(n, ast.For | ast.While))
    return any(isinstance(n, ast.Return) for loop in loops for n in ast.walk(loop))


class _Wider(Exception):
    """A name holds numbers of more types than was known when its function was begun."""


class _Frame:
    """One call that is written out: its names, and where it leaves."""

    def __init__(self, function: Value, number: int) -> None:
        self.node = definition_of(function)
        self.names = getattr(function, "py_func", function).__globals__
        self.number = number
        found = (n for n in ast.walk(self.node) if isinstance(n, ast.Name))
        self.assigned = Counter(n.id for n in found if isinstance(n.ctx, ast.Store))
        self.slots: dict[str, Value] = {}
        self.bound: dict[str, Value] = {}
        self.loops: list[ir.Block] = []
        self.returned: dict[ir.Block, Value] = {}


class Function(Expressions):
    """One function for arguments of given kinds, lowered into a module of its own."""

    def __init__(
        self, function: Value, kinds: Sequence[Kind], name: str, flags: Flags, call: Value
    ) -> None:
        self.kind = getattr(function, "kind", "lane")
        self.lowers, self.kinds = function, kinds
        self.name, self._call = name, call
        self.types: dict[tuple[int, str], ir.Type] = {}  # of locals that are numbers, by call
        self.result = Kind(None)
        while not self._lowered():
            pass
        for block in self.function.blocks:
            for one in block.instructions:
                _allow(one, tuple(sorted(flags)))

    def _lowered(self) -> bool:
        """Lower the function; False where a type was found too narrow, which is known the next time."""
        self.module = ir.Module(self.name)
        self.function = declared(self.module, self.name, self.kinds, self.result)
        self.first = self.function.append_basic_block("first")
        self.builder = ir.IRBuilder(self.function.append_basic_block("body"))
        self.frame, self.calls = _Frame(self.lowers, 0), 0
        passed = iter(self.function.args)
        names = [one.arg for one in self.frame.node.args.args]
        values = [val.gathered(kind, passed) for kind in self.kinds]
        try:
            self.enter(dict(zip(names, values, strict=True)))
            if not self.ended():
                self.give(None)
        except _Wider:
            return False
        ir.IRBuilder(self.first).branch(self.function.blocks[1])
        return True

    # ---- names and calls ------------------------------------------------------------------------

    def read(self, name: str) -> Value:
        """Value of a name: of a local, of the function's module, or a builtin."""
        here = self.frame
        if name in here.slots:
            return self.builder.load(here.slots[name])
        if name in here.bound:
            return here.bound[name]
        return here.names[name] if name in here.names else getattr(builtins, name)

    def bind(self, name: str, value: Value) -> None:
        """Let a local have a value; a number that another may follow gets a place in memory."""
        here = self.frame
        known = val.is_known(value) and here.assigned[name] <= 1
        if known or not _is_number(value):
            here.slots.pop(name, None)
            here.bound[name] = value
            return
        value, key = self.value(value), (here.number, name)
        kind = val.wider(self.types.get(key), value.type)
        if kind != self.types.setdefault(key, kind):
            self.types[key] = kind
            raise _Wider
        if name not in here.slots:
            here.slots[name] = ir.IRBuilder(self.first).alloca(kind, name=name)
            here.bound.pop(name, None)
        self.builder.store(self.cast(value, kind), here.slots[name])

    def enter(self, values: dict[str, Value]) -> None:
        """Lower the body of the present call for values of its parameters."""
        here = self.frame
        for name, value in values.items():
            here.assigned[name] += 1
            if here.assigned[name] > 1:
                self.bind(name, value)
            else:
                here.bound[name] = value
        self.several(here.node.body)

    def called(self, function: Value, arguments: list[Value], named: dict[str, Value]) -> Value:
        """What another function returns for these values."""
        plain = function.py_func
        names = [one.arg for one in definition_of(plain).args.args]
        given = dict(zip(names, arguments, strict=False)) | named
        defaults = plain.__defaults__ or ()
        given = dict(zip(names[len(names) - len(defaults) :], defaults, strict=True)) | given
        values = {name: given[name] for name in names}
        inside = getattr(function, "kind", None) == self.kind and not function.apart
        if inside and not _returns_inside_a_loop(function):
            return self.inlined(function, values)
        return self.beside(function, list(values.values()))

    def inlined(self, function: Value, values: dict[str, Value]) -> Value:
        """What a function returns that is written out here."""
        self.calls += 1
        outer, self.frame = self.frame, _Frame(function, self.calls)
        self.enter(values)
        if not self.ended():
            self.frame.returned[self.builder.block] = None
        returned, self.frame = self.frame.returned, outer
        return self.merged([(value, block) for block, value in returned.items()])

    def beside(self, function: Value, arguments: list[Value]) -> Value:
        """What a function of its own returns."""
        arguments = [self.value(a) if isinstance(a, np.ndarray) else a for a in arguments]
        kinds = tuple(val.kind_of(one, known=True) for one in arguments)
        name, result = self._call(function, kinds)
        callee = self.module.globals.get(name) or declared(self.module, name, kinds, result)
        given = [one for one in val.flat(tuple(arguments)) if isinstance(one, ir.Value)]
        found = self.builder.call(callee, given)
        if isinstance(found.type, ir.LiteralStructType):
            parts = [self.builder.extract_value(found, k) for k in range(len(found.type.elements))]
            return val.gathered(result, iter(parts))
        return None if result.of is None else found

    # ---- statements -----------------------------------------------------------------------------

    def ended(self) -> bool:
        """Whether nothing may follow in the present block."""
        block = self.builder.block
        return block.is_terminated or block in self.frame.returned

    def several(self, statements: Iterable[ast.stmt]) -> None:
        """Lower statements in their order, up to one that leaves."""
        for statement in statements:
            if self.ended():
                return
            getattr(self, f"_do_{type(statement).__name__}")(statement)

    def _do_Pass(self, node: ast.Pass | ast.Assert) -> None:
        pass

    _do_Assert = _do_Pass

    def _do_Expr(self, node: ast.Expr) -> None:
        self.expression(node.value)

    def _do_AnnAssign(self, node: ast.AnnAssign) -> None:
        assert isinstance(node.value, ast.expr)
        value = {} if isinstance(node.value, ast.Dict) else self.expression(node.value)
        self.assign(node.target, value)

    def _do_Assign(self, node: ast.Assign) -> None:
        self.assign(node.targets[0], self.expression(node.value))

    def assign(self, target: ast.expr, value: Value) -> None:
        """Assign a value to a target of any form."""
        if isinstance(target, ast.Name):
            self.bind(target.id, value)
        elif isinstance(target, ast.Tuple):
            for part, one in zip(target.elts, value, strict=True):
                self.assign(part, one)
        else:
            assert isinstance(target, ast.Subscript)
            owner, index = self.expression(target.value), self.expression(target.slice)
            if isinstance(owner, dict):
                owner[index] = value
            else:
                self.store(value, self.address(owner, index))

    def address(self, owner: Value, index: Value) -> Value:
        """Where an entry of an array stands."""
        places = list(map(self.value, index if isinstance(index, tuple) else [index]))
        if isinstance(owner, Array):
            return self.place(owner, places)
        return self.builder.gep(owner, places)

    def store(self, value: Value, place: Value) -> None:
        """Put a number into memory."""
        kind, value = place.type.pointee, self.value(value)
        if value.type == DOUBLE and kind == WHOLE:
            value = self.builder.fptosi(value, WHOLE)
        self.builder.store(self.cast(value, kind), place)

    def _do_AugAssign(self, node: ast.AugAssign) -> None:
        op = type(node.op)
        if isinstance(node.target, ast.Name):
            before = self.read(node.target.id)
            self.bind(node.target.id, self.binary(op, before, self.expression(node.value)))
            return
        assert isinstance(node.target, ast.Subscript)
        owner, index = self.expression(node.target.value), self.expression(node.target.slice)
        place = self.address(owner, index)
        before = self.builder.load(place)
        self.store(self.binary(op, before, self.expression(node.value)), place)

    def _do_If(self, node: ast.If) -> None:
        test = self.truth(self.expression(node.test))
        if val.is_known(test):
            self.several(node.body if test else node.orelse)
            return
        b = self.builder
        yes, no, last = (b.append_basic_block() for _ in range(3))
        b.cbranch(test, yes, no)
        reached = False
        for block, statements in ((yes, node.body), (no, node.orelse)):
            b.position_at_end(block)
            self.several(statements)
            if not self.ended():
                b.branch(last)
                reached = True
        b.position_at_end(last)
        if not reached:
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
        self.frame.loops.append(last)
        lower()
        self.frame.loops.pop()
        if not self.ended():
            self.builder.branch(again)
        self.builder.position_at_end(last)

    def _do_Break(self, node: ast.Break) -> None:
        self.builder.branch(self.frame.loops[-1])

    def _do_For(self, node: ast.For) -> None:
        ranges = isinstance(node.iter, ast.Call) and self.expression(node.iter.func) is range
        bounds = list(map(self.expression, node.iter.args)) if ranges else []  # type: ignore[attr-defined]
        few = val.is_known(tuple(bounds)) and len(range(*bounds)) <= 1 if ranges else True
        leaves = any(isinstance(n, ast.Break) for s in node.body for n in ast.walk(s))
        if few and not (ranges and leaves):
            for item in range(*bounds) if ranges else self.expression(node.iter):
                self.settle(node.target, item)
                self.several(node.body)
            return
        b = self.builder
        start, stop, step = (*(bounds if len(bounds) > 1 else (0, *bounds)), 1)[:3]
        down = val.is_known(step) and step < 0  # a step that comes at run time leads upward
        counter = ir.IRBuilder(self.first).alloca(WHOLE)
        b.store(self.value(start), counter)
        test, body, last = (b.append_basic_block() for _ in range(3))
        b.branch(test)
        b.position_at_end(test)
        here = b.load(counter)
        b.cbranch(b.icmp_signed(">" if down else "<", here, self.value(stop)), body, last)

        def lower() -> None:
            b.store(b.add(here, self.value(step), flags=("nsw",)), counter)
            self.assign(node.target, here)
            self.several(node.body)

        self.loop(body, test, last, lower)

    def settle(self, target: ast.expr, item: Value) -> None:
        """Let the variables of a loop that is written out be an item, known for its turn."""
        if isinstance(target, ast.Tuple):
            for part, one in zip(target.elts, item, strict=True):
                self.settle(part, one)
        elif isinstance(target, ast.Name) and val.is_known(item):
            self.frame.slots.pop(target.id, None)
            self.frame.bound[target.id] = item
        else:
            self.assign(target, item)

    def _do_Return(self, node: ast.Return) -> None:
        value = None if node.value is None else self.expression(node.value)
        if self.frame.number:
            self.frame.returned[self.builder.block] = value
        else:
            self.give(value)

    def give(self, value: Value) -> None:
        """Leave the function with a value."""
        value = self.value(value)
        if isinstance(value, ir.Value):  # a bit alone has no place in what a caller is given
            value = self.cast(value, val.wider(WHOLE, value.type))
        kind = val.kind_of(value)
        wanted = kind if self.result.of is None else val.wider_kind(self.result, kind)
        if wanted != self.result:
            self.result = wanted
            raise _Wider
        pairs = zip(val.flat(value), val.types_of(wanted), strict=True)
        values = [self.cast(one, one_kind) for one, one_kind in pairs]
        if value is None:
            self.builder.ret_void()
        elif not isinstance(value, tuple):
            self.builder.ret(values[0])
        else:
            together = ir.Constant(self.function.function_type.return_type, ir.Undefined)
            for k, one in enumerate(values):
                together = self.builder.insert_value(together, one, k)
            self.builder.ret(together)


def _is_number(value: Value) -> bool:
    """Whether a value is one number, which a place in memory can hold."""
    if isinstance(value, ir.Value):
        return not isinstance(value.type, ir.PointerType)
    return isinstance(value, bool | int | float)


_FLAGGED = {"fadd", "fsub", "fmul", "fdiv", "fcmp"}


def _allow(one: ir.Instruction, flags: tuple[str, ...]) -> None:
    """Allow rewrites of an instruction, if it is of doubles and does not say otherwise."""
    if one.opname in _FLAGGED and not one.flags:
        one.flags.extend(flags)
    elif isinstance(one, ir.CallInstr) and one.type == DOUBLE:
        one.fastmath.update(flags)


def declared(module: ir.Module, name: str, kinds: Sequence[Kind], result: Kind) -> ir.Function:
    """A function by its arguments and its result: nothing, a number, or a structure of a tuple's numbers."""
    returned = list(val.types_of(result))
    several = isinstance(result.of, type)
    kind = ir.LiteralStructType(returned) if several else (*returned, ir.VoidType())[0]
    passed = [one for kind in kinds for one in val.types_of(kind)]
    return ir.Function(module, ir.FunctionType(kind, passed), name)
