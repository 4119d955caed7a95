"""How much a study simulates, from what each of its stages says of itself."""

import math

from hpcclear.ensemble import effects
from hpcclear.scene import Scene
from hpcclear.scene.switches import switches
from hpcclear.study.simulations import loads_of
from hpcclear.study.stages import STAGES


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
