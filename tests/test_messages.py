"""No message shows how numbers are kept: NumPy's type names, or its warnings."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from hpcclear import load_scene
from hpcclear.base.errors import InputError
from hpcclear.ensemble.api import as_points
from hpcclear.scene.loading import scene_of_text

ROOT = Path(__file__).parent.parent
SCENES = [ROOT / "jobs" / "slider_crank.toml", ROOT / "jobs" / "linkages" / "crank_rocker.toml"]


@pytest.mark.parametrize("file", SCENES, ids=lambda path: path.stem)
@pytest.mark.parametrize("wrong", [np.nan, -1e300, np.inf])
def test_no_entry_is_refused_in_numpys_words(file, wrong):
    """Every number of a scene, set in Python and as a design: refused or not, no message and no text holds a type's name."""
    scene, messages = load_scene(file), []
    for path in scene.numeric_paths():
        for change in (
            lambda p: scene.with_({p: np.float64(wrong)}),
            lambda p: as_points(scene, {p: [wrong]}),
        ):
            try:
                made = change(path)
            except InputError as error:
                messages.append(str(error))
            else:
                messages.append(getattr(made, "text", ""))
    assert len(messages) == 2 * len(scene.numeric_paths())
    assert [text for text in messages if "np." in text] == []


@pytest.mark.parametrize("file", SCENES, ids=lambda path: path.stem)
def test_a_scene_changed_in_python_is_read_back_from_its_text(file):
    scene = load_scene(file, ["numerics.rtol=1e-7"])
    changed = scene.with_({"numerics.rtol": np.float64(1e-6), "effects.gravity": 9.81}).with_(
        {"numerics.rtol": 1e-5}
    )
    found = scene_of_text(changed.text, "file")
    assert found == changed
    assert found.numerics.rtol == 1e-5


@pytest.mark.parametrize(
    "note", ["numerics.rtol = __import__('os').getcwd()", "numerics.rtol = (", "numerics.rtol"]
)
def test_a_note_that_is_no_value_is_refused(note):
    with pytest.raises(InputError, match="the note of a change cannot be read"):
        scene_of_text(f"# changed: {note}\n{load_scene(SCENES[0]).text}", "file")


def test_warnings_of_numpy_are_not_for_users():
    program = """
import numpy as np, hpcclear.scene
def schema(): return {"log": float(np.log(np.zeros(1))[0]), "ratio": float((np.zeros(1) / 0.0)[0])}
hpcclear.scene.scene_schema = schema
from hpcclear.cli import main
main(["show", "schema"])
"""
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=False,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    assert done.returncode == 0
    assert "NaN" in done.stdout
    assert done.stderr == ""
