"""Settings of matplotlib for every figure, and colours that survive colour blindness and grey print.

No figure names a size, a font or a colour by itself, so that a style sheet of a user can say another.
"""

from types import ModuleType
from typing import Any

import numpy as np

from hpcclear.base.errors import InputError
from hpcclear.base.extras import installing

Look = dict[str, Any]
"""Options of a curve, as matplotlib calls them."""

MM = 1.0 / 25.4
"""Inches, which matplotlib measures figures in."""

WIDTH = 85.0
"""Usual width of a figure, mm: one column, so that 7 pt in the file are 7 pt on the page."""

NAMES = ("blue", "vermilion", "green", "purple", "sky", "orange", "ink")
"""Colours of curves in their order, by name: Okabe and Ito's (without yellow, which is lost on white), distinguished by every
eye, and the colour of text."""

DASHES = ("-", "--", "-.", ":", (0, (5, 1)), (0, (3, 1, 1, 1, 1, 1)), (0, (1, 1)))
"""Line styles in the order of `NAMES`: a curve is never identified by its colour alone."""

MARKERS = ("o", "s", "^", "D", "v", "P", "X")


def _theme(paper: str, ink: str, faint: str, *curves: str) -> dict[str, str]:
    """Settings of the colours of page, text, grid and curves."""
    inked = ("text.color", "axes.labelcolor", "axes.edgecolor", "xtick.color", "ytick.color")
    cycle = f"cycler('color', {[*curves, ink]})"
    papers = dict.fromkeys(("figure.facecolor", "axes.facecolor"), paper)
    return papers | dict.fromkeys(inked, ink) | {"grid.color": faint, "axes.prop_cycle": cycle}


_LIGHT = "#ffffff #000000 #dddddd #0072b2 #d55e00 #009e73 #cc79a7 #56b4e9 #e69f00"
_DARK = "#14181d #e6e9ec #3a434d #4a9fe8 #ff8f4c #3fc79a #e79fc6 #a5ddff #f2c14e"
THEMES = {"light": _theme(*_LIGHT.split()), "dark": _theme(*_DARK.split())}
"""Colours by the name of a theme."""

_SIZES = (
    *("axes.labelsize", "axes.titlesize", "figure.titlesize", "figure.labelsize"),
    *("xtick.labelsize", "ytick.labelsize", "legend.fontsize", "legend.title_fontsize"),
)

RC: dict[str, Any] = {
    **THEMES["light"],
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],  # comes with matplotlib: equal figures everywhere
    "font.size": 7.0,
    **dict.fromkeys(_SIZES, "medium"),
    "axes.titlelocation": "left",
    "legend.frameon": False,
    "legend.handlelength": 1.8,
    "axes.linewidth": 0.6,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.linewidth": 0.4,
    "lines.linewidth": 0.9,
    "lines.markersize": 3.0,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "figure.figsize": (WIDTH * MM, 60.0 * MM),  # the height is the figure's own, or that of a user
    "figure.dpi": 300.0,
    "svg.hashsalt": "hpcclear",  # equal figures, equal bytes
    "svg.fonttype": "path",
    "pdf.fonttype": 42,
    "mathtext.fontset": "dejavusans",
}  # fmt: skip


def matplotlib() -> ModuleType:
    """The matplotlib module. Raises InputError if it is not installed; the message names the extra that brings it."""
    try:
        import matplotlib as module
    except ModuleNotFoundError:
        reason = "figures are drawn with matplotlib, which is not installed"
        raise InputError("matplotlib", None, reason, installing("analysis")) from None
    return module


def colour(which: int | str) -> str:
    """A colour of the style in use: that of curve k of several, or by its name in `NAMES`; "paper" and "ink" are those of page
    and text, "grey" stands between them, "faint" is that of the grid; any other is itself."""
    from matplotlib.colors import to_hex, to_rgb

    settings = matplotlib().rcParams
    named = {"ink": "text.color", "paper": "axes.facecolor", "faint": "grid.color"}
    if which in named:
        return to_hex(settings[named[str(which)]])
    if which == "grey":
        ends = (np.array(to_rgb(settings[named[name]])) for name in ("ink", "paper"))
        red, green, blue = np.average([*ends], axis=0, weights=[0.54, 0.46])
        return to_hex((red, green, blue))
    if isinstance(which, str) and which not in NAMES:
        return which
    every = settings["axes.prop_cycle"].by_key().get("color", ["C0"])
    at = which if isinstance(which, int) else NAMES.index(which)
    return to_hex(every[at % len(every)])


def categories(count: int) -> Look:
    """Colours of as many categories, which have no order: number k of them, from 0 on, has its own."""
    from matplotlib.colors import BoundaryNorm, ListedColormap

    colours = ListedColormap([colour(k) for k in range(max(count, 1))])
    return {"cmap": colours, "norm": BoundaryNorm(np.arange(colours.N + 1) - 0.5, colours.N)}


def look(k: int) -> Look:
    """Colour, line style and marker of curve k of several: no two of the first 49 have all three in common."""
    at, more = k % len(NAMES), k // len(NAMES)
    return {"color": colour(at), "ls": DASHES[(at + more) % len(DASHES)], "marker": MARKERS[at]}
