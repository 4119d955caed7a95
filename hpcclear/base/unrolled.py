"""Short loops written out before they are compiled: ``for k in written_out(ITEMS)`` becomes one copy of its body for each item.

The compiler vectorises neither a loop over coordinates inside a loop over lanes nor a short one of its own (104 ns against
62 ns for a bank of eight states), and a loop over rates must test of each whether its effect is on, which is pruned only
where it is written out. A decorated function is ordinary Python that does the same, unhurried, without the decorator.
"""

import ast
import inspect
import textwrap
from collections.abc import Callable, Iterable, Sequence
from typing import Any, TypeVar

Item = TypeVar("Item")


def written_out(items: Iterable[Item]) -> Iterable[Item]:
    """Mark a loop over `items`, an expression of module globals, for `unrolled`."""
    return items


def unrolled(function: Callable[..., Any]) -> Callable[..., Any]:
    """The same function with its marked loops written out; to stand below the decorator that compiles.

    Of the item a copy stands for,

    - an attribute is written as its value, a whole number in ``int()``, since a function that takes a bare one is compiled
      anew for each; and so is ``getattr(x, item.name)`` as ``x.value``;
    - the item itself stays ``ITEMS[3]``, or is a number where ITEMS is a range. A function that takes the number is
      compiled anew for each, with a constant in place of the argument; one that takes an array's element is not.

    A local that starts as ``name: dict = {}`` and is indexed by items alone becomes one local for each. Lines keep their
    numbers, so that errors and Numba's cache name the file at hand.

    Raises
    ------
    ValueError
        If no loop is marked.
    """
    tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    definition = tree.body[0]
    assert isinstance(definition, ast.FunctionDef)
    definition.decorator_list = []
    writer = _Writer(function.__globals__)
    writer.visit(definition)
    if not writer.loops:
        raise ValueError(f"{function.__name__}: no loop over written_out(...)")
    ast.increment_lineno(tree, function.__code__.co_firstlineno - 1)
    code = compile(ast.fix_missing_locations(tree), function.__code__.co_filename, "exec")
    made: dict[str, Any] = {}
    exec(code, function.__globals__, made)
    result = made[function.__name__]
    result.__module__, result.__qualname__ = function.__module__, function.__qualname__
    return result  # type: ignore[no-any-return]


class _Writer(ast.NodeTransformer):
    """Replaces marked loops by copies of their bodies, and drops the empty dictionaries of their locals."""

    def __init__(self, names: dict[str, Any]) -> None:
        self.names = names
        self.loops = 0
        self.bags: set[str] = set()

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.AST | None:
        if isinstance(node.value, ast.Dict) and isinstance(node.target, ast.Name):
            self.bags.add(node.target.id)
            return None
        return self.generic_visit(node)

    def visit_For(self, node: ast.For) -> ast.AST | list[ast.stmt]:
        marked = isinstance(node.iter, ast.Call) and ast.unparse(node.iter.func) == "written_out"
        if not marked:
            return self.generic_visit(node)
        assert isinstance(node.iter, ast.Call)
        assert isinstance(node.target, ast.Name)
        self.loops += 1
        source = node.iter.args[0]
        items: Sequence[Any] = eval(ast.unparse(source), self.names)
        written: list[ast.stmt] = []
        for number, item in enumerate(items):
            place = (
                ast.Constant(item)
                if isinstance(items, range)
                else ast.Subscript(source, ast.Constant(number), ast.Load())
            )
            copier = _Copier(node.target.id, item, number, place, self.bags)
            for statement in node.body:
                written.append(copier.visit(ast.parse(ast.unparse(statement)).body[0]))
                for part in ast.walk(written[-1]):
                    if hasattr(part, "lineno") or isinstance(part, ast.expr | ast.stmt):
                        ast.copy_location(part, statement)
        return written


class _Copier(ast.NodeTransformer):
    """One copy of a body: the loop's variable replaced by what it stands for."""

    def __init__(self, name: str, item: Any, number: int, place: ast.expr, bags: set[str]) -> None:
        self.name, self.item, self.number, self.place, self.bags = name, item, number, place, bags

    def visit_Name(self, node: ast.Name) -> ast.expr:
        return self.place if node.id == self.name else node

    def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
        if not (isinstance(node.value, ast.Name) and node.value.id == self.name):
            return self.generic_visit(node)
        value = ast.Constant(getattr(self.item, node.attr))
        whole = isinstance(value.value, int) and not isinstance(value.value, bool)
        return ast.Call(ast.Name("int", ast.Load()), [value], []) if whole else value

    def visit_Subscript(self, node: ast.Subscript) -> ast.AST:
        held = isinstance(node.value, ast.Name) and node.value.id in self.bags
        if held and isinstance(node.slice, ast.Name) and node.slice.id == self.name:
            assert isinstance(node.value, ast.Name)
            return ast.Name(f"{node.value.id}_{self.number}", node.ctx)
        return self.generic_visit(node)

    def visit_Call(self, node: ast.Call) -> ast.AST:
        self.generic_visit(node)
        if isinstance(node.func, ast.Name) and node.func.id == "getattr":
            owner, name = node.args
            if isinstance(name, ast.Constant) and isinstance(name.value, str):
                return ast.Attribute(owner, name.value, ast.Load())
        return node
