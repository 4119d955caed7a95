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


@pytest.mark.parametrize("version", ["2.7", "3.6", "3.10"])
def test_an_old_python_is_named_in_one_line(checkout, tmp_path, version):
    done = set_up(checkout, PYTHON=fake_python(tmp_path / "old", version))
    assert_one_line(done, "Python 3.11 or newer is needed", version, "PYTHON=")
    assert not (checkout / ".venv").exists()


def test_no_python_at_all(checkout):
    assert_one_line(set_up(checkout, PYTHON="/nowhere/python3"), "/nowhere/python3", "3.11")


def test_a_python_without_ensurepip_asks_for_the_package(checkout, tmp_path):
    bare = fake_python(tmp_path / "bare", HERE, refuses="import ensurepip")
    assert_one_line(set_up(checkout, PYTHON=bare), "apt-get install python3-venv")
    assert not (checkout / ".venv").exists()


def test_half_an_environment_is_not_left_behind(checkout, tmp_path):
    program = Path(fake_python(tmp_path / "dying", HERE))
    program.write_text(
        f'#!/bin/sh\ncase "$*" in\n*version_info*) echo {HERE} ;;\n'
        "*ensurepip*) ;;\n*) mkdir -p .venv/bin; ln -s $0 .venv/bin/python\n"
        'echo "OSError: [Errno 28] No space left on device"; exit 1 ;;\nesac\n'
    )
    assert_one_line(set_up(checkout, PYTHON=str(program)), "disk is full", str(checkout))
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


def test_an_unwritable_checkout(checkout, place_of_all):
    place = place_of_all
    shutil.copytree(checkout, place / "checkout")
    python = fake_python(place / "bin", HERE)
    for path in (place, place / "checkout"):
        path.chmod(0o555)
    nobody = 65534 if os.getuid() == 0 else None  # root may write anywhere
    done = set_up(place / "checkout", user=nobody, PYTHON=python)
    for path in (place, place / "checkout"):
        path.chmod(0o755)
    assert_one_line(done, f"{place / 'checkout'} is not writable")


def test_a_failed_set_up_leaves_the_shell_alive(checkout):
    done = subprocess.run(
        ["bash", "-c", ". jobs/environment.sh mpich,analysis || echo code $?"],
        cwd=checkout,
        env={"PATH": os.environ["PATH"], "PYTHON": "/nowhere/python3"},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.stdout == "code 2\n"
    assert_one_line(subprocess.CompletedProcess(done.args, 2, done.stdout, done.stderr), "/nowhere")


def test_lowest_versions_exist_for_the_oldest_python_only(checkout, tmp_path):
    newer = fake_python(tmp_path / "newer", "3.13")
    assert_one_line(set_up(checkout, "test", "--lowest", PYTHON=newer), "3.13", "jobs/locks")


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


def test_no_list_names_a_registry_or_a_path():
    for path in LOCKS.glob("*/*.txt"):
        rows = [
            row for row in path.read_text().splitlines() if not row.lstrip().startswith("--hash=")
        ]
        assert not re.search(r"https?:|file:|--index|--find-links|/tmp|/opt", "\n".join(rows)), path


@pytest.mark.parametrize("recipe", ["Dockerfile", "hpcclear.def"])
def test_a_container_installs_tested_files_by_their_hashes(recipe):
    """Every installation is of a list with hashes that is there for the image's Python, or takes nothing from the registry."""
    text = (ROOT / "packaging" / recipe).read_text()
    python = re.search(r"python:(\d+\.\d+)", text).group(1)
    installs = re.findall(r"pip install [^&\n]*", text)
    assert len(installs) == 2
    listed, own = installs
    assert "--require-hashes" in listed
    path = re.search(r"-r '/opt/hpcclear/([^']*)'", listed).group(1)
    assert path == f"jobs/locks/{python}/mpich,analysis.txt"
    assert "--hash=sha256:" in (ROOT / path).read_text()
    assert {"--no-deps", "--no-build-isolation"} <= set(own.split())


def test_what_is_installed_fits_together():
    done = subprocess.run(
        [sys.executable, "-m", "pip", "check"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout
