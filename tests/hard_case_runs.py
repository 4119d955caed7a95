"""The runner of analysis/hard_cases.py, for tests."""

import importlib.util
import sys
from pathlib import Path

PATH = Path(__file__).parent.parent / "analysis" / "hard_cases.py"
_spec = importlib.util.spec_from_file_location("hard_cases", PATH)
assert _spec is not None
assert _spec.loader is not None
hard_cases = importlib.util.module_from_spec(_spec)
sys.modules["hard_cases"] = hard_cases
_spec.loader.exec_module(hard_cases)
