"""The first screen of a study: the recommended design beside today's, its figures, and what to trust of them."""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from hpcclear.base.errors import InputError
from hpcclear.base.objectives import Usual
from hpcclear.base.outcome import Status
from hpcclear.base.verdict import Verdict
from hpcclear.report import alike, bearings, scatter
from hpcclear.report.answer import (
    FAR,
    MANY,
    beyond_hertz,
    confidence,
    steps,
    surrogate_errors,
    unit_of,
)  # fmt: skip
from hpcclear.report.constraints import ABSENT, OPEN, WORDS, verdict_of
from hpcclear.report.figures import fits, labels
from hpcclear.report.html.content import Content, scene_in
from hpcclear.report.merit import baseline_of, best_of, goals_of, is_plain, ours_of, usual_of
from hpcclear.report.parts import Recommended
from hpcclear.report.screen import (
    Level,
    Screen,
    ScreenRow,
    ShareBar,
    Span,
    Tile,
    Trust,
    change,
    lower,
    percent,
    trusted,
    within,
)
from hpcclear.results.content import Results
from hpcclear.scene.domain import bound_at, shares

MOST = 0.5
"""Share of simulations outside the range of the contact model above which a recommendation is not relied on."""

_USUAL = {"mean": "mean", "deviation": "standard deviation", "percentile": "95th percentile"}
"""Statistics that each design has, by the stem of their variables."""

_INFEASIBLE = {
    Verdict.FAILS: "No simulated design satisfies the constraints",
    Verdict.UNDECIDED: "No simulated design is certain to satisfy the constraints",
}


def screen(content: Content) -> Screen | None:
    """Return the first screen of a verified study; None where nothing was verified."""
    verified = content.get("verification")
    if verified is None or not np.isfinite(verified["mean_true"]).any():
        return None
    ours = ours_of(verified)
    best, base = best_of(ours), baseline_of(ours)
    of = Recommended(content.files, ours, best)
    kept = base is not None and str(base["design"].item()) == str(best["design"].item())
    tiles = list(_tiles(best, None if kept else base, content))
    bars, causes = _bars(of)
    rows = tuple(_rows(best, None if kept else base))
    infeasible = verdict_of(best) in _INFEASIBLE
    column = "nearest" if infeasible else "today, kept" if kept else "recommended"
    return Screen(
        _headline(best, tiles, kept),
        tuple(_about(of)),
        _doubt(of),
        tuple(tiles),
        ("design", *(("today",) if base is not None and not kept else ()), column),
        rows,
        _remark(of),
        trusted(_trust(of), beyond_hertz(best) > MANY),
        tuple(bars),
        causes,
        tuple(steps(of)),
        ("front",) if "front" in content.files else (),
        (confidence(best),),
    )


def _readable(one: Results) -> str:
    return str(one["design"].item())


def _headline(best: Results, tiles: list[Tile], kept: bool) -> str:
    if (found := verdict_of(best)) in _INFEASIBLE:
        return _INFEASIBLE[found]
    if kept:
        return "Keep today's design: no simulated design is better"
    compared = [one for one in tiles if one.change][:2]  # limits have no former value
    said = [f"{lower(one.change)} {one.label}" for one in compared if lower(one.change)]
    text = f"Recommended design: {', '.join(said) or 'no significant change'}"
    return labels.sentence(text, best)


def _doubt(of: Recommended) -> str:
    """Why the recommendation is not to be relied on."""
    found = []
    if beyond_hertz(of.best) > MOST:
        found.append("the contact model is outside its range")
    if verdict_of(of.best) is Verdict.UNDECIDED:
        found.append("constraints are undecided")
    if _missed(of.best):
        found.append("the requested accuracy was not reached")
    return "; ".join(found)


def _about(of: Recommended) -> Iterator[str]:
    """What was simulated."""
    yield f"f: {labels.objective(of.ours)}"
    timing, designs = of.files.get("timing"), of.files["verification"].sizes["design"]
    if timing is not None and "samples" in timing:
        count = f"{int(timing['samples'].to_numpy().sum()):,}".replace(",", "\N{NO-BREAK SPACE}")
        yield f"{count} simulations of {designs} designs and a surrogate"


def _ends(one: Results, stem: str) -> tuple[float, float, float]:
    """A simulated value and the ends of its interval, NaN where they are not known."""
    value = float(one[stem if stem in one else f"{stem}_true"])
    low, high = (float(one.get(f"{stem}_{end}", np.nan)) for end in ("lower", "upper"))
    return value, low, high


def _statistics(best: Results) -> dict[str, str]:
    """Words of the values that are shown, and their stems: what the case makes small, then what every design has."""
    asked = [] if is_plain(best) else goals_of(best)
    usual = {Usual.MEAN: "mean", Usual.DEVIATION: "deviation"}
    shown = {usual.get(usual_of(best, name), name) for name in asked}
    found = {str(best[f"{name}_goal"].item()): name for name in asked}
    for stem, words in _USUAL.items():
        if stem not in shown and (stem in best or f"{stem}_true" in best):
            found.setdefault(f"{words} of f", stem)
    return found


def _tiles(best: Results, base: Results | None, content: Content) -> Iterator[Tile]:
    """Constraints and objectives of the case, then mean, standard deviation, percentile, and peak force; each once."""
    limits, known = {one.label: one for one in _limits(best)}, _statistics(best)
    yield from (one for label, one in limits.items() if label not in known)
    for words in sorted(known, key=lambda one: one not in limits):
        stem = known[words]
        unit, mine = unit_of(best, stem if stem in best else f"{stem}_true"), _ends(best, stem)
        before = None if base is None else _ends(base, stem)
        moved, good = ("", None) if before is None else change(mine, before)
        shown, *old = labels.quantities([mine[0], *(before or ())[:1]], unit)
        if np.isfinite(mine[0]):
            better = None if verdict_of(best) in _INFEASIBLE else good  # no gain without a design
            apart = limits[words].within if words in limits else within(*mine, unit)
            yield Tile(words, shown, "".join(old), moved, apart, better)
    yield from _peaks(best, base, content)


def _limits(best: Results) -> Iterator[Tile]:
    """Constraints with their verdicts."""
    for own in _constraints(best):
        unit, most = str(own["constraint_unit"].item()), float(own["constraint_most"])
        value, low, high = (float(own[f"constraint_{end}"]) for end in ("true", "lower", "upper"))
        verdict = Verdict(int(own["constraint_verdict"]))
        held = f"at most {labels.quantity(most, unit)}: {WORDS[verdict]}"
        text = "; ".join(filter(None, (within(value, low, high, unit), held)))
        shown, label = labels.quantity(value, unit), str(own["constraint_goal"].item())
        yield Tile(label, shown, within=text, good=verdict is Verdict.HOLDS)


def simulated(one: Results) -> list[list[str]]:
    """Return what is known of a simulated design: values with their intervals, and how many simulations."""
    tiles = _tiles(one, None, Content(Path(), {}, {}))
    rows = [[tile.label, f"{tile.value} {tile.within}".rstrip()] for tile in tiles]
    return rows + [[word, f"{int(one[word])}"] for word in ("samples", "failed") if word in one]


def _peaks(best: Results, base: Results | None, content: Content) -> Iterator[Tile]:
    """The largest force of the stored responses: one run each, without an interval."""
    names = (_readable(best), "original" if base is not None else "")
    kept = [content.responses.get(name) for name in names]
    known = [None if one is None else one.get("peak_contact_force") for one in kept]
    forces = [np.nan if one is None else float(np.nanmax(one.to_numpy())) for one in known]
    if np.isfinite(forces[0]):
        moved = change((forces[0], np.nan, np.nan), (forces[1], np.nan, np.nan))
        value, old = labels.quantities(forces, "N")
        yield Tile("peak force", value, old.strip("–"), moved[0], "one run", moved[1])


def _constraints(best: Results) -> Iterator[Results]:
    if "constraint_verdict" in best:
        every = (best.isel(constraint=k) for k in range(best.sizes["constraint"]))
        yield from (own for own in every if int(own["constraint_verdict"]) != ABSENT)


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
    scene = scene_in(str(best.attrs.get("scene", "")))
    if scene is None:
        return {}
    try:
        known = scene.study.names if scene.study is not None else ()
        designs = [
            {
                name: float(one[name])
                for v in labels.design_variables(best)
                if (name := str(v.name)) in known and np.isfinite(float(v))
            }
            for one in (best if base is None else base, best)
        ]
        before, after = (np.clip(shares(scene, design), 0.0, 1.0) for design in designs)
    except InputError:
        return {}
    return {
        name: Span(float(low), float(high), bound_at(high))
        for name, low, high in zip(designs[0], before, after, strict=True)
    }


def _remark(of: Recommended) -> str:
    """Whether other designs are as good."""
    twins = alike.others(of.ours, of.best)
    spans = alike.spans(of.ours, of.best, twins, 1) if twins else ""
    more = spans and f" ({spans})"
    return f"{len(twins) + 1} equivalent designs{more}: choose by cost." if twins else ""


def _missed(best: Results) -> str:
    return str(best["accuracy_missed"].item()) if "accuracy_missed" in best else ""


def _trust(of: Recommended) -> Iterator[Trust]:
    best = of.best
    for own in _constraints(best):
        verdict = Verdict(int(own["constraint_verdict"]))
        level = Level.GREEN if verdict is Verdict.HOLDS else Level.RED
        price = float(own["constraint_price"])
        more = f"; about {price:.0f} simulations would decide" if np.isfinite(price) else ""
        more += f"; {OPEN}" if np.isinf(price) else ""
        yield Trust(
            level, f"Constraint {WORDS[verdict]}: {own['constraint_goal'].item()}{more}", "designs"
        )
    share = beyond_hertz(best)
    if share > MANY:
        level = Level.RED if share > MOST else Level.AMBER
        runs = "all runs" if share == 1.0 else f"{100 * share:.0f} % of runs"
        why = bearings.outside(of.files["verification"]) or "contact model outside its range"
        yield Trust(level, f"{why[0].upper()}{why[1:]} ({runs})", "bearings")
    yield _accuracy(best)
    if (moving := of.of_best("chaos")) is not None and float(moving["chaotic"]) > scatter.SOME:
        moved = of.files["chaos"]["chaotic"].to_numpy() > scatter.SOME
        many = "" if moved.all() else f" in {int(moved.sum())} of {moved.size} designs"
        yield Trust(Level.AMBER, f"Chaotic motion{many}: values are means", "quality")
    yield from _failures(of)
    errors = surrogate_errors(best)
    if any(abs(error) > FAR for error in errors):
        yield Trust(
            Level.AMBER,
            "Surrogate error above 20 %: a better design may have been missed",
            "sensitivities",
        )
    if (half := scatter.half_width(of.files.get("sensitivity"))) > scatter.UNSURE:
        yield Trust(
            Level.AMBER, f"Sobol indices ± {100 * half:.0f} %: ranking only", "sensitivities"
        )
    poor = [
        one
        for kind in ("sensitivity", "kriging")
        for one in fits.warnings(kind, of.files.get(kind))
    ]
    if poor:
        yield Trust(Level.AMBER, f"{len(poor)} surrogate fits are poor", "sensitivities")


def _accuracy(best: Results) -> Trust:
    """The half-widths of mean and standard deviation, and whether they are those that were requested."""
    if missed := _missed(best):
        return Trust(Level.RED, f"Requested accuracy not reached: {missed}", "quality")
    scene = scene_in(str(best.attrs.get("scene", "")))
    asked = scene.study.accuracy if scene is not None and scene.study is not None else None
    if asked is not None and "accuracy_missed" in best:
        return Trust(Level.GREEN, "Requested accuracy reached", "quality")
    known = []
    for stem in ("mean", "deviation"):
        value, low, high = _ends(best, stem)
        if value and np.isfinite([low, high]).all():
            known.append(f"{_USUAL[stem]} {percent((high - low) / 2.0 / abs(value))}")
    if not known:
        return Trust(
            Level.AMBER, "Intervals of mean and standard deviation are not known", "quality"
        )
    return Trust(Level.GREEN, f"Accuracy: {', '.join(known)}", "quality")


def _failures(of: Recommended) -> Iterator[Trust]:
    best, samples = of.best, of.files.get("samples")
    failed = int(best["failed"]) if "failed" in best else 0
    if failed:
        yield Trust(
            Level.AMBER,
            f"{failed} of {int(best['samples'])} simulations of this design failed",
            "quality",
        )
    lost = 0 if samples is None else int((samples["status"].to_numpy() != Status.OK).sum())
    if lost:
        yield Trust(Level.AMBER, f"{lost} of {samples.sizes['sample']} samples failed", "quality")  # type: ignore[union-attr]
    if not failed and not lost:
        yield Trust(Level.GREEN, "No simulation failed", "quality")


def _bars(of: Recommended) -> tuple[list[ShareBar], str]:
    """Contributions to the variance of the recommended design; where these are not known, total Sobol indices."""
    own, found = of.of_best("contributions"), of.files.get("sensitivity")
    if own is not None and np.isfinite(own["contribution"].to_numpy()).any():
        return list(map(ShareBar._make, scatter.shares(own))), "".join(scatter.tighten(own))
    if found is not None and "sobol_total" in found:
        rows = zip(
            *(found[name].to_numpy() for name in ("parameter", "sobol_total", "sobol_total_error")),
            strict=True,
        )
        bars = [
            ShareBar(str(n), float(v), scatter.HALF_WIDTH * float(e))
            for n, v, e in rows
            if np.isfinite(v)
        ]
        return sorted(
            bars, key=lambda one: -one.share
        ), "Total Sobol indices over the ranges of the study."
    return [], ""


SCREENS = (screen,)
