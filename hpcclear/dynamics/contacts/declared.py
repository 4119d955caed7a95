"""What a geometry of contact declares: the function that motions call, and its numbers."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from hpcclear.base.arrays import Array
from hpcclear.dynamics.layout.views import Parameters

Get = Callable[[str], Array]
"""Values of an entry of the joint's table, (m,), by its name."""


@dataclass(frozen=True)
class Shape:
    """Numbers of a contact's samples, (m,), m.

    `clearance`, `bearing_radius` and `journal_radius` go to the kernel's rows, where the geometry's function reads them;
    `radii` are what laws of contact get by these three names, and `radius` is that of the sphere on a plane that is as stiff.
    """

    clearance: Array
    bearing_radius: Array
    journal_radius: Array
    radii: tuple[Array, Array, Array]
    radius: Array


@dataclass(frozen=True)
class ContactGeometry:
    """One kind of contact between two bodies.

    ``force(effects, work, par, joint, relative, frame, i, W)`` is a lane function. `relative`: a place of the journal's body
    relative to one of the bearing's (ex, ey, vx, vy), and the angular velocities of journal and bearing, None for what never
    turns; `frame`: what the geometry requires besides (`along_a_line`, or cosines and sines of surfaces out of round).
    It writes gap, normal force, rate and what effects require, and returns the force on the bearing at its place (the journal
    gets the opposite at its own), the moments on bearing and journal about these places, and the power that is lost.
    """

    name: str
    words: str
    force: Any
    shape: Callable[[Get], Shape]
    reach: Callable[[Parameters, int], Array]
    """From `views.Parameters` and a place: how far the journal may be from the bearing until they touch, m."""
    along_a_line: bool = False
    """Whether it lies at a guide's line: `frame` is the unit vector across it, `relative` counts from the line."""

    @property
    def function(self) -> str:
        """Name of the function in generated texts."""
        return str(self.force.py_func.__name__)

    @property
    def module(self) -> str:
        """Module that it is imported from there."""
        return str(self.force.py_func.__module__)
