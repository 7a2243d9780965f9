"""90 % intervals of what the closed loop fits.

Parameters of effects and laws: where chi2, minimised over all others, has grown by 2.706 of its mean, or of what
makes blocks of neighbours scatter where that is more.
Base parameters: a mixture of normals of their inner numbers, one for every explanation within reach,

    sum over i of share_i N(theta_i, C_i + S S'),   S = C J' D

    share_i   how often explanation i is chosen in the resamples, among those with the answer's laws of the parameter: a
              law over creepage takes its mu where the creepage is least, another elsewhere
    C_i       covariance of its fit, under the longest correlation that the noise may have, widened by what it leaves
    D         what the tolerances of the inputs do to the samples, as far as base parameters can imitate it

so that an interval holds what the data say, whichever explanation is true, and what the rig's tolerances leave open.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import ndtri

from twindisc_cli.laws.quantities import MULTIPLIED
from twindisc_cli.loop.diagnosis import Estimate
from twindisc_cli.loop.explain import Outcome
from twindisc_cli.loop.fit import Fit
from twindisc_cli.loop.resample import scatter
from twindisc_cli.loop.search import Explanation
from twindisc_cli.model.experiment import Floats

INTERVAL = 2.706
"""Growth of chi2 at the ends of a 90 % interval."""
LEVELS = (0.05, 0.95)
SURE = 2.0
"""Its own standard errors by which a scatter of blocks must be larger than that of samples to count."""
TINY = 1e-300
NORMAL = np.asarray(ndtri((np.arange(401) + 0.5) / 401))


def term_parameters(fitted: Fit, name: str) -> dict[str, Estimate]:
    """The parameters of a term by key, each with its interval."""
    return {p.key: _estimate(fitted, i) for i, p in enumerate(fitted.problem.parameters) if p.term == name}


def base_parameters(found: Outcome) -> dict[str, Estimate]:
    """Base parameters of the revised model by name; where several tests have one each, with the test's name."""
    after = found.judged.after
    cases = after.problem.cases
    wide = [_wide(member.fit) for member in found.members]
    told: dict[str, Estimate] = {}
    for number, p in enumerate(after.problem.parameters):
        own = len(cases) > 1 and p.case is not None
        name = f"{p.name} ({cases[p.case].test.name})" if own and p.case is not None else p.name
        inner = after.theta[number] + _spread(found, wide, p.name, p.case)
        low, value, high = (float(p.outer(v)) for v in (inner[0], after.theta[number], inner[1]))
        told[name] = Estimate(value, (high - low) / (2.0 * np.sqrt(INTERVAL)), low, high, p.unit)
    return told


def _spread(found: Outcome, wide: Sequence[Floats], name: str, case: int | None) -> Floats:
    """Ends (2,) of the interval of an inner base parameter, from the value that the answer gives it.

    wide: by how much what is left widens the intervals of each member.
    """
    answer, whole = found.answer.fit, found.judged.estimated
    number = _number(answer, name, case)
    systematic = whole.covariance @ (whole.jacobian.T @ _imitated(whole))
    only = np.array([float(member.labels == found.answer.labels) for member in found.members])
    shares = found.shares if np.isfinite(found.shares).all() else only
    draws, weights = [], []
    for member, share, wider in zip(found.members, shares, wide, strict=True):
        if _laws_of(member, name) != _laws_of(found.answer, name):
            continue
        fitted = member.fit
        own = _number(fitted, name, case)
        variance = fitted.covariance[own, own] * wider[own] ** 2 + np.sum(systematic[number] ** 2)
        shift = fitted.theta[own] - answer.theta[number]
        draws.append(shift + np.sqrt(variance) * NORMAL)
        weights.append(np.full(len(NORMAL), max(share, TINY)))
    every, weight = np.concatenate(draws), np.concatenate(weights)
    ends = np.quantile(every, LEVELS, weights=weight, method="inverted_cdf")
    return np.asarray(np.clip(ends, [-np.inf, 0.0], [0.0, np.inf]))


def _laws_of(explanation: Explanation, name: str) -> list[str]:
    """Covariates of an explanation's laws that say what a base parameter means."""
    return sorted(law.covariate for law in explanation.laws.values() if law.quantity == MULTIPLIED.get(name))


def _number(fitted: Fit, name: str, case: int | None) -> int:
    return [(p.name, p.case) for p in fitted.problem.parameters].index((name, case))


def _imitated(fitted: Fit) -> Floats:
    """What the tolerances do to the samples, as far as base parameters can imitate it (sample, nuisance)."""
    nuisance = fitted.problem.nuisance
    return np.zeros((len(fitted.residual), 1)) if nuisance is None else nuisance.imitated


def widened(fitted: Fit) -> Floats:
    """Covariance of the parameters (parameter, parameter), widened by what the fit leaves."""
    wide = _wide(fitted)
    return np.asarray(fitted.covariance * wide * wide[:, None])


def _wide(fitted: Fit) -> Floats:
    """By how much what is left widens the interval of each parameter (parameter,).

    The root of its mean square, at least one; more where blocks of neighbours scatter beyond chance.
    """
    even = np.sqrt(max(fitted.chi2 / max(len(fitted.residual) - len(fitted.theta), 1), 1.0))
    std, error = scatter(fitted)
    ratio = std / np.sqrt(np.diag(fitted.covariance))
    return np.asarray(np.where(ratio > even * (1.0 + SURE * error), ratio, even))


def _estimate(fitted: Fit, number: int) -> Estimate:
    """Value, standard deviation and interval of a parameter by its profile likelihood, widened by what remains."""
    parameter, wide = fitted.problem.parameters[number], float(_wide(fitted)[number])
    value, std = fitted.value(parameter)
    low, high = (_end(fitted, number, side, wide) for side in (-1.0, 1.0))
    return Estimate(value, std * wide, low, high, parameter.unit)


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
