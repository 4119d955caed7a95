"""How to install what a part of the package needs and not everyone has."""

import re
from contextlib import suppress


def installing(extra: str) -> str:
    """Return the command that installs what an extra consists of, as a sentence without a full stop.

    It names the packages, so that it is true wherever this package came from: an index, a wheel or a clone.
    """
    from importlib import metadata  # takes a tenth of the time in which a scene is checked

    wanted = []
    with suppress(metadata.PackageNotFoundError):  # a source tree that is not installed
        for requirement in metadata.requires("hpcclear") or ():
            package, _, condition = requirement.partition(";")
            if re.search(rf"extra == [\"']{extra}[\"']", condition):
                wanted.append(f"'{package.strip()}'")
    packages = " ".join(wanted) or f".[{extra}] in a clone of hpcclear"
    return f"Install it with: pip install {packages}"
