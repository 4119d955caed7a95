"""Lowered functions as machine code: optimised by LLVM, kept on disk, called by their addresses or from Python."""

import ctypes
import linecache
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import llvmlite.binding as llvm
from llvmlite import ir
from numba.core.registry import cpu_target

from hpcclear.base import kept
from hpcclear.base.cached import features_in_use
from hpcclear.base.code_folder import chosen_folder, source_key
from hpcclear.base.lowering.statements import Function, definition_of
from hpcclear.base.lowering.values import DOUBLE, WHOLE, Flags, Kind, Value, flat, kind_of, types_of
from hpcclear.base.width import doubles_in_a_vector


def _target() -> llvm.TargetMachine:
    """The processor that code is for, as Numba has it: with the features of `hpcclear.base.width` or of the user's settings."""
    return cpu_target.target_context.codegen()._tm


@contextmanager
def interleaved(lanes: int) -> Iterator[None]:
    """Have loops over so many lanes that are compiled inside taken all at once, vector by vector in one batch.

    The work on one vector waits for its own roots and quotients, and the processor looks too few instructions ahead to begin
    with the next: a force evaluation took one and a half times as long. LLVM would interleave only what needs no more
    registers than there are. Every number is computed as it would be alone.
    """
    option = "-force-vector-interleave={}"
    half = "+prefer-256-bit" in features_in_use()  # vectors take half of a register
    vectors = max(lanes // min(doubles_in_a_vector(), 4 if half else 8), 1)
    llvm.set_option("", option.format(vectors))
    try:
        yield
    finally:
        llvm.set_option("", option.format(0))  # as LLVM finds best


class _Code(NamedTuple):
    """A function's optimised code, by its name in it, and the kind of its result."""

    module: llvm.ModuleRef
    name: str
    result: Kind


class _Program:
    """The functions that one function is made of: each optimised on its own (`jit.apart`), then linked into its callers."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.known: dict[tuple[object, ...], _Code] = {}

    def code(
        self, function: Value, kinds: Sequence[Kind], flags: Flags, name: str, inlined: bool = False
    ) -> _Code:
        """Optimised code of a function for arguments of these kinds."""
        called: dict[str, _Code] = {}

        def call(other: Value, kinds: tuple[Kind, ...]) -> tuple[str, Kind]:
            options = other.targetoptions
            fast = options.get("fastmath", flags)  # as with Numba, its caller's if it has none
            key = other, kinds, frozenset(fast)
            if key not in self.known:
                own = f"{self.name}.{other.__name__}.{len(self.known)}"
                within = options.get("forceinline", False)
                self.known[key] = self.code(other, kinds, fast, own, within)
            found = self.known[key]
            called[found.name] = found
            return found.name, found.result

        lowered = Function(function, kinds, name, flags, call)
        if inlined:
            lowered.function.attributes.add("alwaysinline")
        module = _optimised(lowered.module, [one.module for one in called.values()])
        if name != self.name:  # no more than its callers need of it
            module.get_function(name).linkage = "linkonce_odr"
        return _Code(module, name, lowered.result)


def _optimised(written: ir.Module, called: Sequence[llvm.ModuleRef]) -> llvm.ModuleRef:
    """A module after LLVM's passes: cheap ones, which bring what it calls into it, then all."""
    target = _target()
    module = llvm.parse_assembly(str(written))
    module.data_layout = str(target.target_data)
    module.triple = target.triple
    module.verify()

    def builder(level: int, vectors: bool, unrolled: bool) -> llvm.PassBuilder:
        options = llvm.create_pipeline_tuning_options()
        options.speed_level = level
        options.loop_vectorization, options.loop_unrolling = vectors, unrolled
        options.slp_vectorization = False
        return llvm.create_pass_builder(target, options)

    # a loop over calls is short, and would be unrolled before they are inlined
    first = builder(3, True, False)
    for function in module.functions:
        first.getFunctionPassManager().run(function, first)
    for one in called:
        module.link_in(one, preserve=True)
    cheap = builder(0, False, True)
    passes = cheap.getModulePassManager()
    passes.add_loop_rotate_pass()
    passes.add_instruction_combine_pass()
    passes.add_jump_threading_pass()
    passes.run(module, cheap)
    full = builder(3, True, True)
    full.getModulePassManager().run(module, full)
    return module


def optimised_module(
    function: Value, kinds: Sequence[Kind], flags: Flags, name: str, **known: Value
) -> llvm.ModuleRef:
    """Return the optimised code of a function by a name, which `str` shows; other arguments as of `Compiled`."""
    others = iter(kinds)
    parameters = [one.arg for one in definition_of(function).args.args]
    every = [kind_of(known[p], known=True) if p in known else next(others) for p in parameters]
    return _Program(name).code(function, every, flags, name).module


def assembly_of(module: llvm.ModuleRef) -> str:
    """Return the assembly of optimised code."""
    return str(_target().emit_assembly(module))


class Compiled:
    """A function as machine code. `address` is what C functions are called by; Python calls the object.

    The function stands at the top of a module, and is marked by `lane_function` or `scalar_function` if calls are to be
    written out. `known` are the parameters that are known: numbers, None, tuples of them; the code has the others, of these
    `kinds`. `flags`: rewrites allowed in its arithmetic; `result`: what it returns to Python, a truth value as a whole
    number.
    """

    def __init__(
        self, function: Value, kinds: Sequence[Kind], flags: Flags, result: Value = None, **known: Value
    ) -> None:  # fmt: skip
        plain = getattr(function, "py_func", function)
        asked = repr((
            source_key(), linecache.getlines(plain.__code__.co_filename), plain.__qualname__,
            kinds, sorted(known.items()), sorted(flags), features_in_use(),
        ))  # fmt: skip
        name = f"{plain.__name__}.{kept.digest(asked.encode()).hex()[:32]}"
        path = Path(chosen_folder()) / f"{name}.code"

        def compiled() -> bytes:
            module = optimised_module(function, kinds, flags, name, **known)
            return bytes(_target().emit_object(module))

        code = kept.made(path, compiled)
        # which keeps the machine code of this process
        engine = cpu_target.target_context.codegen()._engine._ee
        engine.add_object_file(llvm.ObjectFileRef.from_data(code))
        engine.finalize_object()
        self.address = int(engine.get_function_address(name))
        passed: dict[ir.Type, type] = {DOUBLE: ctypes.c_double, WHOLE: ctypes.c_int64}
        numbers = [passed.get(one, ctypes.c_void_p) for kind in kinds for one in types_of(kind)]
        self._call = ctypes.PYFUNCTYPE(result, *numbers)(self.address)

    def __call__(self, *arguments: object) -> Value:
        """Call it with Python's numbers, and arrays by their addresses."""
        return self._call(*flat(arguments))
