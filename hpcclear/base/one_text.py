"""One text of many functions: calls are written out where they stand, before anything is compiled.

What is known beforehand (which effects are on, how many lanes) is put in, and branches that it
decides are dropped, so the text holds what is on and nothing else. It is a file of plain Python beside the compiled code, to
be read, which `hpcclear.base.lowering` compiles.

Only functions that `lane_function` or `scalar_function` has marked are written out, each kind in a text of its own: the two
are compiled with different rules of arithmetic.
"""

import ast
import contextlib
import hashlib
import importlib
import os
import sys
import tempfile
from collections.abc import Callable
from importlib.machinery import SOURCE_SUFFIXES, FileFinder, SourceFileLoader
from pathlib import Path
from types import ModuleType
from typing import Any

from hpcclear.base import kept
from hpcclear.base.code_folder import chosen_folder, source_key
from hpcclear.base.jit import written_kind
from hpcclear.base.text.alike import written_once
from hpcclear.base.text.statements import Writer
from hpcclear.base.text.values import Known, Module, Value, definition_of

_DECORATORS = {
    "lane": '@njit(forceinline=True, error_model="numpy", fastmath=FASTMATH, no_cpython_wrapper=True, no_cfunc_wrapper=True)',
    "scalar": '@njit(error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True)',
}


def text_of(function: Any, name: str, known: dict[str, Any]) -> str:
    """The text of a module that holds `function` as `name`, everything written out."""
    plain = getattr(function, "py_func", function)
    shared = Module()
    shared.used |= {name, "njit", "FASTMATH"}
    parameters = [a.arg for a in definition_of(plain).args.args]
    arguments: list[Value] = [
        Known(known[p]) if p in known else ast.Name(p, ast.Load()) for p in parameters
    ]
    Writer(written_kind(function) or "lane", shared).function(plain, name, arguments, {})
    functions = written_once(shared.functions)
    lines = [f'"""{plain.__module__}.{plain.__name__}, all calls written out."""', ""]
    if len(functions) > 1:
        lines += ["from numba import njit", "from hpcclear.base.jit import FASTMATH"]
    for (module, attribute), text in sorted(shared.imports.items()):
        renamed = f" as {text}" if text != attribute else ""
        lines.append(f"from {module} import {attribute}{renamed}")
    for made, kind in functions:
        lines += ["", ""] + ([_DECORATORS[kind]] if made.name != name else [])
        lines.append(ast.unparse(ast.fix_missing_locations(made)))
    return "\n".join([*lines, ""])


def _folder() -> Path:
    folder = Path(chosen_folder()) / f"texts-{source_key()}"
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    return folder


def one_text(function: Any, label: str, **known: Any) -> Callable[..., Any]:
    """A function with all its calls written out, to be compiled: what stands beside it in its module Python cannot call.

    Parameters
    ----------
    function : callable
        At the top of a module; made by `lane_function` or `scalar_function`, whose kind of calls is written out.
    label : str
        The first part of the text's name.
    **known
        Parameters that are known: numbers, None, tuples of them. The text has the others.

    Returns
    -------
    callable
        From a module of its own, whose file stands beside Numba's cache and is kept for the next process.
    """
    plain = getattr(function, "py_func", function)
    asked = f"{plain.__module__}.{plain.__qualname__} {sorted(known.items())!r}"
    name = f"{label}_{hashlib.sha256(asked.encode()).hexdigest()[:12]}"
    return getattr(module_of(name, lambda: text_of(function, name, known)), name)


def module_of(name: str, write: Callable[[], str]) -> ModuleType:
    """The module of a text that is kept for the next process; `write` is called where there is none yet."""
    loaded = sys.modules.get(f"{_TEXTS}.{name}")
    if loaded is not None:
        return loaded
    path = _folder() / f"{name}.py"
    if not _is_whole(path):
        with kept.alone(path):
            if not _is_whole(path):
                _keep(path, _signed(write().encode()))
    return text_named(name)


def text_named(name: str) -> ModuleType:
    """The module of a text that is there."""
    if _TEXTS not in sys.modules:  # a package, so that one text can import from another
        package = ModuleType(_TEXTS)
        folder = str(_folder())
        package.__path__ = [folder]
        sys.path_importer_cache[folder] = FileFinder(folder, (_Loader, SOURCE_SUFFIXES))
        sys.modules[_TEXTS] = package
    importlib.invalidate_caches()  # the folder may have changed within its date's resolution
    return importlib.import_module(f"{_TEXTS}.{name}")


_TEXTS = "hpcclear_texts"


def _keep(path: Path, text: bytes) -> None:
    """Write a file whole or not at all, and never a second time: Numba's cache goes by its date."""
    with tempfile.NamedTemporaryFile(dir=path.parent, suffix=".part", delete=False) as part:
        part.write(text)
    try:
        os.link(part.name, path)
    except FileExistsError:
        pass  # another rank was faster
    finally:
        os.unlink(part.name)


class _Loader(SourceFileLoader):
    """Takes the byte code of a text only if it is whole."""

    def get_data(self, path: str) -> bytes:
        """Return the content of a file: of the text, or of its byte code."""
        if path == self.path:
            return super().get_data(path)
        content = kept.read(Path(path))
        if content is None:
            raise FileNotFoundError(path)
        return content

    def set_data(self, path: str, data: Any, *, _mode: int = 0o600) -> None:
        """Keep byte code."""
        with contextlib.suppress(OSError):
            Path(path).parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            kept.replace(Path(path), kept.digest(bytes(data)) + bytes(data))


_SIGNED = b"# SHA-256 of the lines above: "


def _signed(text: bytes) -> bytes:
    """A text with its digest in a comment at its end."""
    return text + _SIGNED + kept.digest(text).hex().encode() + b"\n"


def _is_whole(path: Path) -> bool:
    """Whether a text is there; one that is damaged is dropped."""
    try:
        stored = path.read_bytes()
    except OSError:
        return False
    if stored == _signed(stored[: stored.rfind(_SIGNED)]):
        return True
    kept.drop(path)
    return False
