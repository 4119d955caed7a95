"""The drawing of a mechanism, and the scene to start from."""

import itertools
from pathlib import Path

import numpy as np
import opened
import pytest
from click.testing import CliRunner
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from own_engine import engine
from planar_scenes import planar_scene

from hpcclear import simulate
from hpcclear.base.errors import InputError
from hpcclear.cli import cli
from hpcclear.dynamics.planar.problem import poses_at_start
from hpcclear.report import sketch_figure
from hpcclear.report.figures import motion, moving
from hpcclear.report.figures.drawing import CHANGED, draw
from hpcclear.report.figures.placed import Placed
from hpcclear.report.figures.sketch import changes
from hpcclear.report.figures.style import colour
from hpcclear.report.html.page import write_report
from hpcclear.results.content import Results
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

GALLERY = {
    f"{path.parent.name} {path.stem}": path
    for folder in ("linkages", "machines", ".")
    for path in sorted((ROOT / "jobs" / folder).glob("*.toml"))
}
"""Every scene that comes with the program."""


def bars(seed):
    """A linkage of four to eight bars as a scene: a four-bar or a driven five-bar, and pairs of bars on points of it."""
    rng = np.random.default_rng(seed)
    count = 4 + seed % 5
    ground = {"o": [0.0, 0.0], "p": [rng.uniform(0.1, 0.2), rng.uniform(-0.03, 0.05)]}
    ends = {"a": np.array([0.02, 0.03]) * rng.uniform(0.6, 1.4, 2)}
    ends["b"] = np.add(ground["p"], [rng.uniform(-0.03, 0.03), rng.uniform(0.06, 0.12)])
    rows = [("crank", "ground.o", "a"), ("rocker", "ground.p", "b")]
    if count % 2:
        ends["m"] = 0.5 * (ends["a"] + ends["b"]) + [0.0, rng.uniform(0.05, 0.1)]
        rows += [("left", "a", "m"), ("right", "b", "m")]
    else:
        rows += [("coupler", "a", "b")]
    while len(rows) < count - 1:
        k, base = len(rows), rng.choice(sorted(ends))
        ground[f"g{k}"] = [rng.uniform(0.2, 0.35), rng.uniform(-0.05, 0.15)]
        ends[f"k{k}"] = ends[base] + rng.uniform([0.03, 0.04], [0.12, 0.14])
        rows += [(f"link{k}", base, f"k{k}"), (f"lever{k}", f"ground.g{k}", f"k{k}")]
    at = {f"ground.{name}": np.array(place) for name, place in ground.items()} | ends
    bodies, pins, held = {}, {}, {}
    for name, *two in rows:
        way = at[two[1]] - at[two[0]]
        bodies[name] = {
            "length": float(np.hypot(*way)),
            "mass": 0.2,
            "inertia": 1e-4,
            "start_angle": float(np.arctan2(way[1], way[0])),
        }
        for place, end in zip(two, "ab", strict=True):
            bearing = held.setdefault(place, f"{name}.{end}") if "." not in place else place
            if bearing != f"{name}.{end}":
                pins[f"pin{len(pins)}"] = {
                    "kind": "revolute", "journal": f"{name}.{end}", "bearing": bearing
                }  # fmt: skip
    loose = next(name for name, pin in pins.items() if "ground" not in pin["bearing"])
    material = {"youngs_modulus": 2e11, "poisson_ratio": 0.3}
    pins[loose] |= {
        "kind": "clearance", "clearance": "0.2 mm", "bearing_radius": "8 mm",
        "materials": {"bearing": material, "journal": material},
    }  # fmt: skip
    drives = {"motor": {"kind": "constant-speed", "body": "crank", "speed": "600 rpm"}}
    if count % 2:
        drives["servo"] = {
            "kind": "harmonic", "body": "rocker", "amplitude": 0.2, "frequency": 10.0,
            "mean": bodies["rocker"]["start_angle"],
        }  # fmt: skip
    last = rows[-1][0]
    loads = {
        "push": {"kind": "force", "place": f"{last}.b", "force": [30.0, -20.0]},
        "spring": {
            "kind": "spring", "first": "crank.b", "second": "ground.p", "stiffness": 1e3
        },
        "brake": {"kind": "torque", "body": last, "torque": -3.0},
    }  # fmt: skip
    effects = {"contact": {"law": "hunt-crossley", "damping": 0.4}, "gravity": 9.81}
    return planar_scene(bodies, pins, drives, ground=ground, loads=loads, effects=effects)


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


@pytest.mark.parametrize("name", [*SCENES, *GALLERY, *range(20)])
def test_no_word_of_the_drawing_covers_another_or_a_bar_or_leaves_the_page(name):
    scene = (
        bars(name)
        if isinstance(name, int)
        else load_scene(GALLERY[name])
        if name in GALLERY
        else engine(*SCENES[name], study=False)
    )
    figure, axes, texts = drawn(scene)
    boxes = [(text.get_text(), text.get_window_extent()) for text in texts]
    page = figure.bbox
    for word, box in boxes:
        assert page.containsx(box.x0), word
        assert page.containsx(box.x1), word
        assert page.containsy(box.y0), word
        assert page.containsy(box.y1), word
    for (word, one), (other, two) in itertools.combinations(boxes, 2):
        assert not one.overlaps(two), (word, other)
    thick = [line for line in axes.lines if line.get_linewidth() >= 2.0]
    assert len(thick) >= len([one for one in scene.linkage.bodies if one.length is not None])
    for line in thick:
        ends = axes.transData.transform(np.column_stack(line.get_data()))
        way = np.vstack([np.linspace(*two, 200) for two in itertools.pairwise(ends)])
        for word, box in boxes:
            assert not np.any([box.contains(*place) for place in way]), word


def test_lengths_and_mass_centres_are_to_scale():
    _, axes, texts = drawn(engine(study=False))
    assert {"40 mm", "140 mm"} <= {text.get_text() for text in texts}
    lines = [
        np.column_stack(line.get_data())
        for line in axes.lines
        if line.get_linewidth() >= 2.0 or line.get_marker() == "o"
    ]
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


def test_parts_that_differ_from_another_design_are_coloured_with_their_change(tmp_path):
    changed = {"mechanism.rod.mass": 0.3, "mechanism.crank.length": 0.05}
    scene, other = engine(study=False).with_(changed), engine(study=False)
    found = changes(scene, other)
    assert found == {"crank": ["length 40 mm → 50 mm"], "rod": ["mass 0.45 kg → 0.3 kg"]}
    figure = Figure()
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    poses = [poses_at_start(one, DRAWN_AT) for one in (scene, other)]
    draw(axes, scene, poses[0], found, (other, poses[1]))
    words = {text.get_text(): text.get_color() for text in axes.texts}
    assert words["rod\nmass 0.45 kg → 0.3 kg"] == colour(CHANGED)
    assert words["slider"] != colour(CHANGED)
    dashed = [
        line for line in axes.lines if line.get_linestyle() == "--" and len(line.get_xdata()) == 2
    ]
    pin = 0.04 * np.array([np.cos(DRAWN_AT), np.sin(DRAWN_AT)])
    assert any(np.allclose(np.column_stack(line.get_data())[1], pin) for line in dashed)


def test_the_page_has_the_drawing_of_the_recommended_design_without_a_script(tmp_path):
    scene = load_scene(GALLERY["linkages crank_rocker"], ["numerics.averaged_revolutions=1"])
    response = simulate(scene.with_({"study": None}))
    opened.write(response, tmp_path / "response.nc")
    page = write_report(tmp_path).read_text()
    assert 'alt="The mechanism to scale, with its dimensions." class="still"' in page
    found = Results.of(response)
    poses = moving.poses(scene, motion.latest(found, 1), 0)
    placed = Placed(scene.linkage, poses)
    for joint in scene.linkage.joints:  # as far apart as their clearance at most
        apart = np.hypot(*(placed.at(joint.journal) - placed.at(joint.bearing)))
        assert apart < 1.2 * (getattr(joint, "clearance", None) or 1e-9)
