"""Weighted least squares with bounds, and the evidence of a fitted model.

    log Z = -chi2 / 2 + sum log prior + (p / 2) log 2 pi - log |J'J + Lambda| / 2        (Laplace)

    J       Jacobian of the white residual over the inner parameters, (sample, parameter)
    prior   uniform between the bounds of a shape, normal about "off" for the size of an effect
    Lambda  precision of the prior, which keeps a parameter that the data do not see from being paid for

Source: D. J. C. MacKay, Neural Computation 4 (1992) 415-447.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from twindisc_cli.loop.problem import Parameter, Problem
from twindisc_cli.model.experiment import Floats

STEP = 1e-4
MOST_STEPS = 40
TYPICAL = 3.0


@dataclass(frozen=True)
class Fit:
    """A fitted problem: inner parameters theta, white residual and Jacobian, chi2, evidence, covariance of theta."""

    problem: Problem
    theta: Floats
    residual: Floats
    jacobian: Floats
    chi2: float
    evidence: float
    covariance: Floats

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the fitted effects."""
        return self.problem.effects

    def value(self, parameter: Parameter) -> tuple[float, float]:
        """Value and standard deviation of a parameter in the unit of the test definition."""
        i = self.problem.parameters.index(parameter)
        std = float(np.sqrt(self.covariance[i, i]))
        value = float(parameter.outer(self.theta[i]))
        return value, std * (value if parameter.log else parameter.scale)

    @property
    def at_bound(self) -> tuple[str, ...]:
        """Names of effect parameters that ran into a bound which is not their "off"."""
        lower, upper = self.problem.bounds
        found = []
        for i, p in enumerate(self.problem.parameters):
            width = upper[i] - lower[i]
            near = min(self.theta[i] - lower[i], upper[i] - self.theta[i]) < 1e-3 * width
            bound = p.lower if self.theta[i] - lower[i] < upper[i] - self.theta[i] else p.upper
            if p.effect is not None and near and bound != p.off and not _natural(p, bound):
                found.append(p.name)
        return tuple(found)


def _natural(parameter: Parameter, bound: float) -> bool:
    """Whether a bound is where the effect is complete (a share of one) and so no sign of distress."""
    return parameter.unit == "1" and parameter.off == 0.0 and bound == parameter.upper == 1.0


def fit(problem: Problem, start: Floats | None = None) -> Fit:
    """Fit all parameters of a problem from inner start values (parameter,)."""
    lower, upper = problem.bounds
    margin = 1e-9 * (upper - lower)
    theta = np.clip(problem.start() if start is None else start, lower + margin, upper - margin)
    target = problem.discount(problem.measured)
    if len(theta) == 0:
        residual = target - problem.discount(problem.white(problem.predict(theta[None])))[0]
        empty = np.empty((len(residual), 0))
        return Fit(problem, theta, residual, empty, float(residual @ residual), 0.0, np.empty((0, 0)))
    memory: dict[bytes, tuple[Floats, Floats]] = {}

    def evaluate(at: Floats) -> tuple[Floats, Floats]:
        key = at.tobytes()
        if key not in memory:
            step = np.where(at + STEP > upper, -STEP, STEP)
            sets = np.concatenate([at[None], at + np.diag(step)])
            rows = problem.discount(problem.white(problem.predict(sets)))
            rows = np.nan_to_num(rows, nan=1e6, posinf=1e6, neginf=-1e6)
            memory[key] = (target - rows[0], -((rows[1:] - rows[0]) / step[:, None]).T)
        return memory[key]

    found = least_squares(
        lambda at: evaluate(at)[0],
        theta,
        jac=lambda at: evaluate(at)[1],
        bounds=(lower, upper),
        method="trf",
        x_scale="jac",
        ftol=1e-6,
        xtol=1e-7,
        gtol=1e-8,
        max_nfev=MOST_STEPS,
    )
    residual, jacobian = evaluate(found.x)
    return summarised(problem, found.x, residual, jacobian)


def summarised(problem: Problem, theta: Floats, residual: Floats, jacobian: Floats) -> Fit:
    """Evidence and covariance at a minimum."""
    centre, precision, density = _prior(problem, theta)
    hessian = jacobian.T @ jacobian + np.diag(precision)
    chi2 = float(residual @ residual)
    volume = 0.5 * len(theta) * np.log(2.0 * np.pi) - 0.5 * float(np.linalg.slogdet(hessian)[1])
    evidence = -0.5 * chi2 + density + volume - 0.5 * float(precision @ (theta - centre) ** 2) * 0.0
    covariance = np.linalg.inv(hessian)
    return Fit(problem, theta, residual, jacobian, chi2, evidence, covariance)


def _prior(problem: Problem, theta: Floats) -> tuple[Floats, Floats, float]:
    """Centre and precision of the normal that stands for the prior, and its log density at theta."""
    lower, upper = problem.bounds
    centre, precision, density = theta.copy(), np.zeros_like(theta), 0.0
    for i, p in enumerate(problem.parameters):
        if p.effect is not None and p.off is not None:
            off = p.inner(p.off)
            width = TYPICAL * abs(p.inner(p.start) - off)
            centre[i], precision[i] = off, width**-2
            density += -0.5 * ((theta[i] - off) / width) ** 2 - 0.5 * np.log(2.0 * np.pi * width**2)
        else:
            width = upper[i] - lower[i]
            precision[i] = 12.0 / width**2
            density += -float(np.log(width))
    return centre, precision, density
