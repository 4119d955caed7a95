"""Commands that are killed at a moment of chance and given again: their words, small enough for many kills, and the trial."""

import random
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import commands
import losses
from commands import ROOT, overrides
from losses import Loss
from mpi_programs import formula

from hpcclear.results.checkpoint import INTERVAL as CHECKPOINT_INTERVAL

JOBS = ROOT / "jobs"
INTERVAL = 0.5  # s
OPTIONS = ("--checkpoint-interval", str(INTERVAL), "--progress", "quiet")
SHORT = overrides(
    "numerics.transient_revolutions=1",
    "numerics.averaged_revolutions=1",
    "numerics.max_steps=20000",
)


@dataclass(frozen=True)
class Command:
    """A command, and what may become of it when it is killed."""

    words: Callable[[Path], list[str]]
    """Words that put the results into a folder."""
    ranks: int = 2
    """0: without mpiexec."""
    interval: float | None = INTERVAL
    """Seconds between two saves of what is finished; None: nothing is kept, and the same command starts anew."""
    elsewhere: bool = True
    """Whether it ends on another number of ranks, which changes no byte."""
    again: frozenset[int] = frozenset({0})
    """Exit codes of the same command afterwards."""


def study(folder: Path) -> list[str]:
    """A study in which every stage is small."""
    scene = folder.parent / "study.toml"
    scene.write_text(commands.SCENE.read_text().partition("[study]")[0] + formula.STUDY)
    words = ["run", str(scene), "-o", str(folder), "--progress", "quiet"]
    return [*words, *overrides(*commands.CHEAP)]


def _points(folder: Path) -> list[str]:
    table = folder.parent / "points.csv"
    # a chain of bars between two pins of the ground
    table.write_text("name,x [mm],y [mm]\nA,0,0\nB,0,40\nC,110,80\nD,100,0\n")
    return ["init", "--import", str(table), str(folder / "linkage.toml")]


def _table(folder: Path) -> list[str]:
    """Export of samples that are made beside the folder, once."""
    source = folder.parent / "samples.nc"
    if not source.exists():
        code, output = commands.run(commands.sample(source, 300, *SHORT, *OPTIONS), 0)
        assert code == 0, output
    return ["export", str(source), "-o", str(folder / "samples.xlsx")]


def _of(name: str, scene: str, output: str, *words: str, options: Sequence[str] = OPTIONS):
    def made(folder: Path) -> list[str]:
        return [name, str(JOBS / scene), "-o", str(folder / output), *words, *options]

    return made


_RANGE = ("--x", "C=0.1mm:1mm:24", "--transient", "1", "--revolutions", "2", "--bifurcation")
_LIVES = (*overrides("wear.lives=4", "wear.cycles=1e4"), *SHORT)
TURN = ("numerics.transient_revolutions=0", "numerics.averaged_revolutions=1")
_ANGULAR = overrides("wear.profile=angular", "wear.harmonics=2")
_UNKNOWN = ("--unknown", "joints.crank_rod.clearance=10um:150um", "--advise", "--members", "32")

COMMANDS = {
    "sample": Command(lambda folder: commands.sample(folder / "samples.nc", 4000, *OPTIONS)),
    "sample press": Command(
        _of("sample", "linkages/press.toml", "press.nc", *overrides("study.samples=2000", *TURN))
    ),
    "run": Command(study, interval=CHECKPOINT_INTERVAL),
    "map --bifurcation": Command(_of("map", "quickstart.toml", "b.nc", *_RANGE, *SHORT)),
    "map": Command(_of("map", "hunt_crossley.toml", "map.nc", "--x", "C=0.1mm:0.3mm:6")),
    "wear": Command(_of("wear", "wear.toml", "wear.nc", *_LIVES)),
    "wear --set angular": Command(_of("wear", "wear.toml", "wear.nc", *_LIVES, *_ANGULAR)),
    "effects": Command(
        _of("effects", "quickstart.toml", "e.nc", "--tolerance", "5%", "--samples", "64", *SHORT)
    ),
    "identify": Command(_of("identify", "identify.toml", "i.nc", *_UNKNOWN, *SHORT)),
    "accuracy": Command(
        _of("accuracy", "quickstart.toml", "accuracy", "--quick", *SHORT, options=()),
        interval=CHECKPOINT_INTERVAL,
        elsewhere=False,
    ),
    "accuracy --plan": Command(
        lambda folder: [
            "accuracy",
            "--plan",
            str(commands.SCENE),
            "--ranks",
            "2",
            *SHORT,
            *overrides("study.samples=8"),
        ],
        interval=None,
        elsewhere=False,
    ),
    # a scene that is there already is never overwritten
    "init --import": Command(
        _points, ranks=0, interval=None, elsewhere=False, again=frozenset({0, 2})
    ),
    "export": Command(_table, ranks=0, interval=None, elsewhere=False),
}
"""By name. Times of a plan and of an accuracy differ from run to run, so their files are left out of `files`."""


@dataclass(frozen=True)
class Undisturbed:
    """A command and what comes of it when nothing disturbs it."""

    command: Command
    work: float = 0.0
    """Seconds from the opened checkpoint on, or all of them where there is none."""
    files: dict[str, bytes] = field(default_factory=dict)

    @property
    def words(self) -> Callable[[Path], list[str]]:
        """As `Command.words`."""
        return self.command.words


def files(folder: Path) -> dict[str, bytes]:
    """All that lies in a results folder, but for the times, which may differ."""
    found = {str(path.relative_to(folder)): path for path in folder.rglob("*") if path.is_file()}
    return {
        name: b"" if name.startswith("accuracy/") else path.read_bytes()
        for name, path in found.items()
        if not name.endswith("timing.nc")
    }


def undisturbed(name: str, place: Path) -> Undisturbed:
    """Compile what a command needs, then run it in `place`, an empty folder, without a kill."""
    command = COMMANDS[name]
    for turn in ("compiling", "results"):
        folder = place / turn
        folder.mkdir()
        words = command.words(folder)
        began = time.monotonic()
        code, output = commands.run(words, command.ranks, TEST_LOG=str(place / f"{turn}.log"))
        assert code == 0, output
        work = time.monotonic() - began
    log = losses.read(place / "results.log")
    opened = [event.time for event in log if event.what == "opened"]
    return Undisturbed(
        command, log[-1].time - min(opened) if opened else work, files(place / "results")
    )


def trial(
    whole: Undisturbed, place: Path, kills: int, dice: random.Random
) -> tuple[Counter, list[Loss]]:
    """Kill a command so many times in a row, then let it end.

    Asserts that every file can be read meanwhile, that no message is a traceback, that the results are those of the command
    undisturbed with nothing beside them, and that no more was simulated again than `losses` allows.

    Returns
    -------
    tuple of Counter and list of Loss
        In which states the command was killed; what each kill cost.
    """
    command, folder, logs = whole.command, place / "results", []
    folder.mkdir(parents=True)
    words, states = whole.words(folder), Counter[str]()
    for number in range(kills):
        logs.append(place / f"{number}.log")
        job = commands.start(words, command.ranks, TEST_LOG=str(logs[-1]))
        early = command.interval is None or dice.random() < 0.2
        while not early and job.poll() is None and not logs[-1].exists():
            time.sleep(0.02)  # the checkpoint is opened
        moment = time.time() + dice.uniform(0.0, 1.0) * (1.0 if early else whole.work)
        commands.wait_until(job, moment, folder, writing=dice.random() < 0.3)
        victims = list(commands.ranks_of(job).values()) if command.ranks else [job.pid]
        if job.poll() is None and victims:
            states["kills"] += 1
            states["amid a write"] += any(folder.rglob(".hpcclear-*.tmp"))
            commands.kill(dice.choice(sorted(victims)))
        code, output = commands.finish(job, 60.0)
        assert "Traceback" not in output, output
        states["too late"] += code == 0
        commands.check_readable(folder)
    logs.append(place / "last.log")
    ranks = dice.choice((0, 1, 3)) if command.elsewhere else command.ranks
    code, output = commands.run(words, ranks, TEST_LOG=str(logs[-1]))
    assert code in command.again, output
    assert "Traceback" not in output, output
    assert files(folder) == whole.files
    if command.interval is None:
        return states, []
    return states, [
        losses.loss_of(log, logs[k + 1 :], command.interval) for k, log in enumerate(logs[:-1])
    ]
