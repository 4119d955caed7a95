"""The sections of the page on where results come from: scene, time of the ranks, how to do it again."""

import numpy as np

from hpcclear.report.html.content import Content
from hpcclear.report.html.markup import Number, PageTable, download, number, preformatted
from hpcclear.report.parts import SectionOf
from hpcclear.results.content import Results

_PARTS = ("busy", "idle", "compile", "write")
"""What a rank spends time on, variables of kind ``timing``."""


def scene(content: Content) -> list[object] | None:
    """The scene of the results."""
    text = content.attribute("scene")
    return [download("scene.toml", text)] if text else None


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
    return [*_fared(content, found), PageTable(header, rows, "Time of each rank, all stages")]


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
        steps += [words, PageTable(["item", "value"], rows, "Origin of these files")]
    return steps


PARTS = (
    SectionOf(10, "reproduce", "origin", "Versions and command", reproduce, each=True),
    SectionOf(20, "reproduce", "scene", "Scene", scene, each=True),
    SectionOf(30, "reproduce", "time", "Run time of the ranks", timing),
)
