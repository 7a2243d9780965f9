"""Inputs that may be off within their tolerances, marginalised out of the white residuals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from twindisc_cli.model.experiment import Floats


@dataclass(frozen=True)
class Nuisances:
    """What tolerances of the inputs could change: one column each (sample, nuisance), whitened.

    names: the inputs (nuisance,); columns: what base parameters cannot absorb; absorbed: what they can, and by which
    the tolerances move them.
    """

    names: Sequence[str]
    columns: Floats
    absorbed: Floats

    @cached_property
    def _directions(self) -> tuple[Floats, Floats, Floats]:
        """Directions of the nuisances (sample, direction), their lengths, and the nuisances of each of unit length."""
        return np.linalg.svd(self.columns, full_matrices=False)

    def discounted(self, rows: Floats) -> Floats:
        """White rows (..., sample) shrunk along the nuisances: (1 + D D')^(-1/2)."""
        left, size, _ = self._directions
        shrink = 1.0 / np.sqrt(1.0 + size**2) - 1.0
        return np.asarray(rows + ((rows @ left) * shrink) @ left.T)

    @property
    def volume(self) -> float:
        """Half the logarithm of the determinant of 1 + D'D."""
        return 0.5 * float(np.sum(np.log1p(self._directions[1] ** 2)))

    def off(self, residual: Floats) -> Floats:
        """How far the inputs are most probably off, in their tolerances [1] (nuisance,), by a discounted residual.

        The posterior mean of a linear Gaussian model, D' (1 + D D')^-1 r, r the white residual before the discount.
        """
        left, size, right = self._directions
        return np.asarray((size / np.sqrt(1.0 + size**2) * (residual @ left)) @ right)
