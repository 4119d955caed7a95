"""Units as engineers write them: each is read by factors worked out by hand, or refused with the right spelling."""

import math
import re

import pytest

from hpcclear.base.units import UnitError, to_si
from hpcclear.report.figures import labels
from hpcclear.scene.paths import quantities

INCH, POUND, G = 0.0254, 0.45359237, 9.80665
RPM = 2.0 * math.pi / 60.0

READ = {
    "m": {
        "mm": 1e-3, "cm": 1e-2, "dm": 0.1, "km": 1e3, "um": 1e-6, "µm": 1e-6, "μm": 1e-6, "nm": 1e-9, "㎜": 1e-3,
        "micron": 1e-6,
        "in": INCH, "in.": INCH, "inch": INCH, "inches": INCH, '"': INCH, "″": INCH, "''": INCH, "ft": 12 * INCH,
        "thou": INCH / 1e3,
        "(mm)": 1e-3, "yd": 0.9144, "miles": 1609.344, "millimetres": 1e-3,
    },
    "kg": {"g": 1e-3, "Kg": 1.0, "KG": 1.0, "kgs": 1.0, "mg": 1e-6, "t": 1e3, "lb": POUND, "lbs": POUND, "lbm": POUND,
    "oz": POUND / 16,
           "gms": 1e-3, "grams": 1e-3},
    "N": {"kN": 1e3, "KN": 1e3, "MN": 1e6, "mN": 1e-3, "daN": 10.0, "cN": 1e-2, "kgf": G, "kp": G, "lbf": POUND * G,
          "kg*m/s^2": 1.0, "kg·m·s⁻²": 1.0, "J/m": 1.0},
    "N*m": {
        "Nm": 1.0, "N m": 1.0, "N.m": 1.0, "N-m": 1.0, "N·m": 1.0, "N⋅m": 1.0, "N•m": 1.0, "N\u2009m": 1.0, "N\u202fm": 1.0,
        "N\u00a0m": 1.0, "mNm": 1e-3, "Nmm": 1e-3, "N*mm": 1e-3, "N.mm": 1e-3, "Ncm": 1e-2, "cNm": 1e-2, "daNm": 10.0,
        "kNm": 1e3,
        "kN·m": 1e3, "KN*m": 1e3, "µNm": 1e-6, "lbf*ft": POUND * G * 12 * INCH, "lbf-ft": POUND * G * 12 * INCH,
        "lbf·in": POUND * G * INCH, "lbfin": POUND * G * INCH, "kgfm": G, "kgf cm": G / 100, "kp·m": G, "J": 1.0, "Ws": 1.0,
    },
    "kg*m**2": {
        "kg m2": 1.0, "kg m^2": 1.0, "kg m²": 1.0, "kg·m²": 1.0, "kgm2": 1.0, "kgm²": 1.0, "kgm^2": 1.0, "kg*m**2": 1.0,
        "kg*mm2": 1e-6, "kg mm²": 1e-6, "kgmm2": 1e-6, "kg-m2": 1.0, "kg.m2": 1.0, "g cm2": 1e-7, "gcm²": 1e-7,
        "g·cm^2": 1e-7,
        "Kg m2": 1.0, "lb*in^2": POUND * INCH**2, "lbm in2": POUND * INCH**2, "lb-ft²": POUND * (12 * INCH) ** 2,
        "t mm2": 1e-3,
    },
    "Pa": {
        "kPa": 1e3, "MPa": 1e6, "Mpa": 1e6, "GPa": 1e9, "Gpa": 1e9, "gpa": 1e9, "hPa": 100.0, "bar": 1e5, "Bar": 1e5,
        "mbar": 100.0,
        "N/mm2": 1e6, "N/mm^2": 1e6, "N/mm²": 1e6, "N/mm**2": 1e6, "N mm^-2": 1e6, "N·mm⁻²": 1e6, "kN/mm²": 1e9, "N/m2": 1.0,
        "kN/cm2": 1e7, "psi": POUND * G / INCH**2, "PSI": POUND * G / INCH**2, "ksi": 1e3 * POUND * G / INCH**2,
        "lbf/in2": POUND * G / INCH**2, "kgf/cm2": G * 1e4, "kp/cm²": G * 1e4, "atm": 101325.0,
    },
    "Pa*s": {"Pas": 1.0, "Pa s": 1.0, "Pa·s": 1.0, "Pa.s": 1.0, "mPas": 1e-3, "mPa·s": 1e-3, "mPa s": 1e-3, "cP": 1e-3,
    "P": 0.1,
             "Ns/m2": 1.0, "N s/m²": 1.0, "kg/(m s)": 1.0},
    "N/m": {"N/mm": 1e3, "kN/mm": 1e6, "N/um": 1e6, "N/µm": 1e6, "MN/m": 1e6, "N mm^-1": 1e3, "N per mm": 1e3,
    "lbf/in": POUND * G / INCH},
    "N*s/m": {"Ns/m": 1.0, "N s/m": 1.0, "N·s/m": 1.0, "N.s/m": 1.0, "Ns/mm": 1e3, "kNs/m": 1e3, "N/(m/s)": 1.0,
    "N / (m / s)": 1.0,
              "N s m^-1": 1.0, "N*s*m⁻¹": 1.0, "kg/s": 1.0, "N/(mm/s)": 1e3},
    "m/s": {"mm/s": 1e-3, "m s-1": 1.0, "m·s⁻¹": 1.0, "km/h": 1 / 3.6, "m/min": 1 / 60},
    "m/s**2": {"m/s2": 1.0, "m/s^2": 1.0, "m/s²": 1.0, "m s-2": 1.0, "m·s⁻²": 1.0, "mm/s²": 1e-3, "ft/s2": 12 * INCH},
    "N*m**2": {"Nm2": 1.0, "Nm²": 1.0, "N m^2": 1.0, "N·mm²": 1e-6, "Nmm2": 1e-6, "kNm²": 1e3},
    "rad/s": {
        "rpm": RPM, "RPM": RPM, "Rpm": RPM, "r.p.m.": RPM, "rev/min": RPM, "Rev/min": RPM, "rev per min": RPM, "U/min": RPM,
        "r/min": RPM, "tr/min": RPM, "1/min": RPM, "1 / min": RPM, "/min": RPM, "min^-1": RPM, "min-1": RPM, "min⁻¹": RPM,
        "min**-1": RPM, "min^(-1)": RPM, "min–1": RPM, "UPM": RPM, "rps": 60 * RPM, "rev/s": 60 * RPM,
        "rad/s": 1.0,
        "rads/s": 1.0, "rad·s⁻¹": 1.0, "rad s-1": 1.0, "deg/s": math.pi / 180, "°/s": math.pi / 180, "krad/s": 1e3,
    },
    "rad": {"deg": math.pi / 180, "°": math.pi / 180, "º": math.pi / 180, "Deg": math.pi / 180, "degrees": math.pi / 180,
            "°CA": math.pi / 180, "deg CA": math.pi / 180, "degCA": math.pi / 180, "°KW": math.pi / 180,
            "deg ATDC": math.pi / 180,
            "mrad": 1e-3, "turn": 2 * math.pi, "rev": 2 * math.pi, "gon": math.pi / 200},
    "Hz": {"Hz": 1.0, "hz": 1.0, "kHz": 1e3, "khz": 1e3, "1/s": 1.0, "rpm": 1 / 60, "1/min": 1 / 60},
    "1/s": {"1/s": 1.0, "s^-1": 1.0, "/s": 1.0, "1/min": 1 / 60, "ms-1": 1e3},
    "s": {"s": 1.0, "ms": 1e-3, "sec": 1.0, "min": 60.0, "h": 3600.0},
    "": {"%": 0.01, "percent": 0.01, "‰": 1e-3, "pct": 0.01},
}  # fmt: skip
"""By the unit of an entry: spellings and their factors."""

ANSWERED = {
    "m": {"Mm": "mm", "MM": "mm", "CM": "cm", "mil": "thou", "mm2": "Write it in m", "UM": "um", "furlong": "survey foot"},
    "kg": {"gr": "Write g", "N": "Write it in kg"},
    "N": {"kg": "kgf", "lb": "lbf", "kn": "kN", "n": "'N'", "Nm": "Write it in N"},
    "N*m": {"NM": "N\\*m", "nm": "N\\*m", "ft-lb": "ft-lbf", "lb*in": "lbf\\*in", "Knm": "kN\\*m", "Nm/rad": "Write it in N"},
    "Pa": {"mpa": "'mPa' or 'MPa'", "kg/cm2": "kgf/cm2", "barg": "absolute", "psig": "absolute", "n/mm2": "N/mm"},
    "kg*m**2": {"kgm": "Write it in kg"},
    "rad/s": {"Hz": "write rpm", "Mhz": "write rpm", "1/s": "write rpm", "/h": "write rpm", "U": "Write it in rad/s"},
    "rad": {"Grad": "deg", "r": "turn"},
    "m/s": {"MM/S": "mm/s"},
    "N*s/m": {"Nms": "N\\*m\\*s", "Nm": "Write it in"},
}  # fmt: skip
"""By the unit of an entry: spellings that are refused, and what the remedy has to say."""

NUMBERS = {
    "0,3 mm": "0.3 mm", "5 000 mm": "digits", "5\u202f000 mm": "digits", "5'000 mm": "digits", "1.000,5 mm": "digits",
    "1.2·10^-3 m": "1.2e-3", "1.2x10^-3 m": "1.2e-3", "7·10⁻³ m": "7e-3 m", "0x10 m": "Write a number",
    "3x10 m": "Write a number", "2,100e-3 m": "2.100e-3 m", "2,100·10^-3 m": "2.100e-3 m", "2,5×10**2 mm": "2.5e2 mm",
    "1,000,00 m": "between them",
    "5² mm": "digits", "1/2 in": "Write a number",
    "~3 mm": "Write a number",
    "3..5 mm": "digits", "mm": "Write a number", "3 [mm]": "Write a number", "3 mm)": "Write a number",
    "3 mm mm": "Write it in m",
    "3 m^m": "Write a number", "3 m//s": "Write a number", "3 ()": "Write a number", "3 (mm": "Write a number",
}  # fmt: skip
"""Lengths that are none, and what the remedy has to say."""


@pytest.mark.parametrize("target", READ)
def test_every_spelling_is_read(target):
    for unit, factor in READ[target].items():
        for text, number in (("3", 3.0), ("-2.5e1 ", -25.0), ("0.5 ", 0.5)):
            glued = unit.startswith("1")  # "31/min" has another number
            written = f"{text.strip()} {unit}" if glued else f"{text}{unit}"
            assert to_si(written, target) == pytest.approx(number * factor, rel=1e-14), written


@pytest.mark.parametrize("target", ANSWERED)
def test_what_is_not_read_is_answered_with_the_right_spelling(target):
    for unit, remedy in ANSWERED[target].items():
        with pytest.raises(UnitError) as error:
            to_si(f"5 {unit}", target)
        assert re.search(remedy, error.value.remedy), (unit, error.value.remedy)


@pytest.mark.parametrize("text", NUMBERS)
def test_numbers_that_are_none_are_answered(text):
    with pytest.raises(UnitError) as error:
        to_si(text, "m")
    assert NUMBERS[text] in error.value.remedy


def test_a_remedy_is_itself_read():
    """Whatever is proposed in quotes can be written."""
    for target, refused in ANSWERED.items():
        for unit in refused:
            with pytest.raises(UnitError) as error:
                to_si(f"5 {unit}", target)
            if "Did you mean" in error.value.remedy:
                for proposed in error.value.remedy.split("'")[1::2]:
                    assert to_si(f"5 {proposed}", target) > 0.0


def test_what_is_printed_is_read_back():
    """Numbers of every size in every unit of an entry, as the terminal, the report and files write them."""
    units = {quantity.unit for quantity in quantities().values()} - {""}
    assert len(units) > 15
    for unit in units:
        spelled = {unit, labels.plain(unit), labels.pretty(unit)}
        spelled |= {labels.scale(unit, 10.0**power).unit for power in range(-12, 13)}
        for shown in spelled:
            factor = to_si(f"1 {shown}", unit)
            assert shown not in (unit, labels.plain(unit), labels.pretty(unit)) or factor == 1.0
        for power in range(-12, 13):
            written = labels.quantity(1.5 * 10.0**power, unit)
            assert to_si(written, unit) == pytest.approx(1.5 * 10.0**power, rel=1e-12), written


@pytest.mark.parametrize("unit", ["N/mm^1.4", "N/mm^(7/5)", "N/mm**1.4", "N*mm^-1.4", "kN/m^1.4"])
def test_powers_may_be_fractions(unit):
    scale = 1e3 if unit.startswith("k") else 10.0**4.2
    assert to_si(f"3 {unit}", "N/m^1.4") == pytest.approx(3.0 * scale, rel=1e-14)
    with pytest.raises(UnitError):
        to_si(f"3 {unit}", "N/m^1.5")


def test_a_fraction_that_gives_a_whole_power_is_exact():
    assert to_si("0.3 mm^1.0", "m") == to_si("0.3 mm", "m")
    assert to_si("3 mm^(4/2)", "m^2") == to_si("3 mm^2", "m^2")
    assert to_si("7 cm^1.5", "m^1.5") == 7e-3
