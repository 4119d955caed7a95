"""The shape of the package in numbers: rooms, import arrows, circles, sizes; today or at any commit.

    python analysis/structure.py                 # this checkout
    python analysis/structure.py --at HEAD~40    # another commit of it

Everything is read from the sources; nothing of the package is imported or run. Imports within functions and under
TYPE_CHECKING count as well. An arrow joins two entries (a file or a folder) of the package's top level; a circle is a
group of modules each of which reaches the others by imports.
"""

import argparse
import ast
import graphlib
import io
import re
import statistics
import subprocess
import tarfile
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = "hpcclear"
MANY_ARGUMENTS = 8
LONG_MODULE = 400


def modules(root: Path) -> dict[str, Path]:
    """Dotted name to file of every module below `root`/hpcclear."""
    found = {}
    for path in sorted((root / PACKAGE).rglob("*.py")):
        parts = path.relative_to(root).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def imports(name: str, path: Path, known: dict[str, Path]) -> Iterator[str]:
    """Modules of the package that a module imports, by any statement."""
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in known)
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                above = package.split(".")[: len(package.split(".")) - node.level + 1]
                base = ".".join([*above, *([node.module] if node.module else [])])
            for alias in node.names:
                inner = f"{base}.{alias.name}"
                if inner in known or base in known:
                    yield inner if inner in known else base


def arrows_of(root: Path) -> set[tuple[str, str]]:
    """The imports between two modules of the package."""
    known = modules(root)
    return {(a, b) for a, path in known.items() for b in imports(a, path, known) if a != b}


def circles_of(names: list[str], arrows: set[tuple[str, str]]) -> list[list[str]]:
    """Groups of modules that reach one another."""
    number = {name: k for k, name in enumerate(names)}
    ends = np.array([(number[a], number[b]) for a, b in sorted(arrows)]).reshape(-1, 2)
    matrix = coo_array((np.ones(len(ends)), ends.T), (len(names), len(names)))
    _, group = connected_components(matrix, connection="strong")
    inside = [[names[k] for k in np.flatnonzero(group == g)] for g in range(group.max() + 1)]
    return [members for members in inside if len(members) > 1]


def top(name: str) -> str:
    """The entry of the package's top level that a module belongs to; the door is the package itself."""
    return name.split(".")[1] if "." in name else PACKAGE


def floors_of(edges: set[tuple[str, str]], package: str) -> tuple[int, int]:
    """Rooms of a package (its files and folders), and floors: the longest chain of rooms each of which uses the next."""
    inside = [
        tuple(name.split(".")[2] for name in edge)
        for edge in edges
        if all(name.startswith(f"{package}.") for name in edge)
    ]
    below: dict[str, set[str]] = {room: set() for edge in inside for room in edge}
    for a, b in inside:
        if a != b:
            below[a].add(b)
    height: dict[str, int] = {}
    for room in graphlib.TopologicalSorter(below).static_order():
        height[room] = 1 + max((height[one] for one in below[room]), default=0)
    return len(height), max(height.values())


def functions(root: Path) -> list[tuple[int, int, str]]:
    """Lines, arguments and place of every function."""
    found = []
    for name, path in modules(root).items():
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                a = node.args
                count = len(a.posonlyargs) + len(a.args) + len(a.kwonlyargs)
                first = (a.posonlyargs + a.args)[:1]
                count -= bool(first) and first[0].arg in ("self", "cls")
                length = (node.end_lineno or node.lineno) - node.lineno + 1
                found.append((length, count, f"{name}.{node.name}"))
    return found


def _repeated(root: Path, texts: dict[str, str]) -> list[tuple[str, str]]:
    """What grows where one thing is done in several ways: sizes, shared names, `Any`, imports at run time."""
    trees = [ast.parse(text) for text in texts.values()]
    classes = Counter(
        node.name
        for tree in trees
        for node in tree.body
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_")
    )
    shared = [f"{name} {count}" for name, count in classes.most_common() if count > 1]
    large = sum(len(text.splitlines()) > LONG_MODULE for text in texts.values())
    loose = sum(len(re.findall(r"\bAny\b", text)) for text in texts.values())
    upwards = sum(len(re.findall(r"import_module\(", text)) for text in texts.values())
    commands = sum(
        len(re.findall(r"^@(?:click\.|cli\.)?command\(", text, re.M))
        for name, text in texts.items()
        if name.startswith(f"{PACKAGE}.cli")
    )
    tests = sum(len(p.read_text().splitlines()) for p in (root / "tests").rglob("*.py"))
    return [
        ("lines of the tests", f"{tests}"),
        ("commands", f"{commands}"),
        ("Any", f"{loose}"),
        ("calls of import_module", f"{upwards}"),
        (f"modules over {LONG_MODULE} lines", f"{large}"),
        ("names that several public classes have", f"{len(shared)}"),
        *[("", words) for words in shared],
    ]


def measure(root: Path) -> list[tuple[str, str]]:
    """What is counted, and the count in words."""
    known, edges = modules(root), arrows_of(root)
    arrows = {(top(a), top(b)) for a, b in edges if top(a) != top(b)}
    circles = circles_of(sorted(known), edges)
    loose = sorted(
        p.name
        for p in (root / PACKAGE).glob("*.py")
        if p.name not in ("__init__.py", "__main__.py")
    )
    rooms = sorted(p.name for p in (root / PACKAGE).iterdir() if any(p.glob("*.py")))
    sizes = {
        name: len(path.read_text(encoding="utf-8").splitlines()) for name, path in known.items()
    }
    largest = max(sizes, key=lambda name: sizes[name])
    found = functions(root)
    longest, many = max(found), sorted((n, where) for _, n, where in found if n > MANY_ARGUMENTS)
    texts = {name: path.read_text(encoding="utf-8") for name, path in known.items()}
    return [
        *_repeated(root, texts),
        ("entries at the top", f"{len(rooms)} folders, {len(loose)} loose modules"),
        ("import arrows between them", f"{len(arrows)}"),
        ("import circles of modules", f"{len(circles)}"),
        ("rooms and floors of dynamics", "{} on {}".format(*floors_of(edges, "hpcclear.dynamics"))),
        (
            "files that ask is_planar",
            f"{sum('is_planar' in p.read_text() for p in known.values())}",
        ),
        ("modules", f"{len(known)}, {sum(sizes.values())} lines"),
        (
            "module, median and largest",
            f"{statistics.median(sizes.values()):.0f}, {sizes[largest]} ({largest})",
        ),
        ("functions", f"{len(found)}"),
        (
            "function, median and largest",
            f"{statistics.median(n for n, _, _ in found):.0f}, {longest[0]} ({longest[2]})",
        ),
        (f"functions of more than {MANY_ARGUMENTS} arguments", f"{len(many)}"),
        *[("", f"{count} {where}") for count, where in reversed(many)],
        *[("circle", ", ".join(circle)) for circle in circles],
    ]


def checkout(commit: str, place: Path) -> Path:
    """The package and its tests as they were at a commit, below `place`."""
    packed = subprocess.run(
        ["git", "archive", commit, PACKAGE, "tests"], cwd=ROOT, check=True, capture_output=True
    ).stdout
    with tarfile.open(fileobj=io.BytesIO(packed)) as archive:
        archive.extractall(place, filter="data")
    return place


def main() -> None:
    """Print the counts."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--at", metavar="COMMIT", help="count at this commit")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        root = ROOT if asked.at is None else checkout(asked.at, Path(place))
        for what, value in measure(root):
            print(f"{what:40} {value}")


if __name__ == "__main__":
    main()
