"""Flash temperature: how much hotter than the discs the rubbing patch itself is.

    fast   T = G q0 sqrt(a) / (sqrt(pi) e sqrt(V)),   maximum G = 2.18831, mean G = 1.19908
    slow   T = S q0 a b R_F(0, a^2, b^2) / (2 k),      maximum S = 1,       mean S = 3/4
    1/T^2 = c^2 (1/T_fast^2 + 1/T_slow^2)    one disc that takes all the heat; c by table, 1 in both limits
    1/T   = 1/T_1 + 1/T_2                    two discs that share it and meet at one temperature

    Along a line (half-width b, the flux even over it) q0 = Q / (pi a b) and
    fast   mean G = 1.50849;    slow   T = q0 a [ln(4 b/a) + S] / (2 k),  maximum S = 1/2,  mean S = -0.14019,  b >> a

    q0 = 3 Q / (2 pi a b)   peak heat flux of the power Q [W], spread like the Hertzian pressure [W/m2]
    e = sqrt(k rho c)       effusivity;  k conductivity [W/(m K)], rho density [kg/m3], c specific heat [J/(kg K)]
    V                       speed of the surface through the patch, along the semi-axis a [m/s]

Fast, each strip along rolling heats as in Jaeger's band source, T(x) = integral of q / sqrt(x' - x) over the way
behind it; G is the largest value of that integral for a semi-ellipse, and its mean over the patch. Slow, the
temperature has the shape of the Hertzian displacement.

c depends on a/b and on the ratio of the limits; it is that of Jaeger's moving sources (table_makers/flash.py).

Source: H. Blok (1937); J. C. Jaeger, Proc. Royal Society of New South Wales 76 (1942) 203; the joining of both limits,
X. Tian and F. E. Kennedy, J. Tribology 116 (1994) 167, whose formula for the circle is that with c = 1.
Valid for: full sliding, discs thick against the patch. Error within 1 % for a/b from 0.05 to 20 at any speed; of a line
c = 1, which errs by up to 13 % between the limits. Slip is taken as uniform: where full slip begins it grows along the
patch, and the hottest place is 14 % hotter; 3 % at three times that creepage (of a locomotive wheel).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import elliprf

from twindisc_cli.physics._arrays import Floats, arrays, stored

FAST, SLOW = (2.1883066738, 1.1990761641), (1.0, 0.75)
"""G and S of an ellipse: of the largest rise and of the mean."""
RATIOS, WAYS = np.log(np.geomspace(0.05, 20.0, 10)), np.linspace(-4.0, 4.0, 19)
"""ln a/b, and ln of the fast over the slow limit, at which c is known."""
_ENDS = 8.0
"""ln of the limits' ratio at which one of them holds alone."""
_WAYS_AND_ENDS = np.concatenate([[-_ENDS], WAYS, [_ENDS]])
_FAST_MEAN_OF_A_LINE = 1.5084944665  # mean over a fast line source with Hertz's pressure, by quadrature
_SLOW_LINE_MAXIMUM, _SLOW_LINE_MEAN = 0.5, -0.1401861528
_STANDING = 1e-12
"""A surface speed [m/s] at which the slow limit holds."""


@dataclass(frozen=True)
class Solid:
    """What conducts the heat away: conductivity [W/(m K)], density [kg/m3], specific heat [J/(kg K)]."""

    conductivity: float
    density: float
    specific_heat: float

    @property
    def effusivity(self) -> float:
        """e of the module's docstring [W s^(1/2)/(m2 K)]."""
        return float(np.sqrt(self.conductivity * self.density * self.specific_heat))


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
    solid: Solid,
    line: bool = False,
) -> Flash:
    """The flash temperature of two discs of one material that dissipate `power` [W] in an elliptic patch, or a line's.

    The surfaces pass the patch (semi-axes a along rolling, b [m]) at speed (1 +- creepage/2) [m/s]; all broadcast.
    """
    power, creepage, a, b, speed = arrays(power, creepage, a, b, speed)
    conductivity, effusivity = arrays(solid.conductivity, solid.effusivity)
    peak_flux = (1.0 if line else 1.5) * power / (np.pi * a * b)
    per_length = 0.5 * peak_flux * a / conductivity
    fast = peak_flux * np.sqrt(a / np.pi) / effusivity
    if line:
        slow = [per_length * (np.log(4.0 * b / a) + s) for s in (_SLOW_LINE_MAXIMUM, _SLOW_LINE_MEAN)]
        quick = [size * fast for size in (FAST[0], _FAST_MEAN_OF_A_LINE)]
    else:
        slow = [s * per_length * b * elliprf(0.0, a**2, b**2) for s in SLOW]
        quick = [size * fast for size in FAST]
    speeds = [np.maximum(np.abs(speed * (1.0 + side * creepage)), _STANDING) for side in (0.5, -0.5)]
    results = []
    for kind in (0, 1):
        pairs = [(quick[kind] / np.sqrt(v), slow[kind]) for v in speeds]
        factors = [1.0 if line else _correction(kind, a / b, *pair) for pair in pairs]
        results.append(_meeting(*(factor * _joined(*pair) for factor, pair in zip(factors, pairs, strict=True))))
    return Flash(*results)


def _correction(kind: int, ratio: Floats, fast: Floats, slow: Floats) -> Floats:
    """1/c of the largest rise (0) or the mean (1), linear in ln a/b and the ln of the limits' ratio."""
    tiny = np.finfo(float).tiny
    way = np.clip(np.log(np.maximum(fast, tiny) / np.maximum(slow, tiny)), -_ENDS, _ENDS)
    row = np.interp(np.log(ratio), RATIOS, np.arange(len(RATIOS)))
    column = np.interp(way, _WAYS_AND_ENDS, np.arange(len(_WAYS_AND_ENDS)))
    i, j = (
        np.minimum(place.astype(np.intp), count - 2)
        for place, count in ((row, len(RATIOS)), (column, len(_WAYS_AND_ENDS)))
    )
    s, t, known = row - i, column - j, _table()[kind]
    below, above = ((1.0 - t) * known[k, j] + t * known[k, j + 1] for k in (i, i + 1))
    return np.asarray(np.exp((1.0 - s) * below + s * above))


@cache
def _table() -> Floats:
    """- ln c of the largest rise and of the mean, (2, a/b, limits' ratio), with 0 at both ends."""
    return np.pad(stored("twindisc_cli.physics", "flash.npz")["correction"], ((0, 0), (0, 0), (1, 1)))


def _joined(fast: Floats, slow: Floats) -> Floats:
    """The rise between its two limits."""
    return fast * slow / np.sqrt(fast**2 + slow**2 + np.finfo(float).tiny)


def _meeting(one: Floats, other: Floats) -> Floats:
    """The rise of two surfaces that share the heat, from the rise of each under all of it."""
    return one * other / (one + other + np.finfo(float).tiny)
