"""Materials of both partners of a contact."""

from typing import Annotated

from hpcclear.scene.fields import Quantity, Table


class Material(Table):
    """Elastic constants of one contact partner."""

    youngs_modulus: Annotated[float, Quantity("Pa", above=0)]
    """Young's modulus, Pa."""
    poisson_ratio: Annotated[float, Quantity("", above=-1, most=0.5)]
    """Poisson's ratio."""


class Materials(Table):
    """Materials of both partners of a contact."""

    bearing: Material
    journal: Material
