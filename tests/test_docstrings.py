"""Docstrings of public names: there at all; shapes and units of arrays, errors and sources said."""

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from hpcclear.laws import laws

PACKAGE = Path(__file__).resolve().parent.parent / "hpcclear"
MODULES = sorted(path for path in PACKAGE.rglob("*.py") if path.name != "__main__.py")
IDS = [str(path.relative_to(PACKAGE)) for path in MODULES]

ARRAY = re.compile(r"\b(Array|NDArray|ndarray|ArrayLike)\b")
SHAPE = re.compile(
    r"shape|scalar|records?\b|rows?\b|[Ii]nd(ex|ices)|columns?\b|\(\w+(, ?[\w+ ]+)*,?\)"
)
PHYSICAL = (
    "ensemble/api",
    "dynamics/response",
    "scene/points",
    "scene/table",
    "accuracy/equations",
)
UNIT = re.compile(r"\bSI\b|\b(m|m/s|N|N m|J|rad|s|kg)\b")
SOURCE = re.compile(r"doi:|eqs? ?\.? ?\(?\d|\beqs?\. |Table \d|Hertz|fdlibm|eq. 10", re.I)


@dataclass(frozen=True)
class Name:
    """A public name: its docstring, and with it those of the class and module around it."""

    path: str
    node: ast.FunctionDef | ast.ClassDef
    around: str

    @property
    def doc(self) -> str:
        return ast.get_docstring(self.node) or ""

    @property
    def all(self) -> str:
        return f"{self.doc}\n{self.around}"


def strings(node: ast.ClassDef) -> Iterator[str]:
    """The docstring of a class, and the words below its fields."""
    for one in node.body:
        if isinstance(one, ast.Expr) and isinstance(one.value, ast.Constant):
            yield str(one.value.value)


def public(path: Path) -> Iterator[Name]:
    """Classes, functions and methods without an underscore."""
    module = ast.parse(path.read_text(encoding="utf-8"))

    def within(parent: ast.Module | ast.ClassDef, prefix: str, around: str) -> Iterator[Name]:
        for node in parent.body:
            if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_"):
                yield Name(f"{prefix}.{node.name}", node, around)
                if isinstance(node, ast.ClassDef):
                    text = "\n".join([*strings(node), around])
                    yield from within(node, f"{prefix}.{node.name}", text)

    yield from within(module, path.stem, ast.get_docstring(module) or "")


def arrays(node: ast.FunctionDef) -> bool:
    """Whether an array goes in or comes out, by the annotations."""
    given = [a.annotation for a in (*node.args.args, *node.args.kwonlyargs)]
    texts = [ast.unparse(a) for a in (*given, node.returns) if a is not None]
    return any(ARRAY.search(text) for text in texts if not text.startswith("Callable"))


def functions(path: Path) -> Iterator[Name]:
    yield from (name for name in public(path) if isinstance(name.node, ast.FunctionDef))


@pytest.mark.parametrize("path", MODULES, ids=IDS)
def test_every_public_name_is_described(path):
    assert ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))), path
    missing = {name.path for name in public(path) if not name.doc}
    assert not missing


@pytest.mark.parametrize("path", MODULES, ids=IDS)
def test_functions_of_arrays_say_their_shape(path):
    silent = [n.path for n in functions(path) if arrays(n.node) and not SHAPE.search(n.all)]
    assert not silent


@pytest.mark.parametrize("name", PHYSICAL)
def test_functions_of_physical_arrays_say_their_unit(name):
    found = [n for n in functions(PACKAGE / f"{name}.py") if arrays(n.node)]
    assert [n.path for n in found if not UNIT.search(n.all)] == []


@pytest.mark.parametrize("path", MODULES, ids=IDS)
def test_input_errors_that_are_raised_are_announced(path):
    for name in functions(path):
        raised = [
            node
            for node in ast.walk(name.node)
            if isinstance(node, ast.Raise) and node.exc and "InputError(" in ast.unparse(node.exc)
        ]
        assert not raised or "InputError" in name.all, name.path


@pytest.mark.parametrize(
    "path", sorted((PACKAGE / "dynamics" / "physics").glob("[a-z]*.py")), ids=lambda p: p.stem
)
def test_laws_name_their_source(path):
    assert [name.path for name in functions(path) if not SOURCE.search(name.all)] == []


def test_contact_laws_cite_their_paper():
    for name, law in laws("contact").items():
        assert "doi:10." in law.source, name
