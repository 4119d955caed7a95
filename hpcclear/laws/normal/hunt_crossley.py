"""Hunt and Crossley: a fixed damping factor, no memory."""

from hpcclear.laws.declared import ContactLaw, Parameter
from hpcclear.laws.hertz_contact import HERTZIAN


def factor(rate, damping):
    """1 + chi d'."""
    return 1.0 + damping * rate


LAW = ContactLaw(
    words="Hunt and Crossley's, with a fixed damping factor",
    source="Hunt and Crossley 1975, doi:10.1115/1.3423596",
    formula="K d^1.5 (1 + chi d')",
    valid="any impact speed; chi is a property of the contact, not of the impact",
    parameters=(
        Parameter(
            "damping", "s/m", "fixed damping factor chi", least=0, example="0.5 (s/m)", called="fixed damping factor"
        ),
    ),
    factor=factor,
    lossless=lambda values: values["damping"] == 0,
    **HERTZIAN,
)  # fmt: skip
