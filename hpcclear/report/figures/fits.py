"""How well surrogates fit: R2 on test points, and words for those that do not."""

from collections.abc import Callable

import numpy as np

from hpcclear.report.figures import style
from hpcclear.results.content import Results, texts_in

LOW = 0.9
"""R2 on test points below which a surrogate is called indicative, as `study.sensitivity.r2` has it by default."""


def of_surfaces(sensitivity: Results) -> dict[str, float]:
    """Return R2 of each response surface over the whole interval, at the clearance where it is least (kind ``sensitivity``)."""
    widest = sensitivity["r2"].isel(interval=int(np.argmax(sensitivity["interval"].values)))
    surfaces = sensitivity["surface"].values
    return {str(k): float(one.min()) for k, one in zip(surfaces, widest.values, strict=True)}


def of_models(kriging: Results) -> dict[str, float]:
    """Return R2 of each Kriging model, of its worst part (kind ``kriging``)."""
    family = texts_in(kriging, "family")
    r2 = kriging["r2"].values
    return {name: float(np.min(r2[np.array(family) == name])) for name in dict.fromkeys(family)}


def verdict(r2: float) -> str:
    """Return what is wrong with a fit; "" where nothing is."""
    if not np.isfinite(r2):
        return "R² not known"
    if r2 < 0.0:
        return f"R² = {r2:.2g}, worse than a constant"
    return f"R² = {r2:.2f}, indicative only" if r2 < LOW else ""


def warnings(kind: str, content: Results | None) -> list[str]:
    """Return a sentence for each surrogate of a file (kind ``sensitivity`` or ``kriging``) that does not fit."""
    if content is None:
        return []
    model = "Kriging model" if "surrogate" not in content else "surrogate"
    word, known = ("response surface", of_surfaces) if kind == "sensitivity" else (model, of_models)
    said = {name: verdict(r2) for name, r2 in known(content).items()}
    return [f"{word} in {', '.join(n.split())}: {text}" for n, text in said.items() if text]


def captioned(caption: str) -> Callable[[Results], str]:
    """Return what makes the caption of a figure of surrogates: behind its words, those that do not fit."""

    def of(content: Results) -> str:
        found = warnings(str(content.attrs["hpcclear_kind"]), content)
        return f"{caption} Warning: {'; '.join(found)}." if found else caption

    return of


def mark(axes: "style.Axes", r2: float, height: float = 0.5) -> None:
    """Write across a panel what is wrong with the fit that it shows, at this height of it."""
    if text := verdict(r2):
        box = {"facecolor": style.colour("paper"), "alpha": 0.85, "edgecolor": "none", "pad": 1.5}
        words = text.replace(", ", ":\n").replace("R²", "$R^2$")
        axes.text(
            0.5, height, words, transform=axes.transAxes, ha="center", va="center", zorder=6,
            color=style.colour("vermilion"), bbox=box,
        )  # fmt: skip
