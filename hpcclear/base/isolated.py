"""How this package starts Python processes: they run no code of the current directory.

Python puts the current directory, or that of a script, first on its path: whatever lies there under the name of a library's
module would run. `-P` prevents that and keeps PYTHONPATH. The new process begins with this file, and loads the package
from the directory of this file, which need not be on any path.
"""

import importlib
import importlib.util
import os
import sys

_OWN = os.path.abspath(__file__)


def python(function: str, *words: str) -> list[str]:
    """Command line of a process that calls ``"module:function"`` with words and exits with what that returns."""
    stricter = {"-E": sys.flags.ignore_environment, "-s": sys.flags.no_user_site}
    options = [option for option, chosen in stricter.items() if chosen]
    return [sys.executable, "-P", *options, _OWN, function, *words]


def _package() -> None:
    """Load the package that this file belongs to, though no path leads to it."""
    folder = os.path.dirname(os.path.dirname(_OWN))
    spec = importlib.util.spec_from_file_location(
        "hpcclear", os.path.join(folder, "__init__.py"), submodule_search_locations=[folder]
    )
    assert spec is not None
    assert spec.loader is not None
    sys.modules["hpcclear"] = package = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(package)


def _main() -> object:
    _package()
    module, _, function = sys.argv[1].partition(":")
    return getattr(importlib.import_module(module), function)(*sys.argv[2:])


if __name__ == "__main__":
    sys.exit(_main())  # type: ignore[arg-type]
