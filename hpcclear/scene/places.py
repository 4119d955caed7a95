"""Places and angles of a planar linkage: `[x, y]` in the file, alone or by names."""

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import model_validator

from hpcclear.scene.fields import Length, NamedRows, Quantity, Table, invalid

Angle = Annotated[float, Quantity("rad")]


class PairTable(Table):
    """Two components along x and y; ``[x, y]`` in the file is the same."""

    @model_validator(mode="before")
    @classmethod
    def _from_pair(cls, data: object) -> object:
        if not isinstance(data, (list, tuple)):
            return data
        if len(data) != 2:
            raise invalid("a pair [x, y] is expected here", "Write [x, y]")
        return {"x": data[0], "y": data[1]}


class Place(PairTable):
    """A place or an offset; ``[x, y]`` is the same."""

    x: Length
    """x coordinate, m."""
    y: Length
    """y coordinate, m."""


class NamedPlace(Place):
    """A point of a body, in its own axes; ``[x, y]`` is the same."""

    name: str


class PlaceRows(NamedRows):
    """``{name = [x, y]}`` as named rows."""

    def rows(self, value: object) -> Any:
        """``{name: [x, y]}`` as ``[{"name": name, "x": x, "y": y}]``; an error for validators where it is none."""
        if not isinstance(value, (Mapping, tuple)):
            raise invalid("named points are expected here", "Write { name = [x, y] }")
        if isinstance(value, Mapping):
            for name, place in value.items():
                if isinstance(place, (list, tuple)) and len(place) != 2:
                    raise invalid("a point is a pair [x, y]", "Write [x, y] in m", key=str(name))
            value = {
                name: {"x": place[0], "y": place[1]} if isinstance(place, (list, tuple)) else place
                for name, place in value.items()
            }
        return super().rows(value)


NamedPlaces = Annotated[tuple[NamedPlace, ...], PlaceRows()]
NOWHERE = Place(x=0.0, y=0.0)
