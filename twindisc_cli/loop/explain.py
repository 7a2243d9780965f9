"""What a set of tests says by itself: the base model, what it lacks in each channel, and the revised model."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import count

import numpy as np

from twindisc_cli.effects._effect import CHANNELS, Channel
from twindisc_cli.loop.fit import Fit, at, fit, settled
from twindisc_cli.loop.problem import DRIVEN, Case, Problem, case_of
from twindisc_cli.loop.search import Candidate, Finding, akaike, free_friction, refit, search, weigh
from twindisc_cli.model.experiment import Experiment, Floats

RIVALS = 5
NEGLIGIBLE = 1e-4
Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Explanation:
    """An answer to all samples of some tests.

    before: the base model; findings: what is missing in each channel; joint: all explained channels fitted together,
    sure: the same under the noise as estimated; after: the revised model, for each channel.
    """

    before: Fit
    findings: Sequence[Finding]
    joint: Fit
    sure: Fit
    after: Mapping[Channel, Fit]

    @property
    def effects(self) -> tuple[str, ...]:
        """The effects that are added."""
        return tuple(name for finding in self.findings if finding.chosen for name in finding.chosen.names)


def explain(tests: Sequence[Experiment], progress: Progress) -> Explanation:
    """Fit the base model, search every channel, and fit all that was found together."""
    progress("base model", 0.0)
    cases = [case_of(test) for test in tests]
    whole = Problem(cases, tuple(c for c in CHANNELS if any(c in case.noise for case in cases)))
    before = plain_fit(whole)
    whole = replace(whole, cases=remembered(whole.cases, before))
    stages = count(1)
    findings = search(
        whole, lambda channel: progress(f"effects seen in the {channel}", next(stages) / (len(whole.channels) + 2))
    )
    findings, joint = _together(whole, findings)
    sure = as_estimated(joint)
    return Explanation(before, findings, joint, sure, _afterwards(whole, sure, findings))


def plain_fit(problem: Problem, *known: Fit) -> Fit:
    """Fit without nuisances, each base parameter to its own channel: what an effect-free identification would give.

    A channel that misses an effect then does not pull at the parameters of the others. `known` fits give start values.
    """
    theta, cases = _carried(problem, *known), remembered(problem.cases, *known)
    names = [(p.name, p.case) for p in problem.parameters]
    for channel in problem.in_order:
        part = replace(problem, channels=(channel,), nuisance=None, cases=cases)
        alone = fit(part, _carried(part, *known))
        cases = settled(cases, alone)
        for p, inner in zip(alone.problem.parameters, alone.theta, strict=True):
            theta[names.index((p.name, p.case))] = inner
    return at(problem, theta)


def remembered(cases: Sequence[Case], *fits: Fit) -> list[Case]:
    """The cases with K and convection as fitted earlier, for where these are not fitted."""
    return [
        replace(case, known=dict(case.known) | {key: value for f in fits for key, value in f.base(number).items()})
        for number, case in enumerate(cases)
    ]


def _carried(problem: Problem, *fits: Fit) -> Floats:
    """Inner start values of a problem, taken from earlier fits where these had the parameter."""
    known = {
        (p.name, p.case): float(value)
        for fitted in fits
        for p, value in zip(fitted.problem.parameters, fitted.theta, strict=True)
    }
    return np.array([known.get((p.name, p.case), p.inner(p.start)) for p in problem.parameters])


def _together(whole: Problem, findings: list[Finding]) -> tuple[list[Finding], Fit]:
    """Refit all explained channels jointly; rivals are weighed by all of them."""
    explained = [f for f in findings if f.chosen is not None or not f.missing]
    if not explained:
        return findings, findings[0].base
    names = [name for f in explained if f.chosen for name in f.chosen.names]
    problem = replace(whole, channels=tuple(f.channel for f in explained), effects=tuple(names))
    if not any(f.channel == "traction" for f in explained):
        last = max(findings, key=lambda f: DRIVEN.index(f.channel)).base.problem
        problem = replace(problem, cases=last.cases, settled=last.settled)
    joint = refit(problem, _carried(problem, *(f.chosen.fit if f.chosen else f.base for f in explained)))
    for number, finding in enumerate(findings):
        rivals = [c for c in finding.candidates if c.passed and c.probability > NEGLIGIBLE][:RIVALS]
        if finding.chosen is None or len(rivals) < 2:
            continue
        others = [name for name in joint.effects if name not in finding.chosen.names]
        weighed = weigh([_jointly(joint, others, rival) for rival in rivals])
        best = max(weighed, key=lambda c: c.probability)
        rest = [c for c in finding.candidates if c.names not in {w.names for w in weighed}]
        findings[number] = replace(finding, candidates=[*weighed, *rest], chosen=best)
        joint = best.fit
    return findings, joint


def _jointly(joint: Fit, others: Sequence[str], rival: Candidate) -> Candidate:
    """A rival explanation fitted to all explained channels, beside the effects of the other channels."""
    problem = joint.problem.with_effects(*others, *rival.names)
    fitted = fit(problem, _carried(problem, rival.fit, joint))
    return replace(rival, fit=fitted, evidence=akaike(fitted) - akaike(joint))


def as_estimated(fitted: Fit) -> Fit:
    """The fit under the noise as estimated: the caution of the tests of significance would widen the intervals."""
    cases = [
        replace(case, noise={channel: replace(noise, cautious=None) for channel, noise in case.noise.items()})
        for case in fitted.problem.cases
    ]
    return refit(replace(fitted.problem, cases=cases), fitted.theta)


def _afterwards(whole: Problem, joint: Fit, findings: Sequence[Finding]) -> dict[Channel, Fit]:
    """The revised model of each channel: the effects found are declared, as the revised definition will say.

    Where the friction stays unexplained, the other channels are judged with friction as it was measured.
    """
    cases = [
        replace(case, model=replace(case.model, experiment=replace(case.test, effects=other.test.effects)))
        for case, other in zip(whole.cases, settled(whole.cases, joint), strict=True)
    ]
    revised = plain_fit(replace(whole, cases=cases), joint)
    after = dict.fromkeys(whole.channels, revised)
    if any(f.channel == "traction" and f.missing and f.chosen is None for f in findings):
        freed = replace(whole, cases=[free_friction(case) for case in cases], channels=whole.channels[1:])
        if freed.channels:
            after.update(dict.fromkeys(freed.channels, plain_fit(freed, joint)))
    return after
