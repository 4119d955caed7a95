"""Oil in a joint with clearance, as in the scene file."""

from typing import Annotated, Literal

from hpcclear.scene.fields import PositiveLength, Quantity, Table, invalid


class Film(Table):
    """Oil between journal and bearing: a film that carries until the surfaces touch."""

    viscosity: Annotated[float, Quantity("Pa*s", least=0, most=1e4)]
    """Dynamic viscosity at the temperature that the bearing runs at, Pa s."""
    length: PositiveLength
    """Of the bearing, at right angles to the plane, m."""
    model: Literal["short", "long"]
    """How Reynolds' equation is solved: for bearings that are short beside their diameter (Ocvirk), or long (Sommerfeld)."""
    roughness: PositiveLength = 1e-6
    """Of both surfaces together, m: how thin the film is where they touch."""


def check_film(film: Film | None, clearance: float) -> None:
    """An error for validators unless a film is left between rough surfaces in the middle of a clearance, m."""
    if film is not None and 4.0 * film.roughness > clearance:
        raise invalid(
            f"must be at most a quarter of the clearance ({clearance:g} m), or no film is left",
            "Write the roughness of both surfaces together",
            key="film.roughness",
            value=film.roughness,
        )
