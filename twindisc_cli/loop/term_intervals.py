"""90 % intervals of the parameters of effects and laws, and which of them the data do not fix.

An interval ends where chi2, minimised over all other parameters, has grown by 2.706 of its mean, or of what makes
blocks of neighbours scatter where that is more.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from twindisc_cli.effects._effect import Effect, Param
from twindisc_cli.loop.diagnosis import Estimate
from twindisc_cli.loop.fit import Fit
from twindisc_cli.loop.resample import scatter
from twindisc_cli.loop.thresholds import ACCEPTANCE
from twindisc_cli.model.experiment import Floats

INTERVAL = 2.706
"""Growth of chi2 at the ends of a 90 % interval."""
SURE = 2.0
"""Its own standard errors by which a scatter of blocks must be larger than that of samples to count."""


def term_parameters(fitted: Fit, name: str) -> dict[str, Estimate]:
    """The parameters of a term by key, each with its interval."""
    return {p.key: estimate_of(fitted, i) for i, p in enumerate(fitted.problem.parameters) if p.term == name}


def unfixed(effect: Effect, parameters: Mapping[str, Estimate]) -> list[str]:
    """Keys of parameters at a bound of theirs, or with an interval from one to the other: the data do not fix them.

    A bound where an effect is off or complete is none.
    """
    return [p.name for p in effect.params if _is_unfixed(p, parameters[p.name])]


def fixes_a_size(fitted: Fit, name: str) -> bool:
    """Whether the data fix at least one size of an effect; what only shapes it may be anything."""
    effect, parameters = fitted.problem.effect(name), fitted.problem.parameters
    numbers = {p.key: number for number, p in enumerate(parameters) if p.term == name}
    sizes = [p for p in effect.params if p.off is not None]
    return any(not _is_unfixed(p, estimate_of(fitted, numbers[p.name])) for p in sizes)


def _is_unfixed(p: Param, estimate: Estimate) -> bool:
    near = ACCEPTANCE.near_bound * (p.upper - p.lower)
    low, high = estimate.value - p.lower < near, p.upper - estimate.value < near
    bound = p.lower if low else p.upper
    natural = bound == p.off or (p.unit == "1" and p.off == 0.0 and bound == 1.0)
    everywhere = estimate.low - p.lower < near and p.upper - estimate.high < near
    return everywhere or ((low or high) and not natural)


def widened(fitted: Fit) -> Floats:
    """Covariance of the parameters (parameter, parameter), widened by what the fit leaves."""
    wide = widening(fitted)
    return np.asarray(fitted.covariance * wide * wide[:, None])


def widening(fitted: Fit) -> Floats:
    """By how much what is left widens the interval of each parameter (parameter,).

    The root of its mean square, at least one; more where blocks of neighbours scatter beyond chance.
    """
    even = np.sqrt(max(fitted.chi2 / max(len(fitted.residual) - len(fitted.theta), 1), 1.0))
    std, error = scatter(fitted)
    ratio = std / np.sqrt(np.diag(fitted.covariance))
    return np.asarray(np.where(ratio > even * (1.0 + SURE * error), ratio, even))


def estimate_of(fitted: Fit, number: int) -> Estimate:
    """Value and interval of a parameter by its profile likelihood, widened by what remains; std: the interval's own."""
    parameter, wide = fitted.problem.parameters[number], float(widening(fitted)[number])
    value, _ = fitted.value(parameter)
    low, high = (_end(fitted, number, side, wide) for side in (-1.0, 1.0))
    return Estimate(value, (high - low) / (2.0 * np.sqrt(INTERVAL)), low, high, parameter.unit)


def _end(fitted: Fit, number: int, side: float, wide: float) -> float:
    """Where chi2, minimised over the other parameters to second order, has grown by 2.706 of its mean."""
    problem, theta = fitted.problem, fitted.theta
    lower, upper = problem.bounds
    covariance = fitted.covariance
    direction = covariance[:, number] / covariance[number, number]
    reach = side * wide * np.sqrt(INTERVAL * covariance[number, number])
    for _ in range(4):
        at = np.clip(theta + reach * direction, lower, upper)
        row = problem.discount(problem.white(problem.predict(at[None])) - problem.measured)[0]
        growth = float(row @ row) - fitted.chi2
        moved = at[number] - theta[number]
        if growth <= 0.0 or abs(moved) < 1e-12 or not np.isfinite(growth):
            break
        reach = float(np.clip(moved * wide * np.sqrt(INTERVAL / growth), -4.0 * abs(reach), 4.0 * abs(reach)))
    end = np.clip(theta[number] + reach, lower[number], upper[number])
    return float(problem.parameters[number].outer(end))
