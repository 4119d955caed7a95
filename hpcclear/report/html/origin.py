"""The sections of the page on where results come from: effects, time of the ranks, how to do it again."""

from collections.abc import Iterator, Mapping

import numpy as np

from hpcclear.base.errors import InputError
from hpcclear.report.figures import labels
from hpcclear.report.figures import timing as figures
from hpcclear.report.html import gallery
from hpcclear.report.html.content import Content
from hpcclear.report.html.markup import Number, Table, folded, number, preformatted
from hpcclear.report.parts import SectionOf
from hpcclear.results.content import Results
from hpcclear.scene.loading import parse
from hpcclear.scene.paths import quantities

_PARTS = ("busy", "idle", "compile", "write")
"""What a rank spends time on, variables of kind ``timing``."""


def effects(content: Content) -> list[object] | None:
    """Which effects the scene has on, and the scene itself."""
    scene = content.attribute("scene")
    if not scene:
        return None
    try:
        entries = parse(scene, "scene")
    except InputError:
        first: list[object] = [
            "The scene stored with the results is not readable as TOML; it is shown as it is."
        ]
    else:
        shown = ("drive", "joints", "effects", "numerics")
        rows = [row for name in shown for row in _flat(entries.get(name), name)]
        words = "Effects that are not listed were disabled."
        first = [words, Table(["entry", "value"], rows, "Settings of the model")]
    return [*first, folded("The whole scene file", [preformatted(scene)])]


def _flat(value: object, path: str) -> Iterator[list[object]]:
    """Entries of nested tables, a row each."""
    if isinstance(value, Mapping):
        for key, inner in value.items():
            yield from _flat(inner, f"{path}.{key}")
    elif value is not None:
        yield [path, f"{value} {_unit(path, value)}".rstrip()]


def _unit(path: str, value: object) -> str:
    """SI unit of a plain number of a scene, "" where its text has one or it has none."""
    plain = isinstance(value, int | float) and not isinstance(value, bool)
    unit = quantities()[path].unit if plain and path in quantities() else ""
    return labels.pretty(unit) if unit else ""


def timing(content: Content) -> list[object] | None:
    """How every rank spent its time."""
    found = content.get("timing")
    if found is None:
        return None
    rows: list[list[object]] = []
    for k, rank in enumerate(found["rank"].to_numpy()):
        spent = [float(np.sum(found[name][k])) for name in _PARTS]
        share = spent[0] / sum(spent) if sum(spent) > 0.0 else 0.0
        row: list[object] = [
            f"rank {rank}",
            *(Number(f"{s:.3g}") for s in spent),
            Number(f"{share:.0%}"),
        ]
        if "samples" in found:
            row.append(Number(int(np.sum(found["samples"][k]))))
        rows.append(row)
    header = ["rank", "computing (s)", "waiting (s)", "compiling (s)", "writing (s)", "computing"]
    header += ["samples"] if "samples" in found else []
    parts: list[object] = [
        *_fared(content, found),
        Table(header, rows, "Time of each rank, all stages"),
    ]
    picture = gallery.picture(
        figures.timing_figure, found, figures.PARTS[0].captioned({"timing": found})
    )
    return [*parts, picture] if picture else parts


def _fared(content: Content, found: Results) -> list[object]:
    """What the run took, in a sentence or two."""
    spent = {name: float(np.sum(found[name])) for name in _PARTS}
    total, count = sum(spent.values()) or 1.0, found.sizes["rank"]
    wall = float(np.sum([found[name].to_numpy().sum(1) for name in _PARTS], axis=0).max())
    words = (
        f"{count} {'rank' if count == 1 else 'ranks'} worked on it for {number(wall, 3)} s, "
        f"{spent['busy'] / total:.0%} of {'its' if count == 1 else 'their'} time on computing."
    )
    rates = []
    if "samples" in found and float(np.sum(found["busy"])) > 0.0:
        simulated = found["samples"].to_numpy()
        rate = float(simulated.sum() / found["busy"][simulated > 0].sum())
        rates.append(f"{number(rate, 3)} samples per second and core")
    if (samples := content.get("samples")) is not None:
        rates.append(f"{number(float(np.sum(samples['rhs_evaluations'])), 3)} force evaluations")
    return [words, f"{'; '.join(rates).capitalize()}."] if rates else [words]


def reproduce(content: Content) -> list[object]:
    """Command, versions and hash of the scene."""
    found = content.get("timing")
    steps: list[object] = []
    if found is not None:
        steps += ["The command that made these results:"]
        steps += [preformatted(str(found["command"].item()))]
    words = (
        "The same scene, seed and versions on the same type of processor give bit-identical results, on "
        "any number of ranks. `hpcclear reproduce` with this directory simulates some of them again and compares."
    )
    rows = [
        [label, content.attribute(name)]
        for label, name in (
            ("program", "source"),
            ("versions", "versions"),
            ("processor", "processor"),
            ("hash of the scene", "scene_hash"),
            ("method of", "references"),
        )
        if content.attribute(name)
    ]
    if rows:
        steps += [words, Table(["item", "value"], rows, "Origin of these files")]
    return steps


PARTS = (
    SectionOf(120, "effects", "Effects and settings", "parts.html", effects, each=True),
    SectionOf(130, "reproduce", "How to reproduce", "parts.html", reproduce, each=True),
    SectionOf(150, "time", "Run time of the ranks", "parts.html", timing, folded=True),
)
