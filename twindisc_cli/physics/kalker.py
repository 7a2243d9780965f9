"""Kalker's creepage coefficients of an elliptic contact, from a shipped table of Chebyshev coefficients.

Linear theory (Eq. 9), all of the patch sticking, c = sqrt(a b):

    T_x = c^2 G C11 vx        T_y = c^2 G C22 vy + c^3 G C23 phi        M_z = c^3 G C23 vy - c^4 G C33 phi

in magnitude (signs of forces and creepages follow the program that uses them); C32 = C23.

    a/b   semi-axis along rolling over semi-axis across, up to 20
    nu    combined Poisson ratio of Eq. 7, 0 ... 0.5

The table ends at a/b = g0 = 0.05. A patch more slender nears a line contact, and C its known limit:

    C = C_limit(g) [1 + (C(g0)/C_limit(g0) - 1) (g/g0)^(3/2)],    g = a/b,    L = ln(16/g^2)
    C11 = pi^2 / (4 (1 - nu))     C23 = pi sqrt(g) / (3 (1 - nu)) [1 + nu (L/2 + ln 4 - 5)]
    C22 = pi^2 / 4                C33 = pi^2 / (16 (1 - nu) g)

Source: J. J. Kalker, "Three-Dimensional Elastic Bodies in Rolling Contact" (1990), Table E.3 gives a few values and
the limits; those shipped here are exact to 4e-4 at worst (table_makers/rolling.py), below the table to
1e-3 (C11, C22) and 5e-3 (C23, C33).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike, NDArray

from twindisc_cli.physics._arrays import stored
from twindisc_cli.physics.half_space import OutOfRangeError

Floats = NDArray[np.float64]

RATIO_RANGE = (0.05, 20.0)
"""Ratios a/b of the tables; those below follow by the limit of the line contact."""
POISSON_RANGE = (0.0, 0.5)  # of isotropic solids that do not widen when pulled


@dataclass(frozen=True)
class Coefficients:
    """C11 (longitudinal), C22 (lateral), C23 = C32 (coupling of lateral and spin), C33 (spin) [1], all of one shape."""

    c11: Floats
    c22: Floats
    c23: Floats
    c33: Floats


def coefficients(a_over_b: ArrayLike, poisson: ArrayLike) -> Coefficients:
    """Creepage coefficients at a/b [1] and the combined Poisson ratio [1]; the two broadcast.

    Raises OutOfRangeError outside 0 < a/b <= 20 and 0 <= nu <= 0.5.
    """
    ratio, nu = np.broadcast_arrays(np.asarray(a_over_b, dtype=float), np.asarray(poisson, dtype=float))
    require_ratio(ratio)
    require("Poisson's ratio", nu, POISSON_RANGE)
    inside = np.maximum(ratio, RATIO_RANGE[0])
    values = np.exp(chebyshev.chebval2d(*_to_unit_square(inside, nu), _table()))
    if np.any(ratio < inside):
        misses = values / _line_limit(inside, nu) - 1.0
        values = np.where(ratio < inside, _line_limit(ratio, nu) * (1.0 + misses * (ratio / inside) ** 1.5), values)
    return Coefficients(*values)


def _line_limit(ratio: Floats, nu: Floats) -> Floats:
    """C11, C22, C23 and C33 as a/b goes to 0, (4, ...)."""
    quarter = np.pi**2 / 4.0 * np.ones_like(ratio)
    slender = 0.5 * np.log(16.0 / ratio**2) + np.log(4.0) - 5.0
    c23 = np.pi * np.sqrt(ratio) / 3.0 * (1.0 + nu * slender) / (1.0 - nu)
    return np.stack([quarter / (1.0 - nu), quarter, c23, quarter / (4.0 * (1.0 - nu) * ratio)])


def _to_unit_square(ratio: Floats, nu: Floats) -> tuple[Floats, Floats]:
    """Map log(a/b) and nu to -1 ... 1, where the Chebyshev polynomials live."""
    low, high = np.log(RATIO_RANGE)
    return 2.0 * (np.log(ratio) - low) / (high - low) - 1.0, 4.0 * nu - 1.0


def require_ratio(ratio: Floats) -> None:
    """Raise OutOfRangeError unless every a/b lies within the tables or, positive, below them (a NaN does not)."""
    wrong = ratio[~((ratio > 0.0) & (ratio <= RATIO_RANGE[1]))]
    if wrong.size:
        name = "a/b, the length of the patch along rolling over its width,"
        raise OutOfRangeError(f"{name} must lie in 0 ... {RATIO_RANGE[1]:g}, got {wrong.flat[0]:g}")


def require(name: str, values: Floats, bounds: tuple[float, float]) -> None:
    """Raise OutOfRangeError unless every value lies within the bounds (a NaN does not)."""
    low, high = bounds
    wrong = values[~((values >= low) & (values <= high))]
    if wrong.size:
        raise OutOfRangeError(f"{name} must lie in {low:g} ... {high:g}, got {wrong.flat[0]:g}")


@cache
def _table() -> Floats:
    """Chebyshev coefficients of log C over (log a/b, nu), (degree a/b, degree nu, 4)."""
    return stored("twindisc_cli.physics", "kalker.npz")["chebyshev"]
