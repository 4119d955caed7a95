"""What a geometry of contact may use of the motion that it is written into (`base.terms.Touching`), written into a text."""

from collections.abc import Callable

from hpcclear.base.terms import Term, Touching, Vector, named
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.linkage.closing import Closing
from hpcclear.dynamics.linkage.parts import Contact


class ContactWriter(Touching):
    """The terms of one contact."""

    def __init__(self, closing: Closing, k: int, contact: Contact, apart: Vector) -> None:
        self._closing, self._contact, self.apart = closing, contact, apart
        rows = at.CLEARANCE, at.BEARING_RADIUS, at.JOURNAL_RADIUS
        self.clearance, self.bearing_radius, self.journal_radius = (
            named(f"par[(joints[{k}].block + {row}) * W + i]") for row in rows
        )

    @property
    def across(self) -> Vector:
        """Of the line in the frame of its body."""
        return self._closing.direction(self._contact.joint).across()

    def parameter(self, entry: str) -> Term:
        """Named ``JOINT_ENTRY``."""
        return self._closing.writer.parameter(f"{self._contact.joint.name}_{entry}")

    def call(
        self, function: Callable[..., object], *terms: Term, results: tuple[str, ...]
    ) -> tuple[Term, ...]:
        """A statement, with the contact in the names of its results."""
        names = [f"{name}_{self._contact.word}" for name in results]
        return self._closing.writer.call(function, terms, names)
