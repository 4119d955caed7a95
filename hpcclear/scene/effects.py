"""What acts on the mechanism: contact, friction, gravity and loads, as in the scene file."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal, get_args

from pydantic import model_validator

from hpcclear.scene.fields import Curve, CurveOf, Quantity, Speed, Table, invalid

LatchedLaw = Literal[
    "lankarani-nikravesh",
    "flores",
    "gonthier",
    "hu-guo",
    "herbert-mcwhannell",
    "lee-wang",
]
LATCHED_LAWS: tuple[str, ...] = get_args(LatchedLaw)
"""Laws whose damping is scaled by the approach speed, latched at each impact."""
DIVIDING_LAWS = ("flores", "gonthier", "hu-guo")
"""Of these, the ones whose damping factor divides by the restitution."""


class Contact(Table):
    """Normal contact force of every clearance joint."""

    law: Literal["hertz", "hunt-crossley", LatchedLaw]
    """All have Hertz's stiffness; they differ in how an impact loses energy."""
    restitution: Annotated[float, Quantity("", least=0, most=1)] | None = None
    """Coefficient of restitution of the laws that latch the impact speed."""
    damping: Annotated[float, Quantity("s/m", least=0)] | None = None
    """Fixed damping factor chi of Hunt and Crossley, s/m."""
    minimum_impact_speed: Speed = 1e-3
    """Floor of the latched impact speed, m/s."""

    @model_validator(mode="after")
    def _parameters_fit_law(self) -> "Contact":
        latched = self.law in LATCHED_LAWS
        if latched and self.restitution is None:
            raise invalid(
                f"the law {self.law!r} needs a restitution",
                "Add restitution = 0.9 or so",
                key="restitution",
                value=None,
            )
        if not latched and self.restitution is not None:
            raise invalid(
                f"the law {self.law!r} has no restitution",
                "Remove it, or set effects.contact as a whole table",
                key="restitution",
            )
        if self.law == "hunt-crossley" and self.damping is None:
            raise invalid(
                "the law 'hunt-crossley' needs a fixed damping factor",
                "Add damping = 0.5 (s/m) or so",
                key="damping",
                value=None,
            )
        if self.law != "hunt-crossley" and self.damping is not None:
            raise invalid(
                f"the law {self.law!r} has no fixed damping factor",
                "Remove it, or set effects.contact as a whole table",
                key="damping",
            )
        if self.law in DIVIDING_LAWS and self.restitution == 0:
            raise invalid(
                f"the damping of {self.law!r} divides by the restitution, so 0 has no meaning",
                'Use a value above 0, or the law "lankarani-nikravesh"',
                key="restitution",
            )
        return self

    @property
    def latched(self) -> bool:
        """Whether the law remembers the approach speed of each impact."""
        return self.law in LATCHED_LAWS


LUGRE_ENTRIES = (
    "static_coefficient",
    "stribeck_speed",
    "bristle_stiffness",
    "bristle_damping",
    "viscous_coefficient",
)
"""Entries of friction by bristles alone."""


class Friction(Table):
    """Tangential force of every clearance joint."""

    law: Literal["none", "coulomb", "ambrosio", "lugre"] = "none"
    """Coulomb's with a ramp about rest, Ambrosio's with two speeds, or LuGre's bristles, which stick."""
    coefficient: Annotated[float, Quantity("", least=0)] | None = None
    """Coefficient of friction; LuGre: of fast sliding."""
    ramp_speed: Speed | None = None
    """Coulomb: sliding speed below which the force falls linearly to 0, m/s (default 0.01)."""
    speeds: tuple[Annotated[float, Quantity("m/s", least=0)], Speed] | None = None
    """Ambrosio: no friction below the first speed, full friction above the second, m/s."""
    static_coefficient: Annotated[float, Quantity("", least=0)] | None = None
    """LuGre: coefficient of friction from which surfaces at rest begin to slide, at least the coefficient."""
    stribeck_speed: Speed | None = None
    """LuGre: sliding speed at which friction has fallen from the static coefficient by 63 %, m/s."""
    bristle_stiffness: Annotated[float, Quantity("1/m", above=0)] | None = None
    """LuGre: friction over normal force for a metre of deflection, sigma_0 over the normal force, 1/m."""
    bristle_damping: Annotated[float, Quantity("s/m", least=0)] | None = None
    """LuGre: the same for a speed of deflection, sigma_1, s/m (default 0)."""
    viscous_coefficient: Annotated[float, Quantity("s/m", least=0)] | None = None
    """LuGre: the same for a sliding speed, sigma_2, s/m (default 0)."""

    @model_validator(mode="before")
    @classmethod
    def _defaults_of_law(cls, data: Any) -> Any:
        if not isinstance(data, Mapping):
            return data
        defaults = {
            "coulomb": {"ramp_speed": 0.01},
            "lugre": {"bristle_damping": 0.0, "viscous_coefficient": 0.0},
        }
        return {**defaults.get(str(data.get("law")), {}), **data}

    @model_validator(mode="after")
    def _parameters_fit_law(self) -> "Friction":
        if self.law == "none":
            if any(
                getattr(self, name) is not None for name in type(self).model_fields if name != "law"
            ):
                raise invalid(
                    'the law "none" has no parameters, and a parameter says that friction is meant',
                    'Write friction = "none" (--set effects.friction=none) to switch it off, '
                    'or set law = "coulomb"',
                    key="law",
                    value="none",
                )
            return self
        if self.coefficient is None:
            raise invalid(
                f"the law {self.law!r} needs a coefficient",
                "Add coefficient = 0.01 or so",
                "coefficient",
                None,
            )
        if self.law == "lugre":
            self._bristles_are_whole(self.coefficient)
            return self
        for name in LUGRE_ENTRIES:
            if getattr(self, name) is not None:
                raise invalid(
                    f"the law {self.law!r} has no bristles", 'Remove it, or set law = "lugre"', name
                )
        if self.law == "coulomb" and self.speeds is not None:
            raise invalid(
                "the law 'coulomb' has one ramp speed",
                "Write ramp_speed = 0.01 (m/s) instead",
                "speeds",
            )
        if self.law == "ambrosio" and self.ramp_speed is not None:
            raise invalid(
                "the law 'ambrosio' has two speeds",
                "Write speeds = [0.001, 0.01] (m/s) instead",
                "ramp_speed",
            )
        if self.law == "ambrosio" and self.speeds is None:
            raise invalid(
                "the law 'ambrosio' needs two speeds",
                "Add speeds = [0.001, 0.01] (m/s)",
                "speeds",
                None,
            )
        if self.speeds is not None and not self.speeds[0] < self.speeds[1]:
            raise invalid(
                "the first speed must be below the second", "Write them in rising order", "speeds"
            )
        return self

    def _bristles_are_whole(self, coefficient: float) -> None:
        """An error for validators unless LuGre's law has its numbers and no other's."""
        for name in ("ramp_speed", "speeds"):
            if getattr(self, name) is not None:
                raise invalid(
                    "the law 'lugre' has no ramp: bristles hold at any speed",
                    "Write stribeck_speed = 0.01 (m/s) and bristle_stiffness = 1e5 (1/m) instead",
                    name,
                )
        for name, example in (
            ("static_coefficient", f"{1.5 * coefficient:.3g}"),
            ("stribeck_speed", "0.01 (m/s)"),
            ("bristle_stiffness", "1e5 (1/m)"),
        ):
            if getattr(self, name) is None:
                raise invalid(
                    f"the law 'lugre' needs a {name}", f"Add {name} = {example} or so", name, None
                )
        static = self.static_coefficient or 0.0
        if coefficient == 0.0 < static:
            raise invalid(
                "friction at rest alone is no law: bristles would give way at once",
                "Write a coefficient above 0, or static_coefficient = 0 for no friction",
                "coefficient",
            )
        if static < coefficient:
            raise invalid(
                f"must be at least the coefficient of sliding ({coefficient:g}): friction falls with speed",
                "Write the larger of both coefficients here",
                "static_coefficient",
            )


class GuideFriction(Table):
    """Coulomb friction between slider and guide."""

    coefficient: Annotated[float, Quantity("", least=0)]
    """Coefficient of friction."""
    ramp_speed: Speed = 0.01
    """Sliding speed below which the force falls linearly to 0, m/s."""


class Effects(Table):
    """What acts on the mechanism; what is off is not computed."""

    contact: Contact | None = None
    """Normal contact force; needed as soon as a joint has clearance."""
    friction: Friction = Friction()
    """Friction in the clearance joints; "none" or left out is off."""
    gravity: Annotated[float, Quantity("m/s**2", least=0)] = 0.0
    """m/s2, towards -y; 0 is off."""
    slider_load: Annotated[Curve, CurveOf("N")] | None = None
    """N, positive along +x; constant or ``[[crank angle, force], ...]`` over one turn; "none" or
    left out is off."""
    guide_friction: GuideFriction | None = None
    """Friction of the slider in its guide; "none" or left out is off."""

    @model_validator(mode="before")
    @classmethod
    def _none_is_off(cls, data: Any) -> Any:
        if not isinstance(data, Mapping):
            return data
        for key in ("friction", "guide_friction"):
            if isinstance(data.get(key), str) and data[key] != "none":
                raise invalid(
                    'a table is expected here, or "none"',
                    'Write "none" to switch it off, or a table such as { coefficient = 0.01 }'
                    + (' with law = "coulomb"' if key == "friction" else ""),
                    key=key,
                    value=data[key],
                )
        words = ("friction", "slider_load", "guide_friction")
        return {key: value for key, value in data.items() if not (key in words and value == "none")}
