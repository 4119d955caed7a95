"""The first screen of responses: peak forces, the objective, the loads of the bearings, and whether the model is valid."""

from collections.abc import Iterator, Sequence

import numpy as np

from hpcclear.base.outcome import Flag, Regime, Status
from hpcclear.report import bearings
from hpcclear.report.figures import labels
from hpcclear.report.html.content import Content
from hpcclear.report.screen import Screen, ScreenRow, Tile, Trust, amber, green, red, trusted
from hpcclear.results.content import Results


def screen(response: Results, content: Content) -> Screen:
    """Return the first screen of a response."""
    name = next(name for name, one in content.responses.items() if one is response)
    status = Status(int(response["status"]))
    if not status.valid:
        said = f"The simulation failed: {response.attrs.get('ended', status.message)}"
        return Screen(said, doubt="no number of it is a result", steps=(status.remedy,))
    loads = bearings.bearings(response)
    header = ("bearing", "peak force", "at crank angle", "mean force", "contact")
    beyond = bool(int(response["flags"]) & Flag.BEYOND_HERTZ)
    design = "" if name == "response" else name.replace("original", "baseline")
    return Screen(
        _headline(response, loads),
        (f"f: {labels.objective(response)}", design),
        "the contact model is outside its range" if beyond else "",
        tuple(_tiles(response, loads)),
        header if loads else (),
        tuple(map(_row, loads)),
        trust=trusted(_trust(response, loads), beyond),
        steps=tuple(_steps(response)),
        figures=("response", "orbit") if loads else ("response",),
    )


def _row(one: bearings.Bearing) -> ScreenRow:
    peak, mean = (labels.quantity(force, "N") for force in (one.peak, one.mean))
    return ScreenRow(one.joint, (peak, bearings.degrees(one), mean, bearings.share(one.contact)))


def _headline(response: Results, loads: Sequence[bearings.Bearing]) -> str:
    """The largest force and where it acts, and f."""
    said = f"f {_f(response)} {_within(response)}".removesuffix(f" {labels.NOT_CHECKED}")
    if not loads:
        return labels.sentence(said, response)
    worst = max(loads, key=lambda one: one.peak)
    peak = f"Peak force {labels.quantity(worst.peak, 'N', 3)} in {worst.joint}"
    return labels.sentence(f"{peak}; {said}", response)


def half_width(response: Results) -> float:
    """Return the half-width of f of a response; NaN where nobody checked it."""
    return float(response["objective_limit" if "regime" in response else "objective_uncertainty"])


def _within(response: Results) -> str:
    """The half-width of f, over f where that is not 0, in words."""
    f, reach = float(response["objective"]), half_width(response)
    if not np.isfinite(reach):
        return labels.NOT_CHECKED
    unit = str(response["objective"].attrs["units"])
    shown = labels.quantity(100 * reach / abs(f), "%", 2) if f else labels.quantity(reach, unit)
    return f"± {shown}"


def _f(response: Results) -> str:
    f, half = float(response["objective"]), half_width(response)
    return labels.stated(f, f - half, f + half, str(response["objective"].attrs["units"]))[0]


def _tiles(response: Results, loads: Sequence[bearings.Bearing]) -> Iterator[Tile]:
    yield Tile("f", _f(response), within=_within(response))
    for one in sorted(loads, key=lambda one: -one.peak)[:1]:
        angle = "" if bearings.degrees(one) == "–" else f"at {bearings.degrees(one)}"
        yield Tile(f"peak force, {one.joint}", labels.quantity(one.peak, "N"), within=angle)
    drive = bearings.torque(response)
    mean = f"mean {labels.quantity(drive.mean, 'N m')}" if np.isfinite(drive.mean) else ""
    yield Tile("largest torque of the drive", labels.quantity(drive.peak, "N m"), within=mean)
    if np.isfinite(spread := float(response["objective_spread"])):
        shown = labels.quantity(spread, str(response["objective"].attrs["units"]), 2)
        yield Tile("cycle-to-cycle std. dev. of f", shown)


def _trust(response: Results, loads: Sequence[bearings.Bearing]) -> Iterator[Trust]:
    flags, place = int(response["flags"]), "bearings"
    if flags & Flag.BEYOND_HERTZ:
        why = bearings.outside(response) or "forces are indicative"
        yield red(f"Contact model outside its range: {why}", place)
    elif loads:
        yield green("Contact model within its range", place)
    if flags & Flag.TARGET_MISSED:
        yield red("f is not known to numerics.target_error", place)
    if flags & Flag.LATCHED:
        text = "A joint never left contact: f may depend on the integration tolerance"
        yield amber(text, place)
    f, reach = float(response["objective"]), half_width(response)
    if not np.isfinite(reach):
        yield amber("The interval of f is not known: set numerics.target_error", place)
    elif reach > bearings.SENSITIVE * abs(f):
        text = f"f is sensitive to initial conditions or tolerance: {_within(response)}"
        yield amber(text, place)
    else:
        yield green(f"f is known to {_within(response)}", place)
    if "regime" in response and (regime := Regime(int(response["regime"]))) is not Regime.UNJUDGED:
        level = green if regime is Regime.REGULAR else amber
        yield level(f"Motion: {regime.meaning}", place)
    for text in str(response.attrs.get("cautions", "")).splitlines():
        yield amber(text, place)


def _steps(response: Results) -> Iterator[str]:
    if int(response["flags"]) & Flag.BEYOND_HERTZ:
        yield "stiffer bearings or less load"
    if not np.isfinite(half_width(response)):
        yield "numerics.target_error, for a mean with a confidence interval"
