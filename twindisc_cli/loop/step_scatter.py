"""Scatter between the steps of a test beyond the noise, by something that may not have been recorded.

    S = sqrt( (q / k) ),   q = |P W r|^2 ~ chi2[k]

    P W r   whitened residual of an answer along one level for each step, without what its parameters can absorb
    k       number of these directions

S is one where only noise is left; a noise that had to be assumed may be larger by `Acceptance.assumed_noise`. What was
recorded of each step (creepage, load, speed, yaw, order) is compared with the mean residual of the step by the squared
correlation of their ranks (C. Spearman, Am. J. Psychol. 15 (1904) 72-101).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtrc

from twindisc_cli.identify.span import span_of
from twindisc_cli.loop.channels import channels
from twindisc_cli.loop.fit import Fit, refit
from twindisc_cli.loop.generic import levels
from twindisc_cli.loop.noise import Noise
from twindisc_cli.loop.thresholds import ACCEPTANCE
from twindisc_cli.model.experiment import Experiment, Floats, Ints

FEWEST_STEPS = 3  # two steps have no scatter beyond a difference


@dataclass(frozen=True)
class StepScatter:
    """Scatter between the steps of one test in one channel.

    size: in standard deviations of what the noise would leave; p_value of the noise leaving as much; mu_scatter: of the
    mu of a step over its mean, where that was taken for noise, else 0 [1]; varied_with: squared rank correlation of the
    steps' mean residuals with each column that was recorded and differs between them, largest first.
    """

    test: str
    channel: str
    steps: int
    size: float
    p_value: float
    mu_scatter: float
    varied_with: Mapping[str, float]


def step_scatter(fitted: Fit) -> list[StepScatter]:
    """The scatter between steps that a fit leaves beyond the noise, in every test and channel that has steps.

    Also that of mu which was taken for noise.
    """
    taken = [case.mu_scatter for case in fitted.problem.cases]
    fitted = _without_scatter(fitted) if any(taken) else fitted
    problem, result = fitted.problem, list[StepScatter]()
    for (number, channel), where in problem.places.items():
        case, steps = problem.cases[number], channels()[channel].steps
        step = steps(case.test) if steps is not None else np.zeros(1, dtype=np.int64)
        count, squared = _length(fitted, where, case.noise[channel], step)
        noise = 1.0 if case.noise[channel].estimated else ACCEPTANCE.assumed_noise
        p_value = float(chdtrc(count, squared / noise**2)) if count else 1.0
        if p_value < ACCEPTANCE.unexplained_alone:
            prediction = problem.predict(fitted.theta[None])[number]
            miss = case.values(channel) - channels()[channel].predicted(case.model, prediction)[0]
            varied, size = _varied(case.test, step, miss), float(np.sqrt(squared / count))
            of_mu = taken[number] if channel == "traction" else 0.0
            result.append(StepScatter(case.test.name, channel, len(np.unique(step)), size, p_value, of_mu, varied))
    return result


def _without_scatter(fitted: Fit) -> Fit:
    """A fit in which no scatter of mu is taken for noise."""
    cases = [replace(case, mu_scatter=0.0) for case in fitted.problem.cases]
    return refit(replace(fitted.problem, cases=cases, nuisance=None), fitted.theta)


def _length(fitted: Fit, where: slice, noise: Noise, step: Ints) -> tuple[int, float]:
    """Number of directions of the steps' levels beside the fit, and squared length of the residual along them."""
    distinct = np.unique(step)
    if len(distinct) < FEWEST_STEPS:
        return 0, 0.0
    rows = np.zeros((len(distinct), len(fitted.residual)))
    rows[:, where] = noise.whiten(levels(step).T)
    columns, reached = fitted.problem.discount(rows).T, span_of(fitted.jacobian)
    directions = span_of(columns - reached @ (reached.T @ columns))
    return directions.shape[1], float(np.sum((directions.T @ fitted.residual) ** 2))


def _varied(test: Experiment, step: Ints, miss: Floats) -> dict[str, float]:
    """Squared rank correlation of the steps' mean residuals with what was recorded of them, largest first."""
    distinct, history = np.unique(step), test.history
    mean = np.array([miss[step == number].mean() for number in distinct])
    first = history.step_begin[distinct]
    recorded = {
        "creepage": history.creepage,
        "load": history.load_factor,
        "rolling_speed": history.speed_factor,
        "yaw": history.yaw,
        "order": np.arange(len(history.step), dtype=float),
    }
    of_steps = {name: column[first] for name, column in recorded.items()} | test.measured.column_means(distinct)
    varied = {name: column for name, column in of_steps.items() if np.ptp(column) > 0.0}
    shares = {name: float(np.corrcoef(_ranks(column), _ranks(mean))[0, 1]) ** 2 for name, column in varied.items()}
    return dict(sorted(shares.items(), key=lambda pair: -pair[1]))


def _ranks(column: Floats) -> Floats:
    """Mean rank of each value (row,)."""
    return np.array([np.mean(np.flatnonzero(np.sort(column) == value)) for value in column])
