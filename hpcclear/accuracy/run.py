"""The `accuracy` command: every panel measured, written, drawn."""

from collections.abc import Callable
from pathlib import Path

from hpcclear.accuracy import averaging, integration, surrogate
from hpcclear.accuracy.panels import Notify, Panels
from hpcclear.accuracy.profile import Profile
from hpcclear.accuracy.standin import with_case
from hpcclear.base.errors import InputError
from hpcclear.ensemble.identity import run_key
from hpcclear.ensemble.session import DEFAULT_OPTIONS, Options, Place, Session
from hpcclear.ranks.team import Ranks
from hpcclear.results import dataset
from hpcclear.results.checkpoint import Checkpoint
from hpcclear.results.content import Results
from hpcclear.scene import Scene

FILE = "accuracy.nc"


def measure(
    scene: Scene,
    ranks: Ranks,
    profile: Profile,
    notify: Notify = lambda text: None,
    store: Checkpoint | None = None,
    show: Callable[[Results], object] = lambda content: None,
) -> Results:
    """Measure what accuracy costs for a scene with a clearance joint at least; on root. Returns results of kind ``accuracy``.

    `notify` gets what is going on, a line at a time; the store keeps finished work; `show` gets the dataset of all that is
    there whenever there is more of it. Raises InputError if both joints are ideal: the objective is 0 then, whatever the
    settings.
    """
    if scene.objective.joints:
        key, joints = "numerics.objective_joints", scene.numerics.objective_joints
        reason, remedy = (
            "accuracy is measured for all joints together",
            "Leave the joints out for this command",
        )
        raise InputError(key, joints, reason, remedy)
    if not scene.clearance_joints():
        reason = "the objective is 0 without clearance"
        raise InputError("joints", "ideal", reason, "Give a joint clearance")
    panels = Panels(scene, ranks, profile, notify, store, show)
    notify("compilation")
    studied, case, _ = with_case(scene)
    surrogate.simulated_middle(studied, case, ranks)  # first of all, so that its time is seen
    panels.add_motion()
    panels.add_spending()
    panels.timed_panel("integration", lambda: integration.measure(scene, profile, panels.notify))
    panels.timed_panel("averaging", lambda: averaging.measure(scene, profile))
    panels.add_study()
    return panels.content()


def run_accuracy(
    scene: Scene,
    directory: Path,
    ranks: Ranks,
    profile: Profile,
    notify: Notify,
    options: Options = DEFAULT_OPTIONS,
) -> tuple[Results, dict[str, Path]]:
    """Measure, write ``accuracy.nc`` and the figures; the dataset and the files by what they show.

    Each figure is written as soon as its panel is measured, and what is measured is kept: the same command goes on from
    there. `notify` gets what is going on, a line at a time. Raises InputError, StorageError, Stopped, RankFailed.
    """
    from hpcclear.report.figures import accuracy as accuracy_figures
    from hpcclear.report.figures import style

    style.matplotlib()  # said before the measuring, not after
    place = Place.of_directory(directory, options.fresh)
    key = {**run_key(scene, "accuracy"), "profile": profile.name}
    drawn: dict[str, Path] = {}
    shown: dict[str, list[bytes]] = {}

    def draw(content: Results) -> None:
        """Figures of what is there, and was not when they were drawn."""
        for name, figure in accuracy_figures.FIGURES.items():
            first, *more = accuracy_figures.MAIN[name]
            if first not in content:
                continue
            found = [content[one].values.tobytes() for one in (first, *more) if one in content]
            if found != shown.get(name):
                drawn[name] = style.save(figure(content), place.output / f"{name}.png")
                shown[name] = found

    with Session(place, key, ranks, options) as session:
        if session.has_all([FILE]):
            content = dataset.read(place.output / FILE, "accuracy")
        else:
            session.describe(scene)
            store = session.opened()
            content = measure(scene, ranks, profile, notify, store, draw)
            content.attrs.update(session.attributes)
            dataset.write(content, place.output / FILE)
            shown.clear()  # all say now what they were made of
        draw(content)
        session.close(session.attributes)
    return content, {"accuracy": place.output / FILE, **drawn}
