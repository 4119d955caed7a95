"""Units as engineers write them: a table of names that are read, one of those that are refused, and their products.

Every factor stands here: registries of units differ by version in what a furlong, a drachm or a quarter is.

Sources: BIPM, "The International System of Units" (9th edition, 2019); NIST SP 811 (2008), appendix B, for others.
"""

import re
import unicodedata
from decimal import Decimal, localcontext
from fractions import Fraction
from functools import lru_cache
from math import pi

Dimensions = dict[str, Fraction]
"""Exponents of metre, gram, second and radian."""
Unit = tuple[Fraction, Dimensions]
"""Factor to metre, gram, second and radian, and the exponents of these."""

_PREFIXES = {
    "n": -9, "u": -6, "µ": -6, "μ": -6, "m": -3, "c": -2, "d": -1, "": 0, "da": 1, "h": 2, "k": 3, "M": 6, "G": 9,
}  # fmt: skip


def _unit(size: Fraction | int, *powers: int) -> Unit:
    named = zip(("meter", "gram", "second", "radian"), powers, strict=False)
    return Fraction(size), {name: Fraction(power) for name, power in named if power}


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


def _prefixed(prefixes: dict[str, int], unmeant: tuple[str, ...]) -> dict[str, Unit]:
    """Units with prefixes, but for those that nobody means."""
    made: dict[str, Unit] = {}
    for symbol, (size, powers) in _BASES.items():
        for prefix, exponent in prefixes.items():
            made[prefix + symbol] = size * Fraction(10) ** exponent, powers
    return {name: unit for name, unit in made.items() if name not in unmeant}


UNITS: dict[str, Unit] = _SINGLE | _prefixed(_PREFIXES, ("Mm", "Gg", "Grad", "hbar"))
"""Units by symbol, which remedies propose."""

_LONG = {
    "": "", "pico": "p", "nano": "n", "micro": "u", "milli": "m", "centi": "c", "deci": "d", "deca": "da", "deka": "da",
    "hecto": "h", "kilo": "k", "mega": "M", "giga": "G", "tera": "T",
}  # fmt: skip
_WORDS = {
    "meter": "m", "metre": "m", "gram": "g", "gramme": "g", "second": "s", "radian": "rad", "hertz": "Hz", "newton": "N",
    "pascal": "Pa", "bar": "bar", "joule": "J", "watt": "W",
}  # fmt: skip
_FURTHER: dict[str, Unit] = {
    "yd yard": _unit(36 * _INCH, 1), "mi mile": _unit(63_360 * _INCH, 1), "nmi": _unit(1852, 1),
    "angstrom": _unit(Fraction(1, 10**10), 1), "foot feet": _SINGLE["ft"],
    "tonne": _SINGLE["t"], "pound": _SINGLE["lb"], "ounce": _SINGLE["oz"], "carat ct": _unit(Fraction(1, 5), 0, 1),
    "grain": _unit(1000 * _POUND / 7000, 0, 1), "stone": _unit(14_000 * _POUND, 0, 1),
    "slug": _unit(1000 * _POUND_FORCE / (12 * _INCH), 0, 1), "slinch blob": _unit(1000 * _POUND_FORCE / _INCH, 0, 1),
    "minute": _SINGLE["min"], "hour": _SINGLE["h"], "day d": _unit(86_400, 0, 0, 1), "week": _unit(604_800, 0, 0, 1),
    "msec": _unit(Fraction(1, 1000), 0, 0, 1), "usec": _unit(Fraction(1, 10**6), 0, 0, 1),
    "degree": _SINGLE["deg"], "revolution cycle": _SINGLE["turn"], "gon grad grade": _unit(Fraction(pi) / 200, 0, 0, 0, 1),
    "arcmin": _unit(Fraction(pi) / 10_800, 0, 0, 0, 1), "arcsec": _unit(Fraction(pi) / 648_000, 0, 0, 0, 1),
    "mdeg": _unit(Fraction(pi) / 180_000, 0, 0, 0, 1),
    "dyn dyne": _unit(Fraction(1, 100), 1, 1, -2), "gf": _unit(_G, 1, 1, -2), "tf": _unit(10**6 * _G, 1, 1, -2),
    "kip klbf": _unit(10**6 * _POUND_FORCE, 1, 1, -2), "pdl poundal": _unit(1000 * _POUND * 12 * _INCH, 1, 1, -2),
    "atm": _unit(101_325_000, -1, 1, -2), "torr": _unit(Fraction(101_325_000, 760), -1, 1, -2),
    "at": _unit(98_066_500, -1, 1, -2), "kpsi": _SINGLE["ksi"],
    "Mpsi": _unit(10**9 * _POUND_FORCE / _INCH**2, -1, 1, -2),
    "mmHg": _unit(Fraction(133_322_387_415, 10**6), -1, 1, -2),
    "inHg": _unit(Fraction(254, 10) * Fraction(133_322_387_415, 10**6), -1, 1, -2),
    "erg": _unit(Fraction(1, 10**4), 2, 1, -2), "hp horsepower": _unit(550_000 * _POUND_FORCE * 12 * _INCH, 2, 1, -3),
    "PS": _unit(75_000 * _G, 2, 1, -3),
    "poise": _SINGLE["P"], "centipoise": _SINGLE["cP"], "reyn": _unit(1000 * _POUND_FORCE / _INCH**2, -1, 1, -1),
    "St stokes": _unit(Fraction(1, 10**4), 2, 0, -1), "cSt": _unit(Fraction(1, 10**6), 2, 0, -1),
    "knot kt": _unit(Fraction(1852, 3600), 1, 0, -1), "mph": _unit(63_360 * _INCH / 3600, 1, 0, -1),
    "kph": _unit(Fraction(10, 36), 1, 0, -1), "fps": _unit(12 * _INCH, 1, 0, -1),
    "l L liter litre": _unit(Fraction(1, 1000), 3), "dimensionless": _unit(1),
}  # fmt: skip
OTHERS: dict[str, Unit] = {name: unit for names, unit in _FURTHER.items() for name in names.split()}
OTHERS |= _prefixed({"p": -12, "T": 12}, ("pbar", "Tm", "Tg"))
_KNOWN = UNITS | OTHERS
for _prefix, _short in _LONG.items():
    _spelt = {_prefix + one: _short + of for one, of in _WORDS.items()}
    OTHERS |= {one: _KNOWN[short] for one, short in _spelt.items() if short in _KNOWN}
_PLURAL = [name for name in OTHERS if len(name) > 3 and name[-1] not in "szH"]
OTHERS |= {f"{name}s": OTHERS[name] for name in _PLURAL}
"""Units that are read besides: the SI's in full words, and those of other systems."""

SPELLINGS = {
    name: symbol
    for symbol, names in {
        "rpm": "RPM Rpm UPM Upm upm U/min r.p.m. r.p.m", "rps": "RPS", "turn": "rev revs Rev U r tr Umdr",
        "deg": "° º Deg DEG degCA °CA CAD degKW °KW", "rad": "rads", "kg": "Kg KG kgs Kgs kilo kilos", "g": "gms",
        "lb": "lbs lbm Lb LB", "kN": "KN", "kgf": "kp", "GPa": "Gpa gpa GPA", "MPa": "Mpa MPA", "kPa": "kpa Kpa KPa",
        "Pa": "PA", "bar": "Bar BAR bara", "psi": "PSI psia", "Hz": "hz HZ", "kHz": "khz KHz Khz", "mm": "㎜",
        "um": "micron microns", "in": '" ″ inch inches Inch', "s": "sec secs", "min": "Min mins", "h": "hr hrs",
        "%": "percent pct",
    }.items()
    for name in names.split()
}  # fmt: skip
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
    "ton": "Write t for 1000 kg, or lb", "tons": "Write t for 1000 kg, or lb",
    "hundredweight": "Write kg or lb", "cwt": "Write kg or lb", "quarter": "Write kg or lb",
    "dram": "Write g or oz", "drachm": "Write g or oz", "pond": "Write gf", "cal": "Write J", "calorie": "Write J",
    **dict.fromkeys(
        ("furlong", "furlongs", "fathom", "fathoms", "chain", "chains", "rod", "rods", "pole", "perch", "link", "league"),
        "Write m, ft or yd: it is one length by the survey foot and another by the international foot",
    ),
}  # fmt: skip
"""Names that are read in more than one way, and what to write."""

_TOKEN = re.compile(
    r"\s*(?:(?P<name>[A-Za-zμ%‰°\"]{1,20})\.?(?![A-Za-z])"
    r"(?:(?:\^|\*\*)(?:\((?P<ratio>-?\d{1,3}/[1-9]\d{0,2})\)|\(?(?P<decimal>-?\d\.\d{1,6})\)?)(?!\d)"
    r"|(?:\^|\*\*)?\(?(?P<power>-?\d)\)?(?!\d))?|(?P<sign>\*\*?|[/()]))\s*"
)
_CRANK_ANGLE = re.compile(r"(deg|°)\s*(CA|KW|crank|[ab][TB]DC|[AB]TDC)\b")
_FOREIGN = str.maketrans(
    {**dict.fromkeys("·⋅∙•‧・×", "*"), **dict.fromkeys("−–‐‑", "-"), "º": "°", "″": '"', "⁻": "-"}
    | dict.fromkeys("\u200b\u2060\ufeff")
)
"""Signs that word processors put in place of those of a keyboard; of no width: dropped."""
LONGEST = 80
"""Characters of a quantity or unit, so that nothing takes long over it."""


class UnitError(ValueError):
    """A string that is no quantity of the expected unit; `remedy` says what to write."""

    def __init__(self, reason: str, remedy: str) -> None:
        self.reason = reason
        self.remedy = remedy
        super().__init__(reason, remedy)


class NoUnit(ValueError):
    """A text that is not made of names, powers and signs."""


def _named(name: str) -> list[tuple[str, Unit]]:
    """Units that a name stands for, two of "Nm"; raises ValueError."""
    name = SPELLINGS.get(name, name)
    if name in REFUSED:
        raise UnitError(f"{name!r} may mean more than one unit", REFUSED[name])
    for known in (UNITS, OTHERS):
        if name in known:
            return [(name, known[name])]
    for cut in range(1, len(name)):
        if name[:cut] in HEADS and name[cut:] in TAILS:
            return [(part, UNITS[part]) for part in (name[:cut], name[cut:])]
    raise ValueError(f"{name!r} is not a known unit")


def tidy(text: str) -> str:
    """A unit in the characters of a keyboard: "N·m²" as "N*m2"; raises NoUnit where it is too long for one."""
    if len(text) > LONGEST:
        raise NoUnit
    plain = unicodedata.normalize("NFKC", text.translate(_FOREIGN)).translate(_FOREIGN)
    plain = re.sub(r"(?<=\w)\s+per\s+(?=\w)", "/", plain.strip().replace("''", '"'))
    spelled = plain if plain in TURNS_BY_TIME else SPELLINGS.get(plain, plain)
    plain = _CRANK_ANGLE.sub("deg", spelled)
    # a dot or hyphen between two names is a product: "N.m", "ft-lbf"
    return re.sub(r"(?<=[A-Za-z\d])[.-](?=[A-Za-z])", "*", plain)


def factors_of(text: str) -> list[tuple[str, Fraction, int]]:
    """Names, powers, and 1 or -1 for above or below the line, of a unit in the characters of a keyboard; raises NoUnit."""
    tokens, at = list[re.Match[str]](), 0
    text = re.sub(r"^1\s*(?=/)", "", text)
    while at < len(text):
        found = _TOKEN.match(text, at)
        if found is None:
            raise NoUnit
        tokens.append(found)
        at = found.end()
    factors, sides, side, awaited = list[tuple[str, Fraction, int]](), [1], 1, True
    for token in tokens:
        sign = token["sign"]
        if sign is None:
            power = Fraction(token["ratio"] or token["decimal"] or token["power"] or 1)
            factors.append((token["name"], power, sides[-1] * side))
            side, awaited = 1, False
        elif sign == "(":
            sides.append(sides[-1] * side)
            side, awaited = 1, True
        elif sign == ")" and len(sides) > 1 and not awaited:
            sides.pop()
        elif sign in ("*", "/") and (not awaited or (sign == "/" and token is tokens[0])):
            side, awaited = (-1 if sign == "/" else 1), True
        else:
            raise NoUnit
    if awaited or len(sides) > 1:
        raise NoUnit
    return factors


def _raised(size: Fraction, power: Fraction) -> Fraction:
    """A size to a power: exact of whole ones, else to so many digits that the nearest float is the same."""
    if power.denominator == 1:
        return size ** int(power)
    with localcontext(prec=50):
        base, exponent = (Decimal(one.numerator) / one.denominator for one in (size, power))
        return Fraction(base**exponent)


def dimensions(unit: str) -> tuple[Fraction, Dimensions]:
    """Factor of a unit to metre, gram, second and radian, and its exponents of these; raises ValueError."""
    return parsed(unit)[:2] if unit else (Fraction(1), {})


def parts(unit: str) -> list[tuple[str, Unit, Fraction]]:
    """Names, units and powers of which a unit is the product; raises ValueError."""
    factors, found = factors_of(tidy(unit)), []
    for name, power, side in factors:
        *before, last = _named(name)
        found += [(part, one, Fraction(side)) for part, one in before]
        found.append((*last, power * side))
    seconds = sum(own.get("second", 0) * power for _, (_, own), power in found)
    if any(name in TURNS_BY_TIME for name, _, _ in factors) and seconds >= 0:
        raise ValueError(f"{unit!r} is not a known unit")
    return found


@lru_cache(maxsize=256)
def parsed(unit: str) -> tuple[Fraction, Dimensions, dict[str, Dimensions]]:
    """Factor to base units, dimensions, and those of each unit named; ValueError says why there are none."""
    scale, powers, names = Fraction(1), dict[str, Fraction](), dict[str, Dimensions]()
    for name, (size, own), power in parts(unit):
        scale *= _raised(size, power)
        names[name] = own
        for base, exponent in own.items():
            powers[base] = powers.get(base, Fraction(0)) + exponent * power
    return scale, {base: power for base, power in powers.items() if power}, names
