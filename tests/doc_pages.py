"""Code blocks of the documentation, found by a Markdown parser, and a reader who runs them in the order of the page."""

import copy
import os
import shutil
import subprocess
import sys
import tomllib
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import tomli_w
from commands import warm
from markdown_it import MarkdownIt
from patience import crowded

from hpcclear.scene import load_scene

ROOT = Path(__file__).resolve().parent.parent
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
READ_ONLY = ("text", "singularity", "matlab")
"""Languages of blocks that are there to be read: what a command prints, a diagram, a recipe for another program."""


@dataclass(frozen=True)
class Block:
    """A fenced block and the words after its language."""

    page: str
    line: int
    language: str
    title: str | None
    no_run: str | None  # the reason
    slow: bool
    quoted: bool  # out of a file that other tests load
    text: str

    @property
    def runs(self) -> bool:
        """Whether it is there to be run, and can be run here."""
        read = self.language in READ_ONLY and self.title is None
        return not read and self.no_run is None and not self.quoted

    def __str__(self) -> str:
        return f"{self.page}:{self.line}"


@cache
def tokens(page: Path) -> list[Any]:
    return MarkdownIt("commonmark").enable("table").parse(page.read_text(encoding="utf-8"))


def blocks(page: Path) -> list[Block]:
    """Every fence of a page."""
    found = []
    for token in tokens(page):
        if token.type == "fence":
            language, _, rest = token.info.partition(" ")
            title = rest.split('"')[1] if rest.startswith("title=") else None
            no_run = rest.removeprefix("no-run:").strip() if rest.startswith("no-run:") else None
            name, line = str(page.relative_to(ROOT)), token.map[0] + 1
            slow = rest.startswith("slow:")
            quoted = rest.startswith("from ")
            found.append(Block(name, line, language, title, no_run, slow, quoted, token.content))
    return found


class Reader:
    """Somebody with a fresh checkout who does what a page says."""

    def __init__(self, place: Path) -> None:
        made = shutil.ignore_patterns(".*", "__pycache__", "*.egg-info")
        # a room of the package is called so too
        made_here = shutil.ignore_patterns("results", "site")

        def ignored(folder: str, names: list[str]) -> set[str]:
            here = made_here(folder, names) if Path(folder) == ROOT else set()
            return {*made(folder, names), *here}

        shutil.copytree(ROOT, place, ignore=ignored)
        self.place = place
        self.names: dict[str, Any] = {"__name__": "__main__"}

    def do(self, block: Block) -> None:
        """Run or load one block; AssertionError or the block's own error when that fails."""
        if block.language == "bash":
            self._shell(block)
        elif block.language == "python" and block.title is not None:
            (self.place / block.title).write_text(block.text, encoding="utf-8")
        elif block.language == "python":
            exec(compile(block.text, str(block), "exec"), self.names)
        elif block.language == "toml":
            self._scene(block)
        else:
            assert block.language in ("csv", *READ_ONLY), f"{block}: unknown language"
            if block.title is not None:
                (self.place / block.title).write_text(block.text, encoding="utf-8")

    def _shell(self, block: Block) -> None:
        programs = (warm().programs, Path(sys.executable).parent, os.environ["PATH"])
        here = {"PATH": os.pathsep.join(map(str, programs)), "MPLBACKEND": "Agg"}
        done = subprocess.run(
            ["bash", "-euo", "pipefail", "-c", block.text],
            cwd=self.place,
            env=os.environ | here,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=crowded(1800 if block.slow else 300),
            check=False,
        )
        assert done.returncode == 0, f"{block}\n{block.text}\n{done.stdout}\n{done.stderr}"
        assert "Traceback" not in done.stderr, f"{block}\n{done.stderr}"

    def _scene(self, block: Block) -> None:
        """A whole scene is loaded; a part takes the place of what stands in the named file, or in a shipped scene."""
        part = tomllib.loads(block.text)
        file = self.place / block.title if block.title else None
        linkage = part.get("mechanism", {}).get("kind") == "planar"
        if not linkage and not {"mechanism", "drive", "joints"} <= part.keys():
            shipped = "quickstart" if "study" in part else "slider_crank"
            base = file or self.place / "jobs" / f"{shipped}.toml"
            part = replaced(tomllib.loads(base.read_text(encoding="utf-8")), part)
        elif file is not None and file.exists():
            part = replaced(tomllib.loads(file.read_text(encoding="utf-8")), part)
        target = file or self.place / "block.toml"
        target.write_text(tomli_w.dumps(part), encoding="utf-8")
        load_scene(target)


def replaced(scene: dict[str, Any], part: dict[str, Any]) -> dict[str, Any]:
    """A scene with the entries of the second level, such as mechanism.rod, taken from a part; a joint that does not say of
    which kind it is adds to what is there."""
    made = copy.deepcopy(scene)
    for key, value in part.items():
        if isinstance(value, dict) and isinstance(made.get(key), dict):
            whole = made[key] if key != "drive" else {}  # a drive is of one kind
            made[key] = {**whole, **value}
            for name in ("bodies", "joints", "drives"):  # of a linkage: some of those that it has
                if name in value and set(value[name]) < set(whole.get(name, ())):
                    made[key][name] = {**whole[name], **value[name]}
            if key == "joints":
                for name, joint in value.items():
                    made[key][name] = {**({} if "kind" in joint else whole[name]), **joint}
        else:
            made[key] = value
    return made
