"""90 % intervals of what the closed loop fits.

Parameters of effects and laws: by their profile likelihood (`term_intervals`).
Base parameters: a mixture of normals of their inner numbers, one for every explanation within reach,

    sum over i of share_i N(theta_i, C_i + S S'),   S = C J' D

    share_i   how often explanation i is chosen in the resamples, among those with the answer's laws of the parameter: a
              law over creepage takes its mu where the creepage is least, another elsewhere; and where nothing in the
              answer acts on the parameter, it is a mean, which it is not beside what does
    C_i       covariance of its fit, under the longest correlation that the noise may have, widened by what it leaves
    D         what the tolerances of the inputs do to the samples, as far as base parameters can absorb it

so that an interval holds what the data say, whichever explanation is true, and what the rig's tolerances leave open.
Where the zero of the torque is not known and would move mu, an interval holds that of the fit with a free zero, too.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.special import ndtri

from twindisc_cli.effects._effect import Stage
from twindisc_cli.identify.least_squares import NINETY
from twindisc_cli.laws.quantities import MULTIPLIED
from twindisc_cli.loop.diagnosis import BaseEstimate
from twindisc_cli.loop.explain import Outcome
from twindisc_cli.loop.explanation import Explanation
from twindisc_cli.loop.fit import Fit
from twindisc_cli.loop.term_intervals import INTERVAL, widened, widening
from twindisc_cli.model.experiment import Floats

LEVELS = (0.05, 0.95)  # the interval of 90 %
TINY = 1e-300  # keeps a logarithm finite
STAGE_OF: Mapping[str, Stage] = {"mu": "friction", "K": "wear"}
NORMAL = np.asarray(ndtri((np.arange(401) + 0.5) / 401))


def base_parameters(outcome: Outcome, free: Fit | None) -> dict[str, BaseEstimate]:
    """Base parameters of the revised model by name; free: the answer with a free zero of the torque, if it counts."""
    after = outcome.judged.after
    cases = after.problem.cases
    wide = [widening(member.fit) for member in outcome.members]
    estimates: list[BaseEstimate] = []
    for number, p in enumerate(after.problem.parameters):
        test = cases[p.case].test.name if len(cases) > 1 and p.case is not None else ""
        inner = after.theta[number] + _spread(outcome, wide, p.name, p.case)
        inner = inner if free is None else _holding(inner, free, p.name, p.case)
        low, value, high = (float(p.outer(v)) for v in (inner[0], after.theta[number], inner[1]))
        std = (high - low) / (2.0 * np.sqrt(INTERVAL))
        estimates.append(BaseEstimate(value, std, low, high, p.unit, p.name, test))
    return {estimate.name: estimate for estimate in estimates}


def _spread(outcome: Outcome, wide: Sequence[Floats], name: str, case: int | None) -> Floats:
    """Ends (2,) of the interval of an inner base parameter, from the value that the answer gives it.

    wide: by how much what is left widens the intervals of each member.
    """
    answer, whole = outcome.answer.fit, outcome.judged.estimated
    number = _number(answer, name, case)
    nuisance = whole.problem.nuisance
    absorbed = np.zeros((len(whole.residual), 1)) if nuisance is None else nuisance.absorbed
    systematic = whole.covariance @ (whole.jacobian.T @ absorbed)
    only = np.array([float(member.labels == outcome.answer.labels) for member in outcome.members])
    shares = outcome.shares if np.isfinite(outcome.shares).all() else only
    draws, weights = [], []
    for member, share, wider in zip(outcome.members, shares, wide, strict=True):
        if not means_the_same(name, member, outcome.answer):
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


def _holding(inner: Floats, free: Fit, name: str, case: int | None) -> Floats:
    """The interval (2,) that holds `inner` and the one of the fit with a free zero."""
    number = _number(free, name, case)
    half = NINETY * np.sqrt(widened(free)[number, number])
    return np.array([min(inner[0], free.theta[number] - half), max(inner[1], free.theta[number] + half)])


def means_the_same(name: str, member: Explanation, answer: Explanation) -> bool:
    """Whether a base parameter is the same thing in a member as in the answer."""
    same_laws = _laws_of(member, name) == _laws_of(answer, name)
    return same_laws and (_acts_on(name, answer) or not _acts_on(name, member))


def _acts_on(name: str, explanation: Explanation) -> bool:
    """Whether any term acts where a base parameter does: friction that changes on mu, wear that does on K."""
    return any(explanation.effect(term).stage == STAGE_OF.get(name) for term in explanation.terms)


def _laws_of(explanation: Explanation, name: str) -> list[str]:
    """Covariates of an explanation's laws that say what a base parameter means."""
    return sorted(law.covariate for law in explanation.laws.values() if law.quantity == MULTIPLIED.get(name))


def _number(fitted: Fit, name: str, case: int | None) -> int:
    return [(p.name, p.case) for p in fitted.problem.parameters].index((name, case))
