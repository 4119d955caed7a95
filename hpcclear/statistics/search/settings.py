"""Settings of the swarm."""

from dataclasses import dataclass


@dataclass(frozen=True)
class SwarmSettings:
    """The defaults are the one documented setting; what a study sets of them its scene has checked."""

    particles: int = 100
    c1: float = 1.8  # pull to the particle's own best
    c2: float = 1.8  # pull to its leader
    inertia_first: float = 1.2  # w_max of eq. 23
    inertia_last: float = 0.1  # w_min of eq. 23
    speed_limit: float = 0.5  # of each variable's range, per iteration
    mutation_share: float = 0.2
    mutation_index: float = 20.0  # of the polynomial distribution; larger is nearer
    archive_capacity: int = 400
    tournament: int = 3
