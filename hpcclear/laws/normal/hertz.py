"""Hertz: elastic, without loss."""

from hpcclear.laws.declared import ContactLaw
from hpcclear.laws.hertz_contact import HERTZIAN


def factor():
    """Nothing but the elastic part."""
    return 1.0


LAW = ContactLaw(
    words="Hertz's elastic contact, without loss",
    source="Lankarani and Nikravesh 1990, doi:10.1115/1.2912617, for internal contact of spheres",
    formula="K d^1.5",
    valid="small contacts: up to 30 degrees to either side",
    factor=factor,
    **{**HERTZIAN, "damping": lambda: 0.0, "without_loss": ""},
)
