"""`python -I -S client.py SOCKET PROGRAM WORDS...`: what PROGRAM does, by a process that is warm already (warm.py).

Loads next to nothing: it begins in 0.02 s. A launcher's pipe and its signals go along, so that it may stand behind
mpiexec; killed, it takes the program with it.
"""

import json
import os
import signal
import socket
import sys


def request(
    place: str, words: list[str], descriptors: dict[int, int], **more: object
) -> socket.socket:
    """Begin a program; numbers sent are its signals, closing the socket kills it, and its code is the answer.

    `descriptors`: the program's numbers and which of ours they are.
    """
    asked = {
        "words": words,
        "environment": dict(os.environ),
        "folder": os.getcwd(),
        "user": None,
        "descriptors": list(descriptors),
    }
    connection = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    connection.connect(place)
    socket.send_fds(connection, [json.dumps(asked | more).encode()], list(descriptors.values()))
    return connection


def tell(connection: socket.socket, number: int) -> None:
    """Tell a signal to the program behind a connection; one that has ended needs none."""
    try:  # noqa: SIM105 - contextlib would have to be loaded
        connection.send(str(number).encode())
    except OSError:
        pass


if __name__ == "__main__":
    signals = [signal.Signals[n] for n in ("SIGINT", "SIGTERM", "SIGUSR1", "SIGUSR2", "SIGHUP")]
    numbers = [0, 1, 2, *(int(os.environ[name]) for name in ("PMI_FD",) if name in os.environ)]
    with request(sys.argv[1], sys.argv[2:], {number: number for number in numbers}) as answer:
        for one in signals:
            signal.signal(one, lambda number, _: tell(answer, number))
        for number in numbers[3:]:
            os.close(number)  # the launcher waits for its end
        code = int(answer.recv(16) or b"70")
        for one in signals:  # as the program itself at its end: what comes too late ends nothing
            signal.signal(one, signal.SIG_IGN)
    if code < 0:
        if -code != signal.SIGKILL:
            signal.signal(-code, signal.SIG_DFL)
        os.kill(os.getpid(), -code)
    sys.exit(code)
