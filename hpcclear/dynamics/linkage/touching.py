"""What a geometry of contact may use of the motion that it is written into (`hpcclear.scene.contacts`)."""

from collections.abc import Callable

from hpcclear.dynamics import layout as at
from hpcclear.dynamics.linkage.closing import Closing
from hpcclear.dynamics.linkage.expression import Term, Vector, named
from hpcclear.dynamics.linkage.parts import Contact


class Touching:
    """The motion as one contact sees it; terms as of `acting.Acting`.

    `apart`: position of the journal's place relative to the bearing's, m.
    """

    def __init__(self, closing: Closing, k: int, contact: Contact, apart: Vector) -> None:
        self._closing, self._k, self._contact, self.apart = closing, k, contact, apart

    def parameter(self, entry: str) -> Term:
        """One of the joint's numbers, by its entry."""
        return self._closing.writer.parameter(f"{self._contact.joint.name}_{entry}")

    @property
    def across(self) -> Vector:
        """Unit vector to the left of the joint's line."""
        return self._closing.direction(self._contact.joint).across()

    @property
    def clearance(self) -> Term:
        """Of the contact's `Shape`, m."""
        return self._number(at.CLEARANCE)

    @property
    def bearing_radius(self) -> Term:
        """Of the contact's `Shape`, m."""
        return self._number(at.BEARING_RADIUS)

    @property
    def journal_radius(self) -> Term:
        """Of the contact's `Shape`, m."""
        return self._number(at.JOURNAL_RADIUS)

    def _number(self, row: int) -> Term:
        return named(f"par[(joints[{self._k}].block + {row}) * W + i]")

    def call(
        self, function: Callable[..., object], *terms: Term, results: tuple[str, ...]
    ) -> tuple[Term, ...]:
        """What a function of numbers returns, by names: one without branches, of arithmetic, ``abs`` and ``np.sqrt``."""
        names = [f"{name}_{self._contact.word}" for name in results]
        return self._closing.writer.call(function, terms, names)
