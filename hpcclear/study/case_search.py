"""The search of one case by simulation: which designs it asks for next, with how many simulations, and which it ends with."""

import itertools
from collections.abc import Sequence
from functools import partial

import moocore
import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.scene.cases import Case
from hpcclear.scene.domain import box
from hpcclear.scene.points import snapped
from hpcclear.scene.sampling import unit_lhs
from hpcclear.scene.stages import REPLICATES
from hpcclear.statistics.random.tail import of_share
from hpcclear.statistics.search import improvement
from hpcclear.statistics.search.beliefs import Beliefs, Known, Space
from hpcclear.statistics.search.improvement import NEAR
from hpcclear.statistics.search.pareto import cut
from hpcclear.statistics.surrogate.piecewise import Piecewise
from hpcclear.study import contest, goals, truth
from hpcclear.study.budget import AIM, AIMS, FIRST, HEDGES, OFF, SETTLED, SURE, all_over
from hpcclear.study.failures import CLOSE, FEW, Failures
from hpcclear.study.guesses import Guesses
from hpcclear.study.optimisation import Choice, choices, distinct
from hpcclear.study.run import StudyRun
from hpcclear.study.simulated import Simulated

PARTS = 3
"""Parts that `infill_designs` are simulated in, since each new design says where the next belongs."""

WORTH, FRONT, AREA, PATIENCE = 0.2, 1.0, 0.01, 2
"""What another design or more simulations are worth at least, and what the design that is taken for the best may lose: of the
accuracy requested, in what decides and in other directions, and of the area below a front of two objectives, with more a fifth
of that of the distance to it; rounds in a row that are not, after which the search ends."""

LEADERS, KNOWN = 3, 0.25
"""Designs that get more simulations first, and standard error, over the accuracy requested, beyond which they do."""

ALIKE = 0.5
"""What is not known of the difference from the nearest simulated design, over what is not known of the difference from the best
(variances): below this share the nearest design is simulated again in place of the new one."""

AWAY, BOLD = 0.05, 2.0
"""How far `HEDGES` are off others, over the ranges; standard errors by which they may be better than is believed."""

SMALL, SHOWN = 0.012, 3.0
"""Of the same for other statistics than probabilities: 0.24 % below the threshold is sought; and standard errors after the most
simulations that a verified design may have, by which the last of `AIMS` keeps its constraints."""

AGREE = 0.04, 0.001
"""How well the model has to know the last of `SETTLED`: its index, some 10 % of a probability, or another statistic over its
threshold."""


class CaseSearch:
    """The search of one case: it asks for simulations of `designs`, which it has in their order."""

    def __init__(
        self, run: StudyRun, case: Case, start: Sequence[Choice], models: Sequence[Piecewise]
    ) -> None:
        self._run, self._case, settings = run, case, run.study.verification
        self._size = truth.search_length(run.study)
        self._names = run.study.design_variables(case.name)
        self._region, self._rng = box(run.scene, self._names), run.rng("search", case.name)
        guesses = Guesses(run, case, models, self._size)
        directions = contest.directions(case)
        self._space = Space(
            self._region.bounds,
            directions,
            goals.exact_in(run.scene, case),
            self._margins(AIM),
            partial(snapped, run.study, self._names),
            guesses.trends(self._region, self._rng),
        )
        others = [*range(1, len(directions)), None] if len(case.goals) > 1 else []
        turns = [part for one in others for part in (0, one)] or [0]
        self._turns = itertools.cycle(turns)
        self._most = settings.infill_rounds * settings.infill_designs
        self._batch = max(settings.infill_designs // PARTS, 1)
        self._idle, self._hope = 0, 0.0
        self._last: Beliefs | None = None
        self._least = AREA if len(case.goals) < 3 else AREA / 5.0
        unit = unit_lhs(all_over(run.study, case), len(self._names), self._rng)
        wide = choices(run, case.name, self._region.at(unit))
        self.designs = Simulated(run, case, guesses, distinct([*start, *wide]))
        self._begun = len(self.designs)
        self._failures = Failures(run, case, self._rng)
        self._near, self._again = set[int](), set[int]()
        self._agree = [AGREE[one.statistic != "exceedance"] for one in case.kept]

    # -- asking ------------------------------------------------------------------------------------

    def ask(self) -> list[int]:
        """Numbers of the designs that are simulated next; none at the end."""
        if not self.designs.made[0].size:
            return list(range(self._begun))
        count = min(self._batch, self._begun + self._most - len(self.designs))
        if self._idle == PATIENCE or count <= 0:
            return []
        if (beliefs := self._beliefs()) is None:
            unit = unit_lhs(count, len(self._names), self._rng)
            return self.designs.add(self._region.at(unit))
        rows, left = self._leaders(beliefs), list[tuple[float, Array]]()
        for _ in range(count):
            if (len(self.designs) - self._begun) % improvement.EXPLORED == improvement.EXPLORED - 1:
                point, worth = improvement.farthest(beliefs)
                if worth > 0.0:
                    beliefs.take(point)
                    rows += self.designs.add(point[None])
                continue
            turn = next(self._turns)
            direction = None if turn is None else self._space.directions[turn]
            point, worth = improvement.proposed(beliefs, direction)
            size = 0.0 if direction is None else self._accuracy(beliefs, direction)
            if size > 0.0:
                self._hope = worth / size
            least = (FRONT if turn else WORTH) * size
            row, again = self._contender(beliefs, direction, rows)
            new = worth / FIRST
            if again > new and again * self.designs.made[row].shape[2] > least:
                rows.append(row)
            elif worth > (least or self._least):
                beliefs.take(point)
                rows += self.designs.add(point[None])
            else:
                left.append((worth / (least or self._least), point))
        self._idle = self._idle + 1 if len(left) == count else 0
        if self._idle:
            rows = list(dict.fromkeys([*rows, *self._beyond(beliefs, left)]))
        self._again = {row for row in rows if self.designs.made[row].size}
        fresh = beliefs.pending
        if self._failures.goals and len(fresh):
            means, _ = beliefs.shortfalls(fresh)
            first = len(self.designs) - len(fresh)
            self._near |= {first + int(k) for k in np.flatnonzero(abs(means.max(axis=1)) < CLOSE)}
        return rows

    def _beyond(self, beliefs: Beliefs, left: Sequence[tuple[float, Array]]) -> list[int]:
        """Designs where none is expected to win enough: those that may be the best, as long as the one that is taken for it is
        expected to lose too much to them, or more simulations of known ones beside them; then the best of those `left` and
        where nothing is known, since the models may be wrong."""
        main, rows = self._space.directions[0], list[int]()
        size = self._accuracy(beliefs, main)
        points, loss = improvement.drawn(beliefs, main, len(left))
        if loss > WORTH * size > 0.0:
            self._idle, self._hope = 0, loss / size
            for place in points:
                row = self._alike(beliefs, place, main)
                if row is None:
                    beliefs.take(place)
                    rows += self.designs.add(place[None])
                elif row not in rows:
                    rows.append(row)
            return rows
        point, apart = max(left, key=lambda one: one[0])[1], 1.0
        while apart > 0.0 and len(rows) < len(left):  # of a catalogue none may be left
            beliefs.take(point)
            rows += self.designs.add(point[None])
            point, apart = improvement.farthest(beliefs)
        return rows

    def _alike(self, beliefs: Beliefs, place: Array, direction: Array) -> int | None:
        """The simulated design nearest to a place, if a new design there would have nearly the same error: then further
        simulations of the nearest one say more about both. None if it would not, or if the nearest one may have no more."""
        known = beliefs.known.designs
        best = np.where(beliefs.allowed, beliefs.believed @ direction, np.inf).argmin()
        row = int(self._space.apart(known, place).argmin())
        off = [
            beliefs.apart(place[None], one)[0] @ direction**2 for one in (known[row], known[best])
        ]
        return row if off[0] < ALIKE * off[1] and self._longer(row) else None

    def _leaders(self, beliefs: Beliefs) -> list[int]:
        """The design that is taken for the best, at first some, unless it has as many simulations as a design may have: what
        few simulations flatter is found out before others follow it, and what all get wrong by them is known."""
        main = self._space.directions[0]
        merit = np.where(beliefs.finite, beliefs.believed @ main, np.inf)
        merit = np.where(beliefs.allowed | ~beliefs.allowed.any(), merit, np.inf)
        first = self.designs.sizes.max() == FIRST
        rows = np.argsort(merit, kind="stable")[: LEADERS if first else 1]
        size = KNOWN * self._accuracy(beliefs, main)
        return [
            k
            for k in rows.tolist()
            if self._unclear(k) or (self._longer(k) and self.designs.error(k, main) > size)
        ]

    def _contender(
        self, beliefs: Beliefs, direction: Array | None, taken: Sequence[int]
    ) -> tuple[int, float]:
        """The known design of which more simulations are worth most, and how much for each point of its replicates."""
        if direction is None:
            return 0, 0.0
        sizes = self.designs.sizes[: len(beliefs.known.designs)]
        worth = improvement.replications(beliefs, direction) / np.maximum(sizes, 1)
        worth[sizes >= self._size] = 0.0
        worth[[row for row in taken if row < len(worth)]] = 0.0
        row = int(worth.argmax())
        return row, float(worth[row])

    def _accuracy(self, beliefs: Beliefs, direction: Array) -> float:
        """The accuracy requested in a direction, at the best design that is known."""
        known = beliefs.believed[beliefs.finite]
        best = known[(known @ direction).argmin()]
        return contest.size_of(self._run, self._case, direction, best)

    # -- what is known -------------------------------------------------------------------------------

    def _beliefs(self) -> Beliefs | None:
        """By a model of all designs so far; None where too many of them failed for one."""
        try:
            self._last = Beliefs(self._known(), self._space, self._rng, self._last)
        except InputError:
            return None
        return self._last

    def _known(self) -> Known:
        """Objectives and constraints of all designs so far, with their standard errors."""
        found, count = self.designs.known(), len(self._case.goals)
        for row, k in itertools.product(self._failures.drawn, range(len(self._failures.goals))):
            column = count + self._case.kept.index(self._failures.goals[k])
            plain = *found[row, :, column], self.designs.made[row]
            found[row, :, column] = self._failures.excess(row, k, *plain)
        (values, errors), (excess, doubts) = (
            np.moveaxis(part, 1, 0) for part in np.split(found, [count], axis=2)
        )
        places, shifts = self.designs.places(self._space.bounds), self.designs.shifts()[:count]
        return Known(places, values, errors, excess, doubts, shifts)

    # -- probabilities -------------------------------------------------------------------------------

    def weigh(self) -> None:
        """Draw weighted samples of designs near a threshold that have none, and twice as many of those that are asked again."""
        if not self._failures.goals:
            return
        columns = [self._case.kept.index(one) for one in self._failures.goals]
        excess = self._known().excess[:, columns].max(axis=1)
        known = np.flatnonzero(np.isfinite(excess)).tolist()
        if known and not self._failures.densities:
            nearest = min(known, key=lambda row: abs(excess[row]))
            self._failures.prepare(self.designs.choices[nearest])
        near = {row for row in known if abs(excess[row]) < CLOSE} | self._near
        again = sorted(near & self._again & set(self._failures.drawn))
        self._failures.draw(self.designs.choices, sorted(near - set(self._failures.drawn)), FEW)
        for row in again:
            self._failures.draw(self.designs.choices, [row], self._failures.drawn_of(row))
        self._near = set()

    def settle(self) -> None:
        """Look closely at the best designs by the model, until it knows how far they keep their constraints."""
        for _ in range(SETTLED if any(not one.exact for one in self._case.kept) else 0):
            if (beliefs := self._beliefs()) is None:
                return
            point = improvement.expected(beliefs, self._space.directions[0])
            apart = self._space.apart(beliefs.known.designs, point)
            row = int(apart.argmin())
            if apart[row] > NEAR:
                (row,) = self.designs.add(point[None])
            while self._unclear(row):
                lengthened(self._run, [(self, [row])])
            if self._failures.densities:
                self._failures.draw(self.designs.choices, [row], SURE)
            guess, _ = beliefs.shortfalls(point[None], np.zeros(len(self._case.kept)))
            if (abs(self._known().excess[row] - guess[0]) < self._agree).all():
                return

    def _longer(self, row: int) -> bool:
        """Whether a design may have more simulations."""
        return bool(self.designs.made[row].shape[2] < self._size)

    def _unclear(self, row: int) -> bool:
        """Whether further simulations would reduce what is unknown of the constraints of a design."""
        length = self.designs.made[row].shape[2]
        errors = self.designs.of(row, length)[0][1, len(self._case.goals) :] if length else np.inf
        return self._longer(row) and bool((errors > np.array(self._agree) / 2.0).any())

    # -- the end -------------------------------------------------------------------------------------

    def finalists(self) -> list[Choice]:
        """Designs to verify: in each direction the one that is believed to be the best, and others that may be; where there
        are constraints the best that keep them by several margins; and of the front as many as the study wants."""
        if (beliefs := self._beliefs()) is None:
            return self.designs.choices[: self._run.study.verification.designs]
        known, main = beliefs.known.designs, self._space.directions[0]
        kept = np.flatnonzero(beliefs.allowed)
        if not len(kept):
            broken = np.where(beliefs.finite, beliefs.shortfalls(known)[0].max(axis=1), np.inf)
            nearest = np.argsort(broken, kind="stable")[: 1 + HEDGES]
            return [self.designs.choices[row] for row in nearest]
        means = beliefs.believed[kept]
        rows = [int(kept[(means @ one).argmin()]) for one in self._space.directions]
        designs = self._run.study.verification.designs
        if designs and len(self._case.goals) > 1:
            front = np.flatnonzero(moocore.is_nondominated(means))
            rows += kept[front[cut(means[front], max(designs, means.shape[1]))]].tolist()
        rows = list(dict.fromkeys(rows))
        merit = beliefs.believed @ main
        spreads = np.sqrt(beliefs.apart(known, known[rows[0]]) @ main**2)
        bold = merit - BOLD * spreads
        for row in kept[np.argsort(bold[kept], kind="stable")]:
            if bold[row] > merit[rows[0]]:
                break
            apart = self._space.apart(known[rows], known[row])
            if len(rows) < len(self._space.directions) + HEDGES and apart.min() > AWAY:
                rows.append(int(row))
        points = [improvement.expected(beliefs, one) for one in self._space.directions]
        if all(one.exact for one in self._case.kept):
            points = [
                point for one, point in zip(self._space.directions, points, strict=True)
                if float((means @ one).min() - beliefs.means(point[None])[0] @ one)
                > WORTH * self._accuracy(beliefs, one)
            ]  # fmt: skip
        else:
            apart = self._space.apart(known, points[0])
            near = int(np.where(beliefs.finite, apart, np.inf).argmin())
            doubt = beliefs.shortfalls(points[0][None])[1][0]
            off = np.hypot(beliefs.known.excess_errors[near], doubt)
            margins = [self._margins(aim, off) for aim in AIMS]
            margins += [self._margins(AIM) + errors * off for errors in OFF]
            points += [improvement.expected(beliefs, main, one) for one in margins]
        taken = known[rows]
        for point in points:
            if self._space.apart(taken, point).min() > NEAR:
                taken = np.vstack([taken, point])
        fresh = choices(self._run, self._case.name, taken[len(rows) :])
        return distinct([*(self.designs.choices[row] for row in rows), *fresh])

    def _margins(self, aim: float, errors: Array | None = None) -> Array:
        """By how much the constraints are kept where a share of the allowed probability is taken, (constraints,); of other
        statistics by standard errors of the search, where these are known."""
        found, left = [], (1.0 - aim) / (1.0 - AIMS[-1])
        later = SHOWN * (self._size * REPLICATES / self._run.study.verification.most_samples) ** 0.5
        for k, one in enumerate(self._case.kept):
            if one.exact:
                found.append(0.0)
            elif one.statistic == "exceedance" and one.most > 0.0:
                found.append(of_share(aim * one.most) - of_share(one.most))
            else:
                least = SMALL * (1.0 - aim)
                found.append(least if errors is None else max(least, left * later * errors[k]))
        return np.array(found)

    def remarks(self) -> list[str]:
        """What may still be won, in words; nothing if the search ended by itself."""
        if self._idle == PATIENCE or not self._hope > 1.0:
            return []
        return [
            f"The search of {self._case.name} ended with its rounds while another design is expected to win {self._hope:.2g} "
            "times the accuracy requested; more study.verification.infill_rounds may still win."
        ]


def lengthened(run: StudyRun, asked: Sequence[tuple["CaseSearch", list[int]]]) -> None:
    """Twice the simulations of designs of several cases, and first ones of new designs."""
    where = [(one.designs, row) for one, rows in asked for row in rows]
    before = [one.made[row].shape[2] for one, row in where]
    for length in sorted(set(before)):
        alike = [at for at, own in zip(where, before, strict=True) if own == length]
        chosen = [one.choices[row] for one, row in alike]
        fresh = truth.drawn(run, chosen, "search", length or FIRST, length)
        for (one, row), values in zip(alike, fresh, strict=True):
            one.take(row, values)
