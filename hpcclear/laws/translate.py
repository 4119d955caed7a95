"""From a plain Python function of arithmetic to the same in words that vectorise: no branch, no library call.

A function may have assignments, arithmetic, comparisons, ``a if c else b``, ``if`` with assignments or returns, and calls of
`WORDS` and of other such functions of its module. Constants of its module are written in.
"""

import ast
import builtins
import inspect
import math
import textwrap
from collections.abc import Callable
from types import FunctionType, ModuleType
from typing import Any

import numpy as np

from hpcclear.base.arithmetic import MOST_POWER, FormulaError, check_count, constant_of

LawError = FormulaError

WORDS = {
    "sqrt": "math.sqrt", "exp": "powers.exponential", "log": "powers.logarithm", "tanh": "powers.tanh",
    "atan": "powers.arctan", "arctan": "powers.arctan", "abs": "abs", "fabs": "abs", "absolute": "abs",
    "copysign": "math.copysign", "min": "no_more", "minimum": "no_more", "max": "no_less", "maximum": "no_less",
    "pow": "powers.power", "power": "powers.power",
}  # fmt: skip
"""What a law may call, of Python, `math` or NumPy, and how that is written in the lanes."""
_SIGNS = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/"}
_ORDERS = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="}


def definition_of(function: Callable[..., object]) -> ast.FunctionDef:
    """The syntax tree of a function."""
    try:
        tree = ast.parse(textwrap.dedent(inspect.getsource(function))).body[0]
    except (OSError, TypeError, SyntaxError, IndexError):
        raise LawError("its source cannot be read", "Write it with def in a file") from None
    if not isinstance(tree, ast.FunctionDef):
        reason = "is not a function written with def"
        raise LawError(reason, "Write it with def, at the top of the file")
    return tree


def written(function: Callable[..., object], name: str, title: str) -> list[str]:
    """Texts of a function, called `name`, and before it of those it calls. Raises LawError if it has more than arithmetic."""
    try:
        return _Writer(title).function(function, name)
    except RecursionError:
        raise LawError(f"{title} is nested too deeply", "Split it into parts") from None


class _Writer:
    """Writes one function and those that it calls."""

    def __init__(self, title: str, depth: int = 0) -> None:
        self.title = title
        self.depth = depth
        self.helpers: list[str] = []
        self.names: dict[object, str] = {}

    def function(self, function: Callable[..., object], name: str) -> list[str]:
        """Its text and those before it."""
        if self.depth > 8:
            raise LawError(f"{self.title} calls itself, or too deeply")
        tree = definition_of(function)
        arguments = [one.arg for one in tree.args.args]
        if tree.args.vararg or tree.args.kwarg or tree.args.kwonlyargs or tree.args.defaults:
            reason = f"{self.title} has arguments with defaults or stars"
            raise LawError(reason, "Name plain arguments")
        self.globals = {**vars(builtins), **getattr(function, "__globals__", {})}
        closed = inspect.getclosurevars(function).nonlocals if function.__closure__ else {}  # type: ignore[attr-defined]
        self.globals |= closed
        self.own = name
        self.known = set(arguments)
        self.lines: list[str] = []
        self.returns: list[tuple[str | None, str]] = []
        self.count = 0
        self.statements(tree.body, None)
        if not self.returns:
            raise LawError(f"{self.title} returns nothing", "End it with return")
        *others, (last, result) = self.returns
        if last is not None and not self.exhaustive(tree.body):
            raise LawError(f"{self.title} does not always return", "End it with return")
        for guard, value in reversed(others):
            result = f"({value} if {guard} else {result})"
        body = "\n".join(f"    {line}" for line in [*self.lines, f"return {result}"])
        text = f"@lane_function\ndef {name}({', '.join(map(self.local, arguments))}):\n{body}\n"
        return [*self.helpers, text]

    def exhaustive(self, body: list[ast.stmt]) -> bool:
        last = body[-1]
        if isinstance(last, ast.If):
            return bool(last.orelse) and self.exhaustive(last.body) and self.exhaustive(last.orelse)
        return isinstance(last, ast.Return)

    def local(self, name: str) -> str:
        """A name that is not among the words."""
        return f"{name}_"

    def let(self, value: str) -> str:
        """A new name for a value."""
        self.count += 1
        self.lines.append(f"t{self.count} = {value}")
        return f"t{self.count}"

    # ---- statements -----------------------------------------------------------------------------
    def statements(self, body: list[ast.stmt], guard: str | None) -> None:
        """Write statements that count where `guard` holds; all are worked out, and chosen from."""
        for k, one in enumerate(body):
            match one:
                case ast.Expr(value=ast.Constant()) | ast.Pass():
                    pass
                case ast.Return(value=value) if value is not None:
                    self.returns.append((guard, self.let(self.text(value))))
                    return
                case ast.Assign(targets=[ast.Name(id=name)], value=value):
                    self.assign(name, self.text(value), guard)
                case ast.AnnAssign(target=ast.Name(id=name), value=value) if value is not None:
                    self.assign(name, self.text(value), guard)
                case ast.AugAssign(target=ast.Name(id=name) as target, op=op, value=value):
                    sum_ = ast.BinOp(ast.Name(target.id, ast.Load()), op, value)
                    self.assign(name, self.text(sum_), guard)
                case ast.If(test=test, body=yes, orelse=no):
                    here = self.let(f"1.0 if {self.text(test)} else 0.0")
                    before = "" if guard is None else f"({guard}) & "
                    self.statements(yes, f"{before}({here} == 1.0)")
                    self.statements(no, f"{before}({here} == 0.0)")
                    self.statements(body[k + 1 :], guard)
                    return
                case _:
                    said = f"{self.title} contains more than arithmetic: {ast.unparse(one)!r}"
                    raise LawError(said)

    def assign(self, name: str, value: str, guard: str | None) -> None:
        own = self.local(name)
        if guard is not None and name in self.known:
            value = f"{value} if {guard} else {own}"
        self.known.add(name)
        self.lines.append(f"{own} = {value}")

    # ---- expressions ----------------------------------------------------------------------------
    def text(self, node: ast.expr) -> str:
        """An expression in words that vectorise."""
        match node:
            case ast.Constant(value=bool() | complex() | str() | bytes() | None):
                pass
            case ast.Constant(value=int() | float() as number):
                return self.number(number)
            case ast.Name(id=name):
                return self.local(name) if name in self.known else self.constant(name)
            case ast.Attribute():
                return self.number(self.value(node))
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return f"(-{self.text(operand)})"
            case ast.UnaryOp(op=ast.UAdd(), operand=operand):
                return self.text(operand)
            case ast.BinOp(left=base, op=ast.Pow(), right=power):
                return self.power(base, power)
            case ast.BinOp(left=left, op=op, right=right) if type(op) in _SIGNS:
                return f"({self.text(left)} {_SIGNS[type(op)]} {self.text(right)})"
            case ast.IfExp(test=test, body=yes, orelse=no):
                return f"({self.text(yes)} if {self.text(test)} else {self.text(no)})"
            case ast.Compare(left=left, ops=ops, comparators=others):
                return self.compared([left, *others], ops)
            case ast.BoolOp(op=op, values=values):
                sign = " & " if isinstance(op, ast.And) else " | "
                return "(" + sign.join(self.text(one) for one in values) + ")"
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                return f"((1.0 if {self.text(operand)} else 0.0) == 0.0)"
            case ast.Call(func=called, args=arguments, keywords=[]):
                return self.call(called, arguments)
        raise LawError(f"{self.title} contains more than arithmetic: {ast.unparse(node)!r}")

    def compared(self, parts: list[ast.expr], ops: list[ast.cmpop]) -> str:
        if any(type(op) not in _ORDERS for op in ops):
            raise LawError(f"{self.title} compares in another way than by size")
        texts = [self.text(one) for one in parts]
        pairs = zip(texts[:-1], ops, texts[1:], strict=True)
        found = [f"({a} {_ORDERS[type(op)]} {b})" for a, op, b in pairs]
        return found[0] if len(found) == 1 else f"({' & '.join(found)})"

    def number(self, value: object) -> str:
        if isinstance(value, bool) or not isinstance(value, int | float | np.number):
            raise LawError(f"{self.title} uses {value!r}, which is not a number")
        try:
            value = float(value)
        except OverflowError:
            value = math.inf
        if not math.isfinite(value):
            raise LawError(f"{self.title} has a number that is not finite")
        return repr(value) if value >= 0 else f"({value!r})"

    def constant(self, name: str) -> str:
        if name not in self.globals:
            reason = f"{self.title} uses {name!r}, which is not defined"
            raise LawError(reason, "Make it an argument")
        return self.number(self.globals[name])

    def value(self, node: ast.expr) -> Any:
        """What a name or an attribute of a module stands for."""
        match node:
            case ast.Name(id=name) if name in self.globals and name not in self.known:
                return self.globals[name]
            case ast.Attribute(value=owner, attr=attribute):
                module = self.value(owner)
                if isinstance(module, ModuleType) and hasattr(module, attribute):
                    return getattr(module, attribute)
        raise LawError(f"{self.title} uses {ast.unparse(node)!r}, which is not defined")

    def named(self, name: str) -> object:
        """What a name of the module stands for; None for an argument or a local value."""
        return None if name in self.known else self.globals.get(name)

    def power(self, base: ast.expr, power: ast.expr) -> str:
        inside = self.text(base)
        negative = isinstance(power, ast.UnaryOp) and isinstance(power.op, ast.USub)
        number: object = power.operand if negative else power  # type: ignore[attr-defined]
        if isinstance(number, ast.Name) and number.id not in self.known:
            number = ast.Constant(self.globals.get(number.id))
        if isinstance(number, ast.BinOp):  # such as 3/2
            known = constant_of(number, self.named)
            if known is not None:
                negative, number = negative != (known < 0.0), ast.Constant(abs(known))
        constant_of(ast.BinOp(base, ast.Pow(), power), self.named)  # has a finite value, if any
        if isinstance(number, ast.Constant):
            value = float(self.number(number.value))
            if value > MOST_POWER:
                raise LawError(f"{self.title} has a power above {MOST_POWER:g}")
            if (2 * value).is_integer():
                result = _products(self.let(inside), value)
                return f"(1.0 / {result})" if negative else result
        return self.let(f"powers.power({inside}, {self.text(power)})")

    def call(self, called: ast.expr, arguments: list[ast.expr]) -> str:
        function = self.value(called)
        texts = [self.text(one) for one in arguments]
        name = getattr(function, "__name__", "")
        home = str(getattr(function, "__module__", "") or "")
        own = home.partition(".")[0] in ("builtins", "math", "numpy")
        known = own or isinstance(function, np.ufunc)
        if name == "float" and known:
            return texts[0]
        if known and name in WORDS:
            check_count(name, len(texts))
            return self.let(f"{WORDS[name]}({', '.join(texts)})")
        if isinstance(function, FunctionType):
            return self.let(f"{self.helper(function)}({', '.join(texts)})")
        reason = f"{self.title} calls {ast.unparse(called)!r}, which the kernel does not provide"
        raise LawError(reason, f"Use one of: {', '.join(WORDS)}")

    def helper(self, function: FunctionType) -> str:
        """The name of another function of the law's, written before this one."""
        if function not in self.names:
            name = f"{self.own}_{function.__name__}"
            self.names[function] = name
            self.helpers += _Writer(self.title, self.depth + 1).function(function, name)
        return self.names[function]


def _products(name: str, power: float) -> str:
    """A power that is a multiple of a half, as products."""
    whole = int(power)
    factors = [name] * whole + ([f"math.sqrt({name})"] if power > whole else [])
    return f"({' * '.join(factors)})" if factors else "1.0"
