"""The search of each case by simulation: where to simulate next, with how many simulations, and which designs to verify.

A surrogate of f that is good to a percent is no judge of standard deviations that differ by less, and where f is rough none
holds: a swarm on it finds what its errors flatter. So its designs are only where the search begins, beside some all over the
box. Every design here is simulated, by few simulations at first. Models of each objective and constraint over designs say
what a new design may win, and what more simulations of a known one may change; whichever is worth more for each simulation
comes next (`hpcclear.statistics.search.improvement`). All designs meet the same scatter. The search ends when nothing is
worth a part of the accuracy requested.

Of a probability of failure the models have the reliability index (`hpcclear.study.failures`).
"""

from collections.abc import Sequence

import numpy as np

from hpcclear.base.threads import one_thread
from hpcclear.statistics.surrogate.piecewise import Piecewise
from hpcclear.study.case_search import CaseSearch, lengthened
from hpcclear.study.optimisation import Choice
from hpcclear.study.run import Result, StudyRun
from hpcclear.study.surrogates import of_further


def search(run: StudyRun, start: Sequence[Choice], model: Piecewise) -> Result:
    """Designs of each case to verify beside the swarm's ends, from all designs of the swarm and the surrogate of f.

    Returns ``case`` (k,) and ``design`` (k, variables of the optimisation, NaN where one is not the case's); ``remarks``: what
    a reader should know, a sentence each. Raises InputError if all simulations of a round fail.
    """
    found, remarks = searched(run, start, [model, *of_further(run, model)])
    names = run.study.optimisation
    rows = [[one.design.get(name, np.nan) for name in names] for one in found]
    return {
        "case": np.array([one.case for one in found], "U64"),
        "design": np.reshape(rows, (-1, len(names))),
        "remarks": np.array(remarks, "U"),
    }


def searched(
    run: StudyRun, start: Sequence[Choice], models: Sequence[Piecewise] = ()
) -> tuple[list[Choice], list[str]]:
    """The designs and remarks of `search`, from surrogates of f and of further responses, if there are any."""
    if not run.study.verification.infill_rounds:
        return [], []
    searches = [
        CaseSearch(run, case, [one for one in start if one.case == case.name], models)
        for case in run.study.cases
    ]
    with one_thread():
        while asked := [(one, rows) for one in searches if len(rows := one.ask())]:
            lengthened(run, asked)
            for one, _ in asked:
                one.weigh()
        for one in searches:
            one.settle()
        found = [choice for one in searches for choice in one.finalists()]
        return found, [text for one in searches for text in one.remarks()]


def found_in(run: StudyRun, result: Result) -> list[Choice]:
    """The designs of `search`."""
    chosen = []
    for case, row in zip(result["case"], result["design"], strict=True):
        own = run.study.design_variables(str(case))
        design = {n: float(x) for n, x in zip(run.study.optimisation, row, strict=True) if n in own}
        chosen.append(Choice("", str(case), design))
    return chosen
