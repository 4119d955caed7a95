"""What a scene takes from elsewhere than this program: Python files beside it, packages that offer plug-ins."""

import contextlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated

from pydantic.json_schema import JsonSchemaValue

from hpcclear.base.errors import InputError
from hpcclear.plugins.registry import Registry
from hpcclear.plugins.sources import REFERENCE, SCIPY, digest, is_trusting
from hpcclear.scene.fields import Converted, NamedRows, Table, Tables, invalid, table_at


class UntrustedSource(InputError):
    """Python source would be run that nobody has allowed."""


class PluginFile(Table):
    """A Python file beside the scene file. Its text is stored and sent with the scene."""

    name: str
    source: str
    """Complete text of the file."""


class PluginPackage(Table):
    """An installed package that offers a plug-in of this scene."""

    name: str
    version: str
    """Version of the installed package."""


class Plugins(Table):
    """Origin of the plug-ins of this scene. The program adds this table to results; a scene file does not need it."""

    files: Annotated[tuple[PluginFile, ...], NamedRows()] = ()
    """Python files beside the scene file, named in it as "module:Name"."""
    packages: Annotated[tuple[PluginPackage, ...], NamedRows()] = ()
    """Packages whose plug-ins the scene names."""


@dataclass(frozen=True)
class PluginName(Converted):
    """An entry that names a plug-in of some kind."""

    registry: Registry[object]

    def convert(self, value: object) -> str:
        """The name, known to be there; an error for validators where it is none."""
        if not isinstance(value, str):
            raise invalid("a name is expected here", "Write it in quotes")
        with as_invalid():
            self.registry.get(value)
        return value

    def json_schema(self) -> JsonSchemaValue:
        """One of ours, or any other name."""
        other = {"type": "string", "description": 'of a package, or "module:Name" of a file'}
        return {"anyOf": [{"enum": list(self.registry.ours())}, other]}


@contextlib.contextmanager
def as_invalid(key: str = "") -> Iterator[None]:
    """Where a validator requests a plug-in: what is wrong with that as an error of the entry."""
    try:
        yield
    except InputError as error:
        of_file = error.key.endswith(".py")
        reason = f"{error.key}: {error.value}: {error.reason}" if of_file else error.reason
        raise invalid(reason, error.remedy, key) from error


def texts_of(content: Tables) -> dict[str, str]:
    """Source texts that the content of a scene carries, by module; whatever else stands there."""
    rows = table_at(content, "plugins.files").items()
    texts = {str(name): row.get("source") for name, row in rows if isinstance(row, Mapping)}
    return {name: text for name, text in texts.items() if isinstance(text, str)}


def modules_named(content: object) -> set[str]:
    """Modules of all texts in the content of a scene that read ``"module:Name"``."""
    if isinstance(content, str):
        found = REFERENCE.fullmatch(content)
        return {found.group(1)} - {SCIPY} if found else set()
    if isinstance(content, Mapping):
        content = list(content.values())
    inner = content if isinstance(content, (list, tuple)) else ()
    return {module for one in inner for module in modules_named(one)}


def with_texts(content: Tables, read: Callable[[str], str | None]) -> dict[str, object]:
    """The content with the texts of the modules that it names; `read` gives a text, None where there is no such file."""
    texts = {module: read(module) for module in sorted(modules_named(content))}
    rows = {module: {"source": text} for module, text in texts.items() if text is not None}
    return {**content, **({"plugins": {"files": rows}} if rows else {})}


def files_run(plugins: Plugins | None) -> tuple[str, ...]:
    """Return a sentence for each Python file that was run with a scene."""
    files = () if plugins is None else plugins.files
    return tuple(f"the scene names {one.name}.py: its Python code runs" for one in files)


def check_trust(content: Tables, name: str) -> None:
    """InputError if the content carries Python text and nobody has said that it may be run; `name`: where it stands."""
    texts = texts_of(content)
    if not texts or is_trusting():
        return
    listed = ", ".join(f"{one}.py (SHA-256 {digest(text)[:12]})" for one, text in texts.items())
    raise UntrustedSource(
        "plugins.files", name,
        f"its scene contains Python source, which runs only with --trust: {listed}",
        "Read it first; in Python use `with hpcclear.plugins.trusting()`. In your own scene file leave the table out: "
        "the files beside it are read",
    )  # fmt: skip
