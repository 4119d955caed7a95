"""Slopes of response surfaces and Sobol indices."""

from hpcclear.results.rows import Columns, count, flag, kind_of, number, text

# fmt: off
COLUMNS: Columns = {
    "surface": text(("surface",), "inputs of the response surface"),
    "interval": number(("interval",), "1", "interval, fraction of the range"),
    "clearance": number(("clearance",), "m", "radial clearance"),
    "parameter": text(("parameter",), "design variable"),
    "sensitivity": number(("surface", "interval", "clearance", "parameter"), "objective",
        "slope at midpoint, times range", required=True),
    "standard_error": number(("surface", "interval", "clearance", "parameter"), "objective",
        "standard error of the preceding variable", required=True),
    "r2": number(("surface", "interval", "clearance"), "1", "1 - SSE/SST on test points", required=True),
    "rmae": number(("surface", "interval", "clearance"), "1",
        "largest test error / standard deviation of test values", required=True),
    "leave_one_out_r2": number(("surface", "interval", "clearance"), "1", "1 - SSE/SST of leave-one-out errors"),
    "converged": flag(("surface", "clearance", "parameter"),
        "whether the sensitivity is determined", "not_determined determined", required=True),
    "convergence_interval": number(("surface", "clearance", "parameter"), "1", "interval where the sensitivity is determined"),
    "plateau_interval": number(("surface", "clearance", "parameter"), "1", "widest interval from which it is constant"),
    "best_sensitivity": number(("surface", "clearance", "parameter"), "objective",
        "slope where determined, times range"),
    "uncertainty": number(("surface", "clearance", "parameter"), "objective",
        "standard error of best_sensitivity, truncation included"),
    "surface_r2": number(("surface", "clearance"), "1", "1 - SSE/SST on test points, global surface"),
    "surface_rmae": number(("surface", "clearance"), "1", "largest test error / standard deviation of test values"),
    "surface_r2_explained": number(("surface", "clearance"), "1", "explained variance ratio, eq. 26 as printed"),
    "surface_rmae_mean": number(("surface", "clearance"), "1", "largest test error / mean of test values, eq. 27"),
    "surface_order": count(("surface", "clearance"), "order of the global surface"),
    "surface_points": count(("surface", "clearance"), "points that the surface was fitted to"),
    "surface_terms": count(("surface", "clearance"), "number of terms of the surface; 0 if none was fitted"),
    "surface_accepted": flag(("surface", "clearance"), "whether the surface passed on its test points", "refused accepted"),
    "mean_objective": number(("clearance",), "objective", "mean of the objective over the box"),
    "mean_objective_error": number(("clearance",), "objective", "standard error of the preceding variable"),
    "sobol_first": number(("parameter",), "1", "first-order Sobol index"),
    "sobol_first_error": number(("parameter",), "1", "its standard error"),
    "sobol_total": number(("parameter",), "1", "total Sobol index, without the share of chaotic scatter"),
    "sobol_total_error": number(("parameter",), "1", "its standard error"),
    "sobol_noise": number((), "1", "share of the variance over the ranges that is chaotic scatter, by perturbed runs"),
    "sobol_noise_error": number((), "1", "its standard error"),
    "influence": number(("parameter",), "objective", "mean effect; parameters are ranked by it"),
    "selected": flag(("parameter",), "whether the parameter is selected for its influence", "left_out selected"),
}
# fmt: on

KIND = kind_of(
    40,
    "Sensitivity of the objective against clearance",
    COLUMNS,
    ("surface", "interval", "clearance", "parameter"),
    absent="no sensitivities (`hpcclear run` of a study with `study.sensitivity.groups`)",
)
