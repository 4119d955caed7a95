"""How many cores this process may use by itself."""

from hpcclear.base import host

_state = {"alone": True}


def among_ranks() -> None:
    """Say that other processes of this run share the cores."""
    _state["alone"] = False


def own_cores() -> int:
    """Cores that this process may use: one where it is a rank among others."""
    if not _state["alone"]:
        return 1
    return len(host.cores())
