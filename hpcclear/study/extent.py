"""How much a study simulates, from what each of its stages says of itself."""

import math

from hpcclear.ensemble import effects
from hpcclear.scene import Scene
from hpcclear.scene.switches import switches
from hpcclear.study import (
    chaos,
    edge,
    lives,
    optimisation,
    refinement,
    responses,
    sensitivities,
    surrogates,
    tolerance,
    truth,
    verdicts,
)
from hpcclear.study.goals import ends_in_all
from hpcclear.study.paper import readings
from hpcclear.study.paper.printed import printed_designs


def samples_of(scene: Scene) -> dict[str, int]:
    """Samples on the ranks by stage, if no surface or model is refused.

    The most there can be then, if the number of draws of a design is given: a front may be short, or stand early. For an
    accuracy verified designs are taken to need what the paper's did.

    Raises
    ------
    InputError
        If the scene has no study.
    """
    found = _of_stages(scene)
    asked = scene.required_study.certificate
    if asked is not None:
        most = certificate_samples(scene) if asked.samples is None else asked.samples
        found["effects"] = most * _variants(scene)
    return found


def _of_stages(scene: Scene) -> dict[str, int]:
    """The same of all stages but the certificate, whose size goes by theirs."""
    study = scene.required_study
    extremes, spread = optimisation.chosen_in_all(study)
    verified = spread + len(study.cases) + len(printed_designs(scene))  # the original, in each case
    count = truth.expected(study)
    if study.verification.infill_rounds:
        verified += 2 * ends_in_all(study)  # runners-up, and what is believed to be the ends
    begun, rounds = refinement.simulations(study)
    failing = sum(verdicts.usual_in(case, study.verification) for case in study.cases)
    return {
        "wear": lives.simulations(scene),
        "sensitivity": sensitivities.simulations(study),
        "kriging": surrogates.simulations(study),
        "check": begun,
        "infill": rounds,
        "edge": edge.simulations(study),
        "verification": (extremes + verified) * (count + failing // len(study.cases)),
        "pairs": tolerance.simulations(study),
        "lives": lives.simulations_of_designs(scene),
        "chaos": (extremes + verified) * 2 * chaos.PAIRS,
        "readings": readings.simulations(scene)[0],
    }


def responses_of(scene: Scene) -> int:
    """Single responses, which root simulates alone.

    Raises
    ------
    InputError
        If the scene has no study.
    """
    return responses.simulations(scene.required_study) + readings.simulations(scene)[1]


CERTIFICATE_SHARE = 0.05
"""Of a study's samples that its certificate of effects may take."""


def certificate_extent(scene: Scene, samples: int | None = None) -> tuple[int, float]:
    """Samples of each variant at most, and of the whole scene that all come to by their work (infinite for none at most).

    Where `samples` names no number, effects that are told soon leave what they do not need to those that are not.
    """
    if samples is not None or scene.study is None:
        return effects.SAMPLES if samples is None else samples, math.inf
    return effects.SAMPLES, float(certificate_samples(scene) * _variants(scene))


def certificate_samples(scene: Scene) -> int:
    """Samples of a variant, for a certificate of effects that takes a small share of the study it serves.

    Counted are the whole scene, each effect by itself and one set of them; never fewer than a first look needs.
    """
    study = scene.study
    if study is None:
        return effects.SAMPLES
    total = sum(_of_stages(scene).values()) if study.cases else study.samples
    share = CERTIFICATE_SHARE * total / _variants(scene)
    return int(min(max(share, effects.LEAST), effects.SAMPLES))


def _variants(scene: Scene) -> int:
    """Variants that a certificate simulates as a rule."""
    return len(switches(scene)) + 2
