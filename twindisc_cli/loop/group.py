"""What repeats of a test lack: one search over all of them, a level of its own for each, and what differs.

Two structures are compared by their evidence:

    shared   one search over all tests: terms with one set of parameters, base parameters (the level) of each its own
    own      terms one after the other with parameters of their own in each test that they act in (`members`)

Whether one set of parameters holds is tested by the score of a parameter of its own in each test:

    Q = sum g_i' A_i^-1 g_i ~ chi2[k (n - 1)],   A_i = J_i' M_i J_i,   g_i = J_i' M_i r_i

    r_i, J_i  white residual of test i at the shared fit, its Jacobian over the k parameters of the term
    M_i       takes out what the level of the test can absorb

A parameter that is of both signs in the tests, or stands at a bound in them, is no common cause: its term is refused.
Source: C. R. Rao, Proc. Camb. Phil. Soc. 44 (1948) 50-57 (score test).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.special import chdtrc

from twindisc_cli.identify.least_squares import NINETY
from twindisc_cli.identify.span import span_of
from twindisc_cli.laws.law import Law
from twindisc_cli.loop.candidates import effects
from twindisc_cli.loop.design import next_for_set
from twindisc_cli.loop.diagnosis import NextExperiment
from twindisc_cli.loop.explanation import Explanation, by_falling, evidence_of, without
from twindisc_cli.loop.fit import Fit, at, precision, refit
from twindisc_cli.loop.left_out import GroupError, Learnt, group_errors
from twindisc_cli.loop.levels import Levels, levels_of, with_what_differs
from twindisc_cli.loop.members import (
    Added,
    SharedParameter,
    added,
    changes_sign,
    estimates,
    mixture,
    p_one_set,
    parameters_of,
    pooled,
)
from twindisc_cli.loop.problem import Problem, problem_of
from twindisc_cli.loop.search import Search, search
from twindisc_cli.loop.thresholds import SEARCH
from twindisc_cli.loop.ties import by_falling_value, falling
from twindisc_cli.model.experiment import Experiment, Floats, Ints

Progress = Callable[[str, float], None]

ACTS = 0.5
"""A term acts in a test where that is more probable than not."""
SINGLE = 0.05
"""One set of parameters for all tests is refused below this probability."""
SEEN = 1e-6
"""Information on a direction of the parameters, over that on the best seen one, above which a test sees it."""


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
class GroupDiagnosis:
    """What the tests of a group lack together, and what would tell the explanations apart best in all of them.

    levels: base parameters that each test has of its own, by key. refused: why a term that explains much is none of
    the group's, by its name.
    """

    tests: tuple[str, ...]
    shared: Sequence[Shared]
    levels: Mapping[str, Levels]
    errors: Mapping[str, GroupError]
    refused: Mapping[str, str]
    next_experiment: NextExperiment | None


@dataclass(frozen=True)
class _Structure:
    """One of the two structures: its terms, how it predicts tests left out, pairs of rival fits, its evidence."""

    shared: Sequence[Shared]
    learnt: Learnt
    rivals: tuple[tuple[str, str], Sequence[tuple[Fit, Fit]]] | None
    gain: float
    refused: Mapping[str, str] = field(default_factory=dict)


def diagnose_group(tests: Sequence[Experiment], progress: Progress) -> GroupDiagnosis:
    """What repeats of a test lack, at least two."""
    problem = problem_of(tests)
    result = search(problem, lambda what: progress(f"group of {len(tests)}: {what}", 0.3), enough=_differing)
    one = _one_set(result)
    best = one
    simple = len(one.shared) == 1 and one.shared[0].holds == "all" and not one.shared[0].p_one < SINGLE
    if not simple or _leaves(*one.learnt.fits):
        progress(f"group of {len(tests)}: parameters of their own", 0.6)
        own = _own_sets([_alone(problem, i) for i in range(len(tests))], result)
        best = own if own.gain > one.gain else one
    progress(f"group of {len(tests)}: tests left out", 0.9)
    return GroupDiagnosis(
        tests=tuple(test.name for test in tests),
        shared=best.shared,
        levels=with_what_differs(levels_of(best.learnt.fits), tests),
        errors=group_errors(best.learnt),
        refused={**one.refused, **best.refused},
        next_experiment=_next(best),
    )


def _differing(answer: Explanation, base: Explanation) -> bool:
    """Whether some of the tests do without an answer: then what they share is found by parameters of their own."""
    gains = 0.5 * (_chi2(base.fit) - _chi2(answer.fit)) / answer.evidence_scale
    return bool(np.any(mixture(gains)[0] < ACTS))


def _leaves(fitted: Fit) -> bool:
    """Whether a fit leaves more than noise, so that parameters of their own are worth a trial."""
    return bool(chdtrc(max(len(fitted.residual) - len(fitted.theta), 1), fitted.chi2) < SINGLE)


def _alone(problem: Problem, number: int) -> Explanation:
    """One of the tests by itself, with the noise that all of them tell."""
    case = problem.cases[number]
    first = refit(Problem([case], tuple(c for c in problem.channels if c in case.noise)))
    return Explanation.of_base(first)


def _next(best: _Structure) -> NextExperiment | None:
    """The history that separates the closest rivals best over all tests."""
    if best.rivals is None:
        return None
    names, pairs = best.rivals
    return next_for_set([((one, 0.5), (other, 0.5)) for one, other in pairs], names) if pairs else None


# ------------------------------------------------------------------------------------------------- one set


def _one_set(result: Search) -> _Structure:
    """The best explanation of all tests with one set of parameters of which no term is refused."""
    refused: dict[str, str] = {}
    beside = [e for rivals in result.rivals.values() for e in rivals]
    every = by_falling([e for e in (*result.others, *beside) if not e.fit.at_bound], evidence_of)
    for explanation in (result.answer, *(e for e in every if e.labels != result.answer.labels)):
        against = {name: why for name in explanation.terms if (why := _differs(explanation.fit, name))}
        if not against:
            break
        refused |= against
    else:
        explanation = result.base
    close = [e for e in every if (explanation.evidence - e.evidence) / explanation.evidence_scale < SEARCH.equivalent]
    close = [e for e in close if e.labels != explanation.labels and not set(e.terms) & set(refused)]
    rivals = None
    if close and explanation.terms:
        names = _joined(explanation), _joined(close[0])
        count = range(len(explanation.fit.problem.cases))
        rivals = names, [(_single(explanation.fit, i), _single(close[0].fit, i)) for i in count]
    return _Structure(
        shared=[_of_all(explanation, name, close) for name in explanation.terms],
        learnt=Learnt([explanation.fit]),
        rivals=rivals,
        gain=explanation.evidence - result.base.evidence,
        refused=refused,
    )


def _joined(explanation: Explanation) -> str:
    return " + ".join(sorted(str(term) for term in explanation.labels))


def _differs(fitted: Fit, name: str) -> str:
    """Why a term is refused whose parameters are of both signs in the tests; empty where they are not."""
    theta, covariance, _ = _of_each(fitted, name)
    return changes_sign(parameters_of([fitted], name), theta, covariance)


def _of_all(explanation: Explanation, name: str, close: Sequence[Explanation]) -> Shared:
    """A term with one set of parameters: what each test gains by it, and what each would give it of its own."""
    fitted = explanation.fit
    theta, covariance, p_one = _of_each(fitted, name)
    lost = _chi2(without(explanation, name).fit) - _chi2(fitted)
    probability, (middle, low, high), gain = mixture(0.5 * lost / explanation.evidence_scale)
    acts = np.flatnonzero(probability > ACTS)
    own = [i for i, p in enumerate(fitted.problem.parameters) if p.term == name]
    parameters = {}
    for k, i in enumerate(own):
        p, std = fitted.problem.parameters[i], np.sqrt(fitted.excess * fitted.covariance[i, i])
        each = pooled(p, theta[acts, k], covariance[acts, k, k])
        ends = p.outer(
            np.clip(fitted.theta[i] + NINETY * std * np.array([-1, 0, 1]), p.inner(p.lower), p.inner(p.upper))
        )
        parameters[p.key] = replace(each, low=float(ends[0]), mean=float(ends[1]), high=float(ends[2]))
    labels = {explanation.term(name)}
    others = [e for e in close if not labels & e.labels]
    return Shared(
        name, probability, middle, low, high, gain,
        acts=tuple(int(i) for i in acts),
        shown=len(lost),
        parameters=parameters,
        p_one=p_one,
        alternatives=tuple(dict.fromkeys(str(t) for e in others for t in e.labels - explanation.labels)),
    )  # fmt: skip


def _of_each(fitted: Fit, name: str) -> tuple[Floats, Floats, float]:
    """Inner parameters that each test would give a shared term (test, parameter), covariances, p of one set for all.

    To first order from the shared fit, so that a test which says little stays near it.
    """
    problem = fitted.problem
    own = [i for i, p in enumerate(problem.parameters) if p.term == name]
    prior, wide = np.diag(precision(problem)[own]), fitted.excess
    theta, covariance, q, rank = [], [], 0.0, 0
    lower, upper = (ends[own] for ends in problem.bounds)
    for number, rows in enumerate(_rows(problem)):
        level = [i for i, p in enumerate(problem.parameters) if p.case == number]
        basis = span_of(fitted.jacobian[rows][:, level])
        columns = fitted.jacobian[rows][:, own]
        columns = columns - basis @ (basis.T @ columns)
        score, information = columns.T @ fitted.residual[rows], columns.T @ columns
        inverse = np.linalg.inv(information + prior)
        theta.append(np.clip(fitted.theta[own] - inverse @ score, lower, upper))
        covariance.append(wide * inverse)
        q += float(score @ np.linalg.pinv(information, rcond=SEEN, hermitian=True) @ score) / wide
        rank += _rank(information)
    free = rank - len(own)
    return np.array(theta), np.array(covariance), float(chdtrc(free, q)) if free > 0 else float("nan")


def _rank(information: Floats) -> int:
    """How many directions of the parameters the samples see, given their information (parameter, parameter)."""
    size = np.linalg.eigvalsh(information)
    return int(np.sum(size > SEEN * max(float(size[-1]), 1e-300)))


def _rows(problem: Problem) -> list[Ints]:
    """The white samples of each test (sample,)."""
    return [np.flatnonzero(problem.owner == number) for number in range(len(problem.cases))]


def _chi2(fitted: Fit) -> Floats:
    """Squared length of the white residual of each test (test,)."""
    return np.array([float(np.sum(fitted.residual[rows] ** 2)) for rows in _rows(fitted.problem)])


def _single(fitted: Fit, number: int) -> Fit:
    """What a fit of all tests says of one of them."""
    problem, case = fitted.problem, fitted.problem.cases[number]
    channels = tuple(c for c in problem.channels if c in case.noise)
    alone = replace(problem, cases=[case], channels=channels, nuisance=None, tracks=None)
    values = {
        p.name: inner for p, inner in zip(problem.parameters, fitted.theta, strict=True) if p.case in (None, number)
    }
    return at(alone, np.array([values[p.name] for p in alone.parameters]))


# ------------------------------------------------------------------------------------------------- own sets


def _own_sets(bases: Sequence[Explanation], result: Search) -> _Structure:
    """Terms one after the other, each with parameters of its own in the tests that it acts in."""
    laws = {name: trial.law(result.answer.fit.values(name)) for name, trial in result.answer.laws.items()}
    now, chosen, refused = list(bases), list[Shared](), dict[str, str]()
    rivals: tuple[tuple[str, str], Sequence[tuple[Fit, Fit]]] | None = None
    while len(chosen) < SEARCH.most_terms:
        names = [name for name in _promising(now, result) if name not in {term.name for term in chosen}]
        tried = sorted((added(now, name, laws) for name in names), key=lambda t: (falling(t.gain), t.name in laws))
        enough = [t for t in tried if t.gain > (SEARCH.law_evidence if t.name in laws else SEARCH.effect_evidence)]
        refused |= {t.name: t.refused for t in enough if t.refused}
        best = _best([t for t in enough if not t.refused], laws)
        if best is None:
            break
        close = [t for t in tried if t is not best and not t.refused and best.gain - t.gain < SEARCH.equivalent]
        rivals = rivals or _rivals(now, best, close)
        chosen.append(_pooled(best, [t.name for t in close]))
        now = [
            e if e is not None and p > ACTS else old for e, p, old in zip(best.each, best.probability, now, strict=True)
        ]
    gain = sum(e.evidence - old.evidence for e, old in zip(now, bases, strict=True))
    gain -= _paid(result) if any(term.name in laws for term in chosen) else 0.0
    acts = {term.name: term.acts for term in chosen}
    return _Structure(chosen, Learnt([e.fit for e in now], acts, laws), rivals, gain, refused)


def _paid(result: Search) -> float:
    """What the forms and parameters of the answer cost in its evidence: a law that is resized was learnt with them."""
    answer, base = result.answer, result.base
    return (base.evidence + 0.5 * base.fit.chi2) - (answer.evidence + 0.5 * answer.fit.chi2)


def _promising(now: Sequence[Explanation], result: Search) -> list[str]:
    """What the search over all tests chose, and the effects that promise most in single tests."""
    promise: dict[str, float] = {}
    for explanation in now:
        for proposal in effects(explanation.fit):
            promise[proposal.name] = promise.get(proposal.name, 0.0) + max(proposal.promise, 0.0)
    best = by_falling_value({name: value for name, value in promise.items() if value > 0.0})
    return list(dict.fromkeys([*result.answer.terms, *best[: SEARCH.fitted_each_round]]))


def _best(enough: Sequence[Added], laws: Mapping[str, Law]) -> Added | None:
    """The term that says most, an effect before a law within reach; None where none says enough."""
    close = [t for t in enough if enough[0].gain - t.gain < SEARCH.equivalent]
    return min(close, key=lambda t: (t.name in laws, falling(t.gain)), default=None)


def _rivals(
    now: Sequence[Explanation], best: Added, close: Sequence[Added]
) -> tuple[tuple[str, str], Sequence[tuple[Fit, Fit]]] | None:
    """The closest rival of a term, and the fits of both in the tests that the term acts in."""
    if not close:
        return None
    pairs = [
        (e.fit, rival.fit)
        for e, rival, p in zip(best.each, close[0].each, best.probability, strict=True)
        if rival is not None and e is not None and p > ACTS
    ]
    return (best.name, close[0].name), pairs


def _pooled(term: Added, alternatives: Sequence[str]) -> Shared:
    acts = [i for i, e in enumerate(term.each) if e is not None and term.probability[i] > ACTS]
    fits = [e.fit for e in (term.each[i] for i in acts) if e is not None]
    theta, covariance = estimates(fits, term.name)
    middle, low, high = term.share
    own = parameters_of(fits, term.name)
    return Shared(
        term.name, term.probability, middle, low, high, term.gain,
        acts=tuple(acts),
        shown=sum(e is not None for e in term.each),
        parameters={p.key: pooled(p, theta[:, k], covariance[:, k, k]) for k, p in enumerate(own)},
        p_one=p_one_set(theta, covariance),
        alternatives=tuple(alternatives),
    )  # fmt: skip
