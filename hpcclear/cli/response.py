"""What `simulate` prints: loads of the bearings first, then torque, validity and objective, then warnings."""

from pathlib import Path

import numpy as np
from rich import box
from rich.table import Table

from hpcclear.base.outcome import Status
from hpcclear.cli.terminal import console, fitting, objective_of, quantity, remark, table
from hpcclear.dynamics.evaluation.steady.wording import in_a_line
from hpcclear.report import bearings, noise
from hpcclear.report.figures import labels, motion
from hpcclear.results.content import Results
from hpcclear.scene.describing import TITLE


def describe_response(response: Results, output: Path, seconds: float | None = None) -> None:
    """Print the loads, objective and warnings of one response (kind ``response``), and its file.

    `seconds`: run time, printed with a steady mean.
    """
    out = console()
    status = Status(int(response["status"]))
    loads = bearings.bearings(response)
    if status.valid and loads:
        out.print(_bearing_table(loads, gaps=response.attrs.get("references") == TITLE))
        if impacts := noise.joints(response):
            out.print(_impact_table(impacts))
    out.print(table("Response", [*_status_rows(response), *_rows(response, seconds)]))
    for label, text in bearings.remarks(response):
        out.print(remark(label, text))
    out.print(f"written  {output}")


def _status_rows(response: Results) -> list[tuple[str, str]]:
    """How the simulation ended, and for a failure its remedy."""
    status = Status(int(response["status"]))
    said = f"{status.name.lower()}: {status.message}"
    rows = [("status", response.attrs.get("ended", said))]
    return rows if status is Status.OK else [*rows, ("remedy", status.remedy)]


def _impact_table(rows: list[list[str]]) -> Table:
    """What a revolution has of impacts, a row for each joint."""
    made = Table(title=noise.TITLE, title_justify="left", box=box.SIMPLE_HEAD, pad_edge=False)
    for header in noise.HEADER:
        made.add_column(header, justify="left" if header == "joint" else "right", overflow="fold")
    for row in rows:
        made.add_row(*map(fitting, row))
    return made


def _bearing_table(found: list[bearings.Bearing], *, gaps: bool) -> Table:
    """Peak and mean force, angle of the peak and contact of each joint, and of the paper's mechanism the mean gap."""
    made = Table(
        title="Bearings, over the averaged revolutions", title_justify="left", box=box.SIMPLE_HEAD,
        pad_edge=False,
    )  # fmt: skip
    pressed = bearings.pressures(found)[-1:]  # one: eighty columns hold no more
    made.add_column("joint", overflow="fold")
    for header in ("peak force", "at crank angle", "mean force", "contact", *["mean gap"] * gaps):
        made.add_column(header, justify="right")
    for header, _ in pressed:
        made.add_column(header, justify="right")
    for one in found:
        row = [
            one.joint,
            quantity(one.peak, "N"),
            bearings.degrees(one),
            quantity(one.mean, "N"),
            bearings.share(one.contact),
            *[quantity(one.gap, "m")] * gaps,
            *(shown(one) for _, shown in pressed),
        ]
        made.add_row(*map(fitting, row))
    return made


def _rows(response: Results, seconds: float | None) -> list[tuple[str, str]]:
    """Everything about the whole mechanism, the objective after the loads."""
    rows = []
    status = Status(int(response["status"]))
    if status.valid:
        shown = fitting(bearings.torque_words(bearings.torque(response)))
        rows += [(name, fitting(text)) for name, text in noise.frame(response)]
        rows += [("torque of the drive", shown), *_crank(response)]
        rows += [("peak between instants", text) for text in _between_instants(response)]
        if bearings.bearings(response):
            rows.append(("contact model", bearings.validity(response)))
        if "regime" in response:
            rows.append(("f, steady mean", in_a_line(response, seconds)))
    f, spread = float(response["objective"]), float(response["objective_spread"])
    words, unit = objective_of(response)
    half_width = float(
        response["objective_limit" if "regime" in response else "objective_uncertainty"]
    )
    shown = fitting(labels.with_half_width(f, half_width, unit)) if np.isfinite(f) else "nan"
    rows.append(("objective f", f"{shown}: {words}"))
    if np.isfinite(spread):
        rows.append(("cycle-to-cycle std. dev.", quantity(spread, unit, 2)))
    return [*rows, ("force evaluations", f"{int(response['rhs_evaluations'])}")]


def _between_instants(response: Results) -> list[str]:
    """Joints whose peak force lies between two stored instants, with the largest stored value."""
    if "transient_turns" not in response.attrs:
        return []
    return [
        f"{one.joint}: angle not known; largest stored value of the averaged revolutions "
        f"{quantity(one.stored, 'N')} at {np.degrees(one.angle):.0f} deg. "
        "Raise output.instants_per_revolution"
        for one in bearings.bearings(response)
        if one.between_instants
    ]


def _crank(response: Results) -> list[tuple[str, str]]:
    """Speed of a free crank from start to end, and how it drifts from one revolution to the next."""
    if "crank_speed" not in response:
        return []
    speed = response["crank_speed"].to_numpy() * 30.0 / np.pi
    turns, time = motion.turns(response), response["time"].to_numpy()
    if np.ptp(turns * time[-1] - turns[-1] * time) <= 1e-9 * turns[-1] * time[-1]:
        return []  # it is prescribed
    ends = np.interp(np.arange(np.ceil(turns[0]), turns[-1] + 1e-9), turns, time)
    shown = f"{speed[0]:.5g} rpm at the start, {speed[-1]:.5g} rpm at the end"
    means = 60.0 / np.diff(ends)
    if len(means) > 1:
        shown += f"; drift of the last revolution {means[-1] - means[-2]:+.2g} rpm"
    return [("crank speed", shown)]
