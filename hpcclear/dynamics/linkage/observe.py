"""Forces and accelerations at given states: the stepper's equations of motion, read instead of integrated."""

from hpcclear.base.jit import scalar_function
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.linkage.rhs import accelerations


@scalar_function
def observe(effects, n, par, torque_table, load_table, states, contacts, times, out):
    """Fill `out` (instants, n + RATES) with accelerations and rates.

    `states` (instants, 2 n): coordinates, then velocities; `contacts` (instants, 4): active flags and 1/d'_0 of both
    joints; `times` (instants,): since the start of the revolution.
    """
    work = out[0, :1].repeat(at.WORK)
    work[:] = 0.0
    for row in range(len(times)):
        for k in range(n):
            work[at.QS + k] = states[row, k]
            work[at.VS + k] = states[row, n + k]
        work[at.ACTIVE_12] = contacts[row, 0]
        work[at.ACTIVE_23] = contacts[row, 1]
        work[at.INVERSE_IMPACT_12] = contacts[row, 2]
        work[at.INVERSE_IMPACT_23] = contacts[row, 3]
        work[at.STAGE_TIME] = times[row]
        accelerations(effects, work, par, torque_table, load_table, 1)
        for k in range(n):
            out[row, k] = work[at.ACC + k]
        for r in range(at.RATES):
            out[row, n + r] = work[at.RATE_NOW + r]
