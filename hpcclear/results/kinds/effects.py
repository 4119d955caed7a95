"""Variants without some effects, against the complete scene."""

from hpcclear.base.objectives import MEAN_GAP
from hpcclear.results.rows import ResultKind, count, flag, number, text

KIND = ResultKind(
    150, "Effect screening: effects that can be neglected", ("variant",), alone=True,
    table={
        "variant": count("variant", "number of the variant; 0 is the complete scene"),
        "effect": text("effect", "effect that may be disabled"),
        "response": text("response", "result that changes"),
        "off": flag("variant effect", "whether the effect is disabled in the variant", "on off", required=True),
        "change": number("variant response", "1", "relative change from the complete scene", required=True),
        "limit": number("variant response", "1", "half-width of its confidence interval", required=True),
        "finding": flag("variant response",
            "whether the change is within the tolerance", "within beyond undecided", required=True),
        "decision": flag("variant",
            "whether all changes that count are within the tolerance", "within beyond undecided", required=True),
        "point_change": number("variant", "1",
            "root mean square change of single samples, relative to the mean", required=True),
        "judged": flag("response", "whether its change counts", "reported judged", required=True),
        "recommended": flag("variant", "whether the variant is the cheapest within the tolerance",
            "not_recommended recommended", required=True),
        "work": number("variant", "1", "computing work relative to the complete scene", required=True),
        "evaluations": number("variant", "1", "mean number of evaluations of the equations of motion", required=True),
        "coordinates": count("variant", "number of integrated coordinates", required=True),
        "samples": count("variant", "number of simulations", required=True),
        "failed": count("variant", "number of simulations that failed", required=True),
        "objective": number("variant", "objective", f"mean objective f, {MEAN_GAP.words}", required=True),
    },
)
