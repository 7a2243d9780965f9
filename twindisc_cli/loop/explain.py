"""What a set of tests says: the base model, the answer to what it lacks, and how far each is from what was measured."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from twindisc_cli.loop.channels import channels
from twindisc_cli.loop.fit import Fit, carried, fit, plain_fit, refit, remembered
from twindisc_cli.loop.holdout import withheld, without
from twindisc_cli.loop.judge import Judged, judge, rises
from twindisc_cli.loop.mixture import Mixture, mixture_of
from twindisc_cli.loop.noise import Mask
from twindisc_cli.loop.problem import Problem, problem_of
from twindisc_cli.loop.resample import weights
from twindisc_cli.loop.search import Explanation, Search, preferred, ranked, search
from twindisc_cli.loop.thresholds import THRESHOLDS
from twindisc_cli.loop.validate import at_its_own_level, elsewhere, predict_test
from twindisc_cli.model.experiment import Experiment, Floats

Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Outcome:
    """The search, its answer as judged, and the explanations that were compared with it.

    Search, members and shares have seen no sample that is held out. mixture: what predicts. members: complete
    explanations; shares: their mean weight over the resamples (member,), NaN where not resampled. refused: answers
    whose error rises. on_all: what a choice among the explanations fitted to all samples would be, None where not
    asked. sure: the answer on all samples under the noise as estimated.
    """

    search: Search
    judged: Judged
    mixture: Mixture
    members: Sequence[Explanation]
    shares: Floats
    refused: Mapping[frozenset[tuple[str, ...]], str]
    on_all: frozenset[tuple[str, ...]] | None
    sure: Fit

    @property
    def problem(self) -> Problem:
        """The tests, their channels and noise."""
        return self.judged.before.problem

    @property
    def answer(self) -> Explanation:
        """The explanation that is given."""
        return self.judged.explanation

    @property
    def blind(self) -> bool:
        """Whether the held-out samples had no say: the answer is what the search chose without them."""
        return self.answer.labels == self.search.answer.labels


def explain(tests: Sequence[Experiment], *, validate: Experiment | None, quick: bool, progress: Progress) -> Outcome:
    """Search the tests without the samples held out, and judge the answer, and then its rivals, on these.

    Search, choice, noise and fit see none of the samples held out. The parameters of the answer are then estimated on
    all samples.
    """
    masks = [withheld(test) for test in tests]
    seen = problem_of([without(test, mask) for test, mask in zip(tests, masks, strict=True)])
    seen_before = plain_fit(seen)
    seen = replace(seen, cases=remembered(seen.cases, seen_before))
    other = elsewhere(validate, seen_before) if validate is not None else None
    found = search(seen, lambda stage: progress(stage, 0.3), other)
    progress("judging on held-out samples", 0.75)
    members = ranked(
        [found.answer, *(e for rivals in found.rivals.values() for e in rivals), *found.others, found.base]
    )
    apart = any(mask.any() for test in masks for mask in test.values())
    before = plain_fit(problem_of(tests), seen_before) if apart else seen_before
    judged, refused = _first_honest(found.answer, members, validate, before, seen_before, masks)
    progress("resampling", 0.85)
    shares = np.full(len(members), np.nan) if quick else np.mean(weights(members), axis=0)
    on_all = None if quick or not apart else chosen_on_all(judged, members)
    mixture = mixture_of(judged, members, shares, refused, masks)
    return Outcome(found, judged, mixture, members, shares, refused, on_all, as_estimated(judged.estimated))


def chosen_on_all(judged: Judged, members: Sequence[Explanation]) -> frozenset[tuple[str, ...]]:
    """What would be chosen among the explanations near the answer if they were fitted to all samples."""
    answer, whole = judged.explanation, judged.estimated
    base = refit(judged.before.problem, judged.before.theta) if answer.terms else whole
    again = [replace(answer, fit=whole, before=base.chi2)]
    near = [m for m in members if m.labels != answer.labels and not m.fit.at_bound]
    near = [m for m in near if (answer.evidence - m.evidence) / answer.heat < 2.0 * THRESHOLDS.within]
    for member in near[: THRESHOLDS.rivals]:
        problem = replace(whole.problem.with_terms(*member.terms, trial=member.fit.problem.trial))
        again.append(replace(member, fit=fit(problem, carried(problem, whole, member.fit)), before=base.chi2))
    return preferred(again).labels


def _first_honest(
    answer: Explanation,
    members: Sequence[Explanation],
    validate: Experiment | None,
    before: Fit,
    seen_before: Fit,
    masks: Sequence[Mapping[str, Mask]],
) -> tuple[Judged, dict[frozenset[tuple[str, ...]], str]]:
    """The first explanation whose error rises nowhere: the answer, others, parts of it; the base model raises none.

    What says no more than the base model does is no answer, whatever was refused before it.
    """
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

    Level and form of a channel that is predicted within its noise are up to chance. A test has a level of its own: what
    predicts its course better once the level is known is not refused for the level.
    """
    first, last = predict_test(test, judged.unseen_before), predict_test(test, judged.unseen_after)
    open_ = [c for c, noise in first.case.noise.items() if last.error(c) > THRESHOLDS.at_noise * noise.std]
    raised = [c for c in open_ if rises(first.misses(c), last.misses(c))]
    if not raised:
        return []
    own = at_its_own_level(first), at_its_own_level(last)
    return [c for c in raised if own[1].error(c) > (1.0 - THRESHOLDS.rise) * own[0].error(c)]


def as_estimated(fitted: Fit) -> Fit:
    """The fit under the noise as estimated: the caution of the tests of significance would widen the intervals."""
    cases = [
        replace(case, noise={channel: replace(noise, cautious=None) for channel, noise in case.noise.items()})
        for case in fitted.problem.cases
    ]
    return refit(replace(fitted.problem, cases=cases, nuisance=None), fitted.theta)
