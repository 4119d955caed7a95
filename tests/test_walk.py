"""The walk of docs/architecture.md: the files that a number passes in `hpcclear sample`, counted as it runs."""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_the_walk_names_the_files_that_a_number_passes():
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    named = re.findall(r"^\d+\. `([\w/]+\.py)`", page, re.M)
    script = [sys.executable, str(ROOT / "analysis" / "walk.py")]
    done = subprocess.run(script, capture_output=True, text=True, check=True)
    passed = re.findall(r"^ *\d+ ([\w/]+\.py) ", done.stdout, re.M)
    assert sorted(named) == sorted(passed)
