"""The section on the loads of the bearings in every stored response: all numbers and remarks of a simulation."""

from collections.abc import Mapping, Sequence

import numpy as np

from hpcclear.base.outcome import Regime, Status
from hpcclear.report import bearings
from hpcclear.report.figures import labels, motion, noise
from hpcclear.report.html.content import Content
from hpcclear.report.html.markup import Number, PageTable, quantity
from hpcclear.report.merit import recommended, role
from hpcclear.report.parts import SectionOf
from hpcclear.report.screens.response import half_width
from hpcclear.results.content import Results


def loads(content: Content) -> list[object] | None:
    """Return tables of the bearings of every stored response, torque, impacts, then remarks; None without any."""
    verified = content.files.get("verification")
    best = "" if verified is None else recommended(verified)
    titles = {"original": "baseline"} | ({} if verified is None else {best: role(verified)})
    every = {titles.get(name, name): one for name, one in content.responses.items()}
    chosen = titles.values() if best else ()
    shown = {name: one for name, one in every.items() if name in chosen} or every
    valid = {name: one for name, one in shown.items() if Status(int(one["status"])).valid}
    found = {name: bearings.bearings(one) for name, one in valid.items()}
    parts: list[object] = []
    if any(found.values()):
        parts.append(_bearings(found))
    if valid:
        header = ["response", "largest torque", "mean torque", "objective f"]
        rows = [_whole(name, one) for name, one in valid.items()]
        parts.append(_table(header, rows, "Drive and objective"))
    impacts, further = list[list[object]](), list[list[object]]()
    for name, one in valid.items():
        impacts += [[name, joint, *map(Number, cells)] for joint, *cells in noise.joints(one)]
        further += [[name, *row] for row in _further(one, len(valid) == 1)]
    if impacts:
        parts.append(_table(["response", *noise.HEADER], impacts, "Impacts, mean per revolution"))
    if further:
        parts.append(_table(["response", "quantity", "value"], further, "Further results"))
    for name, one in every.items():
        status = Status(int(one["status"]))
        if not status.valid:
            parts.append(f"{name}: failed, {status.message}. {status.remedy}.")
    return [*parts, *_remarks(shown)] or None


def _remarks(shown: Mapping[str, Results]) -> list[str]:
    """Every remark once, with the responses that it is on."""
    found: dict[tuple[str, str], list[str]] = {}
    for name, one in shown.items():
        for remark in bearings.remarks(one):
            found.setdefault(remark, []).append(name)
    every = len(shown)

    def of(names: list[str]) -> str:
        where = "all responses" if len(names) == every else ", ".join(names)
        return f" ({where})" if every > 1 else ""

    return [f"{label}{of(names)}: {text}." for (label, text), names in found.items()]


def _bearings(found: dict[str, list[bearings.Bearing]]) -> PageTable:
    """The bearings of all responses; a column of pressures where the length of a bearing is known."""
    every = [(name, one) for name, each in found.items() for one in each]
    pressed = bearings.pressures([one for _, one in every])
    header = ["response", "joint", "peak force", "at crank angle", "mean force"]
    header += ["contact", "mean gap", *(title for title, _ in pressed)]
    rows = []
    for name, one in every:
        cells = [quantity(one.peak, "N"), Number(bearings.degrees(one)), quantity(one.mean, "N")]
        cells += [Number(bearings.share(one.contact)), quantity(one.gap, "m")]
        rows.append([name, one.joint, *cells, *(Number(shown(one)) for _, shown in pressed)])
    return _table(header, rows, "Bearings, over the averaged revolutions")


def _table(header: Sequence[object], rows: Sequence[Sequence[object]], caption: str) -> PageTable:
    """A table of responses; a single response is not named."""
    first = 0 if len({row[0] for row in rows}) > 1 else 1
    return PageTable(header[first:], [row[first:] for row in rows], caption)


def _whole(name: str, found: Results) -> list[object]:
    drive = bearings.torque(found)
    f, unit = float(found["objective"]), str(found["objective"].attrs["units"])
    known = Number(labels.with_half_width(f, half_width(found), unit))
    return [name, quantity(drive.peak, "N m"), quantity(drive.mean, "N m"), known]


def _further(response: Results, alone: bool) -> list[tuple[str, str]]:
    """What else is known of a response; of one that stands alone all of it."""
    rows = list(noise.frame(response))
    if not alone:
        return rows
    rows += _crank(response)
    if "regime" in response:
        regime = Regime(int(response["regime"]))
        period = float(response["period"])
        known = f", period {period:.0f}" if np.isfinite(period) else ""
        text = f"{regime.meaning}{known}; {int(response['steady_revolutions'])} revolutions"
        rows.append(("motion", text))
    return [*rows, ("force evaluations", f"{int(response['rhs_evaluations'])}")]


def _crank(response: Results) -> list[tuple[str, str]]:
    """Speed of a free crank from start to end, and how it drifts from one revolution to the next."""
    if "crank_speed" not in response:
        return []
    speed = response["crank_speed"].values * 30.0 / np.pi
    turns, time = motion.turns(response), response["time"].values
    if np.ptp(turns * time[-1] - turns[-1] * time) <= 1e-9 * turns[-1] * time[-1]:
        return []  # it is prescribed
    ends = np.interp(np.arange(np.ceil(turns[0]), turns[-1] + 1e-9), turns, time)
    shown = f"{speed[0]:.5g} rpm at the start, {speed[-1]:.5g} rpm at the end"
    means = 60.0 / np.diff(ends)
    if len(means) > 1:
        shown += f"; drift of the last revolution {means[-1] - means[-2]:+.2g} rpm"
    return [("crank speed", shown)]


PARTS = (SectionOf(10, "bearings", "loads", "Loads of the bearings", loads),)
