"""Flash temperature: how much hotter than the discs the rubbing patch itself is.

    fast   T = G q0 sqrt(a) / (sqrt(pi) e sqrt(V)),   maximum G = 2.18831, mean G = 1.19908
    slow   T = S q0 a b R_F(0, a^2, b^2) / (2 k),      maximum S = 1,       mean S = 3/4
    1/T^2 = 1/T_fast^2 + 1/T_slow^2          one disc that takes all the heat
    1/T   = 1/T_1 + 1/T_2                    two discs that share it and meet at one temperature

    Along a line (half-width b, the flux even over it) q0 = Q / (pi a b) and
    fast   mean G = 1.50849;    slow   T = q0 a [ln(4 b/a) + S] / (2 k),  maximum S = 1/2,  mean S = -0.14019,  b >> a

    q0 = 3 Q / (2 pi a b)   peak heat flux of the power Q [W], spread like the Hertzian pressure [W/m2]
    e = sqrt(k rho c)       effusivity;  k conductivity [W/(m K)], rho density [kg/m3], c specific heat [J/(kg K)]
    V                       speed of the surface through the patch, along the semi-axis a [m/s]

Fast, each strip along rolling heats as in Jaeger's band source, T(x) = integral of q / sqrt(x' - x) over the way
behind it; G is the largest value of that integral for a semi-ellipse, and its mean over the patch. Slow, the
temperature has the shape of the Hertzian displacement.

Source: H. Blok (1937); J. C. Jaeger, Proc. Royal Society of New South Wales 76 (1942) 203; the joining of both limits,
X. Tian and F. E. Kennedy, J. Tribology 116 (1994) 167, whose formula for the circle this is.
Valid for: full sliding, discs thick against the patch; the joining errs by a few per cent between the limits.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import elliprf

from twindisc_cli.physics._arrays import Floats, arrays

_FAST_MAXIMUM = 2.1883066738
_FAST_MEAN, _FAST_MEAN_OF_A_LINE = 1.1990761641, 1.5084944665
_SLOW_MEAN = 0.75
_SLOW_LINE_MAXIMUM, _SLOW_LINE_MEAN = 0.5, -0.1401861528
_STANDING = 1e-12
"""A surface speed [m/s] at which the slow limit holds."""


@dataclass(frozen=True)
class Flash:
    """Rise of the patch above the discs [K]: its hottest point and its mean."""

    maximum: Floats
    mean: Floats


def flash_temperature(
    *,
    power: ArrayLike,
    creepage: ArrayLike,
    a: ArrayLike,
    b: ArrayLike,
    speed: ArrayLike,
    conductivity: ArrayLike,
    density: ArrayLike,
    specific_heat: ArrayLike,
    line: bool = False,
) -> Flash:
    """The flash temperature of two discs of one material that dissipate `power` [W] in an elliptic patch, or a line's.

    The surfaces pass the patch (semi-axes a along rolling, b [m]) at speed (1 +- creepage/2) [m/s]; all broadcast.
    """
    power, creepage, a, b, speed = arrays(power, creepage, a, b, speed)
    conductivity, density, specific_heat = arrays(conductivity, density, specific_heat)
    peak_flux = (1.0 if line else 1.5) * power / (np.pi * a * b)
    per_length = 0.5 * peak_flux * a / conductivity
    fast_mean = _FAST_MEAN_OF_A_LINE if line else _FAST_MEAN
    if line:
        slow, slow_mean = (per_length * (np.log(4.0 * b / a) + s) for s in (_SLOW_LINE_MAXIMUM, _SLOW_LINE_MEAN))
    else:
        slow = per_length * b * elliprf(0.0, a**2, b**2)
        slow_mean = _SLOW_MEAN * slow
    effusivity = np.sqrt(conductivity * density * specific_heat)
    fast = peak_flux * np.sqrt(a / np.pi) / effusivity
    speeds = [np.maximum(np.abs(speed * (1.0 + side * creepage)), _STANDING) for side in (0.5, -0.5)]
    return Flash(
        maximum=_meeting(*(_joined(_FAST_MAXIMUM * fast / np.sqrt(v), slow) for v in speeds)),
        mean=_meeting(*(_joined(fast_mean * fast / np.sqrt(v), slow_mean) for v in speeds)),
    )


def _joined(fast: Floats, slow: Floats) -> Floats:
    """The rise between its two limits."""
    return fast * slow / np.sqrt(fast**2 + slow**2 + np.finfo(float).tiny)


def _meeting(one: Floats, other: Floats) -> Floats:
    """The rise of two surfaces that share the heat, from the rise of each under all of it."""
    return one * other / (one + other + np.finfo(float).tiny)
