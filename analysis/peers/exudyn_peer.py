"""Exudyn: a multibody code with this very contact, explicit and adaptive (Dormand and Prince).

Its first impact model with restitution 1 - (1 - c_e^2)/2 is the law of Lankarani and Nikravesh with c_e. The crank
turns freely with so much inertia that no force changes its speed. The approach speed is latched between steps, and how
well an impact is met depends on the tolerance of the discontinuous iteration: the default of 1 is the most
accurate that still runs, 1000 is faster. Beyond that errors do not fall with the tolerance any more.
"""

from collections.abc import Callable

import exudyn as exu
import exudyn.itemInterface as items
from plain_loop import (
    CRANK,
    FAR,
    FIRST,
    NEAR,
    ROD_INERTIA,
    ROD_MASS,
    SECOND,
    SLIDER_MASS,
    STIFFNESS,
)
from scenes import Setup

from hpcclear.dynamics import layout as at
from peers.system import end_time

_HUGE = 1e12  # kg m^2


def _body(mbs, mass: float, inertia: float, place: list[float], velocity: list[float], fixed):
    """A rigid body in the plane, its coordinates `fixed` held at their start."""
    node = mbs.AddNode(
        items.NodeRigidBody2D(referenceCoordinates=place, initialVelocities=velocity)
    )
    body = mbs.AddObject(items.ObjectRigidBody2D(mass=mass, inertia=inertia, nodeNumber=node))
    ground = mbs.AddMarker(
        items.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(items.NodePointGround()), coordinate=0)
    )
    for coordinate in fixed:
        held = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate))
        mbs.AddObject(items.CoordinateConstraint(markerNumbers=[ground, held]))
    return node, body


def _contact(mbs, p, joint: int, floor: float, journal, bearing) -> None:
    """A journal inside a bearing, each a body and a distance from its reference point along its x axis."""
    markers = [
        mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=body, localPosition=[distance, 0, 0]))
        for body, distance in (journal, bearing)
    ]
    memory = mbs.AddNode(
        items.NodeGenericData(
            initialCoordinates=[p[joint + at.CLEARANCE], 0, 0, 0], numberOfDataCoordinates=4
        )
    )
    # the damping coefficient is 3 (1 - c_e^2)/4, their restitution makes it 3 (1 - e)/2
    restitution = 1.0 - p[joint + at.DAMPING] / 1.5
    mbs.AddObject(
        items.ObjectContactSphereSphere(
            markerNumbers=markers,
            nodeNumber=memory,
            spheresRadii=[p[joint + at.JOURNAL_RADIUS], p[joint + at.BEARING_RADIUS]],
            isHollowSphere1=True,
            dynamicFriction=p[joint + at.FRICTION_NUMBERS],
            frictionProportionalZone=1.0 / p[joint + at.INVERSE_RAMP],
            contactStiffness=p[joint + STIFFNESS],
            contactStiffnessExponent=1.5,
            restitutionCoefficient=restitution,
            minimumImpactVelocity=floor,
            impactModel=1,
        )
    )


def _model(setup: Setup, sample: int):
    p, start = setup.par[sample], setup.start[sample]
    floor = setup.problem.impact_floor
    state, velocity = start.coordinates(4), start.velocities(4)
    system = exu.SystemContainer()
    mbs = system.AddSystem()
    _, crank = _body(mbs, 1.0, _HUGE, [0, 0, 0], [0, 0, p[at.SPEED]], (0, 1))
    rod = _body(mbs, p[ROD_MASS], p[ROD_INERTIA], list(state[:3]), list(velocity[:3]), ())[1]
    node, slider = _body(mbs, p[SLIDER_MASS], 1.0, [state[3], 0, 0], [velocity[3], 0, 0], (1, 2))
    _contact(mbs, p, FIRST, floor, (crank, p[CRANK]), (rod, -p[NEAR]))
    _contact(mbs, p, SECOND, floor, (slider, 0.0), (rod, p[FAR]))
    mbs.Assemble()
    return mbs, node


def _solver(method: str, iteration_tolerance: float) -> Callable[[Setup, int], float]:
    def solve(setup: Setup, sample: int = 0) -> float:
        mbs, slider = _model(setup, sample)
        settings = exu.SimulationSettings()
        settings.solution.file.write = False
        settings.timeIntegration.verboseMode = 0
        settings.timeIntegration.endTime = end_time(setup, sample)
        settings.timeIntegration.numberOfSteps = 100
        settings.timeIntegration.automaticStepSize = True
        settings.timeIntegration.initialStepSize = 1e-6
        settings.timeIntegration.minimumStepSize = 1e-14
        settings.timeIntegration.relativeTolerance = setup.problem.rtol
        settings.timeIntegration.absoluteTolerance = 1e-3 * setup.problem.rtol
        settings.timeIntegration.discontinuous.iterationTolerance = iteration_tolerance
        try:
            mbs.SolveDynamic(settings, solverType=getattr(exu.DynamicSolverType, method))
        except exu.SolverError:
            return float("nan")
        return float(mbs.GetNodeOutput(slider, exu.OutputVariableType.Position)[0])

    return solve


SOLVERS = {
    "Exudyn DOPRI5, 1": _solver("DOPRI5", 1.0),
    "Exudyn DOPRI5, 1000": _solver("DOPRI5", 1000.0),
}
LAWS = ("lankarani-nikravesh",)
