"""A cluster in a box: nodes as namespaces of this machine, each with its own host name, network, IPC and /dev/shm.

A node is what ``unshare`` makes: on a bridge of its own, with an address, an /etc/hosts that knows the others, and a
local directory. Files and process numbers are shared: the launcher, on one node, has to enter the others.
"""

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Self

from commands import began

ROOT = Path(__file__).parents[2]
BIN = Path(sys.prefix) / "bin"
KINDS = ("--net", "--uts", "--ipc", "--mount")


def refusal() -> str:
    """Why no box can be made here; empty where it can."""
    if sys.platform != "linux" or os.geteuid() != 0:
        return "nodes are namespaces of Linux, made by root"
    missing = [name for name in ("unshare", "nsenter", "ip", "mount") if shutil.which(name) is None]
    if missing:
        return f"{', '.join(missing)} not found (Debian's util-linux and iproute2)"
    trial = "ip link add one type veth peer name two && ip link add three type bridge && mount -t tmpfs x /dev/shm"
    command = ["unshare", *KINDS, "sh", "-c", trial]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return f"not allowed here: {done.stderr.strip()[:200]}" if done.returncode else ""


class Node:
    """One node: a process that holds its namespaces, the first of those in it.

    Parameters
    ----------
    name, address : str
        Its host name, and its address on the bridge.
    local : Path
        A directory of its own, whatever others see there.
    """

    def __init__(self, name: str, address: str, local: Path, hosts: Path) -> None:
        self.name, self.address = name, address
        local.mkdir(exist_ok=True)
        script = (
            f"hostname {name} && ip link set lo up && mount -t tmpfs shm /dev/shm && mount -t tmpfs local {local} && "
            f"mount --bind {hosts} /etc/hosts && echo up && exec sleep infinity"
        )
        self._holder = subprocess.Popen(
            ["unshare", *KINDS, "sh", "-c", script], stdout=subprocess.PIPE, text=True
        )
        assert self._holder.stdout is not None
        assert self._holder.stdout.readline() == "up\n", f"{name} does not come up"
        self.pid = self._holder.pid
        self._net = os.readlink(f"/proc/{self.pid}/ns/net")

    def words(self, command: Sequence[str]) -> list[str]:
        """A command as it is given to run on this node."""
        return ["nsenter", "-t", str(self.pid), "-n", "-u", "-i", "-m", "--", *command]

    def run(self, *command: str) -> str:
        """Output of a short command on this node."""
        done = subprocess.run(self.words(command), capture_output=True, text=True, check=True)
        return done.stdout

    def processes(self, word: str = "hpcclear") -> dict[int, str]:
        """Processes of the node with a word in their command, zombies left out, by number."""
        found = {}
        for place in Path("/proc").glob("[0-9]*"):
            with contextlib.suppress(OSError):
                if os.readlink(place / "ns" / "net") == self._net:
                    command = (place / "cmdline").read_bytes().replace(b"\0", b" ").decode()
                    if word in command:
                        found[int(place.name)] = command
        return found

    def ranks(self) -> dict[int, int]:
        """Process numbers of this node's ranks of a job, by rank."""
        found = {}
        for process in self.processes():
            with contextlib.suppress(OSError):
                for entry in Path(f"/proc/{process}/environ").read_bytes().split(b"\0"):
                    name, _, value = entry.partition(b"=")
                    if name in (b"PMI_RANK", b"SLURM_PROCID"):
                        found[int(value)] = process
        return found

    def kill(self) -> None:
        """End at once all that runs there."""
        while running := self.processes(""):
            for process in running:
                with contextlib.suppress(ProcessLookupError):
                    os.kill(process, signal.SIGKILL)
            self._holder.poll()
            time.sleep(0.01)
        self._holder.wait()


class Box:
    """Some nodes on one bridge; a context, outside of which nothing of it is left.

    Parameters
    ----------
    nodes : int
    directory : Path
        Shared by all; gets the hosts file, local directories and the launcher.
    """

    def __init__(self, nodes: int, directory: Path) -> None:
        self.directory = directory
        self.nodes: list[Node] = []
        self._count = nodes
        self.launcher = directory / "enter"

    def __enter__(self) -> Self:
        hosts = self.directory / "hosts"
        names = [f"box{k}" for k in range(1, self._count + 1)]
        lines = [f"10.111.0.{k} {name}" for k, name in enumerate(names, 1)]
        hosts.write_text("\n".join(["127.0.0.1 localhost", *lines]) + "\n")
        self._switch = subprocess.Popen(
            ["unshare", "--net", "sh", "-c", "echo up && exec sleep infinity"],
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self._switch.stdout is not None
        self._switch.stdout.readline()
        try:
            self._in_switch("ip link add bridge type bridge && ip link set bridge up")
            for k, name in enumerate(names, 1):
                node = Node(name, f"10.111.0.{k}", self.directory / f"local-{name}", hosts)
                self.nodes.append(node)
                self._plug(node)
            lines = [f"{node.name}) pid={node.pid} ;;" for node in self.nodes]
            self.launcher.write_text(_LAUNCHER.format(cases="\n    ".join(lines)))
            self.launcher.chmod(0o755)
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *exception: object) -> None:
        for node in self.nodes:
            node.kill()
        self._switch.kill()
        self._switch.wait()

    def mpiexec(self, ranks: int, *options: str) -> list[str]:
        """The first words of a job on all nodes, on `ranks` of each, given on the first node."""
        hosts = ",".join(f"{node.name}:{ranks}" for node in self.nodes)
        command = [str(BIN / "mpiexec"), "-launcher", "ssh", "-launcher-exec", str(self.launcher)]
        total = str(ranks * len(self.nodes))
        return self.nodes[0].words([*command, *options, "-hosts", hosts, "-n", total])

    def start(
        self,
        words: Sequence[str],
        ranks: int = 1,
        program: Sequence[str] = ("-m", "hpcclear"),
        **settings: str,
    ) -> subprocess.Popen:
        """Start the program under mpiexec."""
        return began([*self.mpiexec(ranks), sys.executable, *program, *words], **settings)

    def left(self) -> dict[str, list[str]]:
        """What still runs of the program on each node."""
        found = {node.name: list(node.processes().values()) for node in self.nodes}
        return {name: commands for name, commands in found.items() if commands}

    def wait_until_empty(self, seconds: float) -> float:
        """Wait until nothing of the program runs any more; the seconds it took, infinite if longer than `seconds`."""
        began = time.monotonic()
        while time.monotonic() - began < seconds:
            if not self.left():
                return time.monotonic() - began
            time.sleep(0.2)
        return float("inf")

    def cut(self, node: Node) -> None:
        """Pull the plug of a node's network."""
        self._in_switch(f"ip link set p{node.name} down")

    def _plug(self, node: Node) -> None:
        port = f"p{node.name}"
        self._in_switch(
            f"ip link add {port} type veth peer name eth0 netns {node.pid} && ip link set {port} master bridge up"
        )
        node.run("sh", "-c", f"ip addr add {node.address}/24 dev eth0 && ip link set eth0 up")

    def _in_switch(self, script: str) -> None:
        words = ["nsenter", "-t", str(self._switch.pid), "-n", "sh", "-c", script]
        subprocess.run(words, check=True)


# As hydra calls ssh: options, a host name, a command in words that a shell is to read.
_LAUNCHER = """#!/bin/bash
while [[ $1 == -* ]]; do shift; done
case $1 in
    {cases}
    *) echo "no node $1" >&2; exit 1 ;;
esac
shift
exec nsenter -t $pid -n -u -i -m -- sh -c "cd '$PWD' && exec $*"
"""
