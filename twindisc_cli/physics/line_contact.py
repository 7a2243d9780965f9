"""Contact of two straight discs along a line: Hertz's pressure, and rolling by Carter and by FASTSIM's strips.

    p(x) = p0 sqrt(1 - x^2/a^2),    a = sqrt(4 q / (pi E* kappa)),    p0 = E* kappa a / 2

    T/(mu N) = 1 - (1 - k)^n,    k = min(1, xi / n),    xi = |linear force| / (mu N) = G a b C11 |v| / (mu N)
    C11 = pi / (1 - nu),    C22 = pi

    q      load per length [N/m];   kappa  relative curvature along rolling [1/m];   G, nu  combined, of Eq. 7
    a, b   half-length of the patch along rolling, half of its width [m];   v  creepage [1]
    n      2: Carter's exact theory;  3: FASTSIM, with a parabolic bound.  The leading 1 - k of the length sticks

Carter's traction is one ellipse minus another, and his slip w follows from their strains:

    t(x) = mu p0 [sqrt(1 - (x/a)^2) - sqrt((1 - k)^2 - (x/a - k)^2)]    w = V mu kappa sqrt((x - k a)^2 - (1 - k)^2 a^2)

The second root of t stands where the patch sticks, the root of w where it slips; in full sliding it is
w = V (|v| - mu kappa x). FASTSIM's slip is V (v - L dt/ds) as in `fastsim`, 1/L = G C11 b / a per width, s = a - x.

Source: K. L. Johnson, Contact Mechanics (1985), sections 4.2(c) and 8.3; F. W. Carter, Proc. Royal Society A 112
(1926) 151; the strips as in `fastsim`, integrated.
Valid for: discs long against the patch, the ends left out; quasi-identical bodies. C22 is that of the plane theory.
Where the axes tilt, each strip has its own creepage v - phi y, under an even load across the width.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from twindisc_cli.physics._arrays import Floats, together

Theory = Literal["exact", "fastsim"]
ORDER: dict[Theory, int] = {"exact": 2, "fastsim": 3}
"""Normalised creepage above which no point of the patch sticks: n above."""


_AT, _WEIGHTS = np.polynomial.legendre.leggauss(32)
PLACES, SHARES = tuple(_AT.tolist()), tuple((0.5 * _WEIGHTS).tolist())
"""Places y/b over the width at which strips are asked for, and the share of the width that each stands for; the mean of
Carter's law over creepages of both signs is met within 2e-4."""


@dataclass(frozen=True)
class Strip:
    """A line contact: half-length a along rolling, half-width b [m] and peak pressure p0 [Pa]."""

    a: Floats
    b: Floats
    p0: Floats

    @property
    def area(self) -> Floats:
        """Area of the patch [m2]."""
        return 4.0 * self.a * self.b


@dataclass(frozen=True)
class Traction:
    """Traction [Pa], its bound mu p [Pa] and the sliding velocity [m/s] at x [m], each (x,), and where it sticks."""

    x: Floats
    traction: Floats
    bound: Floats
    slip: Floats

    @property
    def sticks(self) -> NDArray[np.bool_]:
        """Where the surfaces do not slide."""
        return np.asarray(self.slip == 0.0)


def line_contact(
    *, curvature: ArrayLike, normal_load: ArrayLike, width: ArrayLike, effective_modulus: ArrayLike
) -> Strip:
    """The line contact of a width [m] under `normal_load` [N]; all broadcast."""
    sharp, load, width, modulus = together(curvature, normal_load, width, effective_modulus)
    a = np.sqrt(4.0 * load / width / modulus / (np.pi * sharp))
    return Strip(a=a, b=0.5 * width, p0=0.5 * modulus * (sharp * a))


def coefficients(poisson: float) -> tuple[float, float]:
    """C11 and C22 [1]."""
    return np.pi / (1.0 - poisson), np.pi


def saturation(xi: ArrayLike, theory: Theory) -> Floats:
    """T/(mu N) [1] at the normalised creepage xi [1] of any shape."""
    n = ORDER[theory]
    return 1.0 - (1.0 - np.minimum(np.asarray(xi, dtype=float) / n, 1.0)) ** n


def unsaturation(fraction: ArrayLike, theory: Theory) -> Floats:
    """The smallest xi [1] at which T/(mu N) is `fraction`, 0 ... 1, NaN beyond: the inverse of `saturation`."""
    n = ORDER[theory]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(-n * np.expm1(np.log1p(-np.asarray(fraction, dtype=float)) / n))


def stick_fraction(xi: ArrayLike, theory: Theory) -> Floats:
    """Share of the patch that sticks [1]."""
    return 1.0 - np.minimum(np.asarray(xi, dtype=float) / ORDER[theory], 1.0)


def along_the_patch(
    x: Floats, *, a: float, bound: float, stiffness: float, creepage: float, theory: Theory
) -> Traction:
    """Traction and sliding velocity over the speed [1] at x [m], -a ... a, leading edge at +a, for creepage >= 0.

    bound: mu N over the width [N/m]; stiffness: linear force over creepage and width [N/m].
    """
    at, n = x / a, ORDER[theory]
    full = n * bound / stiffness  # the creepage from which on all of the patch slides
    k = min(creepage / full, 1.0)
    if theory == "fastsim":
        limit, driven = 0.75 * bound / a * (1.0 - at**2), 0.5 * stiffness * creepage * (1.0 - at) / a
        return Traction(x, np.minimum(driven, limit), limit, np.where(driven > limit, creepage - full * at, 0.0))
    peak = 2.0 * bound / (np.pi * a)
    limit = peak * np.sqrt(np.maximum(1.0 - at**2, 0.0))
    inner = (1.0 - k) ** 2 - (at - k) ** 2
    slip = creepage - full * at if k == 1.0 else full * np.sqrt(np.maximum(-inner, 0.0))
    return Traction(x, limit - peak * np.sqrt(np.maximum(inner, 0.0)), limit, slip)
