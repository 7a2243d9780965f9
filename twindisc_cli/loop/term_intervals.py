"""90 % intervals of the parameters of effects and laws, and which of them the data do not fix.

An interval ends where chi2, minimised over all other parameters, has grown by 2.706 of its mean, or of what makes
blocks of neighbours scatter where that is more.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np

from twindisc_cli.effects._effect import Effect, Param
from twindisc_cli.loop.diagnosis import Estimate
from twindisc_cli.loop.fit import Fit, linearised, precision
from twindisc_cli.loop.problem import Problem
from twindisc_cli.loop.resample import scatter
from twindisc_cli.loop.thresholds import ACCEPTANCE
from twindisc_cli.model.experiment import Floats

INTERVAL = 2.706
"""Growth of chi2 at the ends of a 90 % interval."""
CURVED = 4.0
"""How many times faster than to second order chi2 grows where the valley is followed."""
STEPS, MOST_STEPS, SMALLEST = 6, 4, 100
"""Steps to where it would end to second order, how many times as many at most, and the smallest part of the way."""
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
    at_lower, at_upper = (partial(_is_near, p, bound) for bound in (p.lower, p.upper))
    bound = p.lower if at_lower(estimate.value) else p.upper
    natural = bound == p.off or (p.unit == "1" and p.off == 0.0 and bound == 1.0)
    everywhere = at_lower(estimate.low) and at_upper(estimate.high)
    return everywhere or (_is_near(p, bound, estimate.value) and not natural)


def _is_near(p: Param, bound: float, value: float) -> bool:
    """Whether a value is at a bound of a parameter, as far as the range goes: of sizes over decades in logarithms."""
    scale = np.log if p.log else float
    return bool(abs(scale(value) - scale(bound)) < ACCEPTANCE.near_bound * (scale(p.upper) - scale(p.lower)))


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
    ends = np.clip(
        [_end(fitted, number, side, wide) for side in (-1.0, 1.0)], *(b[number] for b in fitted.problem.bounds)
    )
    low, high = (float(parameter.outer(end)) for end in ends)
    return Estimate(value, (high - low) / (2.0 * np.sqrt(INTERVAL)), low, high, parameter.unit)


def _end(fitted: Fit, number: int, side: float, wide: float) -> float:
    """Inner value where chi2, minimised over the other parameters, has grown by 2.706 of its mean.

    To second order; where it grows faster than that by far, the valley is curved, and is followed.
    """
    problem, theta = fitted.problem, fitted.theta
    lower, upper = problem.bounds
    covariance = fitted.covariance
    direction = covariance[:, number] / covariance[number, number]
    reach = side * wide * np.sqrt(INTERVAL * covariance[number, number])
    for _ in range(4):
        at = np.clip(theta + reach * direction, lower, upper)
        row = problem.discount(problem.white(problem.predict(at[None])) - problem.measured)[0]
        growth = float(row @ row) - fitted.chi2
        if growth > CURVED * INTERVAL * wide**2:
            return _valley_end(fitted, number, reach, INTERVAL * wide**2)
        moved = at[number] - theta[number]
        if growth <= 0.0 or abs(moved) < 1e-12 or not np.isfinite(growth):
            break
        reach = float(np.clip(moved * wide * np.sqrt(INTERVAL / growth), -4.0 * abs(reach), 4.0 * abs(reach)))
    return float(theta[number] + reach)


def _valley_end(fitted: Fit, number: int, reach: float, most: float) -> float:
    """Inner value where chi2 has grown by `most` along the valley in which the other parameters follow one.

    Its bound where chi2 grows by less. reach: how far that would be to second order.
    """
    bounds, problem = fitted.problem.bounds, fitted.followed
    here, before, grown, step = fitted.theta, fitted.theta - fitted.covariance[:, number], 0.0, reach / STEPS
    for _ in range(MOST_STEPS * STEPS):
        along = (here - before) / (here - before)[number]
        least, chi2 = _minimised(problem, np.clip(here + step * along, *bounds), number)
        growth = chi2 - fitted.chi2
        if growth > most and abs(step) > abs(reach) / SMALLEST:
            step *= 0.5
        elif growth > most:
            share = (np.sqrt(most) - np.sqrt(grown)) / (np.sqrt(growth) - np.sqrt(grown))
            return float(here[number] + share * step)
        else:
            before, here, grown = here, least, max(growth, 0.0)
            if here[number] in (bounds[0][number], bounds[1][number]):
                break
            step *= 1.5
    return float(here[number])


def _minimised(problem: Problem, theta: Floats, number: int) -> tuple[Floats, float]:
    """Inner parameters (parameter,), one of them held and the others fitted by Gauss and Newton, and chi2 there."""
    target, others = problem.discount(problem.measured), np.arange(len(theta)) != number
    prior, best = np.diag(precision(problem)[others]), (theta, np.inf)
    for _ in range(STEPS):
        left, slopes, _ = linearised(problem, theta, target)
        if not left @ left < best[1]:
            break
        best = theta, float(left @ left)
        free = slopes[:, others]
        theta = theta.copy()
        theta[others] -= np.linalg.solve(free.T @ free + prior, free.T @ left)
        theta = np.clip(theta, *problem.bounds)
    return best
