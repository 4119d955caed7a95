"""The one table of what stands in every result file: names, dimensions, units and what they mean.

Each line reads: name, dimensions, unit, long name. A star marks what may not be missing. A row
named as its only dimension is a coordinate. In the place of the unit, ``count`` stands for a whole
number, ``flag`` for a small code whose meanings are attributes, ``text`` for text, ``objective`` (and
``objective^2``) for what has the unit of the study's objective (`Column.unit`); everything else is a
number of double precision in that unit. Units are written so that UDUNITS (CF), pint and
cf-xarray all read them ("kg m^2", not "kg m2").
"""

from typing import NamedTuple

import numpy as np

from hpcclear.base.outcome import ON_REQUEST, Flag, Status


class Column(NamedTuple):
    """A row of the table: what one variable of a file is."""

    dims: tuple[str, ...]
    units: str  # "" for text and flags, which have none; see `unit`
    long_name: str
    dtype: str  # "f8", "i8", "i1" or "text"

    def unit(self, objective: str) -> str:
        """The unit in a study whose objective has the unit `objective`."""
        if self.units == "objective":
            return objective
        if self.units == "objective^2":
            return f"{objective}^2" if objective.isalpha() else f"({objective})^2"
        return self.units


class Kind(NamedTuple):
    """A file of the table."""

    title: str
    coords: dict[str, Column]
    data: dict[str, Column]
    required: frozenset[str]  # data variables; coordinates always are
    design_dims: tuple[str, ...] | None  # dimensions of its design variables; None: it has none
    limit_dims: tuple[str, ...] | None  # dimensions of their limits, NAME_lower and NAME_upper


DESIGN_VARIABLES = {
    "m1": ("kg", "mass of the crank"),
    "u1": ("m", "position of the mass centre of the crank, from its first joint"),
    "I1": ("kg m^2", "inertia of the crank about its mass centre"),
    "m2": ("kg", "mass of the rod"),
    "u2": ("m", "position of the mass centre of the rod, from its first joint"),
    "I2": ("kg m^2", "inertia of the rod about its mass centre"),
    "m3": ("kg", "mass of the slider"),
    "C": ("m", "radial clearance"),
    "I1_ratio": ("1", "inertia of the crank over that of a slender rod, m1 L1^2/12"),
    "I2_ratio": ("1", "inertia of the rod over that of a slender rod, m2 L2^2/12"),
}
"""Units and long names of the design variables of the paper (its Table 3)."""

_NO_YES = np.array([0, 1], np.int8)

FURTHER: dict[str, dict[str, object]] = {
    "status": {
        "flag_values": np.array([int(status) for status in Status], np.int8),
        "flag_meanings": " ".join(status.name.lower() for status in Status),
    },
    "outcome": {
        "flag_values": np.array([int(status) for status in Status], np.int8),
        "flag_meanings": " ".join(status.name.lower() for status in Status),
    },
    "flags": {
        "flag_masks": np.array([int(flag) for flag in Flag], np.int8),
        "flag_meanings": " ".join(flag.name.lower() for flag in Flag),
    },
    "latched": {"flag_values": _NO_YES, "flag_meanings": "free latched"},
    "converged": {"flag_values": _NO_YES, "flag_meanings": "not_determined determined"},
    "selected": {"flag_values": _NO_YES, "flag_meanings": "left_out selected"},
    "used": {"flag_values": _NO_YES, "flag_meanings": "not_an_input input"},
    "surface_accepted": {"flag_values": _NO_YES, "flag_meanings": "refused accepted"},
    "accepted": {"flag_values": _NO_YES, "flag_meanings": "refused accepted"},
    "verified": {"flag_values": _NO_YES, "flag_meanings": "not_simulated simulated"},
}
"""CF attributes beyond units and long name: what the codes mean."""

_OUTCOME = """
objective*            | sample       | m     | objective f, mean distance from the clearance circle
objective_spread*     | sample       | m     | standard deviation of f between averaged revolutions
objective_uncertainty | sample       | m     | scatter of f over kicked copies
mean_gap              | sample joint | m     | time mean of the distance from the clearance circle
peak_contact_force    | sample joint | N     | largest contact force over the averaged revolutions
mean_contact_force    | sample joint | N     | mean contact force over the averaged revolutions
peak_crank_moment     | sample       | N m   | largest size of the moment of the drive on the crank
slider_acceleration_deviation | sample | m/s^2 | standard deviation of the slider acceleration in time
energy_error          | sample       | 1     | what the energy balance leaves unexplained, relative
latched               | sample joint | flag  | whole revolutions in contact, impact speed frozen
rhs_evaluations*      | sample       | count | number of evaluations of the equations of motion
status*               | sample       | flag  | how the simulation ended
flags                 | sample       | flag  | what to mind when reading the result
"""

_RESPONSE = """
time                | time       | s     | time since the start
joint               | joint      | text  | joint with clearance, O12 and O23
crank_angle         | time       | rad   | crank angle
slider_position     | time       | m     | slider position
slider_velocity     | time       | m/s   | slider velocity
slider_acceleration | time       | m/s^2 | slider acceleration
rod_x               | time       | m     | x position of the mass centre of the rod
rod_y               | time       | m     | y position of the mass centre of the rod
rod_angle           | time       | rad   | rod angle
eccentricity_x      | time joint | m     | x distance of the journal centre from the bearing centre
eccentricity_y      | time joint | m     | y distance of the journal centre from the bearing centre
penetration         | time joint | m     | overlap of journal and bearing
contact_force       | time joint | N     | normal contact force
friction_force      | time joint | N     | tangential contact force
reaction_x          | time joint | N     | x force on the rod in an ideal joint
reaction_y          | time joint | N     | y force on the rod in an ideal joint
bearing_x           | time       | N     | x force of the frame on the crank
bearing_y           | time       | N     | y force of the frame on the crank
guide_force         | time       | N     | y force of the guide on the slider
constraint_violation | time      | m     | largest position constraint that is not met
crank_moment        | time       | N m   | reaction moment on the crank
kinetic_energy      | time       | J     | kinetic energy
elastic_energy      | time       | J     | energy stored in the contacts
potential_energy    | time       | J     | potential energy against y = 0
driving_work        | time       | J     | work done by the drive since the start
load_work           | time       | J     | work done by the slider load since the start
dissipated_energy   | time       | J     | energy dissipated since the start
energy_residual     | time       | J     | what the energy balance leaves unexplained
""" + _OUTCOME.replace("| sample joint |", "| joint |").replace("| sample ", "| ")

_SAMPLES = (
    """
sample | sample | count | number of the sample in the design
joint  | joint  | text  | joint with clearance, O12 and O23
"""
    + _OUTCOME
)

_FIT = """
r2*          | {dims} | 1     | 1 - SSE/SST on test points
rmae*        | {dims} | 1     | largest test error over their standard deviation
r2_explained | {dims} | 1     | explained variance ratio, eq. 26 as printed
rmae_mean    | {dims} | 1     | largest test error over their mean, eq. 27 as printed
rmse         | {dims} | objective | root mean square error on test points
points       | {dims} | count | number of points fitted
"""

_SENSITIVITY = """
surface              | surface | text | inputs of the response surface
interval             | interval | 1 | interval, fraction of the range
clearance            | clearance | m | radial clearance
parameter            | parameter | text | design variable
sensitivity*         | surface interval clearance parameter | objective | slope at midpoint, times range
standard_error*      | surface interval clearance parameter | objective | standard error of it
r2*                  | surface interval clearance | 1 | 1 - SSE/SST on test points
rmae*                | surface interval clearance | 1 | largest test error over their standard deviation
leave_one_out_r2     | surface interval clearance | 1 | 1 - SSE/SST of leave-one-out errors
converged*           | surface clearance parameter | flag | whether it is determined
convergence_interval | surface clearance parameter | 1 | interval where it is determined
plateau_interval     | surface clearance parameter | 1 | widest interval from which on it agrees
best_sensitivity     | surface clearance parameter | objective | slope where determined, times range
uncertainty          | surface clearance parameter | objective | standard error of it, truncation included
surface_r2           | surface clearance | 1 | 1 - SSE/SST on test points, global surface
surface_rmae         | surface clearance | 1 | largest test error over their deviation
surface_r2_explained | surface clearance | 1 | explained variance ratio, eq. 26 as printed
surface_rmae_mean    | surface clearance | 1 | largest test error over their mean, eq. 27
surface_order        | surface clearance | count | order of the global surface
surface_points       | surface clearance | count | points it was fitted to
surface_accepted     | surface clearance | flag | whether it passed on its test points
mean_objective       | clearance | objective | mean of the objective over the box
mean_objective_error | clearance | objective | standard error of it
sobol_first          | parameter | 1 | first-order Sobol index
sobol_first_error    | parameter | 1 | its standard error
sobol_total          | parameter | 1 | total Sobol index
sobol_total_error    | parameter | 1 | its standard error
influence            | parameter | objective | mean effect, what parameters are ranked by
selected             | parameter | flag | whether its influence is great
"""

_KRIGING = """
model           | model           | text  | name of the model, one for each subinterval
point           | point           | count | number of the training point
parameter       | parameter       | text  | design variable
family          | model           | text  | what the subintervals make up together
training_output | model point     | objective | objective at the training point
weight*         | model point     | 1     | weight of the training point in a prediction
length_scale*   | model parameter | 1     | correlation length, in the unit cube
used            | model parameter | flag  | whether the parameter is an input of the model
signal_variance | model           | 1     | variance of the process, in output_scale^2
noise_variance  | model           | 1     | variance of the noise, in output_scale^2
output_mean     | model           | objective | mean taken off before the fit
output_scale    | model           | objective | deviation divided by before the fit
dropped         | model           | count | number of failed samples left out of the fit
accepted        | model           | flag  | whether the model passed on its test points
""" + _FIT.format(dims="model")

_FRONT = """
case        | case              | text  | case of the robust design
run         | run               | count | number of the run of the optimiser
solution    | solution          | count | number of the solution in its run
mean*       | case run solution | objective | mean of the objective, by the surrogate
deviation*  | case run solution | objective | standard deviation of the objective, by the surrogate
verified    | case run solution | flag  | whether the solution was simulated directly
hypervolume | case run          | objective^2 | area that the front dominates
"""

_VERIFICATION = """
design              | design | text  | name of the design
case                | design | text  | case of the robust design
mean_true*          | design | objective | mean of the objective, by direct simulation
mean_lower          | design | objective | lower confidence limit of the mean
mean_upper          | design | objective | upper confidence limit of the mean
mean_surrogate      | design | objective | mean of the objective, by the surrogate
mean_error          | design | 1     | error of the surrogate mean, relative to the true one
mean_paper          | design | m     | mean as printed in the paper, its Table 4
deviation_true*     | design | objective | standard deviation, by direct simulation
deviation_lower     | design | objective | lower confidence limit of the deviation
deviation_upper     | design | objective | upper confidence limit of the deviation
deviation_surrogate | design | objective | standard deviation, by the surrogate
deviation_error     | design | 1     | error of the surrogate deviation, relative
deviation_paper     | design | m     | deviation as printed in the paper, its Table 4
samples             | design | count | number of simulations
failed              | design | count | number of simulations that failed
"""

_CLAIMS = """
claim    | claim | count | number of the claim
text*    | claim | text  | what is claimed
verdict* | claim | text  | holds, does not hold, or cannot be told
figure*  | claim | text  | the number that decides
"""

_READINGS = """
reading             | reading        | text  | how the text of the paper is read
design              | design         | text  | design of the paper, its Table 4
case                | design         | text  | case of the robust design
objective_smallest* | reading design | m     | objective at the smallest clearance
mean*               | reading design | m     | mean of the objective, by direct simulation
mean_error          | reading design | m     | standard error of it
deviation*          | reading design | m     | standard deviation of the objective
deviation_error     | reading design | m     | standard error of it
failed              | reading design | count | number of simulations that failed
mean_paper          | design         | m     | mean as printed
deviation_paper     | design         | m     | deviation as printed
distance            | reading        | 1     | root mean square of ln(mean / printed mean)
"""

_TIMING = """
rank     | rank       | count | MPI rank
stage    | stage      | text  | stage of the run
busy*    | rank stage | s     | time spent computing
idle*    | rank stage | s     | time spent waiting for other ranks
compile* | rank stage | s     | time spent compiling
write*   | rank stage | s     | time spent writing checkpoints and results
samples  | rank stage | count | number of samples simulated
command* |            | text  | the command that was run
"""

_STATISTICS = """
joint              | joint  | text  | joint
bin                | bin    | count | number of the bin; the first lies below the edges, the last at or above
edge               | edge   | count | number of the edge between two bins
outcome            | outcome | flag  | how a simulation ended
flags              | flags  | flag  | with which care a result is to be read
samples_by_status* | outcome | count | number of samples that ended so
samples_by_flag*   | flags  | count | number of samples with this flag
"""

_STATISTICS_OF = """
{name}_count*     | {dims}      | count  | number of finite values of the {words}
{name}_mean*      | {dims}      | {unit} | mean of the {words}
{name}_deviation* | {dims}      | {unit} | sample standard deviation of the {words}
{name}_minimum*   | {dims}      | {unit} | least {words}
{name}_maximum*   | {dims}      | {unit} | greatest {words}
{name}_histogram* | {dims} bin  | count  | number of samples by {words}
{name}_edges*     | {dims} edge | {unit} | edges of the bins of the {words}
"""

for _row in (
    {"name": "objective", "dims": "", "unit": "m", "words": "objective"},
    {"name": "objective_spread", "dims": "", "unit": "m", "words": "deviation between revolutions"},
    {"name": "mean_gap", "dims": "joint", "unit": "m", "words": "mean gap"},
    {"name": "peak_contact_force", "dims": "joint", "unit": "N", "words": "peak contact force"},
    {"name": "rhs_evaluations", "dims": "", "unit": "1", "words": "number of force evaluations"},
):
    _STATISTICS += _STATISTICS_OF.format(**_row)

_ACCURACY = """
integrator       | integrator             | text  | way of integrating
rung             | rung                   | count | rung of the ladder of tolerances
quantity         | quantity               | text  | what the error is of
setting*         | integrator rung            | 1     | relative tolerance, or step over period for fixed steps
error*           | integrator rung quantity   | 1     | relative error after one revolution, RMS over designs
seconds*         | integrator rung            | s     | wall time of one design over one revolution
evaluations*     | integrator rung            | 1     | force evaluations of one design over one revolution
order*           | integrator quantity        | 1     | slope of error against evaluations, both logarithmic
reference_error* | quantity               | 1     | difference of two ways to the reference, relative
transient        | transient              | count | revolutions waited for
averaged         | averaged               | count | revolutions averaged
averaging_error* | transient averaged     | 1     | relative error of f, RMS over copies
averaging_floor* |                        | 1     | scatter of long averages between copies, relative
turn_seconds*    |                        | s     | wall time of one revolution of one copy
surrogate        | surrogate              | text  | kind of surrogate
training         | training               | count | sample size of the surrogates
r2*              | surrogate training     | 1     | 1 - SSE/SST on test points
rmae*            | surrogate training     | 1     | largest test error over their standard deviation
leave_one_out*   | surrogate training     | 1     | RMS leave-one-out error over the standard deviation
fit_seconds*     | surrogate training     | s     | wall time of the fit
sample_seconds*  |                        | s     | core-seconds of one simulation
estimate         | estimate               | text  | what is drawn from: a surrogate or simulations
moment           | moment                 | text  | mean or deviation
draws            | draws                  | count | Monte Carlo sample size
moment_error*    | estimate moment draws  | 1     | RMS error of Monte Carlo, relative
moment_lower*    | estimate moment draws  | 1     | its lower 95 % confidence limit
moment_upper*    | estimate moment draws  | 1     | its upper 95 % confidence limit
moment_seconds*  | estimate draws         | s     | core-seconds of one Monte Carlo estimate
moment_bias*     | moment                 | 1     | surrogate by quadrature against simulations, relative
bias_error*      | moment                 | 1     | standard error of that
quadrature_seconds* |                     | s     | core-seconds of the quadrature
closed_form*     | moment                 | 1     | quadrature against closed form, relative
ranks            | ranks                  | count | number of ranks at work
strong_seconds*  | ranks                  | s     | wall time of a fixed batch
weak_seconds*    | ranks                  | s     | wall time of a batch that grows with the ranks
loss             | loss                   | text  | what time is lost to
lost_seconds*    | loss                   | s     | core-seconds lost, over all ranks
"""

_DTYPES = {"count": ("1", "i8"), "flag": ("", "i1"), "text": ("", "text")}


def _kind(
    title: str,
    table: str,
    design_dims: tuple[str, ...] | None = None,
    *,
    limit_dims: tuple[str, ...] | None = None,
    whole: bool = False,
) -> Kind:
    coords: dict[str, Column] = {}
    data: dict[str, Column] = {}
    required = set()
    for line in filter(None, table.splitlines()):
        starred, dims, units, long_name = (cell.strip() for cell in line.split("|"))
        name = starred.rstrip("*")
        units, dtype = _DTYPES.get(units, (units, "f8"))
        row = Column(tuple(dims.split()), units, long_name, dtype)
        (coords if row.dims == (name,) else data)[name] = row
        if starred != name:
            required.add(name)
    needed = frozenset(set(data) - set(ON_REQUEST) if whole else required)
    return Kind(title, coords, data, needed, design_dims, limit_dims)


KINDS = {
    "response": _kind("Response of a mechanism with clearance joints", _RESPONSE),
    "samples": _kind(
        "Samples of a mechanism with clearance joints", _SAMPLES, ("sample",), whole=True
    ),
    "sensitivity": _kind("Sensitivity of the objective against clearance", _SENSITIVITY),
    "kriging": _kind(
        "Kriging models of the objective", _KRIGING, ("model", "point"), limit_dims=("model",)
    ),
    "front": _kind("Fronts of mean and deviation", _FRONT, ("case", "run", "solution")),
    "verification": _kind("Designs simulated directly", _VERIFICATION, ("design",)),
    "claims": _kind("What the paper claims, tested on our data", _CLAIMS),
    "readings": _kind("The paper's designs under readings of its text", _READINGS),
    "statistics": _kind("Statistics of many samples, streamed", _STATISTICS),
    "timing": _kind("Where the time went", _TIMING),
    "accuracy": _kind("What accuracy costs in time", _ACCURACY),
}
"""Every result file by its kind."""
