"""The sketch of a scene: its mechanism to scale, curves of loads and motors beside, and a key with every number."""

import re
import textwrap
from collections.abc import Mapping

import numpy as np

from hpcclear.base.written import reading
from hpcclear.report.figures import curves, drawing, labels, motion, moving, style
from hpcclear.report.figures.placed import Pose
from hpcclear.report.html.content import scene_of
from hpcclear.results.content import Results
from hpcclear.scene import Scene
from hpcclear.scene.loading import scene_of_text

_ROW = re.compile(r"mechanism\.(?:bodies|joints|drives|loads)\.(\w+)\.([\w.]+)")
_LEFT_OUT = ("materials", "start_eccentricity", "out_of_round", "wear")


def key(scene: Scene) -> list[str]:
    """A line for each body, joint, drive and load: the numbers of its table that are not zero, as they are written."""
    rows = dict[str, list[str]]()
    for path in scene.numeric_paths():
        row, value = _ROW.fullmatch(scene.path_in_linkage(path)), scene.number(path)
        if row and value and not row[2].startswith(_LEFT_OUT):
            said = f"{re.sub('[_.]', ' ', row[2])} {labels.quantity(value, scene.unit(path))}"
            rows.setdefault(row[1], []).append(said)
    lines = [f"{name}: {', '.join(said)}" for name, said in rows.items()]
    if scene.effects.gravity > 0.0:
        lines.append(f"gravity {scene.effects.gravity:g} m/s², towards -y")
    return ["angles from x, counter-clockwise", *lines]


_WIDTH, _LINE = 170.0, 3.7  # mm of the figure, and of a line of the key
_BESIDE = 62.0  # mm of the column of curves
_COLUMN = 57  # letters of a line


@style.drawn
def sketch_figure(scene: Scene, poses: Mapping[str, Pose]) -> "style.Figure":
    """The mechanism where its bodies are put together, with dimensions, and a key with every number.

    Lengths are to scale, pins are not, and clearances are enlarged as much as said. Curves of loads and motors are drawn
    beside. `poses`: where its bodies are (`hpcclear.dynamics.planar.problem.poses_at_start`).
    """
    with reading(scene.written):
        return _sketch(scene, poses)


def _sketch(scene: Scene, poses: Mapping[str, Pose]) -> "style.Figure":
    tables = curves.tabulated(scene)
    blocks = [textwrap.wrap(line, _COLUMN, subsequent_indent="   ") for line in key(scene)]
    rows = (sum(map(len, blocks)) + 1) // 2
    columns: list[list[str]] = [[], []]
    for block in blocks:
        columns[bool(columns[1]) or len(columns[0]) + len(block) > rows + 1].extend(block)
    width = _WIDTH - (_BESIDE if tables else 0.0)
    drawn = drawing.height(scene, poses, width)
    above = max(drawn, curves.HEIGHT * len(tables))
    height = above + _LINE * (max(map(len, columns)) + 2)
    figure = style.page(height, _WIDTH)
    figure.set_layout_engine("none")
    axes = figure.add_axes((0.0, 1.0 - drawn / height, width / _WIDTH, drawn / height))
    remark = drawing.draw(axes, scene, poses)
    curves.draw(figure, tables, curves.HEIGHT / height, (width / _WIDTH, _BESIDE / _WIDTH))
    top = 1.0 - (above + 0.5 * _LINE) / height
    figure.text(0.02, top, remark, va="top")
    for x, lines in zip((0.02, 0.52), columns, strict=True):
        text = "\n".join(map(labels.literal, lines))
        figure.text(x, top - 1.5 * _LINE / height, text, linespacing=1.35, va="top")
    return figure


_PICTURE = 95.0  # mm of width of a drawing alone


@style.figure("the mechanism to scale, with its dimensions", 5)
def mechanism_figure(response: Results, before: Results | None = None) -> "style.Figure":
    """The mechanism to scale; what differs from another design is coloured. InputError where the file lacks the scene."""
    scene, poses = _posed(response)
    other = None if before is None else _posed(before)
    changed = None if other is None else changes(scene, other[0])
    height = drawing.height(scene, poses, _PICTURE)
    figure = style.page(height, _PICTURE)
    figure.set_layout_engine("none")
    axes = figure.add_axes((0.0, _LINE / height, 1.0, 1.0 - _LINE / height))
    figure.text(0.02, 0.5 * _LINE / height, drawing.draw(axes, scene, poses, changed, other))
    return figure


def _posed(response: Results) -> tuple[Scene, dict[str, Pose]]:
    """The scene of a response and where its bodies are, of a template at the angle at which it is drawn."""
    scene = scene_of_text(str(response.attrs.get("scene", "")), "scene")
    shown = motion.latest(response, 1)
    at = 0.0 if scene.template is None else scene.template.DRAWN_AT / motion.TURN
    off = np.abs(np.mod(motion.turns(shown) - at + 0.5, 1.0) - 0.5)
    return scene, moving.poses(scene, shown, int(off.argmin()))


def differences(response: Results, before: Results) -> dict[str, list[str]]:
    """`changes` of the scenes of two responses; none where a file does not hold its scene whole."""
    new, old = map(scene_of, (response, before))
    return {} if new is None or old is None or new is old else changes(new, old)


def changes(scene: Scene, before: Scene) -> dict[str, list[str]]:
    """Numbers of bodies and joints that differ between two scenes of one structure, in lines, by the names of these."""
    found: dict[str, list[str]] = {}
    for path in {*before.numeric_paths()}.intersection(scene.numeric_paths()):
        row = _ROW.fullmatch(scene.path_in_linkage(path))
        pair = labels.quantities((before.number(path), scene.number(path)), scene.unit(path))
        if row and pair[0] != pair[1]:
            found.setdefault(row[1], []).append(f"{re.sub('[_.]', ' ', row[2])} {' → '.join(pair)}")
    return {name: sorted(said) for name, said in sorted(found.items())}
