"""What `check` prints of the corners of a study's ranges."""

import numpy as np

from hpcclear.cli.terminal import show_rows
from hpcclear.ensemble.corners import MOST, CornerOutcomes, tried
from hpcclear.scene import Scene


def describe(scene: Scene, simulate: bool) -> None:
    """Print which corners of the ranges make no mechanism, and which fail in two revolutions, where, and what to do."""
    found = tried(scene, simulate)
    show_rows("Corners of the study's ranges", lines(found, simulate))


def lines(found: CornerOutcomes, simulate: bool) -> list[tuple[str, str]]:
    """Return label and text of each line."""
    points, total = found.points, len(found.points)
    bad = len(found.refused) + int((found.status > 0).sum())
    does = "can be assembled and complete two revolutions" if simulate else "can be assembled"
    which = (
        "all corners" if total < MOST or total == 2 ** len(points.names) else "a balanced selection"
    )
    rows = [("corners", f"{total} ({which}): {total - bad} {does}")]
    if not bad:
        return rows
    from hpcclear.report.failures import (  # load what reads results
        SampledVariable,
        sentences,
        where,
    )

    columns = [
        SampledVariable(name, unit or "1", points.column(name))
        for name, unit in points.units.items()
    ]
    for reason in dict.fromkeys(found.refused.values()):
        hit = np.array([found.refused.get(row) == reason for row in range(total)])
        place = where(hit, columns)
        rows.append(
            ("refused", f"{int(hit.sum())} of {total} corners: {place and f'{place}: '}{reason}")
        )
    failed = sentences(found.status, columns, "corners") if simulate else ()
    return rows + [("failed", text) for text in failed]
