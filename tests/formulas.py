"""Random formulas and units: of the grammar, with the value that they have, and texts beyond it."""

import math
import random
from collections.abc import Callable, Mapping

Value = Callable[[Mapping[str, float]], float]

_TWO = {
    "+": lambda a, b: a + b, "-": lambda a, b: a - b, "*": lambda a, b: a * b, "/": lambda a, b: a / b,
}  # fmt: skip
_CALLS = {
    "sqrt": math.sqrt, "exp": math.exp, "log": math.log, "tanh": math.tanh, "atan": math.atan, "abs": abs, "fabs": abs,
    "arctan": math.atan, "absolute": abs,
}  # fmt: skip
_OF_TWO = {
    "min": min,
    "max": max,
    "minimum": min,
    "maximum": max,
    "pow": math.pow,
    "power": math.pow,
}
_SIZES = {
    "<": lambda a, b: a < b, "<=": lambda a, b: a <= b, ">": lambda a, b: a > b, ">=": lambda a, b: a >= b,
}  # fmt: skip

BEYOND = (
    "9**9**9**9", "d**(9**999999999)", "(-1)**0.5", "2**0.5j", "1j*d", "d//2", "d%0", "d%3", "1%0", "5//0", "d<<3",
    "1<<99999999999", "~d", "d|1", "d and v", "not d", "d < v", "(d < v) * 3", "d if d else v", "1/0", "0**-1", "d/0", "1e400",
    "1e308*10", "log(0)", "log(-1)", "sqrt(-2)", "exp(1000)", "factorial(99999)", "gamma(500)", "min()", "min(d)",
    "max(d, v, 1)", "sqrt(d, v)", "pow(d)", "sqrt(*d)", "min(a=1)", "d.real", "d[0]", "[d]", "(d, v)", "{d}", "{d: v}",
    "lambda: d", "(d := 3)", "[d for d in v]", "await d", "f'{d}'", "'d'*9999999999", "b'd'", "...", "None", "True", "d is v",
    "d in v", "__import__('os')", "open('x')", "d if v", "d +", "(((((d", "d)", "", " ", "\n", "d\n+ v", "d;v", "d=3",
    "nan", "inf", "sqrt", "d*sqrt", "exp", "\x00", "dé", "ｄ", "d²", "1_000*d", "0x10*d", "0b11*d",
    "1" * 400, "(" * 120 + "d" + ")" * 120,
    "-" * 300 + "d", "+".join(["d"] * 200), "d**" * 40 + "d", "sqrt(" * 90 + "d" + ")" * 90, "not " * 80 + "d < v",
    "d" + "*d" * 90, "d if d < v else " * 20 + "d", "(d if " * 15 + "d<v" + " else v)" * 15, "a" * 450, "d**1e300",
    "d**-1e300", "d**(1e308*10)", "tanh(9**9**9)", "abs(-9**9**9)", "copysign(1, 0/0)", "0*(1/0)", "1 if 1 < 2 else 1/0",
    "d < v < 3 if d else 2", "d if not d < v else v", "d if d < v and v < 2 or d > 3 else v", "d*d if d == v else d != v",
)  # fmt: skip
"""Texts that are no formula, or one whose value must not be computed in just any way."""


def formula(
    rng: random.Random, names: tuple[str, ...], depth: int, calls: bool
) -> tuple[str, Value]:
    """A formula of the grammar and its value, worked out beside any parser; arithmetic errors of Python's are its own."""
    if depth == 0 or rng.random() < 0.15:
        if rng.random() < 0.5:
            name = rng.choice(names)
            return name, lambda given: given[name]
        shown = rng.choice(("0", "1", "2", "3", "0.5", "1.5", "1e-3", "2.5e3", "7", "1e200"))
        return shown, lambda given: float(shown)
    kind = rng.choice(
        ("two", "two", "two", "power", "sign", *(("call", "call2", "if") if calls else ()))
    )
    text, value = formula(rng, names, depth - 1, calls)
    if kind == "sign":
        return f"(-{text})", lambda given: -value(given)
    if kind == "power":
        shown = rng.choice(("2", "3", "0.5", "1.5", "1", "0"))
        return f"({text})**{shown}", lambda given: math.pow(value(given), float(shown))
    if kind == "call":
        word = rng.choice(tuple(_CALLS))
        return f"{word}({text})", lambda given: _CALLS[word](value(given))
    other, second = formula(rng, names, depth - 1, calls)
    if kind == "call2":
        word = rng.choice(tuple(_OF_TWO))
        return f"{word}({text}, {other})", lambda given: _OF_TWO[word](value(given), second(given))
    if kind == "if":
        sign = rng.choice(tuple(_SIZES))
        third, last = formula(rng, names, depth - 1, calls)
        return (
            f"({text} if {other} {sign} {third} else {third})",
            lambda given: value(given) if _SIZES[sign](second(given), last(given)) else last(given),
        )
    sign = rng.choice(tuple(_TWO))
    return f"({text} {sign} {other})", lambda given: _TWO[sign](value(given), second(given))


ODD = ("**", "*", "/", "(", ")", "9", ".", "e9", ",", "<", " if ", " else ", "%", "-", "d", "", "", "²", "~", "^")  # fmt: skip


def mutated(rng: random.Random, text: str) -> str:
    """A text with some characters dropped, doubled or replaced."""
    made = list(text)
    for _ in range(rng.randint(1, 4)):
        place = rng.randrange(len(made) + 1)
        what = rng.choice(ODD)
        made[place : place + rng.randint(0, 2)] = [what]
    return "".join(made)


def beyond(rng: random.Random, names: tuple[str, ...]) -> str:
    """A text that is probably no formula."""
    if rng.random() < 0.3:
        return rng.choice(BEYOND)
    if rng.random() < 0.3:
        return f"{formula(rng, names, 2, True)[0]} {rng.choice('+-*/')} ({rng.choice(BEYOND)})"
    return mutated(rng, formula(rng, names, 4, True)[0])


UNITS = (
    "m**9**9**9", "m^9^9", "m**999999999", "m" * 90, "m*" * 2000 + "m", "(" * 60 + "m" + ")" * 60, "m/" * 30 + "m",
    "1/0", "m/0", "9**9**9", "m**(9**9)", "m^-9", "m^(7/0)", "m^(1/3)", "Gm9 Gm9 Gm9 Gm9 Gm9 Gm9 Gm9 Gm9", "nm-9",
    "N*N*N*N*N*N", "__import__('os')", "m if m else s", "", " " * 500, "%", "per", "m per s", "m per", "é", "m\x00",
    "m\n", "furlong", "ton", "m^1e9",
    "m^1.123456789",
    "x" * 500, "m s" * 40, "°", '"', "''", "deg C", "degC", "K", "dB", "Np", "1", "1/s", "/s", "//s", "*", "m**", "^2", "m^^2",
    "s/m",
)  # fmt: skip
"""Texts that stand for units, or do not."""
