"""A complete answer, as the search compares it with others: the fit of all its terms, and what their forms cost.

Evidence is compared after tempering, since hardly a formula is exact, but for a constant or a line that is added to a
record, and what is wrong with it grows with the size of what is explained: D = (E_best - E) / (1 + c sqrt(fall of
chi2)). Explanations with D below the threshold cannot be separated. Forms of the creep curve are empirical, and err
more than mechanics does: of what is explained in the traction with one of them, c is larger.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from twindisc_cli.effects._effect import Effect
from twindisc_cli.laws.trial import Trial
from twindisc_cli.loop.fit import Fit, carried, fit, refit
from twindisc_cli.loop.terms import Term, term_of
from twindisc_cli.loop.thresholds import SEARCH
from twindisc_cli.loop.ties import falling
from twindisc_cli.loop.validate import Elsewhere
from twindisc_cli.model.experiment import Floats

ROUNDING = 1e-12  # of chi2: a fall by less is none, and its root would be one


@dataclass(frozen=True)
class Explanation:
    """A complete answer: the fit of all its terms, what the choice of each term's form costs, chi2 without any.

    elsewhere: a test that is only predicted, and speaks for or against an answer. missed: chi2 without any term of each
    channel of the tests that are fitted.
    """

    fit: Fit
    costs: Mapping[str, float]
    before: float
    elsewhere: Elsewhere | None = field(default=None, repr=False)
    missed: Mapping[str, float] = field(default_factory=dict, repr=False)

    @classmethod
    def of_base(cls, base: Fit, elsewhere: Elsewhere | None = None) -> Explanation:
        """The base model, beside which others are judged."""
        first = cls(base, {}, 0.0, elsewhere, powers(base))
        return replace(first, before=first.chi2)

    @property
    def chi2(self) -> float:
        """Squared length of what is missed, also of the test that is only predicted."""
        return self.fit.chi2 + self._elsewhere[1]

    @property
    def terms(self) -> tuple[str, ...]:
        """Names of the effects and laws."""
        return self.fit.terms

    @property
    def evidence(self) -> float:
        """Logarithm of the evidence, the choice of forms paid."""
        return self.here + self.there

    @property
    def here(self) -> float:
        """The same of the tests that are fitted alone."""
        return self.fit.evidence - sum(self.costs.values())

    @property
    def there(self) -> float:
        """How probable the test that is only predicted is, as a logarithm; 0 without one."""
        return self._elsewhere[0]

    @cached_property
    def _elsewhere(self) -> tuple[float, float]:
        return (0.0, 0.0) if self.elsewhere is None else self.elsewhere.density(self.fit)

    @cached_property
    def plausibility(self) -> float:
        """Logarithm of the prior of its errors of the set-up, relative to none of them.

        A rig's load, creepage, yaw, crown, torque are seldom off by many times what is typical, whatever is missing:
        it is not tempered. Where few samples are on the rise of a creep curve, a zero of a fifth of it fits as well.
        """
        problem = self.fit.problem
        errors = {name for name in self.terms if name not in self.laws and is_error(self.effect(name))}
        sizes = [p.size(self.fit.value(p)[0]) for p in problem.parameters if p.term in errors and p.off is not None]
        return -0.5 * float(np.sum((np.array(sizes) / SEARCH.typical_sizes) ** 2))

    @property
    def tempering(self) -> float:
        """What differences of evidence are divided by as formulas err more, the more they explain."""
        share = self._share_of_creep_curve
        return self._tempered((1.0 - share) * SEARCH.tempering**2 + share * SEARCH.creep_curve_tempering**2)

    @property
    def evidence_scale(self) -> float:
        """What differences of evidence are divided by: the same, times the excess of what noise had to be assumed."""
        return self.tempering * _excess(self.fit, _falls(self.missed, powers(self.fit)))

    def evidence_scale_for(self, more: Explanation) -> float:
        """The same of what one with more terms says beside this: by what was explained in the channels where it does.

        What is wrong with a formula of wear errs there, and not in the traction.
        """
        explained = self._explained_by_channel
        taken = _falls(powers(self.fit), powers(more.fit))
        both = sum(explained.values()) * sum(taken.values())
        share = sum(explained[c] * taken[c] for c in explained) / both if both > 0.0 else 1.0
        return self._tempered(share * SEARCH.tempering**2) * _excess(more.fit, taken)

    @property
    def _explained_by_channel(self) -> dict[str, float]:
        """By how much the formulas that can err bring chi2 of each channel down."""
        return {channel: self.fit.explained(channel, power) for channel, power in self.missed.items()}

    @property
    def _share_of_creep_curve(self) -> float:
        """Which share of it the traction has, where a term shapes the creep curve; none without one."""
        if not any(_shapes_creep_curve(self.effect(name)) for name in self.terms):
            return 0.0
        explained = self._explained_by_channel
        return explained.get("traction", 0.0) / max(sum(explained.values()), 1.0)

    def _tempered(self, square: float) -> float:
        """The same by the mean square error of the formulas, c^2."""
        explained = self.before - self.chi2 - sum(self.fit.taken_exactly.values())
        explained = explained if explained > ROUNDING * self.before else 0.0
        return 1.0 + float(np.sqrt(square * explained))

    def effect(self, name: str) -> Effect:
        """A term as it acts."""
        return self.fit.problem.effect(name)

    def term(self, name: str) -> Term:
        """What a term is, whatever its form."""
        return term_of(name, self.effect(name))

    @property
    def can_err(self) -> bool:
        """Whether it has terms that are more than constants and lines added to what is recorded."""
        return not all(self.effect(name).exact for name in self.terms)

    @property
    def is_spent(self) -> bool:
        """Whether so much was predicted for it and others that nothing more is tried."""
        return self.fit.problem.effort.spent > SEARCH.most_effort

    @property
    def labels(self) -> frozenset[Term]:
        """What all terms are."""
        return frozenset(self.term(name) for name in self.terms)

    def terms_in(self, channel: str) -> list[str]:
        """The terms that show first in a channel."""
        return [name for name in self.terms if self.fit.problem.shown_in(self.effect(name)) == channel]

    @property
    def explained(self) -> set[str]:
        """The channels in which its terms show first."""
        return {self.fit.problem.shown_in(self.effect(name)) for name in self.terms}

    @property
    def laws(self) -> dict[str, Trial]:
        """The terms that are laws."""
        return {name: effect for name in self.terms if isinstance(effect := self.effect(name), Trial)}


def powers(fitted: Fit) -> dict[str, float]:
    """Squared length of the white residual of each channel."""
    return {channel: fitted.power(channel) for channel in fitted.problem.channels}


def explained_channels(before: Explanation, after: Explanation) -> set[str]:
    """Channels from which one explanation takes a good part of what it takes from what another leaves."""
    taken = _falls(powers(before.fit), powers(after.fit))
    return {c for c in taken if taken[c] > SEARCH.replaced_share * max(taken.values())}


def _falls(before: Mapping[str, float], after: Mapping[str, float]) -> dict[str, float]:
    """By how much chi2 of each channel falls, where it does."""
    return {channel: max(power - after[channel], 0.0) for channel, power in before.items()}


def _excess(fitted: Fit, taken: Mapping[str, float]) -> float:
    """By how much noise is larger than it had to be assumed, by what is left where chi2 has fallen: by channel."""
    fallen = sum(taken.values())
    return sum(fitted.excess_of_assumed(c) * part for c, part in taken.items()) / fallen if fallen > 0.0 else 1.0


def is_error(effect: Effect) -> bool:
    """Whether an effect is an error of what a rig sets, or of what it records of the traction."""
    return effect.stage == "operation" or (effect.channel == "traction" and effect.stage == "sensor")


def _shapes_creep_curve(effect: Effect) -> bool:
    """Whether an effect or law changes the slope of the creep curve, or the friction over the creepage."""
    over = effect.covariate if isinstance(effect, Trial) else effect.over
    return effect.stage in ("friction", "traction") and over in ("", "creepage")


def evidence_of(explanation: Explanation) -> float:
    """Logarithm of the evidence of an explanation, to sort by."""
    return explanation.evidence


def by_falling(explanations: Sequence[Explanation], score: Callable[[Explanation], float]) -> list[Explanation]:
    """Explanations by falling score [nats]; those within the numerical error of the evidence of the best left tie.

    Of a tie the shortest description comes first (fewest parameters, lowest cost of its forms), then the name.
    """
    rest, ordered = sorted(explanations, key=score, reverse=True), list[Explanation]()
    while rest:
        tie = [e for e in rest if score(rest[0]) - score(e) <= SEARCH.evidence_error]
        ordered += sorted(tie, key=_description)
        rest = rest[len(tie) :]
    return ordered


def by_falling_share(explanations: Sequence[Explanation], shares: Sequence[float] | Floats) -> list[Explanation]:
    """Explanations by falling share; those whose shares differ by rounding only stay in their order."""
    ordered = sorted(zip(explanations, shares, strict=True), key=lambda pair: falling(pair[1]))
    return [explanation for explanation, _ in ordered]


def _description(explanation: Explanation) -> tuple[int, float, list[str]]:
    """Number of parameters, cost of the forms, and names of an explanation."""
    return len(explanation.fit.theta), round(sum(explanation.costs.values()), 6), sorted(explanation.terms)


def ranked(explanations: Sequence[Explanation]) -> list[Explanation]:
    """Explanations by falling evidence, the best form of each."""
    best: dict[frozenset[Term], Explanation] = {}
    for explanation in by_falling(explanations, evidence_of):
        best.setdefault(explanation.labels, explanation)
    return list(best.values())


def on_samples_of(base: Fit, explanation: Explanation, fitted: Fit) -> Explanation:
    """The same terms as fitted to the samples of a fit of the base model, and judged beside it."""
    first = Explanation.of_base(base, explanation.elsewhere)
    return replace(explanation, fit=fitted, before=first.before, missed=first.missed)


def without(explanation: Explanation, *names: str) -> Explanation:
    """The explanation with terms left out, the others fitted again."""
    rest = [term for term in explanation.terms if term not in names]
    problem = explanation.fit.problem.with_terms(*rest)
    costs = {term: explanation.costs[term] for term in rest}
    return replace(explanation, fit=fit(problem, carried(problem, explanation.fit)), costs=costs)


def refitted(explanation: Explanation) -> Explanation:
    """The same terms with the nuisances where the fit is now."""
    return replace(explanation, fit=refit(explanation.fit.problem, explanation.fit.theta))
