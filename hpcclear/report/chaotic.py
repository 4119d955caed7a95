"""Lines on the sensitivity of designs to initial conditions (kind ``chaos``)."""

from collections.abc import Iterator

from hpcclear.report.parts import LinesOf, Recommended
from hpcclear.report.spread import Line

SOME = 0.05
"""Share of samples that change with a perturbation above which a design is called sensitive to initial conditions."""

LARGE = 0.1
"""Share of the variance above which chaotic scatter is worth more revolutions."""


def _lines(of: Recommended) -> Iterator[Line]:
    """Share of the design's variance that is chaos, and how many designs are chaotic; none if it was not simulated."""
    own = of.of_best("chaos")
    if own is None:
        return
    moved = of.files["chaos"]["chaotic"].to_numpy() > SOME
    text = f"{int(moved.sum())} of {moved.size} designs are sensitive to initial conditions"
    if not float(own["chaotic"]) > SOME:
        text += "; the recommended one is not: perturbations of 1e-9, relative, leave its samples unchanged"
    else:
        text += (
            f". Relative perturbations of 1e-9 change {float(own['chaotic']):.0%} of the recommended design's samples "
            f"and explain {float(own['chaos_share']):.0%} of its variance"
        )
    yield Line("chaos", text)


def _steps(of: Recommended) -> Iterator[str]:
    own = of.of_best("chaos")
    if own is not None and float(own["chaos_share"]) > LARGE:
        yield "a larger numerics.averaged_revolutions, since chaotic scatter decreases with it"


PARTS = (LinesOf(80, ("chaos",), _lines, _steps),)
