"""What the compiler emitted: how much of the floating-point arithmetic works on whole vectors."""

import re
from collections import Counter
from functools import cache
from typing import NamedTuple

from hpcclear.base.jit import FASTMATH
from hpcclear.base.lowering.compiled import assembly_of, optimised_module
from hpcclear.base.lowering.values import DOUBLES
from hpcclear.dynamics.layout import Effects
from hpcclear.dynamics.linkage.linkage import Linkage
from hpcclear.dynamics.stepping.problem import Problem

# x86-64: vaddpd, vfmadd213sd, sqrtpd, vrndscalepd (floor) ...; "p" packed, "s" scalar, "d" double
_X86 = re.compile(
    r"^\s+v?(add|sub|mul|div|sqrt|max|min|addsub|round|rndscale|reduce|rcp14|rsqrt14|fn?m(?:add|sub)\d+)"
    r"([ps])d\s+(.*)$"
)
# AArch64: fadd v0.2d, ... packed; fadd d0, ... scalar
_ARM = re.compile(
    r"^\s+(f(?:add|sub|mul|div|sqrt|max|min|maxnm|minnm|madd|msub|nmadd|nmsub|mla|mls|rintm|abd))\s+"
    r"([vzd])\d+(.*)$"
)


_LABEL = re.compile(r"^(\.?L\w+):")
_JUMP = re.compile(r"^\s+(?:j\w+|b(?:\.\w+)?|cbn?z\s+\w+,|tbn?z\s+\w+,\s*#?\d+,)\s+(\.?L\w+)")


class Arithmetic(NamedTuple):
    """Floating-point instructions of some assembly text."""

    packed: Counter[str]  # by mnemonic, vector instructions
    scalar: Counter[str]
    vector_bits: int  # widest registers that appear
    fallback: int = 0  # scalar instructions left out, see `executed_arithmetic`

    @property
    def packed_share(self) -> float:
        """Share of the arithmetic instructions that work on whole vectors; NaN if there are none."""
        packed, scalar = self.packed.total(), self.scalar.total()
        return packed / (packed + scalar) if packed + scalar else float("nan")


def count_arithmetic(assembly: str) -> Arithmetic:
    """Count double-precision arithmetic in assembly text of x86-64 or AArch64."""
    packed: Counter[str] = Counter()
    scalar: Counter[str] = Counter()
    bits = 64
    for line in assembly.splitlines():
        if (found := _X86.match(line)) is not None:
            is_packed, name = found[2] == "p", found[1]
            if is_packed:
                bits = max(bits, 512 if "zmm" in line else 256 if "ymm" in line else 128)
        elif (found := _ARM.match(line)) is not None:
            is_packed, name = found[2] in "vz", found[1]
            bits = max(bits, 128 if is_packed else 64)
        else:
            continue
        (packed if is_packed else scalar)[
            re.sub(r"\d+$", "", name.replace("rndscale", "round"))
        ] += 1
    return Arithmetic(packed, scalar, bits)


def innermost_loops(assembly: str) -> list[str]:
    """Bodies of the innermost loops: from a label to a jump back to it, with no other such pair inside."""
    lines = assembly.splitlines()
    labels = {found[1]: k for k, line in enumerate(lines) if (found := _LABEL.match(line))}
    spans = [
        (labels[found[1]], k)
        for k, line in enumerate(lines)
        if (found := _JUMP.match(line)) and labels.get(found[1], k) < k
    ]
    inner = [
        (i, j)
        for i, j in spans
        if not any((i, j) != (a, b) and i <= a and b <= j for a, b in spans)
    ]
    return ["\n".join(lines[i : j + 1]) for i, j in inner]


def executed_arithmetic(assembly: str) -> Arithmetic:
    """The arithmetic that runs: without the scalar copies of vector loops, kept for buffers that overlap.

    The compiler cannot know that two buffers never overlap; it asks once before a loop and keeps a scalar copy of
    it. A copy is a loop with nothing packed and, kind by kind, exactly the arithmetic of a vector loop.
    """
    everything = count_arithmetic(assembly)
    loops = [count_arithmetic(body) for body in innermost_loops(assembly)]
    vector = [loop.packed for loop in loops if loop.packed.total() > loop.scalar.total()]
    copies = [
        loop.scalar for loop in loops if not loop.packed and loop.scalar and loop.scalar in vector
    ]
    scalar = everything.scalar.copy()
    for copy in copies:
        scalar.subtract(copy)
    left_out = sum(copy.total() for copy in copies)
    return Arithmetic(everything.packed, +scalar, everything.vector_bits, left_out)


def force_evaluation(problem: Problem, width: int) -> str:
    """Assembly of a problem's force evaluation for `width` lanes, as steppers call it."""
    return _compiled(problem.linkage, problem.effects, width)


@cache
def _compiled(linkage: Linkage, effects: Effects, width: int) -> str:
    motion = linkage.module(effects).motion
    module = optimised_module(
        motion, (DOUBLES, DOUBLES), FASTMATH, "motion", effects=effects, W=width
    )
    return assembly_of(module)
