"""What is released: wheel and source distribution are complete, and work in an empty environment."""

import os
import shutil
import subprocess
import sys
import tarfile
import venv
import zipfile
from email import message_from_bytes
from pathlib import Path

import pytest
from markdown_it import MarkdownIt
from patience import crowded

pytestmark = pytest.mark.nightly
ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "hpcclear"
JOBS = {
    f"hpcclear/cli/jobs/{path.relative_to(ROOT / 'jobs')}"
    for kind in ("*.toml", "linkages/*.toml", "machines/*.toml", "*.slurm", "until_done.sh")
    for path in (ROOT / "jobs").glob(kind)
}
"""Scenes and scripts that `hpcclear init --jobs` writes."""
DATA = (
    JOBS
    | {
        "hpcclear/cli/compressor.toml",
        "hpcclear/cli/four_stroke.toml",
        "hpcclear/cli/starter.toml",
        "hpcclear/py.typed",
        "hpcclear/report/html/page.css",
        "hpcclear/report/html/page.js",
    }
    | {
        f"hpcclear/report/html/templates/{path.name}"
        for path in (ROOT / "hpcclear" / "report" / "html" / "templates").glob("*.html")
    }
)


def run(*words: object, place: Path, patience: float = 600.0) -> str:
    """Output of a program that sees nothing of this checkout; it must succeed."""
    clean = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    done = subprocess.run(
        [str(word) for word in words],
        cwd=place,
        env=clean,
        capture_output=True,
        text=True,
        timeout=crowded(patience),
        check=False,
    )
    assert done.returncode == 0, f"{words}\n{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A directory with the source distribution and, made from that, the wheel."""
    place = tmp_path_factory.mktemp("release")
    names = shutil.ignore_patterns(".*", "site", "build", "*.egg-info", "__pycache__")

    def ignored(folder: str, entries: list[str]) -> set[str]:
        results = {"results"} if Path(folder) == ROOT else set()  # not the package's room
        return results | set(names(folder, entries))

    shutil.copytree(ROOT, place / "source", ignore=ignored)
    run(sys.executable, "-m", "build", "--outdir", place / "dist", place / "source", place=place)
    return place / "dist"


@pytest.fixture(scope="module")
def installed(built: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Programs of an environment that holds the wheel and what it asks for, nothing else."""
    place = tmp_path_factory.mktemp("environment")
    venv.create(place, with_pip=True)
    wheel = next(built.glob("*.whl"))
    pip = (
        place / "bin" / "python",
        "-m",
        "pip",
        "install",
        "--no-compile",  # few modules of all these packages are loaded
        "--quiet",
        "--disable-pip-version-check",
    )
    run(*pip, f"{wheel}[mpich,analysis]", place=place)
    return place / "bin"


def test_wheel_and_source_hold_every_module_and_the_data(built):
    modules = {str(path.relative_to(ROOT)) for path in PACKAGE.rglob("*.py")}
    with zipfile.ZipFile(next(built.glob("*.whl"))) as wheel:
        names = set(wheel.namelist())
    inside = {name for name in names if ".dist-info/" not in name}
    assert inside == modules | DATA
    assert any(name.endswith("licenses/LICENSE") for name in names)
    with tarfile.open(next(built.glob("*.tar.gz"))) as source:
        kept = {name.partition("/")[2] for name in source.getnames()}
    assert modules | DATA | {"LICENSE", "README.md", "pyproject.toml"} <= kept


def test_the_page_of_the_index_stands_alone(built):
    with zipfile.ZipFile(next(built.glob("*.whl"))) as wheel:
        name = next(one for one in wheel.namelist() if one.endswith(".dist-info/METADATA"))
        found = message_from_bytes(wheel.read(name))
    page = MarkdownIt("commonmark").enable("table").parse(str(found.get_payload()))
    links = [
        str(child.attrs.get("href") or child.attrs.get("src"))
        for token in page
        for child in token.children or ()
        if {"href", "src"} & child.attrs.keys()
    ]
    assert len(links) > 20
    repository, *_ = (one.split(", ")[1] for one in found.get_all("Project-URL") or ())
    for link in links:
        assert link.startswith("https://"), link
        if link.startswith(f"{repository}/blob/main/"):
            file = link.removeprefix(f"{repository}/blob/main/").partition("#")[0]
            assert (ROOT / file).exists(), link


def test_a_job_runs_from_the_wheel_alone(installed, tmp_path):
    run(installed / "hpcclear", "init", "jobs", "--jobs", place=tmp_path)
    written = {f"hpcclear/cli/{path.relative_to(tmp_path)}" for path in tmp_path.rglob("*.*")}
    assert written == JOBS
    home = run(
        installed / "python", "-c", "import hpcclear; print(hpcclear.__file__)", place=tmp_path
    )
    assert home.startswith(str(installed.parent))
    results = tmp_path / "results"
    sample = (
        "sample",
        "jobs/quickstart.toml",
        "-o",
        results / "samples.nc",
        "--set",
        "study.samples=32",
    )
    run(installed / "mpiexec", "-n", "2", installed / "hpcclear", *sample, place=tmp_path)
    assert "report.html" in run(installed / "hpcclear", "report", results, place=tmp_path)
    page = (results / "report.html").read_text(encoding="utf-8")
    assert "32 simulations" in page
    assert "<style>" in page
    assert "data:image/png;base64," in page


@pytest.mark.full
def test_the_quickstart_runs_from_the_wheel_alone(installed, tmp_path):
    shutil.copy(ROOT / "jobs" / "quickstart.toml", tmp_path)
    study = ("run", "quickstart.toml", "-o", tmp_path / "study")
    run(installed / "mpiexec", "-n", "2", installed / "hpcclear", *study, place=tmp_path)
    run(installed / "hpcclear", "report", tmp_path / "study", place=tmp_path)
    assert (tmp_path / "study" / "report.html").stat().st_size > 100_000
