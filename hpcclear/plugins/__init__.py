"""The one place where laws, objectives, distributions, surrogates and searches are found by their names.

A name in a scene file is one of ours (``"normal"``), that of an installed package's entry point, or ``"module:Name"``: `Name`
of the Python file ``module.py`` beside the scene file. See `Registry`, and docs/extending.md for what each kind has to offer.
"""

from collections.abc import Callable

from hpcclear.base.objectives import LEVEL, OURS, Objective, level_of
from hpcclear.plugins.registry import Registry
from hpcclear.plugins.sources import run_source, trusting, using

__all__ = [
    "CONTACT_LAWS", "DISTRIBUTIONS", "FRICTION_LAWS", "KINDS", "OBJECTIVES", "SEARCHES", "SURROGATES", "Registry",
    "run_source", "trusting", "using",
]  # fmt: skip

CONTACT_LAWS = Registry[object]("contact law", "hpcclear.contact_laws")
FRICTION_LAWS = Registry[object]("friction law", "hpcclear.friction_laws")
OBJECTIVES = Registry[Objective]("objective", "hpcclear.objectives")
DISTRIBUTIONS = Registry[Callable[..., object]](
    "distribution", "hpcclear.distributions", needs=("ppf",)
)
SURROGATES = Registry[Callable[..., object]]("surrogate", "hpcclear.surrogates")
SEARCHES = Registry[Callable[..., object]]("search", "hpcclear.searches")

for _name, _objective in OURS.items():
    OBJECTIVES.add(_name, _objective)
OBJECTIVES.add_family(LEVEL, level_of)
SURROGATES.add("kriging")
SEARCHES.add("swarm")
for _name in ("AGEMOEA", "AGEMOEA2", "GDE3", "NSGA2", "NSGA3", "RVEA", "SMSEMOA", "UNSGA3"):
    SEARCHES.add(f"pymoo:{_name}")

KINDS = (CONTACT_LAWS, FRICTION_LAWS, OBJECTIVES, DISTRIBUTIONS, SURROGATES, SEARCHES)
"""Every registry."""
