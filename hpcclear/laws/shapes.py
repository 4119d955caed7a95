"""Shapes that laws may call: clipped to a range; NaN stays NaN."""


def clipped(x):
    """To [-1, 1]."""
    return max(min(x, 1.0), -1.0)


def share(x):
    """To [0, 1]."""
    return max(min(x, 1.0), 0.0)
