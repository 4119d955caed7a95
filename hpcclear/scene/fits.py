"""Clearance by ISO 286 fits or by diameters: limits of size, a joint's entries, and the tolerances of a random clearance.

Source: ISO 286-1:2010 (standard tolerances, fundamental deviations) and ISO 286-2:2010 (limit deviations), sizes to 500 mm,
grades 5 to 11, deviations A to H, JS (holes) and a to h, js, k to p (shafts). The numbers were compared with tables of limit
deviations of bearing and tool catalogues, a textbook's tables of fundamental deviations, and the package pressfit 0.1.0.
"""

import re
from bisect import bisect_left
from typing import Annotated, Literal, NamedTuple

from hpcclear.base import tolerances
from hpcclear.base.errors import at
from hpcclear.base.units import note
from hpcclear.scene.fields import Bounds, Content, Entries, Quantity, Table, invalid

SIZES = (3, 6, 10, 18, 30, 50, 80, 120, 180, 250, 315, 400, 500)
"""Largest size of each range, mm."""
PARTS = (
    3, 6, 10, 18, 30, 40, 50, 65, 80, 100, 120, 140, 160, 180, 200, 225, 250, 280, 315, 355, 400, 450, 500,
)  # fmt: skip
"""Largest size of each part of a range, mm: of the fundamental deviations a, b and c."""

GRADES = {
    5: (4, 5, 6, 8, 9, 11, 13, 15, 18, 20, 23, 25, 27),
    6: (6, 8, 9, 11, 13, 16, 19, 22, 25, 29, 32, 36, 40),
    7: (10, 12, 15, 18, 21, 25, 30, 35, 40, 46, 52, 57, 63),
    8: (14, 18, 22, 27, 33, 39, 46, 54, 63, 72, 81, 89, 97),
    9: (25, 30, 36, 43, 52, 62, 74, 87, 100, 115, 130, 140, 155),
    10: (40, 48, 58, 70, 84, 100, 120, 140, 160, 185, 210, 230, 250),
    11: (60, 75, 90, 110, 130, 160, 190, 220, 250, 290, 320, 360, 400),
}
"""Standard tolerances by grade and range of sizes, in micrometres."""

BELOW = {
    "a": (
        270, 270, 280, 290, 300, 310, 320, 340, 360, 380, 410, 460, 520, 580, 660, 740, 820, 920, 1050, 1200, 1350, 1500, 1650,
    ),
    "b": (
        140, 140, 150, 150, 160, 170, 180, 190, 200, 220, 240, 260, 280, 310, 340, 380, 420, 480, 540, 600, 680, 760, 840,
    ),
    "c": (
        60, 70, 80, 95, 110, 120, 130, 140, 150, 170, 180, 200, 210, 230, 240, 260, 280, 300, 330, 360, 400, 440, 480,
    ),
    "d": (20, 30, 40, 50, 65, 80, 100, 120, 145, 170, 190, 210, 230),
    "e": (14, 20, 25, 32, 40, 50, 60, 72, 85, 100, 110, 125, 135),
    "f": (6, 10, 13, 16, 20, 25, 30, 36, 43, 50, 56, 62, 68),
    "g": (2, 4, 5, 6, 7, 9, 10, 12, 14, 15, 17, 18, 20),
    "h": (0,) * len(SIZES),
}  # fmt: skip
"""How far the largest shaft is below the nominal size, in micrometres; holes are as far above it."""
ABOVE = {
    "k": (0, 1, 1, 1, 2, 2, 2, 3, 3, 4, 4, 4, 5),
    "m": (2, 4, 6, 7, 8, 9, 11, 13, 15, 17, 20, 21, 23),
    "n": (4, 8, 10, 12, 15, 17, 20, 23, 27, 31, 34, 37, 40),
    "p": (6, 12, 15, 18, 22, 26, 32, 37, 43, 50, 56, 62, 68),
}
"""How far the smallest shaft is above the nominal size, in micrometres; k of grades 4 to 7, of others 0."""

_FIT = re.compile(
    r"\s*(?:[ØøΦφ⌀]\s*)?(?P<size>\d{1,3}(?:\.\d{1,6})?)\s*(?:mm)?\s*(?P<hole>[A-Z]{1,2})(?P<hole_grade>\d{1,2})"
    r"\s*/\s*(?P<shaft>[a-z]{1,2})(?P<shaft_grade>\d{1,2})\s*"
)
_EXAMPLE = 'Write size, hole and shaft as in "20 H7/f7"'


class Fit(NamedTuple):
    """A hole and a shaft of one nominal size."""

    size: float
    """mm."""
    hole: tuple[float, float]
    """Lower and upper limit deviation, in micrometres."""
    shaft: tuple[float, float]
    """The same."""

    def diameters(self, part: str) -> tolerances.Limits:
        """Smallest and largest diameter of "hole" or "shaft", m."""
        low, high = getattr(self, part)
        return (1e3 * self.size + low) / 1e6, (1e3 * self.size + high) / 1e6

    @property
    def clearances(self) -> tolerances.Limits:
        """Least and largest radial clearance, m; below 0 where both may be tight."""
        (low, high), (least, most) = self.hole, self.shaft
        return (low - most) / 2e6, (high - least) / 2e6

    @property
    def clearance(self) -> float:
        """Radial clearance in the middle of both tolerances, m."""
        return (sum(self.hole) - sum(self.shaft)) / 4e6

    @property
    def bearing_radius(self) -> float:
        """Radius of the hole in the middle of its tolerance, m."""
        return (2e3 * self.size + sum(self.hole)) / 4e6


def fit_of(text: object) -> Fit:
    """Return the limits of size of a fit such as ``"20 H7/f7"``; raise an error for validators if there are none, or no
    clearance."""
    if not isinstance(text, str):
        raise invalid("a fit is written in quotes", _EXAMPLE)
    found = _FIT.fullmatch(text)
    if found is None:
        remedy = _EXAMPLE
        if re.search(r"\d,\d", text):
            remedy = "Write the size with a decimal point"
        elif re.match(r"\s*[A-Za-z]{1,2}\d", text):
            remedy = f'Write the nominal size in mm before it: "20 {text.strip()}"'
        elif re.match(r"[^/]*\d\s*[a-z]{1,2}\d+\s*/\s*[A-Z]", text):
            remedy = "Write the hole, with its capital letter, before the shaft"
        raise invalid("is no fit by ISO 286", remedy)
    size = float(found["size"])
    if not 0.0 < size <= SIZES[-1]:
        raise invalid(f"{found['size']} mm is no size above 0 to {SIZES[-1]} mm", _EXAMPLE)
    hole = _limits(size, found["hole"], int(found["hole_grade"]))
    shaft = _limits(size, found["shaft"], int(found["shaft_grade"]))
    low, high = hole[0] - shaft[1], hole[1] - shaft[0]
    if low < 0.0:
        left = f"{low:.4g} to {high:.4g} um between both diameters"
        reason = f"leaves {left}: no clearance for a joint"
        raise invalid(reason, "Choose a looser fit such as H7/g6, or a joint without clearance")
    return Fit(size, hole, shaft)


def _limits(size: float, letter: str, grade: int) -> tuple[float, float]:
    """Limit deviations of a class such as H7 or f7 at a size in mm, in micrometres."""
    if grade not in GRADES:
        raise invalid(f"{letter}{grade} is of no grade from 5 to 11", _EXAMPLE)
    band = bisect_left(SIZES, size)
    width = GRADES[grade][band]
    small = letter.lower()
    low: float
    if small == "js":
        low = -width / 2
    elif small in BELOW:
        values = BELOW[small]
        near = values[band if len(values) == len(SIZES) else bisect_left(PARTS, size)]
        low = near if letter.isupper() else -near - width
    elif letter in ABOVE:
        low = 0 if letter == "k" and grade > 7 else ABOVE[letter][band]
    else:
        known = "A to H and JS" if letter.isupper() else "a to h, js, k, m, n and p"
        raise invalid(f"{letter}{grade} is not among the classes {known}", _EXAMPLE)
    return low, low + width


_DIAMETER = Quantity("m", above=0)
INSTEAD = {
    "fit": ("clearance", "diametral_clearance", "bearing_radius"),
    "diametral_clearance": ("clearance", "fit"),
    "clearance": ("diametral_clearance", "fit"),
    "bearing_radius": ("fit",),
}
"""Entries of a joint with clearance, and those that each of them stands in place of."""


class Tolerance(Table):
    """Diameters of a bore or a pin: limits of size, and the distribution within them."""

    range: Bounds = None
    """Smallest and largest diameter, m; default: those of the fit."""
    distribution: Literal["normal", "uniform"] = "normal"
    """Distribution of the diameters."""
    cp: Annotated[float, Quantity("", above=0)] = 1.0
    """Capability of a normal distribution: width of the tolerance divided by six standard deviations."""
    cpk: Annotated[float, Quantity("")] | None = None
    """Capability of a distribution that is not centred: distance of its mean from the nearer limit of size, divided by
    three standard deviations; default: `cp`."""
    towards: Literal["upper", "lower"] | None = None
    """Limit of size towards which the mean is shifted if `cpk` is less than `cp`."""
    inspected: bool = True
    """Whether inspection rejects parts outside the limits of size."""

    @classmethod
    def _of_file(cls, row: Entries) -> Entries:
        own = {"range": _DIAMETER.range(row["range"], "range")} if "range" in row else {}
        return {**row, **own}

    def _check(self) -> None:
        if self.distribution == "uniform" and (self.cp, self.cpk, self.towards) != (1, None, None):
            raise invalid("belongs to a normal distribution", "Remove it", "cp")
        if self.cpk is not None and self.cpk > self.cp:
            raise invalid("is larger than cp", "Write cpk no larger than cp", "cpk")
        if self.cpk is not None and self.cpk < self.cp and self.towards is None:
            reason = "the mean lies off the middle, and nothing says where"
            raise invalid(reason, 'Add towards = "upper" or "lower"', "towards")

    def part(self, limits: tolerances.Limits | None) -> tolerances.PartSize:
        """Its distribution; `limits` are those of the fit."""
        given = self.range or limits
        assert given is not None  # by validation
        if self.distribution == "uniform":
            return tolerances.PartSize(*given, sum(given) / 2, float("inf"))
        cpk = self.cp if self.cpk is None else self.cpk
        return tolerances.part(given, self.cp, cpk, self.towards or "upper", self.inspected)


def law_of(entries: Content) -> tolerances.FitClearance:
    """The distribution of a radial clearance by the entries of a random input; raises an error for validators."""
    parts = []
    fit = None if entries.get("fit") is None else fit_of(entries["fit"])
    for name, part in (("bore", "hole"), ("pin", "shaft")):
        tolerance, limits = Tolerance(**entries.get(name, {})), fit and fit.diameters(part)
        if tolerance.range is None and limits is None:
            reason = "its limits of size are not known"
            remedy = f"give the joint a fit, or write {name} = {{ range = [smallest, largest] }}"
            raise invalid(reason, f'Add fit = "20 H7/f7", {remedy}', name, entries.get(name))
        parts.append(tolerance.part(limits))
    bore, pin = parts
    law = tolerances.FitClearance(bore, pin, *entries.get("range", (-float("inf"), float("inf"))))
    low, high = law.span
    if not 1e-10 < low < high:  # of two diameters, with rounding
        shown = f"from {1e6 * low:.4g} to {1e6 * high:.4g} um"
        reason = f"leaves radial clearances {shown}, and every machine needs one above 0"
        remedy = "Choose a looser fit, or cut it off with range = [smallest, largest]"
        raise invalid(reason, remedy, "fit" if fit else "bore")
    return law


def with_clearance(joint: Entries) -> Content:
    """Entries of a joint in the file with `clearance` and `bearing_radius` in place of a fit or a diametral clearance."""
    for key in ("fit", "diametral_clearance"):
        beside = [other for other in INSTEAD[key] if other in joint]
        if key in joint and beside:
            raise invalid(f"stands beside {beside[0]}", "Keep one of them", key, joint[key])
    made = {key: value for key, value in joint.items() if key not in ("fit", "diametral_clearance")}
    if "fit" in joint:
        with at("fit", joint["fit"]):
            fit = fit_of(joint["fit"])
        made |= {"clearance": fit.clearance, "bearing_radius": fit.bearing_radius}
        (low, high), middle = (1e6 * one for one in fit.clearances), 1e6 * fit.clearance
        clearance = f"a radial clearance of {low:.4g} to {high:.4g} um, here {middle:.4g} um"
        radius = f"a bearing radius of {1e3 * fit.bearing_radius:.8g} mm"
        note(joint["fit"], f"{clearance}, and {radius}")
    if "diametral_clearance" in joint:
        diametral = _DIAMETER.convert(joint["diametral_clearance"], "diametral_clearance")
        made["clearance"] = diametral / 2
    return made
