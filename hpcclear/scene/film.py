"""Oil in a joint with clearance, as in the scene file."""

from typing import Annotated, Any

from hpcclear.laws import laws
from hpcclear.scene.fields import PositiveLength, Quantity, Table, invalid
from hpcclear.scene.laws import LawName


class Film(Table):
    """Oil film between journal and bearing. It carries the load until the surfaces touch."""

    viscosity: Annotated[float, Quantity("Pa*s", least=0, most=1e4)]
    """Dynamic viscosity at the operating temperature of the bearing, Pa s."""
    length: PositiveLength
    """Length of the bearing along its axis, m."""
    model: Annotated[str, LawName("film")]
    """Solution of Reynolds' equation: for bearings much shorter than their diameter ("short", Ocvirk), much longer
    ("long", Sommerfeld), or for the actual length ("finite", solved once per bearing)."""
    roughness: PositiveLength = 1e-6
    """Combined roughness of both surfaces, m: the film thickness at which they touch."""

    @property
    def law(self) -> Any:
        """The model, as `hpcclear.laws.declared.FilmLaw`."""
        return laws("film")[self.model]


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
