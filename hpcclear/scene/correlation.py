"""Random inputs that vary together: a Gaussian copula, by the correlation matrix in the scene.

Each input keeps its own distribution; what is correlated are the standard normals whose probabilities are its own.

Sources: R. B. Nelsen, "An Introduction to Copulas" (2006); for ranks K. Pearson, "On further methods of determining
correlation" (1907): rho = 6/pi asin(r/2).
"""

from collections.abc import Sequence
from typing import Annotated, Literal

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.scene.fields import Quantity, Table, invalid

Entry = Annotated[float, Quantity("", least=-1, most=1)]

LEAST_EIGENVALUE = 1e-10
"""Of a matrix that can be factored with digits to spare."""


class Correlation(Table):
    """Correlation of random inputs. Inputs that it does not name are independent."""

    inputs: tuple[str, ...]
    """Random inputs in the order of the rows of the matrix."""
    matrix: tuple[tuple[Entry, ...], ...]
    """Correlations, symmetric with ones along the diagonal."""
    measure: Literal["normal", "rank"] = "normal"
    """Meaning of the matrix. "normal": correlations of the underlying normal variables (of the inputs themselves, if these are
    normal). "rank": Spearman rank correlations of the inputs."""

    def _check(self) -> None:
        count = len(self.inputs)
        if count < 2 or len(set(self.inputs)) < count:
            raise invalid("two or more different inputs are expected", "Name them", "inputs")
        if len(self.matrix) != count or any(len(row) != count for row in self.matrix):
            reason = f"{count} inputs need {count} rows of {count} numbers"
            raise invalid(reason, "Write a row for each input", "matrix")
        entries = np.array(self.matrix)
        if (entries != entries.T).any() or (entries.diagonal() != 1.0).any():
            reason = "a correlation matrix is symmetric, with ones along its diagonal"
            raise invalid(reason, "Correct the entries that differ", "matrix")
        for row, column in np.argwhere(abs(np.triu(entries, 1)) == 1.0):
            pair, entry = f"{self.inputs[row]} and {self.inputs[column]}", entries[row, column]
            reason = f"{pair} are correlated by {entry:g}: one of them determines the other"
            one = ", or, if both are always equal, one random input with the paths of both"
            raise invalid(reason, f"Write {0.99 * entry:g}{one if entry > 0 else ''}", "matrix")
        least = self._least(entries)
        if least < LEAST_EIGENVALUE:
            reason = f"the matrix is not positive definite: its lowest eigenvalue is {least:.2g}"
            shares = (k / 100 for k in range(99, 0, -1))
            share = next(one for one in shares if self._least(one * entries) > LEAST_EIGENVALUE)
            raise invalid(reason, f"Multiply all entries off the diagonal by {share:g}", "matrix")

    def _least(self, entries: Array) -> float:
        """Lowest eigenvalue of the correlations of normals by some entries off the diagonal."""
        return float(np.linalg.eigvalsh(self._of_normals(entries)).min())

    def normal(self, names: Sequence[str]) -> Array:
        """Correlations of the normals behind some of its inputs, shape (n, n)."""
        rows = [self.inputs.index(name) for name in names]
        return self._of_normals(np.array(self.matrix)[np.ix_(rows, rows)])

    def _of_normals(self, entries: Array) -> Array:
        found = entries if self.measure == "normal" else 2.0 * np.sin(np.pi / 6.0 * entries)
        return found - np.diag(found.diagonal() - 1.0)

    def groups(self, names: Sequence[str]) -> list[int]:
        """Return the number of the group of each of some inputs, from 1 on in their order; 0 of independent ones.

        Inputs are in one group where a chain of correlated inputs among them joins them.
        """
        own = [name for name in self.inputs if name in names]
        joined = np.array(self.matrix)[np.ix_(*2 * [[self.inputs.index(n) for n in own]])] != 0.0
        for _ in own:  # every step doubles the length of the chains
            joined = joined @ joined
        members = (frozenset(np.flatnonzero(row)) for row in joined)
        blocks = dict(zip(own, members, strict=True))
        several = [blocks[name] for name in names if len(blocks.get(name, ())) > 1]
        order = list(dict.fromkeys(several))
        return [order.index(blocks[n]) + 1 if blocks.get(n) in order else 0 for n in names]

    def together(self, names: Sequence[str], chances: Sequence[Array]) -> list[Array]:
        """Probabilities (n,) each, strictly between 0 and 1, that vary together, from independent ones; others stay what they
        were.

        The first input of the matrix that is among `names` keeps its own numbers, the next mixes them with its own, and so on.
        """
        from scipy.special import ndtr, ndtri  # as in `hpcclear.base.quantiles`

        own = [name for name in self.inputs if name in names]
        made = list(chances)
        if len(own) < 2:
            return made
        factor = np.linalg.cholesky(self.normal(own))
        normals = [ndtri(chances[list(names).index(name)]) for name in own]
        for row, name in enumerate(own[1:], 1):
            # sums in a fixed order: a product of matrices has other last bits for another number of rows
            mixed = factor[row, 0] * normals[0]
            for column in range(1, row + 1):
                mixed = mixed + factor[row, column] * normals[column]
            made[list(names).index(name)] = np.clip(ndtr(mixed), 2.0**-54, 1.0 - 2.0**-53)
        return made
