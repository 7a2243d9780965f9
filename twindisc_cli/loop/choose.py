"""Which of several explanations is gone on with: what says enough, an effect before a law, the rig before a sensor."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from twindisc_cli.laws.trial import Trial
from twindisc_cli.loop.explanation import Explanation, by_falling, evidence_of
from twindisc_cli.loop.problem import Problem
from twindisc_cli.loop.screen import unexplained_residual
from twindisc_cli.loop.thresholds import ACCEPTANCE, SEARCH
from twindisc_cli.model.experiment import Floats


def chosen(before: Explanation, tried: Sequence[Explanation]) -> Explanation | None:
    """The best of the explanations, an effect of the catalogue before a law; None where none says enough.

    A law of the rig comes before one of a sensor that says the same. A parameter that ran into a bound carries no
    explanation.
    """
    enough = [e for e in tried if _is_enough(e, before) and not e.fit.at_bound]
    return preferred(enough) if enough else None


def preferred(explanations: Sequence[Explanation]) -> Explanation:
    """Of the explanations not separated from the best, one of few laws, of the rig rather than of a sensor."""
    best = max(explanations, key=evidence_of)
    close = [e for e in explanations if (best.evidence - e.evidence) / best.evidence_scale < SEARCH.equivalent]
    fewest = min(len(e.laws) for e in close)
    return by_falling(
        [e for e in close if len(e.laws) == fewest],
        lambda e: e.evidence - best.evidence_scale * SEARCH.sensor_law_cost * _recorded(e),
    )[0]


def _recorded(explanation: Explanation) -> int:
    """How many laws of what a sensor records, whatever happens in the rig, are in an explanation."""
    return sum(law.stage == "sensor" for law in explanation.laws.values())


def _is_enough(explanation: Explanation, before: Explanation) -> bool:
    """Whether one more term says enough: more is asked of a law, and where much was explained before by formulas.

    What a sample says alone, which whitening may spread over its neighbours, does not count. A law may say less where
    the generic functions of its channel see that something is missing, too. A test that is only predicted counts
    against a term in full, and for it up to what the tests that are fitted say.
    """
    taken = before.fit.residual**2 - explanation.fit.residual**2
    here, more = explanation.here - before.here, explanation.evidence - before.evidence
    if min(here, more) < 0.5 * _by_one_sample(before.fit.problem, taken):
        return False
    gain = min(2.0 * here, more) / before.evidence_scale_for(explanation)
    new = [explanation.effect(name) for name in explanation.terms if name not in before.terms]
    if not any(isinstance(effect, Trial) for effect in new):
        return gain > SEARCH.effect_evidence
    if gain > SEARCH.law_evidence:
        return True
    left = unexplained_residual(before.fit, before.fit.problem.shown_in(new[0]))
    return gain > SEARCH.seen_law_evidence and left.significant(ACCEPTANCE.unexplained_alone)


def _by_one_sample(problem: Problem, taken: Floats) -> float:
    """What is taken from chi2 in one sample at most, of what is taken in each white one (sample,)."""
    spread = {part: 3 if problem.cases[part[0]].noise[part[1]].spreads else 1 for part in problem.parts}
    return max(float(np.max(np.convolve(taken[problem.places[part]], np.ones(n)))) for part, n in spread.items())
