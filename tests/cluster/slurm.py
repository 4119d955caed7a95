"""Slurm on the nodes of a box: slurmctld on the first, a slurmd on each, one munged for all."""

import contextlib
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Self

from cluster.box import ROOT, Box, Node
from commands import began

_CONF = ROOT / "tests" / "slurm" / "slurm.conf"
_OWN = """KillWait=5
# A node that does not answer is down after so long: shorter than the silence that ranks bear by default.
SlurmdTimeout=20
UnkillableStepTimeout=20
"""


def refusal() -> str:
    """Why there can be no Slurm here; empty where there can."""
    missing = [name for name in ("slurmctld", "slurmd", "munged", "srun") if not shutil.which(name)]
    return f"{', '.join(missing)} not found (Debian's slurm-wlm and munge)" if missing else ""


class Slurm:
    """The daemons, as a context inside that of the box."""

    def __init__(self, box: Box, cores: int = 2) -> None:
        self.box, self.folder = box, box.directory / "slurm"
        self._cores = cores
        self._daemons: list[subprocess.Popen] = []
        self.settings = {"SLURM_CONF": str(self.folder / "slurm.conf")}

    def __enter__(self) -> Self:
        (self.folder / "state").mkdir(parents=True)
        key = self.folder / "munge.key"
        key.touch(mode=0o600)
        key.write_bytes(os.urandom(1024))
        rows = []
        for node in self.box.nodes:
            (self.folder / f"spool-{node.name}").mkdir()
            rows.append(
                f"NodeName={node.name} NodeAddr={node.address} CPUs={self._cores} State=UNKNOWN"
            )
        first = random.SystemRandom().randrange(1, 30_000) * 1000 + 1
        host = f"{self.box.nodes[0].name}({self.box.nodes[0].address})"
        conf = _CONF.read_text()
        for name, value in (("first", first), ("host", host), ("folder", self.folder)):
            conf = conf.replace(f"@{name}@", str(value))
        Path(self.settings["SLURM_CONF"]).write_text(conf + _OWN + "\n".join(rows) + "\n")
        files = (("key-file", "munge.key"), ("socket", "munge.socket"), ("pid-file", "munged.pid"))
        files = (*files, ("log-file", "munged.log"), ("seed-file", "munge.seed"))
        options = [f"--{option}={self.folder / name}" for option, name in files]
        try:
            self._begin(self.box.nodes[0], "munged", "--foreground", "--force", *options)
            self._begin(self.box.nodes[0], "slurmctld", "-D")
            for node in self.box.nodes:
                self.begin_slurmd(node)
            self._wait_until_idle()
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *exception: object) -> None:
        for daemon in self._daemons[::-1]:
            with contextlib.suppress(ProcessLookupError):
                daemon.send_signal(signal.SIGTERM)
        for daemon in self._daemons:
            try:
                daemon.wait(10.0)
            except subprocess.TimeoutExpired:
                daemon.kill()
                daemon.wait()

    def begin_slurmd(self, node: Node) -> None:
        """Start a node's own daemon, again after the node came back."""
        self._begin(node, "slurmd", "-D")

    def job(
        self, words: Sequence[str], ranks: int, *options: str, **settings: str
    ) -> subprocess.Popen:
        """Start the program under srun, so many ranks on every node."""
        nodes = len(self.box.nodes)
        launch = [
            "srun",
            "--mpi=pmi2",
            f"--nodes={nodes}",
            f"--ntasks={ranks * nodes}",
            f"--ntasks-per-node={ranks}",
        ]
        launch += ["--kill-on-bad-exit=1", *options]
        return self._start(
            self.box.nodes[0], [*launch, sys.executable, "-m", "hpcclear", *words], settings
        )

    def ask(self, *words: str) -> str:
        """What a client of Slurm answers."""
        job = self._start(self.box.nodes[0], list(words), {})
        return job.communicate(timeout=60)[0]

    def _begin(self, node: Node, *words: str) -> None:
        log = (self.folder / f"{words[0]}-{node.name}.out").open("w")
        environment = os.environ | self.settings
        self._daemons.append(
            subprocess.Popen(
                node.words(words), stdout=log, stderr=log, env=environment, start_new_session=True
            )
        )
        time.sleep(0.5)  # the next one needs its socket

    def _start(self, node: Node, words: list[str], settings: dict[str, str]) -> subprocess.Popen:
        return began(node.words(words), ROOT, **self.settings, **settings)

    def _wait_until_idle(self) -> None:
        patience = time.monotonic() + 60.0
        while set(self.ask("sinfo", "--noheader", "--Node", "--format=%T").split()) != {"idle"}:
            if time.monotonic() > patience:
                logs = "\n".join(path.read_text()[-500:] for path in self.folder.glob("*.log"))
                raise RuntimeError(f"Slurm does not start\n{logs}")
            time.sleep(1.0)
