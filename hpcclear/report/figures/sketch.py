"""A drawing of the mechanism that a scene describes: to scale, with names and signs, and a key."""

import textwrap
from collections.abc import Mapping

from hpcclear.report.figures import curves, labels, linkage_sketch, style
from hpcclear.scene import Scene

_DRAWING, _LINE = 75.0, 3.7  # mm of the drawing, and of a line of the key
_COLUMNS = 58  # letters of a line


@style.drawn
def sketch_figure(scene: Scene, poses: Mapping[str, linkage_sketch.Pose]) -> "style.Figure":
    """The mechanism where its bodies are put together, and a key with every number's place.

    Lengths are to scale; clearances are not, since they would be invisible. Tables of loads and motions are drawn below.
    `poses`: where its bodies are
    (`hpcclear.dynamics.planar.problem.poses_at_start`).
    """
    key = linkage_sketch.key(scene, poses)
    lines = [part for line in key for part in textwrap.wrap(line, _COLUMNS)]
    tables = curves.tabulated(scene)
    height = _DRAWING + _LINE * len(lines) + curves.HEIGHT * len(tables)
    figure = style.page(height)
    figure.set_layout_engine("none")
    below = 1.0 - _DRAWING / height
    axes = figure.add_axes((0.0, below, 1.0, 1.0 - below))
    linkage_sketch.draw(axes, scene, poses)
    text = "\n".join(labels.literal(line) for line in lines)
    curves.draw(figure, tables, below, curves.HEIGHT / height)
    below = _LINE * len(lines) / height
    figure.text(0.02, below, text, va="top", fontsize=style.SMALL, linespacing=1.35)
    return figure
