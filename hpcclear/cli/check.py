"""What the command `check` prints: effects, states, the study, and the measured run time of a sample."""

import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hpcclear.base.errors import InputError
from hpcclear.cli.options import detailed, place_of, show
from hpcclear.cli.terminal import print_remark, show_rows
from hpcclear.ranks.launcher import is_launched
from hpcclear.ranks.progress import duration
from hpcclear.scene import Scene
from hpcclear.scene.plugged import files_run
from hpcclear.scene.study_tables import DRAWN
from hpcclear.scene.variables import StudyVariable

if TYPE_CHECKING:
    from hpcclear.ensemble.corners import CornerOutcomes
    from hpcclear.ranks.team import Ranks


MOST_WARNINGS = 3
"""Warnings that are printed without ``--details``."""


def describe_scene(scene: Scene, cost: bool, ranks: "Ranks | None" = None) -> bool:
    """Print the model, its warnings, the study and the measured cost of a sample; return whether the design can turn."""
    from hpcclear.dynamics.planar.problem import cautions_of
    from hpcclear.dynamics.setup.problem import coordinate_count, integrator_of, problem_of

    problem_of(scene)  # refuses what cannot be simulated
    locked = _locked(scene)
    if scene.wear is not None:
        from hpcclear.ensemble.wear import check_worn  # loads the kernel

        check_worn(scene)
    states = 2 * (coordinate_count(scene) - scene.bristles)
    bristles = f" + {scene.bristles} bristle deflections" if scene.bristles else ""
    open_joints = len(scene.contact_labels())
    numbers = scene.numerics
    method = f"{integrator_of(scene)}, rtol {numbers.rtol:g}"
    turns = f"{numbers.transient_revolutions} transient + {numbers.averaged_revolutions} averaged revolutions"
    if (error := numbers.target_error) is not None:
        method = f"{integrator_of(scene)}, f to {100 * error:g} %"
        turns = "rtol and revolutions as needed"
    effects = scene.effects_on()
    if detailed():
        from hpcclear.dynamics import sizing

        moving = f"{states} (positions and velocities){bristles}"
        rows = [
            *((f"effect {k}", text) for k, text in enumerate(effects, 1)),
            ("states", f"{moving} + {open_joints} integrals of the gaps"),
            ("method", method),
            ("revolutions", turns),
            ("time series", sizing.words(scene)),
            *_speeds(scene),
            *_assembly(scene),
            *_tables(scene),
            ("scene hash", scene.hash[:16]),
            ("MPI", _mpi(ranks)),
        ]
    else:
        _assembly(scene)  # refuses what does not close
        rows = [
            ("effects", _few(effects)),
            ("method", f"{method}; {turns}"),
            *_speeds(scene)[:2],
            *([("MPI", _mpi(ranks))] if cost or is_launched() else []),
        ]
    show_rows("Model", rows)
    for text in (*files_run(scene.plugins), *map(str, scene.readings)):
        print_remark("Note", text)
    warned = [*locked, *cautions_of(scene), *scene.warnings]
    most = len(warned) if detailed() else MOST_WARNINGS
    for warning in warned[:most]:
        print_remark("Warning", warning)
    if len(warned) > most:
        print_remark("Warning", f"{len(warned) - most} more (--details)")
    if scene.study is not None:
        show_rows("Study", _study_rows(scene))
    if cost and not locked:
        show_rows("Run time of a sample on this machine", _cost_rows(scene))
    return not locked


def _few(texts: Sequence[str], most: int = 6) -> str:
    """The first texts, and how many more there are."""
    more = f"; and {len(texts) - most} more (--details)" if len(texts) > most else ""
    return "; ".join(texts[:most]) + more


def draw(scene: Scene, sketch: Path) -> None:
    """Draw the mechanism to a file and print where it is."""
    from hpcclear.dynamics.planar.problem import poses_at_start
    from hpcclear.report import save, sketch_figure

    poses = poses_at_start(scene, 0.0 if scene.template is None else scene.template.DRAWN_AT)
    show(f"sketch   {save(sketch_figure(scene, poses), place_of(sketch))}")


def _speeds(scene: Scene) -> list[tuple[str, str]]:
    """Every angular speed and frequency of the mechanism, a row each; what was not written in rpm, in rpm too."""
    words, rows = {"rad/s": "speed", "Hz": "frequency"}, []
    for path in scene.numeric_paths():
        if (unit := scene.unit(path)) in words:
            shown, turns = scene.shown(path), f" ({30.0 * scene.number(path) / np.pi:.6g} rpm)"
            more = turns if unit == "rad/s" and not shown.endswith("rpm") else ""
            rows.append((words[unit], f"{path}: {shown}{more}"))
    return rows


def _tables(scene: Scene) -> list[tuple[str, str]]:
    """Every curve that is looked up, a row each: how many rows it has, and at how many of them steps end."""
    from hpcclear.dynamics.planar.problem import linkage_of
    from hpcclear.dynamics.setup.problem import problem_of

    problem, names = problem_of(scene), linkage_of(scene).curve_rows
    return [
        ("table", f"{name}: {len(curve.starts)} pieces; integration steps end at {len(stops)} rows")
        for name, curve, stops in zip(names, problem.curves, problem.stops, strict=True)
    ]


def _assembly(scene: Scene) -> list[tuple[str, str]]:
    """How a linkage was put together, a row a body; refuses one that does not close."""
    from hpcclear.dynamics.planar.problem import put_together
    from hpcclear.dynamics.planar.tables import mechanism_of

    lines = put_together(mechanism_of(scene.linkage)).report()
    return [(f"start of {line.partition(': ')[0]}", line.partition(": ")[2]) for line in lines]


def _locked(scene: Scene) -> list[str]:
    """That the scene's own linkage cannot turn, where its study varies what that depends on; refuses it otherwise."""
    from hpcclear.dynamics.planar.problem import refused_of, varies_geometry

    refusal = refused_of(scene)
    if refusal is None:
        return []
    if not varies_geometry(scene):
        raise refusal[1]
    return [f"the scene's own design {refusal[1].reason}; its run time is not measured"]


def _mpi(ranks: "Ranks | None") -> str:
    """The MPI library; the ranks that met in it, where a launcher started them; cores of this node."""
    from hpcclear.ranks.boundary import alone, describe_mpi

    try:
        library = describe_mpi()
    except InputError:
        return "none found: one process"
    mail = (ranks or alone()).mail
    text = library + (f"; {mail.size} ranks connected" if mail.size > 1 else "")
    text += f"; {mail.node_cores} cores on this node"
    if mail.node_size <= mail.node_cores:
        return text
    crowded = f"{mail.node_size} ranks on {mail.node_cores} cores"
    return f"{text}; {crowded}: more ranks than cores are slower"


def _study_rows(scene: Scene) -> Iterator[tuple[str, str]]:
    study = scene.required_study
    yield "samples", f"{study.samples} ({DRAWN[study.method]}), seed {study.seed}"
    yield "objective", f"{study.objective}: {scene.objective.words}"
    unit = scene.objective.unit
    for case in study.cases:
        parts = [f"random {', '.join(case.random)}"]
        parts.append(f"lowest {', '.join(one.words(unit, scene.in_unit) for one in case.goals)}")
        for one in case.kept:
            most = scene.in_unit(one.most, one.unit(unit))
            parts.append(f"{one.words(unit, scene.in_unit)} at most {most}")
        yield f"case {case.name}", "; ".join(parts)
    if not detailed():
        short = {"variables": study.variables, "random": (*study.random, *study.worn)}
        for label, named in short.items():
            if named:
                yield label, _few([one.name for one in named], 20).replace(";", ",")
        return
    yield from ((one.name, text) for one in study.variables if (text := _ranged(scene, one)))
    for row in study.random:
        if row.parameters is not None:
            least, most = (scene.in_unit(end, scene.unit(row.paths[0])) for end in row.span)
            about = "" if row.absolute else " about the design"
            yield f"{row.name} random", f"{row.shape_words}, {least} to {most}{about}"
    if any(case.kept for case in study.cases):
        from hpcclear.study import verdicts

        yield from (("constraint", text) for text in verdicts.costs(study, unit))
    for row in study.worn:
        from hpcclear.study import lives

        text = f"clearance after {row.cycles:g} revolutions of {scene.required_wear.lives} service lives, "
        text += f"simulated first (about {lives.simulations(scene)} simulations)"
        yield f"{row.name} random", text


def _ranged(scene: Scene, one: StudyVariable) -> str:
    """Where a variable is varied, and what it is; of load cases how they make one f; "" of one that follows others."""
    if one.rows or one.values is not None:
        names = [row.name for row in one.rows]
        listed = names or [scene.in_unit(value, one.unit) for value in one.values or ()]
        weights = one.over if one.over not in (None, "worst") else ()
        shares = ", ".join(f"{float(weight):g}" for weight in weights)
        how = f"weights {shares}" if weights else "f of the worst"
        loads = "" if one.over is None else f" (load cases, {how})"
        return f"{', '.join(listed)}: {one.words}{loads}"
    if one.range is not None:
        lower, upper = (scene.in_unit(end, one.unit) for end in one.range)
        step = "" if one.step is None else f" by {scene.in_unit(one.step, one.unit)}"
        return f"{lower} to {upper}{step}: {one.words}"
    return f"{one.ratio[0]:g} to {one.ratio[1]:g}: {one.ratio_words}" if one.ratio else ""


def _cost_rows(scene: Scene) -> Iterator[tuple[str, str]]:
    """Simulate the scene once in all lanes of an ensemble, after a run that compiles."""
    from hpcclear.dynamics.evaluation import evaluate_records
    from hpcclear.dynamics.evaluation.evaluator import DEFAULT_LANES
    from hpcclear.dynamics.evaluation.steady.wording import in_a_line
    from hpcclear.scene.points import Points

    path = next(path for path in scene.numeric_paths() if path.endswith(".mass"))
    columns = Points(("mass",), np.full((DEFAULT_LANES, 1), scene.number(path)), ((path,),))
    start = time.perf_counter()
    record = evaluate_records(scene, columns)[0]
    first = time.perf_counter() - start
    start = time.perf_counter()
    evaluate_records(scene, columns)
    each = (time.perf_counter() - start) / DEFAULT_LANES
    if record["regime"]:
        yield "f, steady mean", in_a_line(record)
    yield "run time", f"{each * 1e3:.3g} ms per sample on one core ({DEFAULT_LANES} per batch)"
    yield "evaluations", f"{int(record['rhs_evaluations'])} of the forces"
    yield "compilation", f"{max(first - each * DEFAULT_LANES, 0.0):.1f} s (stored for later runs)"
    if scene.study is None:
        return
    whole = 0
    if scene.study.cases:
        from hpcclear.base.objectives import asked
        from hpcclear.study.forecast import OFTEN, expected

        def evaluated(points: Points) -> np.ndarray:
            return asked(evaluate_records(scene, points), scene.objective)

        whole, each = expected(scene, evaluated, each)
    yield "hpcclear sample", _all(scene.study.samples, each)
    if whole:
        yield "hpcclear run", f"about {_all(whole, each)}; {OFTEN}"


def _all(count: int, each: float) -> str:
    """Number of samples and their time on one core; `each`: s."""
    seconds = count * each
    shown = "less than 1 s" if seconds < 1.0 else duration(seconds)
    return f"{count} samples, {shown} of one core"


def describe_corners(scene: Scene, simulate: bool) -> None:
    """Print which corners of the ranges make no mechanism, and which fail in two revolutions, where, and what to do."""
    from hpcclear.ensemble.corners import tried  # loads the kernel

    show_rows("Corners of the study's ranges", lines(tried(scene, simulate), simulate))


def lines(found: "CornerOutcomes", simulate: bool) -> Iterator[tuple[str, str]]:
    """Yield label and text of each line on the corners of a study's ranges."""
    from hpcclear.ensemble.corners import MOST

    points, total = found.points, len(found.points)
    bad = len(found.refused) + int((found.status > 0).sum())
    does = "can be assembled and complete two revolutions" if simulate else "can be assembled"
    every = total < MOST or total == 2 ** len(points.names)
    which = "all corners" if every else "a balanced selection"
    yield "corners", f"{total} ({which}): {total - bad} {does}"
    if not bad:
        return
    from hpcclear.report import failures  # loads what reads results

    units = ((name, unit or "1") for name, unit in points.units.items())
    columns = [failures.SampledVariable(name, unit, points.column(name)) for name, unit in units]
    for reason in dict.fromkeys(found.refused.values()):
        hit = np.array([found.refused.get(row) == reason for row in range(total)])
        place = failures.where(hit, columns)
        yield "refused", f"{int(hit.sum())} of {total} corners: {place and f'{place}: '}{reason}"
    for text in failures.sentences(found.status, columns, "corners") if simulate else ():
        yield "failed", text
