"""Formulas and units as text: each has the value of an evaluation beside it, or one message, and nothing of it is run."""

import math
import random
import types
from collections import Counter

import formulas
import numpy as np
import pytest
from commands import SCENE

from hpcclear.base.arithmetic import WORDS, FormulaError, names_in, read, value_of
from hpcclear.base.errors import InputError
from hpcclear.base.units import UnitError, to_si
from hpcclear.laws.checks import check_shape, check_units
from hpcclear.laws.constant import with_constants
from hpcclear.laws.formula import law_of
from hpcclear.laws.numbers import _with_numpy, evaluate
from hpcclear.laws.sources import text_of
from hpcclear.scene import load_scene
from hpcclear.scene.loading import scene_of_text

COUNTS = [200, pytest.param(2000, marks=pytest.mark.nightly)]

NAMES = ("(v*b)", "c", "(F*q)")
"""Numbers without a unit, of a friction law."""
UNITS = {"b": "s/m", "c": "", "q": "1/N"}
PARAMETERS = {"b": 2.0, "c": 0.7, "q": 0.5}
SPEEDS, FORCES = (one.ravel() for one in np.meshgrid([-3.0, -0.1, 0.0, 0.4, 2.0], [0.0, 1.0, 30.0]))


def by_hand(value: formulas.Value) -> np.ndarray:
    """Values at all speeds and forces; NaN where Python has none."""
    found = []
    for speed, force in zip(SPEEDS.tolist(), FORCES.tolist(), strict=True):
        try:
            found.append(value({"(v*b)": speed * 2.0, "c": 0.7, "(F*q)": force * 0.5}))
        except (ArithmeticError, ValueError):
            found.append(math.nan)
    return np.array(found)


def in_lanes(law) -> np.ndarray:
    """The same by the text that is compiled, run as Python."""
    lines = [one for one in text_of(law).splitlines() if not one.startswith(("import", "from"))]
    powers = {"exponential": np.exp, "logarithm": np.log, "tanh": np.tanh, "arctan": np.arctan}
    names = {
        "lane_function": lambda function: function, "no_more": np.minimum, "no_less": np.maximum,
        "powers": types.SimpleNamespace(**powers, power=np.power),
        "math": types.SimpleNamespace(sqrt=np.sqrt, copysign=np.copysign),
    }  # fmt: skip
    exec("\n".join(lines), names)
    own = _with_numpy(names["own_ratio"])  # lanes divide by 0 as NumPy does
    law = with_constants(law)
    given = {name: np.full(len(SPEEDS), one) for name, one in PARAMETERS.items()}
    given |= {"speed": SPEEDS, "force": FORCES}
    for once in law.worked_out():
        given |= evaluate(once, given)
    asked = [np.broadcast_to(given[name], len(SPEEDS)) for name in law.arguments(law.ratio)]
    with np.errstate(all="ignore"):
        return np.array([own(*map(np.float64, row)) for row in zip(*asked, strict=True)] or np.nan)


@pytest.mark.parametrize("count", COUNTS)
def test_formulas_of_laws_have_the_value_of_an_evaluation_beside(count):
    """Speeds and forces of both signs and 0; as arrays, and as the text that is compiled for the lanes."""
    rng, ended = random.Random(count), Counter[str]()
    for _ in range(count):
        text, value = formulas.formula(rng, NAMES, rng.randint(1, 4), True)
        expected = by_hand(value)
        try:
            law = law_of("friction", text, tuple(UNITS.items()))
        except FormulaError as error:
            ended[error.reason.partition(":")[0]] += 1
            continue
        known = np.isfinite(expected)
        found = np.broadcast_to(
            evaluate(law.ratio, {**PARAMETERS, "speed": SPEEDS, "force": FORCES}), SPEEDS.shape
        )
        np.testing.assert_allclose(found[known], expected[known], rtol=1e-12, err_msg=text)
        if law.arguments(law.ratio):
            np.testing.assert_allclose(
                in_lanes(law)[known], expected[known], rtol=1e-9, err_msg=text
            )
        try:
            check_shape(law)
            check_units(law, PARAMETERS)
            ended["checked"] += 1
        except FormulaError as error:
            ended[error.reason] += 1
    assert ended["checked"] > 0.7 * count, ended


@pytest.mark.parametrize("count", COUNTS)
def test_formulas_of_designs_have_the_value_of_an_evaluation_beside(count):
    rng = random.Random(count)
    values = {"m2": np.array([0.5, -2.0, 0.0, 31.0]), "C": np.array([1e-4, 3.0, 0.0, -1.0])}
    for _ in range(count):
        text, value = formulas.formula(rng, tuple(values), rng.randint(1, 4), False)
        error = refusal(names_in, text)
        if error is not None:
            assert error.remedy
            continue
        assert set(names_in(text)) <= values.keys()
        found = np.broadcast_to(value_of(text, values), 4)
        for k in range(4):
            try:
                expected = value({name: float(one[k]) for name, one in values.items()})
            except (ArithmeticError, ValueError):
                continue
            if math.isfinite(expected):
                assert found[k] == pytest.approx(expected, rel=1e-12), text


CONTENT = load_scene(SCENE.with_name("slider_crank.toml")).with_({"study": None}).resolved()
LAW = {"law": "expression", "units": {"b": "s/m"}, "b": 0.3}
ROBUST = load_scene(SCENE.with_name("robust_slider_crank.toml")).resolved()


def law_with(kind: str, **entries) -> dict:
    return {**CONTENT, "effects": {**CONTENT["effects"], kind: {**LAW, **entries}}}


PLACES = {
    "contact": lambda text: law_with("contact", force=text),
    "damping of a contact": lambda text: law_with(
        "contact", force=f"K * d**1.5 * (1 + b * ({text}))"
    ),
    "friction": lambda text: law_with("friction", ratio=text),
    "objective": lambda text: with_goal({"formula": text}),
    "distribution": lambda text: with_random(text),
}


def with_goal(goal: dict) -> dict:
    cases = {"own": {"random": ["C"], "objectives": [goal, "mean"]}}
    return {**ROBUST, "study": {**ROBUST["study"], "cases": cases}}


def with_random(text: str) -> dict:
    row = {"distribution": "scipy:gamma", "a": text, "scale": text}
    return {**ROBUST, "study": {**ROBUST["study"], "random": {"C": row}}}


def refusal(call, *arguments, **options) -> InputError | FormulaError | None:
    """What a call is refused with, None where it is not."""
    try:
        call(*arguments, **options)
    except (InputError, FormulaError) as error:
        return error
    return None


def read_or_refused(content: dict) -> str:
    """What is said, "" where it is read."""
    error = refusal(load_scene, content)
    assert error is None or (error.reason and error.remedy)
    return "" if error is None else error.reason


@pytest.mark.parametrize("place", PLACES)
def test_texts_beyond_the_grammar_get_one_message(place):
    for text in formulas.BEYOND:
        read_or_refused(PLACES[place](text))


@pytest.mark.parametrize("count", COUNTS)
def test_damaged_formulas_get_one_message(count):
    rng, places = random.Random(count), list(PLACES.values())
    for k in range(count):
        read_or_refused(places[k % len(places)](formulas.beyond(rng, ("d", "v", "K", "b"))))


@pytest.mark.parametrize("text", formulas.UNITS)
def test_units_are_read_or_get_one_message(text):
    """As the unit of a parameter, of its value, of an entry and of a study's range; none reaches a parser that computes."""
    read_or_refused(law_with("contact", force="K * d**1.5 * (1 + b * v)", units={"b": text}))
    read_or_refused(law_with("contact", force="K * d**1.5 * (1 + b * v)", b=f"0.3 {text}"))
    read_or_refused({**CONTENT, "drive": {**CONTENT["drive"], "speed": f"3 {text}"}})
    with pytest.raises(UnitError):
        to_si(f"3 {text}", "kg*m**7")


FAULTS = {
    "9**9**9**9": "too large", "d**(9**999999999)": "too large", "1e400": "too large", "1e308*10": "too large",
    "exp(1000)": "too large", "1/0": "divides by zero", "d/0": "divides by zero", "0**-1": "without a real value",
    "(-1)**0.5": "without a real value", "log(0)": "without a real value", "sqrt(-2)": "without a real value",
    "d%3": "more than arithmetic", "1<<99999999999": "more than arithmetic", "d//2": "more than arithmetic",
    "1j*d": "more than arithmetic", "factorial(99999)": "calls 'factorial'", "min(d)": "with 1 numbers",
    "max(d, v, 1)": "with 3 numbers", "(d < v) * 3": "where a number is expected", "d and v": "where a number is expected",
    "d if v else d": "for a condition", "-" * 300 + "d": "levels deep", "d" * 501: "more than 500 characters",
}  # fmt: skip


@pytest.mark.parametrize("text", FAULTS)
def test_what_is_wrong_with_a_formula_is_said(text):
    with pytest.raises(FormulaError, match=FAULTS[text]):
        read(text, 500, WORDS)


@pytest.mark.parametrize(
    ("unit", "said"),
    [("s/mm", "not an SI unit"), ("m**9**9**9", "is not known"), ("x", "is not known")],
)
def test_a_formula_has_parameters_in_si_units(unit, said):
    """Its numbers are taken as they are: 0.3 s/mm would be 0.3 s/m."""
    content = law_with("contact", force="K * d**1.5 * (1 + b * v)", units={"b": unit})
    assert said in read_or_refused(content)


def test_a_formula_without_parameters_needs_no_units():
    effects = {**CONTENT["effects"], "contact": {"law": "expression", "force": "K * d**1.5"}}
    assert read_or_refused({**CONTENT, "effects": effects}) == ""


def test_many_parameters_are_refused_in_a_time_that_grows_with_their_number():
    units = {"b": "s/m"} | {f"p{k}": "s/m" for k in range(20_000)}
    content = law_with("contact", force="K * d**1.5", units=units, **dict.fromkeys(units, 1.0))
    assert "more than 32" in read_or_refused(content)


# ---- laws in files --------------------------------------------------------------------------------
HEAD = """from hpcclear import ContactLaw, FrictionLaw, Parameter
import math
NINE = 9
def force(depth, rate, stiffness): return stiffness * depth**1.5
def factor(rate): return 1.0 + 0.1 * rate / (1.0 + abs(rate))
def once(stiffness): return {"own": 2.0 * stiffness}
def ratio(speed): return 0.1 * math.tanh(speed / 0.1)
def slip(speed, deflection): return 0.0 * deflection
"""
BARE = 'words=""'
GIVEN = {
    "ContactLaw": {"force": "force", "factor": "factor", "elastic": "force", "once": "once", "numbers": "{'own': 'N'}",
                   "energy": "force", "kink": "force", "exponent": "force", "damping": "factor", "swing": "force",
                   "without_loss": "'hertz'"},
    "FrictionLaw": {"ratio": "ratio", "kinks": "(ratio,)", "inverse_ramp": "ratio", "steepness": "ratio", "deflection": "slip",
                    "largest": "ratio", "once": "once", "numbers": "{'own': 'N'}"},
}  # fmt: skip
ALONE = [
    pytest.param(
        kind, {key, other}, id=f"{kind}: {key} and {other}" if key != other else f"{kind}: {key}"
    )
    for kind, entries in GIVEN.items()
    for key in entries
    for other in entries
    if key <= other
]


def law_file(tmp_path, text: str, kind: str) -> dict:
    (tmp_path / "own.py").write_text(HEAD + text, encoding="utf-8")
    table = "contact" if kind == "ContactLaw" else "friction"
    effects = {**CONTENT["effects"], table: {"law": "own:LAW"}}
    return {**CONTENT, "effects": effects, "plugins": {"files": {"own": {"source": HEAD + text}}}}


@pytest.mark.parametrize(("kind", "keys"), ALONE)
def test_a_law_without_what_belongs_to_a_part_is_told_so(kind, keys, tmp_path):
    """Every entry alone and every pair: read, or one message, and never an error of Python's."""
    entries = ", ".join(f"{key}={GIVEN[kind][key]}" for key in sorted(keys))
    content = law_file(tmp_path, f"LAW = {kind}({BARE}, {entries})\n", kind)
    error = refusal(load_scene, content, trust=True)
    assert error is None or error.remedy
    for text in ("KeyError", "AttributeError", "NoneType"):
        assert text not in str(error)


STEPS = "\n".join(f"    a{k} = a{k - 1} / 2 + a{k - 1} / 2" for k in range(1, 60))
DOUBLING = f"a0 = stiffness\n{STEPS}\n    return a59 * depth**1.5"
"""Names of constant parts, each of which has the one before twice."""

BODIES = {
    "return stiffness * depth**(9**999999999)": "too large",
    "return stiffness * depth**(1/0)": "divides by zero",
    "return stiffness * depth**1.5" + " * 1.0" * 3000: "",
    "return stiffness * depth**1.5 * (9**(2 + 9**9)) / (9**(2 + 9**9))": "too large",
    "return stiffness * depth**1.5 * (NINE**NINE**NINE)": "too large",
    "return stiffness * depth**1.5 * " + "1" * 400: "not finite",
    "return stiffness * min(depth)": "calls min with 1 numbers",
    "return stiffness * depth**(2 if rate else 3 % 0)": "",
    DOUBLING: "",
}  # fmt: skip


@pytest.mark.parametrize("body", BODIES, ids=range(len(BODIES)))
def test_a_function_of_a_file_is_read_in_bounded_time(body, tmp_path):
    text = f"def own(depth, rate, stiffness):\n    {body}\nLAW = ContactLaw({BARE}, force=own)\n"
    error = refusal(load_scene, law_file(tmp_path, text, "ContactLaw"), trust=True)
    assert BODIES[body] in ("" if error is None else error.reason)


# ---- files and results --------------------------------------------------------------------------------
ENDLESS = "K*d**(9**999999999)"


def test_an_endless_formula_is_refused_in_files_overrides_and_results(tmp_path):
    """A scene file, ``--set``, and the text that a result carries, which `reproduce` and others read."""
    place = SCENE.with_name("slider_crank.toml")
    text = place.read_text(encoding="utf-8")
    law = 'contact = { law = "lankarani-nikravesh", restitution = 0.9 }'
    endless = f'{{ law = "expression", force = "{ENDLESS}" }}'
    changed = text.replace(law, f"contact = {endless}")
    assert changed != text
    path = tmp_path / "scene.toml"
    path.write_text(changed, encoding="utf-8")
    for call in (
        lambda: load_scene(path),
        lambda: load_scene(place, [f"effects.contact={endless}"]),
        lambda: scene_of_text(changed, "result.nc"),
    ):
        with pytest.raises(InputError, match="too large"):
            call()
