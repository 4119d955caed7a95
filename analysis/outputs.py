"""What commands print on pages of the documentation: run them as the pages have them, keep it, and fill the pages.

    python analysis/outputs.py [NAME ...] [--results DIRECTORY]

A block ``text from analysis/results/output_NAME.txt`` of a page shows the file, which is what the command of its page printed.
Results that are in the directory already are read and not made again.
"""

import argparse
import re
import subprocess
import sys
import textwrap
from pathlib import Path
from typing import NamedTuple

from recorded import RESULTS

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests"))

from doc_pages import blocks  # noqa: E402

DOCS = ROOT / "docs"


class Output(NamedTuple):
    """What is printed on a page."""

    page: str
    """Page with the command; others may show its output as well."""
    words: str
    """Words by which the command is found on it."""
    rows: tuple[str, ...] = ()
    """Labels of the rows that pages show; all rows if empty."""


OUTPUTS = {
    "tutorial": Output("tutorial.md", "run jobs/quickstart.toml"),
    "effects": Output("how-to/effects.md", "effects jobs/slider_crank.toml"),
    "identify": Output("how-to/identify.md", "identify jobs/identify.toml --signal measured.csv"),
    "tolerances": Output(
        "how-to/tolerances.md",
        "run jobs/tolerances.toml",
        ("95th percentile of f", "cost", "fit", "trust"),
    ),
    "constraint": Output("how-to/decisions.md", "run jobs/tolerances.toml", ("constraint ",)),
    "halving": Output("how-to/decisions.md", "run jobs/tolerances.toml", ("tolerances",)),
}


def place_of(name: str) -> Path:
    """The file of an output."""
    return RESULTS / f"output_{name}.txt"


def printed(name: str, results: Path) -> str:
    """What a command prints, after the Python blocks that stand before it on its page."""
    one = OUTPUTS[name]
    for block in blocks(DOCS / one.page):
        made = "write_made" not in block.text or (results / "measured.csv").exists()
        if block.language == "python" and not made:
            code = block.text.replace('"jobs/', f'"{ROOT}/jobs/')
            subprocess.run([sys.executable, "-c", code], cwd=results, check=True)
        for line in block.text.replace("\\\n", " ").splitlines():
            if block.language == "bash" and one.words in " ".join(line.split()):
                command = line.partition("hpcclear ")[2].replace("jobs/", f"{ROOT}/jobs/")
                return _run(f"{sys.executable} -m hpcclear {command}", results)
    raise LookupError(f"{one.page} has no command with {one.words}")


def _run(command: str, place: Path) -> str:
    done = subprocess.run(["bash", "-euc", command], cwd=place, stdout=subprocess.PIPE, check=True)
    return done.stdout.decode()


def shown(text: str, rows: tuple[str, ...] = ()) -> str:
    """The lines of an output that pages show: rows of these labels; without those on files, whose places differ."""
    kept, taken = [], True
    for line in map(str.rstrip, text.splitlines()):
        if line and not line.startswith("  "):  # no further line of the row before
            taken = line.strip().startswith(rows or "") and not line.startswith("written")
        kept += [line] * (taken and bool(line or not rows))
    return textwrap.dedent("\n".join(kept)).strip() + "\n"


def filled(page: Path) -> str:
    """The text of a page with its outputs."""
    return re.sub(
        r"(?<=^```text from analysis/results/)(output_\w+\.txt)\n.*?(?=^```$)",
        lambda found: f"{found[1]}\n{(RESULTS / found[1]).read_text(encoding='utf-8')}",
        page.read_text(encoding="utf-8"),
        flags=re.MULTILINE | re.DOTALL,
    )


def main() -> None:
    """Run, keep, fill."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(OUTPUTS))
    parser.add_argument("--results", type=Path, default=ROOT / "results" / "outputs")
    options = parser.parse_args()
    options.results.mkdir(parents=True, exist_ok=True)
    for name in options.names or OUTPUTS:
        place_of(name).write_text(
            shown(printed(name, options.results), OUTPUTS[name].rows), encoding="utf-8"
        )
    for page in sorted(DOCS.rglob("*.md")):
        page.write_text(filled(page), encoding="utf-8")


if __name__ == "__main__":
    main()
