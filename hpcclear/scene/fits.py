"""Clearance by a fit or by diameters: what stands in the file of a joint, and the tolerances of a random clearance."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import model_validator

from hpcclear.base import tolerances
from hpcclear.base.errors import at
from hpcclear.base.units import note
from hpcclear.scene.fields import Quantity, Table, invalid
from hpcclear.scene.iso286 import Limits, fit_of

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

    range: tuple[float, float] | None = None
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

    @model_validator(mode="before")
    @classmethod
    def _in_metres(cls, data: object) -> object:
        if not isinstance(data, Mapping) or "range" not in data:
            return data
        ends = data["range"]
        if not isinstance(ends, (list, tuple)) or len(ends) != 2:
            raise invalid("two diameters are expected here", "Write [smallest, largest]", "range")
        low, high = (_DIAMETER.convert(one, "range") for one in ends)
        if not low < high:
            raise invalid("the diameters do not rise", "Write [smallest, largest]", "range")
        return {**data, "range": (low, high)}

    def _check(self) -> None:
        if self.distribution == "uniform" and (self.cp, self.cpk, self.towards) != (1, None, None):
            raise invalid("belongs to a normal distribution", "Remove it", "cp", self.cp)
        if self.cpk is not None and self.cpk > self.cp:
            raise invalid("is larger than cp", "Write cpk no larger than cp", "cpk")
        off = self.cpk is not None and self.cpk < self.cp
        if off and self.towards is None:
            raise invalid(
                "the mean lies off the middle, and nothing says where",
                'Add towards = "upper" or "lower"', "towards", None,
            )  # fmt: skip

    def part(self, limits: Limits | None) -> tolerances.Part:
        """Its distribution; `limits` are those of the fit."""
        given = self.range or limits
        assert given is not None  # by validation
        if self.distribution == "uniform":
            return tolerances.Part(*given, sum(given) / 2, float("inf"))
        cpk = self.cp if self.cpk is None else self.cpk
        return tolerances.part(given, self.cp, cpk, self.towards or "upper", self.inspected)


def law_of(entries: Mapping[str, Any]) -> tolerances.Clearance:
    """The distribution of a radial clearance by the entries of a random input; raises an error for validators."""
    parts = []
    fit = None if entries.get("fit") is None else fit_of(entries["fit"])
    for name, limits in (
        ("bore", fit and fit.diameters("hole")),
        ("pin", fit and fit.diameters("shaft")),
    ):
        tolerance = Tolerance(**entries.get(name, {}))
        if tolerance.range is None and limits is None:
            raise invalid(
                "its limits of size are not known",
                f'Add fit = "20 H7/f7", give the joint a fit, or write {name} = {{ range = [smallest, largest] }}',
                name, entries.get(name),
            )  # fmt: skip
        parts.append(tolerance.part(limits))
    bore, pin = parts
    law = tolerances.Clearance(bore, pin, *entries.get("range", (-float("inf"), float("inf"))))
    low, high = law.span
    if not 1e-10 < low < high:  # of two diameters, with rounding
        shown = f"from {1e6 * low:.4g} to {1e6 * high:.4g} um"
        raise invalid(
            f"leaves radial clearances {shown}, and a joint with clearance needs one above 0 in every machine",
            "Choose a looser fit, or cut it off with range = [smallest, largest]",
            "fit" if fit else "bore",
        )
    return law


def with_clearance(joint: object) -> Any:
    """Entries of a joint in the file with `clearance` and `bearing_radius` in place of a fit or a diametral clearance."""
    if not isinstance(joint, Mapping):
        return joint
    for key in ("fit", "diametral_clearance"):
        beside = [other for other in INSTEAD[key] if other in joint]
        if key in joint and beside:
            raise invalid(f"stands beside {beside[0]}", "Keep one of them", key, joint[key])
    made = {key: value for key, value in joint.items() if key not in ("fit", "diametral_clearance")}
    if "fit" in joint:
        with at("fit", joint["fit"]):
            fit = fit_of(joint["fit"])
        made |= {"clearance": fit.clearance, "bearing_radius": fit.bearing_radius}
        low, high = (1e6 * one for one in fit.clearances)
        note(
            joint["fit"],
            f"a radial clearance of {low:.4g} to {high:.4g} um, here {1e6 * fit.clearance:.4g} um, "
            f"and a bearing radius of {1e3 * fit.bearing_radius:.8g} mm",
        )
    if "diametral_clearance" in joint:
        diametral = _DIAMETER.convert(joint["diametral_clearance"], "diametral_clearance")
        made["clearance"] = diametral / 2
    return made
