"""Whether another process lives, without its help: the kernel of its node knows, also while a busy machine starves the process.

Of a process on this node /proc has the state and the processor time. Between nodes root and the first rank of each other node
keep a TCP connection that carries nothing: the kernel of a node answers for it however starved the process is, closes it
where the process ends, and reports it as broken 13 s after a cut (the first probe after 4 s, three probes of 3 s).
"""

import contextlib
import hmac
import os
import socket
import struct
import time
from collections.abc import Iterable
from typing import NamedTuple

from hpcclear.base.host import is_running, process_fields

_KEEPALIVE = {"TCP_KEEPIDLE": 4, "TCP_KEEPINTVL": 3, "TCP_KEEPCNT": 3}

_OPEN = 300.0  # s that root's port is open for connections of others
_USER, _SYSTEM, _STARTED = 11, 12, 19  # fields of `process_fields`


class Identity(NamedTuple):
    """A process as others on its node find it in /proc."""

    number: int
    started: str
    namespace: int


def identity() -> Identity | None:
    """Return the identity of this process; None where there is no /proc."""
    fields = process_fields(os.getpid())
    with contextlib.suppress(OSError):
        return Identity(os.getpid(), fields[_STARTED], os.stat("/proc/self/ns/pid").st_ino)
    return None


class Process:
    """A process of this node, by its entry in /proc."""

    def __init__(self, known: Identity) -> None:
        self._known = known
        self._seconds = ""

    @property
    def visible(self) -> bool:
        """Whether it is found there at all: processes of another container are not."""
        fields, here = process_fields(self._known.number), identity()
        same = here is not None and here.namespace == self._known.namespace
        return same and len(fields) > _STARTED and fields[_STARTED] == self._known.started

    def lives(self) -> bool | None:
        """Return True if it computed since the last call or waits for a core, False if it has ended, None if it did neither."""
        fields = process_fields(self._known.number)
        if not fields:
            return None if is_running(self._known.number) else False
        if fields[0] in "ZXx" or fields[_STARTED] != self._known.started:
            return False
        before, self._seconds = self._seconds, f"{fields[_USER]} {fields[_SYSTEM]}"
        return True if fields[0] == "R" or before != self._seconds else None


class Address(NamedTuple):
    """Where root waits for connections, and what both ends say first, so that nobody else is taken for a rank."""

    host: str
    port: int
    word: bytes


class Connections:
    """Connections of this rank to those of other nodes that it exchanges pulses with. Only `join` waits."""

    _HELLO = struct.Struct("16sq")

    def __init__(self) -> None:
        self._listener: socket.socket | None = None
        self._until = 0.0
        self._word = b""
        self._due: set[int] = set()
        self._new: list[socket.socket] = []
        self._lines: dict[int, socket.socket | None] = {}  # None: broken

    def offer(self, others: Iterable[int]) -> Address | None:
        """Open a port for these ranks; None where the system cannot watch a connection."""
        self._due = set(others)
        if not self._due or not all(hasattr(socket, name) for name in _KEEPALIVE):
            return None
        both = socket.has_dualstack_ipv6()
        family = socket.AF_INET6 if both else socket.AF_INET
        try:
            self._listener = socket.create_server(
                ("", 0), family=family, backlog=4096, dualstack_ipv6=both
            )
        except OSError:
            return None
        self._listener.setblocking(False)
        self._until, self._word = time.monotonic() + _OPEN, os.urandom(32)
        return Address(socket.gethostname(), self._listener.getsockname()[1], self._word)

    def join(self, rank: int, to: int, address: Address) -> None:
        """Connect rank `rank` to root, `to`; without a word where that fails, as by a firewall between the nodes."""
        with contextlib.suppress(OSError, UnicodeError):
            line = socket.create_connection((address.host, address.port), timeout=5.0)
            _keep_alive(line)
            line.sendall(self._HELLO.pack(address.word[:16], rank))
            if line.recv(16, socket.MSG_WAITALL) == address.word[16:]:
                line.setblocking(False)
                self._lines[to] = line
            else:
                line.close()

    def accept(self) -> None:
        """Take connections of ranks that have come meanwhile, on root."""
        if self._listener is None:
            return
        with contextlib.suppress(OSError):
            while len(self._new) <= 2 * len(self._due):
                line, _ = self._listener.accept()
                line.setblocking(False)
                self._new.append(line)
        self._new = [line for line in self._new if not self._greeted(line)]
        if not self._due or time.monotonic() > self._until:
            self._shut()

    def _greeted(self, line: socket.socket) -> bool:
        """Whether a new connection has spoken; it is closed unless it said its word."""
        try:
            word, rank = self._HELLO.unpack(line.recv(self._HELLO.size))
            if not hmac.compare_digest(word, self._word[:16]) or rank not in self._due:
                raise ConnectionError
            _keep_alive(line)
            line.sendall(self._word[16:])
        except BlockingIOError:
            return False
        except (OSError, struct.error):
            line.close()
            return True
        self._due.remove(rank)
        self._lines[rank] = line
        return True

    def lives(self, rank: int) -> bool | None:
        """Return False if the connection is broken or was closed by the end of the process; None if it stands, or without one.

        A connection that stands says that the node answers, but not that the process gets on.
        """
        line = self._lines.get(rank)
        if line is not None:
            try:
                line.recv(1)  # nothing is ever sent: it returns at the end only
            except BlockingIOError:
                return None
            except OSError:
                pass  # such as ETIMEDOUT or EHOSTUNREACH after a cut
            line.close()
            self._lines[rank] = None
        return False if rank in self._lines and self._lines[rank] is None else None

    def close(self) -> None:
        """Close all."""
        self._shut()
        for line in self._lines.values():
            if line is not None:
                line.close()
        self._lines.clear()

    def _shut(self) -> None:
        for line in self._new:
            line.close()
        self._new.clear()
        if self._listener is not None:
            self._listener.close()
            self._listener = None


def _keep_alive(line: socket.socket) -> None:
    line.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for name, value in _KEEPALIVE.items():
        line.setsockopt(socket.IPPROTO_TCP, getattr(socket, name), value)
