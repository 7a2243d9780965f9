"""The search for what the model lacks: effects and laws of all stages, judged on all channels at once.

    extend   add the term with the most evidence, as long as it says enough
    swap     exchange each term for a better one, the others fitted beside it
    drop     leave out what no longer says enough

Which terms are fitted is in `extend`, which of them is chosen in `choose`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from twindisc_cli.effects import catalogue
from twindisc_cli.effects._effect import Effect
from twindisc_cli.loop.candidates import Proposal, effects
from twindisc_cli.loop.choose import chosen, preferred
from twindisc_cli.loop.explanation import Explanation, explained_channels, ranked, refitted, without
from twindisc_cli.loop.extend import extended, most_promising, with_one_more
from twindisc_cli.loop.fit import fit, refit
from twindisc_cli.loop.learn import Response, responses
from twindisc_cli.loop.problem import Problem
from twindisc_cli.loop.screen import unexplained_residual
from twindisc_cli.loop.terms import Term
from twindisc_cli.loop.thresholds import RESAMPLING, SEARCH
from twindisc_cli.loop.validate import Elsewhere

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Search:
    """The base model, the answer, and what stands beside it.

    rivals: for each of its terms all explanations in which another stands in its place, or for "" all that were tried
    beside the last answer, where no term was exchanged; others: laws in the place of two effects, and effects in the
    place of a law. is_cut: whether it was ended as it had become too long, and may not have tried all.
    """

    base: Explanation
    answer: Explanation
    rivals: Mapping[str, Sequence[Explanation]]
    others: Sequence[Explanation] = ()
    is_cut: bool = False


def search(
    problem: Problem,
    progress: Progress,
    other: Elsewhere | None = None,
    *,
    enough: Callable[[Explanation, Explanation], bool] = lambda _answer, _base: False,
    missing: Sequence[str] = (),
) -> Search:
    """Find the terms that explain all channels together, and predict another test that is not fitted.

    enough: whether an answer beside the base model ends the search. missing: channels in which something is missing.
    """
    progress("base model")
    base = Explanation.of_base(refit(problem), other)
    best, others = base, list[Explanation]()
    rivals: Mapping[str, Sequence[Explanation]] = {}
    known = set[frozenset[Term]]()
    while (
        best.labels not in known
        and len(best.terms) < SEARCH.most_terms
        and not best.is_spent
        and not (best.can_err and _nothing_left(best, missing))
        and not (best.terms and enough(best, base))
    ):
        known.add(best.labels)
        progress(f"what is missing, term {len(best.terms) + 1}")
        tried = extended(best)
        better = chosen(best, tried)
        if better is None:
            rivals = rivals or {"": tried}
            break
        progress(f"other explanations of {len(better.terms)} terms")
        better, *apart = catalogued(better, best, tried)
        better = refitted(better)
        if enough(better, base):
            best, rivals = better, {"": judged_equally(better, ranked(tried))}
        else:
            best, rivals = without_older_laws(*swap_and_drop(better, best, tried, rivals), best)
        others = judged_equally(best, apart)
    best, rivals = without_two_terms(best, rivals)
    return Search(base, best, rivals, others, best.is_spent)


def _nothing_left(explanation: Explanation, missing: Sequence[str]) -> bool:
    """Whether no generic function of any channel sees anything in what an explanation leaves, and none is missing."""
    fitted = explanation.fit
    return explanation.explained.issuperset(missing) and all(
        unexplained_residual(fitted, channel).p_value > SEARCH.nothing_left for channel in fitted.problem.channels
    )


def catalogued(better: Explanation, before: Explanation, tried: Sequence[Explanation]) -> list[Explanation]:
    """Two effects of the catalogue in the place of a law that was added, where they cannot be separated from it.

    First the explanation to go on with, then the others within reach. The second effect is one of a channel of which
    the law takes a good part, by what it promises beside the first as fitted. Two courses over time of one quantity do
    not stand for a law: sums of settlings follow any curve, as the law does.
    """
    if len(better.laws) == len(before.laws):
        return [better]
    (law,) = (effect for name, effect in better.laws.items() if name not in before.terms)
    both, loose = _two_effects(better, before, tried, better.fit.problem.shown_in(law))
    close = [e for e in both if (better.evidence - e.evidence) / better.evidence_scale < SEARCH.equivalent]
    nearest = {e.labels for e in close}
    return [*close, better, *(e for e in ranked([*both, *loose]) if e.labels not in nearest)][: SEARCH.most_rivals]


def _two_effects(
    better: Explanation, before: Explanation, tried: Sequence[Explanation], channel: str
) -> tuple[list[Explanation], list[Explanation]]:
    """An explanation with two effects beside it in the place of what a better one has more: terms of a channel.

    First those of which the second says something beside the first, half of what an effect must say, then the others.
    Pairs with a term of the better one are among its rivals already.
    """
    least = better.here - SEARCH.equivalent * better.evidence_scale
    alone = {e.terms[-1]: e.here for e in tried}
    lost = explained_channels(before, better)
    shown_in = before.fit.problem.shown_in
    names = [n for n, effect in catalogue().items() if shown_in(effect) in lost and n not in better.terms]
    both, loose = list[Explanation](), list[Explanation]()
    for half in _halves(better, before, tried, channel):
        if half.is_spent:
            break
        for e in most_promising(half, _second(half, names, alone, least), best=max(least - half.here, 0.0)):
            if not e.fit.at_bound and not _courses_over_time(*(e.effect(name) for name in e.terms[-2:])):
                gain = (e.evidence - half.evidence) / half.evidence_scale_for(e)
                (both if gain > 0.5 * SEARCH.effect_evidence else loose).append(e)
    return ranked(both), ranked(loose)


def _second(half: Explanation, names: Sequence[str], alone: Mapping[str, float], least: float) -> list[Proposal]:
    """Those of the effects that bring half an explanation near the least evidence [nats].

    They must promise something, and bring more than alone, as far as their evidence alone is known, by name.
    """
    enough = max(SEARCH.least_share * (least - half.here) + SEARCH.least_promise, 0.0)
    return [p for p in effects(half.fit, names) if p.promise > max(enough, alone.get(p.name, -np.inf) - half.here)]


def _courses_over_time(one: Effect, other: Effect) -> bool:
    """Whether two effects change the same stage over time."""
    return one.over == other.over == "time" and one.stage == other.stage


def _halves(better: Explanation, before: Explanation, tried: Sequence[Explanation], channel: str) -> list[Explanation]:
    """Explanations with the first of two effects that may stand for a law.

    Those that take a good part of what the law takes, and those with another contact, whatever they take: the patch
    alone may leave the misfit as large as it was, and turns the responses to all other effects.
    """
    taken = before.fit.chi2 - better.fit.chi2
    new = [e for e in tried if len(e.laws) == len(before.laws) and e.terms[-1] not in better.terms]
    free = [e for e in new if not e.fit.at_bound]
    large = [e for e in free if before.fit.chi2 - e.fit.chi2 > SEARCH.replaced_share * taken][: SEARCH.replacements]
    known = {*better.terms, *(e.terms[-1] for e in large)}
    shown_in, every = before.fit.problem.shown_in, catalogue().items()
    contacts = [n for n, e in every if e.stage == "contact" and shown_in(e) == channel and n not in known]
    return [*large, *(with_one_more(before, p) for p in effects(before.fit, contacts))]


def without_older_laws(
    explanation: Explanation, rivals: Mapping[str, Sequence[Explanation]], before: Explanation
) -> tuple[Explanation, Mapping[str, Sequence[Explanation]]]:
    """The same with two effects in the place of a law that was there before: beside a new term they may say more."""
    for name in explanation.laws:
        known = name in before.terms and name in rivals
        if not known or len(explanation.terms) == SEARCH.most_terms or explanation.is_spent:
            continue
        shorter = without(explanation, name)
        tried = [e for e in rivals[name] if len(e.terms) == len(explanation.terms)]
        two = _still_preferred(catalogued(explanation, shorter, tried)[0], explanation)
        if two is not explanation:
            return swap_and_drop(two, shorter, [])
    return explanation, rivals


def without_two_terms(
    explanation: Explanation, rivals: Mapping[str, Sequence[Explanation]]
) -> tuple[Explanation, Mapping[str, Sequence[Explanation]]]:
    """The same with two effects in the place of two terms of a channel, one of them a law, where they say more.

    One by one they were exchanged for laws while another channel was not explained yet.
    """
    for channel in explanation.fit.problem.channels:
        own = explanation.terms_in(channel)
        if len(own) != 2 or not any(name in explanation.laws for name in own) or explanation.is_spent:
            continue
        shorter = without(without(explanation, own[0]), own[1])
        tried = most_promising(shorter, effects(shorter.fit))
        two = preferred([explanation, *_two_effects(explanation, shorter, tried, channel)[0]])
        two = _still_preferred(two, explanation)
        if two is not explanation:
            return swap_and_drop(two, shorter, [])
    return explanation, rivals


def _still_preferred(two: Explanation, explanation: Explanation) -> Explanation:
    """What was preferred to an explanation with its nuisances, if it still is, inside its bounds, with its own."""
    if two is explanation:
        return explanation
    again = refitted(two)
    return explanation if again.fit.at_bound else preferred([explanation, again])


def swap_and_drop(
    explanation: Explanation,
    before: Explanation,
    tried: Sequence[Explanation],
    older: Mapping[str, Sequence[Explanation]] | None = None,
) -> tuple[Explanation, dict[str, Sequence[Explanation]]]:
    """Exchange terms for better ones and leave out those that say too little, until nothing changes.

    A term is exchanged for what does a part of what it does; what explains something else is added beside it later.
    With the answer come, for each of its terms, the explanations in which another stands in its place. What was tried
    beside the same other terms is not sought again, but fitted with the nuisances of the answer. older: those that
    stood in the place of a term of `before`; what was within reach there is tried again.
    """
    newest = [name for name in explanation.terms if name not in before.terms]
    known = {newest[0]: judged_equally(explanation, [before, *ranked(tried)])} if len(newest) == 1 else {}
    beside = {before.labels: tried} if tried else {}
    for _ in range(SEARCH.most_terms):
        rivals = dict[str, Sequence[Explanation]](known)
        seen: Sequence[Response] | None = None
        for name in explanation.terms:
            if name in rivals:
                continue
            if explanation.is_spent:
                return explanation, rivals
            shorter = without(explanation, name)
            if shorter.labels in beside:
                others = judged_equally(explanation, ranked(beside[shorter.labels]))
            else:
                seen = responses(explanation.fit) if seen is None else seen
                near = _near(before, (older or {}).get(name, ()))
                others = beside[shorter.labels] = extended(shorter, seen, near)
            better = chosen(shorter, [explanation, *(e for e in others if _stands_for(e, explanation, shorter))])
            if better is None:
                explanation, known = shorter, {}
                break
            enough = explanation.evidence + explanation.evidence_scale
            if better.evidence > enough and better.labels != explanation.labels:
                explanation, known = refitted(better), {}
                break
            rivals[name] = ranked([explanation, shorter, *others])
        else:
            break
    return explanation, rivals


def _near(answer: Explanation, rivals: Sequence[Explanation]) -> set[str]:
    """Names of the terms with which rivals cannot be separated from an answer."""
    near = (e for e in rivals if (answer.evidence - e.evidence) / answer.evidence_scale < SEARCH.equivalent)
    return {name for e in near for name in e.terms}


def _stands_for(other: Explanation, explanation: Explanation, shorter: Explanation) -> bool:
    """Whether what another adds to the shorter explanation does a part of what the term that it lacks does."""
    own = shorter.fit.residual - explanation.fit.residual
    its = shorter.fit.residual - other.fit.residual
    return float(own @ its) > RESAMPLING.stands_for * float(own @ own)


def judged_equally(explanation: Explanation, others: Sequence[Explanation]) -> list[Explanation]:
    """The best others, and effects within reach, fitted with the nuisances of an explanation, by falling evidence."""
    nuisance = explanation.fit.problem.nuisance
    results = [explanation]
    near = (e for e in others[SEARCH.most_rivals :] if len(e.laws) == len(explanation.laws))
    reach = (e for e in near if (explanation.evidence - e.evidence) / explanation.evidence_scale < SEARCH.equivalent)
    for other in [*others[: SEARCH.most_rivals], *reach]:
        if other.labels != explanation.labels or other.terms != explanation.terms:
            again = fit(replace(other.fit.problem, nuisance=nuisance), other.fit.theta)
            results.append(replace(other, fit=again))
    return ranked(results)
