"""Unknown clearances of a machine from a measured signal: posterior distribution, model check, what to measure.

- `signals`, `measured`: signals by name as harmonics of the crank, of a response and of a table; sensors
- `inputs`, `training`: what is not known, and an ensemble of machines as they may be
- `features`, `summaries`: harmonics, third octaves, scatter; regressions of the inputs on them
- `posterior`, `judgement`: models of the summaries, posterior by sequential Monte Carlo, calibration, model check
- `history`, `advice`: growth over several dates; which signal to measure
- `answer`, `api`: the command and the Python function
"""

import sys
from inspect import signature
from types import ModuleType

from hpcclear.identify.api import identify

__all__ = ["identify"]


class _Identify(ModuleType):
    """This package, which can be called: ``hpcclear.identify(scene, unknown, signal)`` stands beside ``hpcclear.map``."""

    __call__ = staticmethod(identify)
    # Python before 3.13 would leave out the first parameter
    __signature__ = signature(identify)


sys.modules[__name__].__class__ = _Identify
