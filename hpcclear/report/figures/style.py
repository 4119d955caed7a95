"""The look of every figure: one column of a journal wide, colours that survive colour blindness and grey print.

Matplotlib is an extra and is imported when a figure is drawn, never with the package; figures are made without
pyplot, so nothing is registered globally and nothing needs closing.
"""

import contextlib
import functools
import inspect
import io
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextvars import ContextVar
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcclear.base.errors import InputError
from hpcclear.base.extras import installing
from hpcclear.results import files
from hpcclear.results.content import Results

Look = dict[str, Any]
"""Options of a curve, as matplotlib calls them."""

if TYPE_CHECKING:  # for all figures: no other module of this package names matplotlib's classes
    from matplotlib.axes import Axes as Axes
    from matplotlib.axis import Axis as Axis
    from matplotlib.figure import Figure as Figure

WIDTH = 85.0
"""Width of a figure, mm: one column, so that 7 pt in the file are 7 pt on the page."""

SMALL, NORMAL = 7.0, 7.5  # pt; ticks and legends, axis labels and titles

PALETTE = {
    "blue": "#0072b2",
    "vermilion": "#d55e00",
    "green": "#009e73",
    "purple": "#cc79a7",
    "sky": "#56b4e9",
    "orange": "#e69f00",
    "black": "#000000",
    "grey": "#767676",
}
"""Okabe and Ito's colours (without yellow, which is lost on white), distinguished by every eye."""

CYCLE = tuple(PALETTE.values())[:7]
DASHES = ("-", "--", "-.", ":", (0, (5, 1)), (0, (3, 1, 1, 1, 1, 1)), (0, (1, 1)))
"""Line styles in the order of `CYCLE`: a curve is never identified by its colour alone."""

MARKERS = ("o", "s", "^", "D", "v", "P", "X")
COLOURS = "viridis"  # perceptually even, the same order in grey
JOINT_NAMES = {"crank_rod": "O12", "rod_slider": "O23"}
"""Of the slider-crank's joints; those of a linkage have the names their users gave them."""

RC: dict[str, Any] = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],  # comes with matplotlib: equal figures everywhere
    "font.size": SMALL,
    "axes.labelsize": NORMAL,
    "axes.titlesize": NORMAL,
    "axes.titlelocation": "left",
    "figure.titlesize": NORMAL,
    "xtick.labelsize": SMALL,
    "ytick.labelsize": SMALL,
    "legend.fontsize": SMALL,
    "legend.title_fontsize": SMALL,
    "legend.frameon": False,
    "legend.handlelength": 1.8,
    "axes.linewidth": 0.6,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.linewidth": 0.4,
    "grid.color": "#dddddd",
    "lines.linewidth": 0.9,
    "lines.markersize": 3.0,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    "svg.hashsalt": "hpcclear",  # equal figures, equal bytes
    "svg.fonttype": "path",
    "pdf.fonttype": 42,
    "mathtext.fontset": "dejavusans",
}

_STAMPS: dict[str, tuple[bytes, dict[str, str | None]]] = {
    "png": (b"Software\x00hpcclear", {"Software": "hpcclear"}),
    "svg": (b"<dc:title>hpcclear</dc:title>", {"Date": None, "Creator": "hpcclear"}),
    "pdf": (b"/Creator (hpcclear)", {"CreationDate": None, "Creator": "hpcclear", "Producer": None}),
}  # fmt: skip
"""By kind what distinguishes our figures from a user's, and the metadata that it stands in."""


def matplotlib() -> Any:
    """The matplotlib module.

    Raises
    ------
    InputError
        It is not installed; the message names the extra that brings it.
    """
    try:
        import matplotlib as module
    except ModuleNotFoundError:
        reason = "figures are drawn with matplotlib, which is not installed"
        raise InputError("matplotlib", None, reason, installing("analysis")) from None
    return module


_given: "ContextVar[list[Axes] | None]" = ContextVar("axes of a caller", default=None)


def drawn(function: "Callable[..., Figure]") -> "Callable[..., Figure]":
    """Draw a figure in this style, whatever the user's settings, and leave those alone.

    Datasets of xarray, which a user gives, become results here. The function takes ``ax`` besides: axes of the caller, as many
    as the figure has panels, from above to below and from left to right. It draws into them, and returns their figure.
    """

    @functools.wraps(function)
    def styled(*args: object, ax: object = None, **kwargs: object) -> "Figure":
        token = _given.set(None if ax is None else list(np.ravel(np.asarray(ax, dtype=object))))
        try:
            with matplotlib().rc_context({**matplotlib().rcParamsDefault, **RC, "backend": "agg"}):
                named = {name: _results(one) for name, one in kwargs.items()}
                figure = function(*map(_results, args), **named)
                settle(_given.get() or figure.axes)
                return figure
        finally:
            _given.reset(token)

    signature = inspect.signature(function)
    given = inspect.Parameter("ax", inspect.Parameter.KEYWORD_ONLY, default=None)
    parameters = [*signature.parameters.values(), given]
    styled.__signature__ = signature.replace(parameters=parameters)  # type: ignore[attr-defined]
    return styled


def _results(given: Any) -> Any:
    """What a figure is given, with results in place of datasets of xarray, also of those in a mapping or list."""
    xarray = sys.modules.get("xarray")
    if xarray is None:
        return given
    if isinstance(given, xarray.Dataset):
        return Results.of(given)
    if isinstance(given, Mapping):
        return {name: _results(one) for name, one in given.items()}
    return [_results(one) for one in given] if isinstance(given, list) else given


def page(height: float) -> "Figure":
    """An empty figure of one column's width and `height` in mm; raises InputError where the caller gave axes."""
    matplotlib()
    if (given := _given.get()) is not None:
        reason = "this figure has a layout of its own"
        raise InputError("ax", len(given), reason, "Leave ax out")
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    pads = ConstrainedLayoutEngine(w_pad=0.03, h_pad=0.03, wspace=0.02, hspace=0.02)
    figure = Figure(figsize=(WIDTH / 25.4, height / 25.4), dpi=300, layout=pads)
    return figure


def grid(rows: int, columns: int, height: float, **options: object) -> "tuple[Figure, np.ndarray]":
    """A page of equal panels, or the caller's axes; axes of shape (rows, columns), options as for `Figure.subplots`.

    Raises
    ------
    InputError
        If the caller gave another number of axes.
    """
    if (given := _given.get()) is not None:
        if len(given) != rows * columns:
            reason = f"this figure has {rows * columns} panels"
            raise InputError("ax", len(given), reason, "Give as many axes, in an array or list")
        figure: Any = given[0].figure
        return figure, np.array(given, dtype=object).reshape(rows, columns)
    figure = page(height)
    return figure, figure.subplots(rows, columns, squeeze=False, **options)


def settle(axes: "Sequence[Axes] | np.ndarray") -> None:
    """Fix tick sizes now (matplotlib makes ticks late, by then the style is gone) and thin them, by the size of each panel."""
    for axis in np.ravel(np.asarray(axes, dtype=object)):
        for one in (axis, *axis.child_axes):
            one.tick_params(labelsize=SMALL, length=2.0, pad=2.0)
            one.tick_params(which="minor", labelsize=SMALL)
        box = axis.get_position()
        room = {"x": 7.0 * box.width, "y": box.height * axis.figure.get_figheight() * 25.4 / 6.0}
        for scale, ticks in room.items():
            lines = getattr(axis, f"{scale}axis")
            lines.get_offset_text().set_fontsize(SMALL)
            if type(lines.get_major_locator()).__name__ == "AutoLocator":
                axis.locator_params(axis=scale, nbins=int(np.clip(round(ticks), 3, 5)))


def look(k: int) -> Look:
    """Colour, line style and marker of curve k of several: no two of the first 49 have all three in common."""
    at = k % len(CYCLE)
    return {
        "color": CYCLE[at],
        "ls": DASHES[(at + k // len(CYCLE)) % len(DASHES)],
        "marker": MARKERS[at],
    }


def legend(
    figure: "Figure", panels: "Axes | Sequence[Axes]", place: str, ncols: int = 2, **options: Any
) -> None:
    """One legend for all panels, ``"upper"`` or ``"lower"``: what those given have, each word once."""
    entries: dict[str, Any] = {}
    for panel in np.ravel(np.asarray(panels, dtype=object)):
        entries |= {word: one for one, word in zip(*panel.get_legend_handles_labels(), strict=True)}
    where: Any = f"outside {place} center"
    figure.legend([*entries.values()], [*entries], loc=where, ncols=ncols, **options)


@contextlib.contextmanager
def _laid_out(figure: "Figure", dpi: int) -> Iterator[None]:
    """The figure with its parts in place for so many dots, for which matplotlib would draw all of it once more."""
    engine, dots = figure.get_layout_engine(), figure.get_dpi()
    if engine is None:
        yield
        return
    figure.set_dpi(dpi)
    engine.execute(figure)
    figure.set_layout_engine("none")
    try:
        yield
    finally:
        figure.set_layout_engine(engine)
        figure.set_dpi(dots)


def render(figure: "Figure", kind: str = "png", dpi: int = 300) -> bytes:
    """The bytes of a figure as ``png``, ``svg`` or ``pdf``; equal figures give equal bytes."""
    buffer = io.BytesIO()
    with (
        matplotlib().rc_context(RC),
        _laid_out(figure, dpi) if kind == "png" else contextlib.nullcontext(),
    ):
        figure.savefig(buffer, format=kind, dpi=dpi, metadata=_STAMPS[kind][1])
    return buffer.getvalue()


def save(figure: "Figure", path: str | Path) -> Path:
    """Write a figure whole, in the format its suffix names.

    Parameters
    ----------
    path : path
        Ends in ``.png``, ``.svg`` or ``.pdf``.

    Returns
    -------
    Path
        Where it stands.

    Raises
    ------
    InputError
        The suffix is another one, or the place cannot be written to.
    StorageError
        The disk is full or fails.
    """
    place = Path(path)
    kind = place.suffix.lower().removeprefix(".")
    if kind not in _STAMPS:
        remedy = "End the name in .png, .svg or .pdf"
        raise InputError("figure", str(place), "figures are png, svg or pdf", remedy)
    files.write_bytes(place, render(figure, kind), _STAMPS[kind][0])
    return place
