"""What acts on the mechanism: contact, friction, gravity and loads, as in the scene file."""

from typing import Annotated, ClassVar

from pydantic import field_validator

from hpcclear.base.pieces import Rows
from hpcclear.laws.declared import ContactLaw, FrictionLaw, Geometry
from hpcclear.scene.curves import Curve, Pairs, by_angle
from hpcclear.scene.fields import Entries, Quantity, Speed, Table, invalid
from hpcclear.scene.joints import JointFriction
from hpcclear.scene.laws import SPHERE, LawTable, quantity_of


class ContactTable(LawTable):
    """Normal contact force of every clearance joint."""

    kind: ClassVar[str] = "contact"
    formula: ClassVar[str] = "force"
    law: str
    """Name of a law (`hpcclear show laws` lists them), "module:name" of a file beside the scene, or "expression"."""
    geometry: str | None = None
    """Geometry of the contact: "sphere" (default), "line" (a pin along the length of its bearing), "liner", "power" or
    "table"."""
    curve: Annotated[Rows, Pairs("m", "N", ("depth", "force"))] | None = None
    """For the geometry "table": ``[[depth, force], ...]``, m and N, both increasing from 0."""
    minimum_impact_speed: Speed = 1e-3
    """Lower bound of the impact velocity in the damping, m/s."""
    force: str | None = None
    """For the law "expression": force in N as a function of depth d, its rate v, Hertz stiffness K, impact velocity v0
    and parameters."""
    units: dict[str, str] | None = None
    """For the law "expression": units of its parameters. The parameters are further entries of this table."""

    @field_validator("geometry")
    @classmethod
    def _sphere_is_the_default(cls, name: str | None) -> str | None:
        return None if name == SPHERE else name

    @property
    def declared(self) -> ContactLaw:
        """The law."""
        assert isinstance(self._law, ContactLaw)
        return self._law

    def _check(self) -> None:
        if self.curve is not None and self.geometry is None:
            raise invalid('belongs to geometry = "table"', "Write geometry, or remove it", "curve")

    @property
    def latched(self) -> bool:
        """Whether the law remembers the approach speed of each impact."""
        return self.declared.latched


class FrictionTable(LawTable):
    """Tangential force of every clearance joint."""

    kind: ClassVar[str] = "friction"
    formula: ClassVar[str] = "ratio"
    law: str = "none"
    """Name of a law (`hpcclear show laws` lists them), "module:name" of a file beside the scene, or "expression"."""
    ratio: str | None = None
    """For the law "expression": friction / normal force as a function of the sliding speed v and parameters."""
    units: dict[str, str] | None = None
    """For the law "expression": units of its parameters. The parameters are further entries of this table."""

    @property
    def declared(self) -> FrictionLaw:
        """The law."""
        assert isinstance(self._law, FrictionLaw)
        return self._law


class EffectTables(Table):
    """Effects that act on the mechanism. Disabled effects are not computed."""

    contact: ContactTable | None = None
    """Law of the normal contact force. Required if any joint has clearance."""
    friction: FrictionTable = FrictionTable()
    """Friction in the joints with clearance; default "none"."""
    gravity: Annotated[float, Quantity("m/s**2", least=0)] = 0.0
    """Acceleration of gravity towards -y, m/s2; 0: disabled."""
    slider_load: Annotated[Curve, by_angle("N")] | None = None
    """Force on the slider, positive along +x, N; constant or ``[[crank angle, force], ...]`` over the turns of a
    revolution; default "none"."""
    guide_friction: JointFriction | None = None
    """Friction of the slider in its guide; default "none"."""

    @property
    def geometry(self) -> Geometry | None:
        """The shapes that touch; None where a law has its own, or there is no contact."""
        return None if self.contact is None else self.contact.declared.geometry

    @property
    def has_pressure(self) -> bool:
        """Whether the geometry of contacts has a pressure."""
        return self.geometry is not None and self.geometry.pressure is not None

    def law_unit(self, path: str) -> str | None:
        """Return the unit of a parameter of the scene's own laws by its path; None for any other entry."""
        for table in (self.contact, self.friction):
            if table is not None and path.startswith(f"effects.{table.kind}."):
                parameter = table.declared.parameter(path.rpartition(".")[2])
                return None if parameter is None else quantity_of(parameter).unit
        return None

    @classmethod
    def _of_file(cls, row: Entries) -> Entries:
        for key in ("friction", "guide_friction"):
            if isinstance(row.get(key), str) and row[key] != "none":
                also = ' with law = "coulomb"' if key == "friction" else ""
                remedy = f'Write "none", or a table such as {{ coefficient = 0.01 }}{also}'
                raise invalid('a table is expected here, or "none"', remedy, key, row[key])
        words = ("contact", "friction", "slider_load", "guide_friction")
        return {key: value for key, value in row.items() if not (key in words and value == "none")}
