"""The scenes that the benchmarks share: the paper's mechanism, its contact laws, and designs from Table 3's box."""

import re
import tomllib
from pathlib import Path
from typing import NamedTuple

from hpcclear.base.arrays import Array
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.layout.views import Start
from hpcclear.dynamics.setup.parameters import parameters
from hpcclear.dynamics.setup.problem import problem_of
from hpcclear.dynamics.setup.start import start_states
from hpcclear.dynamics.stepping.problem import Problem
from hpcclear.scene import Scene, load_scene
from hpcclear.scene.points import Points, latin_hypercube

ROOT = Path(__file__).parent.parent
JOB = ROOT / "jobs" / "quickstart.toml"

LAWS = {
    "hunt-crossley": [
        "effects.contact={law='hunt-crossley', damping=0.5}",
        "effects.friction={law='coulomb', coefficient=0.01, ramp_speed=0.01}",
    ],
    "frictionless": [
        "effects.contact={law='hunt-crossley', damping=0.5}",
        "effects.friction={law='none'}",
    ],
    "lankarani-nikravesh": [
        "effects.contact={law='lankarani-nikravesh', restitution=0.9}",
        "effects.friction={law='coulomb', coefficient=0.01, ramp_speed=0.01}",
    ],
}


class Setup(NamedTuple):
    """What the kernel and the yardstick read."""

    problem: Problem
    par: Array  # (m, PARAMETERS)
    start: Start


def of_page(page: str, title: str) -> Scene:
    """The scene that a page of docs/ has readers write to a file of this title."""
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    (block,) = re.findall(rf'```toml title="{re.escape(title)}"\n(.*?)```', text, re.DOTALL)
    return load_scene(tomllib.loads(block))


def scene(
    law: str, rtol: float, transient: int, averaged: int, *, clearance: float | None = None
) -> Scene:
    """The paper's slider-crank with one of `LAWS`; clearance in m at both joints."""
    overrides = [
        *LAWS[law],
        f"numerics.rtol={rtol!r}",
        f"numerics.transient_revolutions={transient}",
        f"numerics.averaged_revolutions={averaged}",
    ]
    if clearance is not None:
        overrides += [
            f"joints.{joint}.clearance={clearance!r}" for joint in ("crank_rod", "rod_slider")
        ]
    return load_scene(JOB, overrides)


def setup(chosen: Scene, points: Points | None = None) -> Setup:
    """Problem, parameters and start states; without friction its coefficient is 0 for codes that always ask."""
    par = parameters(chosen, points)
    if chosen.effects.friction.law == "none":
        for joint in at.JOINTS[:2]:
            par[:, joint.block + at.FRICTION_NUMBERS] = 0.0
    return Setup(problem_of(chosen), par, start_states(chosen, par, points))


def single(chosen: Scene) -> Setup:
    """One sample: the scene itself."""
    return setup(chosen)


def ensemble(chosen: Scene, samples: int) -> Setup:
    """A Latin hypercube of Table 3's box."""
    return setup(chosen, latin_hypercube(chosen, samples))
