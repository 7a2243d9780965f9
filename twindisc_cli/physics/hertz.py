"""Hertz contact of two smooth bodies: an elliptic patch.

    gap(x, y) = (curvature_x x^2 + curvature_y y^2) / 2
    p(x, y)   = p0 sqrt(1 - x^2/a^2 - y^2/b^2),      p0 = 3 N / (2 pi a b)
    curvature_x = N R_D(0, b^2, a^2) / (pi E*),      curvature_y = N R_D(0, a^2, b^2) / (pi E*)
    approach  = 3 N R_F(0, a^2, b^2) / (2 pi E*)

    a, b      semi-axes along rolling (x) and across it (y) [m]; either may be the longer
    R_D, R_F  Carlson's elliptic integrals, which need no case for the round or the slender ellipse

Source: K. L. Johnson, Contact Mechanics (1985), section 4.2; its elliptic integrals in Carlson's form (DLMF 19.25).
Valid for: a patch small against the radii, elastic, frictionless or of equal materials.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import elliprd, elliprf

from twindisc_cli.physics._arrays import Floats, together

_SECANT_STEPS = 12  # the logarithm of the curvature ratio is nearly linear: six steps reach 1e-15, twelve the extremes

_FARTHEST = 708.0  # the largest logarithm of which a number and its reciprocal exist


@dataclass(frozen=True)
class Ellipse:
    """A Hertzian patch: semi-axes a (rolling) and b [m], peak pressure p0 [Pa], approach [m], all of one shape."""

    a: Floats
    b: Floats
    p0: Floats
    approach: Floats

    @property
    def area(self) -> Floats:
        """Area of the patch [m2]."""
        return np.pi * self.a * self.b


def contact_ellipse(
    *, curvature_x: ArrayLike, curvature_y: ArrayLike, normal_load: ArrayLike, effective_modulus: ArrayLike
) -> Ellipse:
    """The elliptic patch under `normal_load` [N] for relative principal curvatures [1/m] and E* [Pa]; all broadcast.

    A curvature_y of exactly zero is the limit of a load spread over an endless line: a = 0, b = inf, p0 = 0.
    """
    cx, cy, load, modulus = together(curvature_x, curvature_y, normal_load, effective_modulus)
    endless = cy == 0.0
    squared_ratio = _squared_axis_ratio(cx / np.where(endless, cx, cy))
    a = np.cbrt(load / modulus * elliprd(0.0, squared_ratio, 1.0) / (np.pi * cx))
    b = a * np.sqrt(squared_ratio)
    with np.errstate(divide="ignore", invalid="ignore"):
        p0 = 1.5 * load / (np.pi * a * b)
        approach = 1.5 * load / modulus * elliprf(0.0, squared_ratio, 1.0) / (np.pi * a)
    return Ellipse(
        a=np.where(endless, 0.0, a),
        b=np.where(endless, np.inf, b),
        p0=np.where(endless, 0.0, p0),
        approach=np.where(endless, 0.0, approach),
    )


def _squared_axis_ratio(curvature_ratio: Floats) -> Floats:
    """(b/a)^2 that makes the curvature ratio curvature_x/curvature_y, by secant steps in the logarithms."""
    target = np.log(curvature_ratio)
    old, new = 0.9 * target, np.clip(target * 4.0 / 3.0, -_FARTHEST, _FARTHEST)
    old_miss = _log_curvature_ratio(old) - target
    for _ in range(_SECANT_STEPS):
        miss = _log_curvature_ratio(new) - target
        change = miss - old_miss
        settled = np.abs(change) <= 1e-300
        step = -miss * (new - old) / np.where(settled, 1.0, change)
        old, old_miss = new, miss
        new = np.where(settled | (miss == 0.0), new, np.clip(new + step, -_FARTHEST, _FARTHEST))
        if np.all(np.abs(step) <= 4e-16 * np.maximum(1.0, np.abs(new))):
            break
    return np.exp(new)


def _log_curvature_ratio(log_squared_ratio: Floats) -> Floats:
    """The logarithm of curvature_x/curvature_y for the logarithm of (b/a)^2."""
    q = np.exp(log_squared_ratio)
    return np.log(elliprd(0.0, q, 1.0)) - np.log(elliprd(0.0, 1.0 / q, 1.0)) + 1.5 * log_squared_ratio
