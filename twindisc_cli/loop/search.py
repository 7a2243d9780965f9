"""The search for what the model lacks: effects and laws of all stages, judged on all channels at once.

    extend   add the term with the most evidence, as long as it says enough
    swap     exchange each term for a better one, the others fitted beside it
    drop     leave out what no longer says enough

Evidence is compared after cooling, since no formula is exact and what is wrong with it grows with the size of what is
explained: D = (E_best - E) / (1 + c sqrt(fall of chi2)). Explanations with D below the threshold cannot be told apart.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from twindisc_cli.effects._effect import Effect
from twindisc_cli.laws.law import law_key
from twindisc_cli.laws.trial import Trial
from twindisc_cli.loop.candidates import Proposal, effects, flash_law, laws_elsewhere, proposals, warmed
from twindisc_cli.loop.channels import channels
from twindisc_cli.loop.fit import MOST_STEPS, Fit, carried, fit, refit
from twindisc_cli.loop.learn import Pair, Response, responses
from twindisc_cli.loop.problem import Problem
from twindisc_cli.loop.screen import unexplained_residual
from twindisc_cli.loop.terms import Term, term_of
from twindisc_cli.loop.thresholds import ACCEPTANCE, RESAMPLING, SEARCH
from twindisc_cli.loop.validate import Elsewhere
from twindisc_cli.model.experiment import Floats
from twindisc_cli.model.forward import IntegratedSets
from twindisc_cli.model.patch import Paths

Progress = Callable[[str], None]

SAME_PLACE = 0.01
"""Squared distance, in standard errors, below which two fits have ended at the same parameters."""


@dataclass(frozen=True)
class Explanation:
    """A complete answer: the fit of all its terms, what the choice of each term's form costs, chi2 without any.

    elsewhere: a test that is only predicted, and speaks for or against an answer.
    """

    fit: Fit
    prices: Mapping[str, float]
    before: float
    elsewhere: Elsewhere | None = field(default=None, repr=False)

    @property
    def terms(self) -> tuple[str, ...]:
        """Names of the effects and laws."""
        return self.fit.terms

    @property
    def evidence(self) -> float:
        """Logarithm of the evidence, the choice of forms paid."""
        return self.here + self._elsewhere[0]

    @property
    def here(self) -> float:
        """The same of the tests that are fitted alone."""
        return self.fit.evidence - sum(self.prices.values())

    @cached_property
    def _elsewhere(self) -> tuple[float, float]:
        return (0.0, 0.0) if self.elsewhere is None else self.elsewhere.density(self.fit)

    @cached_property
    def plausibility(self) -> float:
        """Logarithm of the prior of its errors of the set-up, relative to none of them.

        A rig's load, creepage, yaw and torque are seldom off by many times what is typical, whatever a formula misses:
        it is not tempered. Where few samples are on the rise of a creep curve, a zero of a fifth of it fits as well.
        """
        problem = self.fit.problem
        errors = {name for name in self.terms if name not in self.laws and is_error(self.effect(name))}
        sizes = [p.size(self.fit.value(p)[0]) for p in problem.parameters if p.term in errors and p.off is not None]
        return -0.5 * float(np.sum((np.array(sizes) / SEARCH.typical_sizes) ** 2))

    @property
    def temperature(self) -> float:
        """What differences of evidence are divided by: formulas err more, the more they explain."""
        return 1.0 + SEARCH.tempering * float(np.sqrt(max(self.before - self.fit.chi2 - self._elsewhere[1], 0.0)))

    def effect(self, name: str) -> Effect:
        """A term as it acts."""
        return self.fit.problem.effect(name)

    def term(self, name: str) -> Term:
        """What a term is, whatever its form."""
        return term_of(name, self.effect(name))

    @property
    def labels(self) -> frozenset[Term]:
        """What all terms are."""
        return frozenset(self.term(name) for name in self.terms)

    @property
    def laws(self) -> dict[str, Trial]:
        """The terms that are laws."""
        return {name: effect for name in self.terms if isinstance(effect := self.effect(name), Trial)}


@dataclass(frozen=True)
class Search:
    """The base model, the answer, and what stands beside it.

    rivals: for each of its terms all explanations in which another stands in its place; others: laws in the place of
    two effects, and effects in the place of a law.
    """

    base: Explanation
    answer: Explanation
    rivals: Mapping[str, Sequence[Explanation]]
    others: Sequence[Explanation] = ()


def search(
    problem: Problem,
    progress: Progress,
    other: Elsewhere | None = None,
    *,
    enough: Callable[[Explanation, Explanation], bool] | None = None,
) -> Search:
    """Find the terms that explain all channels together, and predict another test that is not fitted.

    enough: whether an answer beside the base model ends the search.
    """
    progress("base model")
    first = refit(problem)
    before = first.chi2 + (other.density(first)[1] if other else 0.0)
    base = Explanation(first, {}, before, other)
    best, others = base, list[Explanation]()
    rivals: Mapping[str, Sequence[Explanation]] = {}
    known = set[frozenset[Term]]()
    while (
        best.labels not in known
        and len(best.terms) < SEARCH.most_terms
        and not (best.terms and _nothing_left(best))
        and not (best.terms and enough is not None and enough(best, base))
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
        best, rivals = without_older_laws(*swap_and_drop(refitted(better), best, tried), best)
        others = judged_alike(best, apart)
    best, rivals = without_two_terms(best, rivals)
    return Search(base, best, rivals, others)


def _nothing_left(explanation: Explanation) -> bool:
    """Whether no generic function of any channel sees anything in what an explanation leaves."""
    fitted = explanation.fit
    return all(
        unexplained_residual(fitted, channel).p_value > SEARCH.nothing_left for channel in fitted.problem.channels
    )


def refitted(explanation: Explanation) -> Explanation:
    """The same terms with the nuisances where the fit is now."""
    return replace(explanation, fit=refit(explanation.fit.problem, explanation.fit.theta))


def extended(explanation: Explanation, known: Sequence[Response] | None = None) -> list[Explanation]:
    """The explanation with each of the most promising terms added, by falling evidence; known: responses nearby."""
    explanations = _most_promising(explanation, proposals(explanation.fit, known))
    beside = [*_flashes(explanation, explanations), *_over_others(explanation, explanations)]
    return by_falling([*explanations, *beside], evidence_of)


def _most_promising(explanation: Explanation, proposed: Sequence[Proposal]) -> list[Explanation]:
    """The explanation with each of the terms added that promise most, of those proposed by falling promise.

    Of laws these are the pairs of quantity and covariate with the most evidence over all forms, in the best of these.
    """
    explanations: list[Explanation] = []
    laws, effects_fitted, best = _likeliest_laws(proposed), 0, 0.0
    for proposal in proposed:
        few = not proposal.is_law and effects_fitted < SEARCH.fitted_at_least
        least = SEARCH.least_promise if few else max(0.0, SEARCH.least_share * best)
        enough = proposal.name not in laws if proposal.is_law else effects_fitted >= SEARCH.fitted_each_round
        if proposal.promise < least or enough or _asks_too_much(explanation.fit.problem, proposal):
            continue
        effects_fitted += not proposal.is_law
        explanations.append(_with(explanation, proposal, SEARCH.least_share * best))
        best = max(best, explanations[-1].here - explanation.here)
    return explanations


def _likeliest_laws(proposed: Sequence[Proposal]) -> set[str]:
    """Names of the laws to be fitted, by the evidence of their pairs over all forms."""
    evidence = {p.name: p.pair.log_evidence for p in proposed if p.pair is not None}
    return set(sorted(evidence, key=lambda name: (-round(evidence[name], 6), name))[: SEARCH.fitted_each_round])


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


def is_error(effect: Effect) -> bool:
    """Whether an effect is an error of what a rig sets or records of the traction."""
    return effect.channel == "traction" and effect.stage in ("operation", "sensor")


def evidence_of(explanation: Explanation) -> float:
    """Logarithm of the evidence of an explanation, to sort by."""
    return explanation.evidence


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
    return [_with(explanation, proposal) for proposal in proposed if proposal is not None]


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
    return [_with(explanation, proposal) for proposal in proposed if not proposal.effect.test]


def _within_reach(explanations: Sequence[Explanation]) -> list[Explanation]:
    """Those that cannot be told from the best of them, here: another test may speak against all."""
    best = max((e.here for e in explanations), default=0.0)
    return [e for e in explanations if (best - e.here) / e.temperature < SEARCH.equivalent]


def _with(explanation: Explanation, proposal: Proposal, enough: float = 0.0) -> Explanation:
    """An explanation with one more term.

    Where K differs from strip to strip, the term is fitted on the track as it is without it, and where it says enough
    there [nats], and half of what an effect must say, on its own, from every start that says as much.
    """
    enough = max(enough, 0.5 * SEARCH.effect_evidence * explanation.temperature)
    fitted = explanation.fit
    problem = fitted.problem.with_terms(*fitted.terms, proposal.name, trial=_trial(proposal))
    twice = problem.is_local and proposal.effect.stage != "contact"
    first = replace(problem, tracks=_tracks(fitted)) if twice else problem
    law = proposal.effect if isinstance(proposal.effect, Trial) else None
    steps = SEARCH.curve_steps if law is not None and law.is_curve else MOST_STEPS
    starts = [np.concatenate([fitted.theta, start]) for start in proposal.starts]
    fits = [fit(first, start, steps) for start in starts]
    best = max(f.evidence for f in fits)
    near = _apart([f for f in fits if best - f.evidence < SEARCH.equivalent])
    prices = {**explanation.prices, proposal.name: proposal.price}
    more = [replace(explanation, fit=f, prices=prices) for f in near]
    if law is not None and law.jumps.size:
        more = [_with_edges(e, proposal.name, law, proposal.pair) for e in more]
    if twice and max(e.here for e in more) > explanation.here + enough:
        more = [replace(e, fit=fit(replace(e.fit.problem, tracks=None), e.fit.theta)) for e in more]
    return _first_of_best(more)


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
    return fitted.problem.followed(fitted.theta).tracks or ["none"] * len(fitted.problem.cases)


def _with_edges(explanation: Explanation, name: str, law: Trial, pair: Pair | None) -> Explanation:
    """The same with the edges of a law where they explain most, here and, of what ties, in the test only predicted."""
    refined = replace(explanation, fit=refine_edges(explanation.fit, name, law, pair))
    return refined if explanation.elsewhere is None else _edges_elsewhere(refined, name, explanation.elsewhere, pair)


def refine_edges(fitted: Fit, name: str, trial: Trial, pair: Pair | None) -> Fit:
    """A fit with the edges of a step or a window, which have no slope, where they explain most: two finer scans.

    The first reaches over all places at which no sample tells them apart.
    """
    assert pair is not None
    width = float(np.median(np.diff(pair.edges)))
    for share, gaps in ((1.0, 1.0), (0.12, 0.0)):
        for key in trial.fixed:
            reach = share * width + gaps * pair.gap(trial.fixed[key])
            tried = trial.fixed[key] + reach * np.linspace(-1.0, 1.0, SEARCH.edge_places)
            trial = trial.fixed_at({key: middle_of_least(tried, _chi2_at(fitted, name, trial, key, tried))})
            fitted = fit(_with_trial(fitted, name, trial), fitted.theta)
    return fitted


def _chi2_at(fitted: Fit, name: str, trial: Trial, key: str, places: Floats) -> Floats:
    """chi2 with an edge of a law at other places (place,)."""
    problem = fitted.problem
    values = {k: np.full(len(places), v) for k, v in {**fitted.values(name), **trial.fixed}.items()}
    sets = np.tile(fitted.theta, (len(places), 1))
    predictions = problem.moved(sets, extra={name: {**values, key: places}}, trial={name: trial.unfixed})
    return np.asarray(np.sum(problem.discount(problem.white(predictions) - problem.measured) ** 2, axis=1))


def _with_trial(fitted: Fit, name: str, trial: Trial) -> Problem:
    """The problem of a fit with another form of a law."""
    return fitted.problem.with_terms(*fitted.terms, trial={name: trial})


def _edges_elsewhere(explanation: Explanation, name: str, other: Elsewhere, pair: Pair | None) -> Explanation:
    """The same with the edges of a step or a window where the test that is only predicted has them.

    Among the places that no sample of the tests that are fitted tells apart: which of these it is, is paid for.
    """
    assert pair is not None
    trial = explanation.laws[name]
    for key, place in trial.fixed.items():
        fitted = explanation.fit
        near = np.linspace(*pair.between(place), SEARCH.edge_places)
        places = near[_chi2_at(fitted, name, trial, key, near) < fitted.chi2 + 2.0 * SEARCH.evidence_error]
        moved = [replace(fitted, problem=_with_trial(fitted, name, trial.fixed_at({key: one}))) for one in places]
        said = np.array([other.density(one)[0] for one in moved])
        likely = int(np.sum(said > said.max(initial=-np.inf) - SEARCH.evidence_error))
        if likely < len(said):
            trial = trial.fixed_at({key: middle_of_least(places, -2.0 * said)})
            price = explanation.prices[name] + float(np.log(len(said) / likely))
            again = fit(_with_trial(fitted, name, trial), fitted.theta)
            explanation = replace(explanation, fit=again, prices={**explanation.prices, name: price})
    return explanation


def middle_of_least(places: Floats, chi2: Floats) -> float:
    """Middle of the first run of places (n,) at which chi2 (n,) is least, to within its numerical error.

    Between two samples an edge may stand anywhere: which of the places has the least rounding error says nothing.
    """
    least = np.flatnonzero(chi2 <= chi2.min() + 2.0 * SEARCH.evidence_error)
    run = least[: 1 + int(np.argmin(np.append(np.diff(least) == 1, False)))]
    return float(0.5 * (places[run[0]] + places[run[-1]]))


def _trial(proposal: Proposal) -> dict[str, Effect]:
    return {proposal.name: proposal.effect} if proposal.is_law or proposal.effect.test else {}


def chosen(before: Explanation, tried: Sequence[Explanation]) -> Explanation | None:
    """The best of the explanations, an effect of the catalogue before a law; None where none says enough.

    A law of the rig comes before one of a sensor that says the same. A parameter that ran into a bound carries no
    explanation.
    """
    enough = [e for e in tried if _says_enough(e, before) and not e.fit.at_bound]
    return preferred(enough) if enough else None


def preferred(explanations: Sequence[Explanation]) -> Explanation:
    """Of the explanations that cannot be told from the best, one of few laws, of the rig rather than of a sensor."""
    best = max(explanations, key=evidence_of)
    close = [e for e in explanations if (best.evidence - e.evidence) / best.temperature < SEARCH.equivalent]
    fewest = min(len(e.laws) for e in close)
    return by_falling(
        [e for e in close if len(e.laws) == fewest],
        lambda e: e.evidence - best.temperature * SEARCH.sensor_law_cost * _recorded(e),
    )[0]


def by_falling(explanations: Sequence[Explanation], score: Callable[[Explanation], float]) -> list[Explanation]:
    """Explanations by falling score [nats]; those within the numerical error of the evidence of the best left tie.

    Of a tie the shortest description comes first (fewest parameters, lowest price of its forms), then the name.
    """
    rest, ordered = sorted(explanations, key=score, reverse=True), list[Explanation]()
    while rest:
        tie = [e for e in rest if score(rest[0]) - score(e) <= SEARCH.evidence_error]
        ordered += sorted(tie, key=_description)
        rest = rest[len(tie) :]
    return ordered


def _description(explanation: Explanation) -> tuple[int, float, list[str]]:
    """Number of parameters, price of the forms, and names of an explanation."""
    return len(explanation.fit.theta), round(sum(explanation.prices.values()), 6), sorted(explanation.terms)


def _recorded(explanation: Explanation) -> int:
    """How many laws of what a sensor records, whatever happens in the rig, are in an explanation."""
    return sum(law.stage == "sensor" for law in explanation.laws.values())


def _says_enough(explanation: Explanation, before: Explanation) -> bool:
    """Whether one more term says enough: more is asked of a law, and where much was explained before by formulas.

    What a sample says alone, which whitening may spread over its neighbours, is no finding. A law may say less where
    the generic functions of its channel see that something is missing, too. A test that is only predicted counts
    against a term in full, and for it up to what the tests that are fitted say.
    """
    taken = before.fit.residual**2 - explanation.fit.residual**2
    here, more = explanation.here - before.here, explanation.evidence - before.evidence
    if min(here, more) < 0.5 * _by_one_sample(before.fit.problem, taken):
        return False
    said = min(2.0 * here, more) / before.temperature
    new = [explanation.effect(name) for name in explanation.terms if name not in before.terms]
    if not any(isinstance(effect, Trial) for effect in new):
        return said > SEARCH.effect_evidence
    if said > SEARCH.law_evidence:
        return True
    left = unexplained_residual(before.fit, new[0].channel)
    return said > SEARCH.seen_law_evidence and left.significant(ACCEPTANCE.unexplained_alone)


def _by_one_sample(problem: Problem, taken: Floats) -> float:
    """What is taken from chi2 in one sample at most, of what is taken in each white one (sample,)."""
    spread = {part: 3 if problem.cases[part[0]].noise[part[1]].spreads else 1 for part in problem.parts}
    return max(float(np.max(np.convolve(taken[problem.places[part]], np.ones(n)))) for part, n in spread.items())


def catalogued(better: Explanation, before: Explanation, tried: Sequence[Explanation]) -> list[Explanation]:
    """Two effects of the catalogue in the place of a law that was added, where they cannot be told from it.

    First the explanation to go on with, then the others within reach. The second effect is one of the law's own
    channel, by what it promises beside the first as fitted. Two courses over time of one quantity do not stand for a
    law: sums of settlings follow any curve, as the law does.
    """
    if len(better.laws) == len(before.laws):
        return [better]
    (law,) = (effect for name, effect in better.laws.items() if name not in before.terms)
    both = _two_effects(better, before, tried, law.channel)
    close = [e for e in both if (better.evidence - e.evidence) / better.temperature < SEARCH.equivalent]
    return [*close, better, *(e for e in both if e not in close)][: SEARCH.most_rivals]


def _two_effects(
    better: Explanation, before: Explanation, tried: Sequence[Explanation], channel: str
) -> list[Explanation]:
    """An explanation with two effects of a channel beside it, in the place of what a better one has more.

    Pairs with a term of the better one are among its rivals already.
    """
    least = better.here - SEARCH.equivalent * better.temperature
    single = [p for p in effects(before.fit, channel) if p.name not in better.terms]
    alone = {p.name: before.here + p.promise for p in single}
    return ranked(
        [
            e
            for half in _halves(better, before, tried, single)
            for e in _most_promising(half, _second(half, channel, alone, least))
            if not e.fit.at_bound and not _courses_over_time(*(e.effect(name) for name in e.terms[-2:]))
        ]
    )


def _second(half: Explanation, channel: str, alone: Mapping[str, float], least: float) -> list[Proposal]:
    """Effects of a channel that bring half an explanation near the least evidence [nats].

    With it they must promise more than alone, of which the evidence is given by name.
    """
    enough = SEARCH.least_share * (least - half.here) + SEARCH.least_promise
    return [
        p for p in effects(half.fit, channel) if p.name in alone and p.promise > max(enough, alone[p.name] - half.here)
    ]


def _courses_over_time(one: Effect, other: Effect) -> bool:
    """Whether two effects change the same stage over time."""
    return one.over == other.over == "time" and one.stage == other.stage


def _halves(
    better: Explanation, before: Explanation, tried: Sequence[Explanation], single: Sequence[Proposal]
) -> list[Explanation]:
    """Explanations with the first of two effects that may stand for a law.

    Those that take a good part of what the law takes, and those with another contact, whatever they take: the patch
    alone may leave the misfit as large as it was, and turns the responses to all other effects.
    """
    taken = before.fit.chi2 - better.fit.chi2
    new = [e for e in tried if len(e.laws) == len(before.laws) and e.terms[-1] not in better.terms]
    free = [e for e in new if not e.fit.at_bound]
    large = [e for e in free if before.fit.chi2 - e.fit.chi2 > SEARCH.replaced_share * taken][: SEARCH.replacements]
    known = {e.terms[-1] for e in large}
    contacts = [p for p in single if p.effect.stage == "contact"]
    return [*large, *(_with(before, p) for p in contacts if p.name not in known)]


def without_older_laws(
    explanation: Explanation, rivals: Mapping[str, Sequence[Explanation]], before: Explanation
) -> tuple[Explanation, Mapping[str, Sequence[Explanation]]]:
    """The same with two effects in the place of a law that was there before: beside a new term they may say more."""
    for name in explanation.laws:
        if name not in before.terms or name not in rivals or len(explanation.terms) == SEARCH.most_terms:
            continue
        shorter = without(explanation, name)
        two = catalogued(explanation, shorter, rivals[name])[0]
        if two is not explanation:
            return swap_and_drop(refitted(two), shorter, [])
    return explanation, rivals


def without_two_terms(
    explanation: Explanation, rivals: Mapping[str, Sequence[Explanation]]
) -> tuple[Explanation, Mapping[str, Sequence[Explanation]]]:
    """The same with two effects in the place of two terms of a channel, one of them a law, where they say more.

    One by one they were exchanged for laws while another channel was not explained yet.
    """
    for channel in explanation.fit.problem.channels:
        own = [name for name in explanation.terms if explanation.effect(name).channel == channel]
        if len(own) != 2 or not any(name in explanation.laws for name in own):
            continue
        shorter = without(without(explanation, own[0]), own[1])
        tried = _most_promising(shorter, effects(shorter.fit))
        two = preferred([explanation, *_two_effects(explanation, shorter, tried, channel)])
        if two is not explanation:
            return swap_and_drop(refitted(two), shorter, [])
    return explanation, rivals


def swap_and_drop(
    explanation: Explanation, before: Explanation, tried: Sequence[Explanation]
) -> tuple[Explanation, dict[str, Sequence[Explanation]]]:
    """Exchange terms for better ones and leave out those that say too little, until nothing changes.

    A term is exchanged for what does a part of what it does; what explains something else is added beside it later.
    With the answer come, for each of its terms, the explanations in which another stands in its place. What was tried
    beside the same other terms is not sought again, but fitted with the nuisances of the answer.
    """
    newest = [name for name in explanation.terms if name not in before.terms]
    known = {newest[0]: judged_alike(explanation, [before, *ranked(tried)])} if len(newest) == 1 else {}
    beside = {before.labels: tried} if tried else {}
    for _ in range(SEARCH.most_terms):
        rivals = dict[str, Sequence[Explanation]](known)
        seen: Sequence[Response] | None = None
        for name in explanation.terms:
            if name in rivals:
                continue
            shorter = without(explanation, name)
            if shorter.labels in beside:
                others = judged_alike(explanation, ranked(beside[shorter.labels]))
            else:
                seen = responses(explanation.fit) if seen is None else seen
                others = beside[shorter.labels] = extended(shorter, seen)
            better = chosen(shorter, [explanation, *(e for e in others if _stands_for(e, explanation, shorter))])
            if better is None:
                explanation, known = shorter, {}
                break
            if better.evidence > explanation.evidence + explanation.temperature and better.labels != explanation.labels:
                explanation, known = refitted(better), {}
                break
            rivals[name] = ranked([explanation, shorter, *others])
        else:
            break
    return explanation, rivals


def _stands_for(other: Explanation, explanation: Explanation, shorter: Explanation) -> bool:
    """Whether what another adds to the shorter explanation does a part of what the term that it lacks does."""
    own = shorter.fit.residual - explanation.fit.residual
    its = shorter.fit.residual - other.fit.residual
    return float(own @ its) > RESAMPLING.stands_for * float(own @ own)


def judged_alike(explanation: Explanation, others: Sequence[Explanation]) -> list[Explanation]:
    """The best others, and effects within reach, fitted with the nuisances of an explanation, by falling evidence."""
    nuisance = explanation.fit.problem.nuisance
    results = [explanation]
    near = (e for e in others[SEARCH.most_rivals :] if len(e.laws) == len(explanation.laws))
    reach = (e for e in near if (explanation.evidence - e.evidence) / explanation.temperature < SEARCH.equivalent)
    for other in [*others[: SEARCH.most_rivals], *reach]:
        if other.labels != explanation.labels or other.terms != explanation.terms:
            again = fit(replace(other.fit.problem, nuisance=nuisance), other.fit.theta)
            results.append(replace(other, fit=again))
    return ranked(results)


def ranked(explanations: Sequence[Explanation]) -> list[Explanation]:
    """Explanations by falling evidence, the best form of each."""
    best: dict[frozenset[Term], Explanation] = {}
    for explanation in by_falling(explanations, evidence_of):
        best.setdefault(explanation.labels, explanation)
    return list(best.values())


def without(explanation: Explanation, name: str) -> Explanation:
    """The explanation with one term left out, the others fitted again."""
    rest = [term for term in explanation.terms if term != name]
    problem = explanation.fit.problem.with_terms(*rest)
    prices = {term: explanation.prices[term] for term in rest}
    return replace(explanation, fit=fit(problem, carried(problem, explanation.fit)), prices=prices)
