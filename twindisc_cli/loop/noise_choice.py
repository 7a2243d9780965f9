"""The search under each noise that the samples alone leave open: noise and answer are judged together.

    log p(y | noise, answer) = evidence - log|C| / 2 - log|1 + D'D| / 2

    C   covariance of the samples under the noise, D what the inputs' tolerances could change, whitened

What changes slowly may be noise with a long memory or something that the model lacks. A trend that is no model cannot
say which: a law that follows the samples with few parameters can.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from twindisc_cli.loop.explanation import Explanation
from twindisc_cli.loop.fit import Fit, base_fit, carried, refit, remembered
from twindisc_cli.loop.noise import Noise
from twindisc_cli.loop.problem import Case, Problem
from twindisc_cli.loop.screen import unexplained_residual
from twindisc_cli.loop.search import Search, search
from twindisc_cli.loop.thresholds import SEARCH
from twindisc_cli.loop.validate import elsewhere, with_its_noise

_Progress = Callable[[str], None]


@dataclass(frozen=True)
class Searched:
    """A search, with the base model and the test that is only predicted under its noise."""

    base: Fit
    validate: Case | None
    search: Search


def searched(problem: Problem, validate: Case | None, progress: _Progress, missing: Sequence[str]) -> Searched:
    """The search under the noise that is likelier together with its answer; the larger of two that are as likely.

    Under a smaller noise is searched where the answer leaves something of it, under a larger one where that is as
    likely with a term less.
    """
    best = _under(problem, validate, progress, missing)
    for which in (min, max):
        answer, other = best.search.answer, with_noise(problem, which)
        changed = _changed(problem, other)
        if not changed or answer.is_spent:
            continue
        lead = SEARCH.equivalent if which is min else -SEARCH.equivalent
        if which is max and not _is_as_likely_with_less(answer, other, changed, lead):
            continue
        if which is min and not _leaves_something(answer, other, changed):
            continue
        again = _under(other, validate and _with_noise(validate, which), progress, missing)
        if _likelihood(again.search.answer) > _likelihood(answer) + lead:
            best = again
    return best


def _under(problem: Problem, validate: Case | None, progress: _Progress, missing: Sequence[str]) -> Searched:
    """The search under the noise that a problem has."""
    base = base_fit(problem)
    seen = replace(base.problem, cases=remembered(base.problem.cases, base))
    validate = with_its_noise(validate, base) if validate is not None else None
    other = elsewhere(validate, base) if validate is not None else None
    return Searched(base, validate, search(seen, progress, other, missing=missing))


def _likelihood(answer: Explanation) -> float:
    """Logarithm of the evidence of an answer and the noise together."""
    there = answer.elsewhere.problem.volume if answer.elsewhere is not None else 0.0
    return _here(answer) + answer.there - there


def _here(answer: Explanation) -> float:
    """The same of the tests that are fitted alone."""
    return answer.here - answer.fit.problem.volume


def _changed(problem: Problem, other: Problem) -> set[str]:
    """Channels of which a problem has another noise in one of the tests."""
    both = zip(problem.cases, other.cases, strict=True)
    return {name for one, its in both for name, noise in one.noise.items() if its.noise[name] is not noise}


def _is_as_likely_with_less(answer: Explanation, other: Problem, changed: set[str], lead: float) -> bool:
    """Whether an answer without one of its terms in these channels is so much likelier under another noise."""
    own = [name for channel in changed for name in answer.terms_in(channel)]
    shorter = ([term for term in answer.terms if term != name] for name in own)
    return any(_here(_again(answer, other, terms)) > _here(answer) + lead for terms in shorter)


def _leaves_something(answer: Explanation, other: Problem, changed: set[str]) -> bool:
    """Whether an answer leaves something of these channels under another noise."""
    left = _again(answer, other, answer.terms).fit
    return any(unexplained_residual(left, channel).p_value < SEARCH.nothing_left for channel in changed)


def _again(answer: Explanation, other: Problem, terms: Sequence[str]) -> Explanation:
    """Some terms of an answer, fitted under another noise."""
    problem = replace(other, effort=answer.fit.problem.effort).with_terms(*terms, trial=answer.fit.problem.trial)
    fitted = refit(problem, carried(problem, answer.fit))
    return replace(answer, fit=fitted, costs={term: answer.costs[term] for term in terms})


def with_noise(problem: Problem, which: Callable[..., Noise]) -> Problem:
    """The same with the smaller (min) or the larger (max) of the noises that the samples of each test leave open."""
    return replace(problem, cases=[_with_noise(case, which) for case in problem.cases])


def _with_noise(case: Case, which: Callable[..., Noise]) -> Case:
    return replace(case, noise={name: which(each.open, key=_size) for name, each in case.noise.items()})


def with_noise_like(problem: Problem, other: Problem) -> Problem:
    """The same with that of the noises which is nearer to the one that another problem of the same tests has."""
    cases = [
        replace(case, noise={name: _nearest(noise, its.noise[name]) for name, noise in case.noise.items()})
        for case, its in zip(problem.cases, other.cases, strict=True)
    ]
    return replace(problem, cases=cases)


def _nearest(noise: Noise, other: Noise) -> Noise:
    return min(noise.open, key=lambda one: abs(one.std / other.std - 1.0))


def _size(noise: Noise) -> float:
    return noise.std
