"""Runs commands as the installed program would, each in a fork of one warm process: JSON lines in and out.

In:  {"words": [...], "user": number or null}     Out: {"code": exit code, "output": text, "seconds": s}
"""

import json
import multiprocessing.synchronize  # noqa: F401 - nobody may not read it later
import os
import signal
import sys
import tempfile
import time
from pathlib import Path

import numpy  # noqa: F401
import xarray  # noqa: F401

from hpcclear import cli, scene
from hpcclear.cli import printing  # noqa: F401
from hpcclear.dynamics import evaluator  # noqa: F401
from hpcclear.ensemble import identity, samples
from hpcclear.ranks import boundary
from hpcclear.results import dataset  # noqa: F401

PATIENCE = 120.0  # s; a hang lasts for ever, a crowded machine does not


def child(words: list[str], user: int | None, output: int) -> None:
    """Become the command; does not return."""
    os.setsid()
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(output, 1)
    os.dup2(output, 2)
    if user is not None and os.geteuid() == 0:
        os.setgroups([])
        os.setgid(user)
        os.setuid(user)
    sys.argv = ["hpcclear", *words]
    cli.main(words)


def run(words: list[str], user: int | None) -> dict[str, object]:
    began = time.monotonic()
    with tempfile.TemporaryFile() as output:
        process = os.fork()
        if process == 0:
            code = 70
            try:
                child(words, user, output.fileno())
            except SystemExit as end:
                code = end.code if isinstance(end.code, int) else 70
            except BaseException:  # noqa: BLE001 - what the interpreter would print
                sys.excepthook(*sys.exc_info())
            finally:
                sys.stdout.flush()
                sys.stderr.flush()
                os._exit(code)
        while (ended := os.waitpid(process, os.WNOHANG))[0] == 0:
            if time.monotonic() - began > PATIENCE:
                os.kill(process, signal.SIGKILL)
            time.sleep(0.002)
        output.seek(0)
        text = output.read().decode(errors="replace")
    seconds = time.monotonic() - began
    return {"code": os.waitstatus_to_exitcode(ended[1]), "output": text, "seconds": seconds}


if __name__ == "__main__":
    boundary.describe_mpi()  # loads the library once for all; the rest is what another user may not read
    shipped = scene.load_scene(Path(__file__).parents[2] / "jobs" / "quickstart.toml")
    identity.sample_key(shipped, samples.design(shipped, None))
    for line in sys.stdin:
        asked = json.loads(line)
        print(json.dumps(run(asked["words"], asked["user"])), flush=True)
