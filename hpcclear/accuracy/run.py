"""The `accuracy` command: panels one after the other, measured, kept, written, drawn."""

from collections.abc import Callable
from functools import cache, partial
from pathlib import Path

import numpy as np

from hpcclear.accuracy import averaging, integration, parallel, random_inputs, spending, surrogate
from hpcclear.accuracy.profile import Profile, Variables
from hpcclear.accuracy.standin import with_case
from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.base.objectives import MEAN_GAP
from hpcclear.base.outcome import Status
from hpcclear.dynamics.evaluation import evaluate_records
from hpcclear.dynamics.evaluation.steady.wording import in_a_line
from hpcclear.ensemble.identity import run_key
from hpcclear.ensemble.session import Options, Session, command_line
from hpcclear.ranks.team import Ranks
from hpcclear.results import dataset
from hpcclear.results.checkpoint import Checkpoint
from hpcclear.results.content import Results
from hpcclear.results.names import KINDS
from hpcclear.results.places import Place
from hpcclear.results.provenance import program
from hpcclear.scene import Scene
from hpcclear.scene.points import Points
from hpcclear.statistics.surrogate.piecewise import Leaf

GLANCE = 1e-2
"""Target error of f at which the kind of motion is judged."""

Notify = Callable[[str], object]
Simulate = Callable[[Scene, str, Profile, Ranks], tuple[Array, float]]


class Panels:
    """Panels one after the other; what was kept is not measured again.

    `notify` gets what is going on, a line at a time; `show` the dataset of all that is there whenever there is more of it;
    `store` keeps finished work.
    """

    def __init__(
        self, scene: Scene, ranks: Ranks, profile: Profile, notify: Notify, store: Checkpoint,
        show: Callable[[Results], object],
    ) -> None:  # fmt: skip
        self.scene, self.ranks, self.profile = scene, ranks, profile
        self._store, self._show, self._listener = store, show, notify
        self.values: Variables = {}
        self.attributes: dict[str, object] = {
            **scene.origin,
            **program(),
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

    def kept(self, name: str, work: Callable[[], Variables]) -> Variables:
        """What `work` gives, or gave before."""
        found = self._store.load_stage(name)
        if found is None:
            self.notify(name.replace("-", " "))
            found = work()
            self._store.save_stage(name, found)
        return found

    def panel(self, name: str, work: Callable[[], Variables]) -> None:
        """Add the variables of a panel."""
        self._add(self.kept(name, work))

    def _add(self, found: Variables) -> None:
        self.values.update(found)
        self._show(self.content(whole=False))

    def content(self, *, whole: bool = True) -> Results:
        """Kind ``accuracy``, of all that is there."""
        known = KINDS["accuracy"].coords
        coords = {name: value for name, value in self.values.items() if name in known}
        data = {name: value for name, value in self.values.items() if name not in known}
        return dataset.dataset("accuracy", coords, data, self.attributes, whole=whole)

    def add_motion(self) -> None:
        """What kind of motion it is, as an attribute."""

        def work() -> Variables:
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
        found = self._store.load_stage("copies")
        run = spending.Run.of(self.scene) if found is None else spending.Run(**found)
        if found is None:
            self.notify("tolerance and revolutions")
        else:
            self._add(spending.analyse(run))
        with self.ranks.stage("spending"):
            until, check = self.profile.segments, self.ranks.raise_if_stopped
            for longer in spending.measure(self.scene, run, until, check):
                self._store.save_stage("copies", vars(longer))
                self._add(spending.analyse(longer))

    def add_study(self) -> None:
        """Surrogates and random inputs: their simulations are kept apart from what follows from them."""
        studied, case, where = with_case(self.scene)
        self.attributes["study"] = where
        profile, ranks = self.profile, self.ranks

        def simulated(simulate: Simulate) -> Variables:
            values, each = simulate(studied, case, profile, ranks)
            return {"values": values, "each": np.array(each)}

        designs = self.kept("simulations-of-designs", partial(simulated, surrogate.simulate))
        seconds = float(designs["each"])

        @cache
        def fitted() -> tuple[Variables, Leaf]:
            return surrogate.measure(studied, case, profile, designs["values"], seconds)

        self.panel("surrogates", lambda: fitted()[0])
        draws = self.kept("simulations-of-draws", partial(simulated, random_inputs.simulate))

        def moments() -> Variables:
            values, each = draws["values"], float(draws["each"])
            return random_inputs.measure(studied, case, fitted()[1], profile, values, each)

        self.panel("random-inputs", moments)
        self.panel("ranks", lambda: parallel.measure(studied, case, seconds, profile, ranks))
        count = parallel.samples_of(seconds, profile)
        self.attributes["batch"] = f"ranks: {count} samples, or as many a rank"

    def measured(self) -> Results:
        """All panels of a scene with a clearance joint at least; on root. Returns results of kind ``accuracy``.

        Raises InputError if no joint has clearance, or the objective is of some joints.
        """
        scene, ranks, profile = self.scene, self.ranks, self.profile
        if scene.objective.joints:
            key, joints = "numerics.objective_joints", scene.numerics.objective_joints
            reason = "accuracy is measured for all joints together"
            remedy = "Leave the joints out for this command"
            raise InputError(key, joints, reason, remedy)
        if not scene.clearance_joints():
            reason = "the objective is 0 without clearance"
            raise InputError("joints", "ideal", reason, "Give a joint clearance")
        self._listener("compilation")
        studied, case, _ = with_case(scene)
        surrogate.simulated_middle(studied, case, ranks)  # first of all, so that its time is seen
        self.add_motion()
        self.add_spending()
        with ranks.stage("integration"):
            self.panel("integration", lambda: integration.measure(scene, profile, self.notify))
        with ranks.stage("averaging"):
            self.panel("averaging", lambda: averaging.measure(scene, profile))
        self.add_study()
        return self.content()


FILE = "accuracy.nc"


def run_accuracy(
    scene: Scene, directory: Path, ranks: Ranks, profile: Profile, notify: Notify, options: Options = Options()
) -> tuple[Results, dict[str, Path]]:  # fmt: skip
    """Measure, write ``accuracy.nc`` and the figures; the dataset and the files by what they show.

    Each figure is written as soon as its panel is measured, and what is measured is kept: the same command goes on from
    there. `notify` gets what is going on, a line at a time. Raises InputError, StorageError, Stopped, RankFailed.
    """
    from hpcclear.report.figures import accuracy as accuracy_figures, style

    style.matplotlib()  # said before the measuring, not after
    place = Place.of_directory(directory, options.fresh)
    key = {**run_key(scene, "accuracy"), "profile": profile.name}
    drawn: dict[str, Path] = {}
    shown: dict[str, list[bytes]] = {}

    def draw(content: Results) -> None:
        """Figures of what is there, and was not when they were drawn."""
        for figure, (first, *more) in accuracy_figures.SHOWN.items():
            if first not in content:
                continue
            name = figure.__name__.removesuffix("_figure")
            found = [content[one].values.tobytes() for one in (first, *more) if one in content]
            if found != shown.get(name):
                drawn[name] = style.save(figure(content), place.output / f"{name}.png")
                shown[name] = found

    with Session(place, key, ranks, options) as session:
        if session.has_all([FILE]):
            content = dataset.read(place.output / FILE, "accuracy")
        else:
            store = session.opened(scene)
            content = Panels(scene, ranks, profile, notify, store, draw).measured()
            content.attrs.update(session.attributes)
            dataset.write(content, place.output / FILE)
            shown.clear()  # all say now what they were made of
        draw(content)
        session.close(session.attributes)
    return content, {"accuracy": place.output / FILE, **drawn}
