"""No message shows how numbers are kept: NumPy's type names, or its warnings."""

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


def test_computed_numbers_are_short_in_messages():
    error = InputError("k", [0.1 + 0.2, -1 / 810000, "1.5 mm"], "", "")
    assert "k = [0.3, -1.235e-06, '1.5 mm']" in str(error)


SLIPS = {
    "{key} = {number}": ("comma", "{key} = {point}"),
    "{key} = {number} mm": ("comma", '{key} = "{point} mm"'),
    '{key} = "{point} mm': ("quotation", '{key} = "{point} mm"'),
    '{key} = {point} mm"': ("quotation", '{key} = "{point} mm"'),
    "{key} = '{point} mm": ("quotation", '{key} = "{point} mm"'),
    "{key} = {point} mm": ("quotation", '{key} = "{point} mm"'),
    "{key} = {point} mm  # radial": ("quotation", '{key} = "{point} mm"  # radial'),
    "{key} = \u201c{point} mm\u201d": ("typographic", '{key} = "{point} mm"'),
    "{key} = \u00ab{point} mm\u00bb": ("typographic", '{key} = "{point} mm"'),
    "{key} =\u00a0{point}": ("spaces", "{key} = {point}"),
    "{key}\t{point}": ("no = after", "{key} = {point}"),
    '{key} "{point} mm"': ("no = after", '{key} = "{point} mm"'),
    "{key}: {point} mm": ("no = after", '{key} = "{point} mm"'),
    "{key}\t{number}\tmm": ("comma", '{key} = "{point}\tmm"'),
    "{key} = [{point}, {point}": ("bracket", "{key} = [{point}, {point}]"),
    '{key} = ["{point} mm", {point} mm]': ("quotation", '{key} = ["{point} mm", "{point} mm"]'),
    "{key} = [{number} mm, {number} mm]": ("quotation", '{key} = ["{point} mm", "{point} mm"]'),
    "{key} = {{ a = {number}, b = 1 }}": ("comma", "{key} = {{ a = {point}, b = 1 }}"),
    "{key} = {point};": ("after the value", "{key} = {point}"),
    "{key} =": ("no value", "{key} = value"),
    "{key}.kürbel = {point}": ("letters beyond a to z", "a to z"),
    "{key} = 1\n{key} = 2": ("twice, first in line", "Keep one"),
    "[other": ("bracket", "[other]"),
    "other]": ("bracket", "[other]"),
    "[drive]": ("drive twice, first in line 2", "Keep one"),
    "{key} = [\n  1,\n": ("bracket", "Close it"),
}  # fmt: skip


@pytest.mark.parametrize("key", ["clearance", "rod.mass_center"])
@pytest.mark.parametrize(("point", "number"), [("0.3", "0,3"), ("-12.25", "-12,25")])
@pytest.mark.parametrize("slip", SLIPS)
def test_a_slip_of_writing_is_answered_by_the_line_that_is_meant(
    tmp_path, slip, key, point, number
):
    """Line, what was read, what is wrong with it, and what to write, wherever the line stands."""
    wrong, meant = SLIPS[slip]
    words = {"key": key, "point": point, "number": number}
    written = slip.format(**words)
    for before, after in (
        ("", ""),
        ('[drive]\nkind = "torque"\n', '\n[effects]\ngravity = "1 g"\n'),
    ):
        file = tmp_path / "scene.toml"
        file.write_text(f"# a machine\n{before}{written}{after}", encoding="utf-8")
        if slip == "[drive]" and not before:
            continue
        with pytest.raises(InputError) as caught:
            load_scene(file)
        error = caught.value
        assert error.key == "scene file"
        line = 2 + before.count("\n") + ("\n{key}" in slip)
        read = written.splitlines()["\n{key}" in slip].strip()
        assert error.reason.startswith(f"line {line}, {read!r}, "), error.reason
        assert wrong in error.reason
        assert meant.format(**words) in error.remedy
