"""What makes the scatter of verified designs: contributions of their random inputs, and what tighter tolerances would bring.

Nothing is simulated for it: the samples that verify a design are fitted.
"""

from collections.abc import Sequence

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.report.scatter import to_tighten
from hpcclear.results import dataset
from hpcclear.scene.choices import input_entry
from hpcclear.scene.stages import REPLICATES
from hpcclear.statistics.sensitivity.contributions import contributions
from hpcclear.study.optimisation import Choice
from hpcclear.study.run import Result, StudyRun
from hpcclear.study.truth import scattered

_NAMES = ("contribution", "contribution_error", "halved", "halved_error")
_OF_ALL = ("halved_together", "halved_together_error", "unexplained", "unexplained_error")


def inputs_of(run: StudyRun) -> list[str]:
    """Random inputs of all cases, in the study's order."""
    used = {name for case in run.study.cases for name in case.random}
    return [row.name for row in run.study.random if row.name in used]


def of_designs(run: StudyRun, choices: Sequence[Choice], made: Sequence[Array]) -> Result:
    """Contributions of the random inputs to the scatter of designs.

    From simulations, (2, replicates, values) each, of `hpcclear.study.truth.made`. Returns ``contribution``, ``halved`` and
    their ``_error``, (n, inputs), as `hpcclear.statistics.sensitivity.contributions` has them, and ``group``, 0 of independent
    inputs; NaN for inputs that do not belong to a design's case; ``halving_cost``, (n, inputs), NaN where it is not known;
    ``halved_together`` of the inputs to tighten first, ``unexplained``, and their ``_error``, (n,).
    """
    names = inputs_of(run)
    shape = len(choices), len(names)
    result: Result = {name: np.full(shape, np.nan) for name in (*_NAMES, "group")}
    result |= {name: np.full(len(choices), np.nan) for name in _OF_ALL}
    result["halving_cost"] = _prices(run, choices, names)
    for row, (choice, one) in enumerate(zip(choices, made, strict=True)):
        f, plain = one[0], run.study.verification.draws is not None
        random = run.study.case(choice.case).random
        length, start = (f.size, None) if plain else (f.shape[1], 0)
        points = scattered(run, choice, length, first=start)
        own = [points.names.index(name) for name in random]
        count = f.size // REPLICATES  # plain draws in as many parts
        values = points.values[: REPLICATES * count, own].reshape(REPLICATES, count, len(own))
        its = f.ravel()[: REPLICATES * count].reshape(REPLICATES, count)
        together = run.study.correlation
        groups = [0] * len(random) if together is None else together.groups(random)
        columns = [names.index(name) for name in random]
        result["group"][row, columns] = groups
        apart = [group or -k for k, group in enumerate(groups, 1)]
        found = contributions(values, its, apart)
        parts = (found.share, found.share_error, found.halved, found.halved_error)
        for name, part in zip(_NAMES, parts, strict=True):
            result[name][row, columns] = part
        prices = result["halving_cost"][row, columns]
        first, _ = to_tighten(found.halved, found.halved_error, prices)
        both = (*found.together(first), found.rest, found.rest_error)
        for name, number in zip(_OF_ALL, both, strict=True):
            result[name][row] = number
    return result


def _prices(run: StudyRun, choices: Sequence[Choice], names: Sequence[str]) -> Array:
    """What half the scatter of random inputs costs more, (designs, inputs), where variables with a law of cost drive it; else
    NaN."""
    found = np.full((len(choices), len(names)), np.nan)
    for variable in run.study.variables:
        if variable.cost is None or variable.cost.law is None:
            continue
        driven = {input_entry(path)[0] for path in variable.input_paths}
        columns = [k for k, name in enumerate(names) if name in driven]
        for row, choice in enumerate(choices):
            width = choice.design.get(variable.name, np.nan)
            found[row, columns] = variable.costs(width / 2.0) - variable.costs(width)
    return found


def write(run: StudyRun, choices: Sequence[Choice], found: Result) -> None:
    """Write contributions.nc; `found` of `of_designs`, (n, ...) each."""
    names = inputs_of(run)
    coords = {"design": np.array([one.name for one in choices]), "input": np.array(names)}
    data = {name: found[name] for name in (*_NAMES, *_OF_ALL)}
    if np.isfinite(found["halving_cost"]).any():
        data["halving_cost"] = found["halving_cost"]
    data["group"] = np.nan_to_num(found["group"]).astype(np.int64)
    run.write(dataset.dataset("contributions", coords, data, objective=run.scene.objective))
