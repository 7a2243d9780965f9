"""The exact theory of rolling without lateral creepage and spin, as one curve: T/(mu N) = f(xi; a/b, nu).

    xi = |linear force| / (mu N) = G a b C11 |vx| / (mu N)

    a, b   semi-axes of the Hertzian patch along rolling and across [m];    C11  Kalker's coefficient [1]
    f      rises as xi at first, and comes near 1 where all of the patch slides (xi about 2.4); there a little of the
           traction still points across, so that 1 - f falls off as 1/xi^2

The friction coefficient and the load enter only through xi, so that a curve made once serves every case.
Below the table, a/b < g0 = 0.05, each strip across the patch nears a line contact of Carter's, all strips together
the closed form f_C of `fastrip`, from which the table is 7e-4 away at g0:  f = f_C + (f(g0) - f_C) (a/b) / g0.

Source: table of half_space.rolling (table_makers/rolling.py); F. W. Carter, Proc. Royal Society A 112 (1926) 151.
Error of f some 2e-4, a/b <= 20, all nu.
"""

from __future__ import annotations

from functools import cache, lru_cache
from importlib.resources import files

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike, NDArray

from twindisc_cli.physics import fastrip
from twindisc_cli.physics._arrays import arrays, together
from twindisc_cli.physics.kalker import POISSON_RANGE, RATIO_RANGE, require, require_ratio

Floats = NDArray[np.float64]

_STEP = 0.1  # of the normalised creepage
KNOTS = _STEP * np.arange(36)  # normalised creepages of the table
_INTERVALS = KNOTS.size - 1
_NEWTON_STEPS = 8  # inside one interval of the table, from its middle
_FINE = 385  # ratios a/b of the table at which the curves of one nu are laid out, linear in log(a/b) between them
_SLENDER = 320  # further such ratios below the table, down to where f is f_C to 5e-6


def saturation(xi: ArrayLike, a_over_b: ArrayLike, poisson: float) -> Floats:
    """T/(mu N) [1] at the normalised creepage xi >= 0 and the ratio of semi-axes a/b [1], which broadcast.

    Raises OutOfRangeError outside 0 < a/b <= 20 and 0 <= nu <= 0.5.
    """
    curves = _curves(poisson)
    row, share = _row(a_over_b)
    creepage = np.broadcast_to(xi, np.broadcast_shapes(np.shape(xi), row.shape))
    place = np.minimum(creepage, KNOTS[-1]) / _STEP
    interval = np.minimum(place.astype(np.intp), _INTERVALS - 1)
    t = place - interval
    if row.size == 1:
        return _with_tail(_cubic(_one_curve(curves, row, share), interval, t), creepage)
    flat = curves.reshape(4, -1)
    index = row * _INTERVALS + interval
    below = _cubic(flat, index, t)
    return _with_tail(below + share * (_cubic(flat, index + _INTERVALS, t) - below), creepage)


def unsaturation(fraction: ArrayLike, a_over_b: ArrayLike, poisson: float) -> Floats:
    """The normalised creepage xi at which T/(mu N) is `fraction`, 0 ... 1: the inverse of `saturation`; inf at 1."""
    target, ratio = together(fraction, a_over_b)
    curves = _curves(poisson)
    row, share = _row(ratio)
    interval = _interval_of(target, curves[0], row, share)
    cubic = _lerp(curves[:, row, interval], curves[:, row + 1, interval], share)
    t = np.full(target.shape, 0.5)
    for _ in range(_NEWTON_STEPS):
        slope = cubic[1] + t * (2.0 * cubic[2] + 3.0 * t * cubic[3])
        excess = cubic[0] + t * (cubic[1] + t * (cubic[2] + t * cubic[3])) - target
        t = np.clip(t - excess / np.where(slope > 0.0, slope, np.inf), 0.0, 1.0)
    last = _lerp(curves[:, row, -1], curves[:, row + 1, -1], share).sum(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        beyond = KNOTS[-1] * np.sqrt((1.0 - last) / (1.0 - target))
    result = np.where(target > last, beyond, _STEP * (interval + t))
    return np.where(target >= 1.0, np.inf, result)


def _interval_of(target: Floats, values: Floats, row: NDArray[np.intp], share: Floats) -> NDArray[np.intp]:
    """The last interval that begins at or below the target, by halving; values (row, interval) where each begins."""
    low, high = np.zeros(target.shape, dtype=np.intp), np.full(target.shape, _INTERVALS, dtype=np.intp)
    while np.any(high - low > 1):
        middle = (low + high) // 2
        below = _lerp(values[row, middle], values[row + 1, middle], share) <= target
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return low


def _one_curve(curves: Floats, row: NDArray[np.intp], share: Floats) -> Floats:
    """Cubics of a single ratio a/b, (4, interval)."""
    k, s = int(row.item()), float(share.item())
    return _lerp(curves[:, k], curves[:, k + 1], np.asarray(s))


def _lerp(first: Floats, second: Floats, share: Floats) -> Floats:
    """The first value, moved by a share of the way to the second."""
    return first + share * (second - first)


def _with_tail(value: Floats, creepage: Floats) -> Floats:
    """1 - f falls off as the square of the creepage beyond the last knot."""
    far = creepage > KNOTS[-1]
    if not far.any():
        return value
    return np.where(far, 1.0 - (1.0 - value) * (KNOTS[-1] / np.where(far, creepage, 1.0)) ** 2, value)


def _cubic(table: Floats, index: NDArray[np.intp], t: Floats) -> Floats:
    """The cubics of a table (4, cubic) that the index picks, at t; index and t of one shape."""
    value: Floats = table[3].take(index)
    for coefficients in table[2::-1]:
        value *= t
        value += coefficients.take(index)
    return value


def _row(a_over_b: ArrayLike) -> tuple[NDArray[np.intp], Floats]:
    """Row of the curves below log(a/b), and the share of the row above."""
    (ratio,) = arrays(a_over_b)
    require_ratio(ratio)
    low, high = np.log(RATIO_RANGE)
    place = np.maximum((np.log(ratio) - low) * ((_FINE - 1) / (high - low)), -_SLENDER)
    row = np.minimum(np.floor(place).astype(np.intp), _FINE - 2)
    return row + _SLENDER, place - row


@lru_cache(maxsize=8)
def _curves(poisson: float) -> Floats:
    """Cubics of f over each interval of creepage at the slender and the fine ratios a/b, (4, ratio, interval)."""
    require("Poisson's ratio", np.asarray(poisson), POISSON_RANGE)
    along = chebyshev.chebval(4.0 * poisson - 1.0, np.moveaxis(_table(), 1, 0))
    values = chebyshev.chebval(np.linspace(-1.0, 1.0, _FINE), along).T
    values = np.concatenate([np.zeros((_FINE, 1)), values], axis=1)
    share = np.exp(np.arange(-_SLENDER, 0) * np.log(RATIO_RANGE[1] / RATIO_RANGE[0]) / (_FINE - 1))[:, None]
    values = np.concatenate([share * values[0] + (1.0 - share) * fastrip.saturation(KNOTS), values])
    return _monotone_cubics(np.maximum.accumulate(np.minimum(values, 1.0), axis=1))


def _monotone_cubics(values: Floats) -> Floats:
    """Cubic spline through values at the knots (row, knot) that starts with slope 1, limited so that it never falls.

    Source: J. M. Hyman, Accurate monotonicity preserving cubic interpolation, SIAM J. Sci. Stat. Comput. 4 (1983) 645.
    """
    count = values.shape[1]
    matrix = 4.0 * np.eye(count) + np.eye(count, k=1) + np.eye(count, k=-1)
    matrix[0, :2] = 1.0, 0.0
    matrix[-1, -2:] = 0.0, 1.0
    right = np.empty_like(values)
    right[:, 0] = _STEP
    right[:, 1:-1] = 3.0 * (values[:, 2:] - values[:, :-2])
    right[:, -1] = 2.0 * (1.0 - values[:, -1]) * _STEP / KNOTS[-1]
    slope = np.linalg.solve(matrix, right.T).T
    rise = np.diff(values, axis=1)
    slope[:, :-1] = np.minimum(slope[:, :-1], 3.0 * rise)
    slope[:, 1:] = np.minimum(slope[:, 1:], 3.0 * rise)
    slope = np.maximum(slope, 0.0)
    first, last = slope[:, :-1], slope[:, 1:]
    return np.stack([values[:, :-1], first, 3.0 * rise - 2.0 * first - last, first + last - 2.0 * rise])


@cache
def _table() -> Floats:
    """Chebyshev coefficients of f over log(a/b) and nu at the knots but the first, (a/b, nu, knot)."""
    with (files("twindisc_cli.physics") / "exact.npz").open("rb") as stream, np.load(stream) as data:
        table: Floats = data["chebyshev"]
    return table
