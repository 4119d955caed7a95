"""Python files beside a scene: their text is read once, at the root, and travels with the scene.

A text is run in a module of its own, named by its hash; the file is not needed again, and `sys.path` has no part in it.
"""

import contextlib
import hashlib
import re
import sys
import traceback
from collections.abc import Iterator, Mapping
from contextvars import ContextVar
from types import ModuleType
from typing import NamedTuple

from hpcclear.base.errors import InputError
from hpcclear.base.generated import run_text
from hpcclear.base.holding import holding

REFERENCE = re.compile(r"([A-Za-z_][A-Za-z0-9_]{0,39}):([A-Za-z_][A-Za-z0-9_]{0,79})")
"""``"module:Name"``."""

SCIPY = "scipy"  # in place of a module: what scipy.stats has


class _Reading(NamedTuple):
    """What names of plug-ins stand for while a scene is read."""

    texts: Mapping[str, str]
    packages: dict[str, str]


_reading: ContextVar[_Reading | None] = ContextVar("reading", default=None)
_trusted: ContextVar[bool] = ContextVar("trusted", default=False)


@contextlib.contextmanager
def using(texts: Mapping[str, str]) -> Iterator[dict[str, str]]:
    """In this block ``"module:Name"`` is found in these texts. Yields versions, by package, of plug-ins taken."""
    packages: dict[str, str] = {}
    with holding(_reading, _Reading(texts, packages)):
        yield packages


def texts_in_use() -> Mapping[str, str]:
    """Source texts by module, as the innermost `using` has them."""
    here = _reading.get()
    return {} if here is None else here.texts


def note_package(package: str, version: str) -> None:
    """Note that a plug-in of this package was taken."""
    here = _reading.get()
    if here is not None:
        here.packages[package] = version


def trusting(trust: bool = True) -> contextlib.AbstractContextManager[None]:
    """In this block source text that a result file carries may be run."""
    return holding(_trusted, trust)


def is_trusting() -> bool:
    """Whether a `trusting` block is open."""
    return _trusted.get()


def digest(text: str) -> str:
    """SHA-256 of a source text."""
    return hashlib.sha256(text.encode()).hexdigest()


def run_source(module: str, text: str) -> ModuleType:
    """The module of a source text, run at most once in a process; `module`: its name in scenes, ``"mylaws"`` for mylaws.py.

    Raises InputError if it cannot be run: what it raised, and in which line.
    """
    name = f"hpcclear_plugin_{module}_{digest(text)[:16]}"
    if name in sys.modules:
        return sys.modules[name]
    path = f"<{module}.py of the scene, {digest(text)[:12]}>"
    made = ModuleType(name)
    sys.modules[name] = made  # dataclasses look their module up while it is run
    try:
        run_text(text, path, vars(made))
    except (Exception, SystemExit) as error:
        del sys.modules[name]
        reason = "reading the file raised this error"
        remedy = "Correct it; a plug-in is one file, which may import installed packages"
        raise InputError(f"{module}.py", _said(error, path), reason, remedy) from error
    return made


@contextlib.contextmanager
def in_use(key: str, name: str, what: str) -> Iterator[None]:
    """Raise what the plug-in `name` of an entry `key` raises in use as an InputError, with the line it came from."""
    try:
        yield
    except InputError:
        raise
    except Exception as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        reason = f"{what}: {type(error).__name__}: {error} ({place.filename}, line {place.lineno})"
        raise InputError(key, name, reason, "Correct it, or leave the entry out") from error


def _said(error: BaseException, path: str) -> str:
    """What was raised, and the line of the text it came from."""
    if isinstance(error, SyntaxError):
        line = error.lineno if error.filename == path else None
        words = error.msg
    else:
        lines = [f.lineno for f in traceback.extract_tb(error.__traceback__) if f.filename == path]
        line = lines[-1] if lines else None
        words = str(error)
    return f"{type(error).__name__}: {words}" + (f" (line {line})" if line else "")
