"""Laws as effects name them, by the words that tests of the kernel use for them."""

from hpcclear.dynamics import layout as at
from hpcclear.dynamics.laws import laws
from hpcclear.dynamics.laws.lanes import in_lanes

CONTACT = {"fixed": "hunt-crossley", "latched": "lankarani-nikravesh"}
FRICTION = ("coulomb", "ambrosio", "lugre")


def effects_with(names, **more) -> at.Effects:
    """Effects of these names that are on; with an open joint and no law of contact named, Hertz'."""
    on = set(names) - {*CONTACT, *FRICTION}
    found = [CONTACT[name] for name in CONTACT if name in names]
    is_open = "joints" in {*on, *more}
    law = found[0] if found else "hertz" if is_open else None
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


def contact_row(effects, number: str) -> int:
    """Row of a number of the law of contact among such effects; Hertz' where none of ours is named."""
    law = next((CONTACT[name] for name in CONTACT if name in effects), "hertz")
    return row("contact", law, number)


STIFFNESS = row("contact", "hertz", "stiffness")
"""Row of the stiffness of Hertz' law alone."""
