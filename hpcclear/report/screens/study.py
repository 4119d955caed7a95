"""The first screen of a study: the recommended design beside today's, its figures, and what to trust of them."""

import re
from collections.abc import Iterator
from itertools import zip_longest
from pathlib import Path

import numpy as np

from hpcclear.base.errors import InputError
from hpcclear.base.objectives import Usual
from hpcclear.base.outcome import Status
from hpcclear.base.plain import counted
from hpcclear.base.verdict import Verdict
from hpcclear.report import alike, answer, bearings, merit, scatter
from hpcclear.report.answer import FAR, MANY, beyond_hertz
from hpcclear.report.constraints import WORDS, constraints_of, verdict_of
from hpcclear.report.figures import fits, labels
from hpcclear.report.html.content import Content, scene_of
from hpcclear.report.parts import Recommended
from hpcclear.report.screen import (
    TILES,
    Screen,
    ScreenRow,
    ShareBar,
    Span,
    Tile,
    Trust,
    amber,
    change,
    green,
    lower,
    plus_minus,
    red,
    trusted,
    upper,
    within,
)
from hpcclear.results.content import Results, text_in, texts_in
from hpcclear.scene.domain import bound_at, shares

MOST = 0.5
"""Share of simulations outside the range of the contact model above which a recommendation is not relied on."""

_USUAL = {"mean": "mean", "deviation": "standard deviation", "percentile": "95th percentile"}
"""Statistics that each design has, by the stem of their variables."""

Known = tuple[float, float, float]
"""A value and the ends of its confidence interval, NaN where that is not known."""

_INFEASIBLE = {
    Verdict.FAILS: "No simulated design satisfies the constraints",
    Verdict.UNDECIDED: "No simulated design is certain to satisfy the constraints",
}


def screen(verified: Results, content: Content) -> Screen | None:
    """Return the first screen of a verified study; None where nothing was verified."""
    if not merit.any_counts(verified):
        return None
    ours = merit.ours_of(verified)
    best, base = merit.best_of(ours), merit.baseline_of(ours)
    of = Recommended(content.files, ours, best)
    kept = base is not None and text_in(base, "design") == text_in(best, "design")
    today = None if kept else base
    aims = (
        []
        if merit.is_plain(best)
        else [text_in(best, f"{name}_goal") for name in merit.goals_of(best)]
    )
    tiles = sorted(_tiles(best, today, content), key=lambda one: one.label not in aims)
    bars, causes = _bars(of)
    if infeasible := verdict_of(best) in _INFEASIBLE:
        tiles = [one._replace(good=None) for one in tiles]  # no gain without a design
    column = "nearest" if infeasible else "today, kept" if kept else "recommended"
    return Screen(
        _headline(best, tiles[:TILES], aims, kept),
        tuple(_about(of)),
        _doubt(of),
        tuple(tiles),
        ("design", column) if today is None else ("design", "today", column),
        tuple(_rows(best, today)),
        _remark(of),
        trusted(_trust(of), beyond_hertz(best) > MANY),
        tuple(bars),
        causes,
        tuple(answer.steps(of)),
        ("front",) if "front" in content.files else (),
        (answer.confidence(best),),
    )


def _headline(best: Results, tiles: list[Tile], aims: list[str], kept: bool) -> str:
    if (found := verdict_of(best)) in _INFEASIBLE:
        return _INFEASIBLE[found]
    if kept:
        return "Keep today's design: no simulated design is better"
    limits = {one.goal for one in constraints_of(best)}.difference(aims)
    compared = sorted((one for one in tiles if one.change), key=lambda one: one.label in limits)[:2]
    said = [f"{lower(one.change)} {one.label}" for one in compared if lower(one.change)]
    text = f"Recommended design: {', '.join(said) or 'no significant change'}"
    return labels.sentence(text, best)


def _doubt(of: Recommended) -> str:
    """Why the recommendation is not to be relied on."""
    found = []
    if beyond_hertz(of.best) > MOST:
        found.append("the contact model is outside its range")
    if int(of.best["failed"]) > MANY * int(of.best["samples"]):
        found.append(_failed(of.best))
    if verdict_of(of.best) is Verdict.UNDECIDED:
        found.append("constraints are undecided")
    if text_in(of.best, "accuracy_missed"):
        found.append("the requested accuracy was not reached")
    return "; ".join(found)


def _about(of: Recommended) -> Iterator[str]:
    """What was simulated."""
    yield f"f: {labels.objective(of.ours)}"
    study = None if (scene := scene_of(of.best)) is None else scene.study
    if study is not None:
        yield from (f"over the load cases of {v.name}" for v in study.variables if v.over)
        if len(study.cases) > 1:
            yield f"case {text_in(of.best, 'case')} of {', '.join(one.name for one in study.cases)}"
    count = f"{int(of.best['simulations']):,}".replace(",", "\N{NO-BREAK SPACE}")
    yield f"{count} simulations"


def _statistics(best: Results) -> dict[str, str]:
    """Words of the values that are shown, and their stems: what the case makes small, then what every design has."""
    asked = [] if merit.is_plain(best) else merit.goals_of(best)
    usual = {Usual.MEAN: "mean", Usual.DEVIATION: "deviation"}
    shown = {usual.get(merit.usual_of(best, name), name) for name in asked}
    found = {text_in(best, f"{name}_goal"): name for name in asked}
    for stem, words in _USUAL.items():
        if stem not in shown and (stem in best or f"{stem}_true" in best):
            found.setdefault(f"{words} of f", stem)
    return found


def _tiles(best: Results, base: Results | None, content: Content) -> Iterator[Tile]:
    """Constraints and objectives of the case, then mean, standard deviation, percentile, and peak force; each once."""
    limits, known = {one.label: one for one in _limits(best, base)}, _statistics(best)
    yield from (one for label, one in limits.items() if label not in known)
    for words in sorted(known, key=lambda one: one not in limits):
        stem = known[words]
        name = stem if stem in best else f"{stem}_true"
        unit, mine = answer.unit_of(best, name), labels.estimate(best, stem)
        before = None if base is None else labels.estimate(base, stem)
        if np.isfinite(mine[0]):
            apart = limits[words].within if words in limits else within(*mine, unit)
            yield _compared(words, unit, apart, mine, before)
    yield from _peaks(best, base, content)


def _compared(label: str, unit: str, apart: str, mine: Known, before: Known | None = None) -> Tile:
    """A value beside that of the baseline; both with the ends of their intervals."""
    moved, good = ("", None) if before is None else change(mine, before)
    both = [mine] if before is None else [mine, before]
    chosen = labels.scale(unit, [one[0] for one in both])
    shown, *old = (labels.stated(*one, unit, chosen)[0] for one in both)
    return Tile(label, shown, "".join(old).strip("–"), moved, apart, good)


def _limits(best: Results, base: Results | None) -> Iterator[Tile]:
    """Constraints with their verdicts."""
    former = [] if base is None else constraints_of(base)
    for own, old in zip_longest(constraints_of(best), former):
        both = [(one.true, one.lower, one.upper) for one in (own, old) if one is not None]
        text = "; ".join(filter(None, (within(*both[0], own.unit), own.bounded)))
        yield _compared(own.goal, own.unit, text, *both)


def simulated(one: Results) -> list[list[str]]:
    """Return what is known of a simulated design: values with their intervals, and how many simulations."""
    tiles = _tiles(one, None, Content(Path(), {}))
    rows = [[tile.label, f"{tile.value} {tile.within}".rstrip()] for tile in tiles]
    return rows + [[word, f"{int(one[word])}"] for word in ("samples", "failed")]


def _peaks(best: Results, base: Results | None, content: Content) -> Iterator[Tile]:
    """The largest force of the stored responses: one run each, without an interval, and of chaotic ones no change."""
    names = (text_in(best, "design"), "original" if base is not None else "")
    kept = [content.responses.get(name, Results({})) for name in names]
    known = [one.get("peak_contact_force") for one in kept]
    forces = [np.nan if one is None else float(np.nanmax(one.values)) for one in known]
    if np.isfinite(forces[0]):
        both = ((force, np.nan, np.nan) for force in forces)
        tile, moving = _compared("peak force", "N", "one run", *both), content.files.get("chaos")
        chaotic = moving is not None and bool((moving["chaotic"].values > scatter.SOME).any())
        yield tile._replace(change="", good=None, within="one chaotic run") if chaotic else tile


def _rows(best: Results, base: Results | None) -> Iterator[ScreenRow]:
    """Design variables, with their place in the ranges of the study."""
    spans = _spans(best, base)
    for one in labels.design_variables(best):
        name = str(one.name)
        if not np.isfinite(float(one)):
            continue
        short = labels.words(one)
        words = re.split(", from | about ", str(one.attrs.get("long_name", "")))[0]
        label = short if words in ("", short) else words if "." in short else f"{short}, {words}"
        both = (one,) if base is None else (base[name], one)
        yield ScreenRow(label, tuple(labels.alike(*both)), spans.get(name))


def _spans(best: Results, base: Results | None) -> dict[str, Span]:
    """Where the variables of a design lie in their ranges, by name; none where the scene does not say."""
    scene = scene_of(best)
    if scene is None:
        return {}
    varied = scene.study.names if scene.study is not None else ()
    known = [str(v.name) for v in labels.design_variables(best) if np.isfinite(float(v))]
    names = [name for name in known if name in varied]
    designs = [{n: float(one[n]) for n in names} for one in (best if base is None else base, best)]
    try:
        before, after = (np.clip(shares(scene, design), 0.0, 1.0) for design in designs)
    except InputError:
        return {}
    ends = zip(names, before, after, strict=True)
    return {name: Span(float(low), float(high), bound_at(high)) for name, low, high in ends}


def _remark(of: Recommended) -> str:
    """Whether other designs are as good."""
    if not (twins := alike.others(of.ours, of.best)):
        return ""
    spans = alike.spans(of.ours, of.best, twins, 1)
    return f"{len(twins) + 1} equivalent designs{spans and f' ({spans})'}: choose by cost."


def _trust(of: Recommended) -> Iterator[Trust]:
    best = of.best
    for own in constraints_of(best):
        level = green if own.verdict is Verdict.HOLDS else red
        more = own.deciding and f"; {own.deciding}"
        yield level(f"Constraint {WORDS[own.verdict]}: {own.goal}{more}", "designs")
    share = beyond_hertz(best)
    if share > MANY:
        level = red if share > MOST else amber
        runs = "all runs" if share == 1.0 else f"{100 * share:.0f} % of runs"
        why = bearings.outside(of.files["verification"]) or "contact model outside its range"
        yield level(f"{upper(why)} ({runs})", "bearings")
    yield _accuracy(best)
    if (moving := of.of_best("chaos")) is not None and float(moving["chaotic"]) > scatter.SOME:
        moved = of.files["chaos"]["chaotic"].values > scatter.SOME
        many = "" if moved.all() else f" in {int(moved.sum())} of {moved.size} designs"
        yield amber(f"Chaotic motion{many}: values are means", "quality")
    yield from _failures(of)
    place = "sensitivities"
    if any(abs(error) > FAR for error in answer.surrogate_errors(best)):
        yield amber("Surrogate error above 20 %: a better design may have been missed", place)
    if (half := scatter.half_width(of.files.get("sensitivity"))) > scatter.UNSURE:
        yield amber(f"Sobol indices ± {100 * half:.0f} %: ranking only", place)
    kinds = ("sensitivity", "kriging")
    if poor := sum(len(fits.warnings(kind, of.files.get(kind))) for kind in kinds):
        yield amber(f"Poor fit of {counted(poor, 'surrogate')}", place)


def _accuracy(best: Results) -> Trust:
    """The half-widths of mean and standard deviation, and whether they are those that were requested."""
    if missed := text_in(best, "accuracy_missed"):
        return red(f"Requested accuracy not reached: {missed}", "quality")
    scene = scene_of(best)
    asked = scene.study.accuracy if scene is not None and scene.study is not None else None
    if asked is not None and "accuracy_missed" in best:
        return green("Requested accuracy reached", "quality")
    known = []
    for stem in ("mean", "deviation"):
        value, low, high = labels.estimate(best, stem)
        if value and np.isfinite([low, high]).all():
            known.append(f"{_USUAL[stem]} {plus_minus((high - low) / 2.0 / abs(value))}")
    if not known:
        return amber("Intervals of mean and standard deviation are not known", "quality")
    return green(f"Accuracy: {', '.join(known)}", "quality")


def _failed(best: Results) -> str:
    return f"{int(best['failed'])} of {int(best['samples'])} simulations of this design failed"


def _failures(of: Recommended) -> Iterator[Trust]:
    best, samples = of.best, of.files.get("samples")
    if failed := int(best["failed"]):
        level = red if failed > MANY * int(best["samples"]) else amber
        yield level(f"{_failed(best)}: the others make the results", "quality")
    status = np.zeros(0) if samples is None else samples["status"].values
    if lost := int((status != Status.OK).sum()):
        yield amber(f"{lost} of {len(status)} samples failed", "quality")
    if not failed and not lost:
        yield green("No simulation failed", "quality")


def _bars(of: Recommended) -> tuple[list[ShareBar], str]:
    """Contributions to the variance of the recommended design; where these are not known, total Sobol indices."""
    own, found = of.of_best("contributions"), of.files.get("sensitivity")
    if own is not None and np.isfinite(own["contribution"].values).any():
        return list(map(ShareBar._make, scatter.shares(own))), scatter.tighten(own)
    if found is None or "sobol_total" not in found:
        return [], ""
    values = (found[name].values for name in ("sobol_total", "sobol_total_error"))
    rows = zip(texts_in(found, "parameter"), *values, strict=True)
    known = [row for row in rows if np.isfinite(row[1])]
    bars = [ShareBar(name, float(s), scatter.HALF_WIDTH * float(e)) for name, s, e in known]
    words = "Total Sobol indices over the ranges of the study."
    return sorted(bars, key=lambda one: -one.share), words
