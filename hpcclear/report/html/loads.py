"""The page's section on the loads of the bearings: the numbers and remarks that the terminal prints after `simulate`."""

from collections.abc import Sequence

from hpcclear.base.outcome import Status
from hpcclear.report import bearings, noise
from hpcclear.report.figures import labels
from hpcclear.report.figures.style import JOINT_NAMES
from hpcclear.report.html.content import Content
from hpcclear.report.html.markup import Number, Table, quantity
from hpcclear.report.parts import SectionOf
from hpcclear.results.content import Results

_NO_ANGLE = "A dash instead of an angle: the peak lies between two stored instants, and the stored force there is lower."


def loads(content: Content) -> list[object] | None:
    """Return tables of the bearings of every stored response, torque and validity, impacts, then remarks; None without any."""
    valid = {
        name: one for name, one in content.responses.items() if Status(int(one["status"])).valid
    }
    found = {name: bearings.bearings(one) for name, one in valid.items()}
    parts: list[object] = []
    if any(found.values()):
        parts.append(_bearings(found))
    if any(bearings.degrees(one) == "–" for each in found.values() for one in each):
        parts.append(_NO_ANGLE)
    if valid:
        header = ["response", "largest torque", "mean torque", "objective f", "contact model"]
        rows = [_whole(name, one) for name, one in valid.items()]
        parts.append(_table(header, rows, "Drive, objective, and validity of the contact model"))
    impacts = [
        [_title(name), joint, *map(Number, cells)]
        for name, one in valid.items()
        for joint, *cells in noise.joints(one)
    ]
    if impacts:
        parts.append(_table(["response", *noise.HEADER], impacts, noise.TITLE))
        parts += [
            f"{_title(name)}: " * (len(valid) > 1)
            + "; ".join(f"{words} {text}" for words, text in frame)
            + "."
            for name, one in valid.items()
            if (frame := noise.frame(one))
        ]
    for name, one in content.responses.items():
        status = Status(int(one["status"]))
        if not status.valid:
            parts.append(f"{name}: failed, {status.message}. Remedy: {status.remedy}.")
    return [*parts, *_remarks(content)] or None


def _remarks(content: Content) -> list[str]:
    """Every remark once, with the responses that it is on."""
    found: dict[tuple[str, str], list[str]] = {}
    for name, one in content.responses.items():
        for remark in bearings.remarks(one):
            found.setdefault(remark, []).append(name)
    every = len(content.responses)

    def of(names: list[str]) -> str:
        where = "all responses" if len(names) == every else ", ".join(map(_title, names))
        return f" ({where})" if every > 1 else ""

    return [f"{label}{of(names)}: {text}." for (label, text), names in found.items()]


def _bearings(found: dict[str, list[bearings.Bearing]]) -> Table:
    """The bearings of all responses; a column of pressures where the length of a bearing is known."""
    header: list[object] = [
        "response", "joint", "peak force", "at crank angle", "mean force", "contact", "mean gap",
    ]  # fmt: skip
    pressed = bearings.pressures([one for each in found.values() for one in each])
    rows = [
        [*_row(name, one), *(Number(shown(one)) for _, shown in pressed)]
        for name, each in found.items()
        for one in each
    ]
    header += [title for title, _ in pressed]
    return _table(header, rows, "Bearings, over the averaged revolutions")


def _table(header: Sequence[object], rows: Sequence[Sequence[object]], caption: str) -> Table:
    """A table of responses; a single response is not named."""
    first = 0 if len({row[0] for row in rows}) > 1 else 1
    return Table(header[first:], [row[first:] for row in rows], caption)


def _title(name: str) -> str:
    """A response by the name of its design."""
    return "baseline" if name == "original" else name


def _row(name: str, one: bearings.Bearing) -> list[object]:
    short = JOINT_NAMES.get(one.joint)
    joint = f"{one.joint} ({short})" if short else one.joint
    return [
        _title(name), joint, quantity(one.peak, "N"), Number(bearings.degrees(one)), quantity(one.mean, "N"),
        Number(bearings.share(one.contact)), quantity(one.gap, "m"),
    ]  # fmt: skip


def _whole(name: str, found: Results) -> list[object]:
    drive = bearings.torque(found)
    half_width = found["objective_limit" if "regime" in found else "objective_uncertainty"]
    f, unit = float(found["objective"]), str(found["objective"].attrs["units"])
    shown = labels.with_half_width(f, float(half_width), unit)
    validity = bearings.validity(found) if bearings.bearings(found) else "no joint with clearance"
    return [
        _title(name),
        quantity(drive.peak, "N m"),
        quantity(drive.mean, "N m"),
        Number(shown),
        validity,
    ]


PARTS = (SectionOf(60, "loads", "Loads of the bearings", "parts.html", loads),)
