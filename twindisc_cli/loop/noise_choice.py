"""The search under each noise that the samples alone leave open: noise and answer are judged together.

    log p(y | noise, answer) = evidence - log|C| / 2 - log|1 + D'D| / 2

    C   covariance of the samples under the noise, D what the inputs' tolerances could change, whitened

What changes slowly may be noise with a long memory or something that the model lacks. A trend that is no model cannot
say which: a law that follows the samples with few parameters can.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from twindisc_cli.loop.fit import Fit, base_fit, remembered
from twindisc_cli.loop.noise import Noise
from twindisc_cli.loop.problem import Case, Problem
from twindisc_cli.loop.search import Search, search
from twindisc_cli.loop.thresholds import SEARCH
from twindisc_cli.loop.validate import elsewhere, with_its_noise


@dataclass(frozen=True)
class Searched:
    """A search, with the base model and the test that is only predicted under its noise."""

    base: Fit
    validate: Case | None
    search: Search

    @property
    def evidence(self) -> float:
        """Logarithm of the evidence of the answer and the noise together."""
        answer = self.search.answer
        there = answer.elsewhere.problem.volume if answer.elsewhere is not None else 0.0
        return answer.evidence - answer.fit.problem.volume - there


def searched(
    problem: Problem, validate: Case | None, progress: Callable[[str], None], missing: Sequence[str]
) -> Searched:
    """The search under the noise that is likelier together with its answer.

    A smaller noise has to be so by more than the evidence of two answers that cannot be separated. Under a larger one
    nothing more is found: it is tried where something was found in its channel.
    """

    def under(problem: Problem, validate: Case | None) -> Searched:
        base = base_fit(problem)
        seen = replace(base.problem, cases=remembered(base.problem.cases, base))
        validate = with_its_noise(validate, base) if validate is not None else None
        other = elsewhere(validate, base) if validate is not None else None
        return Searched(base, validate, search(seen, progress, other, missing=missing))

    best = first = under(problem, validate)
    for which in (min, max):
        cases = [with_noise(case, which) for case in problem.cases]
        other = with_noise(validate, which) if validate is not None else None
        changed = {
            name
            for old, new in zip([*problem.cases, validate], [*cases, other], strict=True)
            if old is not None and new is not None
            for name in old.noise
            if old.noise[name] is not new.noise[name]
        }
        if not changed or (which is max and not changed & first.search.answer.explained):
            continue
        again = under(replace(problem, cases=cases), other)
        lead = SEARCH.equivalent if which is min else -SEARCH.equivalent
        if again.evidence > best.evidence + lead:
            best = again
    return best


def with_noise(case: Case, which: Callable[..., Noise]) -> Case:
    """A test with the smaller (min) or the larger (max) of the noises that its samples leave open."""
    return replace(case, noise={name: which(each.open, key=_size) for name, each in case.noise.items()})


def with_noise_like(case: Case, other: Case) -> Case:
    """A test with that of the noises its samples leave open which is nearer to that of another one."""
    noise = {
        name: min(each.open, key=lambda noise: abs(_size(noise) / _size(other.noise[name]) - 1.0))
        for name, each in case.noise.items()
    }
    return replace(case, noise=noise)


def _size(noise: Noise) -> float:
    return noise.std
