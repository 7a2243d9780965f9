"""What stands for each term of an answer in the other explanations, and how probable each is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from twindisc_cli.effects import catalogue
from twindisc_cli.laws.quantities import QUANTITIES
from twindisc_cli.loop.explain import Outcome
from twindisc_cli.loop.search import Explanation
from twindisc_cli.loop.thresholds import THRESHOLDS

Label = tuple[str, ...]
"""An effect's name, or a law's quantity and covariate."""


def in_its_place(found: Outcome, name: str) -> list[tuple[int, Explanation, Label]]:
    """Members that differ from the answer in one term only: number, explanation, label of what stands for it."""
    own = found.answer.label(name)
    others = found.answer.labels - {own}
    return [
        (i, member, next(iter(member.labels - others)))
        for i, member in enumerate(found.members)
        if others <= member.labels and len(member.labels) == len(others) + 1 and own not in member.labels
    ]


@dataclass(frozen=True)
class Weighed:
    """How probable a term of the answer is, NaN where nothing was resampled, and what cannot be told from it.

    probability: of an effect in any form, as a law of its own stage over its own covariate, too. rivals: terms with
    their probability, by falling probability. chances: the probability of each term that stands in its place, itself
    among them. same: laws that are something else in other words, with what they count for.
    """

    probability: float
    rivals: Sequence[tuple[Label, float]]
    chances: Mapping[Label, float]
    same: Mapping[Label, Label]


def weighed(found: Outcome, name: str) -> Weighed:
    """Weigh a term against what stands for it in any explanation without it, alone or with others.

    An effect of which the law over its own covariate is another form is as probable as both, and both are named.
    What does something else than the term where it is added in its place is no rival. The set ends where it is probable
    enough; while it is small, with the effects of the catalogue that are left, or that fit as well and are less
    probable for their parameters alone. That of an effect is small, with effects before laws.
    """
    own, shares = found.answer.label(name), found.shares
    if not np.isfinite(shares).all():
        shares = np.array([np.exp((m.evidence - found.answer.evidence) / found.answer.heat) for m in found.members])
        shares = np.minimum(shares, 1e6) / np.sum(np.minimum(shares, 1e6))
    places = {own: found.answer} | {label: member for _, member, label in in_its_place(found, name)}
    words = {label: _in_other_words(found, name, label, places) for label in places if label != own}
    same = {label: effect for label, effect in words.items() if effect != label}
    strangers = {label for label in places if alike(found, name, places[label], found.answer) < THRESHOLDS.kin}
    chances, together = dict[Label, float](), dict[Label, float]()
    for member, share in zip(found.members, shares, strict=True):
        labels = set(_stand_ins(found, name, member)) - strangers
        for label in labels:
            chances[label] = chances.get(label, 0.0) + float(share)
        for label in {same.get(label, label) for label in labels}:
            together[label] = together.get(label, 0.0) + float(share)
    held = together.pop(own, 0.0)
    forms = {label for label in chances if _is_form(found, name, label, places) and same.get(label) != own}
    probability = held + sum(chances[label] for label in forms)
    rivals = sorted(together.items(), key=_falling)
    laws, effects = list[tuple[Label, float]](), list[tuple[Label, float]]()
    for label, share in rivals:
        few = len(label) == 1 and len(effects) + 1 < THRESHOLDS.small_set
        likely = share > THRESHOLDS.rival_share and (few or held < THRESHOLDS.set_share)
        if likely or (few and label in places and _fits_as_well(found, places[label])):
            (effects if len(label) == 1 else laws).append((label, share))
        held += share
    near = [*effects, *laws][: THRESHOLDS.small_set - 1] if len(own) == 1 else sorted([*effects, *laws], key=_falling)
    return Weighed(min(probability, 1.0) if np.isfinite(found.shares).all() else np.nan, near, chances, same)


def _falling(weighed_label: tuple[Label, float]) -> float:
    """Sorts labels by falling probability."""
    return -weighed_label[1]


def _stand_ins(found: Outcome, name: str, member: Explanation) -> list[Label]:
    """What stands for a term in an explanation: the term itself, or what is new there.

    Where several terms of the answer are not in it, what is new stands for that of its own channel.
    """
    own = found.answer.label(name)
    if own in member.labels:
        return [own]
    channels_of = {
        found.answer.effect(term).channel
        for term in found.answer.terms
        if found.answer.label(term) not in member.labels and term != name
    }
    return [
        member.label(term)
        for term in member.terms
        if member.label(term) not in found.answer.labels
        and (
            member.effect(term).channel == found.answer.effect(name).channel
            or member.effect(term).channel not in channels_of
        )
    ]


def _in_other_words(found: Outcome, name: str, label: Label, places: Mapping[Label, Explanation]) -> Label:
    """What a law is counted for in the place of a term; the label itself where that is nothing else.

    An effect that has its response and changes over the same covariate, or over none. Where the term is an effect, the
    likeliest law of the same quantity that has its response: its covariate runs as the law's own on this history.
    """
    effect = _effect_of(found, name, label, places)
    if effect is not None or len(label) == 1 or len(found.answer.label(name)) == 2:
        return effect or label
    laws = [other for other in places if other[0] == label[0] and _effect_of(found, name, other, places) is None]
    near = [o for o in laws if o == label or alike(found, name, places[label], places[o]) > THRESHOLDS.alike]
    return max(near, key=lambda other: places[other].evidence)


def _effect_of(found: Outcome, name: str, law: Label, places: Mapping[Label, Explanation]) -> Label | None:
    """The likeliest effect of a law's stage and covariate whose response it has in the place of a term."""
    near = [
        other
        for other, member in places.items()
        if len(other) == 1
        and len(law) == 2
        and not member.fit.at_bound
        and catalogue()[other[0]].stage == QUANTITIES[law[0]].stage
        and catalogue()[other[0]].over in ("", law[1])
        and alike(found, name, places[law], member) > THRESHOLDS.alike
    ]
    return max(near, key=lambda other: places[other].evidence, default=None)


def _fits_as_well(found: Outcome, member: Explanation) -> bool:
    """Whether only its parameters are held against an explanation."""
    misfit = [0.5 * e.fit.chi2 - (e.evidence - e.here) for e in (member, found.answer)]
    return not member.fit.at_bound and (misfit[0] - misfit[1]) / found.answer.heat < THRESHOLDS.within


def _is_form(found: Outcome, name: str, label: Label, places: Mapping[Label, Explanation]) -> bool:
    """Whether a label is the law of an effect's stage over its covariate, and does about what the effect does."""
    if len(label) == 1 or label not in places or name not in catalogue():
        return False
    effect = catalogue()[name]
    own = effect.over == label[1] and effect.stage == QUANTITIES[label[0]].stage
    return own and alike(found, name, places[label], found.answer) > THRESHOLDS.resembles


def alike(found: Outcome, name: str, one: Explanation, two: Explanation) -> float:
    """Share of what one explanation does to all channels in the place of a term that another does: squared cosine."""
    others = found.answer.labels - {found.answer.label(name)}
    short = next((m for m in found.members if m.labels == others), found.search.base).fit.residual
    if not len(short) == len(one.fit.residual) == len(two.fit.residual):
        return 0.0
    left, right = short - one.fit.residual, short - two.fit.residual
    return float((left @ right) ** 2 / max(float(left @ left) * float(right @ right), 1e-300))
