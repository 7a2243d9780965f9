"""What stands for each term of an answer in the other explanations, and how probable each is."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from twindisc_cli.effects import catalogue
from twindisc_cli.laws.quantities import QUANTITIES
from twindisc_cli.laws.trial import Trial
from twindisc_cli.loop.explanation import Explanation, by_falling, evidence_of
from twindisc_cli.loop.terms import Alternative, EffectTerm, LawTerm, Term
from twindisc_cli.loop.thresholds import RESAMPLING, SEARCH
from twindisc_cli.loop.ties import by_falling_value
from twindisc_cli.model.experiment import Floats


@dataclass(frozen=True)
class Compared:
    """An answer among all explanations.

    members: the explanations, the base model among them; shares: their probabilities by the resamples (member,), NaN
    where nothing was resampled.
    """

    answer: Explanation
    members: Sequence[Explanation]
    shares: Floats
    base: Explanation

    @property
    def weights(self) -> Floats:
        """The shares, or what the evidence says in their place (member,)."""
        if np.isfinite(self.shares).all():
            return self.shares
        evidence = np.array([(m.evidence - self.answer.evidence) / self.answer.evidence_scale for m in self.members])
        weights = np.minimum(np.exp(np.minimum(evidence, 700.0)), 1e6)
        return np.asarray(weights / weights.sum())

    def in_place_of(self, name: str) -> dict[Term, Explanation]:
        """What stands in the place of a term in members that differ from the answer in it only, and these members."""
        own = self.answer.term(name)
        others = self.answer.labels - {own}
        near = [m for m in self.members if others <= m.labels and len(m.labels) == len(others) + 1]
        return {next(iter(m.labels - others)): m for m in near if own not in m.labels}

    def response(self, name: str, member: Explanation) -> Floats:
        """What a member does to the white samples in the place of a term (sample,)."""
        others = self.answer.labels - {self.answer.term(name)}
        short = next((m for m in self.members if m.labels == others), self.base)
        residual = short.fit.residual
        return residual - member.fit.residual if len(residual) == len(member.fit.residual) else 0.0 * residual

    def remains(self, channel: str, member: Explanation | None = None) -> float:
        """Share of a channel's misfit beyond the noise that the answer leaves, or another explanation, 0 to 1."""
        before, after = (e.fit.power(channel) for e in (self.base, member or self.answer))
        count = self.answer.fit.problem.count(channel)
        spread = count + 2.0 * np.sqrt(2.0 * count)
        return float(np.clip((after - spread) / max(before - count, 1.0), 0.0, 1.0))

    def similarity(self, name: str, one: Explanation, two: Explanation) -> float:
        """Share of what one member does in the place of a term that another does: squared cosine of the responses."""
        left, right = self.response(name, one), self.response(name, two)
        return float((left @ right) ** 2 / max(float(left @ left) * float(right @ right), 1e-300))


@dataclass(frozen=True)
class Weighed:
    """How probable a term of the answer is, NaN where nothing was resampled, and what cannot be separated from it.

    probability: of an effect in any form, as a law of its own stage over its own covariate, too. alternatives: terms
    with their probability. chances: the probability of each term that stands in its place, itself among them. same:
    laws that are something else in other words, with what they count for.
    """

    probability: float
    alternatives: Sequence[Alternative]
    chances: Mapping[Term, float]
    same: Mapping[Term, Term]


def weighed(compared: Compared, name: str, *, as_one_law: bool = False) -> Weighed:
    """Weigh a term against what stands for it in any explanation without it, alone or with others.

    An effect of which the law over its own covariate is another form is as probable as both, and both are named.
    What does something else than the term where it is added in its place is no alternative, nor is what the answer has
    beside it. The set ends where it is probable enough and no longer small, or with the effects of the catalogue that
    fit as well and are less probable for their parameters alone. That of an effect is small, and effects of the
    catalogue come first in it.

    as_one_law: terms that together change one quantity over one covariate count for a law over it in part, and where
    the answer has such terms this law is no other form of one of them.
    """
    own = compared.answer.term(name)
    places = {own: compared.answer} | compared.in_place_of(name)
    shared = _law_of_each(compared.answer).get(own) if as_one_law else None
    words = {term: _in_other_words(compared, name, term, places) for term in places if term not in (own, shared)}
    same = {term: effect for term, effect in words.items() if effect != term}
    similar = {t: compared.similarity(name, member, compared.answer) for t, member in places.items()}
    strangers = {term for term, share in similar.items() if share < RESAMPLING.stands_for}
    chances, together = dict[Term, float](), dict[Term, float]()
    for member, share in zip(compared.members, compared.weights, strict=True):
        terms = set(_stand_ins(compared, name, member)) - strangers
        parts = _parts(member, terms) if as_one_law else dict.fromkeys(terms, 1.0)
        merged = _largest((same.get(term, term), part) for term, part in parts.items())
        for term, part in parts.items():
            chances[term] = chances.get(term, 0.0) + part * float(share)
        for term, part in merged.items():
            together[term] = together.get(term, 0.0) + part * float(share)
    held = together.pop(own, 0.0)
    rivals = {term: share for term, share in together.items() if term not in compared.answer.labels}
    forms = {t for t in chances if t != shared and _is_form(compared, name, t, places) and same.get(t) != own}
    probability = min(held + sum(chances[term] for term in forms), 1.0)
    if isinstance(own, EffectTerm):
        near = _named_beside(compared, places, held, _effects_first(rivals))[: RESAMPLING.small_set - 1]
    else:
        near = _named_beside(compared, places, held, by_probability(rivals))
    return Weighed(probability if np.isfinite(compared.shares).all() else np.nan, near, chances, same)


def by_probability(chances: Mapping[Term, float]) -> list[tuple[Term, float]]:
    """Terms with their probability, by falling probability, and then, where rounding alone decides, by name."""
    return [(term, chances[term]) for term in by_falling_value(chances)]


def _effects_first(chances: Mapping[Term, float]) -> list[tuple[Term, float]]:
    """Terms by falling probability, effects of the catalogue before laws that are hardly more probable."""
    before = RESAMPLING.law_before_effect
    odds = {term: share * (before if isinstance(term, EffectTerm) else 1.0) for term, share in chances.items()}
    return [(term, chances[term]) for term, _ in by_probability(odds)]


def _named_beside(
    compared: Compared, places: Mapping[Term, Explanation], held: float, together: Sequence[tuple[Term, float]]
) -> list[Alternative]:
    """The terms that are named beside a term that is held with this probability, of those in this order."""
    beside, left = list[Alternative](), list[Alternative]()
    for term, share in together:
        small = len(beside) + 1 < RESAMPLING.small_set
        if share > RESAMPLING.rival_share and (small or held < RESAMPLING.set_share):
            beside.append(Alternative(term, share))
        elif isinstance(term, EffectTerm) and term in places and _fits_as_well(compared.answer, places[term]):
            left.append(Alternative(term, share))
        held += share
    return beside + left[: max(RESAMPLING.small_set - 1 - len(beside), 0)]


def _stand_ins(compared: Compared, name: str, member: Explanation) -> list[Term]:
    """What stands for a term in an explanation: the term itself, or what is new there.

    Where several terms of the answer are not in it, what is new stands for that of its own channel.
    """
    answer = compared.answer
    own = answer.term(name)
    if own in member.labels:
        return [own]
    channels_of = {
        answer.effect(term).channel for term in answer.terms if answer.term(term) not in member.labels and term != name
    }
    return [
        member.term(term)
        for term in member.terms
        if member.term(term) not in answer.labels
        and (
            member.effect(term).channel == answer.effect(name).channel or member.effect(term).channel not in channels_of
        )
    ]


def shared_laws(member: Explanation) -> dict[LawTerm, list[Term]]:
    """Laws that several terms of an explanation are together, with these."""
    terms = dict[LawTerm, list[Term]]()
    for name in member.terms:
        if (law := _as_law(member, name)) is not None:
            terms.setdefault(law, []).append(member.term(name))
    return {law: parts for law, parts in terms.items() if len(parts) > 1}


def _as_law(member: Explanation, name: str) -> LawTerm | None:
    """What a term changes over what, as a law; None of an effect of no one covariate, or of no one quantity."""
    term, effect = member.term(name), member.effect(name)
    if isinstance(term, LawTerm):
        return term
    quantities = [key for key, quantity in QUANTITIES.items() if quantity.stage == effect.stage]
    return LawTerm(quantities[0], effect.over, term.test) if effect.over and len(quantities) == 1 else None


def _law_of_each(member: Explanation) -> dict[Term, LawTerm]:
    """The law that a term is a part of, for terms beside which another changes the same quantity over its covariate."""
    return {term: law for law, terms in shared_laws(member).items() for term in terms}


def _parts(member: Explanation, terms: Iterable[Term]) -> dict[Term, float]:
    """In which part an explanation counts for each of some of its terms, and for laws that these are a part of."""
    laws, part, parts = _law_of_each(member), RESAMPLING.one_law, list[tuple[Term, float]]()
    for term in terms:
        law = laws.get(term, term)
        parts += [(term, 1.0)] if law == term else [(term, 1.0 - part), (law, part)]
    return _largest(parts)


def _largest(parts: Iterable[tuple[Term, float]]) -> dict[Term, float]:
    """The largest part in which each term counts."""
    largest = dict[Term, float]()
    for term, part in parts:
        largest[term] = max(part, largest.get(term, 0.0))
    return largest


def _in_other_words(compared: Compared, name: str, term: Term, places: Mapping[Term, Explanation]) -> Term:
    """What a law is counted for in the place of a term; the law itself where that is nothing else.

    An effect that has its response and changes over the same covariate, or over none. Where the term is an effect, the
    likeliest law of the same quantity that has its response: its covariate runs as the law's own on this history.
    """
    if isinstance(term, EffectTerm):
        return term
    effect = _effect_of(compared, name, term, places)
    if effect is not None or isinstance(compared.answer.term(name), LawTerm):
        return effect or term
    laws = [
        other
        for other in places
        if isinstance(other, LawTerm)
        and (other.quantity, other.test) == (term.quantity, term.test)
        and _effect_of(compared, name, other, places) is None
    ]
    near = [
        other
        for other in laws
        if other == term or compared.similarity(name, places[term], places[other]) > RESAMPLING.same_response
    ]
    return _likeliest(near, places)


def _effect_of(compared: Compared, name: str, law: LawTerm, places: Mapping[Term, Explanation]) -> Term | None:
    """The likeliest effect of a law's stage and covariate whose response it has in the place of a term."""
    near = [
        other
        for other, member in places.items()
        if isinstance(other, EffectTerm)
        and not member.fit.at_bound
        and other.test == law.test
        and catalogue()[other.name].stage == QUANTITIES[law.quantity].stage
        and catalogue()[other.name].over in ("", law.covariate)
        and compared.similarity(name, places[law], member) > RESAMPLING.same_response
    ]
    return _likeliest(near, places) if near else None


def _likeliest(terms: Sequence[Term], places: Mapping[Term, Explanation]) -> Term:
    """That of some terms whose explanation has the most evidence."""
    best = by_falling([places[term] for term in terms], evidence_of)[0]
    return next(term for term in terms if places[term] is best)


def _fits_as_well(answer: Explanation, member: Explanation) -> bool:
    """Whether only its parameters are held against an explanation."""
    misfit = [0.5 * e.fit.chi2 - e.there for e in (member, answer)]
    return not member.fit.at_bound and (misfit[0] - misfit[1]) / answer.evidence_scale < SEARCH.equivalent


def _is_form(compared: Compared, name: str, term: Term, places: Mapping[Term, Explanation]) -> bool:
    """Whether a term is the law of an effect's stage over its covariate, and does about what the effect does."""
    effect = compared.answer.effect(name)
    if isinstance(term, EffectTerm) or term not in places or isinstance(effect, Trial) or effect.test != term.test:
        return False
    own = effect.over == term.covariate and effect.stage == QUANTITIES[term.quantity].stage
    return own and compared.similarity(name, places[term], compared.answer) > RESAMPLING.resembles


def shorter(compared: Compared) -> list[tuple[Explanation, float]]:
    """Explanations of fewer terms, none of them of the answer, that cannot be separated from it, with their shares."""
    answer = compared.answer
    return [
        (member, float(share))
        for member, share in zip(compared.members, compared.shares, strict=True)
        if 0 < len(member.terms) < len(answer.terms)
        and not member.labels & answer.labels
        and (answer.evidence - member.evidence) / answer.evidence_scale < SEARCH.equivalent
        and share > RESAMPLING.rival_share
    ]
