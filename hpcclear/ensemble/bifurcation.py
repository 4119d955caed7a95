"""`map --bifurcation`: one entry of a scene over a range, and what the motion does once a revolution at each value."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.objectives import MEAN_GAP, Objective
from hpcclear.base.outcome import Status
from hpcclear.dynamics.response import simulated
from hpcclear.ensemble.identity import sample_key
from hpcclear.ensemble.maps import cells
from hpcclear.ensemble.session import Finished, Options, Session
from hpcclear.ensemble.single import SHORTEST, responses_of
from hpcclear.ranks.team import Ranks
from hpcclear.report.figures import motion
from hpcclear.results import dataset
from hpcclear.results.content import Results
from hpcclear.results.places import Place
from hpcclear.results.signals import Signal, is_counted, signal
from hpcclear.scene import Scene

REDUCED: "dict[str, Callable[[Array], float]]" = {
    "max": np.max, "min": np.min, "mean": np.mean, "number": np.sum
}  # fmt: skip
"""What may stand before the name of a signal: of a revolution, at the stored instants, in place of a section; of events it is
their number unless another word stands there."""

OBJECTIVE = "objective"
"""Name of the mean gap, f of eq. 13, of each revolution."""


@dataclass(frozen=True)
class Observation:
    """What is observed once a revolution."""

    name: str = OBJECTIVE
    """``objective``, a signal (`hpcclear.results.signals`) such as "slider_velocity", or a word of `REDUCED` and one."""
    section: float = 0.0
    """Crank angle at which a series is taken, rad."""
    transient: int = 60
    revolutions: int = 60
    """transient and revolutions: how many are left out and observed."""

    @property
    def reduced(self) -> str:
        """What is made of the instants of a revolution: a word of `REDUCED`; "" at the section."""
        word = self.name.partition(" ")[0]
        return word if word in REDUCED else "number" if is_counted(self.name) else ""

    def of(self, response: Results) -> Signal:
        """The signal that is observed; raises InputError where the response lacks this name."""
        word, _, rest = self.name.partition(" ")
        return signal(response, rest if word in REDUCED else self.name, "--observe")

    def described(self, response: Results) -> Objective:
        """Its unit and words, of a short response."""
        if self.name == OBJECTIVE:
            return replace(MEAN_GAP, name=OBJECTIVE, words="mean gap of each revolution")
        seen, word = self.of(response), self.reduced
        at = f"at crank angle {np.degrees(self.section):g} deg"
        words = f"{seen.label}, {f'{word} of each revolution' if word else at}"
        return replace(MEAN_GAP, name=self.name, unit=seen.unit, words=words)

    def __call__(self, scene: Scene, response: Results) -> Array:
        """Values of revolutions, NaN of a failed simulation, and flags and status of the response, (revolutions + 2,)."""
        said = [float(response[name]) for name in ("flags", "status")]
        return np.append(self._seen(response), said)

    def _seen(self, response: Results) -> Array:
        nothing = np.full(self.revolutions, np.nan)
        if not Status(int(response["status"])).valid:
            return nothing
        shown = motion.steady(response, self.revolutions)
        if self.name == OBJECTIVE:
            return motion.objective_by_turn(shown)[-self.revolutions :]
        values, word = self.of(shown).values, self.reduced
        if not word:
            return motion.section(shown, values, self.section)[-self.revolutions :]
        turn = motion.turns(shown) - motion.turns(shown)[-1] + self.revolutions
        place = np.clip(np.floor(turn + 1e-9).astype(int), 0, self.revolutions - 1)
        return np.array([REDUCED[word](values[place == k]) for k in range(self.revolutions)])


def run_bifurcation(
    scene: Scene,
    axis: str,
    output: Path,
    ranks: Ranks,
    observation: Observation = Observation(),
    options: Options = Options(),
) -> Finished:
    """Simulate a scene at each value of an entry (``PATH=LO:HI:N``) on all ranks, and write what is observed of each
    revolution; on root. Raises InputError, StorageError, Stopped, RankFailed.
    """
    place = Place.of_file(output, options.fresh)
    points, _ = cells(scene, (axis,))
    varied, count = points.values[:, 0], observation.revolutions
    key = {**sample_key(scene, points), "command": "bifurcation", "observation": repr(observation)}

    def make(session: Session) -> Results:
        changes = {
            "study": None,
            "numerics.target_error": None,
            "numerics.transient_revolutions": observation.transient,
            "numerics.averaged_revolutions": count,
        }
        variants = [dict.fromkeys(points.paths[0], float(one)) for one in varied]
        long = scene.with_(changes)
        short = simulated(long.with_({**variants[0], **SHORTEST}), checked=False)
        asked = long, variants, observation, (count + 2,), ranks, "bifurcation"
        *observed, flags, status = responses_of(*asked, checkpoint=session.opened(scene))[:, 0].T
        coords = {"value": np.arange(len(points)), "crossing": np.arange(count)}
        data = {
            points.names[0]: varied,
            "observed": np.transpose(observed),
            "flags": flags.astype(np.int8),
            "status": status.astype(np.int8),
        }
        about = session.attributes, points.units, observation.described(short), points.words
        return session.write(dataset.dataset("bifurcation", coords, data, *about))

    return Session(place, key, ranks, options).finished(make)
