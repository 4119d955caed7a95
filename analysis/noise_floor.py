"""Are total Sobol indices of inputs that do nothing 0 within their errors, however chaotic f is? Counted on formulas.

    python analysis/noise_floor.py      # half a minute on one core

f is the first of three inputs and a part that each evaluation draws anew. Indices, the share of that part and their errors are
those of a study; half-widths are those of 95 %.
"""

import itertools

import numpy as np

from hpcclear.statistics.sensitivity.sobol import analyse_sobol, noise_share, sobol_design

SHARES, ROWS, SEEDS = (0.05, 0.3, 0.6, 0.95), (64, 256, 1024), 100
INPUTS = 3


def main() -> None:
    """Count and print."""
    total = held = 0
    for share, rows in itertools.product(SHARES, ROWS):
        within = sum(inside(share, rows, seed) for seed in range(SEEDS))
        count = SEEDS * (INPUTS - 1)
        total, held = total + count, held + within
        print(f"share of chaos {share:.2f}, {rows:5} rows: {within} of {count}", flush=True)
    print(f"within their error of 0: {held} of {total} ({held / total:.1%})")


def inside(share: float, rows: int, seed: int) -> int:
    """Inputs without influence whose index is 0 within its error."""
    rng = np.random.default_rng([53, seed, rows, round(100 * share)])
    points = sobol_design(np.array([[0.0, 1.0]] * INPUTS), rows, rng)

    def f(x: np.ndarray) -> np.ndarray:
        own = (12.0 * (1.0 - share)) ** 0.5 * x[:, 0]
        return np.asarray(own + share**0.5 * rng.standard_normal(len(x)))

    values = f(points)
    found = analyse_sobol(values, INPUTS)
    beside = max(rows // 4, 32)
    noise, error = noise_share(values[:beside], f(points[:beside]), found.variance)
    errors = np.hypot(np.ptp(found.total_interval, axis=1) / 2.0, 1.96 * error)
    return int((abs(found.total[1:] - noise) <= errors[1:]).sum())


if __name__ == "__main__":
    main()
