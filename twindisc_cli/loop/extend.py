"""An explanation with one more term: which are fitted, from which starts, and where the edges of a law stand."""

from __future__ import annotations

from collections.abc import Container, Iterator, Sequence
from dataclasses import replace

import numpy as np

from twindisc_cli.effects import catalogue
from twindisc_cli.effects._effect import Effect
from twindisc_cli.laws.law import law_key
from twindisc_cli.laws.trial import Trial
from twindisc_cli.loop.candidates import (
    Proposal,
    flash_law,
    laws_at_other_stages,
    laws_elsewhere,
    proposals,
    searched,
    warmed,
)
from twindisc_cli.loop.channels import channels
from twindisc_cli.loop.edges import chi2_at, middle_of_least, missed_at, refined_edges, with_trial
from twindisc_cli.loop.explanation import Explanation, by_falling, evidence_of, explained_channels
from twindisc_cli.loop.fit import MOST_STEPS, Fit, fit
from twindisc_cli.loop.learn import Pair, Response, seen_again
from twindisc_cli.loop.problem import Problem
from twindisc_cli.loop.thresholds import SEARCH
from twindisc_cli.loop.ties import by_falling_value
from twindisc_cli.loop.validate import Elsewhere, LinearPrediction
from twindisc_cli.model.forward import IntegratedSets
from twindisc_cli.model.patch import Paths

SET_IN_STEPS = frozenset({"creepage", "load", "rolling_speed"})
"""Covariates that a rig sets for each step."""
CLOSE = 0.9
"""Share of the best law's promise from which on any other law over them is fitted: to first order, none is exact."""
FIRST_STEPS = 6
"""Steps of a fit on tracks of its own after which one of several starts is gone on from."""
SAME_PLACE = 0.25
"""Squared distance, in standard errors, below which two fits have ended at the same parameters."""


def extended(
    explanation: Explanation, known: Sequence[Response] | None = None, near: Container[str] = ()
) -> list[Explanation]:
    """The explanation with each of the most promising terms added, by falling evidence.

    known: responses nearby; near: names of laws that are tried in any case.
    """
    fitted, other = explanation.fit, explanation.elsewhere
    there = None if other is None else other.to_first_order(fitted)
    explanations = most_promising(explanation, proposals(fitted, known, there=there), near)
    beside = [*_flashes(explanation, explanations), *_over_others(explanation, explanations)]
    beside += _at_other_stages(explanation, explanations, there)
    return by_falling([*explanations, *beside], evidence_of)


def most_promising(
    explanation: Explanation, proposed: Sequence[Proposal], near: Container[str] = (), best: float = 0.0
) -> list[Explanation]:
    """The explanation with each of the terms added that promise most, of those proposed by falling promise.

    Of laws these are the pairs of quantity and covariate with the most evidence over all forms, in the best of these,
    and those that are near. best: what something else in their place says [nats].
    """
    return list(each_promising(explanation, proposed, near, best))


def each_promising(
    explanation: Explanation, proposed: Sequence[Proposal], near: Container[str] = (), best: float = 0.0
) -> Iterator[Explanation]:
    """The same one after the other, as they are fitted."""
    laws, effects_fitted = _likeliest_laws(proposed), 0
    for proposal in proposed:
        few = not proposal.is_law and effects_fitted < SEARCH.fitted_at_least
        least = SEARCH.least_promise if few else max(0.0, SEARCH.least_share * best)
        likely = proposal.name in laws or proposal.name in near
        enough = not likely if proposal.is_law else effects_fitted >= SEARCH.fitted_each_round
        if proposal.promise < least or enough or _asks_too_much(explanation.fit.problem, proposal):
            continue
        effects_fitted += not proposal.is_law
        more = with_one_more(explanation, proposal, best)
        best = max(best, more.here - explanation.here)
        yield more


def _likeliest_laws(proposed: Sequence[Proposal]) -> set[str]:
    """Names of the laws to be fitted, by the evidence of their pairs over all forms: the best, and some of others.

    What another channel shows may outnumber that of a channel. Over time, which has more bins, whatever is set in steps
    may promise more than over what is set.
    """
    evidence, kinds = dict[str, float](), dict[str, set[str]]()
    for p in proposed:
        if p.pair is not None:
            evidence[p.name] = max(p.pair.log_evidence, evidence.get(p.name, -np.inf))
            kinds[p.name] = {p.effect.channel} | ({p.pair.covariate} & SET_IN_STEPS)
    best = by_falling_value(evidence)
    first = {kind: name for name in reversed(best) for kind in kinds[name]}
    close = {name for name in best if kinds[name] & SET_IN_STEPS and evidence[name] > CLOSE * evidence[best[0]]}
    return {*best[: SEARCH.fitted_each_round], *first.values(), *close}


def too_few_samples(problem: Problem) -> list[str]:
    """Channels of a problem without terms in which some effect is not tried, for it asks too much of their samples."""
    effects = [Proposal(name, catalogue()[name], [], 0.0) for name in searched(problem)]
    return list(dict.fromkeys(problem.shown_in(e.effect) for e in effects if _asks_too_much(problem, e)))


def _asks_too_much(problem: Problem, proposal: Proposal) -> bool:
    """Whether a term needs more parameters than a channel without scatter can fix.

    Where the noise had to be assumed, no residual says when enough is explained: a formula of as many parameters as
    there are samples meets them all.
    """
    more = problem.with_terms(*problem.terms, proposal.name, trial=_trial(proposal))
    channel = more.shown_in(proposal.effect)
    noises = [case.noise[channel] for case in more.cases if channel in case.noise]
    if not noises or any(noise.estimated for noise in noises):
        return False
    base = {of.key for of in channels()[channel].parameters}
    terms = {name for name in more.terms if more.shown_in(more.effect(name)) == channel}
    asked = sum(p.key in base if p.term is None else p.term in terms for p in more.parameters)
    return asked * SEARCH.samples_each > sum(int(noise.kept.sum()) for noise in noises)


def _flashes(explanation: Explanation, explanations: Sequence[Explanation]) -> list[Explanation]:
    """Beside each term over the disc's temperature that is within reach, the same over the flash temperature.

    Which of the two counts shows in how the disc lags behind the contact; where it does not, both stand in the set.
    """
    quantities = {
        quantity
        for e in _within_reach(explanations)
        if (quantity := warmed(e.effect(e.terms[-1]))) is not None
        and law_key(quantity, "flash_temperature") not in e.terms
    }
    proposed = [flash_law(explanation.fit, quantity) for quantity in sorted(quantities)]
    return [with_one_more(explanation, proposal) for proposal in proposed if proposal is not None]


def _over_others(explanation: Explanation, explanations: Sequence[Explanation]) -> list[Explanation]:
    """Beside each law that is within reach, the same over what only the test that is predicted separates from it."""
    if explanation.elsewhere is None:
        return []
    new = [e.effect(e.terms[-1]) for e in _within_reach(explanations)]
    named = {(law.quantity, law.covariate) for law in new if isinstance(law, Trial) and not law.test}
    if not named:
        return []
    other = explanation.elsewhere.prediction(explanation.fit)
    proposed = laws_elsewhere(explanation.fit, sorted(named), other)
    return [with_one_more(explanation, proposal) for proposal in proposed if not proposal.effect.test]


def _at_other_stages(
    explanation: Explanation, explanations: Sequence[Explanation], there: LinearPrediction | None
) -> list[Explanation]:
    """Where a law explains most, what has not been fitted of its covariate at other stages of the channels it explains.

    The same of laws that tie with it. To first order, and in bins, a law may promise a tenth of what it says.
    """
    most = max(map(evidence_of, explanations), default=0.0)
    named = {
        (law.quantity, law.covariate): {explanation.fit.problem.shown_in(law), *explained_channels(explanation, e)}
        for e in explanations
        if most - e.evidence <= SEARCH.evidence_error
        and isinstance(law := e.effect(e.terms[-1]), Trial)
        and not law.test
    }
    known = {name for e in explanations for name in e.terms}
    proposed = laws_at_other_stages(explanation.fit, named, there)
    return [with_one_more(explanation, proposal) for proposal in proposed if proposal.name not in known]


def _within_reach(explanations: Sequence[Explanation]) -> list[Explanation]:
    """Those that cannot be separated from the best of them, here: another test may speak against all."""
    best = max((e.here for e in explanations), default=0.0)
    return [e for e in explanations if (best - e.here) / e.evidence_scale < SEARCH.equivalent]


def with_one_more(explanation: Explanation, proposal: Proposal, best: float = 0.0) -> Explanation:
    """An explanation with one more term.

    Where tracks are integrated, the term is fitted on the track as it is without it, and where it says enough there,
    beside the best so far [nats], on its own: of several starts that say as much a few steps from each, and then on
    from the best.
    """
    fitted = explanation.fit
    problem = fitted.problem.with_terms(*fitted.terms, proposal.name, trial=_trial(proposal))
    twice = problem.is_integrated and proposal.effect.stage != "contact"
    first = replace(problem, tracks=_tracks(fitted)) if twice else problem
    law = proposal.effect if isinstance(proposal.effect, Trial) else None
    starts = [np.concatenate([fitted.theta, start]) for start in proposal.starts]
    fits = [fit(first, start) for start in starts]
    most = max(f.evidence for f in fits)
    near = _apart([f for f in fits if most - f.evidence < SEARCH.equivalent])
    costs = {**explanation.costs, proposal.name: proposal.cost}
    more = [replace(explanation, fit=f, costs=costs) for f in near]
    if law is not None and (law.jumps.size or law.is_curve):
        least = explanation.here + SEARCH.least_share * best
        more = [_finished(e, law, proposal) if e.here > least else e for e in more]
    if twice and max(e.here for e in more) > explanation.here + _enough(more[0], proposal.effect, best):
        more = [_on_its_track(e, FIRST_STEPS) for e in more] if len(more) > 1 else more
        return _on_its_track(_first_of_best(more), MOST_STEPS)
    return _first_of_best(more)


def _finished(explanation: Explanation, law: Trial, proposal: Proposal) -> Explanation:
    """The same with what of a law's form is not fitted: the smoothness of a curve, the edges of a step or a window."""
    if law.is_curve:
        return _smoothed(explanation, proposal)
    return _edged(explanation, proposal.name, law, proposal.pair)


def _smoothed(explanation: Explanation, proposal: Proposal) -> Explanation:
    """The same with the length and the size of a curve that say most where the fit is.

    They were chosen to first order, before the curve had taken anything.
    """
    fitted, name = explanation.fit, proposal.name
    assert proposal.pair is not None
    pair = seen_again(fitted, name, proposal.pair)
    if pair is None or pair.smoothness == proposal.pair.smoothness:
        return explanation
    before, after = explanation.laws[name], pair.curve(*pair.smoothness)
    own = fitted.own(name)
    assert after.mix is not None
    start, *_ = np.linalg.lstsq(after.mix, before.heights(fitted.theta[own], np.array(after.at)))
    again = fit(with_trial(fitted, name, after), np.concatenate([fitted.theta[~own], start]))
    return replace(explanation, fit=again) if again.evidence > fitted.evidence else explanation


def _enough(explanation: Explanation, new: Effect, best: float) -> float:
    """What a new term must say on the track as it is to be fitted on its own [nats]; best: what one has said so far.

    Half of what an effect must say, and a share of the best; what acts on no wear moves the track little, and must be
    within reach of the best.
    """
    scale = explanation.evidence_scale
    within_reach = -np.inf if new.channel == "profile" else best - 2.0 * SEARCH.equivalent * scale
    return float(max(0.5 * SEARCH.effect_evidence * scale, SEARCH.least_share * best, within_reach))


def _on_its_track(explanation: Explanation, most_steps: int) -> Explanation:
    """The same fitted on the track that it makes itself, in so many steps at most."""
    own = replace(explanation.fit.problem, tracks=None)
    return replace(explanation, fit=fit(own, explanation.fit.theta, most_steps))


def _first_of_best(explanations: Sequence[Explanation]) -> Explanation:
    """The first of those that tie with the one of most evidence, of those with no parameter at a bound."""
    free = [e for e in explanations if not e.fit.at_bound] or explanations
    if len(free) == 1:
        return free[0]
    most = max(e.evidence for e in free)
    return next(e for e in free if e.evidence > most - SEARCH.evidence_error)


def _apart(fits: Sequence[Fit]) -> list[Fit]:
    """Fits of one problem without those that ended where an earlier one did."""
    different: list[Fit] = []
    for fitted in fits:
        ways = [fitted.theta - other.theta for other in different]
        if all(way @ np.linalg.solve(fitted.covariance, way) > SAME_PLACE for way in ways):
            different.append(fitted)
    return different


def _tracks(fitted: Fit) -> Sequence[IntegratedSets | Paths]:
    """The tracks of a fit; where K is the same in all strips, it takes no integration to follow what changes."""
    return fitted.followed.tracks or ["none"] * len(fitted.problem.cases)


def _edged(explanation: Explanation, name: str, law: Trial, pair: Pair | None) -> Explanation:
    """The same with the edges of a law where they explain most, here and, of what ties, in the test only predicted."""
    assert pair is not None
    width = float(np.median(np.diff(pair.edges)))
    reach = {key: 2.0 * width + pair.gap(place) for key, place in law.fixed.items()}
    refined = replace(explanation, fit=refined_edges(explanation.fit, name, law, reach))
    return refined if explanation.elsewhere is None else _edges_elsewhere(refined, name, explanation.elsewhere, pair)


def _edges_elsewhere(explanation: Explanation, name: str, other: Elsewhere, pair: Pair | None) -> Explanation:
    """The same with the edges of a step or a window where the test that is only predicted has them.

    Among the places between which no sample that is fitted distinguishes: which of these it is, is paid for.
    """
    assert pair is not None
    trial = explanation.laws[name]
    for key, place in trial.fixed.items():
        fitted = explanation.fit
        near = np.linspace(*pair.between(place), SEARCH.edge_places)
        chi2 = chi2_at(fitted, name, key, near)
        places = near[chi2 < fitted.chi2 + 2.0 * SEARCH.evidence_error]
        if len(places) < 2:
            continue
        there = other.to_first_order(fitted)
        misses = missed_at(there.problem, there.theta, name, key, places)
        densities = np.array([replace(there, miss=miss).density for miss in misses])
        likely = int(np.sum(densities > densities.max() - SEARCH.evidence_error))
        if likely < len(densities):
            trial = trial.fixed_at({key: middle_of_least(places, -2.0 * densities)})
            cost = explanation.costs[name] + float(np.log(len(densities) / likely))
            again = fit(with_trial(fitted, name, trial), fitted.theta)
            explanation = replace(explanation, fit=again, costs={**explanation.costs, name: cost})
    return explanation


def _trial(proposal: Proposal) -> dict[str, Effect]:
    return {proposal.name: proposal.effect} if proposal.is_law or proposal.effect.test else {}
