"""The paper's twelve claims on our own data: each holds, does not hold, or undecided.

A difference counts when it is larger than `SURE` standard errors. A claim of several parts holds
when each part does, and does not hold when one part is refuted; otherwise it is undecided.
"""

import itertools
from collections.abc import Callable, Iterable, Sequence

import numpy as np
from scipy.special import chdtri

from hpcclear.base.arrays import Array
from hpcclear.base.verdict import Verdict
from hpcclear.results import dataset
from hpcclear.statistics.random.replicates import student
from hpcclear.study.paper.printed import CLAIMS, case_names, own_names
from hpcclear.study.responses import QUANTITIES, STATISTICS
from hpcclear.study.run import Result, StudyRun
from hpcclear.study.sensitivities import surfaces

LEVEL = 0.99
"""Confidence that decides."""

SURE = 2.5758293035489004
"""Standard errors that decide: `LEVEL`, two-sided."""

HOLDS, FAILS, OPEN = Verdict.HOLDS, Verdict.FAILS, Verdict.UNDECIDED
Finding = tuple[Verdict, str]
"""Verdict, and the numbers behind it."""


def verdict(supported: Iterable[bool], refuted: Iterable[bool]) -> Verdict:
    """Verdict on a claim of several parts, each supported, refuted, or neither."""
    if any(refuted):
        return FAILS
    parts = list(supported)
    return HOLDS if parts and all(parts) else OPEN


class SensitivityEvidence:
    """First-order sensitivities (of `hpcclear.study.sensitivities.analyse`) as evidence: effects over the ranges, by surface
    and clearance.

    Variables go by the paper's symbols where it has one, else by the study's own names.
    """

    def __init__(self, run: StudyRun, result: Result) -> None:
        symbols = {name: symbol for symbol, name in own_names(run.scene).items()}
        self.names = [symbols.get(name, name) for name in run.study.names]
        self.inputs = [[symbols.get(n, n) for n in inputs] for inputs in surfaces(run.study)]
        self.result = result
        self.settings = run.study.sensitivity

    def has(self, *names: str) -> bool:
        """Whether all of them are inputs of some surface."""
        return set(names) <= {name for inputs in self.inputs for name in inputs}

    def of(self, name: str) -> tuple[Array, Array]:
        """Effects and standard errors of a variable, (surfaces, clearances)."""
        rows = [k for k, inputs in enumerate(self.inputs) if name in inputs]
        column = self.names.index(name)
        found = (self.result[key] for key in ("best_sensitivity", "uncertainty"))
        effect, error = (array[rows, :, column] for array in found)
        return effect, error

    def influential(self) -> list[str]:
        """X_G-I."""
        chosen = self.result["selected"].astype(bool)
        return [name for name, is_chosen in zip(self.names, chosen, strict=True) if is_chosen]

    def sign(self, name: str, sign: int) -> tuple[bool, bool, str]:
        """Whether the slope has that sign at every clearance; at some the other; in words."""
        effect, error = self.of(name)
        agree = (sign * effect > SURE * error).any(axis=0)
        oppose = (sign * effect < -SURE * error).any(axis=0)
        word = "grows" if sign > 0 else "falls"
        text = f"f {word} with {name} at {agree.sum()} of {agree.size} clearances"
        if oppose.any():
            text += f", the opposite at {oppose.sum()}"
        return bool(agree.all() and not oppose.any()), bool(oppose.any()), text

    def signs(self, wanted: Sequence[tuple[str, int]]) -> Finding:
        """Verdict on the signs of several variables."""
        if not self.has(*(name for name, _ in wanted)):
            return OPEN, "not among the study's surfaces"
        parts = [self.sign(name, sign) for name, sign in wanted]
        text = "; ".join(part[2] for part in parts)
        return verdict((part[0] for part in parts), (part[1] for part in parts)), text


def _grows_with_clearance(found: SensitivityEvidence) -> Finding:
    mean, error = found.result["mean_objective"], found.result["mean_objective_error"]
    if len(mean) < 2:
        return OPEN, "the study has one clearance"
    step = np.diff(mean)
    allowed = SURE * np.hypot(error[1:], error[:-1])
    least = f"{step.min():.2g}, significant above {allowed[step.argmin()]:.2g}"
    text = f"mean f over the box from {mean[0]:.3g} to {mean[-1]:.3g}; smallest increment {least}"
    return verdict(step > allowed, step < -allowed), text


def _hardly_moves(found: SensitivityEvidence) -> Finding:
    names = [name for name in ("m1", "u1", "I1") if found.has(name)]
    if len(names) < 3:
        return OPEN, "m1, u1 and I1 are not all among the study's surfaces"
    known = [abs(found.of(name)[0]) for name in found.names if found.has(name)]
    largest = np.fmax.reduce(np.concatenate(known))  # NaN only where nothing is known
    upper, lower = [], []
    for name in names:
        effect, error = found.of(name)
        upper.append(np.fmin.reduce((abs(effect) + SURE * error) / largest).max())
        lower.append(np.fmax.reduce((abs(effect) - SURE * error) / largest).max())
    limit = found.settings.influence
    shares = ", ".join(f"{n} {100 * u:.2g} %" for n, u in zip(names, upper, strict=True))
    text = f"at most {shares} of the largest effect (limit {100 * limit:g} %)"
    return verdict((u < limit for u in upper), (low > limit for low in lower)), text


def _order_is_kept(found: SensitivityEvidence) -> Finding:
    names = found.influential()
    kept: list[str] = []
    changed: list[str] = []
    unsure: list[str] = []
    for a, b in itertools.combinations(names, 2):
        rows = [k for k, inputs in enumerate(found.inputs) if a in inputs and b in inputs]
        at = [found.names.index(a), found.names.index(b)]
        for row in rows:
            one, other = abs(found.result["best_sensitivity"][row][:, at].T)
            lead = one - other
            allowed = SURE * np.hypot(*found.result["uncertainty"][row][:, at].T)
            first, second = lead > allowed, lead < -allowed
            where = changed if first.any() and second.any() else kept
            if not (first.all() or second.all() or where is changed):
                where = unsure
            where.append(f"{a}-{b}")
    text = f"of the pairs of {', '.join(names)}: {len(kept)} keep their order at every clearance"
    text += f", {len(changed)} change it" + (f" ({', '.join(changed)})" if changed else "")
    text += f", {len(unsure)} are within their errors"
    supported = [True] * len(kept) + [False] * len(unsure)
    return verdict(supported, [True] * len(changed)), text


def _size_varies(found: SensitivityEvidence) -> Finding:
    parts, texts = [], []
    for name in found.influential():
        effects, errors = found.of(name)
        known = np.isfinite(effects) & np.isfinite(errors) & (errors > 0)
        row = int(known.sum(axis=1).argmax())
        effect, error = effects[row][known[row]], errors[row][known[row]]
        if len(effect) < 2:
            parts.append((False, False))
            continue
        mean = np.average(effect, weights=error**-2)
        chi = float(np.sum(((effect - mean) / error) ** 2))
        varies = chi > chdtri(len(effect) - 1, 0.01)
        precise = bool((error < 0.1 * abs(mean)).all())
        parts.append((varies, precise and not varies))
        texts.append(f"{name} {abs(effect).min():.2g} to {abs(effect).max():.2g}")
    text = "effects over the range: " + ", ".join(texts)
    return verdict((p[0] for p in parts), (p[1] for p in parts)), text


def _global_for_masses(found: SensitivityEvidence) -> Finding:
    masses, others = {"m1", "m2", "m3"}, {"u1", "u2", "I1", "I2"}
    fit, target = found.result["leave_one_out_r2"], found.settings.r2
    supported, refuted, texts = [], [], []
    for row, inputs in enumerate(found.inputs):
        if not (set(inputs) <= masses or set(inputs) <= others):
            continue
        whole = fit[row, 0] >= target
        later = (fit[row, 1:] >= target).any(axis=0)
        if set(inputs) <= masses:
            supported.append(bool(whole.all()))
            refuted.append(bool(np.mean(whole) < 0.5))
        else:
            supported.append(bool((~whole & later).all()))
            refuted.append(bool(whole.all() or not (whole | later).any()))
        least = np.nanmin(fit[row, 0]) if np.isfinite(fit[row, 0]).any() else np.nan
        texts.append(
            f"{' '.join(inputs)}: whole interval at {whole.sum()} of {whole.size} clearances "
            f"(lowest R2 {least:.2f}), only a shorter one at {(~whole & later).sum()}"
        )
    if not texts:
        return OPEN, "the study has no such surfaces"
    text = f"leave-one-out R2 of at least {target:g}; " + "; ".join(texts)
    return verdict(supported, refuted), text


class ResponseEvidence:
    """Responses at one clearance as evidence: differences between designs, and how far copies disagree on them."""

    def __init__(self, series: Result) -> None:
        self.names = series["names"].tolist()
        self.statistics = series["statistics"]

    def change(self, a: str, b: str, statistic: str, quantity: str) -> tuple[float, float]:
        """Relative change from design b to design a, and what it must exceed to be sure; NaN where one of them is missing."""
        if not {a, b} <= set(self.names):  # both ends of a front may be one design
            return np.nan, np.nan
        s, q = STATISTICS.index(statistic), QUANTITIES.index(quantity)
        one, other = (self.statistics[self.names.index(name), ..., s, q] for name in (a, b))
        reach = np.hypot(_reach(one), _reach(other))
        level = abs(other.mean())
        return float((one.mean() - other.mean()) / level), float(reach / level)

    def judged(self, wanted: Sequence[tuple[str, str, str, str, int]]) -> Finding:
        """Verdict on changes (a, b, statistic, quantity, wanted sign)."""
        supported, refuted, texts = [], [], []
        for a, b, statistic, quantity, sign in wanted:
            change, sure = self.change(a, b, statistic, quantity)
            supported.append(sign * change > sure)
            refuted.append(sign * change < -sure)
            text = f"{100 * change:+.1f} % (significant above {100 * sure:.1f} %)"
            if np.isnan(change):
                text = "unknown, for it was not simulated or failed"
            if not supported[-1]:
                texts.append(f"{a} against {b}: {statistic} of {quantity} {text}")
        text = f"{sum(supported)} of {len(wanted)} comparisons as claimed"
        return verdict(supported, refuted), text + (f"; not: {'; '.join(texts)}" if texts else "")


def _reach(values: Array) -> float:
    """95 % half-width of a mean over copies and their segments, (copies, segments): Student's t of the copies where they
    disagree, of the segments where motion is regular and copies agree."""
    means = (values.mean(axis=axis) for axis in (1, 0))
    return float(max(student(LEVEL, len(x) - 1) * x.std(ddof=1) / np.sqrt(len(x)) for x in means))


def _peaks_cut(run: StudyRun, found: ResponseEvidence) -> Finding:
    names = [name for name in found.names if name != "original"]
    pairs = itertools.product(names, QUANTITIES[:3])
    return found.judged([(name, "original", "peak", quantity, -1) for name, quantity in pairs])


def _alpha_lower_beta_calmer(run: StudyRun, found: ResponseEvidence) -> Finding:
    wanted = []
    for case in run.study.cases:
        alpha, beta = f"{case.name} alpha", f"{case.name} beta"
        for quantity in QUANTITIES:
            wanted.append((alpha, beta, "mean", quantity, -1))
            wanted.append((beta, alpha, "fluctuation", quantity, -1))
    return found.judged(wanted)


def _case_2_cuts_more(run: StudyRun, found: ResponseEvidence) -> Finding:
    first, second = case_names(run.scene)
    if first is None or second is None:
        return OPEN, "the study has not both of the paper's cases"
    pairs = itertools.product(("alpha", "beta"), QUANTITIES)
    wanted = [(f"{second} {end}", f"{first} {end}", "peak", name, -1) for end, name in pairs]
    acceleration = (f"{second} alpha", f"{first} alpha", "peak", QUANTITIES[3])
    wanted[wanted.index((*acceleration, -1))] = (*acceleration, 1)
    return found.judged(wanted)


def _beta_of_case_2(run: StudyRun, found: ResponseEvidence) -> Finding:
    case = case_names(run.scene)[1]
    if case is None:
        return OPEN, "the study has not the paper's case 2"
    alpha, beta = f"{case} alpha", f"{case} beta"
    wanted = [(beta, alpha, "mean", QUANTITIES[0], 1)]
    return found.judged([*wanted, (beta, alpha, "fluctuation", QUANTITIES[0], -1)])


def _kriging_accurate(run: StudyRun, kriging: Result) -> Finding:
    checks = np.array([kriging[f"model{k}_check"] for k in range(len(run.study.models))])
    r2, rmse = checks[:, 0], checks[:, 4]
    rows = zip(run.study.models, r2, rmse, strict=True)
    texts = [f"{' '.join(names)}: R2 {one:.4f}, RMSE {off:.2g}" for names, one, off in rows]
    passed = r2 >= run.study.surrogate.r2
    text = f"on fresh points, R2 of at least {run.study.surrogate.r2:g} required; "
    return verdict(passed, r2 < 0.9), text + "; ".join(texts)


def judge(
    run: StudyRun, sensitivity: Result | None, kriging: Result, series: Result
) -> list[Finding]:
    """A verdict and its numbers for each of `CLAIMS`."""
    effects = None if sensitivity is None else SensitivityEvidence(run, sensitivity)
    responses = ResponseEvidence(series)

    def on_effects(rule: Callable[[SensitivityEvidence], Finding]) -> Finding:
        return (OPEN, "the study has no response surfaces") if effects is None else rule(effects)

    return [
        on_effects(_grows_with_clearance),
        on_effects(lambda found: found.signs([("m2", 1), ("m3", 1)])),
        on_effects(_hardly_moves),
        on_effects(lambda found: found.signs([("u2", -1), ("I2", 1)])),
        on_effects(_order_is_kept),
        _peaks_cut(run, responses),
        _alpha_lower_beta_calmer(run, responses),
        on_effects(_global_for_masses),
        _case_2_cuts_more(run, responses),
        _beta_of_case_2(run, responses),
        _kriging_accurate(run, kriging),
        on_effects(_size_varies),
    ]


def write(run: StudyRun, findings: Sequence[Finding]) -> None:
    """Write claims.nc."""
    verdicts, figures = zip(*findings, strict=True)
    data = {"text": CLAIMS, "verdict": verdicts, "figure": figures}
    coords = {"claim": np.arange(1, len(CLAIMS) + 1)}
    run.write(dataset.dataset("claims", coords, data))
