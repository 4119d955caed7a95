"""What is public stays: the test compares with the surface of the last release, and generated changes turn it red."""

import copy
import inspect
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import surface
from patience import crowded

import hpcclear
from hpcclear import __version__

ROOT = Path(__file__).resolve().parent.parent


def test_nothing_public_has_changed_since_the_last_release():
    """`python tests/surface.py` renews what is compared with, at a release or together with a changelog entry."""
    assert surface.changes(surface.stored(), surface.surface()) == []


@pytest.mark.parametrize(("module", "function"), [("identify", "identify"), ("study", "run_study")])
def test_a_module_that_is_called_has_the_parameters_of_its_function(module, function):
    """On every Python: those before 3.13 leave out the first one of a static `__call__`."""
    called = getattr(hpcclear, module)
    assert inspect.signature(called) == inspect.signature(getattr(called, function))
    assert next(iter(inspect.signature(called).parameters)) == "scene"


SOURCES = {
    "a renamed function": (
        {"__init__.py": ('"grid"', '"lattice"'),
         "results/grids.py": ("SHAPE = ", "def lattice(content):\n    return grid(content)\n\n\nSHAPE = ")},
        "Python hpcclear.grid: is gone",
    ),
    "a removed scene entry": (
        {"scene/effects.py": ("    slider_load: Annotated", "    load_of_slider: Annotated")},
        "scene effects.slider_load: is gone",
    ),
    "a changed unit": (
        {"results/kinds/response.py": ('"crank_angle": number(("time",), "rad"', '"crank_angle": number(("time",), "deg"')},
        "file response: crank_angle: units: rad before, deg now",
    ),
}  # fmt: skip
"""Changes of files, and what the command says of them."""


@pytest.mark.full
@pytest.mark.parametrize("name", list(SOURCES))
def test_a_change_of_the_sources_is_named(name, tmp_path):
    """python -m pytest tests/test_surface.py -m full"""
    edits, said = SOURCES[name]
    ignored = shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "hpcclear", tmp_path / "hpcclear", ignore=ignored)
    shutil.copy(ROOT / "tests" / "surface.py", tmp_path)
    shutil.copytree(ROOT / "tests" / "data", tmp_path / "data")
    for file, (before, after) in edits.items():
        path = tmp_path / "hpcclear" / file
        text = path.read_text(encoding="utf-8")
        assert before in text, (file, before)
        path.write_text(text.replace(before, after), encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "surface.py", "--changes"],
        cwd=tmp_path, env=os.environ | {"PYTHONPATH": str(tmp_path)}, capture_output=True, text=True,
        timeout=crowded(300.0), check=False,
    )  # fmt: skip
    assert done.returncode == 1, done.stderr
    assert said in done.stdout


def mutations(before: surface.Surface) -> dict[str, surface.Surface]:
    """A surface with one change each: of every part three entries gone, and each kind of fact changed."""
    found = {}
    for part, entries in before.items():
        names = sorted(entries)
        for name in {names[0], names[len(names) // 2], names[-1]}:
            gone = copy.deepcopy(before)
            del gone[part][name]
            found[f"{part} {name}: gone"] = gone
        for key in {key for entry in entries.values() for key in entry}:
            name = next(name for name in names if entries[name].get(key))
            other = copy.deepcopy(before)
            old = entries[name][key]
            changed = {
                list: old[:-1] if isinstance(old, list) else 0,
                str: f"{old} s",
                bool: not old,
                int: -1,
            }
            if key != "required":  # what was needed and is no longer breaks nobody
                other[part][name][key] = changed[type(old)]
                found[f"{part} {name}: {key}"] = other
    return found


def test_generated_changes_are_found_and_new_names_are_none():
    before = surface.stored()
    cases = mutations(before)
    assert len(cases) > 20
    for name, now in cases.items():
        assert len(surface.changes(before, now)) == 1, name
    more = copy.deepcopy(before)
    for part in more.values():
        part["a new one"] = next(iter(part.values()))
    assert surface.changes(before, more) == []


def test_calls_break_by_a_new_needed_parameter_and_not_by_one_with_a_default():
    before = {
        "Python": {
            "f": {"parameters": [["a", "POSITIONAL_OR_KEYWORD", ""], ["b", "KEYWORD_ONLY", "1"]]}
        }
    }
    now = json.loads(json.dumps(before))
    now["Python"]["f"]["parameters"].append(["c", "KEYWORD_ONLY", "None"])
    assert surface.changes(before, now) == []
    now["Python"]["f"]["parameters"][-1][2] = ""
    assert "c is new and has no default" in surface.changes(before, now)[0]
    now["Python"]["f"]["parameters"] = now["Python"]["f"]["parameters"][1::-1]
    assert surface.changes(before, now) == []  # by name only is b, wherever it stands
    now["Python"]["f"]["parameters"] = now["Python"]["f"]["parameters"][1:]
    assert surface.changes(before, now) == ["Python f: parameter b is gone"]


def test_the_version_stands_in_one_place():
    files = ["pyproject.toml", "CITATION.cff", ".zenodo.json", "README.md", "tests/release.sh"]
    paths = [ROOT / name for name in files]
    paths += [path for path in (ROOT / "packaging").rglob("*") if path.is_file()]
    assert len(paths) > 8
    for path in paths:
        assert __version__ not in path.read_text(encoding="utf-8"), path
    assert f'__version__ = "{__version__}"' in (ROOT / "hpcclear" / "__init__.py").read_text()
