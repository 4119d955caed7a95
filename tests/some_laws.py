"""Laws as effects name them, by the words that tests of the kernel use for them."""

from hpcclear.dynamics import layout as at
from hpcclear.dynamics.contacts.laws import in_lanes
from hpcclear.laws import laws

CONTACT = {"fixed": "hunt-crossley", "latched": "lankarani-nikravesh"}
FRICTION = ("coulomb", "ambrosio", "lugre")


def contact_law(names) -> str:
    """Name of the law of contact among these effects, Hertz' without."""
    return next((law for name, law in CONTACT.items() if name in names), "hertz")


def effects_with(names, **more) -> at.Effects:
    """Effects of these names that are on; with an open joint and no law of contact named, Hertz'."""
    on = set(names) - {*CONTACT, *FRICTION}
    is_open = "joints" in {*on, *more}
    law = contact_law(names) if is_open or set(names) & {*CONTACT} else None
    rubs = [name for name in FRICTION if name in names]
    return at.Effects(
        **dict.fromkeys(on, 1) | more,
        contact=None if law is None else in_lanes(laws("contact")[law]),
        friction=in_lanes(laws("friction")[rubs[0]]) if rubs else None,
    )


def row(kind: str, law: str, number: str) -> int:
    """Row of one of a law's numbers in a joint's block of parameters."""
    first = at.CONTACT_NUMBERS if kind == "contact" else at.FRICTION_NUMBERS
    return first + laws(kind)[law].read.index(number)


STIFFNESS = row("contact", "hertz", "stiffness")
"""Of Hertz' law alone; laws that damp have it elsewhere."""
