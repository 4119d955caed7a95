"""Plug-ins by name: from files beside a scene and from installed packages; whose source is run, and when."""

from pathlib import Path

import opened
import pytest
import report_data
import test_own_objectives as goals
import tomli_w
from click.testing import CliRunner
from commands import warm_command
from test_own_objectives import GOALS

from hpcclear.base.errors import InputError
from hpcclear.cli import cli, loaded
from hpcclear.cli.options import Written
from hpcclear.ensemble.identity import run_key
from hpcclear.plugins import Registry, run_source, trusting, using
from hpcclear.scene import load_scene
from hpcclear.scene.loading import scene_of_text
from hpcclear.scene.plugged import UntrustedSource

QUICKSTART = Path("jobs/quickstart.toml")
SOURCE = """
from dataclasses import dataclass

@dataclass
class Mine:
    size: float = 1.0

    def area(self):
        return self.size**2
"""
PACKAGE = "from pathlib import Path\nclass Theirs:\n    area = 2.0\n"


@pytest.fixture
def shapes() -> Registry:
    """A registry of a kind that no scene has."""
    registry = Registry("shape", "hpcclear.shapes", needs=("area",))
    registry.add("round", run_source("ours", "class Round:\n    area = 3.14\n").Round)
    registry.add("lazy", "fractions:Fraction")
    return registry


def install(folder: Path, group: str, name: str, value: str, package: str = "their-shapes") -> None:
    """A package with an entry point, as pip leaves it in a folder of packages."""
    info = folder / f"{package.replace('-', '_')}-1.2.dist-info"
    info.mkdir(parents=True)
    info.joinpath("METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.2\n")
    info.joinpath("entry_points.txt").write_text(f"[{group}]\n{name} = {value}\n")
    folder.joinpath("their_shapes.py").write_text(PACKAGE)


def carrying(source: str = SOURCE) -> dict:
    """The content of a scene that carries Python source."""
    content = load_scene(QUICKSTART).resolved()
    return {**content, "plugins": {"files": {"shapes": {"source": source}}}}


def test_a_name_is_one_of_ours_a_package_s_or_a_file_s(shapes, tmp_path, monkeypatch):
    install(tmp_path, "hpcclear.shapes", "square", "their_shapes:Theirs")
    monkeypatch.syspath_prepend(tmp_path)
    assert shapes.get("round").area == 3.14
    assert shapes.names() == ("round", "lazy", "square")
    with using({"shapes": SOURCE}) as packages:
        assert shapes.get("shapes:Mine")(3.0).area() == 9.0
        assert packages == {}
        assert shapes.get("square").area == 2.0
    assert packages == {"their-shapes": "1.2"}
    assert shapes.origin("square") == "their-shapes 1.2"
    assert shapes.origin("round") == ""
    assert shapes.origin("shapes:Mine", {"shapes": SOURCE}).startswith("shapes.py, SHA-256 ")


def test_an_unknown_name_gets_the_nearest_and_all(shapes):
    with pytest.raises(InputError, match=r"Did you mean 'round'\? Known: round, lazy"):
        shapes.get("rond")


def test_two_packages_that_offer_one_name_are_named(shapes, tmp_path, monkeypatch):
    for number, value in enumerate(("their_shapes:Theirs", "their_shapes:Path")):
        install(tmp_path / str(number), "hpcclear.shapes", "square", value, f"shapes-{number}")
        monkeypatch.syspath_prepend(tmp_path / str(number))
    with pytest.raises(InputError, match="is offered by shapes-0 and shapes-1"):
        shapes.get("square")


def test_a_package_that_cannot_be_imported_is_named(shapes, tmp_path, monkeypatch):
    install(tmp_path, "hpcclear.shapes", "cube", "their_cubes:Cube")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(
        InputError, match=r"their-shapes 1\.2 offers it.*No module named 'their_cubes'"
    ):
        shapes.get("cube")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a = 1\nb = a / 0\n", r"ZeroDivisionError: division by zero \(line 2\)"),
        ("def f(:\n", r"SyntaxError: .*\(line 1\)"),
        ("import neighbour_of_mine\n", r"No module named 'neighbour_of_mine' \(line 1\)"),
        ("raise SystemExit(3)\n", r"SystemExit: 3 \(line 1\)"),
    ],
)
def test_a_file_that_cannot_be_run_is_named_with_the_line(shapes, text, said):
    for _ in range(2):  # a module that failed is not kept
        with pytest.raises(InputError, match=said) as error:
            shapes.get("wrong:Mine", {"wrong": text})
        assert error.value.key == "wrong.py"


def test_files_are_not_looked_for_where_python_looks(shapes, tmp_path, monkeypatch):
    (tmp_path / "elsewhere.py").write_text(SOURCE)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(InputError, match=r"there is no elsewhere\.py beside the scene file"):
        shapes.get("elsewhere:Mine")


def test_source_that_a_scene_carries_counts_and_is_not_run_unasked():
    content = carrying()
    with pytest.raises(UntrustedSource, match=r"shapes\.py \(SHA-256 [0-9a-f]{12}\)"):
        load_scene(content)
    scene = load_scene(content, trust=True)
    assert scene.plugin_texts == {"shapes": SOURCE}
    assert load_scene(scene.resolved(), trust=True) == scene
    other = load_scene(carrying(SOURCE + "# more\n"), trust=True)
    ours, theirs = run_key(scene, "sample"), run_key(other, "sample")
    assert {key for key in ours if ours[key] != theirs[key]} == {"plugins.files.shapes.source"}
    assert len(ours["plugins.files.shapes.source"]) < 100
    assert scene.hash != other.hash
    assert scene.with_({"study.seed": 5}).plugin_texts == scene.plugin_texts


def test_a_text_of_a_result_file_is_run_only_when_trusted():
    scene = load_scene(carrying(), trust=True).with_({"study.seed": 5})
    with pytest.raises(UntrustedSource):
        scene_of_text(scene.text, "samples.nc")
    with trusting():
        assert scene_of_text(scene.text, "samples.nc") == scene


READING = {
    "report": ("s.nc", "-o", "p.html"),
    "plot": ("s.nc", "-o", "s.png"),
    "reproduce": ("s.nc",),
    "export": ("s.nc", "-o", "s.csv"),
    "compare": ("s.nc", "measured.csv"),
    "reproduce --crate": (".",),
    "sample --merge": ("s.nc", "-o", "m.nc"),
}
"""Commands that read results, and the words behind them."""


def test_a_result_runs_no_code_in_any_command_unless_trusted(tmp_path, monkeypatch):
    """Its scene names a file, carries the text of that, and the file lies beside it as well."""
    ran = tmp_path / "ran"
    source = f"open({str(ran)!r}, 'a').write('ran')\n" + GOALS.read_text()
    (tmp_path / "mygoals.py").write_text(source)
    (tmp_path / "measured.csv").write_text("time [s],slider_position [mm]\n0,1\n0.001,2\n")
    content = load_scene(QUICKSTART).resolved()
    content["study"] |= {"objective": "mygoals:RmsForce"}
    content["plugins"] = {"files": {"mygoals": {"source": source}}}
    made = report_data.samples().assign_attrs(scene=tomli_w.dumps(content))
    monkeypatch.chdir(tmp_path)
    for command, words in READING.items():
        opened.write(made, tmp_path / "s.nc")
        CliRunner().invoke(cli, [*command.split(), *words])
        assert not ran.exists(), command
    CliRunner().invoke(cli, ["reproduce", "s.nc", "--trust"])
    assert ran.exists()


def test_commands_name_the_file_that_a_scene_runs(tmp_path, capsys):
    path = goals.file_with(tmp_path, "mygoals:RmsForce")
    note = "Note: the scene names mygoals.py: its Python code runs"
    code, output = warm_command("check", path, "--no-cost")
    assert code == 0, output
    assert note in " ".join(output.split())
    loaded(Written(path, ()))  # what the commands that simulate do with a scene
    assert note in capsys.readouterr().err
    code, output = warm_command("check", QUICKSTART, "--no-cost")
    assert "Python code" not in output
