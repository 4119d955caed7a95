"""What only some operating systems offer, with what takes its place elsewhere: the one module that requires it.

Linux has all of it, macOS most, native Windows none: each module is loaded where it is called.
"""

import contextlib
import math
import os
import platform
import signal
import sys
from collections.abc import Iterator
from pathlib import Path
from types import FrameType

UNIX_MODULES = ("fcntl", "grp", "pwd", "resource", "termios")
"""Modules of the standard library that native Windows lacks."""

WSL = "On Windows run hpcclear in WSL (wsl --install), where everything works as on Linux"
"""The remedy for a command that needs Unix."""


def flags(*names: str) -> int:
    """Return flags of `os.open` for a file of bytes; those that the system lacks, such as O_NOFOLLOW, are left out."""
    found = getattr(os, "O_BINARY", 0)
    for name in ("O_CLOEXEC", *names):
        found |= getattr(os, name, 0)
    return int(found)


_STOPS = ("SIGTERM", "SIGINT", "SIGUSR1")
STOP_SIGNALS = tuple(getattr(signal, name) for name in _STOPS if hasattr(signal, name))
"""What batch systems and people send to end a job."""


def cores() -> set[int]:
    """Return the numbers of the cores that this process may run on; all of the machine where the system does not say."""
    if hasattr(os, "sched_getaffinity"):
        return os.sched_getaffinity(0)
    return set(range(os.cpu_count() or 1))


def address_space_limit() -> int | None:
    """Return the limit of address space (``ulimit -v``) in bytes, None without one."""
    with contextlib.suppress(ImportError):
        import resource

        limit = resource.getrlimit(resource.RLIMIT_AS)[0]
        return None if limit == resource.RLIM_INFINITY else limit
    return None


def peak_memory() -> float:
    """Return the largest memory of this process so far in bytes; NaN where the system does not say."""
    with contextlib.suppress(ImportError):
        import resource

        unit = 1.0 if sys.platform == "darwin" else 1024.0
        return unit * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return math.nan


def memory() -> float:
    """Return the memory of the machine in bytes; infinity where the system does not say."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, ValueError, OSError):
        return math.inf


def process_fields(pid: int) -> list[str]:
    """Return the fields of /proc/PID/stat from the third, the state, on; empty where they cannot be read."""
    try:
        # the second field, the command, may itself hold blanks and brackets
        return Path(f"/proc/{pid}/stat").read_text(errors="replace").rpartition(")")[2].split()
    except OSError:
        return []


def is_running(pid: int) -> bool:
    """Whether there is such a process; True where that cannot be known."""
    if os.name == "nt":  # signal 0 is Ctrl-C there
        return True
    try:
        os.kill(pid, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        pass  # somebody else's, so there is one
    return True


def lock_file(descriptor: int, shared: bool = False) -> None:
    """Take an advisory lock on an open file (flock), which ends with the process.

    Raises BlockingIOError: another process holds it. Raises OSError: the file system, or the system (errno ENOSYS), has no
    such locks.
    """
    try:
        import fcntl
    except ImportError:
        import errno

        raise OSError(errno.ENOSYS, os.strerror(errno.ENOSYS)) from None
    fcntl.flock(descriptor, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)


def user_number() -> int | None:
    """Return the number of the user; None where files have no owner's number."""
    return os.getuid() if hasattr(os, "getuid") else None


def group_members(number: int) -> tuple[str, set[str]]:
    """Return the name of a group and its members; an empty name where it is not known."""
    with contextlib.suppress(ImportError, KeyError, OSError):
        import grp

        group = grp.getgrgid(number)
        return group.gr_name, set(group.gr_mem)
    return "", set()


@contextlib.contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Raise TimeoutError in what takes more processor time, in the main thread; without limit where there is no SIGPROF."""
    import threading

    if threading.current_thread() is not threading.main_thread() or not hasattr(signal, "SIGPROF"):
        yield
        return

    def ring(number: int, frame: FrameType | None) -> None:
        raise TimeoutError

    before = signal.signal(signal.SIGPROF, ring)
    signal.setitimer(signal.ITIMER_PROF, seconds)  # a busy machine is not the content's fault
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


def processor() -> str:
    """Return the name of the processor, by which results are compared: equal bits are promised on equal names."""
    described: dict[str, str] = {}
    with contextlib.suppress(OSError), open("/proc/cpuinfo", errors="replace") as file:
        for line in file:
            name, _, value = line.partition(":")
            described.setdefault(name.strip(), value.strip())
            if "model name" in described:
                return described["model name"]
    if "CPU part" in described:  # aarch64 has numbers only
        maker = described.get("CPU implementer", "")
        return f"{platform.machine()} implementer {maker} part {described['CPU part']}"
    if sys.platform == "darwin":
        import subprocess

        with contextlib.suppress(OSError, subprocess.SubprocessError):
            command = ["sysctl", "-n", "machdep.cpu.brand_string"]
            said = subprocess.run(command, capture_output=True, text=True, timeout=10, check=True)
            return said.stdout.strip()
    return platform.processor() or platform.machine()
