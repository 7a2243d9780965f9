"""Kalker's creepage coefficients of an elliptic contact, from a shipped table of Chebyshev coefficients.

Linear theory (Eq. 9), all of the patch sticking, c = sqrt(a b):

    T_x = c^2 G C11 vx        T_y = c^2 G C22 vy + c^3 G C23 phi        M_z = c^3 G C23 vy - c^4 G C33 phi

in magnitude (signs of forces and creepages follow the program that uses them); C32 = C23.

    a/b   semi-axis along rolling over semi-axis across, 0.05 ... 20
    nu    combined Poisson ratio of Eq. 7, 0 ... 0.5

Source: J. J. Kalker, "Three-Dimensional Elastic Bodies in Rolling Contact" (1990), Table E.3 gives a few values;
those shipped here are exact to 4e-4 at worst (make_tables.py says how they were made).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

RATIO_RANGE = (0.05, 20.0)
POISSON_RANGE = (0.0, 0.5)


@dataclass(frozen=True)
class Coefficients:
    """C11 (longitudinal), C22 (lateral), C23 = C32 (coupling of lateral and spin), C33 (spin) [1], all of one shape."""

    c11: Floats
    c22: Floats
    c23: Floats
    c33: Floats


def coefficients(a_over_b: ArrayLike, poisson: ArrayLike) -> Coefficients:
    """Creepage coefficients at a/b [1] and the combined Poisson ratio [1]; the two broadcast.

    Raises ValueError outside 0.05 <= a/b <= 20 and 0 <= nu <= 0.5.
    """
    ratio, nu = np.broadcast_arrays(np.asarray(a_over_b, dtype=float), np.asarray(poisson, dtype=float))
    require("a/b", ratio, RATIO_RANGE)
    require("Poisson's ratio", nu, POISSON_RANGE)
    values = np.exp(chebyshev.chebval2d(*_to_unit_square(ratio, nu), _table()))
    return Coefficients(*values)


def _to_unit_square(ratio: Floats, nu: Floats) -> tuple[Floats, Floats]:
    """Map log(a/b) and nu to -1 ... 1, where the Chebyshev polynomials live."""
    low, high = np.log(RATIO_RANGE)
    return 2.0 * (np.log(ratio) - low) / (high - low) - 1.0, 4.0 * nu - 1.0


def require(name: str, values: Floats, bounds: tuple[float, float]) -> None:
    """Raise ValueError unless every value lies within the bounds (a NaN does not)."""
    low, high = bounds
    if not np.all((values >= low) & (values <= high)):
        raise ValueError(f"{name} must lie in {low:g} ... {high:g}, got {values}")


@cache
def _table() -> Floats:
    """Chebyshev coefficients of log C over (log a/b, nu), (degree a/b, degree nu, 4)."""
    with (files("twindisc_cli.physics") / "kalker.npz").open("rb") as stream, np.load(stream) as data:
        table: Floats = data["chebyshev"]
    return table
