"""Laws in the lanes: the plain functions of a law as a text that motions have written out, vectorised like all that is here.

A text holds the law's functions in words that vectorise (`hpcclear.base.bits`, `hpcclear.dynamics.physics.powers`), and for
each one that reads the law's numbers from its joint's rows. It is named by its content.
"""

from hpcclear.laws.constant import with_constants
from hpcclear.laws.declared import VARYING, ContactLaw, Law
from hpcclear.laws.translate import written

HEAD = '''"""{title}, written by hpcclear.laws.sources."""

import math

from hpcclear.base.bits import no_less, no_more
from hpcclear.base.jit import lane_function
from hpcclear.dynamics.physics import powers
'''

_GIVEN = {
    "impact_speed": "1.0 / (inverse + (1.0 - active))",  # in flight 1 m/s, of no consequence
    "inverse_impact_speed": "inverse",
}
_SIGNATURES = {
    "contact": "par, row, depth, rate, inverse, active, i, W",
    "friction": "par, row, speed, force, deflection, deflection_rate, i, W",
}


def text_of(law: Law) -> str:
    """The text of a law; raises LawError if a function has more in it than arithmetic."""
    law = with_constants(law)
    parts = [HEAD.format(title=f"The {law.kind} law {law.name}")]
    for name, function in law.functions().items():
        parts += written(function, f"own_{name}", f"{law.name}.{name}")
    for name, formula in (_contact if isinstance(law, ContactLaw) else _friction)(law).items():
        head = f"@lane_function\ndef joint_{name}({_SIGNATURES[law.kind]}):"
        parts.append(f"{head}\n    return {formula}\n")
    return "\n\n".join(parts)


def _call(law: Law, name: str, **others: str) -> str:
    """The call of one of its functions, in words of `_SIGNATURES`; `others`: what is given otherwise."""
    rows = {number: f"par[(row + {k}) * W + i]" for k, number in enumerate(law.read)}
    varying = {name: _GIVEN.get(name, name) for name in VARYING[law.kind]}
    given = {**rows, **varying, **others}
    asked = law.arguments(law.functions()[name])
    return f"own_{name}({', '.join(given[one] for one in asked)})"


def _contact(law: Law) -> dict[str, str]:
    functions = law.functions()
    if "factor" in functions:
        elastic, kink = _call(law, "elastic"), _call(law, "factor")
        return {"force": f"no_less({elastic} * {kink}, 0.0)", "elastic": elastic, "kink": kink}
    force, at_rest = _call(law, "force"), _call(law, "force", rate="0.0")
    elastic = _call(law, "elastic") if "elastic" in functions else at_rest
    kink = _call(law, "kink") if "kink" in functions else f"{force} / ({elastic} + 1e-300)"
    return {"force": f"no_less({force}, 0.0)", "elastic": elastic, "kink": kink}


def _friction(law: Law) -> dict[str, str]:
    functions = law.functions()
    sides = [_call(law, f"kink_{k}") if f"kink_{k}" in functions else "0.0" for k in (0, 1)]
    found = {"ratio": _call(law, "ratio"), "low": sides[0], "high": sides[1]}
    if "deflection" in functions:
        found["deflection"] = _call(law, "deflection")
    return found
