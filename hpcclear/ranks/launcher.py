"""What started this process: mpiexec, srun or a person; and one thread for each process."""

import contextlib
import importlib
import os
import sys
import time
from collections.abc import Mapping

from hpcclear.base.plain import plain

_SIZE = (
    "PMI_SIZE",  # MPICH, Intel MPI, Cray
    "OMPI_COMM_WORLD_SIZE",  # Open MPI, Fujitsu, jsrun
    "MV2_COMM_WORLD_SIZE",  # MVAPICH
    "SLURM_STEP_NUM_TASKS",  # srun; SLURM_NTASKS would also stand in a batch script without srun
)
_RANK = (
    "PMI_RANK",
    "OMPI_COMM_WORLD_RANK",
    "MV2_COMM_WORLD_RANK",
    "PMIX_RANK",
    "PALS_RANKID",
    "MPIRUN_RANK",
    "ALPS_APP_PE",
)
_THREADS = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "BLIS_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)


def launched_size(environment: Mapping[str, str] = os.environ) -> tuple[str, int]:
    """Number of processes a launcher says it started, and the variable that says so.

    Returns
    -------
    tuple of str and int
        ``("", 1)`` when no launcher left a trace.
    """
    for name in _SIZE:
        if environment.get(name, "").isdigit() and int(environment[name]) > 1:
            return name, int(environment[name])
    return "", 1


def launched_rank(environment: Mapping[str, str] = os.environ) -> int | None:
    """Rank that the launcher gave to this process, known before MPI starts; None without one."""
    names = _RANK if launched_size(environment)[0] != "SLURM_STEP_NUM_TASKS" else ("SLURM_PROCID",)
    for name in names:
        if environment.get(name, "").isdigit():
            return int(environment[name])
    return None


def is_launched(environment: Mapping[str, str] = os.environ) -> bool:
    """Whether a launcher started this process, so that MPI is needed."""
    return launched_rank(environment) is not None


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
