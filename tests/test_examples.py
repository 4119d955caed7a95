"""The scripts of `examples` run alone, from another directory, and print numbers."""

import re
import subprocess
import sys

import pytest
from doc_pages import ROOT
from patience import crowded

SCRIPTS = sorted((ROOT / "examples").glob("*.py"))


@pytest.mark.nightly
@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.stem)
def test_examples_run_and_print_finite_numbers(path, tmp_path):
    options = {"cwd": tmp_path, "capture_output": True, "text": True, "timeout": crowded(600)}
    done = subprocess.run([sys.executable, str(path)], **options)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    assert re.search(r"\d", done.stdout)
    assert "nan" not in done.stdout
    assert not list(tmp_path.iterdir())  # an example leaves nothing behind
