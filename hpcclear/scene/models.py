"""The physical part of a scene: mechanism, drive, joints, effects, numerics and output, as in the scene file."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from hpcclear.scene.fields import (
    Count,
    Curve,
    CurveOf,
    Inertia,
    Length,
    Mass,
    PositiveLength,
    Quantity,
    Speed,
    Table,
    problem,
)


class Link(Table):
    """A rigid bar between two joints."""

    length: PositiveLength
    """Distance between its joints, m."""
    mass: Mass
    """kg."""
    inertia: Inertia
    """Moment of inertia about its mass centre, kg m2."""
    mass_center: Length
    """Distance of the mass centre from its first joint along the link, m; may lie beyond either pin."""


class Slider(Table):
    """The guided body."""

    mass: Mass
    """kg."""


class Mechanism(Table):
    """Planar slider-crank: crank, connecting rod, slider (Tables 1 and 2 of the paper)."""

    kind: Literal["slider-crank"] = "slider-crank"
    crank: Link
    rod: Link
    slider: Slider

    @model_validator(mode="after")
    def _assembles(self) -> "Mechanism":
        if self.rod.length <= self.crank.length:
            raise problem(
                f"the rod must be longer than the crank ({self.crank.length:g} m), or the crank cannot turn round",
                "Lengthen the rod or shorten the crank",
                key="rod.length",
                value=self.rod.length,
            )
        return self


class ConstantSpeed(Table):
    """The crank angle is prescribed: it turns at a constant speed, whatever moment that takes."""

    kind: Literal["constant-speed"]
    speed: Annotated[float, Quantity("rad/s", above=0)]
    """Crank speed, rad/s, counter-clockwise."""

    elsewhere = dict.fromkeys(
        ("torque", "flywheel_inertia", "initial_speed"),
        (
            "contradicts a prescribed crank speed",
            'Remove it, or set drive.kind = "torque" and give initial_speed instead of speed',
        ),
    )


class TorqueDrive(Table):
    """A torque acts on the free crank; its speed is part of the motion."""

    kind: Literal["torque"]
    torque: Annotated[Curve, CurveOf("N*m")]
    """N m, constant or ``[[crank angle, torque], ...]`` over one turn."""
    flywheel_inertia: Annotated[float, Quantity("kg*m**2", least=0)] = 0.0
    """Inertia that turns with the crank, kg m2."""
    initial_speed: Annotated[
        float, Quantity("rad/s", above=0, why="the crank has to start turning")
    ]
    """Crank speed at the start, rad/s."""

    elsewhere = {
        "speed": (
            "a torque-driven crank has no prescribed speed",
            'Remove it and give initial_speed, or set drive.kind = "constant-speed"',
        )
    }


Drive = Annotated[ConstantSpeed | TorqueDrive, Field(discriminator="kind")]


class Material(Table):
    """Elastic constants of one contact partner."""

    youngs_modulus: Annotated[float, Quantity("Pa", above=0)]
    """Pa."""
    poisson_ratio: Annotated[float, Quantity("", above=-1, most=0.5)]
    """Poisson's ratio."""


class ClearanceJoint(Table):
    """A journal that moves freely in a bearing larger than itself by the clearance."""

    kind: Literal["clearance"]
    clearance: PositiveLength
    """Radial clearance c = R_B - R_J, m."""
    bearing_radius: PositiveLength
    """R_B, m; it stays as it is when the clearance varies."""
    bearing: Material
    journal: Material
    start_eccentricity: tuple[Length, Length] = (0.0, 0.0)
    """Journal centre minus bearing centre (x, y) at the start, m; centred unless said otherwise."""

    @property
    def journal_radius(self) -> float:
        """R_J = R_B - c, m."""
        return self.bearing_radius - self.clearance

    @model_validator(mode="after")
    def _journal_fits(self) -> "ClearanceJoint":
        if self.clearance >= self.bearing_radius:
            raise problem(
                f"the clearance must be smaller than the bearing radius ({self.bearing_radius:g} m), "
                "or no journal is left",
                "Write the radial clearance R_B - R_J",
                key="clearance",
                value=self.clearance,
            )
        return self


class IdealJoint(Table):
    """A pin without play."""

    kind: Literal["ideal"]

    @model_validator(mode="before")
    @classmethod
    def _no_dimensions(cls, data: Any) -> Any:
        # What a clearance joint needs may stay in the file, so that `--set joints.crank_rod.kind=ideal` is enough
        # to switch one off; it is dropped here, so that it cannot make two equal scenes look different.
        if isinstance(data, Mapping):
            return {
                key: value
                for key, value in data.items()
                if key not in ClearanceJoint.model_fields or key == "kind"
            }
        return data


Joint = Annotated[ClearanceJoint | IdealJoint, Field(discriminator="kind")]


class Joints(Table):
    """The two joints that may have play; the crank-frame joint is ideal."""

    crank_rod: Joint
    """O12."""
    rod_slider: Joint
    """O23."""


LATCHED_LAWS = (
    "lankarani-nikravesh",
    "flores",
    "gonthier",
    "hu-guo",
    "herbert-mcwhannell",
    "lee-wang",
)
"""Laws whose damping is scaled by the approach speed, latched at each impact."""
DIVIDING_LAWS = ("flores", "gonthier", "hu-guo")
"""Of these, the ones whose damping factor divides by the restitution."""


class Contact(Table):
    """Normal contact force of every clearance joint."""

    law: Literal[
        "hertz",
        "hunt-crossley",
        "lankarani-nikravesh",
        "flores",
        "gonthier",
        "hu-guo",
        "herbert-mcwhannell",
        "lee-wang",
    ]
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
            raise problem(
                f"the law {self.law!r} needs a restitution",
                "Add restitution = 0.9 or so",
                key="restitution",
                value=None,
            )
        if not latched and self.restitution is not None:
            raise problem(
                f"the law {self.law!r} has no restitution",
                "Remove it, or set effects.contact as a whole table",
                key="restitution",
            )
        if self.law == "hunt-crossley" and self.damping is None:
            raise problem(
                "the law 'hunt-crossley' needs a fixed damping factor",
                "Add damping = 0.5 (s/m) or so",
                key="damping",
                value=None,
            )
        if self.law != "hunt-crossley" and self.damping is not None:
            raise problem(
                f"the law {self.law!r} has no fixed damping factor",
                "Remove it, or set effects.contact as a whole table",
                key="damping",
            )
        if self.law in DIVIDING_LAWS and self.restitution == 0:
            raise problem(
                f"the damping of {self.law!r} divides by the restitution, so 0 has no meaning",
                'Use a value above 0, or the law "lankarani-nikravesh"',
                key="restitution",
            )
        return self

    @property
    def latched(self) -> bool:
        """Whether the law remembers the approach speed of each impact."""
        return self.law in LATCHED_LAWS


class Friction(Table):
    """Tangential force of every clearance joint."""

    law: Literal["none", "coulomb", "ambrosio"] = "none"
    coefficient: Annotated[float, Quantity("", least=0)] | None = None
    """Coefficient of friction."""
    ramp_speed: Speed | None = None
    """Coulomb: sliding speed below which the force falls linearly to 0, m/s (default 0.01)."""
    speeds: tuple[Annotated[float, Quantity("m/s", least=0)], Speed] | None = None
    """Ambrosio: no friction below the first speed, full friction above the second, m/s."""

    @model_validator(mode="before")
    @classmethod
    def _default_ramp(cls, data: Any) -> Any:
        if isinstance(data, Mapping) and data.get("law") == "coulomb" and "ramp_speed" not in data:
            return {**data, "ramp_speed": 0.01}
        return data

    @model_validator(mode="after")
    def _parameters_fit_law(self) -> "Friction":
        if self.law == "none":
            if (
                self.coefficient is not None
                or self.ramp_speed is not None
                or self.speeds is not None
            ):
                raise problem(
                    'the law "none" has no parameters, and a parameter says that friction is meant',
                    'Set law = "coulomb", or remove the parameters',
                    key="law",
                    value="none",
                )
            return self
        if self.coefficient is None:
            raise problem(
                f"the law {self.law!r} needs a coefficient",
                "Add coefficient = 0.01 or so",
                "coefficient",
                None,
            )
        if self.law == "coulomb" and self.speeds is not None:
            raise problem(
                "the law 'coulomb' has one ramp speed",
                "Write ramp_speed = 0.01 (m/s) instead",
                "speeds",
            )
        if self.law == "ambrosio" and self.ramp_speed is not None:
            raise problem(
                "the law 'ambrosio' has two speeds",
                "Write speeds = [0.001, 0.01] (m/s) instead",
                "ramp_speed",
            )
        if self.law == "ambrosio" and self.speeds is None:
            raise problem(
                "the law 'ambrosio' needs two speeds",
                "Add speeds = [0.001, 0.01] (m/s)",
                "speeds",
                None,
            )
        if self.speeds is not None and not self.speeds[0] < self.speeds[1]:
            raise problem(
                "the first speed must be below the second", "Write them in rising order", "speeds"
            )
        return self


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
    """Friction in the clearance joints."""
    gravity: Annotated[float, Quantity("m/s**2", least=0)] = 0.0
    """m/s2, towards -y; 0 is off."""
    slider_load: Annotated[Curve, CurveOf("N")] | None = None
    """N, positive along +x; constant or ``[[crank angle, force], ...]`` over one turn; "none" or left out is off."""
    guide_friction: GuideFriction | None = None
    """Friction of the slider in its guide; left out is off."""

    @model_validator(mode="before")
    @classmethod
    def _none_is_off(cls, data: Any) -> Any:
        if isinstance(data, Mapping):
            return {
                key: value
                for key, value in data.items()
                if not (key in ("slider_load", "guide_friction") and value == "none")
            }
        return data


class Numerics(Table):
    """How the motion is integrated, and over which revolutions."""

    formulation: Literal["minimal", "baumgarte"] = "minimal"
    """Minimal coordinates, or Lagrange multipliers with Baumgarte feedback (eq. 11)."""
    alpha: Annotated[float, Quantity("1/s", least=0)] = 250.0
    """Baumgarte feedback on constraint speed, 1/s; used by that formulation only."""
    beta: Annotated[float, Quantity("1/s", least=0)] = 250.0
    """Baumgarte feedback on constraint position, 1/s; used by that formulation only."""
    method: Literal["auto", "dormand-prince", "fehlberg", "dormand-prince-853", "radau"] = "auto"
    """Integrator."""
    rtol: Annotated[float, Quantity("", least=1e-14, most=0.1)] = 1e-6
    """Relative tolerance of a step."""
    atol: PositiveLength | None = None
    """Absolute tolerance on lengths, m; default rtol times 1 mm. Other states are scaled alike (see the manual)."""
    target_error: Annotated[float, Quantity("", above=0, most=0.5)] | None = None
    """Relative error of the objective to aim at; chooses tolerance and revolutions in place of the entries here."""
    transient_revolutions: Annotated[int, Count(0, 10**9)] = 5
    """Revolutions before the average starts."""
    averaged_revolutions: Annotated[int | Literal["auto"], Count(1, 10**9, word="auto")] = 5
    """Revolutions of the average; "auto" goes on until objective_tolerance is met."""
    objective_tolerance: Annotated[float, Quantity("", above=0, below=1)] = 1e-3
    """For "auto": relative standard error of the objective at which averaging ends."""
    max_averaged_revolutions: Annotated[int, Count(2, 10**9)] = 200
    """For "auto": the cap."""
    max_steps: Annotated[int, Count(1)] = 10_000_000
    """Accepted and rejected steps of one sample together; beyond it the sample ends with status STEP_CAP."""
    uncertainty: Annotated[bool, Field(strict=True)] = False
    """Whether each sample also reports the scatter of its objective under kicks of 1e-10."""
    energy: Annotated[bool, Field(strict=True)] = False
    """Whether each sample also closes its energy balance."""

    @property
    def absolute_tolerance(self) -> float:
        """Absolute tolerance on lengths, m."""
        return self.rtol * 1e-3 if self.atol is None else self.atol


class Output(Table):
    """What `simulate` writes."""

    instants_per_revolution: Annotated[int, Count(0, 10**6)] = 720
    """Instants a revolution, evenly spaced in crank angle; 0 writes every accepted step."""
