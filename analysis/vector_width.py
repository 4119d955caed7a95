"""What vectors of 512 bits save beside 256 on this processor: an ensemble, a response, stiff samples.

    python analysis/vector_width.py            # about two minutes, most of it compilation

Two processes, one compiled for each width, take turns; processor time, medians of pairs. It says so where the processor has
no AVX-512.
"""

import argparse
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

from hpcclear.base import width
from hpcclear.dynamics.response import simulate
from hpcclear.ensemble.session import sample_points
from hpcclear.ranks.boundary import alone
from hpcclear.results.provenance import program
from hpcclear.scene import load_scene
from hpcclear.scene.points import latin_hypercube

JOBS = Path(__file__).parent.parent / "jobs"
STIFF = {
    "effects.contact": {"law": "hunt-crossley", "damping": 50.0},
    "effects.friction": {"law": "coulomb", "coefficient": 0.1, "ramp_speed": 5e-4},
}


def works() -> dict[str, Callable[[], object]]:
    """What is timed, by name."""
    scene, ranks = load_scene(JOBS / "quickstart.toml"), alone()
    many = scene.with_({"study.samples": 512})
    points = latin_hypercube(many)
    one = load_scene(JOBS / "slider_crank.toml")
    few = latin_hypercube(stiff := many.with_({**STIFF, "study.samples": 8}))
    return {
        "ensemble of 512": lambda: sample_points(many, points, ranks),
        "single response": lambda: simulate(one),
        "8 stiff samples": lambda: sample_points(stiff, few, ranks),
    }


def serve() -> None:
    """Be one of the two: time what is named on standard input."""
    known = works()
    for line in sys.stdin:
        work = known[line.strip()]
        begun = time.process_time()
        work()
        print(time.process_time() - begun, flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--pairs", type=int, default=9)
    parser.add_argument("--serve", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.serve:
        return serve()
    print(program()["processor"])
    if width.features() is None:
        print("no vectors of 512 bits here: nothing to choose")
        return None
    servers = {
        bits: subprocess.Popen(
            [sys.executable, __file__, "--serve"], text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            env={**os.environ, "HPCCLEAR_VECTOR_BITS": str(bits)},
        )
        for bits in width.WIDTHS
    }  # fmt: skip

    def ask(bits: int, name: str) -> float:
        server = servers[bits]
        assert server.stdin is not None
        assert server.stdout is not None
        print(name, file=server.stdin, flush=True)
        return float(server.stdout.readline())

    for name in works():
        for bits in servers:
            ask(bits, name)  # compiles
        ratios = []
        for turn in range(options.pairs):
            seconds = {
                bits: ask(bits, name) for bits in (width.WIDTHS if turn % 2 else width.WIDTHS[::-1])
            }
            ratios.append(seconds[512] / seconds[256])
        print(
            f"{name:40s} 512 over 256 bits {statistics.median(ratios):.2f} ({min(ratios):.2f} to {max(ratios):.2f})"
        )
    for server in servers.values():
        server.communicate()
    return None


if __name__ == "__main__":
    main()
