"""Oil in a joint with clearance, as in the scene file."""

from typing import Annotated, Any

from hpcclear.scene.fields import PositiveLength, Quantity, Table, invalid
from hpcclear.scene.laws import LawName, our_laws


class Film(Table):
    """Oil between journal and bearing: a film that carries until the surfaces touch."""

    viscosity: Annotated[float, Quantity("Pa*s", least=0, most=1e4)]
    """Dynamic viscosity at the temperature that the bearing runs at, Pa s."""
    length: PositiveLength
    """Of the bearing, at right angles to the plane, m."""
    model: Annotated[str, LawName("film")]
    """How Reynolds' equation is solved: for bearings that are short beside their diameter (Ocvirk), long (Sommerfeld), or of
    their own length, once a bearing."""
    roughness: PositiveLength = 1e-6
    """Of both surfaces together, m: how thin the film is where they touch."""

    @property
    def law(self) -> Any:
        """The model, as `hpcclear.dynamics.laws.declared.FilmLaw`."""
        return our_laws("film")[self.model]


def check_film(film: Film | None, clearance: float, radius: float) -> None:
    """An error for validators unless a film is left between rough surfaces in the middle of a clearance, m, and its model fits.

    `radius`: of the bearing, m.
    """
    if film is None:
        return
    ratio, (least, most) = 0.5 * film.length / radius, film.law.lengths
    if film.law.further is not None and not least <= ratio <= most:
        raise invalid(
            f"is for lengths from {least:g} to {most:g} diameters, and this bearing is {ratio:.3g} long",
            'Take "short"' if ratio < 1.0 else 'Take "long"',
            key="film.model",
            value=film.model,
        )
    if 4.0 * film.roughness > clearance:
        raise invalid(
            f"must be at most a quarter of the clearance ({clearance:g} m), or no film is left",
            "Write the roughness of both surfaces together",
            key="film.roughness",
            value=film.roughness,
        )
