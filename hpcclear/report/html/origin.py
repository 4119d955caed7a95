"""The sections of the page on where results come from: effects, time of the ranks, how to do it again."""

from collections.abc import Iterator, Mapping
from typing import Any

from hpcclear.base.errors import InputError
from hpcclear.report.html.content import Content
from hpcclear.report.html.markup import Number, Table, preformatted
from hpcclear.scene.loading import parse


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
    return [*first, preformatted(scene, "The whole scene file")]


def _flat(value: Any, path: str) -> Iterator[list[object]]:
    """Entries of nested tables, a row each."""
    if isinstance(value, Mapping):
        for key, inner in value.items():
            yield from _flat(inner, f"{path}.{key}")
    elif value is not None:
        yield [path, str(value)]


def timing(content: Content) -> list[object] | None:
    """How every rank spent its time."""
    found = content.get("timing")
    if found is None:
        return None
    parts = ("busy", "idle", "compile", "write")
    rows: list[list[object]] = []
    for k, rank in enumerate(found["rank"].to_numpy()):
        spent = [float(found[name].isel(rank=k).sum()) for name in parts]
        share = spent[0] / sum(spent) if sum(spent) > 0.0 else 0.0
        row: list[object] = [
            f"rank {rank}",
            *(Number(f"{s:.3g}") for s in spent),
            Number(f"{share:.0%}"),
        ]
        if "samples" in found:
            row.append(Number(int(found["samples"].isel(rank=k).sum())))
        rows.append(row)
    header = ["rank", "computing (s)", "waiting (s)", "compiling (s)", "writing (s)", "computing"]
    header += ["samples"] if "samples" in found else []
    return [Table(header, rows, "Time of each rank, all stages")]


def reproduce(content: Content) -> list[object]:
    """Command, versions and hash of the scene."""
    found = content.get("timing")
    steps: list[object] = []
    if found is not None:
        steps += ["The command that made these results:"]
        steps += [preformatted(str(found["command"].item()))]
    words = (
        "The same scene, seed and versions on the same type of processor give the same numbers to the last bit, on "
        "any number of ranks; `hpcclear reproduce` with this directory simulates some of them again and compares."
    )
    rows = [
        [label, content.attribute(name)]
        for label, name in (
            ("program", "source"),
            ("versions", "versions"),
            ("processor", "processor"),
            ("hash of the scene", "scene_hash"),
            ("after", "references"),
        )
        if content.attribute(name)
    ]
    if rows:
        steps += [words, Table(["what", "value"], rows, "Origin of these files")]
    return steps
