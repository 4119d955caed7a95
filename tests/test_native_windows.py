"""Where Unix's modules, functions and signals are missing every command works, or ends in a sentence and exit code 2."""

import ast
import json
import subprocess
import sys
from pathlib import Path

import pytest
from native_windows import MODULES, PAGE, REFUSED, STOPS, WORKS, table
from patience import crowded

from hpcclear import cli
from hpcclear.base import host
from hpcclear.base.errors import InputError, mendable

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="module")
def outcomes(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[int, str]]:
    """Exit code and output of every command."""
    code = (
        "import json, sys; sys.path.insert(0, 'tests'); from pathlib import Path; import native_windows as n;"
        "found = n.outcomes(Path(sys.argv[1]), str(n.ROOT / 'jobs' / 'quickstart.toml')); print(json.dumps(found))"
    )
    place = tmp_path_factory.mktemp("windows")
    done = subprocess.run(
        [sys.executable, "-c", code, str(place)],
        cwd=ROOT, capture_output=True, text=True, timeout=crowded(600.0), check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return {name: tuple(found) for name, found in json.loads(done.stdout).items()}


@pytest.mark.nightly
def test_every_command_works_or_ends_in_a_sentence(outcomes):
    codes = {name: code for name, (code, _) in outcomes.items()}
    assert codes == dict.fromkeys(WORKS, 0) | dict.fromkeys(STOPS, 3) | dict.fromkeys(REFUSED, 2)
    for name, (code, said) in outcomes.items():
        assert "Traceback" not in said, (name, said)
        assert said.strip(), name
        assert code != 2 or "Error: " in said or "Usage: " in said


def test_the_page_lists_every_command_as_the_test_found_it():
    assert {name.split()[0] for name in (*WORKS, *STOPS, *REFUSED)} == set(cli.cli.every())
    assert table() in PAGE.read_text(encoding="utf-8")


def imported_at_the_top(path: Path) -> set[str]:
    """Modules that are imported when a module is."""
    found = set()
    for node in ast.parse(path.read_bytes()).body:
        if isinstance(node, ast.Import):
            found |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            found.add(node.module.partition(".")[0])
    return found


def test_no_module_of_unix_is_imported_at_the_top_nor_outside_the_host():
    assert imported_at_the_top(Path(__file__)) >= {"ast", "hpcclear"}
    for path in (ROOT / "hpcclear").rglob("*.py"):
        assert not imported_at_the_top(path) & set(MODULES), path
        named = {
            alias.name
            for node in ast.walk(ast.parse(path.read_bytes()))
            if isinstance(node, ast.Import)
            for alias in node.names
        }
        assert path.name == "host.py" or not named & set(MODULES), path


@pytest.mark.parametrize("name", host.UNIX_MODULES)
def test_a_missing_module_of_unix_is_a_sentence_that_names_wsl(name):
    known = mendable(ModuleNotFoundError(f"No module named {name!r}", name=name))
    assert isinstance(known, InputError)
    assert name in str(known)
    assert "WSL" in str(known)
    assert mendable(ModuleNotFoundError("No module named 'x'", name="x")) is None
