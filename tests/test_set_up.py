"""The set-up of both commands: which versions it takes, and one clear line for what keeps it from its work."""

import os
import re
import shutil
import socket
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
LOCKS = ROOT / "jobs" / "locks"
PYTHONS = ("3.11", "3.12", "3.13", "3.14")
HERE = "{}.{}".format(*sys.version_info)


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """What the set-up reads, in a place with a space and an umlaut."""
    place = tmp_path / "a checkout für mich"
    shutil.copytree(ROOT / "jobs", place / "jobs")
    shutil.copy(ROOT / "pyproject.toml", place)
    return place


def set_up(
    checkout: Path, *words: str, user: int | None = None, **settings: str
) -> subprocess.CompletedProcess[str]:
    """Source jobs/environment.sh as the commands do; nothing comes from a registry."""
    kept = {name: os.environ[name] for name in ("PATH", "TMPDIR") if name in os.environ}
    nothing = {"PIP_CONFIG_FILE": os.devnull, "PIP_NO_INDEX": "1", "PIP_RETRIES": "0"}
    extras = words or ("mpich,analysis",)
    return subprocess.run(
        ["bash", "-euc", '. jobs/environment.sh "$@"; echo "PATH=$PATH"', "set-up", *extras],
        cwd=checkout,
        env=kept | {"PYTHON": sys.executable} | nothing | settings,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
        user=user,
    )


def assert_one_line(done: subprocess.CompletedProcess[str], *words: str) -> None:
    """It ended with code 2 and one line on standard error that holds all the words."""
    assert done.returncode == 2, done
    lines = done.stderr.splitlines()
    assert len(lines) == 1, done.stderr
    assert lines[0].startswith("set-up: "), lines
    for word in words:
        assert word in lines[0], lines


def fake_python(place: Path, version: str, refuses: str = "") -> str:
    """An interpreter that says it is `version`, and fails when its command holds `refuses`."""
    place.mkdir()
    program = place / "python3"
    program.write_text(
        f"#!/bin/sh\ncase \"$*\" in\n*'{refuses or 'nothing at all'}'*) exit 1 ;;\n"
        f"*version_info*) echo {version} ;;\n*) exit 1 ;;\nesac\n"
    )
    program.chmod(0o755)
    return str(program)


@pytest.mark.parametrize(
    ("version", "words"),
    [
        ("2.7", ("Python 3.11 or newer is needed", "2.7", "PYTHON=")),
        ("3.10", ("Python 3.11 or newer is needed", "3.10", "PYTHON=")),
        ("", ("/nowhere/python3", "3.11")),
        (HERE, ("apt-get install python3-venv",)),
    ],
)
def test_a_python_that_does_not_do_is_named_in_one_line(checkout, tmp_path, version, words):
    fake = fake_python(tmp_path / "one", version, refuses="import ensurepip")
    assert_one_line(set_up(checkout, PYTHON=fake if version else "/nowhere/python3"), *words)
    assert not (checkout / ".venv").exists()


@pytest.fixture
def prepared(checkout: Path) -> Path:
    """A checkout whose environment exists, with this Python and its pip, and holds nothing yet."""
    programs = checkout / ".venv" / "bin"
    programs.mkdir(parents=True)
    (programs / "python").write_text(f'#!/bin/sh\nexec "{sys.executable}" "$@"\n')
    (programs / "python").chmod(0o755)
    return checkout


def test_no_registry_is_said_in_one_line_with_the_reason_of_pip(prepared):
    # From the newest list of packages: none of it may be installed here already at the locked version.
    (prepared / "jobs" / "locks" / HERE / "mpich,analysis.txt").write_text(
        f"no-such-package==1.0 --hash=sha256:{'0' * 64}\n"
    )
    done = set_up(prepared, PYTHON="")
    assert_one_line(done, "no-such-package==1.0", f"Python {HERE}", "(pip: ")
    with socket.socket() as free:  # bound, and nobody listens
        free.bind(("127.0.0.1", 0))
        nowhere = f"http://127.0.0.1:{free.getsockname()[1]}/simple"
        done = set_up(prepared, PYTHON="", PIP_INDEX_URL=nowhere, PIP_NO_INDEX="0", PIP_RETRIES="1")
    assert_one_line(done, "registry cannot be reached", "no-such-package==1.0")
    assert not (prepared / ".venv" / ".installed-mpich,analysis").exists()


def pins(folder: str, extras: str = "test") -> dict[str, str]:
    """Versions by name in one of the lists; each must have a hash."""
    text = (LOCKS / folder / f"{extras}.txt").read_text()
    found = re.findall(
        r"^([a-z0-9-]+)==(\S+) \\\n    --hash=sha256:[0-9a-f]{64}", text, re.MULTILINE
    )
    assert len(found) == len(re.findall("==", text)), "a package without a hash"
    return dict(found)


def asked() -> dict[str, str]:
    """Lower bounds of pyproject.toml, of all that the tests install."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    lists = project["project"]["optional-dependencies"]
    rows = project["project"]["dependencies"] + lists["mpich"] + lists["analysis"] + lists["docs"]
    rows += lists["test"] + project["build-system"]["requires"]
    found = [re.fullmatch(r"([\w.-]+)(\[\w+\])?>=([\d.]+)(,<\S+)?", row) for row in rows]
    return {m[1].lower().replace("_", "-"): m[3] for m in found if m is not None}


def release(version: str) -> tuple[int, ...]:
    """The numbers of a version, without what follows them."""
    numbers = [int(word) for word in re.match(r"[\d.]*\d", version)[0].split(".")]
    return tuple(numbers + [0] * (4 - len(numbers)))


@pytest.mark.parametrize("python", PYTHONS)
def test_the_tested_versions_are_all_that_is_asked_for(python):
    tested = pins(python)
    for name, bound in asked().items():
        assert release(tested[name]) >= release(bound), name
    run = pins(python, "mpich,analysis")
    assert run.items() <= tested.items()


def test_the_lowest_versions_are_the_bounds():
    lowest = pins("lowest-3.11")
    for name, bound in asked().items():
        assert release(lowest[name])[:2] == release(bound)[:2], f"renew jobs/locks: {name}"
