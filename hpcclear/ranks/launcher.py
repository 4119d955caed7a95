"""What started this process: mpiexec, srun or a person; and one thread for each process."""

import contextlib
import importlib
import os
import sys
import time
from collections.abc import Mapping
from pathlib import Path

from hpcclear.base.host import process_fields
from hpcclear.base.plain import plain

_SIZE = (
    "PMI_SIZE",  # MPICH, Intel MPI, Cray
    "OMPI_COMM_WORLD_SIZE",  # Open MPI, Fujitsu, jsrun
    "MV2_COMM_WORLD_SIZE",  # MVAPICH
    "SLURM_STEP_NUM_TASKS",  # srun; SLURM_NTASKS would also stand in a batch script without srun
)
_RANK = (
    "PMI_RANK", "OMPI_COMM_WORLD_RANK", "MV2_COMM_WORLD_RANK", "PMIX_RANK", "PALS_RANKID", "MPIRUN_RANK", "ALPS_APP_PE",
)  # fmt: skip
_THREADS = (
    "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS", "VECLIB_MAXIMUM_THREADS",
)  # fmt: skip


def launched_size(environment: Mapping[str, str] = os.environ) -> tuple[str, int]:
    """Variable in which a launcher says how many processes it started, and this number; ``("", 1)`` without a launcher."""
    for name in _SIZE:
        if environment.get(name, "").isdigit() and int(environment[name]) > 1:
            return name, int(environment[name])
    return "", 1


def launched_rank(environment: Mapping[str, str] = os.environ) -> int | None:
    """Rank that the launcher gave to this process, known before MPI starts; None without one."""
    names = _RANK if launched_size(environment)[0] != "SLURM_STEP_NUM_TASKS" else ("SLURM_PROCID",)
    values = (environment.get(name, "") for name in names)
    return next((int(one) for one in values if one.isdigit()), None)


def is_launched(environment: Mapping[str, str] = os.environ) -> bool:
    """Whether a launcher started this process, so that MPI is needed."""
    return launched_rank(environment) is not None


def lineage() -> dict[int, int]:
    """Parents of this process and of those above it that the launcher started too, such as a shell, by process number.

    They end with the process of the launcher on this node, whose number is the last. Without a launcher there is none: whoever
    starts a command in the background may end before it. srun without MPI counts where it started this process itself.
    """
    names = [name for name in (*_RANK, "SLURM_PROCID") if name in os.environ]
    found, above = {os.getpid(): os.getppid()}, os.getppid()
    while names and above not in found and _began_with(above, names[0]):
        fields = process_fields(above)
        if not fields:
            break
        found[above] = above = int(fields[1])
    return found if is_launched() or (names and len(found) == 1) else {}


def is_orphan(parents: Mapping[int, int]) -> bool:
    """Whether any of these processes lost its parent (`lineage`), so that the launcher does not reach this one any more."""
    own = os.getpid()
    return any(
        (os.getppid() if process == own else int((process_fields(process) or "00")[1])) != parent
        for process, parent in parents.items()
    )


def _began_with(process: int, name: str) -> bool:
    """Whether a process got this variable from who started it; False where that cannot be read."""
    try:
        entries = Path(f"/proc/{process}/environ").read_bytes().split(b"\0")
    except OSError:
        return False
    return any(entry.startswith(f"{name}=".encode()) for entry in entries)


def end_job(complaint: str, code: int) -> None:
    """Say why this process cannot begin, and have the launcher end the others, which may wait for it in MPI.

    For want of what MPI itself needs; without a launcher it says so only. Open MPI and ``srun --kill-on-bad-exit`` end a
    job by the exit code alone. MPICH's launcher waits, unless it gets a request by the descriptor it left (PMI-1).
    """
    rank = launched_rank()
    if rank:
        time.sleep(2.0)  # where all lack the same, root says it and ends the job meanwhile
        complaint = f"rank {rank}: {complaint}"
    with contextlib.suppress(OSError):
        print(plain(complaint), file=sys.stderr, flush=True)
    descriptor = os.environ.get("PMI_FD", "")
    if rank is not None and descriptor.isdigit():
        time.sleep(0.5)  # an end may overtake what the launcher has not passed on to the user yet
        with contextlib.suppress(OSError):
            os.write(int(descriptor), f"cmd=abort exitcode={int(code)}\n".encode())


def pin_threads() -> None:
    """Keep BLAS, OpenMP and Numba of this process to one thread.

    Ranks share a node's cores, and sums over several threads differ in the last bit. Libraries that
    are not loaded yet read the environment; those that are get informed.
    """
    for name in _THREADS:
        os.environ[name] = "1"
    if "numpy" in sys.modules:
        hook, sys.unraisablehook = sys.unraisablehook, lambda _: None
        try:  # a library that cannot be opened again keeps what the environment says, without a word
            importlib.import_module("threadpoolctl").threadpool_limits(1)
        finally:
            sys.unraisablehook = hook
    if "numba" in sys.modules:
        sys.modules["numba"].set_num_threads(1)
    else:  # Numba refuses a change of this variable once its threads run
        os.environ["NUMBA_NUM_THREADS"] = "1"
