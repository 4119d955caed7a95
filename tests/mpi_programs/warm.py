"""Becomes any program that is asked for, in a fork of one process that has loaded everything: 0.1 s where a start takes 2.

`warm.py SOCKET` listens there and ends with its standard input. A connection hands over what a process begins with
(see `client`), passes signals on, and gets what became of it: the exit code, or minus the signal that ended it. Who
hangs up before that kills it.
"""

import atexit
import contextlib
import ctypes
import gc
import importlib
import json
import multiprocessing.synchronize  # noqa: F401 - nobody may not read it later
import os
import pkgutil
import runpy
import selectors
import signal
import socket
import sys
from pathlib import Path

import last_bits
import threadpoolctl  # noqa: F401
from numba.core.registry import cpu_target

import hpcclear
from hpcclear import cli, scene
from hpcclear.ensemble import identity, session
from hpcclear.laws import checks
from hpcclear.ranks import boundary

HIGH = 500  # a descriptor above all in use
LIMIT = 200_000  # bytes of a request: words, environment, folder


def become(asked: dict, descriptors: list[int]) -> None:
    """Be the program; does not return."""
    code = 70
    try:
        os.setsid()
        kept = [os.dup2(number, HIGH + k) for k, number in enumerate(descriptors)]
        os.closerange(3, HIGH)  # among them the ends of other programs
        for number, place in zip(kept, asked["descriptors"], strict=True):
            os.dup2(number, place)
        os.closerange(HIGH, HIGH + len(kept))
        os.environ.clear()
        os.environ.update(asked["environment"])
        os.chdir(asked["folder"])  # another user may not be allowed to
        if asked["user"] is not None and os.geteuid() == 0:
            os.setgroups([])
            os.setgid(asked["user"])
            os.setuid(asked["user"])
        program, *words = asked["words"]
        if program == "-m":
            sys.argv = words  # hpcclear and what it is asked
            cli.main()
        else:
            sys.argv, sys.path[0] = [program, *words], str(Path(program).parent)
            runpy.run_path(program, run_name="__main__")
        code = 0
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else 0 if end.code is None else 1
    except BaseException:  # noqa: BLE001 - what the interpreter would print
        sys.excepthook(*sys.exc_info())
        code = 1
    finally:
        atexit._run_exitfuncs()
        sys.stdout.flush()
        sys.stderr.flush()
        ctypes.CDLL(None).exit(code)  # not os._exit: MPICH tells its launcher at the very end


def serve(place: str) -> None:
    """Fork for each request until standard input ends."""
    with (
        socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as door,
        selectors.DefaultSelector() as all_ends,
    ):
        door.bind(place)
        door.listen(64)
        print("ready", flush=True)
        all_ends.register(door, selectors.EVENT_READ, None)
        all_ends.register(0, selectors.EVENT_READ, None)
        while True:
            key, _ = all_ends.select()[0]  # one at a time: what it does may settle the others
            if key.fileobj == 0:
                break
            if key.fileobj is door:
                begin(door.accept()[0], all_ends)
            elif isinstance(key.fileobj, socket.socket):
                number = key.fileobj.recv(16)
                os.kill(key.data, int(number or signal.SIGKILL))
                if not number:  # hung up
                    all_ends.unregister(key.fileobj)
            else:
                end(key, all_ends)
        for key in list(all_ends.get_map().values()):  # what it still is ends with it
            if isinstance(key.data, int):
                os.kill(key.data, signal.SIGKILL)


def begin(client: socket.socket, all_ends: selectors.BaseSelector) -> None:
    request, descriptors, _, _ = socket.recv_fds(client, LIMIT, 16)
    if not request:
        client.close()
        return
    process = os.fork()
    if process == 0:
        become(json.loads(request), descriptors)
    for number in descriptors:
        os.close(number)
    all_ends.register(client, selectors.EVENT_READ, process)
    all_ends.register(os.pidfd_open(process), selectors.EVENT_READ, (process, client))


def end(key: selectors.SelectorKey, all_ends: selectors.BaseSelector) -> None:
    process, client = key.data
    code = os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])
    all_ends.unregister(key.fd)
    os.close(key.fd)
    if client in (entry.fileobj for entry in all_ends.get_map().values()):
        all_ends.unregister(client)
    with contextlib.suppress(OSError):  # nobody waits for it
        client.send(str(code).encode())
    client.close()


def load() -> None:
    """All that a command may need."""
    for module in pkgutil.walk_packages(hpcclear.__path__, "hpcclear."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)
    last_bits.disturb()
    boundary.describe_mpi()  # loads the library once for all; the rest is what another user may not read
    shipped = scene.load_scene(Path(__file__).parents[2] / "jobs" / "quickstart.toml")
    identity.sample_key(shipped, session.design(shipped, None))
    checks.registry()
    # which of them keeps Numba to one thread is found later
    for layer in ("tbbpool", "omppool", "workqueue"):
        with contextlib.suppress(ImportError):
            importlib.import_module(f"numba.np.ufunc.{layer}")
    cpu_target.typing_context.refresh()
    cpu_target.target_context.refresh()


if __name__ == "__main__":
    load()
    gc.collect()
    gc.freeze()  # programs look for unreachable objects among their own only, and copy no page to do so
    serve(sys.argv[1])
