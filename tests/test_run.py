"""The second command: every step runs whatever became of the others, and the table says what became of each."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
PROJECT = """
[tool.ruff.lint]
select = ["F"]
[tool.mypy]
packages = ["hpcclear"]
[tool.pytest.ini_options]
testpaths = ["tests"]
markers = ["full: long profile", "nightly: left to --nightly"]
[tool.importlinter]
root_package = "hpcclear"
[[tool.importlinter.contracts]]
name = "floors"
type = "layers"
layers = ["hpcclear.above", "hpcclear.below"]
"""
FILES = {
    "pyproject.toml": PROJECT,
    "hpcclear/__init__.py": "",
    "hpcclear/above.py": "import hpcclear.below as below\n\nprint(below.number)\n",
    "hpcclear/below.py": "number: int = 1\n",
    "tests/test_one.py": "def test_one():\n    assert True\n",
}
TESTS = "tests, serial and under mpiexec"
STEPS = (TESTS, "lint", "format", "types", "layers")
ALL_TYPES = "types, every locked Python"
FAULTS = {
    (): {},
    ("lint",): {"hpcclear/below.py": "import os\n\nnumber: int = 1\n"},
    STEPS: {
        "tests/test_one.py": "def test_one():\n    assert []\n",
        "hpcclear/below.py": "import hpcclear.above as above\nimport os\n\nnumber: int='one'\n",
    },
}


def run(checkout: Path, *words: str, set_up: str = "") -> tuple[int, str, dict[str, str]]:
    """Exit code, output, and the table's results of a small project of the same shape."""
    for name, text in FILES.items():
        path = checkout / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if not path.exists():
            path.write_text(text)
    (checkout / "jobs").mkdir()
    (checkout / "jobs" / "environment.sh").write_text(set_up)
    shutil.copy(HERE / "run.sh", checkout / "tests")
    tools = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    inherited = {k: v for k, v in os.environ.items() if not k.startswith(("PYTEST", "PYTHONPATH"))}
    done = subprocess.run(
        ["bash", "tests/run.sh", *words],
        cwd=checkout,
        env=inherited | {"PATH": tools},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=1800,
    )
    rows = re.findall(r"^(\S.*?) +(ok|RED) +\d+:\d\d$", done.stdout, re.MULTILINE)
    return done.returncode, done.stdout, dict(rows)


@pytest.mark.parametrize("red", FAULTS)
def test_every_step_runs_and_the_table_names_the_red_ones(red, tmp_path):
    for name, text in FAULTS[red].items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    code, output, rows = run(tmp_path)
    assert code == (TESTS in red), output
    expected = {"set-up": "ok"} | {name: "RED" if name in red else "ok" for name in STEPS}
    assert rows == expected, output
    assert re.search(r"^1 (passed|failed) in ", output, re.MULTILINE), output
    assert ("concerns developers only" in output) == (red == ("lint",))


@pytest.mark.parametrize("wrong", ["lint", ALL_TYPES])
def test_what_lands_is_decided_by_every_step_and_every_locked_python(wrong, tmp_path):
    faults = FAULTS[("lint",)] if wrong == "lint" else {}
    for name, text in faults.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    (tmp_path / "tests").mkdir(exist_ok=True)
    (tmp_path / "tests" / "types.sh").write_text(f"exit {int(wrong == ALL_TYPES)}\n")
    code, output, rows = run(tmp_path, "--strict")
    assert code == 1, output
    assert [name for name, result in rows.items() if result == "RED"] == [wrong], output
    assert ALL_TYPES in rows
    assert "--strict" in (HERE.parent / ".ci" / "run").read_text()


@pytest.mark.parametrize("words", ["return 3", "exit 2", "no-such-command"])
def test_a_set_up_that_fails_is_one_line_and_nothing_runs(words, tmp_path):
    code, output, rows = run(tmp_path, set_up=words)
    assert code == 1
    assert rows == {"set-up": "RED"}
    assert output.rstrip().endswith("set-up failed: nothing was tested")
    assert "== " not in output


def test_skips_and_their_reasons_end_the_report_and_nightly_leaves_out_nothing(tmp_path):
    (tmp_path / "tests").mkdir()
    skipping = 'import pytest\n\n\ndef test_two():\n    pytest.skip("no browser here")\n'
    (tmp_path / "tests" / "test_two.py").write_text(skipping)
    late = "import pytest\n\n\n@pytest.mark.nightly\ndef test_three():\n    assert True\n"
    (tmp_path / "tests" / "test_three.py").write_text(late)
    code, output, _ = run(tmp_path)
    assert code == 0, output
    assert "1 passed, 1 skipped" in output
    assert "left out by this profile: tests marked full or nightly" in output
    assert "no browser here" in output.rstrip().splitlines()[-1]
    shutil.rmtree(tmp_path / "jobs")
    code, output, _ = run(tmp_path, "--nightly")
    assert "2 passed, 1 skipped" in output
    assert "left out by this profile: tests marked full\n" in output


def test_further_words_go_to_pytest(tmp_path):
    code, output, _ = run(tmp_path, "--junitxml=found.xml", "tests/test_one.py")
    assert code == 0, output
    assert 'tests="1"' in (tmp_path / "found.xml").read_text()


def test_quick_says_what_it_leaves_out_and_leaves_out_what_exists(tmp_path):
    (tmp_path / "tests").mkdir()
    (tmp_path / "tests" / "test_mopso.py").write_text("def test_two():\n    assert True\n")
    (tmp_path / "tests" / "test_trust.py").write_text("assert False\n")
    code, output, _ = run(tmp_path, "--quick")
    assert code == 0, output
    assert "2 passed" in output
    (left,) = re.findall(r"^long=\(([^)]*)\)$", (HERE / "run.sh").read_text(), re.MULTILINE)
    for name in left.split():
        assert (HERE / f"test_{name}.py").exists()
        assert re.search(rf"^ .*\b{name}\b", output, re.MULTILINE)
