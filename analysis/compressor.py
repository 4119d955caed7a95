"""How a compressor gets louder as its bushes wear: impact energy, force on the frame and wear from new to 0.15 mm.

    python analysis/compressor.py DIRECTORY

Writes `analysis/results/compressor.csv` and ``compressor.png`` of `jobs/compressor.toml` at radial clearances of both joints
from those of its fits to 0.15 mm. Means over 30 revolutions with 95 % confidence intervals; about a minute.
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from recorded import record

from hpcclear import evaluate, load_scene, simulate
from hpcclear.base.outcome import Flag
from hpcclear.report.figures.labels import with_half_width
from hpcclear.statistics.spectra import half_width

SCENE = Path(__file__).parents[1] / "jobs" / "compressor.toml"
WORN = (3e-5, 5e-5, 7.5e-5, 1e-4, 1.25e-4, 1.5e-4)
"""Radial clearances of both joints, m; before them those of the fits."""
JOINTS = ("crank_rod", "rod_slider")
COEFFICIENT = 2e-16  # m^2/N, of both bushes
HOURS = 1000.0
REPLICAS = 8
"""Of sliding work: pistons whose masses differ so little that only the chance of chaotic motion does."""


def rows(scene):
    """Of each clearance: name, mm; energy lost in impacts a revolution, J, and half-width; force on the frame, N, too; level
    at 1 kHz, dB; impacts a revolution; wear of the bushes in 1000 h, mm^3, likewise;
    flags."""
    seconds = 2 * np.pi / scene.number("drive.speed")
    for clearance in (None, *WORN):
        changes = {f"joints.{one}.clearance": clearance for one in JOINTS if clearance is not None}
        one = scene.with_(changes)
        found = simulate(one)
        masses = one.number("mechanism.slider.mass") * (1.0 + 1e-9 * np.arange(REPLICAS))
        work = evaluate(one, {"mechanism.slider.mass": masses})["sliding_work"].sum("joint")
        volumes = COEFFICIENT * work.to_numpy() / seconds * 3600.0 * HOURS * 1e9
        energy = found["impact_energy_by_revolution"].sum("joint").to_numpy()
        yield (
            "new" if clearance is None else f"{clearance * 1e3:g}",
            np.mean([one.number(f"joints.{joint}.clearance") for joint in JOINTS]) * 1e3,
            energy.mean(), float(half_width(energy[:, None])[0]),
            float(found["rms_frame_force"]), float(found["rms_frame_force_limit"]),
            float(found["frame_force_level"].sel(band=1000.0, method="nearest")),
            float(found["impacts"].sum()),
            volumes.mean(), float(half_width(volumes[:, None])[0]),
            int(found["flags"]),
        )  # fmt: skip


def main(directory):
    """Write the table and the figure."""
    directory.mkdir(parents=True, exist_ok=True)
    made = list(rows(load_scene(SCENE)))
    lines = [
        ("radial clearance (mm)", "energy lost in impacts a revolution", "RMS force on the frame",
         "level at 1 kHz (dB re 1 µN)", "impacts a revolution", "wear of the bushes in 1000 h (mm³)")
    ]  # fmt: skip
    for name, _, energy, reach, force, width, level, impacts, volume, about, flags in made:
        assert not flags & Flag.BEYOND_HERTZ
        lines.append(
            (name, with_half_width(energy, reach, "J"), with_half_width(force, width, "N"),
             f"{level:.1f}", f"{impacts:.3g}", with_half_width(volume, about, "1"))
        )  # fmt: skip
    record("compressor", lines)
    clearance = [row[1] for row in made]
    figure, axes = plt.subplots(3, 1, figsize=(6, 8), sharex=True)
    axes[0].errorbar(
        clearance, [1e3 * r[2] for r in made], [1e3 * r[3] for r in made], fmt="o-", capsize=3
    )
    axes[0].set_ylabel("energy lost in impacts\n(mJ a revolution)")
    axes[1].errorbar(clearance, [r[4] for r in made], [r[5] for r in made], fmt="o-", capsize=3)
    axes[1].set_ylabel("RMS force on the frame (N)")
    axes[2].errorbar(clearance, [r[8] for r in made], [r[9] for r in made], fmt="o-", capsize=3)
    axes[2].set_ylabel("wear in 1000 h (mm³)")
    axes[2].set_xlabel("radial clearance, mean of both joints (mm)")
    figure.tight_layout()
    figure.savefig(directory / "compressor.png", dpi=120)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
