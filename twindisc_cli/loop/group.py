"""What repeats of a test lack: each term fitted in every test with parameters of its own, then pooled.

    log Z = log int_0^1 prod_i [s exp(E_i) + 1 - s] ds               a term acts in a share s of the tests, s ~ U(0, 1)
    P_i   = < s exp(E_i) / [s exp(E_i) + 1 - s] >                    it acts in test i; < > over s given all tests
    theta = (sum C_i^-1)^-1 sum C_i^-1 theta_i                       one set of parameters for the tests it acts in
    Q     = sum (theta_i - theta)' C_i^-1 (theta_i - theta) ~ chi2[k (n - 1)]

    E_i      what the term adds to the evidence of test i beside the terms before it, tempered as in the search [nats]
    theta_i  its k parameters in test i, C_i their covariance, widened by what the fit leaves

Terms are added in the order of log Z, as long as it says enough. Parameters are pooled one by one as well: mean and
scatter between tests. A law acts as it was learnt, with a size of its own in each test.

Sources: J. O. Berger and L. R. Pericchi, J. Am. Stat. Assoc. 91 (1996) 109-122 (evidence of mixtures); W. G. Cochran,
Biometrics 10 (1954) 101-129 (Q).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.special import chdtrc

from twindisc_cli.effects._effect import Effect, Param, seen
from twindisc_cli.effects._state import State
from twindisc_cli.identify import hierarchy
from twindisc_cli.laws.law import Law, acted
from twindisc_cli.loop.candidates import effects
from twindisc_cli.loop.channels import channels
from twindisc_cli.loop.design import next_for_set
from twindisc_cli.loop.diagnosis import NextExperiment
from twindisc_cli.loop.fit import Fit, fit, plain_fit, refit
from twindisc_cli.loop.problem import Parameter, problem_of
from twindisc_cli.loop.search import Explanation
from twindisc_cli.loop.thresholds import THRESHOLDS
from twindisc_cli.model.experiment import Experiment, Floats

Progress = Callable[[str, float], None]

ACTS = 0.5
"""A term acts in a test where that is more probable than not."""
SINGLE = 0.05
"""One set of parameters for all tests is refused below this probability."""
FOLDS = 4
"""A group is left out in so many parts, one after the other."""
LEAST_FACTOR = -0.95  # a factor stays positive
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
class Shared:
    """A term over a group: in which share of the tests it acts (90 % interval), and how probably in each (test,).

    gain: log Z [nats]. acts: the tests it acts in, of those `shown` that can show it. parameters: by key, over the
    tests it acts in; p_one: one set of parameters for these, NaN where it acts in one. alternatives: terms that the
    group cannot tell from it.
    """

    name: str
    probability: Floats
    share: float
    low: float
    high: float
    gain: float
    acts: tuple[int, ...]
    shown: int
    parameters: Mapping[str, SharedParameter]
    p_one: float
    alternatives: tuple[str, ...]

    @property
    def holds(self) -> str:
        """For all tests that can show it, some or one."""
        return "all" if len(self.acts) == self.shown else "one" if len(self.acts) == 1 else "some"


@dataclass(frozen=True)
class GroupError:
    """Root mean square of measured minus predicted over all tests of a group, in `unit`.

    constant: without the terms. left_out: a quarter of the tests by the parameters that the others give the terms, only
    the base parameters (the level) of each its own; one test by the others where there are fewer than four. NaN where
    no term acts in two tests.
    """

    unit: str
    constant: float
    left_out: float


@dataclass(frozen=True)
class GroupDiagnosis:
    """What the tests of a group lack together, and what would tell the explanations apart best in all of them."""

    tests: tuple[str, ...]
    shared: Sequence[Shared]
    errors: Mapping[str, GroupError]
    next_experiment: NextExperiment | None


@dataclass(frozen=True)
class _Candidate:
    """One term added to each test (test,): the explanation, None where the test cannot show it; its P and log Z."""

    name: str
    added: Sequence[Explanation | None]
    gains: Floats
    probability: Floats
    share: tuple[float, float, float]
    gain: float


def diagnose_group(
    tests: Sequence[Experiment], names: Sequence[str], laws: Mapping[str, Law], progress: Progress
) -> GroupDiagnosis:
    """What repeats lack: `names` of effects that may act, laws that were learnt on one of the tests by their names."""
    bases = []
    for test in tests:
        first = refit(problem_of([test]))
        bases.append(Explanation(first, {}, first.chi2))
    now, chosen, rivals = bases, list[Shared](), list[tuple[list[Explanation], _Candidate]]()
    left = list(dict.fromkeys([*names, *laws]))
    while left and len(chosen) < THRESHOLDS.most_terms:
        progress(f"group of {len(tests)}: {len(chosen)} terms in common", 0.2 * len(chosen))
        tried = sorted((_tried(now, name, laws) for name in left), key=lambda t: (-t.gain, t.name in laws))
        best = _best(tried, laws)
        if best is None:
            break
        close = [t for t in tried if t is not best and _behind(best, t) < THRESHOLDS.within]
        rivals += [(now, t) for t in close[:1]]
        chosen.append(_shared(best, [t.name for t in close]))
        now = [
            e if e is not None and p > ACTS else old
            for e, p, old in zip(best.added, best.probability, now, strict=True)
        ]
        left.remove(best.name)
    return GroupDiagnosis(
        tests=tuple(test.name for test in tests),
        shared=chosen,
        errors=_errors(bases, now, chosen, laws),
        next_experiment=_next(now, rivals),
    )


def _tried(now: Sequence[Explanation], name: str, laws: Mapping[str, Law]) -> _Candidate:
    added = [_with(explanation, name, laws) for explanation in now]
    gains = np.array(
        [0.0 if e is None else (e.evidence - old.evidence) / e.temperature for e, old in zip(added, now, strict=True)]
    )
    probability, share, gain = mixture(gains)
    return _Candidate(name, added, gains, probability, share, gain)


def _with(explanation: Explanation, name: str, laws: Mapping[str, Law]) -> Explanation | None:
    """An explanation with one more term; None where the test cannot show it, or a bound carries it."""
    fitted = explanation.fit
    trial = {name: scaled(laws[name])} if name in laws else {}
    problem = fitted.problem.with_terms(*fitted.terms, name, trial=trial)
    own = [p for p in problem.parameters if p.term == name]
    starts = [np.array([p.inner(p.start) for p in own])] if trial else _starts(fitted, name)
    fits = [fit(problem, np.concatenate([fitted.theta, start])) for start in starts]
    fits = [result for result in fits if not result.at_bound]
    return replace(explanation, fit=max(fits, key=lambda f: f.evidence)) if fits else None


def _starts(fitted: Fit, name: str) -> Sequence[Floats]:
    return next((p.starts for p in effects(fitted) if p.name == name), [])


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


def _best(tried: Sequence[_Candidate], laws: Mapping[str, Law]) -> _Candidate | None:
    """The term that says most, an effect before a law within reach; None where none says enough."""
    enough = [t for t in tried if t.gain > (THRESHOLDS.law_enough if t.name in laws else THRESHOLDS.enough)]
    close = [t for t in enough if _behind(enough[0], t) < THRESHOLDS.within]
    return min(close, key=lambda t: (t.name in laws, -t.gain), default=None)


def _behind(best: _Candidate, other: _Candidate) -> float:
    return best.gain - other.gain


def _shared(candidate: _Candidate, alternatives: Sequence[str]) -> Shared:
    acts = [i for i, e in enumerate(candidate.added) if e is not None and candidate.probability[i] > ACTS]
    fits = [e.fit for e in (candidate.added[i] for i in acts) if e is not None]
    theta, covariance = _estimates(fits, candidate.name)
    middle, low, high = candidate.share
    return Shared(
        candidate.name, candidate.probability, middle, low, high, candidate.gain,
        acts=tuple(acts),
        shown=sum(e is not None for e in candidate.added),
        parameters={p.key: _pooled(p, theta[:, k], covariance[:, k, k]) for k, p in enumerate(_own(fits,
        candidate.name))}, p_one=_one_set(theta, covariance),
        alternatives=tuple(alternatives),
    )  # fmt: skip


def _own(fits: Sequence[Fit], name: str) -> list[Parameter]:
    return [p for p in fits[0].problem.parameters if p.term == name] if fits else []


def _estimates(fits: Sequence[Fit], name: str) -> tuple[Floats, Floats]:
    """Inner parameters of a term (test, parameter) and their covariances (test, parameter, parameter)."""
    theta, covariance = [], []
    for fitted in fits:
        own = [i for i, p in enumerate(fitted.problem.parameters) if p.term == name]
        wide = max(fitted.chi2 / max(len(fitted.residual) - len(fitted.theta), 1), 1.0)
        theta.append(fitted.theta[own])
        covariance.append(wide * fitted.covariance[np.ix_(own, own)])
    return np.array(theta), np.array(covariance)


def one_set(theta: Floats, covariance: Floats) -> tuple[Floats, Floats]:
    """theta and its covariance, weighed over tests: (test, parameter), (test, parameter, parameter)."""
    precision = np.linalg.inv(covariance)
    together = np.linalg.inv(precision.sum(axis=0))
    return together @ np.einsum("ijk,ik->j", precision, theta), together


def _typical(theta: Floats, covariance: Floats) -> Floats:
    """The mean over tests, whose parameters scatter between them as far as they say (parameter,)."""
    if len(theta) < 2:
        return np.asarray(theta[0])
    std = np.sqrt(np.einsum("ikk->ik", covariance))
    between = [hierarchy.pool(theta[:, k], std[:, k]).between for k in range(theta.shape[1])]
    return one_set(theta, covariance + np.diag(np.square(between)))[0]


def _one_set(theta: Floats, covariance: Floats) -> float:
    """The probability of so large a Q if one set of parameters holds for all."""
    if len(theta) < 2:
        return float("nan")
    off = theta - one_set(theta, covariance)[0]
    q = float(np.einsum("ij,ijk,ik->", off, np.linalg.inv(covariance), off))
    return float(chdtrc(off.shape[1] * (len(off) - 1), q))


def _pooled(p: Parameter, theta: Floats, variance: Floats) -> SharedParameter:
    """A parameter over the tests, pooled as it is fitted."""
    value, std = p.outer(theta), np.sqrt(variance) * (p.outer(theta) if p.log else p.scale)
    if len(theta) < 2:
        nan = float("nan")
        return SharedParameter(p.unit, value, std, float(value[0]), nan, nan, nan, nan)
    pooled = hierarchy.pool(theta, np.sqrt(variance))
    mean, low, high = (float(p.outer(np.array(v))) for v in (pooled.mean, pooled.low, pooled.high))
    between = pooled.between if p.log else pooled.between * p.scale
    return SharedParameter(p.unit, value, std, mean, low, high, float(between), pooled.p_one)


# ------------------------------------------------------------------------------------------------- errors


def _errors(
    bases: Sequence[Explanation], now: Sequence[Explanation], shared: Sequence[Shared], laws: Mapping[str, Law]
) -> dict[str, GroupError]:
    """The error of each channel without the terms, and of each test by the terms of the others."""
    constant = [_misses(plain_fit(replace(base.fit.problem, nuisance=None))) for base in bases]
    several = any(len(term.acts) > 1 for term in shared)
    foretold = [_foretold(i, now, shared, laws) for i in range(len(now))] if several else []
    results = {}
    for channel in dict.fromkeys(c for misses in constant for c in misses):
        of = channels()[channel]
        before, after = (
            float(np.sqrt(np.mean(np.concatenate([m[channel] for m in every if channel in m]) ** 2)))
            if every
            else np.nan
            for every in (constant, foretold)
        )
        results[channel] = GroupError(of.unit, of.factor * before, of.factor * after)
    return results


def _foretold(
    number: int, now: Sequence[Explanation], shared: Sequence[Shared], laws: Mapping[str, Law]
) -> dict[str, Floats]:
    """Misses of a test by the terms that act in it, with the parameters of the others that they act in."""
    fitted = now[number].fit
    values: dict[str, dict[str, float]] = {}
    for term in shared:
        fits = [now[i].fit for i in term.acts if (i - number) % min(len(now), FOLDS)]
        if number in term.acts and fits:
            theta = _typical(*_estimates(fits, term.name))
            values[term.name] = {
                p.key: float(p.outer(np.array(v))) for p, v in zip(_own(fits, term.name), theta, strict=True)
            }
    case = fitted.problem.cases[0]
    test = replace(
        case.test,
        effects={**case.test.effects, **{name: own for name, own in values.items() if name not in laws}},
        laws={**case.test.laws, **{name: resized(laws[name], values[name]["size"]) for name in values if name in laws}},
    )
    declared = replace(case, model=replace(case.model, experiment=test))
    return _misses(plain_fit(replace(fitted.problem, cases=[declared], terms=(), trial={}, nuisance=None)))


def resized(law: Law, size: float) -> Law:
    """A law with so many times its change."""
    if law.shape is not None:
        return replace(law, parameters={**law.parameters, law.of.size_key: size * law.parameters[law.of.size_key]})
    middle = 1.0 if law.of.kind == "factor" else 0.0
    return replace(law, value=tuple(middle + size * (value - middle) for value in law.value))


def _misses(fitted: Fit) -> dict[str, Floats]:
    """Measured minus predicted of a fit of one test, by channel."""
    (case,), (prediction,) = fitted.problem.cases, fitted.problem.predict(fitted.theta[None])
    return {c: case.values(c) - channels()[c].predicted(case.model, prediction)[0] for c in case.noise}


# ------------------------------------------------------------------------------------------------- next


def _next(
    now: Sequence[Explanation], rivals: Sequence[tuple[Sequence[Explanation], _Candidate]]
) -> NextExperiment | None:
    """The history that tells the closest rivals apart best over all tests."""
    if not rivals:
        return None
    before, other = rivals[0]
    first = next((e for e, old in zip(now, before, strict=True) if e is not old), None)
    name = first.terms[len(before[0].terms)] if first is not None else ""
    pairs = [
        ((e.fit, 0.5), (rival.fit, 0.5))
        for e, rival, old in zip(now, other.added, before, strict=True)
        if rival is not None and e is not old
    ]
    return next_for_set(pairs, (name, other.name)) if pairs else None
