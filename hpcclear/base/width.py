"""How wide the vectors are that the compiler uses: 128, 256 or, on a processor with AVX-512, 512 bits.

LLVM takes 256 bits on many processors that have 512: those slow their clock for wide vectors, or did so when its table was
written. With 512 the kernel took two thirds of the time on the two processors of `docs/performance.md`, so only those that are
known to slow down keep 256. Results do not depend on it: every number of a vector is computed as it would be alone.
"""

import os
import re
from pathlib import Path

import llvmlite.binding as llvm

from hpcclear.base.errors import InputError

WIDTHS = (128, 256, 512)

SLOWED = ("skylake-avx512", "cascadelake", "cooperlake", "cannonlake")
"""Processors, as LLVM calls them, whose clock falls with wide vectors (Intel's first generations of AVX-512)."""

_PREFERENCE = {128: "+prefer-128-bit", 256: "+prefer-256-bit", 512: "-prefer-256-bit"}


def asked_width() -> int | None:
    """The width that ``HPCCLEAR_VECTOR_BITS`` names; None where it is not set. Raises InputError if it is none of `WIDTHS`."""
    asked = os.environ.get("HPCCLEAR_VECTOR_BITS", "")
    if asked not in ("", *map(str, WIDTHS)):
        raise InputError(
            "HPCCLEAR_VECTOR_BITS", asked, "is not a vector width",
            "Set it to 128, 256 or 512, or leave it unset: the width then goes by the processor",
        )  # fmt: skip
    return int(asked) if asked else None


def features() -> str | None:
    """The processor's features for Numba; None where there is nothing to choose. Raises InputError as `asked_width`."""
    asked = asked_width()
    known = llvm.get_host_cpu_features()
    if asked != 128 and not known.get("avx512f", False):
        return None
    usual = 256 if llvm.get_host_cpu_name() in SLOWED else 512
    return f"{known.flatten()},{_PREFERENCE[asked or usual]}"


def doubles_in_a_vector() -> int:
    """Numbers that a vector register of this processor holds: 8, 4 or 2."""
    known = llvm.get_host_cpu_features()
    if known.get("avx512f", False):
        return 8
    return 4 if known.get("avx", False) else 2


USUAL = 32 * 1024
"""Bytes where the system does not say."""


def first_level_cache() -> int:
    """Bytes of a core's first-level cache of data, as Linux states it of the first core; `USUAL` where it does not."""
    for index in sorted(Path("/sys/devices/system/cpu/cpu0/cache").glob("index*")):
        try:
            said = " ".join((index / name).read_text() for name in ("level", "type", "size"))
        except OSError:
            continue
        if found := re.fullmatch(r"1\s+(?:Data|Unified)\s+(\d+)K\s*", said):
            return int(found[1]) * 1024
    return USUAL
