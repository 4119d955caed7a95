"""The package's rooms: every module in one of them, and no two modules that need one another."""

import graphlib
import re
from pathlib import Path

import grimp
import pytest

from hpcclear import __version__

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def graph() -> grimp.ImportGraph:
    """Who imports whom, imports inside functions and those for types alone included."""
    return grimp.build_graph("hpcclear", exclude_type_checking_imports=False, cache_dir=None)


def test_no_modules_need_one_another(graph):
    arrows = {name: graph.find_modules_directly_imported_by(name) for name in graph.modules}
    graphlib.TopologicalSorter(arrows).prepare()  # names the circle, if there is one


def test_the_architecture_page_names_files_that_are_there_and_its_walk_is_short():
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    walk = re.findall(r"^\d+\. `([\w/]+\.py)`", page, re.M)
    assert 10 < len(walk) <= 17
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
