"""The search under each noise that the samples alone leave open: noise and answer are judged together.

    log p(y | noise, answer) = evidence - log|C| / 2 - log|1 + D'D| / 2

    C   covariance of the samples under the noise, D what the inputs' tolerances could change, whitened

What changes slowly may be noise with a long memory or something that the model lacks. A trend that is no model cannot
say which: a law that follows the samples with few parameters can.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from twindisc_cli.loop.channels import channels
from twindisc_cli.loop.explanation import Explanation, without
from twindisc_cli.loop.fit import Fit, base_fit, carried, refit, remembered
from twindisc_cli.loop.mu_scatter import likeliest_scatter, with_scatter
from twindisc_cli.loop.noise import Noise
from twindisc_cli.loop.problem import Case, Problem
from twindisc_cli.loop.screen import unexplained_residual
from twindisc_cli.loop.search import Search, search
from twindisc_cli.loop.terms import Term
from twindisc_cli.loop.thresholds import ACCEPTANCE, SEARCH
from twindisc_cli.loop.validate import elsewhere, with_its_noise
from twindisc_cli.model.prediction import Prediction

_Progress = Callable[[str], None]


@dataclass(frozen=True)
class Searched:
    """A search, with the base model and the test that is only predicted under its noise.

    or_noise: terms that explain as much without the noise that its answer has in their place; or_scatter: whether a mu
    that scatters from step to step would explain as much as the answer does in the traction.
    """

    base: Fit
    validate: Case | None
    search: Search
    or_noise: frozenset[Term] = frozenset()
    or_scatter: bool = False


def searched(problem: Problem, validate: Case | None, progress: _Progress, missing: Sequence[str]) -> Searched:
    """The search under the noise that is likelier together with its answer; of two as likely, the slow one.

    Or that with two terms less. Noise without a slow part is tried where the answer leaves something under it; slow
    noise, or a mu that scatters from step to step, where it may stand for a term. That a search was ended is no reason
    not to try the scatter: terms that stand for it are many.
    """
    first = _under(problem, validate, progress, missing)
    answer, or_scatter = first.search.answer, False

    def again_under(other: Problem) -> Searched:
        return _under(other, validate and _like(validate, other.cases[0]), progress, missing)

    other = _scattering(answer, problem)
    if other is not None:
        again = again_under(other)
        found = again.search.answer
        # that levels say nothing of another test does not speak for them
        gain = min(_likelihood(found) - _likelihood(answer), _here(found) - _here(answer))
        gain = min(gain, gain / answer.evidence_scale)  # an answer that explains much errs by its formulas
        if (instead := _instead(answer, again, gain, SEARCH.equivalent)) is not None:
            return instead
        or_scatter = gain > -SEARCH.equivalent
    for another, lead in ((_quick, SEARCH.equivalent), (_slow, -SEARCH.equivalent)):
        other = None if answer.is_spent else another(answer, problem)
        if other is not None:
            again = again_under(other)
            gain = _likelihood(again.search.answer) - _likelihood(answer)
            if (instead := _instead(answer, again, gain, lead)) is not None:
                return replace(instead, or_scatter=or_scatter)
    return replace(first, or_scatter=or_scatter)


def _instead(answer: Explanation, again: Searched, gain: float, lead: float) -> Searched | None:
    """A search under another noise whose answer is likelier by a lead, or as likely with two terms less; else None."""
    found = again.search.answer
    far_shorter = len(answer.terms) - len(found.terms) > 1
    if not gain > (-SEARCH.equivalent if far_shorter else lead):
        return None
    return replace(again, or_noise=answer.labels - found.labels) if gain < SEARCH.equivalent else again


def with_noise_like(problem: Problem, other: Problem) -> Problem:
    """A problem with those of its open noises that are nearest to the noises of another one of the same tests."""
    return replace(problem, cases=[_like(*both) for both in zip(problem.cases, other.cases, strict=True)])


def _under(problem: Problem, validate: Case | None, progress: _Progress, missing: Sequence[str]) -> Searched:
    """The search under the noise that a problem has."""
    base = base_fit(problem)
    seen = replace(base.problem, cases=remembered(base.problem.cases, base))
    validate = with_its_noise(validate, base) if validate is not None else None
    other = elsewhere(validate, base) if validate is not None else None
    return Searched(base, validate, search(seen, progress, other, missing=missing))


def _quick(answer: Explanation, problem: Problem) -> Problem | None:
    """A problem without slow noise, where an answer leaves something under that; else None."""
    other = _with(problem, lambda _, __, noise: min(noise.open, key=lambda one: (one.slow is not None, one.std)))
    changed = _changed(answer, problem, other)
    if not changed:
        return None
    left = _again(answer, other).fit
    leaves = any(unexplained_residual(left, channel).p_value <= SEARCH.nothing_left for channel in changed)
    return other if leaves else None


def _slow(answer: Explanation, problem: Problem) -> Problem | None:
    """A problem with the slow noise under which an answer with a term less is likely enough; else None."""
    among = [c for c in problem.channels if any(c in case.noise and case.noise[c].rivals for case in problem.cases)]
    for term in [term for channel in among for term in answer.terms_in(channel)]:
        shorter = without(answer, term)
        other = _with(problem, partial(_likeliest, problem.cases, shorter.fit.problem.predict(shorter.fit.theta[None])))
        changed = _changed(answer, problem, other)
        if changed and _here(_again(shorter, other)) > _here(answer) - SEARCH.equivalent:
            return other
    return None


def _scattering(answer: Explanation, problem: Problem) -> Problem | None:
    """A problem in which mu scatters from step to step, where a part of an answer is likely enough so; else None.

    The answer itself has to be likelier by far: that mu scatters beside it changes little.
    """
    terms = answer.terms_in("traction")
    if not terms:
        return None
    now, best, most = _here(answer), None, -np.inf
    for left_out in dict.fromkeys([(), tuple(terms), *((term,) for term in terms)]):
        part = without(answer, *left_out) if left_out else answer
        sizes = likeliest_scatter(part.fit)
        if any(sizes):
            other = with_scatter(problem, sizes)
            gain = _here(_again(part, other)) - now
            if gain > max(most, -SEARCH.equivalent if left_out else SEARCH.equivalent * answer.evidence_scale):
                best, most = other, gain
    return best


def _likeliest(cases: Sequence[Case], predictions: Sequence[Prediction], number: int, name: str, noise: Noise) -> Noise:
    """That of the open noises of a channel of a test under which what a prediction leaves is most probable."""
    case = cases[number]
    left = case.values(name) - channels()[name].predicted(case.model, predictions[number])[0]
    return max(noise.open, key=lambda one: -0.5 * float(np.sum(one.whiten(left) ** 2)) - one.volume)


def _with(problem: Problem, choose: Callable[[int, str, Noise], Noise]) -> Problem:
    """A problem with one of the noises that the samples leave open, where these are several, by test and channel."""
    cases = []
    for number, case in enumerate(problem.cases):
        chosen = {name: choose(number, name, noise) for name, noise in case.noise.items() if noise.rivals}
        cases.append(replace(case, noise={**case.noise, **chosen}))
    return replace(problem, cases=cases)


def _like(case: Case, other: Case) -> Case:
    """A test with those of its open noises that are nearest to the noises of another: of one kind, then in size.

    And with the scatter of mu over the steps that the other has.
    """
    noise = {name: _nearest(noise, other.noise.get(name, noise)) for name, noise in case.noise.items()}
    return replace(case, noise=noise, mu_scatter=other.mu_scatter)


def _nearest(noise: Noise, other: Noise) -> Noise:
    """That of the open noises which is nearest to another noise."""
    return min(noise.open, key=lambda one: (_kind(one) != _kind(other), abs(one.std / other.std - 1.0)))


def _kind(noise: Noise) -> tuple[float, ...]:
    """Share and shortest memory of the slow part of a noise; empty without one."""
    return () if noise.slow is None else (noise.slow.share, noise.slow.memories[0])


def _changed(answer: Explanation, problem: Problem, other: Problem) -> set[str]:
    """Channels that have open noises in a problem, and another one for an answer than in the other problem."""
    three = zip(answer.fit.problem.cases, problem.cases, other.cases, strict=True)
    return {
        name
        for now, case, then in three
        for name, noise in case.noise.items()
        if noise.rivals and now.noise[name] is not then.noise[name]
    }


def _again(answer: Explanation, other: Problem) -> Explanation:
    """An answer fitted under another noise."""
    own = answer.fit.problem
    problem = replace(other, effort=own.effort).with_terms(*answer.terms, trial=own.trial)
    return replace(answer, fit=refit(problem, carried(problem, answer.fit)))


def _likelihood(answer: Explanation) -> float:
    """Logarithm of the evidence of an answer and the noise together."""
    there = answer.elsewhere.problem.volume if answer.elsewhere is not None else 0.0
    return _here(answer) + answer.there - there


def _here(answer: Explanation) -> float:
    """The same of the tests that are fitted alone; a scatter of mu is expected to be as large as that of repeats."""
    scatters = [case.mu_scatter / ACCEPTANCE.repeat_scatter for case in answer.fit.problem.cases]
    return answer.here - answer.fit.problem.volume - 0.5 * float(np.sum(np.square(scatters)))
