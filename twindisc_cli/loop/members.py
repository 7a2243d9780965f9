"""A term in each test of a group with parameters of its own: in how many tests it acts, and how its parameters pool.

    log Z = log int_0^1 prod_i [s exp(E_i) + 1 - s] ds               a term acts in a share s of the tests, s ~ U(0, 1)
    P_i   = < s exp(E_i) / [s exp(E_i) + 1 - s] >                    it acts in test i; < > over s given all tests
    theta = (sum C_i^-1)^-1 sum C_i^-1 theta_i                       one set of parameters for the tests it acts in
    Q     = sum (theta_i - theta)' C_i^-1 (theta_i - theta) ~ chi2[k (n - 1)]

    E_i      what the term adds to the evidence of test i beside the terms before it, tempered as in the search [nats]
    theta_i  its k parameters in test i, C_i their covariance, widened by what the fit leaves

A law acts as it was learnt on all tests, with a size of its own in each.

Sources: J. O. Berger and L. R. Pericchi, J. Am. Stat. Assoc. 91 (1996) 109-122 (evidence of mixtures); W. G. Cochran,
Biometrics 10 (1954) 101-129 (Q).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.special import chdtrc

from twindisc_cli.effects._effect import Effect, Param, seen
from twindisc_cli.effects._state import State
from twindisc_cli.identify import hierarchy
from twindisc_cli.laws.law import Law, acted
from twindisc_cli.loop.candidates import effects
from twindisc_cli.loop.explanation import Explanation
from twindisc_cli.loop.fit import Fit, fit
from twindisc_cli.loop.problem import Parameter
from twindisc_cli.model.experiment import Floats

LEAST_FACTOR = -0.95
"""A factor of a resized law stays above zero by a twentieth."""
SIGN_ERRORS = 2.0
"""Standard errors from its "off" value at which a parameter has a sign: one in twenty has the wrong one by chance."""
MOST_AT_BOUND = 0.25
"""Share of the tests in which a term may stand at a bound: more, and it is not what happens in them."""
_SHARES = np.linspace(0.0, 1.0, 401)


@dataclass(frozen=True)
class SharedParameter:
    """A parameter over the tests that its term acts in, (test,), in `unit`, with its pooled mean and 90 % interval.

    between: scatter between the tests, relative where the parameter spans decades. p_one: probability of one value.
    """

    unit: str
    value: Floats
    std: Floats
    mean: float
    low: float
    high: float
    between: float
    p_one: float


@dataclass(frozen=True)
class Added:
    """One term added to each test (test,): the explanation, None where the test cannot show it; its P and log Z.

    refused: why it is no term of the group, empty where it may be.
    """

    name: str
    each: Sequence[Explanation | None]
    probability: Floats
    share: tuple[float, float, float]
    gain: float
    refused: str = ""


def added(now: Sequence[Explanation], name: str, laws: Mapping[str, Law]) -> Added:
    """A term beside those that each test has (test,), with parameters of its own in each."""
    both = [_with(explanation, name, laws) for explanation in now]
    each = [e for e, _ in both]
    gains = np.array(
        [0.0 if e is None else (e.evidence - old.evidence) / e.evidence_scale for e, old in zip(each, now, strict=True)]
    )
    probability, share, gain = mixture(gains)
    shown = [e.fit for e, p in zip(each, probability, strict=True) if e is not None and p > 0.5]
    pressed = float(np.mean([at_bound for _, at_bound in both]))
    refused = f"stands at a bound in {100.0 * pressed:.0f} % of the tests" if pressed > MOST_AT_BOUND else ""
    if shown and not refused:
        refused = changes_sign(parameters_of(shown, name), *estimates(shown, name))
    return Added(name, each, probability, share, gain, refused)


def _with(explanation: Explanation, name: str, laws: Mapping[str, Law]) -> tuple[Explanation | None, bool]:
    """An explanation with one more term, None where the test cannot show it; whether a bound carries all its fits."""
    fitted = explanation.fit
    trial = {name: scaled(laws[name])} if name in laws else {}
    problem = fitted.problem.with_terms(*fitted.terms, name, trial=trial)
    own = [p for p in problem.parameters if p.term == name]
    proposed = next((p.starts for p in effects(fitted, [name])), []) if not trial else []
    starts = [np.array([p.inner(p.start) for p in own])] if trial else proposed
    fits = [fit(problem, np.concatenate([fitted.theta, start])) for start in starts]
    inside = [result for result in fits if not result.at_bound]
    if not inside:
        return None, any(f.evidence > fitted.evidence for f in fits)
    return replace(explanation, fit=max(inside, key=lambda f: f.evidence)), False


def changes_sign(own: Sequence[Parameter], theta: Floats, covariance: Floats) -> str:
    """Why a term is refused whose inner parameters (test, parameter) are of both signs; empty where none is."""
    for k, p in enumerate(own):
        if p.off is None or not p.lower < p.off < p.upper:
            continue
        sizes = (theta[:, k] - p.inner(p.off)) / np.sqrt(covariance[:, k, k])
        if sizes.min() < -SIGN_ERRORS and sizes.max() > SIGN_ERRORS:
            ends = p.outer(np.array([theta[:, k].min(), theta[:, k].max()]))
            return f"its {p.key} changes its sign between the tests ({ends[0]:.3g} to {ends[1]:.3g})"
    return ""


def scaled(law: Law) -> Effect:
    """A law as it was learnt, times a size of its own."""
    size = Param(
        "size", "1", off=0.0, start=1.0, lower=-5.0, upper=5.0, meaning="size of the change, to the learnt one"
    )
    channel = law.of.channel
    return Effect(law.stage, (size,), partial(_scaled, law), "learnt", channel, seen(channel))


def _scaled(law: Law, state: State, *, size: Floats) -> State:
    def change(x: Floats) -> Floats:
        level = size[..., None] if law.covariate == "y_over_edge" else size
        result = level * law.change(x)
        return np.maximum(result, LEAST_FACTOR) if law.of.kind == "factor" else result

    return acted(law.quantity, law.covariate, change, state)


def resized(law: Law, size: float) -> Law:
    """A law with so many times its change."""
    if law.shape is not None:
        return replace(law, parameters={**law.parameters, law.of.size_key: size * law.parameters[law.of.size_key]})
    middle = 1.0 if law.of.kind == "factor" else 0.0
    return replace(law, value=tuple(middle + size * (value - middle) for value in law.value))


def mixture(gains: Floats) -> tuple[Floats, tuple[float, float, float], float]:
    """P that a term acts in each test (test,), the share with its 90 % interval, and log Z, from E (test,)."""
    share = _SHARES[:, None]
    with np.errstate(divide="ignore"):
        acting, idle = np.log(share) + gains, np.log1p(-share)
    rows = np.logaddexp(acting, idle)
    total = rows.sum(axis=1)
    weight = np.exp(total - total.max())
    gain = float(total.max() + np.log(np.trapezoid(weight, _SHARES)))
    weight = weight / weight.sum()
    low, middle, high = np.interp([0.05, 0.5, 0.95], np.cumsum(weight), _SHARES)
    return weight @ np.exp(acting - rows), (float(middle), float(low), float(high)), gain


def parameters_of(fits: Sequence[Fit], name: str) -> list[Parameter]:
    """The parameters of a term; none without a fit."""
    return [p for p in fits[0].problem.parameters if p.term == name] if fits else []


def estimates(fits: Sequence[Fit], name: str) -> tuple[Floats, Floats]:
    """Inner parameters of a term (test, parameter) and their covariances (test, parameter, parameter)."""
    theta, covariance = [], []
    for fitted in fits:
        own = [i for i, p in enumerate(fitted.problem.parameters) if p.term == name]
        theta.append(fitted.theta[own])
        covariance.append(fitted.excess * fitted.covariance[np.ix_(own, own)])
    return np.array(theta), np.array(covariance)


def one_set(theta: Floats, covariance: Floats) -> tuple[Floats, Floats]:
    """theta and its covariance, weighed over tests: (test, parameter), (test, parameter, parameter)."""
    precision = np.linalg.inv(covariance)
    together = np.linalg.inv(precision.sum(axis=0))
    return together @ np.einsum("ijk,ik->j", precision, theta), together


def typical(theta: Floats, covariance: Floats) -> Floats:
    """The mean over tests, whose parameters scatter between them as far as they say (parameter,)."""
    if len(theta) < 2:
        return np.asarray(theta[0])
    std = np.sqrt(np.einsum("ikk->ik", covariance))
    between = [hierarchy.pool(theta[:, k], std[:, k]).between for k in range(theta.shape[1])]
    return one_set(theta, covariance + np.diag(np.square(between)))[0]


def p_one_set(theta: Floats, covariance: Floats) -> float:
    """The probability of so large a Q if one set of parameters holds for all."""
    if len(theta) < 2:
        return float("nan")
    off = theta - one_set(theta, covariance)[0]
    q = float(np.einsum("ij,ijk,ik->", off, np.linalg.inv(covariance), off))
    return float(chdtrc(off.shape[1] * (len(off) - 1), q))


def pooled(p: Parameter, theta: Floats, variance: Floats) -> SharedParameter:
    """A parameter over the tests, pooled as it is fitted: inner theta and its variance (test,)."""
    value, std = p.outer(theta), np.sqrt(variance) * (p.outer(theta) if p.log else p.scale)
    if len(theta) < 2:
        nan = float("nan")
        return SharedParameter(p.unit, value, std, float(value[0]), nan, nan, nan, nan)
    together = hierarchy.pool(theta, np.sqrt(variance))
    mean, low, high = (float(p.outer(np.array(v))) for v in (together.mean, together.low, together.high))
    between = together.between if p.log else together.between * p.scale
    return SharedParameter(p.unit, value, std, mean, low, high, float(between), together.p_one)
