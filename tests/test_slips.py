"""Random linkages through `check`, sound, locked and with the slips that people make: never a traceback, nothing silent."""

import re
from collections import Counter
from pathlib import Path

import pytest
import tomli_w
from click.testing import CliRunner
from slips import Slip, slip

from hpcclear.base.errors import InputError
from hpcclear.cli import cli

FIRST, ONE = 200, 1_000
"""Scenes of the short profile, and of each test of the long one."""

UGLY = re.compile(r"np\.float64|Traceback|RuntimeWarning|\x1b|object at 0x|Error: Error")


def answer(made: Slip, place: Path) -> tuple[int, str]:
    """Exit code and output of `check --no-cost`."""
    file = place / "scene.toml"
    file.write_text(tomli_w.dumps(made.content), encoding="utf-8")
    done = CliRunner().invoke(cli, ["check", str(file), "--no-cost"])
    if isinstance(done.exception, InputError):  # what `main` makes of it
        return 2, f"{done.output}Error: {done.exception}"
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        return 1, f"{done.output}Traceback: {done.exception!r}"
    return done.exit_code, done.output


def fault(made: Slip, code: int, output: str) -> str:
    """What is wrong with an answer; "" for nothing."""
    if ugly := UGLY.search(output):
        return f"ugly: {ugly.group()}"
    if code not in (0, 2):
        return f"exit code {code}"
    if made.words and code == 0:
        return "silent"
    if missing := [word for word in made.words if word not in output]:
        return f"does not name {missing}"
    if made.turns and code != 0:
        return "a sound scene is refused"
    return ""


@pytest.mark.parametrize(
    ("first", "count"),
    [
        pytest.param(0, FIRST, marks=pytest.mark.nightly),
        *(pytest.param(k, ONE, marks=pytest.mark.full) for k in range(0, 10_000, ONE)),
    ],
)
def test_check_answers_every_random_scene(first, count, tmp_path, recwarn):
    faults: Counter[tuple[str, str]] = Counter()
    example: dict[tuple[str, str], str] = {}
    for seed in range(first, first + count):
        made = slip(seed)
        code, output = answer(made, tmp_path)
        if found := fault(made, code, output):
            faults[made.name, found] += 1
            example.setdefault((made.name, found), f"seed {seed}: {output[-600:]}")
    assert not faults, "\n".join(f"{faults[key]} of {key}: {text}" for key, text in example.items())
    assert not [str(one.message) for one in recwarn if issubclass(one.category, RuntimeWarning)]
