"""Functions of one text that differ by addresses alone are written, and compiled, once.

The joints of a linkage, the stages of an implicit step: each is the same function at another place of the work array. Where
two are alike but for whole numbers in their subscripts, one stays, and takes what those are apart as parameters. As it is
inlined where it is called, with numbers, the same instructions come out of it.
"""

import ast
import copy
from collections.abc import Iterator

Function = tuple[ast.FunctionDef, str]
"""A definition, and its kind."""

MOST_SHIFTS = 4  # distances by which the addresses of two functions may differ


def written_once(functions: list[Function]) -> list[Function]:
    """The same functions without those that repeat another or do nothing, and calls to match.

    Parameters
    ----------
    functions : list of (ast.FunctionDef, str)
        With their kinds, "lane" or "scalar"; no two share a name of a variable. The last is the one that is requested, and
        stays as it is called. Functions of kind "scalar" are merged where they are equal, as they need not be inlined.
    """
    functions = [(_own_nodes(function), kind) for function, kind in functions]
    while True:
        fewer = _without_empty(functions)
        fewer = _merged(fewer)
        if len(fewer) == len(functions):
            return fewer
        functions = fewer


def _own_nodes(function: ast.FunctionDef) -> ast.FunctionDef:
    """The same function, each of whose nodes stands at one place of it: the writer uses some again."""
    (own,) = ast.parse(ast.unparse(ast.fix_missing_locations(function))).body
    assert isinstance(own, ast.FunctionDef)
    return own


def _without_empty(functions: list[Function]) -> list[Function]:
    empty = {f.name for f, _ in functions[:-1] if all(isinstance(s, ast.Pass) for s in f.body)}
    if not empty:
        return functions
    kept = [(f, kind) for f, kind in functions if f.name not in empty]
    for function, _ in kept:
        _Leave(empty).visit(function)
    return kept


class _Leave(ast.NodeTransformer):
    """Calls of functions that do nothing are left out."""

    def __init__(self, empty: set[str]) -> None:
        self.empty = empty

    def visit_Expr(self, node: ast.Expr) -> ast.stmt:
        call = node.value
        named = isinstance(call, ast.Call) and isinstance(call.func, ast.Name)
        return ast.Pass() if named and call.func.id in self.empty else node  # type: ignore[attr-defined]


def _merged(functions: list[Function]) -> list[Function]:
    """One round: functions that call others which became one may be alike in the next."""
    groups: dict[tuple[str, str], list[_Form]] = {}
    for function, kind in functions[:-1]:
        form = _Form(function)
        groups.setdefault((kind, form.text), []).append(form)
    calls: dict[str, tuple[str, list[int]]] = {}
    for (kind, _), forms in groups.items():
        first, shifts = forms[0], _shifts(forms)
        if len(forms) == 1 or shifts is None or (shifts and kind != "lane"):
            continue
        names = [f"{first.function.name}_shift_{k}" for k in range(len(shifts))]
        first.shift(dict(zip(shifts, names, strict=True)), [form.numbers for form in forms])
        for row, form in enumerate(forms):
            calls[form.function.name] = first.function.name, [shift[row] for shift in shifts]
    kept = [(f, k) for f, k in functions if calls.get(f.name, (f.name, []))[0] == f.name]
    for function, _ in kept:
        _Call(calls).visit(function)
    return kept


class _Form:
    """A function whose variables have numbers for names, and whose addresses are left out."""

    def __init__(self, function: ast.FunctionDef) -> None:
        self.function = function
        self.places = list(_addresses(function))
        self.numbers = [place.value for place in self.places if isinstance(place.value, int)]
        variables = {a.arg for a in function.args.args}
        found = (n for n in ast.walk(function) if isinstance(n, ast.Name))
        variables |= {n.id for n in found if isinstance(n.ctx, ast.Store)}
        bare = copy.deepcopy(function)
        bare.name = ""
        for place in _addresses(bare):
            place.value = 0
        numbered: dict[str, str] = {}
        for node in ast.walk(bare):
            if isinstance(node, ast.arg):
                node.arg = numbered.setdefault(node.arg, str(len(numbered)))
            elif isinstance(node, ast.Name) and node.id in variables:
                node.id = numbered.setdefault(node.id, str(len(numbered)))
        self.text = ast.dump(bare)

    def shift(self, names: dict[tuple[int, ...], str], numbers: list[list[int]]) -> None:
        """Add to each address the parameter that holds how far it is from that of the first function."""
        self.function.args.args += [ast.arg(name) for name in names.values()]
        by_place = dict(zip(map(id, self.places), zip(*numbers, strict=True), strict=True))
        _Shift(by_place, names).visit(self.function)


class _Shift(ast.NodeTransformer):
    def __init__(
        self, numbers: dict[int, tuple[int, ...]], names: dict[tuple[int, ...], str]
    ) -> None:
        self.numbers, self.names = numbers, names

    def visit_Constant(self, node: ast.Constant) -> ast.expr:
        name = self.names.get(_apart(self.numbers.get(id(node), (0,))))
        return node if name is None else ast.BinOp(node, ast.Add(), ast.Name(name, ast.Load()))


class _Call(ast.NodeTransformer):
    """Calls of what is left, with the addresses' shifts."""

    def __init__(self, calls: dict[str, tuple[str, list[int]]]) -> None:
        self.calls = calls

    def visit_Call(self, node: ast.Call) -> ast.expr:
        self.generic_visit(node)
        if isinstance(node.func, ast.Name) and node.func.id in self.calls:
            name, shifts = self.calls[node.func.id]
            return ast.Call(
                ast.Name(name, ast.Load()), [*node.args, *map(ast.Constant, shifts)], []
            )
        return node


def _apart(numbers: tuple[int, ...]) -> tuple[int, ...]:
    return tuple(number - numbers[0] for number in numbers)


def _shifts(forms: list[_Form]) -> list[tuple[int, ...]] | None:
    """By how much addresses of functions lie apart, each distance once; None if there are too many of them."""
    columns = zip(*(form.numbers for form in forms), strict=True)
    shifts = list(dict.fromkeys(s for s in map(_apart, columns) if any(s)))
    return shifts if len(shifts) <= MOST_SHIFTS else None


def _addresses(function: ast.FunctionDef) -> Iterator[ast.Constant]:
    """Whole numbers that are summands of subscripts."""
    for node in ast.walk(function):
        if isinstance(node, ast.Subscript):
            waiting = [node.slice]
            while waiting:
                part = waiting.pop()
                if isinstance(part, ast.BinOp) and isinstance(part.op, ast.Add):
                    waiting += [part.right, part.left]
                elif isinstance(part, ast.Constant) and type(part.value) is int:
                    yield part
