"""Surfaces of a joint that are out of round, as in the scene file."""

from hpcclear.scene.fields import Length, Table, invalid
from hpcclear.scene.film import Film

MOST_WAVES = 8
"""Around a surface."""

Wave = Length


class Waves(Table):
    """Depth of a surface below the round one, m: a Fourier series in the angle around it. The angle is measured from
    the x axis of the body; in a slider-crank this axis points from the first joint of a link to its second.
    """

    cosine_1: Wave = 0.0
    sine_1: Wave = 0.0
    cosine_2: Wave = 0.0
    sine_2: Wave = 0.0
    cosine_3: Wave = 0.0
    sine_3: Wave = 0.0
    cosine_4: Wave = 0.0
    sine_4: Wave = 0.0
    cosine_5: Wave = 0.0
    sine_5: Wave = 0.0
    cosine_6: Wave = 0.0
    sine_6: Wave = 0.0
    cosine_7: Wave = 0.0
    sine_7: Wave = 0.0
    cosine_8: Wave = 0.0
    sine_8: Wave = 0.0

    def given(self) -> int:
        """The number of the last wave that is not zero."""
        found = [
            n for n in range(1, MOST_WAVES + 1)
            if getattr(self, f"cosine_{n}") or getattr(self, f"sine_{n}")
        ]  # fmt: skip
        return max(found, default=0)

    def deepest(self) -> float:
        """What the depth can come to at most, m."""
        return sum(abs(getattr(self, name)) for name in type(self).model_fields)


class OutOfRound(Table):
    """Waviness of the surfaces of a joint with clearance. A surface without an entry is round."""

    bearing: Waves | None = None
    journal: Waves | None = None


def check_waves(waves: OutOfRound | None, clearance: float, film: Film | None) -> None:
    """An error for validators unless some clearance is left everywhere around, m, and the joint is dry."""
    if waves is None:
        return
    if film is not None:
        raise invalid(
            "an oil film needs round surfaces", "Remove out_of_round, or film",
            key="out_of_round", value=None,
        )  # fmt: skip
    for name in ("bearing", "journal"):
        own = getattr(waves, name)
        if own is not None and own.deepest() >= clearance:
            raise invalid(
                f"waves are up to {own.deepest():g} m high, but the clearance is {clearance:g} m: the journal may not fit",
                "Make them smaller than the clearance",
                key=f"out_of_round.{name}",
                value=own.deepest(),
            )
