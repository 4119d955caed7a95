"""Names of units as engineers write them: one table of those that are read, one of those that are refused with a remedy.

Sources: BIPM, "The International System of Units" (9th edition, 2019); NIST SP 811 (2008), appendix B, for pounds, inches, kgf.
"""

from fractions import Fraction
from math import pi

Dimensions = dict[str, Fraction]
"""Exponents of metre, gram, second and radian, by pint's names of them."""
Unit = tuple[Fraction, Dimensions]
"""Factor to metre, gram, second and radian, and the exponents of these."""

_PREFIXES = {
    "n": -9, "u": -6, "µ": -6, "μ": -6, "m": -3, "c": -2, "d": -1, "": 0, "da": 1, "h": 2, "k": 3, "M": 6, "G": 9,
}  # fmt: skip


def _unit(
    size: Fraction | int, meter: int = 0, gram: int = 0, second: int = 0, radian: int = 0
) -> Unit:
    powers = {"meter": meter, "gram": gram, "second": second, "radian": radian}
    return Fraction(size), {name: Fraction(power) for name, power in powers.items() if power}


_INCH, _POUND, _G = Fraction(254, 10_000), Fraction(45_359_237, 10**8), Fraction(980_665, 10**5)
_POUND_FORCE = _POUND * _G
_TURN = Fraction(2 * pi)

_BASES: dict[str, Unit] = {
    "m": _unit(1, 1), "g": _unit(1, 0, 1), "s": _unit(1, 0, 0, 1), "rad": _unit(1, 0, 0, 0, 1), "Hz": _unit(1, 0, 0, -1),
    "N": _unit(1000, 1, 1, -2), "Pa": _unit(1000, -1, 1, -2), "bar": _unit(10**8, -1, 1, -2), "J": _unit(1000, 2, 1, -2),
    "W": _unit(1000, 2, 1, -3),
}  # fmt: skip
"""Units that take prefixes."""

_SINGLE: dict[str, Unit] = {
    "min": _unit(60, 0, 0, 1), "h": _unit(3600, 0, 0, 1), "t": _unit(10**6, 0, 1),
    "in": _unit(_INCH, 1), "ft": _unit(12 * _INCH, 1), "thou": _unit(_INCH / 1000, 1),
    "lb": _unit(1000 * _POUND, 0, 1), "oz": _unit(1000 * _POUND / 16, 0, 1),
    "kgf": _unit(1000 * _G, 1, 1, -2), "lbf": _unit(1000 * _POUND_FORCE, 1, 1, -2),
    "ozf": _unit(1000 * _POUND_FORCE / 16, 1, 1, -2),
    "psi": _unit(1000 * _POUND_FORCE / _INCH**2, -1, 1, -2), "ksi": _unit(10**6 * _POUND_FORCE / _INCH**2, -1, 1, -2),
    "P": _unit(100, -1, 1, -1), "cP": _unit(1, -1, 1, -1), "deg": _unit(Fraction(pi) / 180, 0, 0, 0, 1),
    "turn": _unit(_TURN, 0, 0, 0, 1), "rpm": _unit(_TURN / 60, 0, 0, -1, 1), "rps": _unit(_TURN, 0, 0, -1, 1),
    "%": _unit(Fraction(1, 100)), "‰": _unit(Fraction(1, 1000)),
}  # fmt: skip

UNITS: dict[str, Unit] = _SINGLE | {
    prefix + symbol: (size * Fraction(10) ** exponent, powers)
    for symbol, (size, powers) in _BASES.items()
    for prefix, exponent in _PREFIXES.items()
    if prefix + symbol not in ("Mm", "Gg", "Grad", "hbar")  # nobody means them
}
"""Units by symbol. Others are looked up in pint's registry, whose import takes longer than a simulation."""

SPELLINGS = {
    name: symbol
    for symbol, names in {
        "rpm": "RPM Rpm UPM Upm upm U/min r.p.m. r.p.m",
        "rps": "RPS",
        "turn": "rev revs Rev U r tr Umdr",
        "deg": "° º Deg DEG degCA °CA CAD degKW °KW",
        "kg": "Kg KG kgs Kgs kilo kilos",
        "g": "gms",
        "lb": "lbs lbm Lb LB",
        "kN": "KN",
        "GPa": "Gpa gpa GPA",
        "MPa": "Mpa MPA",
        "kPa": "kpa Kpa KPa",
        "Pa": "PA",
        "bar": "Bar BAR bara",
        "psi": "PSI psia",
        "Hz": "hz HZ",
        "kHz": "khz KHz Khz",
        "mm": "㎜",
        "um": "micron microns",
        "in": '" ″ inch inches Inch',
        "s": "sec secs",
        "min": "Min mins",
        "h": "hr hrs",
        "kgf": "kp",
        "rad": "rads",
        "%": "percent pct",
    }.items()
    for name in names.split()
}
SPELLINGS |= {f"bar{end}": "bar" for end in ("(a)", " a", " abs", " (abs)", " absolute", "(abs)")}
"""Other spellings that leave no doubt of what is meant."""

TURNS_BY_TIME = ("U", "r", "tr")
"""Turns on nameplates (U/min, r/min, tr/min), which mean nothing without a time."""

HEADS = (
    *(prefix + symbol for symbol in ("N", "g", "Pa", "J", "W") for prefix in _PREFIXES),
    *("kgf", "lbf", "ozf", "lb", "oz"),
)
"""Units that others are written against without a sign between: Nm, kgm2, mPas."""
TAILS = ("nm", "um", "µm", "μm", "mm", "cm", "dm", "m", "km", "in", "ft", "s", "ms", "min", "h")
"""Units that are written so."""

REFUSED = {
    "Mm": "Write mm for millimetres: Mm are megametres",
    "Grad": "Write deg for degrees, or gon",
    "gr": "Write g for grams, or grain",
    "mil": "Write thou for 1/1000 inch, or mrad",
    "Nms": "Write N*m*s or N*ms",
    "barg": "Write an absolute pressure in bar: a gauge pressure leaves the ambient pressure out",
    "psig": "Write an absolute pressure in psi: a gauge pressure leaves the ambient pressure out",
}
"""Names that are read in more than one way, and what to write."""
