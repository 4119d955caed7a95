"""An accuracy asked of a whole study (`study.accuracy`): what it leaves no room for beside it."""

from hpcclear.scene.fields import invalid
from hpcclear.scene.numerics import Numerics
from hpcclear.scene.stages import Verification
from hpcclear.scene.study import Study

KEY = "study.accuracy"


def check(study: Study, numerics: Numerics) -> None:
    """Refuse what an accuracy cannot be spread over, and settings that it decides; PydanticCustomError with the whole key."""
    if study.accuracy is None:
        return
    if not study.cases:
        raise invalid(
            "nothing is verified without a case, so there is no moment to be accurate",
            "Name a case in study.cases, or leave it out", KEY,
        )  # fmt: skip
    if study.worn:
        raise invalid(
            "lives of worn joints have errors of their own, which cannot be weighed against these",
            "Leave it out, and set wear.tolerance and study.verification.accuracy", KEY,
        )  # fmt: skip
    if numerics.averaged_revolutions == "auto" or numerics.target_error is not None:
        free = "target_error" if numerics.target_error is not None else "averaged_revolutions"
        raise invalid(
            "every sample chooses its own revolutions then, and study.accuracy compares samples over the same",
            "Write a number of averaged_revolutions, or leave study.accuracy out and set study.verification.accuracy",
            f"numerics.{free}",
        )  # fmt: skip
    _refuse_decided("numerics", numerics, Numerics(), ("rtol", "atol"))
    taken = ("method", "samples", "accuracy", "least_samples", "infill_samples")
    _refuse_decided("study.verification", study.verification, Verification(), taken)


def _refuse_decided(table: str, given: object, default: object, names: tuple[str, ...]) -> None:
    """Refuse entries that the accuracy decides, unless they say what they would without it."""
    for name in names:
        value = getattr(given, name)
        if value not in (getattr(default, name), "qmc"):
            shown = value.model_dump(exclude_none=True) if hasattr(value, "model_dump") else value
            raise invalid(
                "study.accuracy decides it", f"Remove it, or {KEY}", f"{table}.{name}", shown
            )
