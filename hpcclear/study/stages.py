"""The stages of a study in their order: what each needs, does, writes and simulates.

Resuming, announcements, plans and the files of a finished study all go by this one list.
"""

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from hpcclear.ensemble import effects
from hpcclear.ranks.progress import duration
from hpcclear.ranks.terminal import Style, announce
from hpcclear.scene import Scene
from hpcclear.scene.study import Study
from hpcclear.scene.switches import switches
from hpcclear.statistics.surrogate.piecewise import Piecewise
from hpcclear.study import (
    budget,
    certificate,
    chaos,
    contributions,
    fronts,
    lives,
    optimisation,
    rare,
    responses,
    search,
    sensitivities,
    surrogates,
    tolerance,
    truth,
    verdicts,
    verification,
    worst,
)
from hpcclear.study.optimisation import Choice
from hpcclear.study.paper import claims, readings
from hpcclear.study.paper.printed import is_the_papers, printed_designs, printed_moments
from hpcclear.study.run import Result, StudyRun
from hpcclear.study.simulations import loads_of
from hpcclear.study.verification import Verified


@dataclass(frozen=True)
class Stage:
    """One stage of a study."""

    name: str
    run: Callable[..., Any]
    """Does it, from the run and the results of `needs`; what it returns is its result."""
    needs: tuple[str, ...] = ()
    """Stages, all of them earlier, whose results it takes: None for one that does not apply. Beside them there is "scene", as
    it was written."""
    applies: Callable[[Scene], bool] = lambda scene: True
    """Whether a study of this scene has it."""
    words: Mapping[str, str] = field(default_factory=dict)
    """What to announce of it, by the names of its parts (without the number of a round); nothing: it is not counted."""
    writes: tuple[str, ...] = ()
    """Kinds of the result files without which it is not finished."""
    samples: Callable[[Scene], Mapping[str, int]] = lambda scene: {}
    """Samples on the ranks, by parts; 0 where it does not apply."""
    responses: Callable[[Scene], int] = lambda scene: 0
    """Single responses, which root simulates alone."""


class Models(NamedTuple):
    """Surrogates as they are kept, and the one that is searched."""

    kept: Result
    searched: Piecewise


class SearchOutcome(NamedTuple):
    """What a search ends with: designs to be verified, and remarks on how they were found."""

    designs: list[Choice]
    remarks: list[str]


def _sensitivity(run: StudyRun) -> Result:
    result = run.stage("sensitivity", sensitivities.analyse)
    sensitivities.write(run, result)
    return result


def _surrogates(run: StudyRun) -> Models:
    kept = run.stage("kriging", surrogates.fit_all)
    run.write_samples()
    models = surrogates.models_of(run.scene, kept)
    surrogates.write(run, kept, models)
    return Models(kept, models[-1])


def _search(run: StudyRun, models: Models) -> SearchOutcome:
    """Fronts by the model, and what simulations of their designs and of others make of them."""
    found = run.stage("optimisation", optimisation.optimise, models.searched)
    ends, between = optimisation.extremes(run, found), optimisation.spread(run, found)
    fronts.write(run, found, [*ends, *between], models.searched)
    result = run.stage("search", search.search, [*ends, *between], models.searched)
    return SearchOutcome(to_verify(run, ends, between, result), [*map(str, result["remarks"])])


def to_verify(
    run: StudyRun, ends: Sequence[Choice], between: Sequence[Choice], result: Result
) -> list[Choice]:
    """Designs that are verified, of the ends of the swarm's fronts, those between them, and the result of a search."""
    papers = ends if is_the_papers(run.scene) else []
    better = search.found_in(run, result)
    designs = optimisation.distinct([*papers, *better]) if better else [*ends, *between]
    return [*designs, *verification.original(run), *printed_designs(run.scene)]


def _verification(run: StudyRun, models: Models, found: SearchOutcome) -> Verified:
    true = run.stage("verification", rare.decided, found.designs)
    table = verification.named(run, found.designs, true)
    true = {name: values[table.rows] for name, values in true.items()}
    text, more = tolerance.reached(run, true, table)
    remarks = [*found.remarks, *([text] if run.study.paired else []), *more]
    remarks += verification.undecided(run, table.choices, true)
    remarks += verification.missed(run, table.choices, true, models.searched)
    return Verified(table, true, remarks)


def _verified(run: StudyRun, models: Models, verified: Verified, over_life: Result | None) -> None:
    printed = printed_moments(run.scene, verified.table.choices)
    verification.write(run, verified, models.searched, printed, over_life or {})


def _worst(run: StudyRun, verified: Verified) -> None:
    choices = verified.table.choices
    worst.write(run, choices, run.stage("worst", worst.of_designs, choices))


def _chaos(run: StudyRun, verified: Verified) -> None:
    choices = verified.deciding
    chaos.write(run, choices, run.stage("chaos", chaos.simulate, choices))


def _responses(run: StudyRun, verified: Verified) -> Result:
    series = run.stage("responses", responses.simulate_all, verified.deciding)
    responses.write(run, verified.deciding)
    return series


def _designs(scene: Scene) -> int:
    """How many designs are verified at most."""
    study = scene.required_study
    found = sum(optimisation.chosen_in_all(study))
    if study.verification.infill_rounds:
        papers = optimisation.chosen_in_all(study)[0] * is_the_papers(scene)
        found = papers + sum(budget.designs(study, case) for case in study.cases)
    return found + len(study.cases) + len(printed_designs(scene))  # the original, in each case


_BEFORE_VERIFICATION = ("wear", "sensitivity", "surrogates", "search")


def _of_verification(scene: Scene) -> dict[str, int]:
    study = scene.required_study
    settings = study.verification
    kept = [goal for case in study.cases for goal in case.kept if verdicts.rare(goal, settings)]
    failing = int(sum(verdicts.usual(goal, settings) for goal in kept))
    each = truth.expected(study) + failing // len(study.cases)
    designs = _designs(scene)
    before = [stage.samples(scene) for stage in STAGES if stage.name in _BEFORE_VERIFICATION]
    others = designs * each + sum(sum(parts.values()) for parts in before)
    pairs = tolerance.simulations(study, designs, others)
    return {"verification": designs * each, "pairs": pairs}


def _samples(part: str, count: Callable[[Scene], int]) -> Callable[[Scene], Mapping[str, int]]:
    """Samples of a stage that has one part."""
    return lambda scene: {part: count(scene)}


def _of_study(count: Callable[[Study], Any]) -> Callable[[Scene], Any]:
    """The same of a study as of a scene that has it."""
    return lambda scene: count(scene.required_study)


_worn = _of_study(lambda study: bool(study.worn))


STAGES = (
    Stage(
        "wear", lambda run: run.of(lives.known(run)), applies=_worn,
        words={"wear": "wear over the service life"}, samples=_samples("wear", lives.simulations),
    ),
    Stage(
        "effects",
        lambda run: certificate.certify(run, certificate_extent(run.scene, run.study.certificate.samples)),
        applies=_of_study(lambda study: study.certificate is not None),
        words={"effects": "effect screening"}, writes=("effects",),
    ),
    Stage(
        "sensitivity", _sensitivity, applies=_of_study(lambda study: bool(study.groups)),
        words={"sensitivity": "sensitivity analysis"}, writes=("sensitivity",),
        samples=_samples("sensitivity", _of_study(sensitivities.simulations)),
    ),
    Stage(
        "surrogates", _surrogates, words={"kriging": "surrogate models"}, writes=("samples", "kriging"),
        samples=_samples("kriging", _of_study(surrogates.simulations)),
    ),
    Stage(
        "search", _search, needs=("surrogates",), writes=("front",),
        words={"optimisation": "search on the surrogate", "search": "search by simulation"},
        samples=_samples("search", _of_study(lambda study: sum(budget.simulations(study)))),
    ),
    Stage(
        "verification", _verification, needs=("surrogates", "search"),
        words={"verification": "verification of the best designs"}, samples=_of_verification,
    ),
    Stage(
        "lives",
        lambda run, written, verified: run.stage("lives", lives.of_designs, written, verified.table.choices),
        needs=("scene", "verification"), applies=_worn,
        words={"lives": "wear of the baseline and the best designs"},
        samples=_samples("lives", lives.simulations_of_designs),
    ),
    Stage(
        "front", _verified, needs=("surrogates", "verification", "lives"), writes=("verification",)
    ),
    Stage(
        "contributions", lambda run, verified: contributions.write(run, verified.table.choices, verified.true),
        needs=("verification",), writes=("contributions",),
    ),
    Stage(
        "worst", _worst, needs=("verification",), applies=_of_study(lambda study: study.worst_case),
        words={"worst": "worst case of the best designs"}, writes=("worst",),
        samples=lambda scene: {"worst": worst.simulations(scene) if scene.required_study.worst_case else 0},
    ),
    Stage(
        "chaos", _chaos, needs=("verification",), writes=("chaos",),
        samples=_samples("chaos", _of_study(lambda study: chaos.designs(study) * 2 * chaos.PAIRS)),
    ),
    Stage(
        "responses", _responses, needs=("verification",), responses=_of_study(responses.simulations),
        words={"responses": "responses of the baseline and the best designs"},
    ),
    Stage(
        "readings", lambda run: readings.write(run, run.stage("readings", readings.evaluate)), applies=readings.applies,
        words={"readings": "published designs under alternative interpretations"}, writes=("readings",),
        samples=_samples("readings", lambda scene: readings.simulations(scene)[0]),
        responses=lambda scene: readings.simulations(scene)[1],
    ),
    Stage(
        "claims",
        lambda run, effects, models, series: claims.write(run, claims.judge(run, effects, models.kept, series)),
        needs=("sensitivity", "surrogates", "responses"), applies=is_the_papers, writes=("claims",),
    ),
)  # fmt: skip
"""In their order."""


def stages_of(scene: Scene) -> list[Stage]:
    """The stages that a study of this scene has."""
    return [stage for stage in STAGES if stage.applies(scene)]


def files_of(scene: Scene) -> list[str]:
    """Results without which a study of this scene is not finished; service lives are looked at by themselves."""
    return [f"{kind}.nc" for stage in stages_of(scene) for kind in stage.writes]


def carry_out(run: StudyRun) -> None:
    """All stages, in their order, of a run of the scene as written."""
    results: dict[str, object] = {"scene": run.scene}
    for stage in stages_of(run.scene):
        arguments = [results.get(name) for name in stage.needs]
        results[stage.name] = stage.run(results.get("wear", run), *arguments)


def announcer(scene: Scene, style: Style) -> Callable[[str], None]:
    """What writes, by its name, which stage of a study begins, and how long the study has taken so far."""
    counted = [stage.words for stage in stages_of(scene) if stage.words]
    began = time.monotonic()

    def announced(name: str) -> None:
        kind = name.partition("-")[0]
        for number, words in enumerate(counted, 1):
            if kind in words:
                spent = duration(time.monotonic() - began)
                text = f"stage {number} of {len(counted)}: {words[kind]} ({spent} so far)"
                announce(text, style)

    return announced


# ---- how much they simulate together ----


def samples_of(scene: Scene) -> dict[str, int]:
    """Samples on the ranks by stage, if no surface or model is refused.

    The most there can be then, if the number of draws of a design is given: a front may be short, or stand early. For an
    accuracy verified designs are taken to need what the paper's did. Raises InputError if the scene has no study.
    """
    found = _of_stages(scene)
    asked = scene.required_study.certificate
    if asked is not None:
        most = certificate_samples(scene) if asked.samples is None else asked.samples
        found["effects"] = most * _variants(scene)
    return found


def _of_stages(scene: Scene) -> dict[str, int]:
    """The same of all stages but the effect screening, whose size goes by theirs."""
    loads = loads_of(scene)
    return {part: loads * count for stage in STAGES for part, count in stage.samples(scene).items()}


def responses_of(scene: Scene) -> int:
    """Single responses, which root simulates alone. Raises InputError if the scene has no study."""
    return sum(stage.responses(scene) for stage in STAGES)


CERTIFICATE_SHARE = 0.05
"""Of a study's samples that its effect screening may take."""


def certificate_extent(scene: Scene, samples: int | None = None) -> tuple[int, float]:
    """Samples of each variant at most, and of the whole scene that all come to by their work (infinite for none at most).

    Where `samples` names no number, effects that are decided early leave their budget to the others.
    """
    if samples is not None or scene.study is None:
        return effects.SAMPLES if samples is None else samples, math.inf
    return effects.SAMPLES, float(certificate_samples(scene) * _variants(scene))


def certificate_samples(scene: Scene) -> int:
    """Samples of a variant, for an effect screening that takes a small share of the study it serves.

    Counted are the whole scene, each effect by itself and one set of them; never fewer than a first look needs.
    """
    study = scene.required_study
    total = sum(_of_stages(scene).values()) if study.cases else study.samples
    share = CERTIFICATE_SHARE * total / _variants(scene)
    return int(min(max(share, effects.LEAST), effects.SAMPLES))


def _variants(scene: Scene) -> int:
    """Variants that an effect screening simulates as a rule."""
    return len(switches(scene)) + 2
