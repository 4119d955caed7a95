"""What an import brings with it, asked of a fresh interpreter."""

import subprocess
import sys

from patience import crowded


def loaded_by(statement: str, suspects: set[str]) -> set[str]:
    """Those of the suspected modules that are loaded after a statement."""
    code = f"import sys\n{statement}\nprint(*({suspects!r} & set(sys.modules)))"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=crowded(120)
    )
    assert done.returncode == 0, done.stderr
    return set(done.stdout.split())
