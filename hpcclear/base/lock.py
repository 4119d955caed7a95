"""Locks: one run at a time in a results directory, one process at a time that compiles a function.

The lock is a file. While its holder lives, the operating system holds an advisory lock on that file (flock), which no crash
can leave behind. The lock of a run also names its holder: host, process and batch job. On file systems without flock the
exclusive creation of the file decides, and what it says about its holder.

The package filelock (4.3.1) judges dead holders too, by host, process and boot, but knows no batch jobs: a lock of another
host is never free. Its lock by flock names no holder, and does without flock for ENOSYS alone. Loading it takes 0.055 s of
processor time, a third of `hpcclear --help`.
"""

import errno
import json
import os
import secrets
import socket
from pathlib import Path
from typing import NamedTuple, Self

from hpcclear.base import host
from hpcclear.base.errors import InputError, refused

_NO_FLOCK = {errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, errno.EINVAL}
_SLURM = ("SLURM_JOB_ID", "SLURM_RESTART_COUNT")
_ATTEMPTS = 100  # of taking a lock that others keep releasing in between


class Holder(NamedTuple):
    """Who holds a lock; empty text where something is not known."""

    host: str
    boot: str  # changes when the host restarts
    pid: int
    started: str  # start time of the process, in ticks since the boot: tells reused numbers apart
    job: str  # Slurm job
    restart: str  # how often Slurm has requeued the job

    @classmethod
    def this_process(cls) -> "Holder":
        """The running process."""
        pid, (job, restart) = os.getpid(), (os.environ.get(name, "") for name in _SLURM)
        (started,) = host.process_fields(pid)[19:20] or [""]
        return cls(socket.gethostname(), _boot(), pid, started, job, restart)

    @classmethod
    def parse(cls, text: bytes) -> "Holder | None":
        """The holder a lock file names; None when its writer was killed while writing."""
        try:
            found = json.loads(text)
            holder = cls(*(found[name] for name in cls._fields))
        except (ValueError, KeyError, TypeError, RecursionError):
            return None
        kinds = [int if name == "pid" else str for name in cls._fields]
        return holder if all(map(isinstance, holder, kinds)) and holder.pid > 0 else None

    def is_over(self) -> bool:
        """Whether the holder is known to be gone; False when that is not known."""
        here = Holder.this_process()
        if self.host == here.host:
            return self.boot != here.boot or not _alive(self.pid, self.started)
        if self.job and self.job == here.job:
            return self.restart != here.restart  # this very job, requeued on another node
        return bool(self.job) and _job_is_over(self.job)

    def __str__(self) -> str:
        job = f", Slurm job {self.job}" if self.job else ""
        return f"process {self.pid} on {self.host}{job}"


def _boot() -> str:
    try:
        return Path("/proc/sys/kernel/random/boot_id").read_text().strip()
    except OSError:
        return ""


def _alive(pid: int, started: str) -> bool:
    if not host.is_running(pid):
        return False
    found = host.process_fields(pid)
    if len(found) <= 19:
        return True
    return found[0] not in "ZX" and (started == "" or found[19] == started)


def _is_flocked(descriptor: int) -> bool:
    try:
        host.lock_file(descriptor, shared=True)
    except OSError as error:
        return isinstance(error, BlockingIOError)
    return False


def _job_is_over(job: str) -> bool:
    """Whether Slurm says that the job is not waiting and not running; False without an answer."""
    if not job.isdecimal():
        return False
    import subprocess

    command = ["squeue", "--noheader", "--format=%T", "--jobs", job]
    try:
        answer = subprocess.run(command, capture_output=True, text=True, timeout=20, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return False
    if answer.returncode != 0:
        return "Invalid job id" in answer.stderr  # Slurm forgets a job some minutes after its end
    return answer.stdout.strip() == ""


class Lock:
    """A lock file in a directory, which exists; as a context, one in which no other run works there.

    Raises InputError on entry: another run holds the lock, or the directory cannot be written to. Raises StorageError on
    entry: the disk fails.
    """

    def __init__(self, directory: Path, name: str = ".hpcclear.lock") -> None:
        self.path = directory / name
        self._descriptor: int | None = None

    def __enter__(self) -> Self:
        self.acquire()
        return self

    def __exit__(self, *exception: object) -> None:
        self.release()

    def refuse_others(self) -> None:
        """Raise InputError while another process holds the lock, which is not taken; one that cannot be read counts as free."""
        try:
            descriptor = os.open(self.path, host.flags("O_RDONLY", "O_NOFOLLOW", "O_NONBLOCK"))
        except OSError:
            return
        try:
            holder = Holder.parse(os.read(descriptor, 4096))
            if holder is not None and not holder.is_over() and holder != Holder.this_process():
                raise self._refusal(holder)
            if holder is None and _is_flocked(descriptor):  # its holder is about to write its name
                raise self._refusal(None)
        finally:
            os.close(descriptor)

    def is_ours(self) -> bool:
        """Whether this process holds the lock, by this object or another one."""
        try:
            return Holder.parse(self.path.read_bytes()[:4096]) == Holder.this_process()
        except OSError:
            return False

    def acquire(self) -> None:
        """Take the lock or refuse; see the class."""
        for _ in range(_ATTEMPTS):
            try:
                descriptor, created = self._open()
            except FileNotFoundError:
                if self.path.parent.is_dir():
                    continue  # released between two looks
                raise refused(self.path, OSError(errno.ENOENT, "")) from None
            except OSError as error:
                raise refused(self.path, error) from None
            try:
                if self._take(descriptor, created):
                    self._descriptor = descriptor
                    return
            except OSError as error:
                raise refused(self.path, error) from None
            finally:
                if self._descriptor != descriptor:
                    os.close(descriptor)
        raise self._refusal(None)

    def take(self) -> bool:
        """Take the lock without a name if no process holds it at this moment; return whether it was free.

        Raises OSError: the file cannot be made, or its file system has no such locks.
        """
        descriptor = os.open(self.path, host.flags("O_RDWR", "O_NOFOLLOW", "O_CREAT"), 0o600)
        try:
            host.lock_file(descriptor)
            if self._is_current(descriptor):
                self._descriptor = descriptor
        except BlockingIOError:
            pass
        finally:
            if self._descriptor is None:
                os.close(descriptor)
        return self._descriptor is not None

    def release(self) -> None:
        """Give the lock back; nothing happens when it is not held."""
        if self._descriptor is None:
            return
        descriptor, self._descriptor = self._descriptor, None
        current = self._is_current(descriptor)
        if os.name == "nt":  # where an open file cannot be removed
            os.close(descriptor)
        if current:
            self.path.unlink(missing_ok=True)  # while flock still keeps others out
        if os.name != "nt":
            os.close(descriptor)

    def _open(self) -> tuple[int, bool]:
        how = host.flags("O_RDWR", "O_NOFOLLOW", "O_NONBLOCK")
        try:
            return os.open(self.path, how | os.O_CREAT | os.O_EXCL, 0o644), True
        except FileExistsError:
            return os.open(self.path, how), False

    def _take(self, descriptor: int, created: bool) -> bool:
        """Make the open file ours: True if it is, False to try again, `InputError` if refused."""
        try:
            host.lock_file(descriptor)
            guarded = True
        except BlockingIOError:
            raise self._refusal(Holder.parse(os.read(descriptor, 4096))) from None
        except OSError as error:
            if error.errno not in _NO_FLOCK:
                raise
            guarded = False
        if not self._is_current(descriptor):
            return False  # its holder released it after we opened it
        text = os.read(descriptor, 4096)
        holder = Holder.parse(text)
        if holder is not None and not holder.is_over():
            raise self._refusal(holder)
        if not guarded and not created:
            if holder is None:
                raise self._refusal(None)  # being written this moment, or its writer was killed
            self._bury(text)
            return False
        os.ftruncate(descriptor, 0)
        os.lseek(descriptor, 0, os.SEEK_SET)
        os.write(descriptor, json.dumps(Holder.this_process()._asdict()).encode())
        os.fsync(descriptor)
        return True

    def _bury(self, text: bytes) -> None:
        """Remove a dead run's lock where there is no flock; of several who try, one succeeds."""
        grave = self.path.with_name(f".hpcclear-lock-{secrets.token_hex(8)}.tmp")
        try:
            os.rename(self.path, grave)
        except FileNotFoundError:
            return
        try:
            if grave.read_bytes() != text:  # a new holder came in between: give it back
                os.link(grave, self.path)
        finally:
            grave.unlink(missing_ok=True)

    def _is_current(self, descriptor: int) -> bool:
        try:
            return os.path.samestat(os.fstat(descriptor), os.lstat(self.path))
        except FileNotFoundError:
            return False

    def _refusal(self, holder: Holder | None) -> InputError:
        who = f"{holder} holds it" if holder is not None else "another run is taking it"
        else_ = f"If no run is active any more, remove {self.path} and run the command again"
        remedy = f"Wait for that run or stop it. {else_}"
        return InputError("output", str(self.path.parent), who, remedy)
