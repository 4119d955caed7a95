"""How much a study simulates, from what each of its stages says of itself."""

from hpcclear.scene import Scene
from hpcclear.study import optimisation, responses, sensitivities, surrogates
from hpcclear.study.paper import readings
from hpcclear.study.paper.printed import printed_designs


def samples_of(scene: Scene) -> dict[str, int]:
    """Samples on the ranks by stage, if no surface or model is refused and the surrogate holds at once.

    The most there can be then: a short front has fewer designs to verify.

    Raises
    ------
    InputError
        If the scene has no study.
    """
    study = scene.required_study
    extremes, spread = optimisation.chosen_in_all(study)
    verified = spread + len(study.cases) + len(printed_designs(scene))  # the original, in each case
    count = study.verification.samples
    return {
        "sensitivity": sensitivities.simulations(study),
        "kriging": surrogates.simulations(study),
        "check": extremes * count,
        "verification": verified * count,
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
