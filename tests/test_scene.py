"""Scene files: what is accepted, what is refused and how, units, overrides, equality."""

import contextlib
import copy
import functools
import math
import pickle
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings, strategies as st
from jsonschema import Draft202012Validator
from patience import crowded
from refusals import refused

from hpcclear.base import units as scene_units
from hpcclear.base.errors import InputError
from hpcclear.scene import Scene, differences, load_scene, scene_schema
from hpcclear.scene.describing import unused
from hpcclear.scene.paths import flatten, replace

ROOT = Path(__file__).parent.parent
JOBS = sorted((ROOT / "jobs").glob("*.toml"))
BROKEN = sorted((Path(__file__).parent / "broken_scenes").glob("*.toml"))
SLIDER_CRANK = ROOT / "jobs" / "slider_crank.toml"
ROBUST = ROOT / "jobs" / "robust_slider_crank.toml"


@pytest.fixture
def scene() -> Scene:
    return load_scene(SLIDER_CRANK)


@pytest.mark.parametrize("path", BROKEN, ids=lambda path: path.stem)
def test_broken_scene_is_refused_with_key_and_remedy(path: Path) -> None:
    expected = path.read_text().partition("\n")[0].removeprefix("# expect: ")
    key, _, fragment = expected.partition(" | ")
    with pytest.raises(InputError) as caught:
        load_scene(path)
    error = caught.value
    assert (error.key, fragment in str(error)) == (key, True), str(error)
    assert error.reason
    assert error.remedy
    assert error.__cause__ is None
    assert error.__suppress_context__ or error.__context__ is None


def test_what_nothing_of_a_study_reads_is_said() -> None:
    words = "verification.samples=10", "verification.contest=3", "accuracy.exceedance=0.1"
    words = *(f"study.{one}" for one in words), "numerics.target_revolutions=500"
    said = " ".join(unused(load_scene(ROBUST, [*words, "study.cases={mean = ['C']}"])))
    assert re.findall(r"study\.random\.(\w+) is in no case", said) == ["m2", "m3", "u2", "I2"]
    assert "numerics.target_revolutions is not used" in said
    assert "study.verification.contest is not used" in said
    assert "study.accuracy.exceedance is not used" in said


def test_of_two_values_of_an_entry_the_last_counts_and_that_is_said(capsys) -> None:
    scene = load_scene(ROBUST, ["numerics.rtol=1.5e-6", "numerics.rtol=1.5e-7"])
    assert scene.numerics.rtol == 1.5e-7
    assert "numerics.rtol=1.5e-7 replaces numerics.rtol=1.5e-6" in capsys.readouterr().err
    load_scene(ROBUST, ["numerics.rtol=1.5e-7"] * 2)
    assert not capsys.readouterr().err


@pytest.mark.parametrize("path", JOBS, ids=lambda path: path.stem)
def test_shipped_scene_survives_a_round_trip(path: Path, tmp_path: Path) -> None:
    scene = load_scene(path)
    copied = tmp_path / "copy.toml"
    copied.write_text(scene.to_toml())
    for again in (load_scene(copied), load_scene(scene.resolved())):
        assert again == scene
        assert again.hash == scene.hash
    assert scene.text == path.read_text()


def test_formatting_and_spelling_do_not_change_the_hash(scene: Scene, tmp_path: Path) -> None:
    text = SLIDER_CRANK.read_text()
    text = (
        text.replace('"0.3 mm"', "3e-4").replace("0.12", "1.2e-1").replace('"0.5 GPa"', '"500 MPa"')
    )
    text = "# a comment\n" + text.replace("rod = { length", "rod = {  length")
    respelled = tmp_path / "respelled.toml"
    respelled.write_text(text)
    again = load_scene(respelled)
    assert again.text != scene.text
    assert again.hash == scene.hash
    assert again == scene
    assert hash(again) == hash(scene)


def test_every_number_changes_the_hash(scene: Scene) -> None:
    hashes = {scene.hash}
    for path in scene.numeric_paths():
        hashes.add(scene.with_({path: scene.number(path) * 0.99 + 1e-9}).hash)
    assert len(hashes) == len(scene.numeric_paths()) + 1


def test_order_of_variables_counts() -> None:
    first = load_scene(ROBUST)
    content = first.resolved()
    variables = content["study"]["variables"]
    content["study"]["variables"] = dict(reversed(variables.items()))
    second = load_scene(content)
    assert second.hash != first.hash
    assert differences(first, second) == ["study: the order of variables or random inputs"]


def test_differences_name_key_and_both_values(scene: Scene) -> None:
    other = scene.with_({"mechanism.rod.mass": 0.3, "numerics.atol": 1e-9})
    assert differences(scene, other) == [
        "mechanism.rod.mass: 0.21 kg -> 0.3 kg",
        "numerics.atol: (not set) -> 1e-09",
    ]
    assert differences(scene, scene) == []


def test_scene_travels_through_pickle_and_copy(scene: Scene) -> None:
    for again in (pickle.loads(pickle.dumps(scene)), copy.deepcopy(scene)):
        assert again == scene
        assert again.text == scene.text


def test_with_validates_and_keeps_the_original(scene: Scene) -> None:
    changed = scene.with_(**{"joints.crank_rod.clearance": 1e-3})
    assert changed.joints.crank_rod.clearance == 1e-3
    assert scene.joints.crank_rod.clearance == 3e-4
    assert changed.with_({"joints.crank_rod.clearance": "0.3 mm"}) == scene
    assert scene.with_({"effects.friction": None}).effects.friction.law == "none"
    assert scene.with_({"effects.friction": "none"}).effects.friction.law == "none"
    with pytest.raises(InputError, match="bearing radius"):
        scene.with_({"joints.crank_rod.clearance": 0.03})
    with pytest.raises(InputError, match="no dotted path"):
        scene.with_({"joints..clearance": 0.03})


def test_number_and_unit(scene: Scene) -> None:
    assert scene.number("mechanism.rod.mass") == 0.21
    assert scene.unit("joints.crank_rod.clearance") == "m"
    assert scene.unit("effects.contact.restitution") == ""
    with pytest.raises(InputError, match=r"Did you mean 'mechanism\.rod\.mass'"):
        scene.number("mechanism.rod.mas")
    assert "numerics.rtol" not in scene.numeric_paths()


@pytest.mark.parametrize(
    ("override", "path", "value"),
    [
        ("mechanism.rod.mass=0.25", "mechanism.rod.mass", 0.25),
        ("joints.crank_rod.clearance=0.5 mm", "joints.crank_rod.clearance", 5e-4),
        ('joints.crank_rod.clearance="0.5 mm"', "joints.crank_rod.clearance", 5e-4),
        ("drive.speed = 600 rpm", "drive.speed", 20 * math.pi),
        ('effects.contact={law="hunt-crossley", damping=0.5}', "effects.contact.damping", 0.5),
        ("numerics.energy=true", "numerics.energy", True),
        ("joints.rod_slider.kind=ideal", "joints.rod_slider.kind", "ideal"),
        (
            "effects.slider_load=[[0, 1.0], [3.0, 2.0]]",
            "effects.slider_load",
            [[0.0, 1.0], [3.0, 2.0]],
        ),
    ],
)
def test_override(override: str, path: str, value: object) -> None:
    scene = load_scene(SLIDER_CRANK, [override])
    assert dict(flatten(scene.resolved()))[path] == value
    assert scene.text.startswith(f"# set: {override}\n")
    assert load_scene(tomllib.loads(scene.text)) == scene


@pytest.mark.parametrize(("element", "value"), [("range.1", [0.15, 0.5]), ("range.0", [0.5, 0.6])])
def test_override_of_an_element_of_a_list(element: str, value: list[float]) -> None:
    """Counted from 0, as messages name it; an element that a list has not is refused with the whole path."""
    scene = load_scene(ROBUST, [f"study.variables.m1.{element}=0.5"])
    assert scene == load_scene(ROBUST, [f"study.variables.m1.range={value}"])
    with refused("study.variables.m1.range.2"):
        load_scene(ROBUST, ["study.variables.m1.range.2=0.5"])


@pytest.mark.parametrize(
    "override",
    ["mechanism.rod.mass", "=3", "a b=3", ".x=1", "mechanism..rod=1", ".".join("x" * 18) + "=1"],
)
def test_malformed_override_is_refused(override: str) -> None:
    with refused("--set"):
        load_scene(SLIDER_CRANK, [override])


def test_override_cannot_smuggle_in_a_second_key() -> None:
    with refused("mechanism.rod.mass"):
        load_scene(SLIDER_CRANK, ["mechanism.rod.mass=1\nvalue2=2"])


def test_c_drives_the_clearances_there_are() -> None:
    both = load_scene(ROBUST)
    one = load_scene(ROBUST, ["joints.crank_rod.kind=ideal"])
    assert both.study is not None
    assert one.study is not None
    assert both.study.variable("C").paths == (
        "joints.crank_rod.clearance",
        "joints.rod_slider.clearance",
    )
    assert one.study.variable("C").paths == ("joints.rod_slider.clearance",)
    assert one.study.random_input("C").paths == ("joints.rod_slider.clearance",)
    with pytest.raises(InputError, match="no number there"):
        load_scene(
            ROBUST,
            [f"joints.{name}.kind=ideal" for name in ("crank_rod", "rod_slider")]
            + ['effects.friction={law="none"}'],
        )
    assert both.with_({"joints.crank_rod.kind": "ideal"}) == one


def test_a_coefficient_of_zero_is_on(scene: Scene) -> None:
    assert any(
        "friction" in text for text in scene.with_({"effects.friction.coefficient": 0}).effects_on()
    )
    assert scene.with_({"effects.slider_load": 0}).effects.slider_load == 0.0
    assert scene.with_({"effects.slider_load": "none"}).effects.slider_load is None


def test_curves_come_in_radians_and_si(scene: Scene) -> None:
    table = [[0, "1 kN"], ["180 deg", -500], ["360 deg", "1 kN"]]
    loaded = scene.with_({"effects.slider_load": table})
    assert loaded.effects.slider_load == ((0.0, 1000.0), (math.pi, -500.0), (2 * math.pi, 1000.0))
    assert "effects.slider_load" not in loaded.numeric_paths()
    assert "effects.slider_load" in scene.with_({"effects.slider_load": 5}).numeric_paths()


def test_mass_centre_beyond_the_pin_is_only_a_warning(scene: Scene) -> None:
    odd = scene.with_({"mechanism.rod.mass_center": -0.02})
    assert any("mass_center" in text for text in odd.warnings)


def test_start_outside_the_clearance_is_only_a_warning(scene: Scene) -> None:
    on_circle = scene.with_({"joints.crank_rod.start_eccentricity": ["0.3 mm", 0]})
    assert on_circle.joints.crank_rod.start_eccentricity.x == 3e-4
    assert on_circle.warnings == scene.warnings
    beyond = scene.with_({"joints.crank_rod.start_eccentricity": ["0.4 mm", 0]})
    assert len(beyond.warnings) == len(scene.warnings) + 1


# --- units -------------------------------------------------------------------------------------


@given(value=st.floats(1e-9, 1e9), unit=st.sampled_from(["um", "mm", "cm", "m"]))
def test_lengths_are_rounded_once(value: float, unit: str) -> None:
    digits = {"um": 6, "mm": 3, "cm": 2, "m": 0}[unit]
    mantissa, _, exponent = f"{value:.16e}".partition("e")
    assert scene_units.to_si(f"{value:.16e} {unit}", "m") == float(
        f"{mantissa}e{int(exponent) - digits}"
    )


# --- files -------------------------------------------------------------------------------------


def test_unreadable_files_are_refused(tmp_path: Path) -> None:
    latin = tmp_path / "latin.toml"
    latin.write_bytes("# Reibungszahl für\n[mechanism]\n".encode("latin-1"))
    big = tmp_path / "big.toml"
    big.write_bytes(b"#" * 1_000_001)
    binary = tmp_path / "binary.toml"
    binary.write_bytes(bytes(range(256)))
    loop = tmp_path / "loop.toml"
    loop.symlink_to(loop)
    sources = [
        tmp_path,
        tmp_path / "missing.toml",
        latin,
        big,
        binary,
        loop,
        Path("/dev/zero"),
        "a\0b",
    ]
    for source in sources:
        with refused("scene file"):
            load_scene(source)


def test_symbolic_link_and_byte_order_mark_are_fine(tmp_path: Path, scene: Scene) -> None:
    marked = tmp_path / "marked.toml"
    marked.write_bytes(b"\xef\xbb\xbf" + SLIDER_CRANK.read_bytes().replace(b"\n", b"\r\n"))
    link = tmp_path / "link.toml"
    link.symlink_to(marked)
    assert load_scene(link) == scene


HOSTILE = [
    "a." * 400_000 + "a=1",
    "[" + "a." * 400_000 + "a]",
    '"a".' * 200_000 + "a=1",
    "a . " * 200_000 + "a=1",
    "a=" + "[" * 900_000,
    "a=" + "{a=" * 200_000,
    "x" * 999_000,
    "a = " + "9" * 900_000,
    "a = 1e" + "9" * 900_000,
    "".join(f"k{i}=1\n" for i in range(90_000)),
    "a = '" + "." * 900_000,
    '"' * 900_000,
]


def test_hostile_files_end_quickly(tmp_path: Path) -> None:
    for index, text in enumerate(HOSTILE):
        (tmp_path / f"{index}.toml").write_text(text)
    # In a process of its own, because a parser that hangs in a pattern cannot be interrupted.
    code = (
        "from hpcclear.base.errors import InputError\nfrom hpcclear.scene import load_scene\n"
        f"for index in range({len(HOSTILE)}):\n"
        f"    try:\n        load_scene(f'{tmp_path}/{{index}}.toml')\n"
        "    except InputError as error:\n        print(index, flush=True)"
    )
    command = [sys.executable, "-c", code]
    result = subprocess.run(
        command, capture_output=True, text=True, timeout=crowded(60), check=True
    )
    assert result.stdout.split() == [str(index) for index in range(len(HOSTILE))]


# --- fuzzing -----------------------------------------------------------------------------------

SHIPPED = [load_scene(path).resolved() for path in JOBS]
PATHS = [[key for key, _ in flatten(content)] for content in SHIPPED]
NUMBERS = st.one_of(
    st.floats(),
    st.integers(),
    st.integers(min_value=10**300, max_value=10**320),
    st.sampled_from([0, -1, 1, 1e300, -0.0, 5e-324]),
)
STRINGS = st.one_of(
    st.text(max_size=12),
    st.sampled_from(
        ["0.3 mm", "3 kg", "1e9 m", "nan", "auto", "none", "ideal", "torque", "1 m**9"]
    ),
)
SCALARS = st.one_of(NUMBERS, STRINGS, st.booleans(), st.none(), st.dates())
KEYS = st.one_of(
    st.text(max_size=8),
    st.sampled_from(
        sorted({part for paths in PATHS for path in paths for part in path.split(".")})
    ),
)
VALUES = st.recursive(
    SCALARS,
    lambda inner: st.one_of(st.lists(inner, max_size=4), st.dictionaries(KEYS, inner, max_size=4)),
    max_leaves=12,
)
QUICK = settings(
    max_examples=150, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck)
)
LONG = settings(QUICK, max_examples=10_000)


def _loads_or_refuses(content: dict[str, object]) -> None:
    try:
        scene = load_scene(content)
    except InputError:
        return
    assert load_scene(scene.resolved()).hash == scene.hash
    assert load_scene(tomllib.loads(scene.to_toml())) == scene


@st.composite
def _mutants(draw: st.DrawFn) -> dict[str, object]:
    index = draw(st.integers(0, len(SHIPPED) - 1))
    content = copy.deepcopy(SHIPPED[index])
    for _ in range(draw(st.integers(1, 3))):
        path = draw(st.sampled_from(PATHS[index]))
        path = ".".join(path.split(".")[: draw(st.integers(1, 4))])
        content = replace(content, path, draw(VALUES))
    return content


@QUICK
@given(content=st.dictionaries(KEYS, VALUES, max_size=6))
def test_random_content_loads_or_is_refused(content: dict[str, object]) -> None:
    _loads_or_refuses(content)


@QUICK
@given(content=_mutants())
def test_mutated_scene_loads_or_is_refused(content: dict[str, object]) -> None:
    _loads_or_refuses(content)


@pytest.mark.full
@LONG
@given(content=_mutants())
def test_many_mutated_scenes_load_or_are_refused(content: dict[str, object]) -> None:
    _loads_or_refuses(content)


@QUICK
@given(data=st.data())
def test_damaged_text_loads_or_is_refused(
    data: st.DataObject, tmp_path_factory: pytest.TempPathFactory
) -> None:
    text = bytearray(ROBUST.read_bytes())
    for _ in range(data.draw(st.integers(1, 5))):
        place = data.draw(st.integers(0, len(text) - 1))
        text[place : place + data.draw(st.integers(0, 40))] = data.draw(st.binary(max_size=6))
    source = tmp_path_factory.getbasetemp() / "damaged.toml"
    source.write_bytes(text)
    with contextlib.suppress(InputError):
        load_scene(source)


# --- schema ------------------------------------------------------------------------------------


@functools.cache
def validator_of_scenes() -> Draft202012Validator:
    """Made, and checked to be a schema, once."""
    Draft202012Validator.check_schema(scene_schema())
    return Draft202012Validator(scene_schema())


@pytest.mark.parametrize(
    "path",
    [*JOBS, *(ROOT / "jobs" / "linkages").glob("*.toml"), *(ROOT / "hpcclear").glob("cli/*.toml"),
     *(ROOT / "docs" / "mkdocs" / "examples").glob("*.toml")],
    ids=lambda path: f"{path.parent.stem}-{path.stem}",
)  # fmt: skip
def test_schema_accepts_what_is_shipped(path: Path) -> None:
    validator = validator_of_scenes()
    assert list(validator.iter_errors(tomllib.loads(path.read_text()))) == []
    assert list(validator.iter_errors(load_scene(path).resolved())) == []


def test_a_key_of_a_table_given_alone_is_sent_there() -> None:
    with pytest.raises(InputError, match=r"belongs to \[effects\].*Write effects.gravity"):
        load_scene(JOBS[0], ["gravity=9.81"])
    with pytest.raises(InputError, match=r'or "none"'):
        load_scene(JOBS[0], ["effects.friction=off"])


def test_a_study_that_leaves_out_the_scene_itself_is_worth_a_warning() -> None:
    path = next(path for path in JOBS if path.stem == "quickstart")
    assert not any("outside" in text for text in load_scene(path).warnings)
    heavy = load_scene(path, ["mechanism.rod.mass=0.55"])
    assert any("0.105 kg to 0.42 kg" in text and "0.55 kg" in text for text in heavy.warnings)


def test_schema_knows_the_word_that_switches_off() -> None:
    validator = validator_of_scenes()
    content = tomllib.loads(JOBS[0].read_text())
    content["effects"] |= {"friction": "none", "guide_friction": "none", "slider_load": "none"}
    assert list(validator.iter_errors(content)) == []
    content["effects"]["friction"] = "nine"
    assert list(validator.iter_errors(content))


@pytest.mark.parametrize(
    "name", ["unknown_key", "boolean_mass", "negative_mass", "missing_mass", "unknown_law"]
)
def test_schema_refuses_wrong_keys_and_values(name: str) -> None:
    path = next(path for path in BROKEN if path.stem == name)
    content = tomllib.loads(path.read_text())
    assert list(validator_of_scenes().iter_errors(content))


def test_the_accuracy_of_a_study_is_read_where_verification_had_it() -> None:
    whole = tomllib.loads((ROOT / "jobs" / "quickstart.toml").read_text())
    asked = whole["study"].pop("accuracy")
    whole["study"].setdefault("verification", {})["accuracy"] = asked
    assert (
        load_scene(whole).required_study.wanted
        == load_scene(ROOT / "jobs" / "quickstart.toml").required_study.wanted
    )
    whole["study"]["accuracy"] = asked
    with pytest.raises(InputError, match=r"stands in \[study\] already"):
        load_scene(whole)
