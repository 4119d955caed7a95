"""What is common to the samples of a scene: its effects, coordinates, method, tolerances, tables, as a `Problem`."""

from functools import lru_cache

from hpcclear.base.errors import InputError
from hpcclear.base.pieces import Pieces
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.contacts.laws import in_lanes, rate_in_lanes
from hpcclear.dynamics.layout.views import Parameters
from hpcclear.dynamics.linkage.linkage import Linkage
from hpcclear.dynamics.planar import problem as planar
from hpcclear.dynamics.planar.tables import curves_of
from hpcclear.dynamics.planar.tolerances import STIFF, swings
from hpcclear.dynamics.setup.parameters import parameter_rows, parameters
from hpcclear.dynamics.stepping.explicit.tableau import TABLEAUS, TSITOURAS, Tableau
from hpcclear.dynamics.stepping.implicit.control import STEEP
from hpcclear.dynamics.stepping.problem import Problem
from hpcclear.scene import Scene
from hpcclear.scene.driving import PlanarRunUp, PlanarTable

IMPLICIT_METHODS = {"switching": "stiff", "radau": "always"}
"""Methods that take implicit steps whatever the scene, and when."""

STIFF_DAMPING = 10.0  # fixed damping factor in s/m, or coefficient of a law with restitution, from which "auto" is implicit


def coordinate_count(scene: Scene) -> int:
    """Coordinates that are integrated; 0 where the drives prescribe everything."""
    if planar.is_prescribed(scene):
        return 0
    return scene.bristles + len(planar.linkage_of(scene).forest.coordinates)


def effects_of(scene: Scene, *, recorded: bool = False) -> at.Effects:
    """Which branches of the kernel are compiled for this scene, or for a record of all that its motion has."""
    e = scene.effects
    count = len(scene.contact_labels())
    main = planar.linkage_of(scene).mechanism.period
    judge = scene.objective
    waves = scene.waves()
    films = {scene.joint_labels.index(name): film.model for name, film in scene.films().items()}
    return at.Effects(
        joints=count,
        first=next(iter(scene.open_places), 0),
        contact=in_lanes(e.contact.declared) if e.contact is not None and count else None,
        friction=in_lanes(e.friction.declared) if e.friction.law != "none" and count else None,
        torque=_flag(not main.prescribed and bool(main.advance)),
        objective=rate_in_lanes(judge) if judge.whole or (judge.rate and count) else None,
        energies=_flag(recorded or scene.numerics.energy),
        series=_flag(recorded),
        responses=_flag(recorded or scene.responses_asked()),
        impacts=_flag(bool(count) and (recorded or scene.impacts_asked())),
        wear=_flag(bool(scene.worn_joints())),
        waves=_flag(any(waves.values())),
        bearing_waves=waves["bearing"] or None,
        journal_waves=waves["journal"] or None,
        threshold=_flag(scene.has_thresholds),
        profile=_flag(bool(scene.wear is not None and scene.wear.waves and scene.worn_joints())),
        films=tuple(films.get(k) for k in range(at.MAX_JOINTS)) if films else None,
    )


def _flag(on: bool) -> int | None:
    return 1 if on else None


def tableau_of(scene: Scene) -> Tableau:
    """The embedded pair of ``numerics.method``: Tsitouras' unless another one is named."""
    return TABLEAUS.get(scene.numerics.method, TSITOURAS)


def implicit_method(scene: Scene) -> str:
    """When the kernel takes implicit steps: "never", "stiff" (where a lane's motion calls for it), "always".

    The automatic choice goes by the scene's numbers, so that a scene that is not stiff pays nothing for the other method.
    A response and an ensemble go by the same choice.
    """
    method = scene.numerics.method
    if method == "auto" and scene.modes:
        mechanism = planar.linkage_of(scene).mechanism
        if max(swings(mechanism)) * mechanism.period.seconds > STIFF:
            return "always"  # there is no segment of the motion in which they are slow
    if method != "auto" or not scene.clearance_joints():
        return IMPLICIT_METHODS.get(method, "never")
    if scene.films() or scene.bristles:
        return "stiff"  # a film's damping grows beyond all bounds as it gets thin; bristles give way within a micrometre
    par = Parameters(parameters(scene)[0])
    there = list(at.places_of(effects_of(scene)))
    ramp = par.steepness * (scene.effects.friction.law != "none")
    stiff = (ramp >= STEEP) | (par.damping >= STIFF_DAMPING)
    return "stiff" if stiff[there].any() else "never"


def _curves_of_rows(scene: Scene, linkage: Linkage) -> tuple[Pieces, ...]:
    """A linkage's curves, in the order of their rows."""
    known = curves_of(scene)
    for drive in linkage.mechanism.drives:
        if isinstance(drive, (PlanarTable, PlanarRunUp)):
            names = (f"{drive.name}.{part}" for part in drive.curves)
            known |= zip(names, drive.pieces, strict=True)
    return tuple(known[name] for name in linkage.curve_rows)


def check_objective(scene: Scene) -> None:
    """InputError where the objective has a rate of the whole mechanism, and no motion is integrated that it could go with."""
    if scene.objective.whole and not coordinate_count(scene):
        reason = "its rate is integrated along with the motion, and this motion is prescribed"
        remedy = 'Give a joint kind = "clearance"'
        raise InputError(scene.objective_key, scene.objective.name, reason, remedy)


@lru_cache(maxsize=16)
def problem_of(scene: Scene) -> Problem:
    """What is common to all samples of a scene."""
    e = scene.effects
    check_objective(scene)
    linkage = planar.linkage_of(scene)
    return Problem(
        linkage=linkage,
        effects=effects_of(scene),
        coordinates=coordinate_count(scene),
        tableau=tableau_of(scene),
        rtol=scene.numerics.rtol,
        atol=scene.numerics.absolute_tolerance,
        impact_floor=1e-3 if e.contact is None else e.contact.minimum_impact_speed,
        transient=scene.numerics.transient_revolutions,
        averaged=scene.numerics.averaged_revolutions,
        max_steps=scene.numerics.max_steps,
        implicit=implicit_method(scene),
        cycle=linkage.mechanism.period.advance,
        parameter_rows=parameter_rows(scene),
        curves=_curves_of_rows(scene, linkage),
        chosen=scene.objective.joints,
        from_rest=getattr(linkage.mechanism.period, "expected_speed", None) is not None,
    )


def integrator_of(scene: Scene) -> str:
    """Name of the method that a scene's responses and samples are integrated by."""
    if coordinate_count(scene) == 0:
        return "closed form"
    name = tableau_of(scene).name
    return {"never": name, "stiff": f"{name} and radau", "always": "radau"}[implicit_method(scene)]
