"""Panels of the `accuracy` command, one after the other: what was measured is kept, and goes into one dataset."""

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import numpy as np

from hpcclear.accuracy import averaging, integration, parallel, random_inputs, spending, surrogate
from hpcclear.accuracy.looked_at import quantities_of
from hpcclear.accuracy.profile import Profile
from hpcclear.accuracy.standin import with_case
from hpcclear.base.objectives import MEAN_GAP
from hpcclear.base.outcome import Status
from hpcclear.dynamics.evaluation import evaluate_records
from hpcclear.dynamics.evaluation.steady.wording import in_a_line
from hpcclear.ensemble.session import command_line
from hpcclear.ranks.team import Ranks
from hpcclear.results import dataset
from hpcclear.results.checkpoint import Checkpoint
from hpcclear.results.content import Results
from hpcclear.results.names import KINDS
from hpcclear.results.provenance import provenance
from hpcclear.scene import Scene
from hpcclear.scene.points import Points

GLANCE = 1e-2
"""Target error of f at which the kind of motion is judged."""

Values = Mapping[str, Any]
Notify = Callable[[str], object]


class Panels:
    """Panels one after the other; what was kept is not measured again.

    Parameters
    ----------
    notify : callable
        Gets what is going on, a line at a time.
    show : callable
        Gets the dataset of all that is there whenever there is more of it.
    """

    def __init__(
        self,
        scene: Scene,
        ranks: Ranks,
        profile: Profile,
        notify: Notify,
        store: Checkpoint | None,
        show: Callable[[Results], object],
    ) -> None:
        self.scene, self.ranks, self.profile = scene, ranks, profile
        self._store, self._show = store, show
        self._listener = notify
        self.values: dict[str, Any] = {}
        self.attributes: dict[str, Any] = {
            **provenance(scene.text or scene.to_toml(), scene.hash, scene.references),
            "profile": profile.name,
            "command": command_line(),
            "designs": f"integration: {profile.designs} designs near the scene, one revolution from the start",
            "repeats": f"medians of {profile.repeats} runs ({profile.outside_repeats} for scipy's solvers)",
            "copies": f"averaging: {profile.copies} copies over {profile.revolutions} revolutions",
            "mpi_ranks": ranks.size,
        }

    def notify(self, text: str) -> None:
        """Say what is going on, after looking whether the run shall stop."""
        self.ranks.raise_if_stopped()
        self._listener(text)

    def kept(self, name: str, work: Callable[[], Values]) -> Values:
        """What `work` gives, or gave before."""
        found = self._stored(name)
        if found is None:
            self.notify(name.replace("-", " "))
            found = dict(work())
            self._save(name, found)
        return found

    def _stored(self, name: str) -> dict[str, Any] | None:
        return None if self._store is None else self._store.load_stage(name)

    def _save(self, name: str, data: Values) -> None:
        if self._store is not None:
            self._store.save_stage(name, data)

    def panel(self, name: str, work: Callable[[], Values]) -> None:
        """Add the variables of a panel."""
        self.values.update(self.kept(name, work))
        self._show(self.content(whole=False))

    def content(self, *, whole: bool = True) -> Results:
        """Kind ``accuracy``, of all that is there."""
        known = KINDS["accuracy"].coords
        coords = {name: value for name, value in self.values.items() if name in known}
        data = {name: value for name, value in self.values.items() if name not in known}
        return dataset.dataset("accuracy", coords, data, self.attributes, whole=whole)

    def add_integration(self) -> None:
        """Error of one revolution against time, for every method."""
        with self.ranks.stage("integration"):
            self.panel(
                "integration",
                lambda: _integration(
                    integration.measure(self.scene, self.profile, self.notify), self.scene
                ),
            )

    def add_averaging(self) -> None:
        """Error of f against revolutions."""
        with self.ranks.stage("averaging"):
            self.panel("averaging", lambda: _averaging(averaging.measure(self.scene, self.profile)))

    def add_motion(self) -> None:
        """What kind of motion it is, as an attribute."""

        def work() -> Values:
            scene = self.scene.with_(
                {"numerics.target_error": GLANCE, "numerics.objective_joints": ()}
                | {self.scene.objective_key: MEAN_GAP.name}  # which a steady mean is of
            )
            with self.ranks.stage("motion"):
                record = evaluate_records(scene, Points((), np.empty((1, 0)), ()))[0]
            status = Status(int(record["status"]))
            return {"words": np.array(in_a_line(record) if status.valid else status.message)}

        self.attributes["motion"] = str(self.kept("motion", work)["words"])

    def add_spending(self) -> None:
        """Error of a steady mean against time; goes on from the copies that were kept, a doubling at a time."""
        found = self._stored("copies")
        run = spending.Run.of(self.scene) if found is None else spending.Run(**found)
        if found is None:
            self.notify("tolerance and revolutions")
        else:
            self._shown(run)
        with self.ranks.stage("spending"):
            until, check = self.profile.segments, self.ranks.raise_if_stopped
            for longer in spending.measure(self.scene, run, until, check):
                self._save("copies", vars(longer))
                self._shown(longer)

    def _shown(self, run: spending.Run) -> None:
        self.values.update(_spending(spending.analyse(run)))
        self._show(self.content(whole=False))

    def add_study(self) -> None:
        """Surrogates and random inputs: their simulations are kept apart from what follows from them."""
        studied, case, where = with_case(self.scene)
        self.attributes["study"] = where
        profile, ranks = self.profile, self.ranks

        def simulated(part: Any) -> Callable[[], Values]:
            def work() -> Values:
                values, each = part.simulate(studied, case, profile, ranks)
                return {"values": values, "each": each}

            return work

        designs = self.kept("simulations-of-designs", simulated(surrogate))
        seconds = float(designs["each"])

        @cache
        def fitted() -> surrogate.Surrogates:
            return surrogate.measure(studied, case, profile, designs["values"], seconds)

        self.panel("surrogates", lambda: _surrogates(fitted()))
        draws = self.kept("simulations-of-draws", simulated(random_inputs))

        def moments() -> Values:
            values, each = draws["values"], float(draws["each"])
            return _random(
                random_inputs.measure(studied, case, fitted().model, profile, values, each)
            )

        self.panel("random-inputs", moments)
        self.panel(
            "ranks", lambda: _parallel(parallel.measure(studied, case, seconds, profile, ranks))
        )
        self.attributes["batch"] = (
            f"ranks: {parallel.samples_of(seconds, profile)} samples, or as many a rank"
        )


# ---- what is found, as the file has it ---------------------------------------------------------


def _spending(found: spending.Spending) -> Values:
    cheapest = np.array([found.cheapest(aim) for aim in spending.AIMS])
    return {
        "tolerance": found.tolerance,
        "spent": found.spent,
        "aim": np.array(spending.AIMS),
        "spent_error": found.error,
        "spent_model": found.model,
        "spent_seconds": found.seconds,
        "tolerance_bias": found.bias,
        "tolerance_bias_error": found.bias_error,
        "turn_variance": found.variance,
        "tolerance_seconds": found.turn_seconds,
        "spin_up": found.spin_up,
        "cheapest_tolerance": cheapest[:, 0],
        "cheapest_revolutions": cheapest[:, 1],
        "cheapest_seconds": cheapest[:, 2],
    }


def _integration(found: integration.Integration, scene: Scene) -> Values:
    names = ("setting", "error", "seconds", "evaluations", "order", "reference_error")
    return {
        "integrator": np.array(found.methods),
        "rung": np.arange(found.setting.shape[1]),
        "quantity": np.array(quantities_of(scene)),
        **{name: getattr(found, name) for name in names},
    }


def _averaging(found: averaging.Averaging) -> Values:
    return {
        "transient": found.transient,
        "averaged": found.averaged,
        "averaging_error": found.error,
        "averaging_floor": found.floor,
        "turn_seconds": found.seconds,
    }


def _surrogates(found: surrogate.Surrogates) -> Values:
    names = ("r2", "rmae", "leave_one_out", "fit_seconds", "sample_seconds")
    return {
        "surrogate": np.array(found.names),
        "training": found.training,
        **{name: getattr(found, name) for name in names},
    }


def _random(found: random_inputs.RandomInputs) -> Values:
    return {
        "estimate": np.array(random_inputs.ESTIMATES),
        "moment": np.array(random_inputs.MOMENTS),
        "draws": found.draws,
        "moment_error": found.error,
        "moment_lower": found.lower,
        "moment_upper": found.upper,
        "moment_seconds": found.seconds,
        "moment_bias": found.bias,
        "bias_error": found.bias_error,
        "closed_form": found.closed_form,
        "quadrature_seconds": found.quadrature_seconds,
    }


def _parallel(found: parallel.Parallel) -> Values:
    return {
        "ranks": found.ranks,
        "loss": np.array(parallel.LOSSES),
        "strong_seconds": found.strong,
        "weak_seconds": found.weak,
        "lost_seconds": found.lost,
    }
