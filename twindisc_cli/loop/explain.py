"""What a set of tests says: the base model, the answer to what it lacks, and how far each is from what was measured."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from twindisc_cli.laws.trial import Trial
from twindisc_cli.loop.channels import channels
from twindisc_cli.loop.fit import Fit, at, carried, fit, refit, remembered
from twindisc_cli.loop.holdout import withheld, without
from twindisc_cli.loop.noise import Mask
from twindisc_cli.loop.problem import Case, Problem, cases_of
from twindisc_cli.loop.resample import unseen, weights
from twindisc_cli.loop.search import Explanation, Search, ranked, search
from twindisc_cli.loop.thresholds import THRESHOLDS
from twindisc_cli.loop.validate import elsewhere, foretell, rms
from twindisc_cli.model.experiment import Experiment, Floats
from twindisc_cli.model.forward import Prediction

Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Judged:
    """An explanation with the revised model, on all samples and on those that were not held out.

    before, after: the base and the revised model fitted to all samples; unseen_before, unseen_after: to the samples
    that are not held out. Errors are over a channel of all tests, (fitted, held out), each in SI units.
    """

    explanation: Explanation
    before: Fit
    after: Fit
    unseen_before: Fit
    unseen_after: Fit
    masks: Sequence[Mapping[str, Mask]]

    @cached_property
    def predictions(self) -> dict[str, list[Prediction]]:
        """Predictions of all tests at all samples by each of the four fits."""
        cases = self.before.problem.cases
        return {
            kind: predicted(getattr(self, kind), cases) for kind in ("before", "after", "unseen_before", "unseen_after")
        }

    def misses(self, channel: str, kind: str, *, held_out: bool) -> Floats:
        """Measured minus predicted of a channel, in the order of the record (sample,)."""
        misses = []
        for i, case in enumerate(self.before.problem.cases):
            if channel in case.noise:
                order = case.noise[channel].order
                order = order[self.masks[i][channel][order] == held_out]
                predicted = channels()[channel].predicted(case.model, self.predictions[kind][i])[0]
                misses.append((case.values(channel) - predicted)[order])
        return np.concatenate(misses)

    def error(self, channel: str, kind: str, *, held_out: bool) -> float:
        """Root mean square of measured minus predicted; NaN without samples."""
        return rms(self.misses(channel, kind, held_out=held_out))

    @property
    def rises(self) -> list[str]:
        """Channels in which the error after is above the error before, fitted or held out, beyond chance."""
        found = []
        for channel in self.before.problem.channels:
            for held_out, first, last in ((False, "before", "after"), (True, "unseen_before", "unseen_after")):
                before, after = (self.misses(channel, kind, held_out=held_out) for kind in (first, last))
                if rises(before, after):
                    found.append(channel)
        return list(dict.fromkeys(found))


def rises(before: Floats, after: Floats) -> bool:
    """Whether misses (sample,) grew from before to after: by more than blocks of neighbours scatter, or by far."""
    if len(before) < THRESHOLDS.fewest_judged:
        return False
    growth = rms(after) / max(rms(before), 1e-300) - 1.0
    parts = np.array_split(after**2 - before**2, min(THRESHOLDS.judged_blocks, len(before) // 2))
    means = np.array([part.mean() for part in parts])
    chance = float(means.std(ddof=1)) / np.sqrt(len(means))
    sure = float(means.mean()) > THRESHOLDS.rise_errors * chance
    return bool(growth > THRESHOLDS.rise_at_most or (growth > THRESHOLDS.rise and sure))


@dataclass(frozen=True)
class Outcome:
    """The search, its answer as judged, and the explanations that were weighed against it.

    members: complete explanations; shares: their mean weight over the resamples (member,), NaN where not resampled;
    blind: the member that would be chosen without the samples held out; refused: answers whose error rises.
    """

    search: Search
    judged: Judged
    members: Sequence[Explanation]
    shares: Floats
    blind: Explanation
    refused: Mapping[frozenset[tuple[str, ...]], str]
    sure: Fit

    @property
    def problem(self) -> Problem:
        """The tests, their channels and noise."""
        return self.judged.before.problem

    @property
    def answer(self) -> Explanation:
        """The explanation that is given."""
        return self.judged.explanation


def explain(tests: Sequence[Experiment], *, validate: Experiment | None, quick: bool, progress: Progress) -> Outcome:
    """Search the tests, choose the best answer that raises no error, and weigh it against the others."""
    whole = problem_of(tests)
    before = plain_fit(whole)
    whole = replace(whole, cases=remembered(whole.cases, before))
    masks = [withheld(test) for test in tests]
    other = elsewhere(validate, before) if validate is not None else None
    found = search(whole, lambda stage: progress(stage, 0.3), other)
    progress("judging on held-out samples", 0.75)
    members = ranked(
        [found.answer, *(e for rivals in found.rivals.values() for e in rivals), *found.others, found.base]
    )
    judged, refused = _first_honest(found.answer, members, tests, validate, before, masks)
    progress("resampling", 0.85)
    shares = np.full(len(members), np.nan) if quick else np.mean(weights(members), axis=0)
    held = np.concatenate([_white_mask(whole, i, c, masks) for i, c in whole.parts])
    return Outcome(
        found, judged, members, shares, members[unseen(members, held)], refused, as_estimated(judged.explanation.fit)
    )


def problem_of(tests: Sequence[Experiment]) -> Problem:
    """All channels of the tests, with their noise."""
    cases = cases_of(tests)
    return Problem(cases, tuple(c for c in channels() if any(c in case.noise for case in cases)))


def _white_mask(problem: Problem, number: int, channel: str, masks: Sequence[Mapping[str, Mask]]) -> Floats:
    """Which white samples of a channel are held out, as numbers (sample,)."""
    noise = problem.cases[number].noise[channel]
    return masks[number][channel][noise.order].astype(float)


def _first_honest(
    answer: Explanation,
    members: Sequence[Explanation],
    tests: Sequence[Experiment],
    validate: Experiment | None,
    before: Fit,
    masks: Sequence[Mapping[str, Mask]],
) -> tuple[Judged, dict[frozenset[tuple[str, ...]], str]]:
    """The first explanation whose error rises nowhere: the answer, others, parts of it; the base model raises none.

    What says no more than the base model does is no answer, whatever was refused before it.
    """
    seen = [without(test, mask) for test, mask in zip(tests, masks, strict=True)]
    apart = any(mask.any() for test in masks for mask in test.values())
    seen_before = plain_fit(problem_of(seen), before) if apart else before
    refused = {}
    base = next(m for m in members if not m.terms)
    others = [m for m in members if m.labels != answer.labels and m.evidence - base.evidence > THRESHOLDS.enough]
    shorter = [m for m in others if m.labels < answer.labels]
    for member in [answer, *others[: THRESHOLDS.most_refused], *shorter, base]:
        if member.labels in refused:
            continue
        judged = judge(member, before, seen_before, masks)
        raised = judged.rises or (_raised_elsewhere(judged, validate) if validate is not None else [])
        if not member.terms or not raised:
            break
        refused[member.labels] = f"raises the error of the {' and the '.join(channels()[c].label for c in raised)}"
    return judged, refused


def _raised_elsewhere(judged: Judged, test: Experiment) -> list[str]:
    """Channels of a test that was not fitted in which the revised model is worse than the base, and than the noise.

    Level and form of a channel that is foretold within its noise hang on chance.
    """
    first, last = foretell(test, judged.before), foretell(test, judged.after)
    open_ = [c for c, noise in first.case.noise.items() if last.error(c) > THRESHOLDS.at_noise * noise.std]
    return [c for c in open_ if rises(first.misses(c), last.misses(c))]


def judge(member: Explanation, before: Fit, seen_before: Fit, masks: Sequence[Mapping[str, Mask]]) -> Judged:
    """An explanation's errors, where all samples were seen and where those held out were not."""
    after = revised_fit(member.fit, before)
    if not member.terms:
        return Judged(member, before, before, seen_before, seen_before, masks)
    blind = after
    if seen_before is not before:
        problem = seen_before.problem.with_terms(*member.terms, trial=member.fit.problem.trial)
        refitted = fit(problem, carried(problem, member.fit, seen_before))
        blind = revised_fit(refitted, seen_before)
    return Judged(member, before, after, seen_before, blind, masks)


def plain_fit(problem: Problem, *known: Fit) -> Fit:
    """Fit without nuisances, each base parameter to its own channel: what an effect-free identification would give.

    A channel that misses an effect then does not pull at the parameters of the others. `known` fits give start values.
    """
    theta, cases = carried(problem, *known), remembered(problem.cases, *known)
    names = [(p.name, p.case) for p in problem.parameters]
    for channel in problem.channels:
        part = replace(problem, channels=(channel,), nuisance=None, cases=cases)
        alone = fit(part, carried(part, *known))
        cases = remembered(cases, alone)
        for p, inner in zip(alone.problem.parameters, alone.theta, strict=True):
            theta[names.index((p.name, p.case))] = inner
    return at(replace(problem, nuisance=None, tracks=None), theta)


def revised_fit(fitted: Fit, before: Fit) -> Fit:
    """The revised model: what was found is declared, as the revised definition will say, the base fitted anew."""
    cases = [revised_case(case, fitted) for case in before.problem.cases]
    tracks = fitted.problem.followed(fitted.theta).tracks
    return plain_fit(replace(before.problem, cases=cases, tracks=tracks), fitted, before)


def revised_case(case: Case, fitted: Fit) -> Case:
    """A test with the effects and the laws of a fit declared."""
    effects, laws = dict(case.test.effects), dict(case.test.laws)
    for name in fitted.terms:
        effect = fitted.problem.effect(name)
        if isinstance(effect, Trial):
            laws[name] = effect.law(fitted.values(name))
        else:
            effects[name] = fitted.values(name)
    return replace(case, model=replace(case.model, experiment=replace(case.test, effects=effects, laws=laws)))


def predicted(fitted: Fit, cases: Sequence[Case]) -> list[Prediction]:
    """Predictions at all samples of these tests by a fit that may have seen fewer of them."""
    whole = [
        replace(case, model=replace(case.model, experiment=replace(case.test, measured=other.test.measured)))
        for case, other in zip(fitted.problem.cases, cases, strict=True)
    ]
    whole = [replace(case, known=first.held) for case, first in zip(whole, fitted.problem.cases, strict=True)]
    return replace(fitted.problem, cases=whole).predict(fitted.theta[None])


def as_estimated(fitted: Fit) -> Fit:
    """The fit under the noise as estimated: the caution of the tests of significance would widen the intervals."""
    cases = [
        replace(case, noise={channel: replace(noise, cautious=None) for channel, noise in case.noise.items()})
        for case in fitted.problem.cases
    ]
    return refit(replace(fitted.problem, cases=cases, nuisance=None), fitted.theta)
