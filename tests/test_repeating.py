"""The `reproduce` command: results that are what their scenes come to here, and such that are not."""

from dataclasses import replace

import numpy as np
import opened
import pytest
from click.testing import CliRunner
from commands import CHEAP, SCENE

from hpcclear import evaluate, load_scene, simulate, to_table
from hpcclear.base.errors import InputError
from hpcclear.cli import cli
from hpcclear.ensemble.api import as_points, evaluated
from hpcclear.ensemble.repeating import repeated
from hpcclear.results.crate import write_crate


def strip(content) -> None:
    """What only a forged file lacks."""
    content.attrs = {"hpcclear_kind": content.attrs["hpcclear_kind"]}


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A directory with some samples and a response, whose objective is not that of the kernel."""
    place = tmp_path_factory.mktemp("made")
    scene = load_scene(SCENE, [*CHEAP, "study.objective=peak-contact-force"])
    clearances = np.linspace(1e-4, 9e-4, 12)
    opened.write(evaluate(scene, {"C": clearances, "m2": clearances * 500}), place / "samples.nc")
    opened.write(simulate(scene), place / "response.nc")
    return place


def said(*words: str):
    return CliRunner().invoke(cli, words, standalone_mode=False)


def changed(made, tmp_path, name: str, change) -> dict[str, object]:
    """What is found in a copy of one file that `change` was let at."""
    content = opened.read(made / name)
    change(content)
    opened.write(content, tmp_path / name)
    (found,) = repeated(tmp_path, 5)
    return vars(found)


def test_what_was_made_here_is_the_same(made):
    result = said("reproduce", str(made), "--samples", "5")
    assert result.return_value == 0
    assert result.output.splitlines() == [
        "response.nc: its series: the same",
        "samples.nc: 5 of 12 samples: the same",
    ]
    (alone,) = repeated(made / "samples.nc", 100)
    assert alone.extent == "12 of 12 samples"


def test_a_last_bit_tells(made, tmp_path):
    def nudge(content):
        content["objective"][-1] = np.nextafter(content["objective"][-1], 1.0)

    (differing,) = changed(made, tmp_path, "samples.nc", nudge)["differing"]
    assert differing.startswith("objective (")
    result = said("reproduce", str(tmp_path))
    assert result.return_value == 1
    assert "not the same: objective" in result.output


def test_a_series_that_was_changed_tells(made, tmp_path):
    def shift(content):
        content["crank_moment"][7] += 1.0

    (differing,) = changed(made, tmp_path, "response.nc", shift)["differing"]
    assert differing.startswith("crank_moment (")


def test_a_scene_that_reads_otherwise_is_not_simulated(made, tmp_path):
    def rehash(content):
        content.attrs["scene_hash"] = "0" * 64

    assert "reads otherwise" in changed(made, tmp_path, "samples.nc", rehash)["extent"]


def test_a_scene_that_is_none_is_refused(made, tmp_path):
    def forge(content):
        content.attrs["scene"] = "mechanism = 3"

    for change in (forge, strip):
        # in a directory the others are compared all the same
        found = changed(made, tmp_path, "samples.nc", change)
        assert found["unread"]
        assert str(found["extent"]).startswith("not simulated")
        with pytest.raises(InputError):
            list(repeated(tmp_path / "samples.nc", 5))
    assert write_crate(tmp_path).exists()


def test_a_place_without_results_is_refused(tmp_path):
    with pytest.raises(InputError, match="no result file"):
        list(repeated(tmp_path, 5))


def test_rows_of_tables_and_names_of_designs_are_repeated_and_exported_in_words(tmp_path):
    scene = load_scene(SCENE.with_name("tolerances.toml"), CHEAP)
    points = as_points(scene, {"rod": [0, 1], "fit": [3, 0], "t_u2": [1e-3, 2e-3]})
    content = evaluated(scene, replace(points, labels=("old", "new")))
    opened.write(content, tmp_path / "samples.nc")
    (found,) = repeated(tmp_path, 5)
    assert (found.extent, found.differing) == ("2 of 2 samples", ())
    assert len(set(content["objective"].values)) == 2
    table = to_table(opened.read(tmp_path / "samples.nc"))[["rod", "fit", "t_u2 [mm]", "label"]]
    assert table.values.tolist()[0] == ["steel", "40 H6/g5", 1.0, "old"]
    for name, value in (("rod", 2), ("rod", 0.5), ("rod", np.nan), ("t_u2", np.nan)):
        with pytest.raises(InputError, match=r"of a row|must be finite"):
            as_points(scene, {name: value})
