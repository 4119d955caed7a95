"""How many cores this process may use by itself."""

import os

_state = {"alone": True}


def among_ranks() -> None:
    """Say that other processes of this run share the cores."""
    _state["alone"] = False


def own_cores() -> int:
    """Cores that this process may use: one where it is a rank among others."""
    if not _state["alone"]:
        return 1
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
