"""Into MPI and out of it: the one module that knows mpi4py, and the boundary that no error crosses.

Root runs the program, the other ranks work for it (`hpcclear.ranks.team`). However the program ends -
done, bad input, stopped early, an error on any rank - it is said once and every rank leaves with
the same exit code, within seconds. Without a launcher there is one process and no MPI library.
"""

import contextlib
import faulthandler
import functools
import os
import socket
import sys
import time
import traceback
import warnings
from collections.abc import Callable, Iterator, Sequence
from types import ModuleType

from hpcclear.base.errors import InputError, LimitError, StorageError, check_address_space, mendable
from hpcclear.base.extras import installing
from hpcclear.ranks import launcher
from hpcclear.ranks.mailbox import Backoff, Leave, Mail, Message, Tag
from hpcclear.ranks.stopping import ANEW, GRACE, RESUMES, Exit, RankFailed, Stopped, StopSwitch
from hpcclear.ranks.team import Ranks
from hpcclear.ranks.terminal import write
from hpcclear.ranks.watch import SILENCE, Watch, silence

PATIENCE = 600.0
"""Seconds that a rank waits for all others to come into MPI: a cold start of many nodes takes some minutes."""

LAST_WAIT = SILENCE
"""Seconds that a rank which is done waits for the others to leave MPI with it: one of them may be starved of its processor."""

COMPLAINT_PATIENCE = 30.0
"""Seconds that a rank which cannot begin waits for them: they may be at something that needs no MPI."""


def run_on_ranks(program: Callable[[Ranks], int | None], stop: StopSwitch | None = None) -> int:
    """Run `program`, which gets the `Ranks`, on root while the other ranks work for it: the `boundary` no error crosses.

    Returns the exit code for `sys.exit`, the same on every rank: what `program` returns (None is 0), or that of an error.
    """
    try:
        with boundary(stop) as ranks:
            sys.exit(program(ranks))
    except SystemExit as error:
        return int(error.code or Exit.DONE)
    return Exit.DONE


@contextlib.contextmanager
def boundary(
    stop: StopSwitch | None = None, ahead: Sequence[str] = (), *, resumes: bool = True
) -> Iterator[Ranks]:
    """A block in which root has all ranks, and which no error leaves; the others work for it and do not come in.

    `stop`: entered already, to hear signals from early on; by default one without a time limit. `ahead`: modules that the
    other ranks load while root reads what is to be done. `resumes`: the same block goes on from what this one saved when it
    was stopped.

    Raises SystemExit on all other ranks instead of the block, and on root unless all went well. The exit code is the same on
    every rank: 0, or that of a `sys.exit` in the block; 1 after a program error, a refused write or want of memory, reported
    once; 2 after an `InputError`; 3 after `Stopped`.
    """
    launcher.pin_threads()
    with contextlib.ExitStack() as stack:
        stop = stack.enter_context(StopSwitch()) if stop is None else stop
        stop.outlook = RESUMES if resumes else ANEW
        ranks = Ranks(_joined(stop), stop)
        with _watch(ranks):
            if ranks.is_root:
                ended: BaseException | None = None
                try:
                    yield ranks
                except BaseException as error:  # noqa: BLE001 - the rank boundary
                    ended = error
                code = _ended(ranks, ended)
            else:
                code = _as_worker(ranks, ahead)
        if ranks.size > 1:
            stop.leave_within(LAST_WAIT, code)  # for others that died on their way out
        ranks.mail.finalize()
        if code or not ranks.is_root:
            sys.exit(code)


def _joined(stop: StopSwitch) -> Mail:
    """The mailbox of this rank, all ranks being there; SystemExit where they cannot begin, which is said once."""
    try:
        check_address_space(launcher.launched_size()[1] > 1)
        mail = _open_mail()
    except LimitError as error:  # MPI might end the process with a code of its own
        launcher.end_job(f"Error: {error}", Exit.FAILED)
        sys.exit(Exit.FAILED)
    except InputError as error:
        if launcher.launched_rank() in (0, None):  # every copy finds the same
            _say(f"Error: {error}")
        sys.exit(Exit.BAD_INPUT)
    stop.last_resort = mail.abort
    if refused := _refused(mail):
        sys.exit(refused)
    return mail


def _watch(ranks: Ranks) -> Watch:
    """Who lives is watched: root fails when a rank is lost, the others end when root is, and say so."""
    mail, stop = ranks.mail, ranks.stop_switch
    seconds = mail.everyone(silence())[0]  # root's word counts
    parents = launcher.lineage()

    def give_up(rank: int) -> None:
        text = f"Error: nothing was heard of rank {rank}"
        if mail.lives(rank) is False:
            text += ", and the system reports: its process has ended, or its node or the network is gone"
        else:
            text += f" for {seconds:g} s (HPCCLEAR_SILENCE): its process, its node or the network is gone"
        report = f"{text}. What was finished is saved", Exit.FAILED, None
        if ranks.is_root:
            mail.notify_itself(Message(rank, Tag.ERROR, report))
        elif rank == mail.neighbours[0]:  # root, or the way to it
            _say(f"{text}. Rank {ranks.rank} on {socket.gethostname()} ends")
            stop.leave_within(0.0, Exit.FAILED)
        else:
            mail.send(0, Tag.ERROR, report)

    orphaned = functools.partial(stop.request, "the process that started it is gone")
    is_orphan = functools.partial(launcher.is_orphan, parents) if parents else None
    return Watch(mail, seconds, give_up, orphaned, is_orphan)


def refuse_together(complaint: str) -> int:
    """End all ranks because this one cannot begin: the others wait for it in MPI; exit code 2. Root shows why, once."""
    try:
        mail = _open_mail(COMPLAINT_PATIENCE)
    except InputError:
        if launcher.launched_rank() in (0, None):
            _say(complaint)
    else:
        _refused(mail, complaint)
    return Exit.BAD_INPUT


def _refused(mail: Mail, complaint: str = "") -> int:
    """Exit code if the ranks cannot begin together, which root says, or 0; every rank calls it and hears the same."""
    said = mail.everyone((complaint, os.environ.get("HPCCLEAR_LANES", "")))
    complaints = [(rank, text) for rank, (text, _) in enumerate(said) if text]
    lanes = sorted({asked for _, asked in said})
    if complaints:
        rank, text = complaints[0]
        text = text if rank == 0 else f"rank {rank} of {mail.size}: {text}"
    elif len(lanes) > 1:
        shown = ", ".join(asked or "nothing" for asked in lanes)
        reason = "it differs from rank to rank"
        remedy = "Set it to the same value on all ranks, or on none"
        text = f"Error: {InputError('HPCCLEAR_LANES', shown, reason, remedy)}"
    else:
        return Exit.DONE
    if mail.rank == 0:
        _say(text)
    mail.finalize()
    return Exit.BAD_INPUT


def alone() -> Ranks:
    """One process without signals, exits or MPI, for notebooks: errors are plain exceptions."""
    return Ranks(Mail(), StopSwitch())


def describe_mpi() -> str:
    """Name and version of the MPI library that would be used; does not start it. Raises InputError if none can be loaded."""
    lines = _load_mpi().Get_library_version().strip("\0\n ").splitlines()
    return " ".join(lines[0].replace("Version:", "").split())


def _load_mpi() -> ModuleType:
    try:
        import mpi4py

        if "mpi4py.MPI" not in sys.modules:
            mpi4py.rc.initialize = mpi4py.rc.finalize = False  # begun and ended here, on purpose
        from mpi4py import MPI
    except (ImportError, RuntimeError) as error:
        reason = f"mpi4py cannot load one ({' '.join(str(error).split())})"
        remedy = "Load the site's MPI module, or set MPI4PY_LIBMPI to its libmpi. To have one of your own: "
        remedy += installing("mpich").partition(": ")[2]
        raise InputError("MPI library", "none", reason, remedy) from error
    return MPI


def _open_mail(patience: float = PATIENCE) -> Mail:
    if not launcher.is_launched() and "mpi4py.MPI" not in sys.modules:
        return Mail()
    mpi, (variable, copies) = _load_mpi(), launcher.launched_size()
    if mpi.Is_finalized():  # by an earlier call in this process, and MPI starts only once
        if copies > 1:  # which do not find each other without it
            reason = "this process has left MPI after an earlier run, and it cannot start twice"
            remedy = "Import mpi4py.MPI at the top of the script, which keeps MPI until its end"
            raise InputError(variable, copies, reason, remedy)
        return Mail()
    begins = not mpi.Is_initialized()
    if begins:
        with warnings.catch_warnings():  # mpi4py's own guess, with a warning from every copy
            warnings.filterwarnings("ignore", "suspicious MPI execution environment")
            # it holds the interpreter while others are missing: only this clock runs on (2: sys.stderr may be no file)
            faulthandler.dump_traceback_later(patience, exit=True, file=2)
            mpi.Init_thread()
            faulthandler.cancel_dump_traceback_later()
    if copies > 1 and mpi.COMM_WORLD.size == 1:
        reason = f"the launcher started {copies} processes, but each sees only itself: the launcher"
        reason += f" does not belong to the MPI library in use ({describe_mpi()})"
        remedy = "Start with the mpiexec of that library, or set MPI4PY_LIBMPI to the launcher's"
        raise InputError(variable, copies, reason, remedy + "; with srun, choose the right --mpi")
    return Mail(mpi, finalizes=begins)


def _ended(ranks: Ranks, error: BaseException | None) -> int:
    """Say how root's block ended, and send the others home with the same exit code."""
    code: int = Exit.DONE
    text = note = ""
    match error:
        case Stopped():
            code, text = Exit.STOPPED, f"Stopped early: {error}. {ranks.stop_switch.outlook}."
        case InputError():
            code, text = Exit.BAD_INPUT, f"Error: {error}"
        case StorageError():
            code, text = Exit.FAILED, f"Error: {error}"
        case RankFailed():
            code, note = error.code, str(error)
        case SystemExit():
            code = error.code if isinstance(error.code, int) else Exit(error.code is not None)
        case BaseException():
            code = Exit.BAD_INPUT if isinstance(mendable(error), InputError) else Exit.FAILED
            text = _report(ranks, error)
    if text or note:
        ranks.stop_switch.reported = True
    if text:
        _say(text)
    return _dismiss(ranks, code, note)


def _dismiss(ranks: Ranks, code: int, note: str) -> int:
    """Notify the others to leave; after a failure those who do not listen are ended.

    An error of another rank is reported last. A rank that cannot reach root reports the error itself and ends the job.
    """
    if code != Exit.DONE:
        ranks.stop_switch.leave_within(GRACE, code)
    ranks.mail.notify_others(Tag.LEAVE, code)
    waited_for, backoff = set(range(1, ranks.size)), Backoff()
    patience = time.monotonic() + 1.5
    while waited_for:
        message = ranks.mail.poll()
        if message is None:
            if code != Exit.DONE and time.monotonic() > patience:
                _say_and_abort(ranks, note, code)
            backoff.wait()
        elif message.tag == Tag.LEFT:
            waited_for.discard(message.source)
        elif message.tag == Tag.ERROR and code == Exit.DONE:
            _say_and_abort(ranks, *message.body[:2])
    if note:
        _say(note)
    return code


def _as_worker(ranks: Ranks, ahead: Sequence[str]) -> int:
    """Work for root; an error goes to root, which reports it and ends the job."""
    try:
        ranks.serve(ahead)
    except Leave as leave:
        code = leave.code
    except BaseException as error:  # noqa: BLE001 - the rank boundary
        code = _notify_root(ranks, error)
    if code != Exit.DONE:
        ranks.stop_switch.leave_within(GRACE, code)
    ranks.mail.send(0, Tag.LEFT)
    return code


def _notify_root(ranks: Ranks, error: BaseException) -> int:
    """Send a report and finished records to root; if root is deaf, report and end the job here."""
    known = isinstance(error, InputError)
    note = (f"Error: {error}", Exit.BAD_INPUT) if known else (_report(ranks, error), Exit.FAILED)
    ranks.mail.send(0, Tag.ERROR, (*note, ranks.outbox()))
    patience, backoff = time.monotonic() + 2.0, Backoff()
    while time.monotonic() < patience:
        message = ranks.mail.poll()
        if message is not None and message.tag == Tag.LEAVE:
            return int(message.body)
        backoff.wait()
    _say_and_abort(ranks, *note)
    return note[1]


def _report(ranks: Ranks, error: BaseException) -> str:
    """Where a program error happened, and its traceback; for want of memory and the like, what to do about it."""
    known = mendable(error)
    if isinstance(known, InputError):
        return f"Error: {known}"
    if isinstance(error, StorageError):
        return f"Error: {ranks.where}: {error}"
    if known is not None:
        return f"Error: {ranks.where}: {known}; what was finished is saved"
    trace = "".join(traceback.format_exception(error)).rstrip()
    return f"hpcclear failed on {ranks.where}\n{trace}"


def _say_and_abort(ranks: Ranks, text: str, code: int) -> None:
    """Report, if there is anything to say, and end every rank."""
    if text:
        _say(text)
        time.sleep(0.3)  # an abort may overtake what the launcher has not passed on to the user yet
    ranks.mail.abort(code)


def _say(text: str) -> None:
    with contextlib.suppress(OSError):  # a launcher that is gone reads no more
        write(text)
