"""The drawing of a mechanism, and the scene to start from."""

import itertools
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from own_engine import engine

from hpcclear.base.errors import InputError
from hpcclear.cli import cli
from hpcclear.dynamics.planar.problem import poses_at_start
from hpcclear.report import sketch_figure
from hpcclear.report.figures.sketch import Placed
from hpcclear.scene import load_scene
from hpcclear.scene.slider_crank import DRAWN_AT

ROOT = Path(__file__).parents[1]
SCENES = {
    "engine": (),
    "short crank": ("mechanism.crank.length=8 mm",),
    "long crank": ("mechanism.crank.length=130 mm",),
    "counterweight": ("mechanism.crank.mass_center=-30 mm", "effects.gravity=9.81"),
    "ideal": ("joints.crank_rod.kind=ideal", "effects.slider_load=none"),
    "torque": (
        'drive={ kind = "torque", torque = 4.0, flywheel_inertia = 0.05, initial_speed = "3000 rpm" }',
    ),
}

LINKAGES = {path.stem: path for path in (ROOT / "jobs" / "linkages").glob("*.toml")}


def drawn(scene):
    """Figure, its axes and its texts, laid out."""
    figure = sketch_figure(
        scene, poses_at_start(scene, 0.0 if scene.template is None else DRAWN_AT)
    )
    figure.canvas.draw()
    return (
        figure,
        figure.axes[0],
        [t for t in [*figure.texts, *figure.axes[0].texts] if t.get_text()],
    )


@pytest.mark.parametrize("name", [*SCENES, *LINKAGES])
def test_no_word_of_the_drawing_covers_another_or_leaves_the_page(name):
    scene = load_scene(LINKAGES[name]) if name in LINKAGES else engine(*SCENES[name], study=False)
    figure, _, texts = drawn(scene)
    boxes = [(text.get_text(), text.get_window_extent()) for text in texts]
    page = figure.bbox
    for word, box in boxes:
        assert page.containsx(box.x0), word
        assert page.containsx(box.x1), word
        assert page.containsy(box.y0), word
        assert page.containsy(box.y1), word
    for (word, one), (other, two) in itertools.combinations(boxes, 2):
        assert not one.overlaps(two), (word, other)


def test_lengths_and_mass_centres_are_to_scale():
    _, axes, _ = drawn(engine(study=False))
    lines = [np.column_stack(line.get_data()) for line in axes.lines]
    pin = 0.04 * np.array([np.cos(DRAWN_AT), np.sin(DRAWN_AT)])
    bars = [line for line in lines if line.shape == (2, 2)]
    crank = next(line for line in bars if np.allclose(line[0], 0.0))
    assert np.allclose(crank[1], pin)
    rod = next(line for line in bars if np.allclose(line[0], pin))
    assert np.hypot(*(rod[1] - rod[0])) == pytest.approx(0.14)
    assert rod[1, 1] == pytest.approx(0.0)
    points = [line[0] for line in lines if line.shape == (1, 2)]
    for centre in (pin * 10 / 40, pin + (rod[1] - pin) * 45 / 140):
        assert any(np.allclose(point, centre) for point in points)


@pytest.mark.parametrize(
    "options",
    [[], ["--four-stroke"], ["--compressor"]],
    ids=["two-stroke", "four-stroke", "compressor"],
)
def test_check_draws_and_init_writes_what_check_accepts(tmp_path, options):
    file, figure = tmp_path / "my engine.toml", tmp_path / "sketch.svg"
    made = CliRunner().invoke(cli, ["init", str(file), *options])
    assert made.exit_code == 0
    assert f"hpcclear check {file}" in made.output
    last = "sample" if "--compressor" in options else "run"
    assert f"hpcclear {last} {file} -o " in file.read_text()
    scene = load_scene(file)
    assert scene.warnings == ()
    assert scene.study.objective in file.read_text()
    assert ("720 deg" in file.read_text()) == ("--four-stroke" in options)
    words = ["check", str(file), "--no-cost", "--sketch", str(figure)]
    checked = CliRunner().invoke(cli, words)
    assert checked.exit_code == 0
    assert figure.read_text().startswith("<?xml")
    before = file.read_bytes()
    again = CliRunner().invoke(cli, ["init", str(file)])
    assert isinstance(again.exception, InputError)
    assert file.read_bytes() == before


def test_a_linkage_is_drawn_where_it_was_put_together():
    """Every joint's two places coincide, and every name is there."""
    scene = load_scene(LINKAGES["press"])
    placed = Placed(scene.mechanism, poses_at_start(scene))
    for joint in scene.mechanism.joints:
        if joint.kind in ("revolute", "clearance"):
            np.testing.assert_allclose(
                placed.at(joint.journal), placed.at(joint.bearing), atol=1e-9
            )
    _, axes, texts = drawn(scene)
    said = {text.get_text() for text in texts}
    mechanism = scene.mechanism
    for rows in (mechanism.bodies, mechanism.joints, mechanism.drives, mechanism.loads):
        assert {row.name for row in rows} <= said
    assert "300 rpm" in "\n".join(said)
    assert axes.get_aspect() == 1.0
