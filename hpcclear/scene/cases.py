"""Cases: what is random in an optimisation, what is made small, and what designs must keep to."""

from pydantic import model_validator

from hpcclear.scene.fields import Table, invalid
from hpcclear.scene.goals import DEVIATION, MEAN, Constraint, Goal
from hpcclear.scene.variables import NAME


class Case(Table):
    """One optimisation: which of the random inputs are random in it."""

    name: str
    random: tuple[str, ...]
    """Names of `[study.random]`; what is left out has its design's value."""
    objectives: tuple[Goal, Goal] | None = None
    """The two things that are made small; default "mean" and "deviation" of f. A word stands for a statistic without
    further entries."""
    constraints: tuple[Constraint, ...] | None = None
    """What its designs must keep to."""

    @model_validator(mode="after")
    def _named(self) -> "Case":
        if not NAME.fullmatch(self.name):  # it stands in names of files, figures and pages
            raise invalid("is not a name", "Use a letter, then letters, digits or _", key="name")
        return self

    @model_validator(mode="after")
    def _some_random(self) -> "Case":
        if not self.random:
            raise invalid(
                "a case without random inputs has no deviation to minimise", "Name some", "random"
            )
        if len(set(self.random)) < len(self.random):
            raise invalid("a random input is named twice", "Remove one", key="random")
        return self

    @property
    def goals(self) -> tuple[Goal, Goal]:
        """The two things that are made small."""
        return (MEAN, DEVIATION) if self.objectives is None else self.objectives

    @property
    def kept(self) -> tuple[Constraint, ...]:
        """What designs must keep to."""
        return self.constraints or ()

    @property
    def plain(self) -> bool:
        """Whether mean and deviation alone are asked for."""
        return self.goals == (MEAN, DEVIATION) and not self.kept
