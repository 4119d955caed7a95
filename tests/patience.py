"""Waits and grace times on a machine that others use as well."""

import os


def crowded(seconds: float) -> float:
    """`seconds` of a quiet machine, as long as they may take at the present load: twice the processes a core.

    For the limit of a wait for what would hang otherwise, and for how soon something ends.
    """
    share = max(os.getloadavg()[:2]) / (os.cpu_count() or 1)
    return seconds * max(2.0, 2.0 * share)
