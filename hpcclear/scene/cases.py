"""Cases: what is random in an optimisation, what is made small, and what designs must keep to."""

from hpcclear.base.objectives import ENDS
from hpcclear.scene.fields import Table, invalid
from hpcclear.scene.goals import DEVIATION, MEAN, Constraint, Goal
from hpcclear.scene.named import NAME


class Case(Table):
    """One optimisation, with the random inputs that vary in it."""

    name: str
    random: tuple[str, ...]
    """Names of the inputs in `[study.random]` that are random. All others have the value of the design."""
    objectives: tuple[Goal, ...] | None = None
    """Objectives to minimise, one to five; default "mean" and "deviation" of f. The name of a statistic alone suffices
    if it needs no further entry."""
    constraints: tuple[Constraint, ...] | None = None
    """Constraints on the designs of the case."""

    def _check(self) -> None:
        if not NAME.fullmatch(self.name):  # it stands in names of files, figures and pages
            raise invalid("is not a name", "Use a letter, then letters, digits or _", key="name")
        if not self.random:
            raise invalid(
                "a case without random inputs has no standard deviation to minimise",
                "Name some",
                "random",
            )
        if len(set(self.random)) < len(self.random):
            raise invalid("a random input is named twice", "Remove one", key="random")
        rows = self.goals
        if not rows:
            raise invalid(
                "a case needs an objective",
                'Add one, such as "mean" or { formula = "m2 + m3" }',
                "objectives",
            )
        if len(rows) > len(ENDS):
            raise invalid(
                f"with more than {len(ENDS)} objectives nearly every design is on the front",
                "Use constraints for some of them, or combine some in one formula",
                "objectives",
            )
        for k, goal in enumerate(rows):
            if any(goal.same_as(other) for other in rows[:k]):
                raise invalid(
                    "is an objective already",
                    "Remove it, or name another objective",
                    f"objectives.{k}",
                    goal.formula or goal.statistic,
                )

    @property
    def goals(self) -> tuple[Goal, ...]:
        """The things that are made small."""
        return (MEAN, DEVIATION) if self.objectives is None else self.objectives

    @property
    def ends(self) -> tuple[str, ...]:
        """Names of the designs with the least of each: alpha of the first, beta of the second, and so on."""
        return tuple(f"{self.name} {end}" for end in ENDS[: len(self.goals)])

    @property
    def kept(self) -> tuple[Constraint, ...]:
        """What designs must keep to."""
        return self.constraints or ()

    @property
    def plain(self) -> bool:
        """Whether mean and standard deviation are the only objectives."""
        return self.goals == (MEAN, DEVIATION) and not self.kept
