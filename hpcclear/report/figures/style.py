"""What every figure is drawn with: results as a user gives them, its page and panels, one for each of several responses,
legends, and files.

Matplotlib is an extra and is imported when a figure is drawn, never with the package; figures are made without
pyplot, so nothing is registered globally and nothing needs closing. Colours and sizes are those of
`hpcclear.report.figures.theme`, or what a user wants (`hpcclear.report.figures.printing`).
"""

import functools
import inspect
import io
from collections.abc import Callable, Mapping, Sequence
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast
from weakref import WeakKeyDictionary

import numpy as np

from hpcclear.base.errors import InputError
from hpcclear.base.holding import holding
from hpcclear.report.figures import labels
from hpcclear.report.figures.printing import Printing, renamed, wanted
from hpcclear.report.figures.theme import (
    DASHES as DASHES,
    MM,
    NAMES as NAMES,
    RC,
    WIDTH,
    Look as Look,
    categories as categories,
    colour as colour,
    look as look,
    matplotlib,
)
from hpcclear.report.parts import FigureOf
from hpcclear.results import files
from hpcclear.results.content import Results
from hpcclear.results.names import DESIGN_VARIABLES, KINDS


def taken(kind: str, given: Any) -> Any:
    """Return results for a figure's argument, called as the `kind` of its file. Raises InputError of other arrays."""
    if hasattr(given, "data_vars"):
        return Results.of(given)
    if not isinstance(given, Mapping) or kind not in (*KINDS, "responses"):
        return given
    if all(isinstance(one, Mapping | Results) for one in given.values()):
        return {str(name): taken(kind, one) for name, one in given.items()}
    return _of_arrays(kind, {str(name): np.asarray(one) for name, one in given.items()})


def _of_arrays(kind: str, arrays: Mapping[str, np.ndarray]) -> Results:
    """Results of arrays that are named as in a file of the kind; places along dimensions without a coordinate are numbered."""
    from hpcclear.results.dataset import dataset

    table = KINDS[kind]
    data = {name: one for name, one in arrays.items() if name not in table.coords}
    coords = {name: one for name, one in arrays.items() if name in table.coords}
    for name, one in data.items():
        dims = table.data[name].dims if name in table.data else table.design_dims or ()
        for dim, size in zip(dims, one.shape, strict=False):
            number = np.arange(1, size + 1)
            words = table.coords[dim].dtype == "text"
            coords.setdefault(dim, number.astype(str) if words else number)
    units = {name: "1" for name in data if name not in DESIGN_VARIABLES}
    try:
        return dataset(kind, coords, data, units=units, whole=False)
    except ValueError as error:
        reason = f"the arrays are not those of a {kind} ({error})"
        remedy = "Name them as variables of such a file, of the same shapes"
        raise InputError(kind, sorted(arrays), reason, remedy) from None


def several(response: object) -> dict[str, Results]:
    """Return several responses by the names of their designs; none where there is only one."""
    if isinstance(response, Results) and "design" in response.sizes:
        names = response.labels.get("design", np.arange(1, response.sizes["design"] + 1))
        return {str(name): response.isel(design=k) for k, name in enumerate(names)}
    return response if isinstance(response, dict) else {}


if TYPE_CHECKING:  # for all figures: no other module of this package names matplotlib's classes
    from matplotlib.axes import Axes as Axes
    from matplotlib.axis import Axis as Axis
    from matplotlib.figure import Figure as Figure
    from matplotlib.legend import Legend

    Panels = dict[tuple[int, str], Axes]
    """Axes by the number of the column of results, and the name of the panel."""

_STAMPS: dict[str, tuple[bytes, dict[str, str | None]]] = {
    "png": (b"Software\x00hpcclear", {"Software": "hpcclear"}),
    "svg": (b"<dc:title>hpcclear</dc:title>", {"Date": None, "Creator": "hpcclear"}),
    "pdf": (b"/Creator (hpcclear)", {"CreationDate": None, "Creator": "hpcclear", "Producer": None}),
}  # fmt: skip
"""By kind what distinguishes our figures from a user's, and the metadata that it stands in."""


_given: "ContextVar[list[Axes] | None]" = ContextVar("axes of a caller", default=None)
_users: "WeakKeyDictionary[Figure, Printing]" = WeakKeyDictionary()
"""What a figure was drawn with: some settings count when it is written."""


@dataclass
class _Columns:
    """A page on which several results stand beside each other, each in the same panels."""

    names: list[str]
    here: int = 0
    """Which of them is drawn."""
    figure: "Figure | None" = None
    panels: "Panels" = field(default_factory=dict)


column: ContextVar[float] = ContextVar("width of a figure whose user wants none, mm", default=WIDTH)
_columns: ContextVar[_Columns | None] = ContextVar("results beside each other", default=None)


def drawn(function: "Callable[..., Figure]") -> "Callable[..., Figure]":
    """Draw a figure in this style, whatever the user's settings, and leave those alone.

    Results are given as a dataset of xarray or as plain arrays by their names; an argument is called as the kind of its file.
    Of several responses (a mapping by their names) a figure of one ``response`` has a column for each. The function takes
    ``ax`` besides: axes of the caller, as many as the figure has panels, from above to below and from left to right. It draws
    into them, and returns their figure.
    """
    signature = inspect.signature(function)

    @functools.wraps(function)
    def styled(*args: object, ax: object = None, **kwargs: object) -> "Figure":
        bound = signature.bind(*args, **kwargs).arguments
        values = {name: taken(name, one) for name, one in bound.items()}
        user = wanted.get()
        given = None if ax is None else list(np.ravel(np.asarray(ax, dtype=object)))
        default = matplotlib().rcParamsDefault
        usual = {"figure.figsize": (column.get() * MM, 60.0 * MM)}
        rc = {**default, **RC, **usual, **user.rc, "text.usetex": False, "backend": "agg"}
        try:
            with holding(_given, given), matplotlib().rc_context(rc), labels.called() as paths:
                every = several(values.get("response"))
                figure = _beside(function, every, values) if every else function(**values)
                panels = _given.get() or figure.axes
                renamed(figure, panels, paths, user)
                settle(panels)
                if ax is None:
                    _users[figure] = user
                return figure
        except KeyError as error:
            if all(isinstance(one, Results) for one in bound.values()):
                raise
            reason = f"{error.args[0]!r} is needed, and not among the arrays"
            raise InputError(next(iter(bound)), sorted(bound), reason, "Add it") from error

    given = inspect.Parameter("ax", inspect.Parameter.KEYWORD_ONLY, default=None)
    parameters = [*signature.parameters.values(), given]
    styled.__signature__ = signature.replace(parameters=parameters)  # type: ignore[attr-defined]
    return styled


def figure(
    caption: str | Callable[..., str], order: int = 0, *, name: str = "", kind: str = "", along: str = ""
) -> "Callable[[Callable[..., Figure]], Callable[..., Figure]]":  # fmt: skip
    """Draw a figure as `drawn` does, and declare it as one of results (`hpcclear.report.parts.FigureOf`).

    Its name is that of its function, and its files are of the kinds that its arguments are called as, unless others are given.
    """

    def declared(function: "Callable[..., Figure]") -> "Callable[..., Figure]":
        made, (first, *others) = drawn(function), inspect.signature(function).parameters
        own = kind or first, name or function.__name__.removesuffix("_figure")
        beside = next((one for one in others if one in KINDS), "")
        made.declared = FigureOf(*own, made, caption, order, beside, along)  # type: ignore[attr-defined]
        return made

    return declared


def _beside(
    function: "Callable[..., Figure]", every: Mapping[str, Results], values: Mapping[str, Any]
) -> "Figure":
    """A column for each of several responses, under its name."""
    state = _Columns(list(every))
    with holding(_columns, state):
        for state.here, (name, one) in enumerate(every.items()):
            figure = function(**{**values, "response": one})
            mine = [axes for (column, _), axes in state.panels.items() if column == state.here]
            if not mine:
                reason, remedy = "this figure shows one design", "Choose one with --design"
                raise InputError("design", list(every), reason, remedy)
            above = mine[0].get_title(), mine[0].get_title(loc="left")
            mine[0].set_title("\n".join([labels.literal(name), *filter(None, above)]))
            if state.here:
                for panel in mine:
                    panel.set_ylabel("")
    return figure


def across() -> float:
    """Width of a figure, or of a column of one, mm: of several columns twice as much, if nobody wants another."""
    width: float = matplotlib().rcParams["figure.figsize"][0] / MM
    count = len(beside.names) if (beside := _columns.get()) else 1
    user = wanted.get()
    if count > 1 and "figure.figsize" not in user.rc:
        width *= 2.0
    return width / count


def page(height: float, width: float | None = None) -> "Figure":
    """An empty figure, mm, by default as wide as a column, or as a user wants it. Raises InputError if the caller gave axes."""
    matplotlib()
    if (given := _given.get()) is not None:
        raise InputError("ax", len(given), "this figure has a layout of its own", "Leave ax out")
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    from hpcclear.report.figures.layout import Fitting

    if width is None or "figure.figsize" in wanted.get().rc:
        width = across() * (len(beside.names) if (beside := _columns.get()) else 1)
    size = (width * MM, (wanted.get().height or height) * MM)
    figure = Figure(figsize=size, layout=Fitting())
    FigureCanvasAgg(figure)
    return figure


def mosaic(
    cells: Sequence[Sequence[str]], height: float, **options: Any
) -> "tuple[Figure, dict[str, Axes]]":
    """A page of panels by name (``"."``: none), or the caller's axes in this order; InputError of another number."""

    def make(figure: "Figure", count: int) -> "Panels":
        empty = {f"{k} .": "." for k in range(count)}
        keys = [[f"{k} {name}" for k in range(count) for name in row] for row in cells]
        places: Any = [[empty.get(key, key) for key in row] for row in keys]
        made: dict[str, Axes] = figure.subplot_mosaic(places, **options)
        return {(k, name): made[f"{k} {name}"] for k in range(count) for name in names}

    names = dict.fromkeys(name for row in cells for name in row if name != ".")
    return _panels(list(names), height, make)


def grid(rows: int, columns: int, height: float, **options: Any) -> "tuple[Figure, np.ndarray]":
    """A page of equal panels, or the caller's axes, (rows, columns); options of `Figure.subplots`, errors as of `mosaic`."""

    def make(figure: "Figure", count: int) -> "Panels":
        shared = {"sharey": "row"} if count > 1 else {}
        axes = figure.subplots(rows, columns * count, squeeze=False, **{**shared, **options})
        return {
            (at // columns, f"{row * columns + at % columns}"): one
            for (row, at), one in np.ndenumerate(axes)
        }

    figure, panels = _panels([str(k) for k in range(rows * columns)], height, make)
    axes = np.empty(rows * columns, dtype=object)
    axes[:] = list(panels.values())
    return figure, axes.reshape(rows, columns)


def side_by_side(count: int, height: float, **options: Any) -> "tuple[Figure, np.ndarray]":
    """`grid` of one column, axes of shape (count, 1); its panels, each so high, stand beside each other in a wide column."""
    wide = count > 1 and column.get() > WIDTH and _given.get() is None
    columns = 1 + wide
    rows = -(-count // columns)
    figure, axes = grid(rows, columns, height * rows, **options if columns == 1 else {})
    for spare in axes.ravel()[count:]:
        spare.remove()
    return figure, axes.ravel()[:count, None]


def below(axes: np.ndarray, words: str) -> None:
    """Label the lowest panel of each column."""
    specs = [(panel, panel.get_subplotspec()) for panel in axes.ravel()]
    for panel in {one and one.colspan.start: panel for panel, one in specs}.values():
        panel.set_xlabel(words)


def _panels(
    names: list[str], height: float, make: "Callable[[Figure, int], Panels]"
) -> "tuple[Figure, dict[str, Axes]]":
    """The panels of the results that are drawn now: those of a page of all columns, or of the caller."""
    beside = _columns.get() or _Columns([""])
    if beside.figure is None:
        keys = [(k, name) for name in names for k in range(len(beside.names))]
        given = _given.get()
        if given is None:
            beside.figure = page(height)
            beside.panels = make(beside.figure, len(beside.names))
        elif len(given) == len(keys):
            beside.figure = cast("Figure", given[0].figure)
            beside.panels = dict(zip(keys, given, strict=True))
        else:
            reason = f"this figure has {len(keys)} panels"
            raise InputError("ax", len(given), reason, "Give as many axes, in an array or list")
    return beside.figure, {name: beside.panels[beside.here, name] for name in names}


def settle(axes: "Sequence[Axes] | np.ndarray") -> None:
    """Fix tick sizes now (matplotlib makes ticks late, by then the style is gone) and thin them, by the size of each panel."""
    settings = matplotlib().rcParams
    for axis in np.ravel(np.asarray(axes, dtype=object)):
        for one in (axis, *axis.child_axes):
            for scale in "xy":
                size = settings[f"{scale}tick.labelsize"]
                one.tick_params(axis=scale, which="both", labelsize=size)
                getattr(one, f"{scale}axis").get_offset_text().set_fontsize(size)
            one.tick_params(length=2.0, pad=2.0)
        box = axis.get_position()
        width, height = axis.figure.get_size_inches() / MM
        room = {"x": 7.0 * box.width * width / WIDTH, "y": box.height * height / 6.0}
        for scale, ticks in room.items():
            if type(getattr(axis, f"{scale}axis").get_major_locator()).__name__ == "AutoLocator":
                axis.locator_params(axis=scale, nbins=int(np.clip(round(ticks), 2, 5)))


def legend(
    figure: "Figure", panels: "Axes | Sequence[Axes] | np.ndarray", place: str, **options: Any
) -> None:
    """One legend for all panels, ``"upper"`` or ``"lower"``, of as many columns as fit: each word once."""
    entries: dict[str, Any] = {}
    if _columns.get() is not None:  # of the column before
        for old in figure.legends:
            words = (one.get_text() for one in old.get_texts())
            entries |= dict(zip(words, old.legend_handles, strict=True))
            old.remove()
    for panel in np.ravel(np.asarray(panels, dtype=object)):
        entries |= {word: one for one, word in zip(*panel.get_legend_handles_labels(), strict=True)}
    where: Any = f"outside {place} center"
    make = functools.partial(figure.legend, [*entries.values()], [*entries], loc=where, **options)
    _in_columns(make, len(entries), 0.98 * figure.bbox.width)


def key(panel: "Axes", place: str = "best", **options: Any) -> None:
    """The legend of one panel, of as many columns as fit its width; ``"above"`` is over its data, on the right."""
    where = "upper right" if place == "above" else place
    make = functools.partial(panel.legend, loc=where, **options)
    made = _in_columns(make, len(panel.get_legend_handles_labels()[1]), panel.bbox.width)
    if made is not None and place == "above":
        share = min(1.2 * made.get_window_extent().height / panel.bbox.height, 0.7)
        (low, high), top = panel.get_ylim(), panel.dataLim.y1
        panel.set_ylim(top=max(high, low + (top - low) / (1.0 - share)))


def _in_columns(make: "Callable[..., Legend]", most: int, room: float) -> "Legend | None":
    """A legend of as many columns as fit into so many dots; None of nothing."""
    for columns in range(most, 0, -1):
        made = make(ncols=columns)
        if columns == 1 or made.get_window_extent().width <= room:
            return made
        made.remove()
    return None


def render(figure: "Figure", kind: str = "png", dpi: int = 300) -> bytes:
    """Bytes of a figure as ``png``, ``svg`` or ``pdf``, equal for equal figures. Raises InputError if labels do not fit."""
    buffer, user = io.BytesIO(), _users.get(figure, Printing())
    engine, dots = figure.get_layout_engine(), figure.get_dpi()
    none = {"backend": "agg", "figure.autolayout": False, "figure.constrained_layout.use": False}
    with matplotlib().rc_context({**RC, **user.rc, **none}):
        try:
            figure.set_dpi(dpi)
            if engine is not None:  # here, as matplotlib would draw all of it once more for it
                asked = user.rc or user.height or user.texts  # so that labels may not fit
                if asked and hasattr(engine, "check"):
                    engine.check(figure)
                else:
                    engine.execute(figure)
                figure.set_layout_engine(None)  # with one all would be drawn once more
            figure.savefig(buffer, format=kind, dpi=dpi, metadata=_STAMPS[kind][1])
        finally:
            if engine is not None:
                figure.set_layout_engine(engine)
            figure.set_dpi(dots)
    return buffer.getvalue()


def save(figure: "Figure", path: str | Path) -> Path:
    """Write a figure whole, in the format that the suffix of its path names: ``.png``, ``.svg`` or ``.pdf``. Returns where it
    stands.

    Raises InputError: the suffix is another one, or the place cannot be written to. Raises StorageError: the disk is full or
    fails.
    """
    place = Path(path)
    kind = place.suffix.lower().removeprefix(".")
    if kind not in _STAMPS:
        remedy = "End the name in .png, .svg or .pdf"
        raise InputError("figure", str(place), "figures are png, svg or pdf", remedy)
    files.write_bytes(place, render(figure, kind), _STAMPS[kind][0])
    return place
