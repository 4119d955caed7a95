"""The package's rooms: every module in one of them, and no two modules that need one another."""

import ast
import graphlib
import re
import tomllib
from pathlib import Path

import grimp
import pytest

from hpcclear import __version__

ROOT = Path(__file__).parents[1]
DOORS = {"hpcclear", "hpcclear.__main__"}


@pytest.fixture(scope="module")
def graph() -> grimp.ImportGraph:
    """Who imports whom, imports inside functions and those for types alone included."""
    return grimp.build_graph("hpcclear", exclude_type_checking_imports=False, cache_dir=None)


def test_no_modules_need_one_another(graph):
    arrows = {name: graph.find_modules_directly_imported_by(name) for name in graph.modules}
    graphlib.TopologicalSorter(arrows).prepare()  # names the circle, if there is one


def test_every_module_stands_in_a_room_of_the_contract(graph):
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    contracts = settings["tool"]["importlinter"]["contracts"]
    floors = next(one["layers"] for one in contracts if one["type"] == "layers")
    rooms = {room.strip() for floor in floors for room in floor.split("|")}
    loose = {name for name in graph.modules - DOORS if name.split(".")[1] not in rooms}
    assert not loose
    assert {path.stem for path in (ROOT / "hpcclear").glob("*.py")} == {"__init__", "__main__"}


def test_no_name_of_a_package_hides_behind_a_module_of_it():
    """Importing a submodule sets its name on the package, over a function that is called the same."""
    hidden = []
    for path in sorted((ROOT / "hpcclear").rglob("__init__.py")):
        inside = {one.stem for one in path.parent.iterdir() if one.suffix in ("", ".py")}
        package = ".".join(path.parent.relative_to(ROOT).parts)
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            names = {getattr(node, "name", "")}
            if isinstance(node, ast.ImportFrom) and node.module != package:
                names |= {one.asname or one.name for one in node.names}
            hidden += [f"{package}.{name}" for name in names & inside]
    assert not hidden


def test_the_architecture_page_names_files_that_are_there_and_its_walk_is_short():
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    walk = re.findall(r"^\d+\. `([\w/]+\.py)`", page, re.M)
    assert 10 < len(walk) <= 20
    assert len(set(walk)) == len(walk)
    named = set(re.findall(r"`((?:\w+/)+\w+\.py)`", page))
    missing = {
        name for name in named if not any((ROOT / top / name).exists() for top in ("", "hpcclear"))
    }
    assert not missing


def test_the_version_stands_in_one_place():
    files = ["pyproject.toml", "CITATION.cff", ".zenodo.json", "README.md", "tests/release.sh"]
    paths = [ROOT / name for name in files]
    paths += [path for path in (ROOT / "packaging").rglob("*") if path.is_file()]
    assert len(paths) > 8
    for path in paths:
        assert __version__ not in path.read_text(encoding="utf-8"), path
