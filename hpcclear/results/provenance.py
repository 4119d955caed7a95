"""Global attributes that say what made a file."""

import functools
import platform
import re
from importlib import metadata

from hpcclear.base import host

_PACKAGES = ("numpy", "scipy", "numba", "llvmlite", "h5py", "xarray", "scikit-learn", "moocore")


@functools.cache
def program() -> dict[str, str]:
    """Return what is said of the program, the packages that it uses and the processor; no time: equal runs, equal bytes."""
    version, python = _version_of("hpcclear"), f"python {platform.python_version()}"
    return {
        "source": f"hpcclear {version}", "history": f"written by hpcclear {version}", "hpcclear_version": version,
        "versions": ", ".join([python, *(f"{name} {_version_of(name)}" for name in _PACKAGES)]),
        "processor": host.processor(),
    }  # fmt: skip


def _version_of(package: str) -> str:
    """The version of an installed package, without a parser of all that is said about it."""
    said = metadata.distribution(package).read_text("METADATA") or ""
    found = re.search(r"^Version: (\S+)", said, re.M)
    return found[1] if found else metadata.version(package)
