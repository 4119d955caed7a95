"""Hostile and damaged input to the real commands: never a traceback, a hang, or exit 0 on nonsense."""

import math
import random
import re
import tomllib
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import pytest
from commands import CHEAP, SCENE, overrides, run, sample, warm_command

from hpcclear.scene import load_scene
from hpcclear.scene.paths import flatten

pytestmark = pytest.mark.nightly

NOBODY = 65534
TEXT = SCENE.read_text()
ROBUST = SCENE.with_name("robust_slider_crank.toml").read_text()
FULL = pytest.mark.full
TERMINAL = re.compile(r"(.{0,80}\n){1,24}")


@pytest.fixture(scope="module")
def hpcclear(tmp_path_factory) -> Callable[..., tuple[int, str]]:
    # A command that hangs is killed after a while, but one that compiles the kernel first may take its time.
    code, output = run(sample(tmp_path_factory.mktemp("compiling") / "samples.nc", 40), 0)
    assert code == 0, output
    return warm_command


def refused(answer: tuple[int, str]) -> bool:
    """Whether a command ended with exit code 2 and one message."""
    code, output = answer
    return code == 2 and output.startswith("Error: ") and "Traceback" not in output


# -- scenes -------------------------------------------------------------------------------------

NASTY = (
    *("nan", "inf", "-inf", "1e999", "-1", "0", "-0.0", "1e-320", "9" * 400, "0x7fffffffffffffff"),
    *("true", '""', '"three"', '"5 apples"', '"1e5 kg m/s^3"', '"../../etc/passwd"', '"\\u0000"'),
    *("[]", "{}", "[[[[]]]]", "1979-05-27", "07:32:00", "'''", "{ a = 1 }", '"${HOME}"', '"nan m"'),
    *("[1, 2, 3]", "\"__import__('os')\"", '"9**9**9"', '"1 mm mm mm"', '"%s%n"', '"μ"', '"1;rm -rf ."'),
)  # fmt: skip
TOKENS = (*'[]{}"=\n.,#\x00\ud7ff\\é', "'''", "[[")


def replace_value(text: str, dice: random.Random) -> str:
    lines = text.splitlines()
    place = dice.choice([i for i, line in enumerate(lines) if "=" in line])
    key, _, _ = lines[place].partition("=")
    lines[place] = f"{key}= {dice.choice(NASTY)}"
    return "\n".join(lines)


def replace_number(text: str, dice: random.Random) -> str:
    found = dice.choice(list(re.finditer(r'"?-?\d[\d.]*(?:e-?\d+)?(?: [a-zA-Z/]+")?', text)))
    return text[: found.start()] + dice.choice(NASTY) + text[found.end() :]


def insert_token(text: str, dice: random.Random) -> str:
    place = dice.randrange(len(text))
    return text[:place] + dice.choice(TOKENS) * dice.choice((1, 1, 2, 50)) + text[place:]


def cut(text: str, dice: random.Random) -> str:
    first = dice.randrange(len(text))
    return text[:first] + text[first + dice.randrange(1, 200) :]


def swap_lines(text: str, dice: random.Random) -> str:
    lines = text.splitlines()
    a, b = dice.randrange(len(lines)), dice.randrange(len(lines))
    lines[a], lines[b] = lines[b], lines[a]
    return "\n".join(lines)


def repeat(text: str, dice: random.Random) -> str:
    lines = text.splitlines()
    place = dice.randrange(len(lines))
    return "\n".join(lines[:place] + [lines[place]] * dice.choice((2, 3, 1000)) + lines[place:])


def rename_key(text: str, dice: random.Random) -> str:
    words = [word for word in text.split() if word.isidentifier() and len(word) > 1]
    word = dice.choice(words)
    return text.replace(word, word[:-1] + dice.choice("xX0_é"), 1)


MUTATIONS: tuple[Callable[[str, random.Random], str], ...] = (
    *(replace_value, replace_number, insert_token, cut, swap_lines, repeat, rename_key),
)
ENCODINGS = (*["utf-8"] * 4, "utf-8-sig", "latin-1", "utf-16", "utf-32", "cp037")


def mutated(dice: random.Random) -> bytes:
    """A scene file with a few faults, at times in a wrong encoding or with damaged bytes."""
    text = dice.choice((TEXT, ROBUST))
    for _ in range(dice.choice((1, 1, 1, 2, 5))):
        text = dice.choice(MUTATIONS)(text, dice)
    content = bytearray(text.encode(dice.choice(ENCODINGS), errors="replace"))
    if dice.random() < 0.1:
        for _ in range(dice.randrange(1, 20)):
            content[dice.randrange(len(content))] = dice.randrange(256)
    return bytes(content)


def makes_sense(path: Path) -> bool:
    """Whether a file that was accepted says, read by another parser, what a mechanism can be."""
    content = tomllib.loads(path.read_bytes().decode("utf-8-sig"))
    scene = load_scene(path)
    numbers = [value for _, value in flatten(scene.resolved()) if isinstance(value, float)]
    links = [scene.number(f"mechanism.{key}") for key in ("crank.length", "rod.length")]
    masses = [scene.number(f"mechanism.{key}.mass") for key in ("crank", "rod", "slider")]
    return (
        all(map(math.isfinite, numbers))
        and min(masses) > 0.0
        and 0.0 < links[0] < links[1]
        and set(content)
        <= {"format_version", "mechanism", "drive", "joints", "effects", "numerics"}
        | {"study", "output"}
    )


@pytest.mark.parametrize("count", [150, pytest.param(10_000, marks=FULL)])
@pytest.mark.timeout(7200)
def test_any_scene_file_is_checked_or_refused(hpcclear, tmp_path, count):
    dice, codes = random.Random(count), Counter()
    path = tmp_path / "scene.toml"
    for number in range(count):
        path.write_bytes(mutated(dice))
        code, output = hpcclear("check", path, "--no-cost")
        codes[code] += 1
        kept = f"case {number}: exit code {code}\n{output[-3000:]}\n{path.read_bytes()[:4000]!r}"
        assert code in (0, 2), kept
        assert "Traceback" not in output, kept
        assert code == 0 or output.startswith("Error: "), kept
        assert code == 2 or makes_sense(path), kept
        assert code == 2 or TERMINAL.fullmatch(output), kept
        for command in ("simulate", "sample") if code == 0 and codes[0] % 6 == 1 else ():
            words = [command, path, "-o", tmp_path.parent / f"{command}-{count}-{number}.nc"]
            code, output = hpcclear(*words, *overrides("study.samples=16", *CHEAP))
            codes[command] += code == 0
            assert code == 1 or TERMINAL.fullmatch(output), f"{command}, {kept}\n{output}"
    print(f"{count} scene files: {dict(codes)}")
    ran = count * min(codes["simulate"], codes["sample"])
    assert min(codes[0], codes[2], ran) > count // 50  # all happen, or nothing was tested


# -- places -------------------------------------------------------------------------------------


def tree(folder: Path) -> dict[str, tuple[int, int]]:
    """What there is below a folder, and when it was changed."""
    return {
        str(path.relative_to(folder)): (path.lstat().st_mtime_ns, path.lstat().st_size)
        for path in folder.rglob("*")
    }


PATHS = ("../outside", "/tmp/outside", "a/b", "..", ".", "~/x", "x\\u0000y", "con\\\\..\\\\x")
STRINGS = (
    (
        "[study.variables]",
        '[study.variables]\n"{}" = {{ path = "mechanism.slider.mass", range = [0.1, 0.2] }}',
    ),
    ("seed = 1", 'seed = 1\nmethod = "{}"'),
    ("seed = 1", 'seed = 1\nobjective = "{}"'),
    ('law = "coulomb"', 'law = "{}"'),
    ('kind = "slider-crank"', 'kind = "{}"'),
    ("rtol = 1e-6", 'rtol = 1e-6\nmethod = "{}"'),
)


@pytest.mark.parametrize("path", PATHS)
def test_no_string_of_a_scene_leads_out_of_the_output_directory(hpcclear, tmp_path, path):
    inside = tmp_path / "results" / "here"
    inside.mkdir(parents=True)
    scene = tmp_path / "scene.toml"
    scene.write_text("")
    before = tree(tmp_path)
    small = overrides(*CHEAP, "study.samples=40")
    for found, instead in STRINGS:
        assert found in TEXT
        text = TEXT.replace(found, instead.format(path), 1)
        scene.write_text(text)
        code, output = hpcclear("sample", scene, "-o", inside / "x.nc", *small)
        assert code in (0, 2), output
        assert "Traceback" not in output
    after = tree(tmp_path)
    changed = {name for name in after if after[name] != before.get(name)} - {"scene.toml"}
    assert all(name.startswith("results/here") for name in changed), changed
    assert not Path("/tmp/outside").exists()


def test_places_without_permission_or_of_the_wrong_kind_are_refused(hpcclear, place_of_all):
    locked, file, full = (place_of_all / name for name in ("locked", "file", "directory.nc"))
    locked.mkdir(mode=0o555)
    file.write_text("mine")
    full.mkdir()
    scene = place_of_all / "scene.toml"
    scene.write_text(TEXT)
    (place_of_all / "dangling.nc").symlink_to(place_of_all / "no" / "where.nc")
    place_of_all.chmod(0o555)  # if it is this user's own
    before = tree(place_of_all)
    words = ("sample", scene, *overrides(*CHEAP, "study.samples=40"), "-o")
    for place in (
        locked / "x.nc",
        file / "x.nc",
        full,
        place_of_all / "no" / "x.nc",
        Path("/proc/x.nc"),
    ):
        answer = hpcclear(*words, place, user=NOBODY)
        assert refused(answer), (place, answer)
        assert str(place.parent) in answer[1] or str(place) in answer[1]
    assert tree(place_of_all) == before


def test_what_may_not_be_read_is_named_by_every_command(hpcclear, place_of_all):
    scene, folder = place_of_all / "scene.toml", place_of_all / "closed"
    scene.write_text(TEXT)
    folder.mkdir()
    for path in (scene, folder):
        path.chmod(0)
    try:
        for words in (("check", scene), ("simulate", scene, "-o", place_of_all / "x.nc")):
            answer = hpcclear(*words, user=NOBODY)
            assert refused(answer), answer
            assert str(scene) in answer[1]
        for command in ("report", "crate", "reproduce"):
            answer = hpcclear(command, folder, user=NOBODY)
            assert refused(answer), (command, answer)
            assert str(folder) in answer[1]
    finally:
        folder.chmod(0o755)


# -- damaged results ----------------------------------------------------------------------------


@pytest.fixture(scope="module")
def result(hpcclear, tmp_path_factory) -> tuple[list[object], Path]:
    """Words of a command that is done, and its result."""
    output = tmp_path_factory.mktemp("result") / "samples.nc"
    words = ["sample", SCENE, *overrides(*CHEAP, "study.samples=40"), "-o", output]
    code, text = hpcclear(*words)
    assert code == 0, text
    return words, output


def damaged(content: bytes, other: bytes, dice: random.Random) -> bytes:
    """The bytes of a file after an accident or a clumsy attack, never the same as before."""
    data = bytearray(content)
    place = dice.randrange(len(data))
    how = dice.choice(
        ("cut", "flip", "zero", "insert", "double", "splice", "empty", "noise", "tail")
    )
    if how == "cut":
        del data[place:]
    elif how == "flip":
        for _ in range(dice.choice((1, 1, 8, 100))):
            data[dice.randrange(len(data))] ^= 1 << dice.randrange(8)
    elif how == "zero":
        data[place : place + 4096] = bytes(len(data[place : place + 4096]))
    elif how == "insert":
        data[place:place] = dice.randbytes(dice.choice((1, 8, 512)))
    elif how == "double":
        data += content
    elif how == "splice":
        data[place:] = other[place:]
    elif how == "empty":
        data.clear()
    elif how == "noise":
        data = bytearray(dice.randbytes(dice.randrange(1, 5000)))
    else:
        data += dice.randbytes(dice.choice((1, 100)))
    if bytes(data) == content:
        data.append(0)
    return bytes(data)


@pytest.mark.parametrize("count", [5, pytest.param(200, marks=FULL)])
@pytest.mark.timeout(1800)
def test_commands_refuse_damaged_results(hpcclear, result, count):
    words, output = result
    content, timing = output.read_bytes(), output.with_suffix(".timing.nc").read_bytes()
    dice = random.Random(count)
    try:
        for _ in range(count):
            output.write_bytes(damaged(content, timing, dice))
            answer = hpcclear(*words)
            assert refused(answer), answer
            assert str(output) in answer[1]
            code, text = hpcclear("report", output.parent)  # shows what is left, and says so
            assert (code, "Traceback" in text) == (0, False), text
            assert "samples.nc was left out" in (output.parent / "report.html").read_text()
    finally:
        output.write_bytes(content)
    assert hpcclear(*words)[0] == 0
    assert output.read_bytes() == content
