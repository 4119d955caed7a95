"""Files of other people: those they name are not opened, their text commands no terminal, their cache is not loaded."""

import json
import os
import subprocess
import sys
import tempfile
import unicodedata
from pathlib import Path

import opened
import pytest
import report_data as data
from click.testing import CliRunner
from commands import warm_command
from patience import crowded

from hpcclear.base import code_folder, private, remarks
from hpcclear.base.errors import InputError, StorageError
from hpcclear.base.private import private_folder
from hpcclear.cli import cli
from hpcclear.cli.tables import console, table
from hpcclear.cli.terminal import print_remark
from hpcclear.results import dataset, netcdf
from hpcclear.results.content import Results
from hpcclear.results.crate import NAME

ROOT = Path(__file__).parent.parent
QUICKSTART = ROOT / "jobs" / "quickstart.toml"
SECRET = "mallory,of,the,secret,line"


def forged(path: Path, scene: str) -> Path:
    """A response that says it was made of such a scene."""
    content = data.response(3)
    content.attrs["scene"] = scene
    opened.write(content, path)
    return path


@pytest.fixture
def secret(tmp_path) -> Path:
    path = tmp_path / "passwd"
    path.write_text(f"{SECRET}\n" * 3)
    return path


# -- files that a result names ----------------------------------------------------------------------


def test_no_file_that_the_scene_of_a_result_names_is_opened(tmp_path, secret, monkeypatch):
    place = tmp_path / "results"
    place.mkdir()
    content = QUICKSTART.read_text().partition("[study.random]")[0]
    naming = f'{content}\n[study.random]\nC = {{ distribution = "samples", file = "{secret}" }}\n'
    for name, text in (("a", naming), ("c", "no scene"), ("d", "")):
        forged(place / f"{name}.nc", text)
    (place / "e.nc").write_bytes((place / "a.nc").read_bytes()[:-500])
    opened: list[str] = []
    open_path = Path.open
    monkeypatch.setattr(
        Path, "open", lambda self, *a, **k: opened.append(str(self)) or open_path(self, *a, **k)
    )
    done = CliRunner().invoke(cli, ["reproduce", str(place)], standalone_mode=False)
    assert done.exception is None
    assert done.return_value == 1
    assert SECRET not in done.output
    assert str(secret) not in opened
    said = [line.split(": ") for line in done.output.splitlines()]
    assert [words[0] for words in said] == [
        f"{name}.nc" for name in "acde"
    ]  # none stops the others
    assert all(words[1] == "not simulated" for words in said)
    assert "names a file" in said[0][2]


@pytest.mark.parametrize("command", ["crate", "reproduce"])
def test_one_damaged_file_does_not_hide_the_others(tmp_path, command):
    data.write_study(tmp_path)
    good = len(dataset.files_in(tmp_path))
    for name in ("aa.nc", "zz.nc"):
        unsealed = dataset.encode(Results.of(data.timing()))
        (tmp_path / name).write_bytes(unsealed.getvalue())
    done = CliRunner().invoke(cli, [command, str(tmp_path)], standalone_mode=False)
    assert done.return_value == 1
    assert done.output.count("aa.nc") == done.output.count("zz.nc") == 1
    if command == "crate":
        listed = json.loads((tmp_path / NAME).read_text())["@graph"]
        assert sum(one["@type"] == "File" for one in listed) == good


# -- what reaches the terminal ----------------------------------------------------------------------

EVIL = "\x1b]0;owned\x07\x9b31m\r\u202eabc\x7f"


def controls(text: str) -> list[str]:
    """Characters of a text that may command a terminal."""
    kinds = ("Cc", "Cf", "Cs", "Zl", "Zp")
    return [c for c in text if c not in "\n\t" and unicodedata.category(c) in kinds]


def test_no_message_and_no_table_holds_control_characters(capsys):
    for error in (InputError(EVIL, EVIL, EVIL, EVIL), StorageError(EVIL, EVIL, EVIL)):
        assert not controls(str(error))
    out = console()
    out.print(table(EVIL, [(EVIL, EVIL)]))
    out.print(EVIL)
    print_remark("Mind", EVIL)
    out.print("[study] and [/] and :smile: are no markup")
    shown = capsys.readouterr().out
    assert not controls(shown)
    assert "[study] and [/] and :smile:" in shown


@pytest.fixture(scope="module")
def evil(tmp_path_factory) -> Path:
    """A directory of results in whose attributes, names of variables, and units there are escape sequences."""
    place = data.write_study(tmp_path_factory.mktemp("evil"))
    for path in place.glob("*.nc"):
        content = netcdf.load(path).to_xarray()
        for name in content.attrs:
            if isinstance(content.attrs[name], str) and name != "hpcclear_kind":
                content.attrs[name] = f"{content.attrs[name]}{EVIL}"
        for variable in content.variables.values():
            if isinstance(variable.attrs.get("long_name"), str):
                variable.attrs["long_name"] += EVIL
        opened.write(content, path)
    return place


@pytest.mark.parametrize("command", ["reproduce", "report", "crate"])
def test_escape_sequences_of_results_stay_in_them(evil, command):
    _, output = warm_command(command, evil)
    assert output
    assert not controls(output)


SPELLINGS = {
    "a key": f'format_version = 1\n"{EVIL.encode("unicode_escape").decode()}" = 1\n',
    "a table": f'["{EVIL.encode("unicode_escape").decode()}"]\nx = 1\n',
    "a value": f'format_version = "{EVIL.encode("unicode_escape").decode()}"\n',
    "raw": f"format_version = {EVIL}\n",
    "a joint": 'format_version = 1\n[mechanism]\nkind = "linkage"\n[joints."\\u001b]0;x"]\nkind = "ideal"\n',
}


@pytest.mark.parametrize("command", ["check", "simulate", "sample"])
@pytest.mark.parametrize("text", SPELLINGS.values(), ids=SPELLINGS)
def test_escape_sequences_of_scenes_stay_in_them(tmp_path, command, text):
    text = text.replace("\\x", "\\u00")  # as TOML writes them
    (tmp_path / "scene.toml").write_text(text, encoding="utf-8", newline="")
    words = [command, str(tmp_path / "scene.toml")]
    words += [] if command == "check" else ["-o", str(tmp_path / "x.nc")]
    code, output = warm_command(*words)
    assert not controls(output)
    assert code == 2


# -- the cache --------------------------------------------------------------------------------------


@pytest.fixture
def said(monkeypatch) -> list[str]:
    """What is remarked."""
    heard: list[str] = []
    monkeypatch.setattr(remarks, "_made", set())
    monkeypatch.setattr(remarks, "_listeners", [heard.append])
    return heard


@pytest.fixture
def home(tmp_path, monkeypatch) -> Path:
    """Where the user's own cache is."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home"))
    monkeypatch.delenv("HPCCLEAR_CACHE", raising=False)
    return tmp_path / "home" / "hpcclear"


def test_a_folder_of_ones_own_is_used_without_a_word(tmp_path, monkeypatch, said, home):
    monkeypatch.setenv("HPCCLEAR_CACHE", str(tmp_path / "deep" / "below"))
    folder = private_folder("HPCCLEAR_CACHE")
    assert folder == tmp_path / "deep" / "below" / f"hpcclear-{private.user_name()}"
    assert folder.stat().st_mode & 0o777 == 0o700
    assert said == []


@pytest.mark.parametrize("mode", [0o777, 0o707, 0o703, 0o1777, 0o755, 0o711])
@pytest.mark.parametrize("levels", [1, 2])
def test_a_folder_that_others_can_exchange_is_not_used(
    tmp_path, monkeypatch, said, home, mode, levels
):
    parent = tmp_path / "shared" / "/".join(f"level{k}" for k in range(levels))
    parent.mkdir(parents=True)
    (tmp_path / "shared").chmod(mode)
    monkeypatch.setenv("HPCCLEAR_CACHE", str(parent))
    folders = {private_folder("HPCCLEAR_CACHE") for _ in range(3)}
    if mode & 0o002 and not mode & 0o1000:  # sticky: only owners rename there
        assert folders == {home}
        assert len(said) == 1
        assert str(tmp_path / "shared") in said[0]
    else:
        assert folders == {parent / f"hpcclear-{private.user_name()}"}
        assert said == []


@pytest.mark.parametrize("mode", [0o777, 0o770, 0o757, 0o750, 0o701, 0o1777])
def test_a_folder_of_numba_that_others_can_open_is_not_used(
    tmp_path, monkeypatch, said, home, mode
):
    """Code in it is loaded as it is, whoever named the folder; a link of one's own may lead to it."""
    folder = tmp_path / "named"
    folder.mkdir()
    (tmp_path / "link").symlink_to(folder)
    for k, name in enumerate(("named", "link")):
        monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / name))
        folder.chmod(mode)
        assert code_folder._place.__wrapped__() == (private_folder("HPCCLEAR_CACHE"), False)
        assert str(tmp_path / name) in said[k]
        assert "open to others" in said[k]
        folder.chmod(0o700)
        assert code_folder._place.__wrapped__() == (folder, True)
    assert len(said) == 2
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "new"))
    assert code_folder._place.__wrapped__() == (tmp_path / "new", True)
    assert (tmp_path / "new").stat().st_mode & 0o777 == 0o700


@pytest.mark.parametrize("made", ["a file", "a link", "open to others", "somebody else's"])
def test_what_somebody_made_before_is_not_used_and_that_is_said_once(
    tmp_path, monkeypatch, said, home, made
):
    monkeypatch.setenv("HPCCLEAR_CACHE", str(tmp_path))
    place = tmp_path / f"hpcclear-{private.user_name()}"
    if made == "a file":
        place.write_text("mine")
    elif made == "a link":
        (tmp_path / "elsewhere").mkdir(mode=0o700)
        place.symlink_to(tmp_path / "elsewhere")
    else:
        place.mkdir(mode=0o700)
        place.chmod(0o750 if made == "open to others" else 0o700)
    if made == "somebody else's":
        lstat = Path.lstat
        other = os.stat_result([*lstat(place)[:4], os.getuid() + 1, *lstat(place)[5:]])
        monkeypatch.setattr(Path, "lstat", lambda self: other if self == place else lstat(self))
    before = set(Path(tempfile.gettempdir()).iterdir())
    assert {private_folder("HPCCLEAR_CACHE") for _ in range(3)} == {home}  # one that is found again
    assert len(said) == 1
    assert str(place) in said[0]
    assert set(Path(tempfile.gettempdir()).iterdir()) == before


def test_where_nothing_can_be_kept_a_temporary_folder_goes_at_the_end(tmp_path):
    code = "from hpcclear.base.private import private_folder; print(private_folder('HPCCLEAR_CACHE').is_dir())"
    known = {
        "HPCCLEAR_CACHE": "/proc/nowhere",
        "XDG_CACHE_HOME": "/proc/nowhere",
        "TMPDIR": str(tmp_path),
    }
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=crowded(60.0),
        env=os.environ | {"PYTHONPATH": str(ROOT)} | known,
    )  # fmt: skip
    assert done.stdout == "True\n"
    assert "compiles anew" in done.stderr
    assert list(tmp_path.iterdir()) == []
