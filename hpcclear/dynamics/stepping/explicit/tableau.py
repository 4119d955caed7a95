"""Embedded Runge-Kutta pairs as data; the stepper reads the coefficients and is compiled once for all.

The equations of motion are of second order with q' = v, so the stages of q follow from those of v:
``q_s = q + h c_s v + h^2 sum_j (A A)_sj a_j``. This is the same method, in exact arithmetic, as applying A to the
first-order system, with half the storage. Every pair is brought to first-same-as-last form: its last stage
is the new point, whose accelerations start the next step.
"""

from dataclasses import dataclass
from fractions import Fraction as F

import numpy as np

STAGES = 14
"""Most stages of a pair, the new point included. Sums over the stages are unrolled: steps are compiled for their number."""

# where the rows of a packed tableau start, each as long as the longest: c, A, A A, b, e, e A, b - (the stage before)
NODES = 0
MATRIX = NODES + STAGES
SQUARE = MATRIX + STAGES * STAGES
WEIGHTS = SQUARE + STAGES * STAGES
ERROR = WEIGHTS + STAGES
ERROR_SQUARE = ERROR + STAGES
LAST = ERROR_SQUARE + STAGES
PACKED = LAST + STAGES


@dataclass(frozen=True)
class Tableau:
    """An embedded pair, first-same-as-last: stage matrix `a` (stages, stages), weights `b` and error weights `e` (stages,).

    `order`: of the solution that is carried on; `error_order`: of the other one, the error estimate scales like
    h**(error_order + 1). Raises ValueError if there are more than `STAGES` stages, or coefficients do not fit together.
    """

    name: str
    order: int
    error_order: int
    a: np.ndarray
    b: np.ndarray
    e: np.ndarray
    source: str

    def __post_init__(self) -> None:
        s = self.stages
        if not (self.a.shape == (s, s) and len(self.b) == len(self.e) == s <= STAGES):
            most = f"{STAGES} stages at most, the new point included, not {s}"
            raise ValueError(f"{self.name}: the stepper takes pairs of {most}")

    @property
    def stages(self) -> int:
        """How many there are, the new point included."""
        return len(self.b)

    def packed(self) -> np.ndarray:
        """Coefficients for the stepper in one flat array: c, A, A A, b, e, e A, b - (the stage before); 0 for stages that are
        not there."""
        a, left = self.a, STAGES - self.stages
        rows = (a.sum(axis=1), a, a @ a, self.b, self.e, self.e @ a, self.b - a[-2])
        return np.concatenate([np.pad(x, (0, left)).ravel() for x in rows])


def _pair(
    name: str, orders: tuple[int, int], source: str, numbers: str, *, difference: bool = False
) -> Tableau:
    """Assemble a tableau from exact numbers, as printed: rows of its matrix but for the first, which is empty, its weights, and
    the other solution's or their `difference`. The new point, whose row are the weights, becomes the last stage."""
    rows = [[F(number) for number in row.split()] for row in numbers.split(";")]
    size = len(rows[-2]) + 1
    *matrix, weights, other = ([*row, *[F(0)] * (size - len(row))] for row in [[], *rows])
    error = other if difference else [x - y for x, y in zip(weights, other, strict=True)]
    a, b, e = (np.array(one, dtype=float) for one in ([*matrix, weights], weights, error))
    return Tableau(name, *orders, a, b, e, source)


DORMAND_PRINCE = _pair("dormand-prince", (5, 4), "Dormand and Prince 1980, doi:10.1016/0771-050X(80)90013-3", """
    1/5;
    3/40 9/40;
    44/45 -56/15 32/9;
    19372/6561 -25360/2187 64448/6561 -212/729;
    9017/3168 -355/33 46732/5247 49/176 -5103/18656;
    35/384 0 500/1113 125/192 -2187/6784 11/84;
    5179/57600 0 7571/16695 393/640 -92097/339200 187/2100 1/40
""")  # fmt: skip

# By decimals, whose order conditions hold to 1e-36.
TSITOURAS = _pair("tsitouras", (5, 4), "Tsitouras 2011, doi:10.1016/j.camwa.2011.06.002", """
    0.161;
    -0.0084806554923569885444268742502307747 0.3354806554923569885444268742502307747;
    2.8971530571054934321304325941929387649 -6.3594484899750748431481599123838256260
      4.3622954328695814110177273181908868610;
    5.3258648284392566044288779208405113178 -11.748883564062827877747170339785772962
      7.4955393428898362083046047845643581557 -0.0924950663617552492565020793320719161;
    5.8614554429464200286592514869826478904 -12.920969317847109291706118681783359395
      8.1593678985761586431804007945392534852 -0.0715849732814009972245305425258297387
      -0.0282690503940683829090030572127122415;
    0.0964607668180652295181673131651287633 0.01 0.4798896504144995747752495322905965199
      1.3790085741037418931922748218568727708 -3.2900695154360806799010475857113638501
      2.3247105240997739824153559183987657961;
    -0.001780011052225771443378550607539534776 -0.000816434459656746903223636063354686240
      0.007880878010261996010314727672526304239 -0.1447110071732629075371651479726351167
      0.5823571654525552250199376106520421794 -0.4580821059291869466616365188325542974 1/66
""", difference=True)  # fmt: skip

FEHLBERG = _pair("fehlberg", (4, 5), "Fehlberg 1969, NASA TR R-315: an adaptive fourth-order pair, as in the paper", """
    1/4;
    3/32 9/32;
    1932/2197 -7200/2197 7296/2197;
    439/216 -8 3680/513 -845/4104;
    -8/27 2 -3544/2565 1859/4104 -11/40;
    25/216 0 1408/2565 2197/4104 -1/5 0;
    16/135 0 6656/12825 28561/56430 -9/50 2/55
""")  # fmt: skip

_THIRTEEN = "Prince and Dormand 1981, doi:10.1016/0771-050X(81)90010-3: their 8(7) pair of 13 stages, for tight tolerances"
# Ratios of whole numbers, with which the order conditions hold to 1e-15.
PRINCE_DORMAND = _pair("prince-dormand", (8, 7), _THIRTEEN, """
    1/18;
    1/48 1/16;
    1/32 0 3/32;
    5/16 0 -75/64 75/64;
    3/80 0 0 3/16 3/20;
    29443841/614563906 0 0 77736538/692538347 -28693883/1125000000 23124283/1800000000;
    16016141/946692911 0 0 61564180/158732637 22789713/633445777 545815736/2771057229 -180193667/1043307555;
    39632708/573591083 0 0 -433636366/683701615 -421739975/2616292301 100302831/723423059 790204164/839813087
      800635310/3783071287;
    246121993/1340847787 0 0 -37695042795/15268766246 -309121744/1061227803 -12992083/490766935
      6005943493/2108947869 393006217/1396673457 123872331/1001029789;
    -1028468189/846180014 0 0 8478235783/508512852 1311729495/1432422823 -10304129995/1701304382
      -48777925059/3047939560 15336726248/1032824649 -45442868181/3398467696 3065993473/597172653;
    185892177/718116043 0 0 -3185094517/667107341 -477755414/1098053517 -703635378/230739211 5731566787/1027545527
      5232866602/850066563 -4093664535/808688257 3962137247/1805957418 65686358/487910083;
    403863854/491063109 0 0 -5068492393/434740067 -411421997/543043805 652783627/914296604 11173962825/925320556
      -13158990841/6184727034 3936647629/1978049680 -160528059/685178525 248638103/1413531060 0;
    14005451/335480064 0 0 0 0 -59238493/1068277825 181606767/758867731 561292985/797845732 -1041891430/1371343529
      760417239/1151165299 118820643/751138087 -528747749/2220607170 1/4;
    13451932/455176623 0 0 0 0 -808719846/976000145 1757004468/5645159321 656045339/265891186 -3867574721/1518517206
      465885868/322736535 53011238/667516719 2/45 0
""")  # fmt: skip

TABLEAUS = {t.name: t for t in (TSITOURAS, DORMAND_PRINCE, FEHLBERG, PRINCE_DORMAND)}
