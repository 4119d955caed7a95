"""What each effect costs: time and force evaluations of a revolution with it on against off, measured in one run.

    python analysis/effect_cost.py -o results/effect_cost.nc

writes the table as NetCDF and the figure beside it. Each pair is timed in turn, off and on, several times over, so that
both see the same machine, each time with arrays of their own: the pages of memory that these happen to get change the time
of the same code by up to a sixth. The ratio of the medians counts. Samples come from the Latin hypercube of
jobs/quickstart.toml. Times are processor times; on a busy machine they still suffer from shared caches.
"""

import argparse
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from hpcclear.dynamics.linkage.prescribed import prescribed_motion
from hpcclear.dynamics.planar.tables import mechanism_of
from hpcclear.dynamics.setup.parameters import parameters
from hpcclear.dynamics.setup.problem import problem_of
from hpcclear.dynamics.setup.start import start_states
from hpcclear.dynamics.stepping.lanes import Lanes
from hpcclear.report.figures import style
from hpcclear.results import dataset
from hpcclear.results.provenance import program
from hpcclear.scene import Scene, load_scene
from hpcclear.scene.points import latin_hypercube

JOB = Path(__file__).parent.parent / "jobs" / "quickstart.toml"

HERTZ = "effects.contact={law='hertz'}"
SMOOTH = "effects.contact={law='hunt-crossley', damping=0.5}"
LATCHED = "effects.contact={law='lankarani-nikravesh', restitution=0.9}"
NO_FRICTION = "effects.friction={law='none'}"
BARE = [SMOOTH, NO_FRICTION]
FREE = "drive={kind='torque', initial_speed='5000 rpm', flywheel_inertia=0.01, torque=%s}"
CURVE = "[[0.0, 2.0], [1.0, 9.0], [3.0, 4.0], [5.0, -1.0]]"


class Pair(NamedTuple):
    """An effect and the two scenes that differ by it."""

    name: str
    off: list[str]
    on: list[str]


def added(name: str, *entries: str) -> Pair:
    """An effect added to two clearances with Hunt and Crossley's law."""
    return Pair(name, BARE, [*BARE, *entries])


PAIRS = [
    Pair("clearance at O12", [*BARE, "joints.crank_rod={kind='ideal'}"], BARE),
    Pair("clearance at O23", [*BARE, "joints.rod_slider={kind='ideal'}"], BARE),
    Pair("damping: hunt-crossley", [HERTZ, NO_FRICTION], BARE),
    Pair("damping: lankarani-nikravesh", [HERTZ, NO_FRICTION], [LATCHED, NO_FRICTION]),
    added("friction: coulomb", "effects.friction={law='coulomb', coefficient=0.01}"),
    added(
        "friction: ambrosio",
        "effects.friction={law='ambrosio', coefficient=0.01, speeds=[0.001, 0.01]}",
    ),
    added(
        "friction: lugre",
        "effects.friction={law='lugre', coefficient=0.01, static_coefficient=0.015, stribeck_speed=0.01, "
        "bristle_stiffness=1e5}",
    ),
    *(
        added(
            f"bending of the rod, {modes} modes, {stiffness} N m2",
            f"mechanism.rod.bending={{modes={modes}, stiffness={stiffness}.0, damping=0.01}}",
        )
        for modes, stiffness in ((1, 800), (2, 800), (4, 800), (2, 20000))
    ),
    added("torque drive", FREE % "5.0"),
    Pair("tabulated torque", [*BARE, FREE % "5.0"], [*BARE, FREE % CURVE]),
    added("gravity", "effects.gravity=9.81"),
    added("slider load", "effects.slider_load=-50.0"),
    added(
        "tabulated slider load", "effects.slider_load=[[0.0, -200.0], [1.5, -30.0], [4.0, 80.0]]"
    ),
    added("guide friction", "effects.guide_friction={coefficient=0.1}"),
    added("baumgarte formulation", "numerics.formulation='baumgarte'"),
    added(
        "wear of both joints",
        "joints.crank_rod.wear={length=0.02, bearing={coefficient=1e-15}}",
        "joints.rod_slider.wear={length=0.02, bearing={coefficient=1e-15}}",
    ),
    *(
        added(
            f"wear of both joints, {words}",
            *(
                f"joints.{joint}.wear={{length=0.02, {surfaces}}}"
                for joint in ("crank_rod", "rod_slider")
            ),
            f"wear={{profile='angular', harmonics={waves}}}",
        )
        for words, surfaces, waves in (
            ("profile of 3 waves", "bearing={coefficient=1e-15}", 3),
            ("profile of 4 waves", "bearing={coefficient=1e-15}", 4),
            (
                "profile of 3 waves, journals too",
                "bearing={coefficient=1e-15}, journal={coefficient=1e-15}",
                3,
            ),
        )
    ),
    *(
        added(
            f"{model} oil film of {viscosity}",
            *(
                f"joints.{joint}.film={{model='{model}', viscosity='{viscosity}', length='{length}'}}"
                for joint in ("crank_rod", "rod_slider")
            ),
        )
        for model, length in (("short", "20 mm"), ("long", "80 mm"))
        for viscosity in ("1 mPa*s", "10 mPa*s", "100 mPa*s")
    ),
    added("energies", "numerics.energy=true"),
    added("further responses", "numerics.responses=true"),
]


class Ensemble:
    """Samples of a scene, ready to be run again and again."""

    def __init__(self, scene: Scene, samples: int, width: int) -> None:
        points = latin_hypercube(scene, samples)
        self.par = parameters(scene, points)
        self.start = start_states(scene, self.par, points)
        self.lanes = Lanes(problem_of(scene), width)

    def run(self) -> tuple[float, float]:
        """Seconds (of processor time: other work on the machine counts less) and force evaluations of a revolution."""
        started = time.process_time()
        outcome = self.lanes.run(self.par, self.start)
        seconds = time.process_time() - started
        revolutions = outcome.revolutions.sum()
        return seconds / revolutions, outcome.evaluations.sum() / revolutions


def scene(entries: list[str], revolutions: int) -> Scene:
    """The job's scene with other effects."""
    length = f"numerics.averaged_revolutions={revolutions}"
    return load_scene(JOB, [*entries, "numerics.transient_revolutions=0", length])


def measured(pair: Pair, options: argparse.Namespace) -> np.ndarray:
    """Times off and on, evaluations off and on, of each repetition, shape (4, repetitions)."""
    scenes = [scene(entries, options.revolutions) for entries in (pair.off, pair.on)]
    both = [
        [Ensemble(one, options.samples, options.lanes) for one in scenes]
        for _ in range(options.pairs)
    ]
    for ensembles in both:  # compile and warm up
        for ensemble in ensembles:
            ensemble.run()
    rows = []
    for ensembles in both:
        (time_off, count_off), (time_on, count_on) = (ensemble.run() for ensemble in ensembles)
        rows.append([time_off, time_on, count_off, count_on])
    return np.array(rows).T


def closed_form(options: argparse.Namespace) -> np.ndarray:
    """Seconds per output instant without clearance, reactions and crank moment included, per repetition."""
    entries = ["joints.crank_rod={kind='ideal'}", "joints.rod_slider={kind='ideal'}", NO_FRICTION]
    content = load_scene(JOB, entries[2:]).resolved()
    content.pop("study")  # no clearance is left to vary
    bare = load_scene(content, entries)
    mechanism = mechanism_of(bare.linkage)
    instants = np.linspace(0.0, mechanism.period.seconds, 720)
    times = []
    for _ in range(options.pairs + 1):
        start = time.process_time()
        for _ in range(10):
            prescribed_motion(mechanism, instants)
        times.append((time.process_time() - start) / (10 * len(instants)))
    return np.array(times[1:])


def table(options: argparse.Namespace) -> xr.Dataset:
    """All pairs as a dataset."""
    pairs = [pair for pair in PAIRS if options.only in pair.name]
    rows = np.array([measured(pair, options) for pair in pairs])
    names = ("time_off", "time_on", "evaluations_off", "evaluations_on")
    words = ("time of a revolution", "force evaluations of a revolution")
    content = xr.Dataset(coords={"effect": [pair.name for pair in pairs]})
    for k, name in enumerate(names):
        dims = ("effect", "repetition")
        state = "on" if k % 2 else "off"
        attributes = {
            "units": "1" if k > 1 else "s",
            "long_name": f"{words[k // 2]}, effect {state}",
        }
        content[name] = (dims, rows[:, k], attributes)
    for name in ("time", "evaluations"):
        on, off = (content[f"{name}_{state}"].median("repetition") for state in ("on", "off"))
        content[f"{name}_ratio"] = (on / off).assign_attrs(
            units="1", long_name=f"{name} of a revolution, on over off (medians)"
        )
    content["time_per_instant"] = (
        ("repetition",),
        closed_form(options),
        {"units": "s", "long_name": "no clearance: time of an output instant, closed form"},
    )
    for name in ("samples", "revolutions", "lanes", "pairs"):
        content.attrs[name] = getattr(options, name)
    text = JOB.read_text()
    content.attrs |= load_scene(JOB).origin | {"scene": text} | program()
    return content


@style.drawn
def figure(content: xr.Dataset):  # type: ignore[no-untyped-def]
    """Bars of both ratios, an effect a row."""
    fig, axes = style.grid(1, 1, 90.0)
    ax = np.ravel(axes)[0]
    place = np.arange(content.sizes["effect"])[::-1]
    for name, shift, colour, hatch in (
        ("time", 0.19, "blue", ""),
        ("evaluations", -0.19, "orange", "///"),
    ):
        ratio = content[f"{name}_ratio"].values
        ax.barh(
            place + shift, ratio, 0.36, color=style.colour(colour), hatch=hatch, label=name,
            edgecolor="white",
        )  # fmt: skip
    ax.axvline(1.0, color="black", linewidth=0.6)
    ax.set_yticks(place, content["effect"].values)
    ax.set_xlabel("a revolution with the effect on over off")
    ax.grid(axis="y", visible=False)
    ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2)
    return fig


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=Path("effect_cost.nc"))
    parser.add_argument(
        "--pairs", type=int, default=15, help="repetitions of each pair, at least 5"
    )
    parser.add_argument("--samples", type=int, default=64)
    parser.add_argument("--revolutions", type=int, default=5)
    parser.add_argument("--lanes", type=int, default=32, help="1 for the single response")
    parser.add_argument("--only", default="", help="measure effects with this in their name")
    options = parser.parse_args()
    content = table(options)
    dataset.write(content, options.output)
    style.save(figure(content), options.output.with_suffix(".png"))
    for name in content["effect"].values:
        one = content.sel(effect=name)
        print(f"{name:30s} time x {one.time_ratio:.2f}   evaluations x {one.evaluations_ratio:.2f}")
    instant = float(content["time_per_instant"].median())
    print(f"{'no clearance':30s} {instant * 1e9:.0f} ns an output instant")


if __name__ == "__main__":
    main()
