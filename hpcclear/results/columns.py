"""The tables of `hpcclear.results.names`: what stands in every result file, a row each.

A row named as its only dimension is a coordinate. ``objective`` in the place of a unit, and
``objective^2``, stand for the unit of the study's objective (`Column.of`). Units are written so
that UDUNITS (CF), pint and cf-xarray all read them ("kg m^2", not "kg m2").
"""

from typing import NamedTuple

from hpcclear.base.objectives import MEAN_GAP, Objective

Dims = tuple[str, ...]


class Column(NamedTuple):
    """A row of the table: what one variable of a file is."""

    dims: Dims
    units: str  # "" for text and flags, which have none; see `of`
    long_name: str
    dtype: str  # "f8", "i8", "i1" or "text"
    required: bool = False

    def unit(self, objective: str) -> str:
        """The unit in a study whose objective has the unit `objective`."""
        if self.units == "objective":
            return objective
        if self.units == "objective^2":
            return f"{objective}^2" if objective.isalpha() else f"({objective})^2"
        return self.units

    def of(self, objective: Objective) -> "Column":
        """The row in a file of results for that objective: its unit, and its words in place of the mean gap's."""
        words = self.long_name.replace(MEAN_GAP.words, objective.words)
        return self._replace(units=self.unit(objective.unit), long_name=words)


Columns = dict[str, Column]


def number(dims: Dims, units: str, long_name: str, *, required: bool = False) -> Column:
    """A number of double precision."""
    return Column(dims, units, long_name, "f8", required)


def count(dims: Dims, long_name: str, *, required: bool = False) -> Column:
    """A whole number."""
    return Column(dims, "1", long_name, "i8", required)


def flag(dims: Dims, long_name: str, *, required: bool = False) -> Column:
    """A small code, whose meanings are attributes."""
    return Column(dims, "", long_name, "i1", required)


def text(dims: Dims, long_name: str, *, required: bool = False) -> Column:
    """Words."""
    return Column(dims, "", long_name, "text", required)


def _outcome(*per_sample: str) -> Columns:
    """What one simulation comes to, in a file with these dimensions."""
    per_joint = (*per_sample, "joint")
    # fmt: off
    return {
        "objective": number(per_sample, "objective", f"objective f, {MEAN_GAP.words}", required=True),
        "objective_spread": number(per_sample, "objective",
        "standard deviation of f between averaged revolutions", required=True),
        "objective_uncertainty": number(per_sample, "objective", "scatter of f over kicked copies"),
        "objective_limit": number(per_sample, "objective", "95 % half-width of the limits of f as a steady mean"),
        "regime": flag(per_sample, "kind of motion"),
        "period": number(per_sample, "1", "revolutions after which the motion repeats itself"),
        "kick_growth": number(per_sample, "1", "mean logarithm of the growth of a kick per revolution"),
        "kick_growth_limit": number(per_sample, "1", "95 % half-width of the limits of kick_growth"),
        "attractors": number(per_sample, "1", "kinds of motion that several starts ended in"),
        "steady_rtol": number(per_sample, "1", "tightest relative tolerance that the steady mean took"),
        "steady_revolutions": number(per_sample, "1", "revolutions of all copies that the steady mean took"),
        "mean_gap": number(per_joint, "m", "time mean of the distance from the clearance circle"),
        "peak_contact_force": number(per_joint, "N", "largest contact force over the averaged revolutions"),
        "mean_contact_force": number(per_joint, "N", "mean contact force over the averaged revolutions"),
        "peak_crank_moment": number(per_sample, "N m", "largest size of the moment of the drive on the crank"),
        "slider_acceleration_deviation": number(per_sample, "m/s^2",
        "standard deviation of the slider acceleration in time"),
        "point_acceleration_deviation": number(per_sample, "m/s^2",
        "root mean square about its mean of the acceleration of the followed point"),
        "peak_point_acceleration": number(per_sample, "m/s^2", "largest acceleration of the followed point"),
        "sliding_work": number(per_joint, "J", "normal force times sliding distance in a revolution"),
        "energy_error": number(per_sample, "1", "what the energy balance leaves unexplained, relative"),
        "latched": flag(per_joint, "whole revolutions in contact, impact speed frozen"),
        "rhs_evaluations": count(per_sample, "number of evaluations of the equations of motion", required=True),
        "status": flag(per_sample, "how the simulation ended", required=True),
        "flags": flag(per_sample, "what to mind when reading the result"),
    }
    # fmt: on


def _fit(*dims: str) -> Columns:
    """How well a model does."""
    return {
        "r2": number(dims, "1", "1 - SSE/SST on test points", required=True),
        "rmae": number(
            dims, "1", "largest test error over their standard deviation", required=True
        ),
        "r2_explained": number(dims, "1", "explained variance ratio, eq. 26 as printed"),
        "rmae_mean": number(dims, "1", "largest test error over their mean, eq. 27 as printed"),
        "rmse": number(dims, "objective", "root mean square error on test points"),
        "points": count(dims, "number of points fitted"),
    }


def _statistics_of(name: str, dims: Dims, units: str, words: str) -> Columns:
    """Statistics of one result."""
    return {
        f"{name}_count": count(dims, f"number of finite values of the {words}", required=True),
        f"{name}_mean": number(dims, units, f"mean of the {words}", required=True),
        f"{name}_deviation": number(
            dims, units, f"sample standard deviation of the {words}", required=True
        ),
        f"{name}_minimum": number(dims, units, f"least {words}", required=True),
        f"{name}_maximum": number(dims, units, f"greatest {words}", required=True),
        f"{name}_histogram": count((*dims, "bin"), f"number of samples by {words}", required=True),
        f"{name}_edges": number(
            (*dims, "edge"), units, f"edges of the bins of the {words}", required=True
        ),
    }


def _goal(name: str) -> Columns:
    """What a case makes small, where that is not mean and deviation: each design has that of its case."""
    of = f"of what is made small, the {name}"
    return {
        f"{name}_goal": text(("design",), f"{of}: in words"),
        f"{name}_unit": text(("design",), f"{of}: its unit, empty for none"),
        f"{name}_true": number(("design",), "", f"{of}: by direct simulation"),
        f"{name}_lower": number(("design",), "", f"{of}: lower confidence limit"),
        f"{name}_upper": number(("design",), "", f"{of}: upper confidence limit"),
    }


# fmt: off
RESPONSE: Columns = {
    "time": number(("time",), "s", "time since the start"),
    "joint": text(("joint",), "joint with clearance, O12 and O23"),
    "crank_angle": number(("time",), "rad", "crank angle"),
    "crank_speed": number(("time",), "rad/s", "crank speed"),
    "slider_load": number(("time",), "N", "force applied to the slider, along +x"),
    "slider_position": number(("time",), "m", "slider position"),
    "slider_velocity": number(("time",), "m/s", "slider velocity"),
    "slider_acceleration": number(("time",), "m/s^2", "slider acceleration"),
    "rod_x": number(("time",), "m", "x position of the mass centre of the rod"),
    "rod_y": number(("time",), "m", "y position of the mass centre of the rod"),
    "rod_angle": number(("time",), "rad", "rod angle"),
    "body": text(("body",), "body of a linkage"),
    "point": text(("point",), "point of a body of a linkage"),
    "body_x": number(("time", "body"), "m", "x position of the mass centre"),
    "body_y": number(("time", "body"), "m", "y position of the mass centre"),
    "body_angle": number(("time", "body"), "rad", "angle of the body"),
    "body_vx": number(("time", "body"), "m/s", "x velocity of the mass centre"),
    "body_vy": number(("time", "body"), "m/s", "y velocity of the mass centre"),
    "body_spin": number(("time", "body"), "rad/s", "angular velocity of the body"),
    "mode": text(("mode",), "mode of a bar that bends: its body and half waves"),
    "mode_amplitude": number(("time", "mode"), "m", "amplitude of the mode, its largest deflection"),
    "mode_velocity": number(("time", "mode"), "m/s", "how fast the amplitude changes"),
    "pin": text(("pin",), "pin of a linkage without play"),
    "pin_force_x": number(("time", "pin"), "N", "x force of the pin on its journal's body"),
    "pin_force_y": number(("time", "pin"), "N", "y force of the pin on its journal's body"),
    "point_x": number(("time", "point"), "m", "x position of the point"),
    "point_y": number(("time", "point"), "m", "y position of the point"),
    "followed_x": number(("time",), "m", "x position of the followed point"),
    "followed_y": number(("time",), "m", "y position of the followed point"),
    "followed_acceleration_x": number(("time",), "m/s^2", "x acceleration of the followed point"),
    "followed_acceleration_y": number(("time",), "m/s^2", "y acceleration of the followed point"),
    "path_error": number(("time",), "m", "distance of the followed point from where the linkage without play has it"),
    "eccentricity_x": number(("time", "joint"), "m", "x distance of the journal centre from the bearing centre"),
    "eccentricity_y": number(("time", "joint"), "m", "y distance of the journal centre from the bearing centre"),
    "penetration": number(("time", "joint"), "m", "overlap of journal and bearing"),
    "contact_force": number(("time", "joint"), "N", "normal contact force, with an oil film the force of both"),
    "friction_force": number(("time", "joint"), "N", "tangential contact force"),
    "reaction_x": number(("time", "joint"), "N", "x force on the rod in an ideal joint"),
    "reaction_y": number(("time", "joint"), "N", "y force on the rod in an ideal joint"),
    "bearing_x": number(("time",), "N", "x force of the frame on the crank"),
    "bearing_y": number(("time",), "N", "y force of the frame on the crank"),
    "guide_force": number(("time",), "N", "y force of the guide on the slider"),
    "constraint_violation": number(("time",), "m", "largest position constraint that is not met"),
    "crank_moment": number(("time",), "N m", "reaction moment on the crank"),
    "kinetic_energy": number(("time",), "J", "kinetic energy"),
    "elastic_energy": number(("time",), "J", "energy stored in the contacts"),
    "strain_energy": number(("time",), "J", "energy stored in bars that bend"),
    "potential_energy": number(("time",), "J", "potential energy against y = 0"),
    "driving_work": number(("time",), "J", "work done by the drive since the start"),
    "load_work": number(("time",), "J", "work done by the slider load since the start"),
    "dissipated_energy": number(("time",), "J", "energy dissipated since the start"),
    "energy_residual": number(("time",), "J", "what the energy balance leaves unexplained"),
    **_outcome(),
}

SAMPLES: Columns = {
    "sample": count(("sample",), "number of the sample in the design"),
    "joint": text(("joint",), "joint with clearance, O12 and O23"),
    "wave": count(("wave",), "number of a wave around a surface, joint by joint: cosine and sine of one, of two and so on"),
    **_outcome("sample"),
    "sliding_waves": number(("sample", "wave"), "J", "sliding work of a revolution times waves of the contact's angle"),
}

SENSITIVITY: Columns = {
    "surface": text(("surface",), "inputs of the response surface"),
    "interval": number(("interval",), "1", "interval, fraction of the range"),
    "clearance": number(("clearance",), "m", "radial clearance"),
    "parameter": text(("parameter",), "design variable"),
    "sensitivity": number(("surface", "interval", "clearance", "parameter"), "objective",
        "slope at midpoint, times range", required=True),
    "standard_error": number(("surface", "interval", "clearance", "parameter"), "objective",
        "standard error of it", required=True),
    "r2": number(("surface", "interval", "clearance"), "1", "1 - SSE/SST on test points", required=True),
    "rmae": number(("surface", "interval", "clearance"), "1",
        "largest test error over their standard deviation", required=True),
    "leave_one_out_r2": number(("surface", "interval", "clearance"), "1", "1 - SSE/SST of leave-one-out errors"),
    "converged": flag(("surface", "clearance", "parameter"), "whether it is determined", required=True),
    "convergence_interval": number(("surface", "clearance", "parameter"), "1", "interval where it is determined"),
    "plateau_interval": number(("surface", "clearance", "parameter"), "1", "widest interval from which on it agrees"),
    "best_sensitivity": number(("surface", "clearance", "parameter"), "objective",
        "slope where determined, times range"),
    "uncertainty": number(("surface", "clearance", "parameter"), "objective",
        "standard error of it, truncation included"),
    "surface_r2": number(("surface", "clearance"), "1", "1 - SSE/SST on test points, global surface"),
    "surface_rmae": number(("surface", "clearance"), "1", "largest test error over their deviation"),
    "surface_r2_explained": number(("surface", "clearance"), "1", "explained variance ratio, eq. 26 as printed"),
    "surface_rmae_mean": number(("surface", "clearance"), "1", "largest test error over their mean, eq. 27"),
    "surface_order": count(("surface", "clearance"), "order of the global surface"),
    "surface_points": count(("surface", "clearance"), "points it was fitted to"),
    "surface_accepted": flag(("surface", "clearance"), "whether it passed on its test points"),
    "mean_objective": number(("clearance",), "objective", "mean of the objective over the box"),
    "mean_objective_error": number(("clearance",), "objective", "standard error of it"),
    "sobol_first": number(("parameter",), "1", "first-order Sobol index"),
    "sobol_first_error": number(("parameter",), "1", "its standard error"),
    "sobol_total": number(("parameter",), "1", "total Sobol index"),
    "sobol_total_error": number(("parameter",), "1", "its standard error"),
    "influence": number(("parameter",), "objective", "mean effect, what parameters are ranked by"),
    "selected": flag(("parameter",), "whether its influence is great"),
}

KRIGING: Columns = {
    "model": text(("model",), "name of the model, one for each subinterval"),
    "point": count(("point",), "number of the training point"),
    "parameter": text(("parameter",), "design variable"),
    "family": text(("model",), "what the subintervals make up together"),
    "training_output": number(("model", "point"), "objective", "objective at the training point"),
    "weight": number(("model", "point"), "1", "weight of the training point in a prediction", required=True),
    "length_scale": number(("model", "parameter"), "1", "correlation length, in the unit cube", required=True),
    "used": flag(("model", "parameter"), "whether the parameter is an input of the model"),
    "signal_variance": number(("model",), "1", "variance of the process, in output_scale^2"),
    "noise_variance": number(("model",), "1", "variance of the noise, in output_scale^2"),
    "output_mean": number(("model",), "objective", "mean taken off before the fit"),
    "output_scale": number(("model",), "objective", "deviation divided by before the fit"),
    "dropped": count(("model",), "number of failed samples left out of the fit"),
    "accepted": flag(("model",), "whether the model passed on its test points"),
    **_fit("model"),
}

FRONT: Columns = {
    "case": text(("case",), "case of the robust design"),
    "run": count(("run",), "number of the run of the optimiser"),
    "solution": count(("solution",), "number of the solution in its run"),
    "mean": number(("case", "run", "solution"), "objective",
        "mean of the objective, by the surrogate", required=True),
    "deviation": number(("case", "run", "solution"), "objective",
        "standard deviation of the objective, by the surrogate", required=True),
    "verified": flag(("case", "run", "solution"), "whether the solution was simulated directly"),
    "hypervolume": number(("case", "run"), "objective^2", "area that the front dominates"),
    "searched": text(("case",), "what is made small, where that is not mean and deviation alone"),
    "searched_first": number(("case", "run", "solution"), "", "the first of these, by the surrogate"),
    "searched_second": number(("case", "run", "solution"), "", "the second of these, by the surrogate"),
}

VERIFICATION: Columns = {
    "design": text(("design",), "name of the design"),
    "case": text(("design",), "case of the robust design"),
    "mean_true": number(("design",), "objective", "mean of the objective, by direct simulation", required=True),
    "mean_lower": number(("design",), "objective", "lower confidence limit of the mean"),
    "mean_upper": number(("design",), "objective", "upper confidence limit of the mean"),
    "mean_surrogate": number(("design",), "objective", "mean of the objective, by the surrogate"),
    "mean_error": number(("design",), "1", "error of the surrogate mean, relative to the true one"),
    "mean_paper": number(("design",), "m", "mean as printed in the paper, its Table 4"),
    "deviation_true": number(("design",), "objective", "standard deviation, by direct simulation", required=True),
    "deviation_lower": number(("design",), "objective", "lower confidence limit of the deviation"),
    "deviation_upper": number(("design",), "objective", "upper confidence limit of the deviation"),
    "deviation_surrogate": number(("design",), "objective", "standard deviation, by the surrogate"),
    "deviation_error": number(("design",), "1", "error of the surrogate deviation, relative"),
    "deviation_paper": number(("design",), "m", "deviation as printed in the paper, its Table 4"),
    "percentile": number(("design",), "objective", "95th percentile of the objective, by direct simulation"),
    "percentile_lower": number(("design",), "objective", "lower confidence limit of the percentile"),
    "percentile_upper": number(("design",), "objective", "upper confidence limit of the percentile"),
    "life_mean": number(("design",), "objective", "mean of the objective over lives of its own, all ages alike"),
    "life_mean_lower": number(("design",), "objective", "lower confidence limit of it"),
    "life_mean_upper": number(("design",), "objective", "upper confidence limit of it"),
    "life_deviation": number(("design",), "objective", "standard deviation of the objective over lives of its own and ages"),
    "life_deviation_lower": number(("design",), "objective", "lower confidence limit of it"),
    "life_deviation_upper": number(("design",), "objective", "upper confidence limit of it"),
    "same_as": text(("design",), "design named before it that it cannot be told apart from, in mean and deviation"),
    "dominated": flag(("design",), "whether another design of its case is surely better in mean and deviation"),
    "mean_within": number(("design",), "1",
        "relative half-width of the limits of the mean, what the tolerance may add included"),
    "deviation_within": number(("design",), "1", "the same of the deviation"),
    **_goal("first"), **_goal("second"),
    "constraints": text(("design",), "how it stands to the constraints of its case"),
    "samples": count(("design",), "number of simulations"),
    "failed": count(("design",), "number of simulations that failed"),
    "beyond_hertz": count(("design",), "number of simulations whose penetration left the range of Hertz theory"),
    "random": text(("design",), "random inputs of its case"),
    "on_bounds": text(("design",), "variables that sit on a bound of the study, and on which"),
}

BUDGET: Columns = {
    "rung": count(("rung",), "rung of the ladder of tolerances; the last is what the others are measured against"),
    "design": text(("design",), "design of the pilot"),
    "moment": text(("moment",), "what the error is of"),
    "rtol": number(("rung",), "1", "relative tolerance of a step", required=True),
    "evaluations": number(("rung",), "1", "evaluations of the equations of motion, a simulation", required=True),
    "bias": number(("rung", "moment"), "1",
        "relative error that the tolerance makes, root mean square over designs", required=True),
    "bias_error": number(("rung", "moment"), "1", "standard error of its mean", required=True),
    "chosen": flag(("rung",), "whether the study is simulated at it", required=True),
    "reach": number(("design", "moment"), "1", "relative half-width of the limits by the pilot's points", required=True),
    "power": number(("moment",), "1", "power of the number of simulations that it falls by", required=True),
    "tolerance_share": number(("moment",), "1", "what the tolerance takes of the accuracy", required=True),
    "sampling_share": number(("moment",), "1", "what is left to the samples; squares add up", required=True),
    "reached": number(("moment",), "1",
        "what verified designs came to at worst, the tolerance included; missing until they are", required=True),
}

CHAOS: Columns = {
    "design": text(("design",), "name of the design"),
    "chaos_deviation": number(("design",), "objective",
        "standard deviation of the objective under kicks of 1e-9 alone", required=True),
    "chaos_share": number(("design",), "1", "its share of the variance over random inputs", required=True),
    "chaotic": number(("design",), "1", "share of samples whose objective moves with such a kick", required=True),
    "pairs": count(("design",), "samples simulated twice", required=True),
}

CLAIMS: Columns = {
    "claim": count(("claim",), "number of the claim"),
    "text": text(("claim",), "what is claimed", required=True),
    "verdict": text(("claim",), "holds, does not hold, or cannot be told", required=True),
    "figure": text(("claim",), "the number that decides", required=True),
}

READINGS: Columns = {
    "reading": text(("reading",), "how the text of the paper is read"),
    "design": text(("design",), "design of the paper, its Table 4"),
    "case": text(("design",), "case of the robust design"),
    "objective_smallest": number(("reading", "design"), "m", "objective at the smallest clearance", required=True),
    "mean": number(("reading", "design"), "m", "mean of the objective, by direct simulation", required=True),
    "mean_error": number(("reading", "design"), "m", "standard error of it"),
    "deviation": number(("reading", "design"), "m", "standard deviation of the objective", required=True),
    "deviation_error": number(("reading", "design"), "m", "standard error of it"),
    "failed": count(("reading", "design"), "number of simulations that failed"),
    "mean_paper": number(("design",), "m", "mean as printed"),
    "deviation_paper": number(("design",), "m", "deviation as printed"),
    "distance": number(("reading",), "1", "root mean square of ln(mean / printed mean)"),
}

TIMING: Columns = {
    "rank": count(("rank",), "MPI rank"),
    "stage": text(("stage",), "stage of the run"),
    "busy": number(("rank", "stage"), "s", "time spent computing", required=True),
    "idle": number(("rank", "stage"), "s", "time spent waiting for other ranks", required=True),
    "compile": number(("rank", "stage"), "s", "time spent compiling", required=True),
    "write": number(("rank", "stage"), "s", "time spent writing checkpoints and results", required=True),
    "samples": count(("rank", "stage"), "number of samples simulated"),
    "command": text((), "the command that was run", required=True),
}

STATISTICS: Columns = {
    "joint": text(("joint",), "joint"),
    "bin": count(("bin",), "number of the bin; the first lies below the edges, the last at or above"),
    "edge": count(("edge",), "number of the edge between two bins"),
    "outcome": flag(("outcome",), "how a simulation ended"),
    "flags": flag(("flags",), "with which care a result is to be read"),
    "samples_by_status": count(("outcome",), "number of samples that ended so", required=True),
    "samples_by_flag": count(("flags",), "number of samples with this flag", required=True),
    **_statistics_of("objective", (), "objective", "objective"),
    **_statistics_of("objective_spread", (), "objective", "deviation between revolutions"),
    **_statistics_of("mean_gap", ("joint",), "m", "mean gap"),
    **_statistics_of("peak_contact_force", ("joint",), "N", "peak contact force"),
    **_statistics_of("rhs_evaluations", (), "1", "number of force evaluations"),
}

WEAR: Columns = {
    "life": count(("life",), "number of the life"),
    "joint": text(("joint",), "worn joint"),
    "open_joint": text(("open_joint",), "joint of the scene"),
    "cycle": number(("cycle",), "1", "revolutions since new"),
    "quantile": number(("quantile",), "1", "share of lives that do not exceed"),
    "random_input": text(("random_input",), "random input"),
    "angle": number(("angle",), "rad", "angle around a surface, in its body"),
    "clearance": number(("life", "cycle", "joint"), "m", "radial clearance", required=True),
    "local_clearance": number(("life", "cycle", "joint"), "m", "largest clearance around the joint"),
    "bearing_profile": number(("quantile", "cycle", "joint", "angle"), "m",
        "quantiles of the depth of wear around the bearing"),
    "journal_profile": number(("quantile", "cycle", "joint", "angle"), "m",
        "quantiles of the depth of wear around the journal"),
    "sharpest": number(("life",), "1", "largest curvature of a groove over that of the clearance circle"),
    "even_clearance": number(("life", "cycle", "joint"), "m", "clearance of the same life with surfaces that wear evenly"),
    "even_lifetime": number(("life",), "1",
        "revolutions until the first limit is passed with surfaces that wear evenly; infinite if none is"),
    "even_lifetime_quantile": number(("quantile",), "1", "quantiles of the life with surfaces that wear evenly"),
    "even_simulations": count(("life",), "number of simulations with surfaces that wear evenly"),
    "bearing_depth": number(("life", "cycle", "joint"), "m", "mean depth of wear of the bearing", required=True),
    "journal_depth": number(("life", "cycle", "joint"), "m", "mean depth of wear of the journal", required=True),
    "objective": number(("life", "cycle"), "objective", f"objective f, {MEAN_GAP.words}", required=True),
    "peak_contact_force": number(("life", "cycle", "open_joint"), "N",
        "peak contact force over the averaged revolutions, mean of the copies", required=True),
    "clearance_limit": number(("life", "joint"), "m",
        "95 % half-width of the clearance at the end for the limits of the wear rates", required=True),
    "clearance_error": number(("life", "joint"), "m",
        "sum over jumps of what two half jumps and one differ by in the clearance at most", required=True),
    "drift": number(("life",), "1",
        "largest difference of a wear rate or f between copies that waited longer and others, beyond scatter, relative",
        required=True),
    "lifetime": number(("life",), "1", "revolutions until the first limit is passed; infinite if none is", required=True),
    "ended": number(("life",), "1", "revolutions that were followed", required=True),
    "jumps": count(("life",), "number of jumps", required=True),
    "simulations": count(("life",), "number of simulations", required=True),
    "ending": flag(("life",), "how the life ended", required=True),
    "flags": flag(("life",), "what to mind when reading the result", required=True),
    "clearance_quantile": number(("quantile", "cycle", "joint"), "m", "quantiles of the clearance", required=True),
    "objective_quantile": number(("quantile", "cycle"), "objective", "quantiles of the objective", required=True),
    "lifetime_quantile": number(("quantile",), "1", "quantiles of the life; infinite beyond what was followed", required=True),
    "survival": number(("cycle",), "1", "share of lives that are not over", required=True),
    "survival_lower": number(("cycle",), "1", "lower 95 % limit of the survival", required=True),
    "survival_upper": number(("cycle",), "1", "upper 95 % limit of the survival", required=True),
    "exceedance": number(("cycle", "joint"), "1", "share of lives whose clearance is above its limit"),
    "exceedance_lower": number(("cycle", "joint"), "1", "lower 95 % limit of it"),
    "exceedance_upper": number(("cycle", "joint"), "1", "upper 95 % limit of it"),
    "rank_correlation": number(("random_input", "joint"), "1",
        "rank correlation of the growth of the clearance at the end with the random input", required=True),
}

EFFECTS: Columns = {
    "variant": count(("variant",), "number of the variant; 0 is the whole scene"),
    "effect": text(("effect",), "effect that may be off"),
    "response": text(("response",), "what changes"),
    "off": flag(("variant", "effect"), "whether the effect is off in the variant", required=True),
    "change": number(("variant", "response"), "1", "relative change against the whole scene", required=True),
    "limit": number(("variant", "response"), "1", "half-width of its confidence limits", required=True),
    "told": flag(("variant", "response"), "what the change is to the tolerance", required=True),
    "decision": flag(("variant",), "the same of all changes that count", required=True),
    "point_change": number(("variant",), "1",
        "root mean square change of single samples, relative to the mean", required=True),
    "judged": flag(("response",), "whether its change counts", required=True),
    "recommended": flag(("variant",), "the cheapest within the tolerance", required=True),
    "work": number(("variant",), "1", "evaluations times size of one, over those of the whole scene", required=True),
    "evaluations": number(("variant",), "1", "mean number of evaluations of the equations of motion", required=True),
    "coordinates": count(("variant",), "coordinates that are integrated", required=True),
    "samples": count(("variant",), "number of simulations", required=True),
    "failed": count(("variant",), "number of simulations that failed", required=True),
    "objective": number(("variant",), "objective", f"mean objective f, {MEAN_GAP.words}", required=True),
}

ACCURACY: Columns = {
    "integrator": text(("integrator",), "way of integrating"),
    "rung": count(("rung",), "rung of the ladder of tolerances"),
    "quantity": text(("quantity",), "what the error is of"),
    "setting": number(("integrator", "rung"), "1",
        "relative tolerance, or step over period for fixed steps", required=True),
    "error": number(("integrator", "rung", "quantity"), "1",
        "relative error after one revolution, RMS over designs", required=True),
    "seconds": number(("integrator", "rung"), "s", "wall time of one design over one revolution", required=True),
    "evaluations": number(("integrator", "rung"), "1",
        "force evaluations of one design over one revolution", required=True),
    "order": number(("integrator", "quantity"), "1",
        "slope of error against evaluations, both logarithmic", required=True),
    "reference_error": number(("quantity",), "1", "difference of two ways to the reference, relative", required=True),
    "tolerance": number(("tolerance",), "1", "relative tolerance of a steady mean"),
    "spent": count(("spent",), "revolutions averaged, over all copies"),
    "aim": number(("aim",), "1", "relative standard error aimed at"),
    "spent_error": number(("tolerance", "spent"), "1", "relative error of f, RMS over disjoint means", required=True),
    "spent_model": number(("tolerance", "spent"), "1",
        "the same by the formula: bias^2 + variance/revolutions", required=True),
    "spent_seconds": number(("tolerance", "spent"), "s", "core-seconds of a mean with its spin-up", required=True),
    "tolerance_bias": number(("tolerance",), "1",
        "mean of f against the tightest tolerances that agree, relative", required=True),
    "tolerance_bias_error": number(("tolerance",), "1", "standard error of that", required=True),
    "turn_variance": number(("tolerance",), "1",
        "variance of f over one revolution among many, relative", required=True),
    "tolerance_seconds": number(("tolerance",), "s", "core-seconds of a revolution", required=True),
    "spin_up": number((), "1", "revolutions that each copy leaves out", required=True),
    "cheapest_tolerance": number(("aim",), "1", "tolerance of the cheapest mean", required=True),
    "cheapest_revolutions": number(("aim",), "1", "its revolutions", required=True),
    "cheapest_seconds": number(("aim",), "s", "its core-seconds", required=True),
    "transient": count(("transient",), "revolutions waited for"),
    "averaged": count(("averaged",), "revolutions averaged"),
    "averaging_error": number(("transient", "averaged"), "1", "relative error of f, RMS over copies", required=True),
    "averaging_floor": number((), "1", "scatter of long averages between copies, relative", required=True),
    "turn_seconds": number((), "s", "wall time of one revolution of one copy", required=True),
    "surrogate": text(("surrogate",), "kind of surrogate"),
    "training": count(("training",), "sample size of the surrogates"),
    "r2": number(("surrogate", "training"), "1", "1 - SSE/SST on test points", required=True),
    "rmae": number(("surrogate", "training"), "1", "largest test error over their standard deviation", required=True),
    "leave_one_out": number(("surrogate", "training"), "1",
        "RMS leave-one-out error over the standard deviation", required=True),
    "fit_seconds": number(("surrogate", "training"), "s", "wall time of the fit", required=True),
    "sample_seconds": number((), "s", "core-seconds of one simulation", required=True),
    "estimate": text(("estimate",), "what is drawn from: a surrogate or simulations"),
    "moment": text(("moment",), "mean or deviation"),
    "draws": count(("draws",), "Monte Carlo sample size"),
    "moment_error": number(("estimate", "moment", "draws"), "1", "RMS error of Monte Carlo, relative", required=True),
    "moment_lower": number(("estimate", "moment", "draws"), "1", "its lower 95 % confidence limit", required=True),
    "moment_upper": number(("estimate", "moment", "draws"), "1", "its upper 95 % confidence limit", required=True),
    "moment_seconds": number(("estimate", "draws"), "s", "core-seconds of one Monte Carlo estimate", required=True),
    "moment_bias": number(("moment",), "1", "surrogate by quadrature against simulations, relative", required=True),
    "bias_error": number(("moment",), "1", "standard error of that", required=True),
    "quadrature_seconds": number((), "s", "core-seconds of the quadrature", required=True),
    "closed_form": number(("moment",), "1", "quadrature against closed form, relative", required=True),
    "ranks": count(("ranks",), "number of ranks at work"),
    "strong_seconds": number(("ranks",), "s", "wall time of a fixed batch", required=True),
    "weak_seconds": number(("ranks",), "s", "wall time of a batch that grows with the ranks", required=True),
    "loss": text(("loss",), "what time is lost to"),
    "lost_seconds": number(("loss",), "s", "core-seconds lost, over all ranks", required=True),
}
# fmt: on
