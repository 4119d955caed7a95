"""A force that was measured or computed elsewhere, as a table against the depth.

A monotone cubic lies between the rows (Fritsch and Butland 1984, doi:10.1137/0905021), a straight line behind the last. The
numbers are written into the function, so that lanes evaluate it without a branch: each row adds its part of the depth.
"""

import itertools
from functools import lru_cache

import numpy as np

from hpcclear.base.pieces import Rows
from hpcclear.laws.declared import Geometry, Parameter
from hpcclear.laws.formula import function_of

EXAMPLE = ((1e-6, 100.0),)


@lru_cache(maxsize=32)
def of_rows(rows: Rows) -> Geometry:
    """The geometry of rows (depth in m, force in N), both rising from 0."""
    rows = rows if rows[0][0] == 0.0 else ((0.0, 0.0), *rows)
    depths, forces = np.array(rows).T
    cubics, slope = _cubics(depths, forces)
    last = float(depths[-1])
    return Geometry(
        words="a table of force against depth, from one's own measurement or finite elements",
        source="F. N. Fritsch and J. Butland 1984, doi:10.1137/0905021, for what lies between its rows",
        formula="a monotone cubic from row to row",
        valid="depths up to the last row",
        elastic=function_of(_elastic(depths, cubics, slope), "elastic"),
        energy=function_of(_energy(depths, forces, cubics, slope), "energy"),
        parameters=(
            Parameter("depth_scale", "m", "factor of the depths in the table", 1.0, above=0),
            Parameter("force_scale", "N", "factor of the forces in the table", 1.0, above=0),
        ),
        deepest=lambda depth_scale: last * depth_scale,
        of_rows=of_rows,
    )


def _cubics(depths: np.ndarray, forces: np.ndarray) -> tuple[np.ndarray, float]:
    """Cubics (4, cells) by falling powers of the depth beyond a row, and the slope at the last row."""
    if len(depths) == 2:  # a straight line, as the example, for which nobody has to load SciPy
        slope = float(forces[1] / depths[1])
        return np.array([[0.0], [0.0], [slope], [0.0]]), slope
    from scipy.interpolate import PchipInterpolator

    curve = PchipInterpolator(depths, forces)
    return curve.c, float(curve(depths[-1], 1))


def _text(name: str, depths: np.ndarray, factor: str, terms: list[str]) -> str:
    """A function: a factor times terms in the parts of the depth, ``s0`` and so on between rows, ``beyond`` behind the last."""
    lines = [f"def {name}(depth, depth_scale, force_scale):", "    x = depth / depth_scale"]
    for k, (low, high) in enumerate(itertools.pairwise(depths.tolist())):
        lines.append(f"    s{k} = min(max(x - {low!r}, 0.0), {high - low!r})")
    lines.append(f"    beyond = max(x - {depths[-1].item()!r}, 0.0)")
    return "\n".join([*lines, f"    return {factor} * ({' + '.join(terms)})", ""])


def _elastic(depths: np.ndarray, cubics: np.ndarray, slope: float) -> str:
    """The force: cubics (4, cells) by falling powers, whose constants are the sums of what stands before them."""
    terms = [
        f"s{k} * ({m!r} + s{k} * ({c2!r} + s{k} * {c3!r}))"
        for k, (c3, c2, m, _) in enumerate(cubics.T.tolist())
    ]
    return _text("elastic", depths, "force_scale", [*terms, f"{float(slope)!r} * beyond"])


def _energy(depths: np.ndarray, forces: np.ndarray, cubics: np.ndarray, slope: float) -> str:
    cells = zip(forces.tolist(), cubics.T.tolist(), strict=False)
    terms = [
        f"s{k} * ({f!r} + s{k} * ({m / 2!r} + s{k} * ({c2 / 3!r} + s{k} * {c3 / 4!r})))"
        for k, (f, (c3, c2, m, _)) in enumerate(cells)
    ]
    last = f"beyond * ({forces[-1].item()!r} + {float(slope) / 2!r} * beyond)"
    return _text("energy", depths, "force_scale * depth_scale", [*terms, last])


GEOMETRY = of_rows(EXAMPLE)
