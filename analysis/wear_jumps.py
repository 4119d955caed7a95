"""Jumps against runs without any: clearances of random lives after many revolutions, what jumps cost, whether errors are held.

    python analysis/wear_jumps.py [--revolutions 100000] [--lives 40] [--chunk 10] [--profile angular] [--truth FILE] [-o FIG]

Without jumps every life runs on from where it is, and after every chunk of revolutions its clearances grow by what these wore.
Wear coefficients are larger than those of jobs/wear.toml by as much as lives are shorter, so that clearances grow alike.
With profiles these grow alike, and what is compared is the clearance where it is largest around the bearing.
The run without jumps is kept in FILE (.npz), if one is named, and taken from there another time. FIG shows what errors of
jumps cost: processor time against the error of the clearance, by the tolerance of a jump.
"""

import argparse
import time
from pathlib import Path

import numpy as np

from hpcclear.dynamics.layout.views import Outcome, Start
from hpcclear.dynamics.setup.parameters import parameters
from hpcclear.dynamics.setup.problem import problem_of
from hpcclear.dynamics.setup.start import start_states
from hpcclear.dynamics.stepping.lanes import Lanes
from hpcclear.dynamics.wear.law import Joints, joints_of
from hpcclear.dynamics.wear.life import Asked, LifePlan, WearOutcome, life
from hpcclear.ensemble.wear import States, inputs_of, waiting_longer
from hpcclear.report.figures import style
from hpcclear.scene import Scene, load_scene

SCENE = Path(__file__).parents[1] / "jobs" / "wear.toml"
TOLERANCES = (0.01, 0.003, 0.001, 0.0003, 0.0001)
"""Of the figure."""
WHOLE = 1e6
"""Revolutions of the starter's lives."""


def scene_of(lives: int, revolutions: int, profile: str) -> Scene:
    """The starter's lives, worn faster."""
    scene = load_scene(SCENE)
    faster = WHOLE / revolutions
    changes = {"wear.lives": lives, "wear.cycles": float(revolutions), "wear.profile": profile}
    for row in scene.required_study.random:
        if row.name in ("k12", "k23"):
            changes[row.paths[0]] = faster * scene.number(row.paths[0])
            changes[f"study.random.{row.name}.deviation"] = faster * row.deviation
            changes[f"study.random.{row.name}.half_width"] = faster * row.half_width
    return scene.with_(changes)


def unjumped(scene: Scene, revolutions: int, chunk: int) -> tuple[np.ndarray, float]:
    """Clearances (lives, joints) after so many revolutions, and the processor time; new clearances after each chunk."""
    inputs = inputs_of(scene)
    joints = joints_of(scene, inputs)
    states = States(scene, inputs, joints)
    lives = range(len(joints.clearance))
    work = np.zeros(joints.clearance.shape)
    moments = np.zeros((*work.shape, states.relief.size))
    lanes = Lanes(
        problem_of(
            scene.with_(
                {"numerics.transient_revolutions": 0, "numerics.averaged_revolutions": chunk}
            )
        ),
        32,
    )

    def par_of() -> np.ndarray:
        rows = [states.rows(k, Asked(work[k], range(1), moments[k])) for k in lives]
        return parameters(scene, states.points(np.concatenate(rows)))

    par = par_of()
    start = start_states(scene, par, None)
    lanes.run(par, start)  # compiles
    began = time.process_time()
    for _ in range(revolutions // chunk):
        outcome = lanes.run(par_of(), start)
        if (outcome.status != 0).any():
            raise RuntimeError("a simulation failed")
        done = outcome.sliding_work[:, : work.shape[1]]
        if moments.size:
            share = waves_of(outcome, moments.shape) / np.maximum(
                outcome.sliding_power[:, : work.shape[1], None], 1e-300
            )
            moments += share * (joints.counted(work + done) - joints.counted(work))[..., None]
        work += done
        start = outcome.end()
    return deepest(joints, states, work, moments), time.process_time() - began


def waves_of(outcome: Outcome, shape: tuple[int, ...]) -> np.ndarray:
    """Waves of the sliding power of worn joints, W, as of `Relief`."""
    return outcome.profile[:, : shape[1] * shape[2]].reshape(shape)


def deepest(joints: Joints, states: States, work: np.ndarray, moments: np.ndarray) -> np.ndarray:
    """Clearances (lives, joints), m, where they are largest around the surfaces."""
    return joints.worn(work)[0] + states.relief.deepest(states.relief.waves(joints, moments))


def truth_of(
    scene: Scene, revolutions: int, chunk: int, kept: Path | None
) -> tuple[np.ndarray, float]:
    """The same, from the file if it is there, kept in it if not."""
    if kept is not None and kept.exists():
        found = np.load(kept)
        if str(found["scene"]) != scene.hash:
            raise SystemExit(f"{kept} is of other lives")
        return found["clearance"], float(found["seconds"])
    clearance, seconds = unjumped(scene, revolutions, chunk)
    if kept is not None:
        np.savez(kept, clearance=clearance, seconds=seconds, scene=scene.hash)
    return clearance, seconds


def jumped(scene: Scene) -> tuple[np.ndarray, np.ndarray, float, int]:
    """Clearances by jumps, the stated error of each (lives, joints), processor time, simulations."""
    inputs = inputs_of(scene)
    joints = joints_of(scene, inputs)
    states = States(scene, inputs, joints)
    table, numerics = scene.wear, scene.numerics
    plan = LifePlan(
        table.cycles,
        table.tolerance,
        float(numerics.averaged_revolutions),
        table.copies,
        table.most_copies,
    )
    kinds = [Lanes(problem_of(one), 32) for one in (scene, waiting_longer(scene))]
    relief = states.relief
    lives = [life(joints[k], plan, relief) for k in range(len(joints.clearance))]
    going = {k: next(one) for k, one in enumerate(lives)}
    ended = {}
    began = time.process_time()
    while going:
        rows = [states.rows(k, asked) for k, asked in going.items()]
        par = parameters(scene, states.points(np.concatenate(rows)))
        late = np.concatenate([np.array(asked.copies) % 2 for asked in going.values()])
        start = start_states(scene, par, None)
        answer = [
            np.empty((len(par), 2)),
            np.empty(len(par)),
            np.empty((len(par), 2)),
            np.empty(len(par), int),
            np.empty((len(par), 2, relief.size)),
        ]
        for kind, lanes in enumerate(kinds):
            chosen = late == kind
            outcome = lanes.run(par[chosen], Start(start.rows[chosen]))
            period = outcome.time / outcome.revolutions
            parts = (
                outcome.sliding_power[:, :2] * period[:, None], outcome.objective, outcome.peak_force[:, :2], outcome.status,
                waves_of(outcome, (len(period), 2, relief.size)) * period[:, None, None],
            )  # fmt: skip
            for whole, part in zip(answer, parts, strict=True):
                whole[chosen] = part
        cuts = np.cumsum([len(part) for part in rows])[:-1]
        found = zip(*(np.split(whole, cuts) for whole in answer), strict=True)
        waiting, going = going, {}
        for k, seen in zip(waiting, found, strict=True):
            try:
                going[k] = lives[k].send(WearOutcome(*seen))
            except StopIteration as end:
                ended[k] = end.value
    seconds = time.process_time() - began
    done = [ended[k] for k in range(len(lives))]
    last = [one.nodes[-1] for one in done]
    ends = deepest(
        joints, states, np.stack([n.work for n in last]), np.stack([n.moments for n in last])
    )
    stated = np.stack([one.error + one.limit for one in done])
    return ends, stated, seconds, sum(one.simulations for one in done)


@style.drawn
def figure(ladder, truth, slow):  # type: ignore[no-untyped-def]
    """Processor time of all lives against the error of their clearances, and what they state, a point a tolerance."""
    fig, axes = style.grid(1, 1, 75.0)
    ax, times = np.ravel(axes)[0], [row[3] for row in ladder]
    errors = {
        "error, median": [np.median(np.abs(row[1] - truth) / truth) for row in ladder],
        "error, largest": [(np.abs(row[1] - truth) / truth).max() for row in ladder],
        "stated, median": [np.median(row[2] / truth) for row in ladder],
    }
    for (words, values), colour, mark in zip(
        errors.items(), ("blue", "orange", "grey"), "osx", strict=True
    ):
        ax.loglog(values, times, color=style.colour(colour), marker=mark, label=words)
    for row, error in zip(ladder, errors["error, median"], strict=True):
        ax.annotate(f"{row[0]:g}", (error, row[3]), textcoords="offset points", xytext=(4, 4))
    ax.axhline(slow, color="black", ls="--", label="without jumps")
    ax.set_xlabel("error of the clearance at the end, relative (–)")
    ax.set_ylabel("processor time of all lives (s)")
    ax.legend(loc="center left")
    return fig


def main() -> None:
    """Print the comparison."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--revolutions", type=int, default=100_000)
    parser.add_argument("--lives", type=int, default=40)
    parser.add_argument("--chunk", type=int, default=10)
    parser.add_argument("--truth", type=Path)
    parser.add_argument("-o", "--output", type=Path)
    parser.add_argument("--profile", choices=("uniform", "angular"), default="uniform")
    asked = parser.parse_args()
    scene = scene_of(asked.lives, asked.revolutions, asked.profile)
    ends, stated, fast, simulations = jumped(scene)
    ends, stated, fast, simulations = jumped(scene)  # once more, compiled
    truth, slow = truth_of(scene, asked.revolutions, asked.chunk, asked.truth)
    off = np.abs(ends - truth)
    new = joints_of(scene, inputs_of(scene)).clearance
    print(f"{asked.lives} lives of {asked.revolutions} revolutions, processor time")
    print(
        f"growth of clearance: median {np.median(truth / new - 1):.1%}, most {(truth / new).max() - 1:.1%}"
    )
    print(
        f"error of clearance: median {np.median(off / truth):.2e}, most {(off / truth).max():.2e}"
    )
    print(
        f"stated error holds the true one in {(off <= stated).all(axis=1).mean():.1%} of the lives"
    )
    if asked.output is not None:
        ladder = [(t, *jumped(scene.with_({"wear.tolerance": t}))) for t in TOLERANCES]
        style.save(figure(ladder, truth, slow), asked.output)
    print(f"stated over true, median: {np.median(stated / np.maximum(off, 1e-300)):.3g}")
    print(
        f"without jumps {slow:.1f} s, with {fast:.2f} s ({simulations} simulations): {slow / fast:.0f} times less"
    )


if __name__ == "__main__":
    main()
