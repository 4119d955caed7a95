"""Texts lowered to machine code compute what Python computes, whatever they hold; and what is interrupted is taken up again."""

import importlib
import random
import sys

import numpy as np
import pytest
from running import scene_with

from hpcclear.base.lowering.compiled import Compiled
from hpcclear.base.lowering.values import DOUBLE, WHOLE, Kind
from hpcclear.dynamics.evaluation.evaluator import DEFAULT_LANES
from hpcclear.dynamics.setup.problem import problem_of
from hpcclear.dynamics.stepping.lanes import Lanes


@pytest.fixture
def function_of(tmp_path, monkeypatch):
    """Write a function's source into a module, as texts are, and load it."""
    monkeypatch.syspath_prepend(tmp_path)
    made = []

    def load(source, head=""):
        name = f"lowered_{tmp_path.name.replace('-', '_')}_{len(made)}"
        made.append(name)
        (tmp_path / f"{name}.py").write_text(f"from math import floor, sqrt\n{head}\n\n{source}")
        importlib.invalidate_caches()
        return importlib.import_module(name).f

    yield load
    for name in made:
        sys.modules.pop(name, None)


def expression(rng, depth):
    """A random expression of doubles x, y and whole numbers i, j."""
    if depth == 0:
        return rng.choice(["x", "y", "i", "j", "2", "0.5", "3.0", "x", "y"])
    one, other = expression(rng, depth - 1), expression(rng, depth - 1)
    forms = [
        f"({one} + {other})", f"({one} - {other})", f"({one} * {other})", f"-({one})", f"abs({one})",
        f"({one} if {other} > 1 else {other})", f"max({one}, {other})", f"min({one}, {other})",
        f"sqrt(1.0 + abs({one}))", f"({one} / (1.5 + abs({other})))", f"float({one} < {other} <= 2.0)",
        f"(1.0 if {one} > 0.0 and not {other} > {one} or {other} == 1 else {other})",
        "(i // 3 + j % 4)", "((i & 3) | (j << 2)) * 1.0", f"floor({one} * 0.25)", "int(x * 8.0)",
    ]  # fmt: skip
    return rng.choice(forms)


def test_expressions_have_the_values_that_python_gives_them(function_of):
    """Without rewrites to the last bit, at places of either sign."""
    rng = random.Random(3)
    sums = "\n".join(f"    out[{k}] = {expression(rng, 3)}" for k in range(60))
    plain = function_of(f"def f(x, y, i, j, out):\n{sums}\n")
    kinds = [Kind(DOUBLE), Kind(DOUBLE), Kind(WHOLE), Kind(WHOLE), Kind("array", (DOUBLE, 1))]
    compiled = Compiled(plain, kinds, ())
    for _ in range(20):
        words = rng.uniform(-3, 3), rng.uniform(-3, 3), rng.randrange(-9, 9), rng.randrange(-9, 9)
        mine, theirs = np.zeros((2, 60))
        plain(*words, theirs)
        compiled(*words, mine)
        np.testing.assert_array_equal(mine, theirs)


STATEMENTS = """
def f(n, given, out):
    total = 0
    for k in range(n - 1, -1, -2):
        if given[k] < 0.0:
            continue_here = 1
        elif k == 3:
            break
        total += given[k]
    out[0] = total
    low, high = 0, n
    while high - low > 1:
        middle = (low + high) // 2
        if given[middle] < given[0]:
            low = middle
        else:
            high = middle
    out[1] = low
    for a, b in ((n, 1), (2 * n, 3)):
        out[1] += a * b
    place = 0
    for r in range(0, 3):
        for c in range(2):
            place += TABLE[r, c] * TABLE[r][c]
    out[2] = place
    part = given[1:4]
    out[3] = part[2] + (given[0], given[1], given[2])[n % 3]
    x, y = swapped(given[0], total)
    out[4] = x - y
    out[5] = early(n) + early(0)
"""
HELPERS = """
import numpy as np
from hpcclear.base.jit import lane_function, scalar_function

TABLE = np.array([[3, 1], [4, 1], [5, 9]])

@lane_function
def swapped(a, b):
    return b, a


@scalar_function
def early(n):
    for k in range(n):
        if k * k > n:
            return k
    return 0.5
"""


def test_statements_do_what_they_do_in_python(function_of):
    """Loops of all kinds, a local that holds a whole number first and doubles later, calls, tuples, tables of a module."""
    compiled_of = function_of(STATEMENTS, HELPERS)
    names = compiled_of.__globals__
    rng = np.random.default_rng(1)
    code = Compiled(compiled_of, [Kind(WHOLE), *[Kind("array", (DOUBLE, 1))] * 2], ())
    for n in range(4, 9):
        given = rng.normal(size=n)
        mine, theirs = np.zeros((2, 6))
        code(n, given, mine)
        kept = {name: names[name] for name in ("swapped", "early")}
        names.update({name: one.py_func for name, one in kept.items()})
        compiled_of(n, given, theirs)
        names.update(kept)
        np.testing.assert_array_equal(mine, theirs)


def test_an_interrupted_compilation_is_taken_up_again(monkeypatch):
    """A stepper never runs on addresses that are not there yet."""
    lanes = Lanes(problem_of(scene_with()), DEFAULT_LANES)

    def interrupted(width, stages):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("hpcclear.dynamics.stepping.lanes.explicit_code", interrupted)
        with pytest.raises(KeyboardInterrupt):
            lanes.step(1)
    assert not lanes.step(1)  # compiled now; nothing is queued
    assert all(lanes._codes[:2])
