"""The front by direct simulation: the swarm's designs and others are simulated, and where it is decided, more.

A surrogate of f that is good to a percent is no judge of standard deviations that differ by less: the swarm
finds what its errors flatter. So its designs are only where the search begins. Every design here
is simulated; models of what is made small themselves say where to look next. There are two ways to do that, `by_f` and
`by_statistics`, with the same functions.
"""

import contextlib
from collections.abc import Mapping, Sequence

import numpy as np

from hpcclear.base.errors import InputError
from hpcclear.scene.sampling import unit_lhs
from hpcclear.scene.stages import REPLICATES
from hpcclear.scene.study import Study
from hpcclear.study import by_f, by_statistics, edge, truth
from hpcclear.study.optimisation import Choice
from hpcclear.study.run import Result, StudyRun
from hpcclear.study.tried import Tried, added, bounds, choices, distinct, simulated


def at_edges(study: Study) -> int:
    """Simulations of designs at the edge of constraints and next to it, at most."""
    if study.verification.infill_rounds == 0:
        return 0
    beside = sum(2 * len(study.design_variables(case.name)) + 1 for case in edge.cases_of(study))
    return (
        edge.simulations(study) + len(edge.ASIDE) * beside * truth.search_length(study) * REPLICATES
    )


def search(
    run: StudyRun, start: Sequence[Choice], statistics: bool
) -> tuple[list[Choice], list[str]]:
    """Designs to verify beside those of the swarm, the best that were found; and what a reader should know.

    Parameters
    ----------
    start : sequence of Choice
        Designs of the swarm, of all cases.
    statistics : bool
        Whether the search goes by models of the statistics alone.

    Raises
    ------
    InputError
        If all simulations of a round fail.
    """
    if run.study.verification.infill_rounds == 0:
        return [], []
    way = by_statistics if statistics else by_f
    begun = run.stage("check-0", _begin, start, statistics)
    met = {case.name: [added(run, case.name, begun, None)] for case in run.study.cases}
    for round_, count in enumerate(way.rounds(run.study, len(begun["case"]))):
        going = {name: its[-1] for name, its in met.items() if not way.stands(run, name, its)}
        if not going:
            break
        stage = f"infill-{round_}"
        found = run.stage(stage, _go_on, going, stage, count, statistics)
        for name, before in going.items():
            met[name].append(added(run, name, found, before))
    remarks = [
        f"The search of {name} ended with its rounds while {won}; more study.verification.infill_rounds may still win."
        for name, its in met.items()
        if not way.stands(run, name, its) and (won := way.left(run, name, its))
    ]
    if not statistics:
        _end_at_edges(run, met)
    named = [] if statistics else [choice for choice in start if choice.name]
    finalists = [
        one
        for name, its in met.items()
        for one in _finalists(run, name, its[-1], named, statistics)
    ]
    if edge.cases_of(run.study):
        last = {name: its[-1] for name, its in met.items()}
        known = {name: (one.coordinates, one.values, one.excess) for name, one in last.items()}
        finalists += edge.choices_of(run, run.stage("edge", edge.approach, known))
    named = distinct(named)  # where designs are few, several finalists are one
    return distinct([*named, *finalists])[len(named) :], remarks


def _end_at_edges(run: StudyRun, met: Mapping[str, list[Tried]]) -> None:
    """Add designs next to the edge of the constraints, whose slopes decide which design there is the best."""
    names = [case.name for case in edge.cases_of(run.study)]
    for turn, aside in enumerate(edge.ASIDE if names else ()):
        going = {name: met[name][-1] for name in names}
        found = run.stage(f"edge-{turn}", _beside, going, f"edge-{turn}", aside)
        for name, before in going.items():
            met[name].append(added(run, name, found, before))


def _beside(run: StudyRun, tried: Mapping[str, Tried], stage: str, aside: float) -> Result:
    """One of these turns."""
    chosen = []
    for name, one in tried.items():
        with contextlib.suppress(InputError):  # too few designs that did not fail for a model
            case, known = run.study.case(name), (one.coordinates, one.values, one.excess)
            chosen += choices(run, name, edge.neighbours(run, case, aside, *known))
    return simulated(run, chosen, stage)


def _begin(run: StudyRun, start: Sequence[Choice], statistics: bool) -> Result:
    """Designs that a search begins with."""
    way = by_statistics if statistics else by_f
    return simulated(run, way.begin(run, start), "check-0")


def _go_on(
    run: StudyRun, tried: Mapping[str, Tried], stage: str, count: int, statistics: bool
) -> Result:
    """One round of the cases that are not decided."""
    chosen, way = [], by_statistics if statistics else by_f
    for name, one in tried.items():
        rng = run.rng(stage, name)
        try:
            where = way.further(run, name, one, count, rng)
        except InputError:  # too few designs that did not fail for a model
            region = bounds(run, one.names)
            unit = unit_lhs(count, len(one.names), rng)
            where = region[:, 0] + unit * (region[:, 1] - region[:, 0])
        chosen += choices(run, name, where)
    return simulated(run, chosen, stage)


def _finalists(
    run: StudyRun, case: str, tried: Tried, verified: Sequence[Choice], statistics: bool
) -> list[Choice]:
    """The best designs of a case for verification on scatter of its own, without those of `verified`, which have it anyway."""
    way = by_statistics if statistics else by_f
    where = way.finalists(run, case, tried, run.rng("finalists", case))
    own = [list(choice.design.values()) for choice in verified if choice.case == case]
    return [
        choice
        for choice in choices(run, case, where)
        if not any(
            np.allclose(list(choice.design.values()), one, rtol=1e-9, atol=0.0) for one in own
        )
    ]
