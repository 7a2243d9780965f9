"""Separate tests at one setting: how far their friction scatters from one to the next.

    ln |T/N|_i = m_k + drift_i + u_i + e_i,      u_i ~ N(0, tau^2) between tests,      e_i ~ N(0, s_i^2) within test i

    tau^2 = [ |P y|^2 - tr(P diag(s^2)) ] / tr P          (moments; not below 0)

    y      logarithm of the mean of a test, s_i its standard error
    m_k    of each setting k: creepage, load, speed and yaw
    drift  a polynomial over the order of the tests: what changes steadily from test to test is not scatter
    P      projection on what neither of the two can follow

Source: W. Viechtbauer, J. Educ. Behav. Stat. 30 (2005) 261-293 (moments of random effects).
"""

from __future__ import annotations

import numpy as np

from twindisc_cli.model.experiment import Experiment, Floats, History, Ints

FEWEST = 3
"""Repeats beyond settings and drift, without which a scatter is not estimated."""
CLEAR = 3.0
"""Standard errors of a mean from zero, without which its logarithm says nothing."""
DRIFT = 2
"""Degree of the drift, or less where tests are few."""


def repeat_scatter(test: Experiment) -> float:
    """Standard deviation of the friction between separate tests at one setting, over its mean [1].

    0 where no repeats show it, and where tests have a single sample each, whose noise holds it.
    """
    history, samples = test.history, test.measured.traction
    if not history.separate or samples is None:
        return 0.0
    count = np.bincount(samples.step, minlength=len(history.step_creepage))
    several = np.flatnonzero(count > 1)
    own = [samples.ratio[samples.step == step] for step in several]
    mean = np.array([np.mean(ratio) for ratio in own])
    error = np.array([np.std(ratio, ddof=1) / np.sqrt(len(ratio)) for ratio in own])
    clear = np.abs(mean) > CLEAR * error
    tests, y, s = several[clear], np.log(np.abs(mean[clear])), (error / np.abs(mean))[clear]
    for degree in range(DRIFT, -1, -1):
        reached = _reached(history, tests, degree)
        free = len(tests) - reached.shape[1]
        if free >= FEWEST:
            left = y - reached @ (reached.T @ y)
            within = np.sum(s**2 * (1.0 - np.sum(reached**2, axis=1)))
            return float(np.sqrt(max(left @ left - within, 0.0) / free))
    return 0.0


def _reached(history: History, tests: Ints, degree: int) -> Floats:
    """Orthonormal directions (test, direction) of a mean of each setting and a drift over the order."""
    setting = history.step_conditions[tests]
    means = np.asarray(setting[:, None] == np.unique(setting), dtype=float)
    drift = np.polynomial.legendre.legvander(2.0 * tests / max(len(history.step_creepage) - 1, 1) - 1.0, degree)
    left, size, _ = np.linalg.svd(np.concatenate([means, drift], axis=1), full_matrices=False)
    return np.asarray(left[:, size > 1e-9])
