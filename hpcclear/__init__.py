"""Robust design of mechanisms with clearance joints, as an MPI-parallel batch study.

Public names are loaded when they are first used, so that importing the package costs nothing:

- `load_scene`, `Scene`: a scene file, validated
- `simulate`: one response as an xarray Dataset
- `evaluate`: many designs as an xarray Dataset, in this process
- `map`, `bifurcation`, `wear`, `effects`: what the commands of these names make, as xarray Datasets
- `identify`: unknown clearances of a machine from a measured signal
- `grid`: a map of a file, its entries as coordinates
- `plan`: what a run will cost
- `run_study`, also as `study`: the whole study, on as many processes as are wanted
- `to_table`: a result as a pandas DataFrame
- `ContactLaw`, `FrictionLaw`, `Parameter`: what a law of one's own declares
- `Objective`: what an objective of one's own declares
"""

import sys

if sys.argv[:1] == ["-m"] and "hpcclear" in sys.orig_argv and not sys.flags.safe_path:
    del sys.path[0]  # `python -m hpcclear`: the current directory, where any file may lie

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import hpcclear.identify as identify
    import hpcclear.study as study
    from hpcclear.accuracy.plan import plan
    from hpcclear.base.objectives import Objective
    from hpcclear.dynamics.response import simulate
    from hpcclear.ensemble.api import evaluate
    from hpcclear.ensemble.functions import bifurcation, map, wear
    from hpcclear.laws.declared import ContactLaw, FrictionLaw, Parameter
    from hpcclear.report.tables import to_table
    from hpcclear.results.grids import grid
    from hpcclear.scene import Scene, load_scene
    from hpcclear.study import run_study
    from hpcclear.study.api import effects

__version__ = "1.0.0"

__all__ = [
    "ContactLaw",
    "FrictionLaw",
    "Objective",
    "Parameter",
    "Scene",
    "bifurcation",
    "effects",
    "evaluate",
    "grid",
    "identify",
    "load_scene",
    "map",
    "plan",
    "run_study",
    "simulate",
    "study",
    "to_table",
    "wear",
]

_HOME = {
    "ContactLaw": "laws.declared",
    "FrictionLaw": "laws.declared",
    "Objective": "base.objectives",
    "Parameter": "laws.declared",
    "Scene": "scene",
    "load_scene": "scene",
    "simulate": "dynamics.response",
    "bifurcation": "ensemble.functions",
    "effects": "study.api",
    "evaluate": "ensemble.api",
    "grid": "results.grids",
    "identify": "identify",
    "map": "ensemble.functions",
    "plan": "accuracy.plan",
    "study": "study",
    "wear": "ensemble.functions",
    "run_study": "study",
    "to_table": "report.tables",
}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module = import_module(f".{_HOME[name]}", __name__)
    return module if name == _HOME[name] else getattr(module, name)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
