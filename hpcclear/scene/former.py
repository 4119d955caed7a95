"""Entries that the version before had: what stands in their place, for one version, with a word."""

import math
from collections.abc import Mapping
from typing import Any

from hpcclear.base.errors import InputError
from hpcclear.base.objectives import MEAN_GAP
from hpcclear.scene.stages import MomentAccuracy
from hpcclear.scene.units import UnitError, to_si


def renewed(content: Mapping[str, object]) -> tuple[dict[str, Any], tuple[str, ...]]:
    """The tables of a file by the entries of today, and a sentence for each that was read as another one."""
    made, words = dict(content), list[str]()
    _accuracy(made, words)
    _numerics(made, words)
    return made, tuple(words)


def _numerics(content: dict[str, Any], words: list[str]) -> None:
    """Averages that went on until a standard error, and replicas of every sample: a target error answers for both."""
    numerics = content.get("numerics")
    if not isinstance(numerics, Mapping):
        return
    gone = ("objective_tolerance", "max_averaged_revolutions", "uncertainty")
    kept = {name: entry for name, entry in numerics.items() if name not in gone}
    if kept.get("averaged_revolutions") == "auto":
        del kept["averaged_revolutions"]
        name, value = _of_automatic(content, numerics)
        kept.setdefault(name, value)
        words.append(
            f'numerics.averaged_revolutions = "auto" is read as numerics.{name} = {kept[name]}: write that'
        )
    if numerics.get("uncertainty", False) is not False:
        words.append(
            "numerics.uncertainty is not used: every response has a half-width, and numerics.target_error gives samples one"
        )
    content["numerics"] = kept


def _of_automatic(content: Mapping[str, Any], numerics: Mapping[str, Any]) -> tuple[str, Any]:
    """Entry and value in place of an automatic average: two of its standard errors, or where none can be aimed at its cap."""
    table = content.get("study", numerics)
    named = table.get("objective") if isinstance(table, Mapping) else None
    if "wear" in content or numerics.get("objective_joints") or named not in (None, MEAN_GAP.name):
        return "averaged_revolutions", numerics.get("max_averaged_revolutions", 200)
    entry = numerics.get("objective_tolerance", 1e-3)
    try:
        tolerance = to_si(entry, "") if isinstance(entry, str) else float(entry)
    except (UnitError, TypeError, ValueError, OverflowError):
        tolerance = math.nan
    if not 0.0 < tolerance < 1.0:
        reason = "is no share between 0 and 1, and belongs to automatic averages, which are no more"
        raise InputError(
            "numerics.objective_tolerance",
            entry,
            reason,
            "Set numerics.target_error, to twice of it",
        )
    return "target_error", min(2.0 * tolerance, 0.5)


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
