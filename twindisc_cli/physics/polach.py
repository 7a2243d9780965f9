"""Polach's creep curve with separate slopes in the areas of adhesion and of slip, as a correction of another law.

    T/(mu N) = f(xi) p(e, r e) / p(e, e),   p(e_A, e_S) = (2 / pi) [e_A / (1 + e_A^2) + arctan(e_S)],   e = pi xi / 4

    f    creep curve of the declared theory, xi its normalised creepage
    e    gradient of the tangential stress in the area of adhesion
    r    slope in the area of slip over that in the area of adhesion, k_S / k_A [1]; f is left as it is by r = 1

Source: O. Polach, Wear 258 (2005) 992-1000, Eqs. 8 and 14.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def correction(xi: Floats, slip_slope: Floats) -> Floats:
    """p(e, r e) / p(e, e) at normalised creepages xi > 0 and ratios r of the slopes, broadcast."""
    gradient = 0.25 * np.pi * xi
    adhesion = gradient / (1.0 + gradient**2)
    return np.asarray((adhesion + np.arctan(slip_slope * gradient)) / (adhesion + np.arctan(gradient)))
