"""The commands as a person types them: output, exit codes, messages."""

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import opened
import pytest
import xarray as xr
from click.testing import CliRunner
from commands import MPIEXEC, warm
from patience import crowded
from test_progress import left_of, run_on_a_terminal

from hpcclear import __version__
from hpcclear.cli import OLD, cli

ROOT = Path(__file__).resolve().parent.parent
JOB, SAMPLE = "jobs/slider_crank.toml", ["sample", "jobs/quickstart.toml", "-o", "x.nc"]
SHORT = ["--set", "numerics.transient_revolutions=0", "--set", "numerics.averaged_revolutions=1"]


def hpcclear(*words, timeout=300, module=False, ranks=0, cwd=ROOT, **more):
    """Run a command in processes of its own; 0 ranks: without mpiexec."""
    program = [sys.executable, "-m", "hpcclear"] if module else [warm().programs / "hpcclear"]
    launcher = [MPIEXEC, "-n", str(ranks)] if ranks else []
    return subprocess.run(
        [*launcher, *program, *map(str, words)],
        capture_output=True,
        text=True,
        timeout=crowded(timeout),
        cwd=cwd,
        check=False,
        **more,
    )


def test_check_says_what_would_be_simulated():
    done = hpcclear("check", "jobs/slider_crank.toml", "--details", *SHORT)
    assert done.returncode == 0, done.stderr
    words = "effect 1", "lankarani-nikravesh", "8 (positions", "ms per sample on one core"
    assert [word for word in words if word not in done.stdout] == []
    assert "Warning" in done.stdout  # the paper's own rod
    assert "\x1b" not in done.stdout  # no colours in a pipe
    assert max(len(line) for line in done.stdout.splitlines()) <= 80


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [0, 2])
@pytest.mark.parametrize(
    "words",
    [
        ("sample", "--set", "study.samples=40"),
        ("map", "--x", "m3=0.1:0.2:4"),
        ("wear", "--set", "wear.lives=2", "--set", "wear.cycles=1e4"),
    ],
    ids=lambda words: words[0],
)
@pytest.mark.shortened(3)
def test_pipes_and_terminals_get_80_columns_on_any_number_of_ranks(tmp_path, words, ranks):
    """Output and log: no colour, no bar, no line that wraps, nothing said once a rank."""
    scene = {"wear": "wear"}.get(words[0], "quickstart")
    command, *options = words
    (tmp_path / "jobs").symlink_to(ROOT / "jobs")
    asked = [command, f"jobs/{scene}.toml", "-o", "x.nc", *options, *SHORT]
    done = hpcclear(*asked, ranks=ranks, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    for told in (done.stdout, done.stderr):
        assert not re.search(r"[\x1b\r━]", told)
        lines = [line.strip() for line in told.splitlines() if line.strip()]
        assert all(len(line) <= 80 for line in told.splitlines()), told
        assert len(lines) == len(set(lines)), told
    asked = [one.replace("x.nc", "y.nc").replace("quickstart", "tolerances") for one in asked]
    launch = [str(MPIEXEC), "-n", str(ranks)] if ranks else []
    program = [*launch, sys.executable, "-m", "hpcclear", *asked]
    lines = left_of(run_on_a_terminal(program, cwd=tmp_path))  # with notes
    assert len(lines) <= 24
    assert max(map(len, lines)) <= 80


def test_simulate_writes_a_response_that_opens_anywhere(tmp_path):
    out = tmp_path / "response.nc"
    done = hpcclear("simulate", "jobs/slider_crank.toml", "-o", out, *SHORT)
    assert done.returncode == 0, done.stderr
    assert "f: mean gap" in done.stdout
    response = xr.open_dataset(out)
    assert response["slider_position"].attrs["units"] == "m"
    assert response.sizes["time"] == 721
    assert opened.read(out, "response")["status"] == 0


def test_a_response_that_did_not_end_is_written_and_told(tmp_path):
    out = tmp_path / "response.nc"
    words = ["simulate", "jobs/slider_crank.toml", "-o", out, *SHORT]
    done = hpcclear(*words, "--set", "numerics.max_steps=100")
    assert done.returncode == 1
    assert done.stderr.startswith("Error: step_cap: numerics.max_steps was reached")
    assert (done.stdout + done.stderr).count("See with hpcclear check") == 1
    found = opened.read(out, "response")
    assert np.isnan(found["objective"])
    assert found.sizes["time"] > 10


def test_the_shell_completes_commands_and_options():
    def completed(words):
        asked = {"_HPCCLEAR_COMPLETE": "bash_complete", "COMP_WORDS": words}
        place = {"COMP_CWORD": str(len(words.split()) - 1)}
        return hpcclear(env=os.environ | asked | place).stdout.split()

    assert completed("hpcclear si") == ["plain,simulate"]
    assert completed("hpcclear run --f") == ["plain,--fresh"]


def test_both_entry_points_give_version_and_help():
    assert __version__ in hpcclear("--version", module=True).stdout
    installed = Path(sys.executable).parent / "hpcclear"
    done = subprocess.run([installed, "--version"], capture_output=True, text=True, check=True)
    assert __version__ in done.stdout
    for command in cli.every():
        done = hpcclear(command, "--help")
        assert done.returncode == 0
        assert "Example" in done.stdout


@pytest.mark.parametrize(("place", "code"), [("/dev/full", 1), ("&-", 0)])
def test_an_output_that_takes_nothing_leads_to_no_traceback(place, code):
    words = f"{sys.executable} -m hpcclear check jobs/quickstart.toml --no-cost >{place}"
    done = subprocess.run(["sh", "-c", words], cwd=ROOT, stderr=subprocess.PIPE, check=False)
    assert (done.returncode, b"Traceback" in done.stderr) == (code, False), done.stderr


@pytest.mark.parametrize(("former", "words"), OLD.items())
def test_a_former_name_of_a_command_is_one_and_is_not_listed(former, words):
    old, new = (CliRunner().invoke(cli, [*one.split(), "--help"]) for one in (former, words))
    assert (old.exit_code, old.output) == (new.exit_code, new.output) == (0, new.output)
    assert f"hpcclear {words.split()[0]} " in new.output.replace("Usage: cli ", "hpcclear ")
    assert former not in cli.every()
    assert f"\n  {former} " not in CliRunner().invoke(cli, ["--help"]).output


@pytest.mark.parametrize(
    "words",
    [
        ["accuracy", "a.toml", "--plan", "--quick"],
        ["accuracy", "a.toml", "-o", "a", "--error", "0.1"],
        ["map", "a.toml", "-o", "a.nc", "--x", "C=1:2:3", "--bifurcation", "--y", "C=1:2:3"],
        ["map", "a.toml", "-o", "a.nc", "--x", "C=1:2:3", "--section", "1"],
        ["sample", "a.toml", "-o", "a.nc", "--merge", "--statistics"],
        ["reproduce", "a", "--crate", "--samples", "3"],
        ["init", "--import", "a.csv", "b.toml", "--jobs"],
        ["init", "a.csv", "b.toml"],
        ["init", "a.toml", "--unit", "mm"],
        ["init", "a.toml", "--compressor", "--four-stroke"],
        ["plot", "a.nc", "--seconds", "3"],
        ["plot", "a.nc", "--format", "pdf"],
        ["init", "--import", "a.csv"],
        ["accuracy", "a.toml"],
    ],
)
def test_options_of_another_mode_of_a_command_are_refused(words):
    done = CliRunner().invoke(cli, words)
    assert done.exit_code == 2, done.output
    assert re.search("cannot be combined with|needs --|Missing|unexpected extra", done.output)


@pytest.mark.parametrize("words", ["init", "init --import points.csv"])
def test_what_a_killed_command_left_goes_when_it_runs_again(tmp_path, monkeypatch, words):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "points.csv").write_text("name,x [mm],y [mm]\nO,0,0\nA,50,0\nB,150,80\nC,200,0\n")
    (tmp_path / ".hpcclear-0123456789abcdef.tmp").write_text("half a scene")
    done = CliRunner().invoke(cli, [*words.split(), "made.toml"])
    assert done.exit_code == 0, done.output
    assert sorted(path.name for path in tmp_path.iterdir()) == ["made.toml", "points.csv"]


@pytest.mark.parametrize(
    ("words", "fragment"),
    [
        (["check", "no_such_file.toml"], "no_such_file.toml"),
        (["check", "jobs/slider_crank.toml", "--set", "drive.spead=1"], "speed"),
        (["check", JOB, "--set", "mechanism.rod.length=0.01"], "longer than the crank"),
        (["simulate", JOB], "--output"),
        (["simulate", "jobs/slider_crank.toml", "-o", "/proc/no/such/x.nc"], "/proc/no/such"),
        (["sample", "jobs/slider_crank.toml", "-o", "x.nc"], "study"),
        ([*SAMPLE, "--time-limit", "nan"], "--time-limit"),
        ([*SAMPLE, "--statistics", "--points", "p.csv"], "--points"),
        ([*SAMPLE, "--raw", "x"], "--raw"),
        (["export", "x.nc", "-o", "x.csv", "--beyond", "f=1"], "--beyond needs --statistics"),
        ([*SAMPLE, "--checkpoint-interval", "nan"], "-interval"),
        (["chekc"], "No such command 'chekc'. Did you mean 'check'?"),
        ([*SAMPLE, "--points", "README.md"], "README.md"),
    ],
)
def test_bad_input_is_one_message_and_exit_code_2(words, fragment):
    done = hpcclear(*words)
    assert (done.returncode, "Traceback" in done.stderr) == (2, False)
    assert fragment in done.stderr


def test_a_table_of_designs(tmp_path):
    table = tmp_path / "designs.csv"
    table.write_text("m2,C [mm]\n0.2,0.3\n0.3,0.5\n")
    out = tmp_path / "designs.nc"
    done = hpcclear("sample", "jobs/slider_crank.toml", "-o", out, "--points", table, *SHORT)
    assert done.returncode == 0, done.stderr
    samples = opened.read(out, "samples")
    assert samples["C"].to_numpy().tolist() == [3e-4, 5e-4]
    assert (tmp_path / "designs.timing.nc").exists()


@pytest.mark.mpi
def test_one_two_and_three_ranks_write_the_same_bytes(tmp_path):
    files = []
    for ranks in (0, 1, 2, 3):
        out = tmp_path / str(ranks) / "samples.nc"
        out.parent.mkdir()
        words = ("sample", "jobs/quickstart.toml", "-o", out, "--set", "study.samples=150")
        done = hpcclear(*words, ranks=ranks)
        assert done.returncode == 0, done.stderr
        files.append(out.read_bytes())
    assert all(content == files[0] for content in files[1:])


MONTE_CARLO = ["--set", "study.method=monte-carlo", "--set", "study.samples=64"]


def test_statistics_are_those_of_the_samples(tmp_path):
    out, raw = tmp_path / "statistics.nc", tmp_path / "raw"
    words = ("sample", "jobs/quickstart.toml", *SHORT, *MONTE_CARLO)
    done = hpcclear(*words, "-o", out, "--statistics", "--raw", raw)
    assert done.returncode == 0, done.stderr
    assert "Mean gap" in done.stdout
    assert hpcclear(*words, "-o", tmp_path / "samples.nc").returncode == 0
    statistics = opened.read(out, "statistics")
    samples = opened.read(tmp_path / "samples.nc", "samples")
    (kept,) = raw.glob("samples-*.nc")
    assert (opened.read(kept, "samples")["objective"] == samples["objective"]).all()
    assert float(statistics["objective_mean"]) == pytest.approx(
        float(samples["objective"].mean()), rel=1e-12
    )
    assert int(statistics["samples_by_status"].sum()) == 64
