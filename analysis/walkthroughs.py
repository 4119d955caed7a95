"""Times of the walkthroughs: run every block of docs/how-to/walkthroughs.md, and write `analysis/results/walkthroughs.csv`.

    python analysis/walkthroughs.py

Processor time of all processes of a command; on an idle machine the wall time is as long or, on two ranks, half as long.
"""

import os
import re
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests"))

from doc_pages import Block, Reader, blocks  # noqa: E402
from recorded import record  # noqa: E402

PAGE = ROOT / "docs" / "how-to" / "walkthroughs.md"


def spent() -> float:
    """Processor seconds of finished child processes."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def commands(block: Block) -> str:
    """The commands of hpcclear in a block."""
    found = dict.fromkeys(re.findall(r"hpcclear (\w+)", block.text))
    return ", ".join(f"`{name}`" for name in found)


def duration(seconds: float) -> str:
    """A duration in whole seconds."""
    return f"{seconds:.0f} s" if seconds >= 0.5 else "below 0.5 s"


def main() -> None:
    """Run the page, print a row a block as it is done, and record the table."""
    lines = PAGE.read_text(encoding="utf-8").split("\n")
    rows = [("walkthrough", "commands", "processor time")]
    totals: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as folder:
        reader = Reader(Path(folder) / "clone")
        for block in (one for one in blocks(PAGE) if one.runs):
            if block.language != "bash":
                reader.do(block)
                continue
            before = spent()
            path = os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))
            subprocess.run(
                ["bash", "-eu", "-c", block.text],
                cwd=reader.place,
                env=os.environ | {"PATH": path},
                stdout=subprocess.DEVNULL,
                check=True,
            )
            title = [x for x in lines[: block.line] if x.startswith("## ")][-1][3:].split(":")[0]
            seconds = spent() - before
            totals[title] = totals.get(title, 0.0) + seconds
            rows.append((title, commands(block), duration(seconds)))
            print(*rows[-1], sep=" | ", flush=True)
    rows += [(title, "all", duration(seconds)) for title, seconds in totals.items()]
    record("walkthroughs", rows)


if __name__ == "__main__":
    main()
