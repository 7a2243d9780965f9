"""Regimes: whether a straight line breaks, where, and how probably by chance.

    y = a_j + b_j x on each side of a break;      F(c) = [RSS_0 - RSS(c)] / RSS(c),      sup F over all breaks c

The p-value is the share of permutations of the residuals of the one line whose sup F is as large: it needs no table and
holds for few points. A regime that broke is searched again.

Sources: D. W. K. Andrews, Econometrica 61 (1993) 821-856 (sup F); D. Freedman and D. Lane, J. Bus. Econ. Stat. 1 (1983)
292-298 (permuted residuals).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twindisc_cli.model.experiment import Floats

SHOWN = 0.01
"""A break is reported where chance makes one as clear with this probability at most."""
FEWEST = 4
"""Points of a regime at least: two more than its line has parameters."""
PERMUTATIONS = 999  # the least p-value is 0.001
SEED = 1  # the same data give the same lines


@dataclass(frozen=True)
class Regime:
    """A line y = intercept + slope x between two places; p of the break at its low end, NaN for the first."""

    low: float
    high: float
    intercept: float
    slope: float
    p_value: float


def regimes_of_logarithms(x: Floats, y: Floats) -> list[Regime]:
    """The regimes of ln y over ln x, each (point,), where both are positive; none where no point is."""
    known = (x > 0.0) & (y > 0.0)
    return regimes(np.log(x[known]), np.log(y[known]), np.random.default_rng(SEED)) if np.any(known) else []


def regimes(x: Floats, y: Floats, rng: np.random.Generator) -> list[Regime]:
    """The regimes of y over x, each (point,), in order of x; one where the data show no break."""
    order = np.argsort(x, kind="stable")
    return _split(x[order], y[order], np.nan, rng)


def _split(x: Floats, y: Floats, p: float, rng: np.random.Generator) -> list[Regime]:
    at, p_break = find_break(x, y, rng)
    if p_break <= SHOWN:
        return [*_split(x[:at], y[:at], p, rng), *_split(x[at:], y[at:], p_break, rng)]
    slope = np.sum((x - x.mean()) * y) / spread if (spread := np.sum((x - x.mean()) ** 2)) > 0.0 else 0.0
    return [Regime(float(x[0]), float(x[-1]), float(y.mean() - slope * x.mean()), float(slope), p)]


def find_break(x: Floats, y: Floats, rng: np.random.Generator) -> tuple[int, float]:
    """The first point behind the clearest break of sorted data, and its p-value; (0, 1) where points are too few."""
    if len(x) < 2 * FEWEST or x[0] == x[-1]:
        return 0, 1.0
    slope, intercept = np.polyfit(x - x[0], y, 1)
    line = intercept + slope * (x - x[0])
    shuffled = np.stack([rng.permutation(y - line) for _ in range(PERMUTATIONS)])
    gain = _sup_f(x, np.vstack([y, line + shuffled]))
    at, result = int(gain[0][0]), gain[1]
    return at, float((1 + np.count_nonzero(result[1:] >= result[0])) / (1 + PERMUTATIONS))


def _sup_f(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Where F(c) is largest and how large, of each row of y (row, point); each (row,)."""
    x = x - x.mean()
    sums = [np.cumsum(v, axis=-1) for v in (np.ones_like(x), x, x * x)]
    both = [np.cumsum(v, axis=-1) for v in (y, x * y, y * y)]
    at = np.arange(FEWEST, len(x) - FEWEST + 1)
    at = at[x[at] > x[at - 1]]  # equal x stay together
    before = _residual([s[at - 1] for s in sums], [s[:, at - 1] for s in both])
    after = _residual([s[-1] - s[at - 1] for s in sums], [s[:, [-1]] - s[:, at - 1] for s in both])
    whole = _residual([s[[-1]] for s in sums], [s[:, [-1]] for s in both])
    split = np.maximum(before + after, 1e-12 * whole + np.finfo(float).tiny)
    f = (whole - split) / split
    best = np.argmax(f, axis=1)
    return at[best], np.take_along_axis(f, best[:, None], axis=1)[:, 0]


def _residual(sums: list[Floats], both: list[Floats]) -> Floats:
    """The sum of squares that a line leaves, from the sums over a segment."""
    (n, x, xx), (y, xy, yy) = sums, both
    spread = np.maximum(xx - x * x / n, 0.0)
    joint = xy - x * y / n
    with np.errstate(divide="ignore", invalid="ignore"):
        explained = np.where(spread > 1e-12 * (xx + 1e-300), joint * joint / spread, 0.0)
    return np.maximum(yy - y * y / n - explained, 0.0)
