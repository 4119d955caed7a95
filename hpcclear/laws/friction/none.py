"""No friction."""

from hpcclear.laws.declared import FrictionLaw


def ratio(speed):
    """Nothing."""
    return 0.0 * speed


LAW = FrictionLaw(words="no friction", ratio=ratio)
