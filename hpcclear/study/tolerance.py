"""Whether the tolerance that a pilot chose is good enough for alpha and beta, before all else is verified at it.

The pilot tells what tolerances do to other designs than these, and the least deviation has the largest relative errors. So
verification begins with as many simulations of each design as show which are the ends; these are finished first, and pairs
of their own points at a tighter tolerance tell the bias. If it is too large, all goes on at the next tolerance.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.scene.stages import SCRAMBLINGS
from hpcclear.statistics.random.allocation import FALL, Evidence, biases
from hpcclear.study import truth, verification
from hpcclear.study.budget import Budget, reach_of
from hpcclear.study.optimisation import Choice
from hpcclear.study.pilot import LADDER, PAIRS
from hpcclear.study.run import Result, StudyRun
from hpcclear.study.verification import Table

APART, NEAREST = 2, len(LADDER) - 1
"""Rungs to the tolerance that one is measured against, if there are so many, and the loosest that any is: what is nearer leaves
most of a bias."""

HIDDEN = 0.25
"""Standard error of a bias of alpha or beta, over the accuracy, that is small enough."""

FIRST = 4
"""Pairs are made of one in so many of a design's points at first: where few motions go another way, fewer may miss them all."""

SURELY = 3.0
"""Standard errors by which a bias is beyond what is left to it, before it is believed at once: it is asked several times."""


def verified(
    run: StudyRun, wanted: Array, made: Budget, designs: Sequence[Choice]
) -> tuple[StudyRun, Budget, Result, Table]:
    """The stage of verification, at the loosest tolerance from the split's on that is good enough for alpha and beta; at the
    tightest if none is. `wanted`: the accuracy asked, shape (2,)."""
    true = run.stage("verification", _verify, wanted, made, designs)
    rung, ends = int(true.pop("rung")), true.pop("ends")
    before, rtol = made.split, float(made.found.rtol[rung])
    spent = made.pilot + float(true.pop("pairs_evaluations"))
    made = replace(made, split=replace(before, rung=rung, rtol=rtol), pilot=spent, ends=ends)
    if rung != before.rung:
        run.tell(
            f"Pairs on alpha and beta show that rtol {before.rtol:.0e} takes more of their accuracy than the samples leave: "
            f"designs are verified at {rtol:.0e}."
        )
    run = run.of(run.scene.with_({"numerics.rtol": rtol}))
    return run, made, true, verification.named(run, designs, true)


def _verify(run: StudyRun, wanted: Array, made: Budget, designs: Sequence[Choice]) -> Result:
    """What `truth.simulate` returns; ``rung``, what its tolerance takes of the ends at worst (2,), evaluations of pairs."""
    ladder = Ladder(run, made.found, designs)
    rung, last = made.split.rung, len(made.found.rtol) - 1
    taken: dict[int, Array] = {}
    while True:
        ladder.begin(rung)
        true = ladder.told(rung)
        fresh = sorted(set(_ends(run, designs, true)) - set(taken))
        if not fresh:
            if ladder.finish(rung, range(len(designs))):
                continue  # other designs may be the ends
            worst = np.max(list(taken.values()), axis=0, initial=0.0)
            spent = np.asarray(ladder.spent)
            return true | {"rung": np.asarray(rung), "ends": worst, "pairs_evaluations": spent}
        ladder.finish(rung, fresh)
        # what samples leave, at least the split's share: where `most_samples` ended them no tolerance makes up for it
        reach = reach_of(ladder.told(rung))[fresh]
        left = np.sqrt(np.fmax(wanted**2 - reach**2, np.fmin(made.split.tolerance, wanted) ** 2))
        against = max(min(rung, last - 1), 0)
        tight = min(max(against + APART, NEAREST), last)
        bias, error = ladder.bias(against, tight, fresh, left, wanted)
        if rung == last:
            bias, error = FALL * bias, FALL * error
        # what chance may have made counts no more: a needless tolerance is dear
        known = np.nan_to_num(np.sqrt(np.maximum(bias**2 - error**2, 0.0)))
        if rung < last and not (known <= left).all():
            rung, taken = rung + 1, {}
            continue
        taken |= dict(zip(fresh, known, strict=True))


def _ends(run: StudyRun, designs: Sequence[Choice], true: Result) -> list[int]:
    """Rows of the designs that are the ends of their cases, by what is known."""
    table = verification.named(run, designs, true)
    named = zip(table.choices, table.rows, strict=True)
    return [row for one, row in named if one.name in run.study.case(one.case).ends]


class Ladder:
    """Simulations of designs at several tolerances, the same points at each.

    Parameters
    ----------
    run : StudyRun
    found : Evidence
        Of a pilot: its tolerances, and what a simulation takes at each.
    designs : sequence of Choice

    Attributes
    ----------
    spent : float
        Evaluations of the equations of motion that went into pairs, as many as the pilot's designs take.
    """

    def __init__(self, run: StudyRun, found: Evidence, designs: Sequence[Choice]) -> None:
        self._run, self._designs, self.spent = run, designs, 0.0
        self._rtol, self._evaluations = found.rtol, found.evaluations
        self._scenes = [run.scene.with_({"numerics.rtol": float(one)}) for one in found.rtol]
        self._made = [[np.empty((2, SCRAMBLINGS, 0))] * len(designs) for _ in found.rtol]

    def begin(self, rung: int) -> None:
        """As many points of each design as accuracy is judged from."""
        length = truth.first_length(self._run.study.verification)
        self._lengthen(rung, range(len(self._designs)), length, "verification")

    def finish(self, rung: int, rows: Sequence[int]) -> bool:
        """Double designs until they are accurate; whether there was anything to do."""
        settings, made = self._run.study.verification, self._made[rung]
        before = [made[k] for k in rows]
        few = [self._designs[k] for k in rows]
        with self._at(rung) as run:
            first = truth.first_length(settings)
            after = truth.doubled(
                run, few, "verification", "verification", first, settings.most_samples, before
            )
        for k, one in zip(rows, after, strict=True):
            made[k] = one
        return any(a.size > b.size for a, b in zip(after, before, strict=True))

    def told(self, rung: int) -> Result:
        """What is known of all designs at a tolerance."""
        return truth.told_of(self._run, self._designs, self._made[rung])

    def bias(
        self, rung: int, against: int, rows: Sequence[int], left: Array, wanted: Array
    ) -> tuple[Array, Array]:
        """Relative biases of mean and deviation of some designs, and their standard errors, (rows, 2) each.

        By as few pairs as tell whether they are more than what is `left` to them, or chance hides no more than a part of the
        accuracy; at most by as many as a design has.
        """
        found = np.zeros((2, len(rows), 2))
        lengths = [self._made[rung][k].shape[2] for k in rows]
        length, open_ = max(min(lengths) // FIRST, PAIRS), list(range(len(rows)))
        while open_:
            few = [rows[k] for k in open_]
            self._lengthen(rung, few, length, "verification")
            self._lengthen(against, few, length, "pairs")
            values = [[self._made[one][k][0][:, :length] for k in few] for one in (rung, against)]
            found[:, open_] = np.array(biases(self._rtol[[rung, against]], np.array(values)))[:, 0]
            bias, error = abs(found[0]), found[1]
            told = (bias + 2.0 * error <= left).all(axis=1) | (bias - SURELY * error > left).any(
                axis=1
            )
            told |= (error <= HIDDEN * wanted).all(axis=1)
            length *= 2
            open_ = [k for k in open_ if not told[k] and length <= lengths[k]]
        return found[0], found[1]

    def _lengthen(self, rung: int, rows: Sequence[int], length: int, stage: str) -> None:
        """At least so many points of each scrambling of some designs."""
        made = self._made[rung]
        lengths = {k: made[k].shape[2] for k in rows if made[k].shape[2] < length}
        for short in sorted(set(lengths.values())):
            few = [k for k, one in lengths.items() if one == short]
            with self._at(rung) as run:
                truth.lengthen(run, self._designs, made, few, stage, "verification", length - short)
            if stage == "pairs":
                self.spent += (
                    len(few) * SCRAMBLINGS * (length - short) * float(self._evaluations[rung])
                )

    @contextmanager
    def _at(self, rung: int) -> Iterator[StudyRun]:
        """The run at a tolerance; what follows is numbered on."""
        run = self._run.of(self._scenes[rung])
        yield run
        self._run.simulations.next = run.simulations.next
