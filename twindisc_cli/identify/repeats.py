"""Separate tests at one setting: how far their friction scatters from one to the next.

    ln |T/N|_i = m_k + sum_c b_c x_ci + drift_i + u_i + e_i,      u_i ~ N(0, tau^2) between, e_i ~ N(0, s_i^2) within

    tau^2 = [ |P y|^2 - tr(P diag(s^2)) ] / tr P          (moments; not below 0)

    y      logarithm of the mean of a test, s_i its standard error
    m_k    of each setting k: creepage, load, speed and yaw
    x_c    mean of each declared column, which the friction may follow
    drift  a polynomial over the order of the tests: what changes steadily from test to test is not scatter
    P      projection on what none of these can follow

A test that lies apart from the others by more than chance allows is no scatter.
Sources: W. Viechtbauer, J. Educ. Behav. Stat. 30 (2005) 261-293 (moments of random effects); R. D. Cook, S. Weisberg,
Residuals and Influence in Regression (1982), section 2.2 (outliers, by Student's t of the deleted residual).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.special import stdtr

from twindisc_cli.identify.span import span_of
from twindisc_cli.model.experiment import Experiment, Floats, Ints

FEWEST = 3
"""Repeats beyond settings and drift, without which a scatter is not estimated."""
CLEAR = 3.0
"""Standard errors of a mean from zero, without which its logarithm says nothing."""
DRIFT = 2
"""Degree of the drift, or less where tests are few."""
APART = 0.01
"""Probability, for all tests together, by which one as far off as the farthest is there by chance."""
MOST_APART = 0.2
"""Share of the tests that may lie apart."""


@dataclass(frozen=True)
class Repeats:
    """How friction scatters between separate tests at one setting: the standard deviation over the mean [1].

    NaN where no repeats show it. apart: tests, numbered from 0, that lie apart from the others, with how far over the
    mean [1].
    """

    scatter: float
    apart: Mapping[int, float] = field(default_factory=dict)


def repeats_of(test: Experiment) -> Repeats:
    """The scatter between separate tests; 0 where tests are not separate, or have a single sample each."""
    history, samples = test.history, test.measured.traction
    if not history.separate or samples is None:
        return Repeats(0.0)
    count = np.bincount(samples.step, minlength=len(history.step_creepage))
    several = np.flatnonzero(count > 1)
    if not several.size:
        return Repeats(0.0)
    own = [samples.ratio[samples.step == step] for step in several]
    mean = np.array([np.mean(ratio) for ratio in own])
    error = np.array([np.std(ratio, ddof=1) / np.sqrt(len(ratio)) for ratio in own])
    clear = np.abs(mean) > CLEAR * error
    tests, y, s = several[clear], np.log(np.abs(mean[clear])), (error / np.abs(mean))[clear]
    for design in _designs(test, tests):
        kept = np.ones(len(tests), dtype=bool)
        while (apart := _apart(design[kept], y[kept])) is not None and np.sum(~kept) < MOST_APART * len(kept) - 1:
            kept[np.flatnonzero(kept)[apart]] = False
        left, leverage, free = _left(design[kept], y[kept])
        if free >= FEWEST:
            scatter = np.sqrt(max(left @ left - np.sum(s[kept] ** 2 * (1.0 - leverage)), 0.0) / free)
            off = np.expm1(y - design @ np.linalg.lstsq(design[kept], y[kept])[0])
            return Repeats(float(scatter), {int(tests[i]): float(off[i]) for i in np.flatnonzero(~kept)})
    return Repeats(np.nan)


def _designs(test: Experiment, tests: Ints) -> Iterator[Floats]:
    """What repeats may follow (test, column), the richest first: settings, declared columns and a drift."""
    setting = test.history.step_conditions[tests]
    means = np.asarray(setting[:, None] == np.unique(setting), dtype=float)
    followed = np.column_stack([means, *test.measured.column_means(tests).values()])
    place = 2.0 * tests / max(float(test.history.step[-1]), 1.0) - 1.0
    for degree in range(DRIFT, -1, -1):
        yield np.column_stack([followed, np.polynomial.legendre.legvander(place, degree)])
    yield means


def _left(design: Floats, y: Floats) -> tuple[Floats, Floats, int]:
    """What a design leaves of y, the leverage of each test, and the degrees of freedom."""
    reached = span_of(design)
    return y - reached @ (reached.T @ y), np.sum(reached**2, axis=1), len(y) - reached.shape[1]


def _apart(design: Floats, y: Floats) -> int | None:
    """The test that the others let be as far off by chance only with probability APART, or none."""
    left, leverage, free = _left(design, y)
    if free <= FEWEST:
        return None
    spare = np.maximum(1.0 - leverage, 1e-9)
    without = np.maximum((left @ left - left**2 / spare) / (free - 1), 1e-300)
    p = 2.0 * stdtr(free - 1, -np.abs(left) / np.sqrt(without * spare))
    p = np.where(spare > 0.05, p, 1.0)
    return int(np.argmin(p)) if np.min(p) * len(y) < APART else None
