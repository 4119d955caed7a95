"""How instants and window change third-octave levels of a chaotic compressor: the table of the page on noise.

    python analysis/force_levels.py

`jobs/compressor.toml` at a clearance of 0.05 mm in both joints; 720 stored instants a revolution against 5760 and 11520, with
and without a window, and Welch's method of scipy.signal. Writes `analysis/results/force_levels.csv`.
"""

from pathlib import Path

import numpy as np
from recorded import record
from scipy import signal

from hpcclear import load_scene, simulate
from hpcclear.report.figures.noise import band_name
from hpcclear.statistics import spectra

ROOT = Path(__file__).parent.parent
DENSE = 11520
SHOWN = np.array([100.0, 158.489, 316.228, 1000.0, 2511.886, 5011.872])


def level(squares):
    """dB re 1 uN."""
    return 10.0 * np.log10(squares / spectra.REFERENCE**2)


def columns(forces, period):
    """Levels in the bands shown, by headings; forces (revolutions, DENSE, 2)."""

    def of(thinned, window):
        few = forces[:, :: DENSE // thinned]
        parts = [few[k : k + window] for k in range(len(few) - window + 1)]
        orders = np.stack([spectra.orders(one).sum(axis=1)[:280] for one in parts])
        return level(spectra.in_bands(orders, np.full(len(parts), period), SHOWN).mean(axis=0))

    flat, rate = forces.reshape(-1, 2), DENSE / period
    frequencies, density = signal.welch(flat, rate, nperseg=4 * DENSE, axis=0)
    power, step = density.sum(axis=1), rate / (4 * DENSE)
    bands = [(frequencies >= f * 10**-0.05) & (frequencies < f * 10**0.05) for f in SHOWN]
    return {
        "720 instants, window": of(720, spectra.WINDOW),
        "5760, no window": of(5760, 1),
        "5760, window (as taken)": of(5760, spectra.WINDOW),
        "11520, window": of(DENSE, spectra.WINDOW),
        "Welch": level(np.array([power[one].sum() * step for one in bands])),
    }


def main():
    """Simulate, and record the table."""
    joints = {f"joints.{one}.clearance": 5e-5 for one in ("crank_rod", "rod_slider")}
    scene = load_scene(ROOT / "jobs" / "compressor.toml")
    found = simulate(scene.with_(joints | {"output.instants_per_revolution": DENSE}))
    first = scene.numerics.transient_revolutions * DENSE
    axes = [found[f"frame_force_{axis}"].to_numpy()[first:-1] for axis in "xy"]
    forces = np.stack(axes, axis=-1).reshape(-1, DENSE, 2)
    made = columns(forces, 2.0 * np.pi / scene.number("drive.speed"))
    rows = [("band", *made)]
    rows += [
        (band_name(f), *(f"{one[k]:.1f}" for one in made.values())) for k, f in enumerate(SHOWN)
    ]
    record("force_levels", rows)


if __name__ == "__main__":
    main()
