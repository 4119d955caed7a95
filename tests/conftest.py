"""One thread for BLAS and Numba before numpy loads, and other seeds for the statistical tests."""

import gc
import os
import tempfile
from collections import Counter
from pathlib import Path

import pytest
from mpi_programs import last_bits

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(_name, "1")  # tests share the cores with other processes


def pytest_addoption(parser):
    parser.addoption(
        "--other-seeds",
        type=int,
        default=0,
        help="only statistical tests, with so many other seeds",
    )


def pytest_configure():
    last_bits.disturb()  # if this run has a seed


@pytest.fixture(scope="module")
def shift() -> int:
    """What a statistical test adds to its seeds: 0, or 100, 200, ... with ``--other-seeds``."""
    return 0


@pytest.fixture(scope="module")
def carried_out(tmp_path_factory):
    """Carry out a study by formula, with entries of `formula` set by name: carried_out(scene, BIAS=...), to its directory."""

    def run(scene, notify=lambda text: None, **entries):
        import formula_study

        from hpcclear.ranks.boundary import alone
        from hpcclear.study import run_study

        place = tmp_path_factory.mktemp("study") / "out"
        with pytest.MonkeyPatch.context() as patch:
            formula_study.formula.replace_dynamics(patch.setattr)
            for name, value in entries.items():
                patch.setattr(formula_study.formula, name, value)
            return run_study(scene, place, alone(), progress_style="quiet", notify=notify)

    return run


@pytest.fixture(scope="module")
def browser():
    """A real one, for all tests of a file."""
    from browser import Browser

    made = Browser()
    yield made
    made.close()


@pytest.fixture
def details(monkeypatch):
    """What commands print of results is all of them, as with ``--details``."""
    monkeypatch.setattr("hpcclear.cli.printing.detailed", lambda: True)


@pytest.fixture
def place_of_all():
    """A folder that other users may enter; pytest's own are closed whenever a session of it begins."""
    here = Path(__file__).resolve()
    if os.geteuid() == 0 and not all(
        folder.stat().st_mode & 0o005 == 0o005 for folder in here.parents
    ):
        pytest.skip("other users may not enter this checkout, so none can run its commands")
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        place.chmod(0o755)
        yield place
        place.chmod(0o755)  # whatever a test made of it


def pytest_generate_tests(metafunc):
    others = metafunc.config.getoption("--other-seeds")
    if others and "shift" in metafunc.fixturenames:
        shifts = [100 * (k + 1) for k in range(others)]
        metafunc.parametrize("shift", shifts, scope="module", ids=lambda k: f"shift{k}")


LONGEST = (
    "survival", "docs", "native_windows", "random_scenes", "linkage_scenes", "limits", "accuracy", "certificate",
    "effects", "cli", "statistics", "fuzz", "bending", "cluster", "goals", "reference", "guides", "hostile", "tight",
    "further_responses", "stiff", "jacobian", "hard_cases", "ideal", "motion", "run", "comm", "study",
)  # fmt: skip
"""Files that take longest first: one that begins last keeps a single worker busy at the end."""


def _turn(item):
    name = item.path.stem.removeprefix("test_")
    return LONGEST.index(name) if name in LONGEST else len(LONGEST)


@pytest.hookimpl(tryfirst=True)  # before marks choose
def pytest_collection_modifyitems(config, items):
    items.sort(key=_turn)
    met = Counter()
    for item in items:
        if kept := item.get_closest_marker("shortened"):
            of = (item.path, item.originalname)
            met[of] += not any(item.iter_markers("nightly")) and not any(item.iter_markers("full"))
            if met[of] > kept.args[0]:
                item.add_marker("nightly")
    if config.getoption("--other-seeds"):
        items[:] = [item for item in items if "shift" in item.fixturenames]


def pytest_collection_finish():
    """Leave what is loaded, hundreds of thousands of objects that stay, out of every further search for unreachable ones.

    The compiler makes so many objects that these searches took a seventh of its time.
    """
    gc.collect()
    gc.freeze()
    gc.set_threshold(50_000, 20, 50)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item):
    """What was to spare at each limit of `margins` goes with the report, for repeat_statistical.py."""
    import margins

    margins.TO_SPARE.clear()
    try:
        return (yield)
    finally:
        item.user_properties.append(("to spare", list(margins.TO_SPARE)))
