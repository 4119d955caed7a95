"""One value for each revolution, against an entry of the scene."""

from hpcclear.base.objectives import MEAN_GAP
from hpcclear.base.outcome import Flag, Status
from hpcclear.results.rows import ResultKind, count, flag, number

KIND = ResultKind(
    30, "One value for each revolution, against an entry of the scene", ("value", "crossing"),
    design_dims=("value",), alone=True,
    table={
        "value": count("value", "number of the value"),
        "crossing": count("crossing", "number of the revolution, the first after the transient"),
        "observed": number("value crossing", "objective", MEAN_GAP.words, required=True),
        "flags": flag("value", "validity warnings of the result", Flag),
        "status": flag("value", "outcome of the simulation", Status),
    },
)
