"""Weighted least squares with bounds, and the evidence of a fitted model.

    log Z = -chi2 / 2 + sum log prior + (p / 2) log 2 pi - log |J'J + Lambda| / 2        (Laplace)

    J       Jacobian of the white residual over the inner parameters, (sample, parameter)
    prior   uniform between the bounds of a shape, normal about "off" for the size of an effect
    Lambda  precision of the prior, which keeps a parameter that the data do not see from being paid for

Source: D. J. C. MacKay, Neural Computation 4 (1992) 415-447.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from twindisc_cli.loop.problem import Case, Parameter, Problem
from twindisc_cli.model.experiment import Floats

STEP = 1e-4
MOST_STEPS = 40
TYPICAL = 3.0
FREE = 4.0
EDGE = 1e-3
"""Nearer to a bound than this share of the range a parameter is at it."""


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

    def base(self, number: int) -> dict[str, float]:
        """The fitted base parameters of a test, by key."""
        return {key: float(v[0]) for key, v in self.problem.own_base(number, self.theta[None]).items()}

    @property
    def pressed(self) -> NDArray[np.bool_]:
        """Which parameters are at a bound beyond which they would fit better (parameter,)."""
        lower, upper = self.problem.bounds
        downhill, edge = -self.jacobian.T @ self.residual, EDGE * (upper - lower)
        return np.asarray(np.where(downhill > 0.0, upper - self.theta < edge, self.theta - lower < edge))

    @property
    def at_bound(self) -> tuple[str, ...]:
        """Names of effect parameters that the data press against a bound.

        A bound that is the parameter's "off", or where an effect is complete (a share of one), is none of these; nor is
        one that may be left by a tenth of the range without a cost.
        """
        lower, upper = self.problem.bounds
        slope = self.jacobian.T @ self.residual
        found = []
        for i, p in enumerate(self.problem.parameters):
            width = upper[i] - lower[i]
            low = self.theta[i] - lower[i] < upper[i] - self.theta[i]
            near = min(self.theta[i] - lower[i], upper[i] - self.theta[i]) < EDGE * width
            bound, inward = (p.lower, 0.1 * width) if low else (p.upper, -0.1 * width)
            complete = p.unit == "1" and p.off == 0.0 and bound == 1.0
            cost = 2.0 * slope[i] * inward + inward**2 / self.covariance[i, i]
            if p.effect is not None and near and bound != p.off and not complete and cost > FREE:
                found.append(p.name)
        return tuple(found)


def fit(problem: Problem, start: Floats | None = None) -> Fit:
    """Fit all parameters of a problem from inner start values (parameter,)."""
    lower, upper = problem.bounds
    margin = 1e-9 * (upper - lower)
    theta = np.clip(problem.start() if start is None else start, lower + margin, upper - margin)
    if len(theta) == 0:
        return at(problem, theta)
    target = problem.discount(problem.measured)
    memory: dict[bytes, tuple[Floats, Floats]] = {}

    def evaluated(inner: Floats) -> tuple[Floats, Floats]:
        key = inner.tobytes()
        if key not in memory:
            memory[key] = _linearised(problem, inner, target)
        return memory[key]

    def residual(inner: Floats) -> Floats:
        return evaluated(inner)[0]

    def slope(inner: Floats) -> Floats:
        return evaluated(inner)[1]

    found = least_squares(
        residual,
        theta,
        jac=slope,
        bounds=(lower, upper),
        x_scale="jac",
        ftol=1e-6,
        xtol=1e-7,
        gtol=1e-8,
        max_nfev=MOST_STEPS,
    )
    return _summarised(problem, np.asarray(found.x), *evaluated(np.asarray(found.x)))


def at(problem: Problem, theta: Floats) -> Fit:
    """The summary of a problem at given inner parameters (parameter,), without fitting."""
    return _summarised(problem, theta, *_linearised(problem, theta, problem.discount(problem.measured)))


def settled(cases: Sequence[Case], fitted: Fit) -> list[Case]:
    """The cases with what was fitted given: base parameters as options, effects as declared ones."""
    problem = fitted.problem
    found = {
        name: {key: float(value[0]) for key, value in parameters.items()}
        for name, parameters in problem.effects_of(fitted.theta[None]).items()
    }
    values = {(p.key, p.case): fitted.value(p)[0] for p in problem.parameters if p.effect is None}
    given = []
    for number, case in enumerate(cases):
        test = case.test
        options = replace(
            test.options,
            friction_coefficient=values.get(("mu", number), test.options.friction_coefficient),
            wear_coefficient=values.get(("K", None), test.options.wear_coefficient),
        )
        thermal = test.thermal
        if thermal is not None:
            thermal = replace(thermal, convection=values.get(("convection_W_K", number), thermal.convection))
        test = replace(test, options=options, thermal=thermal, effects={**test.effects, **found})
        given.append(replace(case, model=replace(case.model, experiment=test)))
    return given


def _linearised(problem: Problem, inner: Floats, target: Floats) -> tuple[Floats, Floats]:
    """White residual (sample,) and its Jacobian (sample, parameter)."""
    step = np.where(inner + STEP > problem.bounds[1], -STEP, STEP)
    sets = np.concatenate([inner[None], inner + np.diag(step)])
    rows = problem.discount(problem.white(problem.predict(sets)))
    rows = np.nan_to_num(rows, nan=1e6, posinf=1e6, neginf=-1e6)
    return target - rows[0], -((rows[1:] - rows[0]) / step[:, None]).T


def _summarised(problem: Problem, theta: Floats, residual: Floats, jacobian: Floats) -> Fit:
    """Evidence and covariance at a minimum."""
    precision, density = _prior(problem, theta)
    hessian = jacobian.T @ jacobian + np.diag(precision)
    chi2 = float(residual @ residual)
    volume = 0.5 * len(theta) * np.log(2.0 * np.pi) - 0.5 * float(np.linalg.slogdet(hessian)[1])
    evidence = -0.5 * chi2 + density + volume
    covariance = np.asarray(np.linalg.inv(hessian))
    return Fit(problem, theta, residual, jacobian, chi2, evidence, covariance)


def _prior(problem: Problem, theta: Floats) -> tuple[Floats, float]:
    """Precision of the normal that stands for the prior, and the prior's log density at theta."""
    lower, upper = problem.bounds
    precision, density = np.zeros_like(theta), 0.0
    for i, p in enumerate(problem.parameters):
        if p.effect is not None and p.off is not None:
            off = p.inner(p.off)
            width = TYPICAL * abs(p.inner(p.start) - off)
            precision[i] = width**-2
            density += -0.5 * ((theta[i] - off) / width) ** 2 - 0.5 * np.log(2.0 * np.pi * width**2)
        else:
            width = upper[i] - lower[i]
            precision[i] = 12.0 / width**2
            density += -float(np.log(width))
    return precision, density
