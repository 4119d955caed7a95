"""Radau IIA of order 5: its coefficients.

Source: Hairer and Wanner, Solving ODEs II, IV.8 (RADAU5, doi:10.1007/978-3-642-05221-7), with two simplifications that
q' = v allows:

- the stages of q follow from those of v, ``Zq = h (c v + A Zv)``, so Newton's unknowns are Zv alone;
- for each eigenvalue mu/h of (h A)^-1 the linear system has n unknowns instead of 2 n, with the matrix
  ``mu/h - da/dv - (h/mu) da/dq``.
"""

import math

import numpy as np

from hpcclear.base.jit import lane_function

_S6 = math.sqrt(6.0)
NODES = np.array([(4.0 - _S6) / 10.0, (4.0 + _S6) / 10.0, 1.0])
MATRIX = np.array([
    [(88.0 - 7.0 * _S6) / 360.0, (296.0 - 169.0 * _S6) / 1800.0, (-2.0 + 3.0 * _S6) / 225.0],
    [(296.0 + 169.0 * _S6) / 1800.0, (88.0 + 7.0 * _S6) / 360.0, (-2.0 - 3.0 * _S6) / 225.0],
    [(16.0 - _S6) / 36.0, (16.0 + _S6) / 36.0, 1.0 / 9.0],
])  # fmt: skip
MU = 3.0 + 3.0 ** (2.0 / 3.0) - 3.0 ** (1.0 / 3.0)  # real eigenvalue of the inverse of A
MU_RE = 3.0 + 0.5 * (3.0 ** (1.0 / 3.0) - 3.0 ** (2.0 / 3.0))
MU_IM = -0.5 * (3.0 ** (5.0 / 6.0) + 3.0 ** (7.0 / 6.0))
# A^-1 = T diag(MU, [[MU_RE, -MU_IM], [MU_IM, MU_RE]]) T^-1
T = np.array([
    [0.09443876248897524, -0.14125529502095421, 0.03002919410514742],
    [0.25021312296533332, 0.20412935229379994, -0.38294211275726192],
    [1.0, 1.0, 0.0],
])  # fmt: skip
T_INVERSE = np.array([
    [4.17871859155190428, 0.32768282076106237, 0.52337644549944951],
    [-4.17871859155190428, -0.32768282076106237, 0.47662355450055044],
    [0.50287263494578682, -2.57192694985560522, 0.59603920482822492],
])  # fmt: skip
ERROR_WEIGHTS = np.array([(-13.0 - 7.0 * _S6) / 3.0, (-13.0 + 7.0 * _S6) / 3.0, -1.0 / 3.0])
ERROR_BY_MATRIX = ERROR_WEIGHTS @ MATRIX
# coefficients of x, x^2, x^3 of the polynomial through 0 at x = 0 and 1 at one of the nodes, 0 at the others
BASIS = np.array([
    [13.0 / 3.0 + 7.0 * _S6 / 3.0, -23.0 / 3.0 - 22.0 * _S6 / 3.0, 10.0 / 3.0 + 5.0 * _S6],
    [13.0 / 3.0 - 7.0 * _S6 / 3.0, -23.0 / 3.0 + 22.0 * _S6 / 3.0, 10.0 / 3.0 - 5.0 * _S6],
    [1.0 / 3.0, -8.0 / 3.0, 10.0 / 3.0],
])  # fmt: skip


@lane_function
def weights_at(x):
    """Weights of the three stages in the polynomial at x."""
    return (
        x * (BASIS[0, 0] + x * (BASIS[0, 1] + x * BASIS[0, 2])),
        x * (BASIS[1, 0] + x * (BASIS[1, 1] + x * BASIS[1, 2])),
        x * (BASIS[2, 0] + x * (BASIS[2, 1] + x * BASIS[2, 2])),
    )
