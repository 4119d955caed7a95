"""Robust design of mechanisms with clearance joints, as an MPI-parallel batch study.

Public names are loaded when they are first used, so that importing the package costs nothing:

- `load_scene`, `Scene`: a scene file, validated
- `simulate`: one response as an xarray Dataset
- `evaluate`: many designs as an xarray Dataset, in this process
- `grid`: a map, its entries as coordinates
- `run_study`: the whole study
- `to_table`: a result as a pandas DataFrame
- `ContactLaw`, `FrictionLaw`, `Parameter`: what a law of one's own declares
- `Objective`: what an objective of one's own declares
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hpcclear.base.objectives import Objective
    from hpcclear.dynamics.laws.declared import ContactLaw, FrictionLaw, Parameter
    from hpcclear.dynamics.response import simulate
    from hpcclear.ensemble.api import evaluate
    from hpcclear.ensemble.maps import grid
    from hpcclear.report.tables import to_table
    from hpcclear.scene import Scene, load_scene
    from hpcclear.study import run_study

__version__ = "0.1.0"

__all__ = [
    "ContactLaw",
    "FrictionLaw",
    "Objective",
    "Parameter",
    "Scene",
    "evaluate",
    "grid",
    "load_scene",
    "run_study",
    "simulate",
    "to_table",
]

_HOME = {
    "ContactLaw": "dynamics.laws.declared",
    "FrictionLaw": "dynamics.laws.declared",
    "Objective": "base.objectives",
    "Parameter": "dynamics.laws.declared",
    "Scene": "scene",
    "load_scene": "scene",
    "simulate": "dynamics.response",
    "evaluate": "ensemble.api",
    "grid": "ensemble.maps",
    "run_study": "study",
    "to_table": "report.tables",
}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f".{_HOME[name]}", __name__), name)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
