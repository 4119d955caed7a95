"""The runners of analysis/hard_cases.py and analysis/long_run.py, for tests."""

import importlib
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent / "analysis"))

hard_cases = importlib.import_module("hard_cases")
long_run = importlib.import_module("long_run")
