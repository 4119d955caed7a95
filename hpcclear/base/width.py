"""How wide the vectors are that the compiler uses on a processor with AVX-512: 256 or 512 bits, as a short trial finds.

LLVM goes by the processor's name, and takes 256 bits on many that have 512: those slow their clock for wide vectors, or did so
when the table was written. On one of them the kernel took two thirds of its time with 512. So a loop that is made like the
force evaluation, of products, roots and quotients, is timed with both, a tenth of a second once a processor; the answer is
kept beside the compiled code. Results do not depend on it: every number of a vector is computed as it would be alone.
"""

import ctypes
import hashlib
import os
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import llvmlite
import llvmlite.binding as llvm

from hpcclear.base.errors import InputError

WIDTHS = (256, 512)
GAIN = 0.95
"""Share of the time that 512 bits have to stay below: they heat, and slow what else runs on the processor."""

_LANES, _TURNS = 64, 50
_PRODUCTS = 60
"""With a sum each, to two roots and a quotient: as many instructions of multipliers and adders as in a joint's force. With 24,
what the divider takes, which is the same at both widths on some processors, hid what wide vectors save elsewhere."""

_PHASES, _PHASE = 3, 0.01  # s; long enough for the clock to follow the vectors' width
_CALLS = 200  # of a phase that are counted at least, some microseconds each
_PREFERENCE = {256: "+prefer-256-bit", 512: "-prefer-256-bit"}

_TRIAL = """
declare double @llvm.sqrt.f64(double)
declare double @llvm.fabs.f64(double)

define void @trial(ptr noalias %x, ptr noalias %y, i64 %turns) {{
entry:
  br label %turn
turn:
  %k = phi i64 [ 0, %entry ], [ %k1, %again ]
  br label %lane
lane:
  %i = phi i64 [ 0, %turn ], [ %i1, %lane ]
  %px = getelementptr double, ptr %x, i64 %i
  %py = getelementptr double, ptr %y, i64 %i
  %px0 = load double, ptr %px
  %py0 = load double, ptr %py
  %aa = fmul contract double %px0, %px0
  %bb = fmul contract double %py0, %py0
  %s0 = fadd contract double %aa, %bb
  %s = fadd contract double %s0, 1.0
  %root = call double @llvm.sqrt.f64(double %s)
  %inverse = fdiv double 1.0, %root
{products}
  %sum = fadd contract double %a{last}, %b{last}
  %gap = fsub double %root, %sum
  %size = call double @llvm.fabs.f64(double %gap)
  %depth = call double @llvm.sqrt.f64(double %size)
  %force = fmul contract double %depth, %inverse
  %part = fmul contract double %force, 1.0e-3
  %new = fadd contract double %py0, %part
  store double %new, ptr %py
  %i1 = add i64 %i, 1
  %more = icmp ult i64 %i1, {lanes}
  br i1 %more, label %lane, label %again
again:
  %k1 = add i64 %k, 1
  %go = icmp ult i64 %k1, %turns
  br i1 %go, label %turn, label %done
done:
  ret void
}}
"""


def asked_width() -> int | None:
    """The width that ``HPCCLEAR_VECTOR_BITS`` names; None where it is not set.

    Raises
    ------
    InputError
        If it is set to anything but 256 or 512.
    """
    asked = os.environ.get("HPCCLEAR_VECTOR_BITS", "")
    if asked not in ("", *map(str, WIDTHS)):
        raise InputError(
            "HPCCLEAR_VECTOR_BITS", asked, "is not a vector width",
            "Set it to 256 or 512, or leave it unset: the faster one is then measured and used",
        )  # fmt: skip
    return int(asked) if asked else None


def features(folder: Path) -> str | None:
    """The processor's features as they are passed to Numba; None where there is nothing to choose.

    Parameters
    ----------
    folder : Path
        Of this user and this machine; what was found is kept there.

    Raises
    ------
    InputError
        Of `asked_width`.
    """
    asked = asked_width()
    known = llvm.get_host_cpu_features()
    if not known.get("avx512f", False):
        return None
    flat = known.flatten()
    words = f"{llvm.get_host_cpu_name()} {llvmlite.__version__} {flat}"
    place = folder / f"vector-bits-{hashlib.sha256(words.encode()).hexdigest()[:12]}"
    return f"{flat},{_PREFERENCE[asked or kept(place, faster)]}"


def kept(place: Path, measure: Callable[[], int]) -> int:
    """The width that a file holds; measured where there is none, and of several that do so at once the first is everybody's."""
    if (found := _read(place)) is None:
        mine = measure()
        try:
            _keep(place, str(mine))
        except OSError:
            return mine  # a full disk: measured again the next time
        found = _read(place)
    return WIDTHS[0] if found is None else found


def _read(place: Path) -> int | None:
    try:
        found = int(place.read_text())
    except (OSError, ValueError):
        return None
    return found if found in WIDTHS else None


def _keep(place: Path, text: str) -> None:
    """Written whole or not at all; one that is there and readable stays."""
    with tempfile.NamedTemporaryFile("w", dir=place.parent, suffix=".part", delete=False) as part:
        part.write(text)
    try:
        if place.exists() and _read(place) is None:  # damaged
            os.replace(part.name, place)
        else:
            os.link(part.name, place)
    except FileExistsError:
        pass
    finally:
        Path(part.name).unlink(missing_ok=True)


def faster() -> int:
    """512 if the trial takes less than `GAIN` of the time with it; else 256, also where LLVM cannot compile the trial."""
    try:
        trials = {width: compiled(width) for width in WIDTHS}
    except RuntimeError:  # of another version: nothing depends on it but speed
        return 256
    x, y = ((ctypes.c_double * _LANES)(*[0.5 + k / _LANES for k in range(_LANES)]) for _ in "xy")
    best = dict.fromkeys(WIDTHS, float("inf"))
    for _ in range(_PHASES):
        for width, trial in trials.items():
            begun = now = time.perf_counter()
            counted = 0  # on a busy machine a phase may pass with hardly a call
            while now - begun < _PHASE or counted < _CALLS:
                before = now
                trial(x, y, _TURNS)
                now = time.perf_counter()
                if now - begun > _PHASE / 2:
                    best[width] = min(best[width], now - before)
                    counted += 1
    return 512 if best[512] < GAIN * best[256] else 256


def compiled(width: int) -> Callable[..., None]:
    """The trial for vectors of so many bits, a C function of two arrays of `_LANES` doubles and a number of turns."""
    products = []
    # Two chains, so that it is the units that are timed and not how long a result takes.
    for chain, first in (("a", "%px0"), ("b", "%py0")):
        products.append(f"  %{chain}0 = fmul contract double %inverse, {first}")
        for k in range(_PRODUCTS // 2):
            products.append(f"  %m{chain}{k} = fmul contract double %{chain}{k}, %inverse")
            products.append(f"  %{chain}{k + 1} = fadd contract double %m{chain}{k}, 0.25")
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    text = _TRIAL.format(products="\n".join(products), last=_PRODUCTS // 2, lanes=_LANES)
    machine = llvm.Target.from_default_triple().create_target_machine(
        cpu=llvm.get_host_cpu_name(),
        features=f"{llvm.get_host_cpu_features().flatten()},{_PREFERENCE[width]}",
        opt=3, jit=True,
    )  # fmt: skip
    module = llvm.parse_assembly(text)
    options = llvm.create_pipeline_tuning_options(speed_level=3)
    options.loop_vectorization = True
    passes = llvm.create_pass_builder(machine, options)
    passes.getModulePassManager().run(module, passes)
    engine = llvm.create_mcjit_compiler(module, machine)
    engine.finalize_object()
    kind = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int64)
    trial = kind(engine.get_function_address("trial"))
    _engines.append(engine)
    return trial


_engines: list[llvm.ExecutionEngine] = []
"""What holds the code of trials."""
