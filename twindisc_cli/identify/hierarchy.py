"""Repeats of one test: what scatters between the tests, what within one, and whether one value holds for all.

    y_i = m + u_i + e_i,      u_i ~ N(0, tau^2) between tests,      e_i ~ N(0, s_i^2) within test i
    w_i = 1 / (s_i^2 + tau^2),      m = sum w y / sum w
    tau^2 = sum w^2 [(y - m)^2 - s^2] / sum w^2 + 1 / sum w        (REML, iterated; not below 0)
    var m = sum w (y - m)^2 / [(n - 1) sum w],  t with n - 1       (Hartung and Knapp)
    Q(tau^2) = sum w (y - m)^2 / (n - 1) ~ F(n - 1, f)             one value for all: tau = 0; the interval of tau

    cov(u_i, u_j) = tau^2 rho^|t_i - t_j|                          levels that wander over order or time (`wander`)

    y    logarithms of mu or K, so that scatters are relative [1], (test,)
    f    degrees of freedom of s; inf where it is known
    rho  correlation of levels one place apart, t places; both by REML on a grid, the level between them by kriging

Sources: W. Viechtbauer, J. Educ. Behav. Stat. 30 (2005) 261-293 (REML), Stat. Med. 26 (2007) 37-52 (interval of tau);
J. Hartung and G. Knapp, Stat. Med. 20 (2001) 3875-3889; W. G. Cochran, Biometrics 10 (1954) 101-129 (Q); N. Cressie,
Statistics for Spatial Data (1993), chapter 3 (kriging, REML).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import chdtrc, chdtri, fdtrc, fdtri, stdtr, stdtrit

from twindisc_cli.identify.friction import CONFIDENCE
from twindisc_cli.model.experiment import Floats, Ints

OUTLYING = 0.05
"""A test is an outlier where the others let one of them lie that far out with this probability at most."""
FEWEST_FOR_OUTLIERS = 4  # with three members the odd one cannot be distinguished from the other two
_ITERATIONS = 500  # of the variance, at the most
CORRELATIONS = np.array([0.0, 0.3, 0.5, 0.7, 0.8, 0.9, 0.95, 0.98, 0.99])
"""Correlations of neighbouring levels that are tried: from none to a memory of a hundred places."""
SCATTERS = np.concatenate([[0.0], np.geomspace(0.03, 10.0, 40)])
"""tau that are tried, over the standard deviation of the levels: a long memory shows little of it in few places."""
FEWEST_FOR_ORDER = 5
"""Levels below which no correlation over their order is asked for."""


@dataclass(frozen=True)
class Pooled:
    """The mean of the tests with its interval, tau with its interval, the typical s, and p of one value for all."""

    mean: float
    std: float
    low: float
    high: float
    between: float
    between_low: float
    between_high: float
    within: float
    p_one: float


@dataclass(frozen=True)
class Levels:
    """How much each test lies above the mean of all [1] and its standard error (test,), from cells that they share.

    std is that of the test alone: of a level about the true mean, where the mean of n levels takes (n - 1) / n of it.
    cells: the mean of each cell over the tests, (cell,); within, the scatter of one observation; dof, its degrees
    of freedom.
    """

    level: Floats
    std: Floats
    cells: Floats
    within: float
    dof: int


@dataclass(frozen=True)
class Wander:
    """Levels y with standard errors s at places of order or time, each (test,), that scatter and are correlated.

    mean m; between tau; correlation rho of levels one place apart; p_order: probability of so much correlation if the
    order meant nothing, NaN of too few levels.
    """

    place: Floats
    y: Floats
    s: Floats
    mean: float
    between: float
    correlation: float
    p_order: float

    def level(self, place: ArrayLike) -> tuple[Floats, Floats]:
        """The true level at places (n,), and its standard error (n,): shrunk where measured, drawn where not."""
        place = np.atleast_1d(np.asarray(place, dtype=float))
        squared = self.between**2
        inverse = np.linalg.inv(squared * _correlated(self.place, self.place, self.correlation) + np.diag(self.s**2))
        near = squared * _correlated(place, self.place, self.correlation)
        weight = near @ inverse
        short = 1.0 - weight.sum(axis=1)
        variance = squared - np.sum(weight * near, axis=1) + short**2 / inverse.sum()
        return self.mean + weight @ (self.y - self.mean), np.sqrt(np.maximum(variance, 0.0))


def wander(y: ArrayLike, s: ArrayLike, place: ArrayLike) -> Wander:
    """Levels y with standard errors s > 0 at places, each (test,): how they scatter and wander; at least two."""
    y, s, place = (np.asarray(values, dtype=float) for values in (y, s, place))
    tried = CORRELATIONS if len(y) >= FEWEST_FOR_ORDER else CORRELATIONS[:1]
    scatters = SCATTERS * float(np.std(y, ddof=1))
    results = [
        [_restricted(y, t**2 * _correlated(place, place, rho) + np.diag(s**2)) for t in scatters] for rho in tried
    ]
    likely = np.array([[likelihood for likelihood, _ in row] for row in results])
    alone = float(likely[0].max())
    best, size = (int(i) for i in np.unravel_index(np.argmax(likely), likely.shape))
    p_order = 0.5 * float(chdtrc(1, 2.0 * (likely.max() - alone))) if len(tried) > 1 else float("nan")
    return Wander(place, y, s, results[best][size][1], float(scatters[size]), float(tried[best]), p_order)


def _correlated(one: Floats, two: Floats, correlation: float) -> Floats:
    """Correlation of the levels at two sets of places (n,) and (m,): (n, m)."""
    return np.asarray(correlation ** np.abs(one[:, None] - two))


def _restricted(y: Floats, covariance: Floats) -> tuple[float, float]:
    """Logarithm of the restricted likelihood of y (n,) with a covariance (n, n), and the mean."""
    inverse = np.linalg.inv(covariance)
    precision = float(inverse.sum())
    mean = float(inverse.sum(axis=0) @ y) / precision
    left = y - mean
    volume = float(np.linalg.slogdet(covariance)[1]) + float(np.log(precision))
    return -0.5 * (volume + float(left @ inverse @ left)), mean


def pool(y: ArrayLike, s: ArrayLike, dof: float = np.inf) -> Pooled:
    """Pool at least two tests, y and s (test,)."""
    y, s = np.asarray(y, dtype=float), np.asarray(s, dtype=float)
    squared = _reml(y, s)
    mean, weight = _weighted(y, s, squared)
    count = len(y) - 1
    std = float(np.sqrt(np.sum(weight * (y - mean) ** 2) / (count * weight.sum())))
    half = std * float(stdtrit(count, 0.5 + 0.5 * CONFIDENCE))
    ends = [_where_q_is(y, s, _quantile(count, dof, 0.5 - side * 0.5 * CONFIDENCE)) for side in (1.0, -1.0)]
    q = _q(y, s, 0.0)
    return Pooled(
        mean=mean,
        std=std,
        low=mean - half,
        high=mean + half,
        between=float(np.sqrt(squared)),
        between_low=float(np.sqrt(ends[0])),
        between_high=float(np.sqrt(ends[1])),
        within=float(np.sqrt(np.mean(s**2))),
        p_one=float(chdtrc(count, q * count) if np.isinf(dof) else fdtrc(count, dof, q)),
    )


def outliers(y: ArrayLike, s: ArrayLike) -> list[int]:
    """The tests that do not belong to the others, the farthest first; at most a quarter of them.

    Each test against the pool of all others: t with n - 2, times the number of tests (Bonferroni).
    """
    y, s = np.asarray(y, dtype=float), np.asarray(s, dtype=float)
    kept = list(range(len(y)))
    results: list[int] = []
    while len(kept) >= FEWEST_FOR_OUTLIERS and len(results) < len(y) // 4:
        p = [_deviation_p(y[kept], s[kept], i) for i in range(len(kept))]
        if min(p) * len(kept) > OUTLYING:
            break
        results.append(kept.pop(int(np.argmin(p))))
    return results


def levels(y: ArrayLike, test: Ints, cell: Ints, s: ArrayLike = 1.0) -> Levels | None:
    """The level of each test from observations y = cell + level + e, each (observation,); cells as a rule creepages.

    s: how the scatter of the observations compares, e ~ N(0, (c s)^2); c is found. None where the tests share too few
    cells to be compared.
    """
    y = np.asarray(y, dtype=float)
    s = np.broadcast_to(np.asarray(s, dtype=float), y.shape)
    tests, cells = int(test.max()) + 1, int(cell.max()) + 1
    design = np.zeros((len(y), cells + tests))
    design[np.arange(len(y)), cell] = 1.0
    design[np.arange(len(y)), cells + test] = 1.0
    centred = design[:, cells:-1] - design[:, [-1]]  # levels that sum to zero
    full = np.hstack([design[:, :cells], centred])
    dof = len(y) - full.shape[1]
    if dof < 1 or np.linalg.matrix_rank(full) < full.shape[1]:
        return None
    weighted = full / s[:, None]
    covariance = np.linalg.inv(weighted.T @ weighted)
    beta = covariance @ (weighted.T @ (y / s))
    factor = np.sum(((y - full @ beta) / s) ** 2) / dof
    to_level = np.vstack([np.eye(tests - 1), -np.ones(tests - 1)])
    own = covariance[cells:, cells:]
    return Levels(
        level=to_level @ beta[cells:],
        std=np.sqrt(factor * np.einsum("ij,jk,ik->i", to_level, own, to_level) * tests / (tests - 1.0)),
        cells=beta[:cells],
        within=float(np.sqrt(factor) * np.median(s)),
        dof=dof,
    )


SAME = 0.02
"""Neighbours that differ by less than this share are one nominal value, set twice."""


def cells_of(x: Floats) -> tuple[Ints, Floats]:
    """The cell of each x and the mean of each cell: neighbours closer than SAME are one."""
    order = np.argsort(x)
    apart = np.diff(x[order]) > SAME * np.abs(x[order][1:])
    cell = np.empty(len(x), dtype=np.int64)
    cell[order] = np.concatenate([[0], np.cumsum(apart)])
    return cell, np.bincount(cell, weights=x) / np.bincount(cell)


def _weighted(y: Floats, s: Floats, squared: float) -> tuple[float, Floats]:
    weight = 1.0 / (s**2 + squared)
    return float(np.sum(weight * y) / weight.sum()), weight


def _reml(y: Floats, s: Floats) -> float:
    """tau^2 by REML."""
    squared = float(np.var(y, ddof=1))
    for _ in range(_ITERATIONS):
        mean, w = _weighted(y, s, squared)
        step = float(np.sum(w**2 * ((y - mean) ** 2 - s**2)) / np.sum(w**2) + 1.0 / w.sum())
        if abs(max(step, 0.0) - squared) <= 1e-12 * np.var(y):
            return max(step, 0.0)
        squared = max(step, 0.0)
    return squared


def _q(y: Floats, s: Floats, squared: float) -> float:
    mean, w = _weighted(y, s, squared)
    return float(np.sum(w * (y - mean) ** 2) / (len(y) - 1))


def _quantile(count: int, dof: float, below: float) -> float:
    """The value of Q that so large a share lies above."""
    return float(chdtri(count, below) / count if np.isinf(dof) else fdtri(count, dof, 1.0 - below))


def _where_q_is(y: Floats, s: Floats, target: float) -> float:
    """tau^2 at which Q, which falls with it, has a value; 0 where it is below that already."""
    if _q(y, s, 0.0) <= target:
        return 0.0
    low, high = 0.0, float(np.var(y) + np.mean(s**2))
    while _q(y, s, high) > target:
        low, high = high, 4.0 * high
    for _ in range(100):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _q(y, s, middle) > target else (low, middle)
    return high


def _deviation_p(y: Floats, s: Floats, i: int) -> float:
    """Two-sided p of test i as one more of the others."""
    others, scatter = np.delete(y, i), np.delete(s, i)
    squared = _reml(others, scatter)
    mean, w = _weighted(others, scatter, squared)
    t = (y[i] - mean) / np.sqrt(s[i] ** 2 + squared + 1.0 / w.sum())
    return float(2.0 * stdtr(len(y) - 2, -abs(t)))


def prediction_half(tests: int, std: float) -> float:
    """Half the interval in which one more test lies, from the scatter of so many."""
    return float(std * stdtrit(max(tests - 2, 1), 0.5 + 0.5 * CONFIDENCE))
