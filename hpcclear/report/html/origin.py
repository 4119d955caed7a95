"""The sections of the page on where results come from: scene, time of the ranks, how to do it again."""

import json

import numpy as np

from hpcclear.report.figures import curves, labels
from hpcclear.report.html.content import Content
from hpcclear.report.html.markup import PageTable, download, number, preformatted
from hpcclear.report.parts import SectionOf
from hpcclear.results.content import Results, text_in

_PARTS = {"busy": "computing", "idle": "waiting", "compile": "compiling", "write": "writing"}
"""What a rank spends time on, variables of kind ``timing``, in words."""


_ITEMS = {
    "program": "source",
    "versions": "versions",
    "processor": "processor",
    "hash of the scene": "scene_hash",
    "method of": "references",
}
"""Attributes of files that say where they come from, by their words."""


def inputs(content: Content) -> list[object] | None:
    """Fits, files and curves of the scene by their names, curves with a small drawing."""
    if (scene := content.scene) is None:
        return None
    read = {one[0]: one[1:] for one in json.loads(content.attribute("readings") or "[]")}
    rows: list[list[object]] = []
    for one in curves.tabulated(scene):
        name = read.pop(one.key)[0] if one.key in read else f"{len(one.rows)} points"
        values = [value + 0.0 for _, value in one.rows]  # without a sign of zero
        words = labels.between(min(values), max(values), one.unit)
        drawn = {"kind": "curve", "words": words, "points": curves.outline(one)}
        rows.append([labels.entry(one.key), name, drawn])
    rows += [[labels.entry(path), *one] for path, one in read.items()]
    header = ["entry", "as written", "value"]
    return [PageTable(header, rows, "Fits, files and curves")] if rows else None


def scene(content: Content) -> list[object] | None:
    """The scene of the results."""
    text = content.attribute("scene")
    return [download("scene.toml", text)] if text else None


def timing(found: Results, content: Content) -> list[object]:
    """How the ranks spent their time, in sentences; the figure of it has each rank."""
    spent = {word: float(np.sum(found[name])) for name, word in _PARTS.items()}
    total, count = sum(spent.values()) or 1.0, found.sizes["rank"]
    wall = float(np.sum([found[name].values.sum(1) for name in _PARTS], axis=0).max())
    shares = ", ".join(f"{word} {100 * part / total:.0f} %" for word, part in spent.items())
    words = f"{count} {'rank' if count == 1 else 'ranks'}, {number(wall, 3)} s: {shares}."
    if (samples := content.files.get("samples")) is None:
        return [words]
    return [words, f"{number(float(np.sum(samples['rhs_evaluations'])), 3)} force evaluations."]


def reproduce(content: Content) -> list[object]:
    """Command, versions and hash of the scene."""
    found = content.files.get("timing")
    steps: list[object] = []
    if found is not None:
        steps += ["The command that made these results:", preformatted(text_in(found, "command"))]
    words = "`hpcclear reproduce` with this directory simulates some results again and compares, bit for bit."
    items = {label: content.attribute(name) for label, name in _ITEMS.items()}
    rows = [[label, text] for label, text in items.items() if text]
    table = PageTable(["item", "value"], rows, "Origin of these files")
    return [*steps, words, table] if rows else steps


PARTS = (
    SectionOf(10, "reproduce", "origin", "Versions and command", reproduce, each=True),
    SectionOf(15, "reproduce", "inputs", "Inputs", inputs, each=True),
    SectionOf(20, "reproduce", "scene", "Scene", scene, each=True),
    SectionOf(30, "reproduce", "time", "Run time of the ranks", timing, "timing"),
)
