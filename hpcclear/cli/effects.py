"""The output of `effects`: the change by each effect, and the cheapest scene within the tolerance."""

import json
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import tomli_w
from rich import box
from rich.table import Table

from hpcclear.base.errors import InputError
from hpcclear.base.plain import plain
from hpcclear.base.units import UnitError, to_si
from hpcclear.cli.printing import _load
from hpcclear.cli.terminal import console, fitting, objective_of, table
from hpcclear.ranks.stopping import Exit
from hpcclear.report.figures.effects import (
    Saving,
    Times,
    named,
    saving,
    seconds_of,
    shown,
    statements,
)
from hpcclear.report.figures.labels import paired
from hpcclear.results import dataset
from hpcclear.results.content import Results
from hpcclear.scene import Scene
from hpcclear.scene.loading import parse

if TYPE_CHECKING:
    from hpcclear.ensemble.session import Finished


def tolerance_of(words: str) -> float:
    """A relative change: 0.01, or 1%.

    Raises
    ------
    InputError
        If it is no number.
    """
    try:
        return float(words)
    except ValueError:
        pass
    try:
        return to_si(words, "")
    except UnitError as error:
        raise InputError("--tolerance", words, error.reason, "Write 1%, or 0.01") from None


def describe(found: "Finished", scene: Scene, file: Path) -> int:
    """Print changes, verdicts and the reduced scene; the exit code."""
    out, content = console(), found.content
    seconds = seconds_of(_times(found.timing))
    tolerance = f"{100 * float(content.attrs['tolerance']):g} %"
    out.print(_changes(content, seconds, tolerance))
    for text in statements(content, seconds):
        out.print(fitting(text))
    for name, reason in json.loads(content.attrs["kept"]).items():
        out.print(f"{name} is kept: {reason}")
    what, _ = objective_of(content)
    rows = [
        ("f", what),
        (
            "confidence",
            f"{float(content.attrs['confidence']):.0%} intervals, from averages over the same points",
        ),
        ("samples", f"{int(np.sum(content['samples']))}, {_failed(content)} failed"),
        ("time", _rounds(saving(content, 1, seconds).rounds)),
    ]
    out.print(table("Effect screening", rows))
    out.print(table("Run", _load(found)))
    out.print(f"effects  {found.output}")
    out.file.write("\n" + plain(recommendation(content, scene, file, tolerance, seconds)))
    return Exit.DONE


def _rounds(count: int) -> str:
    if count == 0:
        return "estimated from evaluations of the equations of motion"
    return f"processor time of a sample, 95 % intervals from {count} paired measurements"


def _times(place: Path) -> Results | None:
    try:
        return dataset.read(place, "timing")
    except InputError:
        return None  # or written over by another command: savings are estimated from evaluations


def _failed(content: Results) -> str:
    count = int(np.sum(content["failed"]))
    return str(count) if count else "none"


def _changes(content: Results, seconds: Times, tolerance: str) -> Table:
    """A row a variant: what is off, changes with confidence intervals, time, verdict."""
    what = f"Changes in % with effects disabled, against all enabled; tolerance {tolerance}"
    made = Table(title=what, title_justify="left", box=box.SIMPLE_HEAD, pad_edge=False)
    made.add_column("off", overflow="fold")
    kept = [k for k in range(content.sizes["response"]) if _is_reported(content, k)]
    labels = [str(content["response"].to_numpy()[k]) for k in kept]
    for name in labels:
        words = {"mean": "mean f", "deviation": "std. dev."}
        made.add_column(words.get(name, name), justify="right", no_wrap=True)
    made.add_column("time", justify="right", no_wrap=True)
    made.add_column("within", overflow="fold")
    for k in range(1, content.sizes["variant"]):
        one = content.isel(variant=k)
        changes = [
            shown(float(one["change"][r]), float(one["limit"][r])).removesuffix(" %") for r in kept
        ]
        verdict = ("yes", "no", "?")[int(one["decision"])]
        row = [
            " + ".join(named(content, k)),
            *changes,
            _longer(saving(content, k, seconds)),
            verdict,
        ]
        made.add_row(*(fitting(text) for text in row))
    return made


def _longer(saved: Saving) -> str:
    """How much longer a sample takes, in per cent."""
    share = -100 * saved.share
    if not np.isfinite(saved.half):
        return f"{share:+.0f}"
    text = paired(share, 100 * saved.half)
    return text if text.startswith("-") else f"+{text}"


def _is_reported(content: Results, response: int) -> bool:
    return bool(np.isfinite(content["change"].isel(response=response)[1:]).any())


def recommendation(
    content: Results, scene: Scene, file: Path, tolerance: str, seconds: Times
) -> str:
    """The tables of the scene that change, as TOML to paste, with what they save."""
    chosen = int(np.argmax(content["recommended"].to_numpy()))
    if chosen == 0:
        return f"# No effect of {file} can be neglected within {tolerance}.\n"
    reduced = parse(content.attrs["reduced_scene"], "reduced scene")
    whole = scene.resolved()
    changed = {key: value for key, value in reduced.items() if whole.get(key) != value}
    saved = saving(content, chosen, seconds)
    gone = [key for key in whole if key not in reduced]
    lines = [
        f"# Within {tolerance}, without {', '.join(named(content, chosen))}: "
        f"run time saved: {saved.words}"
        + (f", {saved.speed_up} times as fast." if saved.share > 0.0 else "."),
        f"# These tables stand in place of those of {file}"
        + (f"; [{'], ['.join(gone)}] goes." if gone else "."),
    ]
    return "\n".join(lines) + "\n" + tomli_w.dumps(changed)
