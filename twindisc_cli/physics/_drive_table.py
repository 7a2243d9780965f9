"""What the tables over a drive share: axes of the ratio a/b and of the drive's size, and corrections for nu.

    rho = r / (r + 2.5),    r  size of the drive [1]

Linear theory is at rho = 0, full slip at rho = 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.polynomial import chebyshev

from twindisc_cli.physics._arrays import Floats

POISSON = (0.0, 0.3, 0.5)
"""Poisson's ratios of the tables: the middle one is in full, the others as differences from it."""
HALF_WAY = 2.5
"""Drive at rho = 1/2 [1], near which slip spreads over the patch: full slip of an ellipse begins at 3 to 4."""


@dataclass(frozen=True)
class Nodes:
    """Nodes of a table: Chebyshev's in log(a/b), uniform in rho; a subclass adds those of its angles."""

    ratio_range: tuple[float, float]
    ratio_count: int
    rho_count: int

    @cached_property
    def unit(self) -> Floats:
        """-1 ... 1 for log(a/b)."""
        return np.asarray(chebyshev.chebpts2(self.ratio_count))

    @cached_property
    def ratios(self) -> Floats:
        """Ratios a/b [1]."""
        low, high = np.log(self.ratio_range)
        return np.asarray(np.exp(low + 0.5 * (self.unit + 1.0) * (high - low)))

    @cached_property
    def rho(self) -> Floats:
        """r / (r + 2.5) [1]."""
        return np.linspace(0.0, 1.0, self.rho_count)

    @cached_property
    def sizes(self) -> Floats:
        """Drives r; the last is infinite."""
        with np.errstate(divide="ignore"):
            return HALF_WAY * self.rho / (1.0 - self.rho)


def place_of_ratio(ratio: Floats, ratio_range: tuple[float, float]) -> Floats:
    """0 ... 1 for log(a/b) over the range of a table; beyond it the end."""
    low, high = np.log(ratio_range)
    return np.asarray((np.log(np.clip(ratio, *ratio_range)) - low) / (high - low))


def place_of_size(size: Floats) -> Floats:
    """rho [1] of drives r."""
    return size / (size + HALF_WAY)


def away_from_middle(differences: Floats, poisson: float) -> Floats:
    """What a nu adds to the table of the middle one: the parabola through its differences (2, ...) at the others."""
    low, middle, high = POISSON
    of_low = (poisson - middle) * (poisson - high) / ((low - middle) * (low - high))
    of_high = (poisson - low) * (poisson - middle) / ((high - low) * (high - middle))
    return np.asarray(of_low * differences[0] + of_high * differences[1])
