"""Entries that the version before had: what stands in their place, for one version, with a word."""

from collections.abc import Mapping
from typing import Any

from hpcclear.scene.stages import MomentAccuracy


def renewed(content: Mapping[str, Any]) -> tuple[dict[str, Any], tuple[str, ...]]:
    """The tables of a file by the entries of today, and a sentence for each that was read as another one."""
    made, words = dict(content), list[str]()
    _accuracy(made, words)
    return made, tuple(words)


def _accuracy(content: dict[str, Any], words: list[str]) -> None:
    """`study.verification.accuracy` was of the samples alone."""
    study = content.get("study")
    verification = study.get("verification") if isinstance(study, Mapping) else None
    if not isinstance(study, Mapping) or not isinstance(verification, Mapping):
        return
    if "accuracy" not in verification:
        return
    rest = {name: entry for name, entry in verification.items() if name != "accuracy"}
    content["study"] = {**study, "verification": rest}
    if "accuracy" in study:
        words.append("study.verification.accuracy is not used beside study.accuracy")
        return
    wanted = verification["accuracy"]
    if isinstance(wanted, Mapping):  # one of the two left the other at its default
        wanted = {**MomentAccuracy().model_dump(exclude_none=True), **wanted}
    if wanted == MomentAccuracy().model_dump(exclude_none=True):
        return  # as if nothing were asked
    content["study"]["accuracy"] = wanted
    words.append(
        "study.verification.accuracy is read as study.accuracy, which has what the tolerance takes in it: write that"
    )
