"""What a set of tests says: the base model, the answer to what it lacks, and how far each is from what was measured."""

from __future__ import annotations

from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from twindisc_cli.laws.trial import Trial
from twindisc_cli.loop.alternatives import Compared, Weighed, by_probability, weighed
from twindisc_cli.loop.candidates import proposals_in
from twindisc_cli.loop.channels import channels
from twindisc_cli.loop.choose import chosen, preferred
from twindisc_cli.loop.edges import edges_anew
from twindisc_cli.loop.explanation import Explanation, by_falling_share, on_samples_of, ranked
from twindisc_cli.loop.extend import each_promising
from twindisc_cli.loop.fit import Fit, base_fit, carried, fit, refit
from twindisc_cli.loop.holdout import holds_out, withheld, without
from twindisc_cli.loop.judge import Judged, fall, judge, rises
from twindisc_cli.loop.mixture import Mixture, mixture_of
from twindisc_cli.loop.noise import Mask
from twindisc_cli.loop.noise_choice import searched, with_noise_like
from twindisc_cli.loop.problem import Case, Problem, problem_of
from twindisc_cli.loop.refusal import Refusal
from twindisc_cli.loop.resample import shares
from twindisc_cli.loop.screen import Residual, is_unexplained, left_over_explained, unexplained_residual
from twindisc_cli.loop.search import Search
from twindisc_cli.loop.term_intervals import fixes_a_size
from twindisc_cli.loop.terms import EffectTerm, Term
from twindisc_cli.loop.thresholds import ACCEPTANCE, RESAMPLING, SEARCH
from twindisc_cli.loop.validate import at_its_own_level, predict_test
from twindisc_cli.model.experiment import Experiment, Floats

Progress = Callable[[str, float], None]
SEARCHED = 0.8
"""Share of the time that the search takes, at most."""


@dataclass(frozen=True)
class Outcome:
    """The search, its answer as judged, and the explanations that were compared with it.

    Search and compared have seen no sample that is held out. mixture: what predicts. compared: the answer among all
    explanations. refused: what is not given, and why. on_all: what a choice among the explanations fitted to all
    samples would be, None where not asked. sure: the answer on all samples under the noise as estimated. whole:
    channels of which all samples were searched after all, since they show more than was found without some;
    left_on_all: what the answer leaves of all samples, significant, where these were searched in vain. or_noise: terms
    that explain as much without the noise that is there in their place; or_scatter: whether a mu that scatters from
    step to step would explain as much in the traction.
    """

    search: Search
    judged: Judged
    mixture: Mixture
    compared: Compared
    refused: Mapping[frozenset[Term], Refusal]
    on_all: frozenset[Term] | None
    sure: Fit
    whole: tuple[str, ...] = ()
    left_on_all: tuple[Residual, ...] = ()
    or_noise: frozenset[Term] = frozenset()
    or_scatter: bool = False

    @property
    def problem(self) -> Problem:
        """The tests, their channels and noise."""
        return self.judged.before.problem

    @property
    def answer(self) -> Explanation:
        """The explanation that is given."""
        return self.judged.explanation

    @property
    def members(self) -> Sequence[Explanation]:
        """All explanations."""
        return self.compared.members

    @property
    def shares(self) -> Floats:
        """Probabilities of the explanations (member,); NaN where nothing was resampled."""
        return self.compared.shares

    @property
    def blind(self) -> bool:
        """Whether the held-out samples had no say in which explanation is given."""
        return not self.whole and not any(refusal.reason == "does not predict" for refusal in self.refused.values())


def explain(tests: Sequence[Experiment], *, validate: Case | None, quick: bool, progress: Progress) -> Outcome:
    """Search the tests without the samples held out, and judge the answer, and then its rivals, on these.

    Search, choice, noise and fit see none of the samples held out. The parameters of the answer are then estimated on
    all samples. Channels of which all samples show more than what is given are searched as a whole after that.
    """
    masks = [withheld(test) for test in tests]
    first = _explained(tests, masks, validate, quick=quick, progress=progress)
    left = _left_by_effects(first)
    if first.search.is_cut:
        return replace(first, left_on_all=tuple(left.values()))
    missing = _missing(first)
    more = {channel for channel, rest in left.items() if _is_another_effect(first, rest)}
    for among in filter(None, (more | missing, missing)):
        whole = tuple(channel for channel in first.problem.channels if channel in among)
        again = _explained(
            tests,
            [{c: np.zeros_like(mask) if c in whole else mask for c, mask in test.items()} for test in masks],
            validate,
            whole,
            quick=quick,
            progress=lambda what, share: progress(what, max(share, SEARCHED)),
        )
        if all(_explains_all(again, first, channel) for channel in more & among):
            return replace(again, whole=whole, left_on_all=tuple(rest for c, rest in left.items() if c not in among))
    return replace(first, left_on_all=tuple(left.values()))


def _left_by_effects(outcome: Outcome) -> dict[str, Residual]:
    """What effects of the catalogue leave of all samples, where it is significant, by channel.

    A law need not reach beyond the samples it was learnt on.
    """
    return significant_on_all(outcome, _held_out(outcome) & _by_effects(outcome.answer))


def _is_another_effect(outcome: Outcome, left: Residual) -> bool:
    """Whether what is left of all samples is too large for the own error of the formulas found."""
    judged = outcome.judged
    return left_over_explained(left, judged.estimated, judged.base_estimated) > ACCEPTANCE.another_effect


def _missing(outcome: Outcome) -> set[str]:
    """Channels with samples held out in which nothing is given, and all samples show something.

    What is left of them is significant, or all samples let a term be chosen, or one more where generic functions see
    anything.
    """
    answer = outcome.answer
    unexplained = _held_out(outcome) - answer.explained
    shown = _channels_of_choice(outcome) & unexplained if not answer.terms else set()
    left = _left_on_all(outcome, unexplained - shown)
    shown |= _significant(outcome, left).keys()
    seen = {channel for channel, rest in left.items() if rest.p_value <= SEARCH.nothing_left} - shown
    return shown | (_channels_of_more(outcome.judged, seen) & unexplained if seen else set())


def _held_out(outcome: Outcome) -> set[str]:
    """Channels with samples held out."""
    return {channel for test in outcome.judged.masks for channel, mask in test.items() if mask.any()}


def _by_effects(answer: Explanation) -> set[str]:
    """Channels in which effects of the catalogue show first, and no law."""
    return answer.explained - {answer.fit.problem.shown_in(law) for law in answer.laws.values()}


def _left_on_all(outcome: Outcome, among: Container[str]) -> dict[str, Residual]:
    """What the answer leaves of all samples, by channel."""
    whole = outcome.judged.estimated
    return {c: unexplained_residual(whole, c) for c in outcome.problem.channels if c in among}


def significant_on_all(outcome: Outcome, among: Container[str]) -> dict[str, Residual]:
    """What the answer leaves of all samples that is more than noise and the formulas' own error, by channel."""
    return _significant(outcome, _left_on_all(outcome, among))


def _significant(outcome: Outcome, left: Mapping[str, Residual]) -> dict[str, Residual]:
    """That of it which is more than noise and the formulas' own error."""
    judged = outcome.judged
    return {c: rest for c, rest in left.items() if is_unexplained(rest, judged.estimated, judged.base_estimated)}


def _explains_all(again: Outcome, first: Outcome, channel: str) -> bool:
    """Whether effects found with all samples of a channel leave nothing of it, and err no more on those seen before."""
    seen = replace(again.judged, masks=first.judged.masks)
    before = first.judged.error(channel, "unseen_after", held_out=False)
    after = seen.error(channel, "after", held_out=False)
    complete = channel in _by_effects(again.answer) and not significant_on_all(again, [channel])
    return complete and after <= (1.0 + ACCEPTANCE.growth) * before


def _channels_of_choice(outcome: Outcome) -> set[str]:
    """Channels of what would be chosen on all samples, unless it was refused."""
    member = next((m for m in outcome.members if m.labels == outcome.on_all), None)
    if member is None or member.labels in outcome.refused:
        return set()
    return member.explained


def _channels_of_more(judged: Judged, unexplained: Container[str]) -> set[str]:
    """Channels of the answer with one more term in the unexplained ones, if all samples let it be chosen."""
    answer = on_samples_of(judged.base_estimated, judged.explanation, judged.estimated)
    promising = [p for p in proposals_in(answer.fit, unexplained) if p.promise > 0.5 * SEARCH.effect_evidence]
    more = (one.explained for one in each_promising(answer, promising) if chosen(answer, [one]))
    return next(more, set())


def _explained(
    tests: Sequence[Experiment],
    masks: Sequence[Mapping[str, Mask]],
    validate: Case | None,
    missing: Sequence[str] = (),
    *,
    quick: bool,
    progress: Progress,
) -> Outcome:
    """The same with these samples held out of every channel of the tests; missing: channels that lack something."""
    left = [without(test, mask) for test, mask in zip(tests, masks, strict=True)]
    found = searched(problem_of(left, unlike=True), validate, _by_stage(progress), missing)
    seen_before, validate, result = found.base, found.validate, found.search
    members = ranked(
        [result.answer, *(e for rivals in result.rivals.values() for e in rivals), *result.others, result.base]
    )
    apart = holds_out(masks)
    before = seen_before
    if apart:
        before = base_fit(with_noise_like(problem_of(tests, unlike=True), seen_before.problem), seen_before)
    progress("judging on held-out samples", 0.8)
    chances = np.full(len(members), np.nan) if quick else shares(members)
    compared = Compared(result.answer, members, chances, result.base)
    if not quick:
        compared = replace(compared, answer=most_probable(compared))
    judged, refused = _given(compared, validate, before, seen_before, masks)
    on_all = None if quick or not apart else chosen_on_all(judged, members)
    compared = replace(compared, answer=judged.explanation)
    erring = {labels for labels, refusal in refused.items() if refusal.errs}
    mixture = mixture_of(judged, members, erring, masks)
    sure = as_estimated(judged.estimated)
    return Outcome(
        result,
        judged,
        mixture,
        compared,
        refused,
        on_all,
        sure,
        or_noise=found.or_noise,
        or_scatter=found.or_scatter,
    )


def _by_stage(progress: Progress) -> Callable[[str], None]:
    """Progress of a search, of which nobody knows how many stages it has: each takes a quarter of what is left."""
    left = [SEARCHED]

    def stage(what: str) -> None:
        left[0] *= 0.75
        progress(what, SEARCHED - left[0])

    return stage


def chosen_on_all(judged: Judged, members: Sequence[Explanation]) -> frozenset[Term]:
    """What would be chosen among the explanations near the answer if they were fitted to all samples.

    Where the answer is the base model, another has to say enough.
    """
    answer, whole, base = judged.explanation, judged.estimated, judged.base_estimated
    again = [on_samples_of(base, answer, whole)]
    near = [m for m in members if m.labels != answer.labels and not m.fit.at_bound]
    near = [m for m in near if (answer.evidence - m.evidence) / answer.evidence_scale < 2.0 * SEARCH.equivalent]
    for member in near[: SEARCH.most_rivals]:
        problem = whole.problem.with_terms(*member.terms, trial=member.fit.problem.trial)
        fitted = edges_anew(fit(problem, carried(problem, whole, member.fit)))
        again.append(on_samples_of(base, member, fitted))
    best = preferred(again) if answer.terms else chosen(again[0], again[1:]) or again[0]
    return best.labels


def most_probable(compared: Compared) -> Explanation:
    """The answer with each term exchanged for what the resamples choose more often in its place.

    Or the part of it that they choose more often than all that holds this part and more.
    """
    for _ in range(SEARCH.most_terms):
        better = [
            explanation for name in compared.answer.terms if (explanation := _more_probable(compared, name)) is not None
        ]
        if not better:
            break
        compared = replace(compared, answer=better[0])
    return next((member for member in compared.members if _is_enough(compared, member)), compared.answer)


def _is_enough(compared: Compared, part: Explanation) -> bool:
    """Whether the resamples choose a part of the answer more often than all that holds it and more."""
    if not part.terms or not part.labels < compared.answer.labels:
        return False
    share = {member.labels: weight for member, weight in zip(compared.members, compared.weights, strict=True)}
    more = sum(weight for labels, weight in share.items() if part.labels < labels)
    return bool(share[part.labels] > more + RESAMPLING.share_error)


def _more_probable(compared: Compared, name: str) -> Explanation | None:
    """The explanation with what is chosen more often in the place of a term; None where that is the term itself."""
    result, places = weighed(compared, name), compared.in_place_of(name)
    likely = [
        alternative
        for alternative in result.alternatives
        if alternative.term in places
        and not places[alternative.term].fit.at_bound
        and not _is_the_record_of(compared, name, places[alternative.term])
    ]
    chance = {
        a.term: a.probability if isinstance(a.term, EffectTerm) else result.chances.get(a.term, 0.0) for a in likely
    }
    best = next((term for term, _ in by_probability(chance)), None)
    if best is None or not chance[best] > result.probability + RESAMPLING.share_error:
        return None
    return places[best]


def _is_the_record_of(compared: Compared, name: str, other: Explanation) -> bool:
    """Whether another explanation says of a sensor what a term says of the rig: then the rig's is given."""
    answer = compared.answer
    stages = {other.effect(n).stage for n in other.terms} - {answer.effect(n).stage for n in answer.terms}
    same = compared.similarity(name, answer, other) > RESAMPLING.same_response
    return same and "sensor" in stages and answer.effect(name).stage != "sensor"


def _given(
    compared: Compared,
    unseen: Case | None,
    before: Fit,
    seen_before: Fit,
    masks: Sequence[Mapping[str, Mask]],
) -> tuple[Judged, dict[frozenset[Term], Refusal]]:
    """The first explanation that nothing speaks against: the answer, others by their weight, parts of these, the base.

    What says no more than the base model does is no answer, whatever was refused before it.
    """
    member, refused = compared.answer, dict[frozenset[Term], Refusal]()
    while True:
        judged = judge(member, before, seen_before, masks)
        refusal = _refusal(replace(_without(compared, refused), answer=member), compared, judged, unseen)
        if refusal is None:
            return judged, refused
        refused[member.labels] = refusal
        member = next_to_judge(compared, refused)


def next_to_judge(compared: Compared, refused: Mapping[frozenset[Term], Refusal]) -> Explanation:
    """The explanation to be judged after others were refused: the most probable one left, or the base model."""
    left = _without(compared, refused)
    others = [
        m
        for m in by_falling_share(left.members, left.weights)
        if m.labels not in refused and m.evidence - compared.base.evidence > SEARCH.effect_evidence
    ]
    if len(refused) > ACCEPTANCE.most_refused:
        others = [m for m in others if any(m.labels < labels for labels in refused)]
    return others[0] if others else compared.base


def _without(compared: Compared, refused: Mapping[frozenset[Term], Refusal]) -> Compared:
    """The same with all weight on what was not refused for what it predicts, in every resample."""
    wrong = {labels for labels, refusal in refused.items() if refusal.reason != "rarely chosen"}
    members = [member for member in compared.members if member.labels not in wrong]
    if len(members) == len(compared.members) or not np.isfinite(compared.shares).all():
        return compared
    left = dict(zip((m.labels for m in members), shares(members), strict=True))
    return replace(compared, shares=np.array([left.get(m.labels, 0.0) for m in compared.members]))


def _refusal(compared: Compared, every: Compared, judged: Judged, other: Case | None) -> Refusal | None:
    """What speaks against giving an explanation; None where nothing does, or where it is the base model.

    compared: with all weight on what was not refused; every: with those that were.
    """
    answer = compared.answer
    if not answer.terms:
        return None
    loose = [str(answer.term(name)) for name in answer.terms if _is_loose(answer, name)]
    if loose:
        return Refusal("at a bound", f"has a parameter of {' and '.join(loose)} at a bound, or fixed by nothing")
    first = replace(every, answer=answer)
    rare = [str(answer.term(n)) for n in answer.terms if _is_rare(compared, n) or is_negligible(weighed(first, n))]
    if rare:
        return Refusal("rarely chosen", f"names {' and '.join(rare)}, which few resamples choose")
    raised = [c for c in judged.rises(held_out=False) if _misses_more(answer.fit, compared.base.fit, c)]
    raised = raised or (_raised_elsewhere(judged, compared.base, other) if other is not None else [])
    unseen = judged.rises(held_out=True)
    if raised or unseen:
        names = " and the ".join(channels()[c].label for c in dict.fromkeys([*raised, *unseen]))
        where = " of samples held out: it explains these samples and does not predict others" if not raised else ""
        return Refusal("raises the error" if raised else "does not predict", f"raises the error of the {names}{where}")
    return None


def _misses_more(fitted: Fit, base: Fit, channel: str) -> bool:
    """Whether a channel is missed by more than the base model does, beyond what its inputs' tolerances allow."""
    return fitted.power(channel) > (1.0 + ACCEPTANCE.growth) ** 2 * base.power(channel)


def _is_rare(compared: Compared, name: str) -> bool:
    """Whether a term is too improbable to be given, or all that stands in its place; not where nothing was resampled.

    Where several share its place, each is improbable, and one is given with the others beside it.
    """
    found = weighed(compared, name)
    explained = 1.0 - compared.remains(compared.answer.fit.problem.shown_in(compared.answer.effect(name)))
    together = found.probability + sum(other.probability for other in found.alternatives)
    return together * explained < RESAMPLING.least_probability or is_negligible(found)


def is_negligible(found: Weighed) -> bool:
    """Whether so few resamples choose a term that it is not even an alternative."""
    return found.probability < RESAMPLING.rival_share


def _is_loose(answer: Explanation, name: str) -> bool:
    """Whether every size of an effect stands at a bound, or can be anything within its bounds.

    Parameters that only shape it may be loose, and one size of several: they are named in a note, and the effect is
    then possible at most.
    """
    return not isinstance(answer.effect(name), Trial) and not fixes_a_size(answer.fit, name)


def _raised_elsewhere(judged: Judged, base: Explanation, test: Case) -> list[str]:
    """Channels of a test that was not fitted in which the revised model is worse than the base, and than the noise.

    None where all channels of that test together, as uncertain as parameters and repeats are, do not speak against it.
    Level and form of a channel that is predicted within its noise are up to chance, and so is a small rise where all
    samples that were not fitted are predicted better. A test has a level of its own: what predicts its course better
    once the level is known is not refused for the level.
    """
    if base.there - judged.explanation.there < SEARCH.equivalent:
        return []
    first, last = predict_test(test, judged.unseen_before), predict_test(test, judged.unseen_after)
    open_ = [c for c, noise in first.case.noise.items() if last.error(c) > ACCEPTANCE.predicted * noise.std]
    falls = [fall(first.misses(c), last.misses(c), noise.std) for c, noise in first.case.noise.items()]
    better = judged.fall + sum(falls) > 0.0
    raised = [c for c in open_ if rises(first.misses(c), last.misses(c), far=better)]
    if not raised:
        return []
    own = at_its_own_level(first), at_its_own_level(last)
    return [c for c in raised if own[1].error(c) > (1.0 - ACCEPTANCE.growth) * own[0].error(c)]


def as_estimated(fitted: Fit) -> Fit:
    """The fit under the noise as estimated: the caution of the tests of significance would widen the intervals."""
    cases = [
        replace(case, noise={channel: replace(noise, cautious=None) for channel, noise in case.noise.items()})
        for case in fitted.problem.cases
    ]
    return refit(replace(fitted.problem, cases=cases, nuisance=None), fitted.theta)
