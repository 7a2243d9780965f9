"""Predictions averaged over the explanations that the data leave, by their weight.

    prediction = sum over i of w_i f_i,   sum of w_i = 1

    f_i   prediction of explanation i, its parameters fitted to the same samples
    w_i   exp[E_i / (t c)] p_i
    E_i   evidence, t its temperature; c variance of what is left by the best over that of the noise, at least one
    p_i   prior odds: that of the base model against that of all others together are one

What predicts other tests is fitted to all samples, those held out as well; the weights are those of the evidence then.

Beyond the covariates of the samples that were fitted, lines and powers over these, which grow without bound, have no
weight beside other explanations; a curve stays what it was at the last of them. Nor has a jump between the two samples
between which it stands: no sample shows where.

An average predicts the ends of a curve better than any rule that picks one of several explanations of equal fit.
Source: K. P. Burnham, D. R. Anderson, Sociological Methods & Research 33 (2004) 261-304, with c in their QAIC.
"""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from twindisc_cli.identify.span import span_of
from twindisc_cli.loop.channels import channels
from twindisc_cli.loop.explanation import Explanation, by_falling_share, on_samples_of
from twindisc_cli.loop.fit import Fit
from twindisc_cli.loop.holdout import holds_out
from twindisc_cli.loop.judge import Judged, Kind, about_jumps, judge
from twindisc_cli.loop.noise import Mask
from twindisc_cli.loop.term_intervals import INTERVAL
from twindisc_cli.loop.terms import Term
from twindisc_cli.loop.thresholds import RESAMPLING
from twindisc_cli.loop.ties import first_of_most
from twindisc_cli.loop.validate import rms
from twindisc_cli.model.experiment import Floats
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.model.prediction import Prediction

ROUNDING = 1e-6  # relative, of a covariate


@dataclass(frozen=True)
class Mixture:
    """Explanations as judged, the answer first, and their weights (member,), which sum to one.

    fitted: sizes of each covariate of the samples that were fitted, sorted (sample,), by channel and covariate. jumps:
    of each member the covariates over which it jumps, and where.
    """

    members: Sequence[Judged]
    weights: Floats
    fitted: Mapping[tuple[str, str], Floats] = field(default_factory=dict)
    jumps: Sequence[Sequence[tuple[str, Floats]]] = ()

    @cached_property
    def on_all(self) -> Mixture:
        """The same explanations, weighed by all samples, with which their parameters are then estimated as well."""
        judged = self.members[0]
        if not holds_out(judged.masks):
            return self
        whole = [on_samples_of(judged.base_estimated, m.explanation, m.estimated) for m in self.members]
        return replace(self, weights=_by_evidence(whole), fitted=_fitted(judged.before))

    def weights_at(self, channel: str, model: ForwardModel, prediction: Prediction) -> Floats:
        """Weights at the samples of a channel of a test (member, sample); its covariates are those of a prediction.

        Beyond the covariates it was learnt on, what grows there without bound gives way to what does not; and a jump to
        what has none where no sample shows where it is.
        """
        over = channels()[channel].covariates(model, prediction)
        count = len(next(iter(over.values())))
        weights = np.repeat(self.weights[:, None], count, axis=1)
        for number, member in enumerate(self.members):
            for covariate in _unbounded(member.explanation):
                if (known := self.fitted.get((channel, covariate))) is not None:
                    weights[number, _beyond(known, np.abs(over[covariate]))] = 0.0
            for covariate, places in self.jumps[number] if self.jumps else ():
                if (known := self.fitted.get((channel, covariate))) is not None:
                    weights[number, about_jumps(covariate, places, known, np.abs(over[covariate]))] = 0.0
        weights = np.where(weights.sum(axis=0) > 0.0, weights, self.weights[:, None])
        return np.asarray(weights / weights.sum(axis=0))

    def predicted(self, channel: str, number: int, kind: Kind) -> Floats:
        """Predicted samples of a channel of one test (sample,)."""
        before = self.members[0]
        model = before.before.problem.cases[number].model
        rows = [channels()[channel].predicted(model, m.prediction(kind)[number])[0] for m in self.members]
        weights = self.weights_at(channel, model, before.prediction("unseen_before")[number])
        return np.asarray(np.sum(weights * np.array(rows), axis=0))

    def misses(self, channel: str, kind: Kind, *, held_out: bool) -> Floats:
        """Measured minus predicted of a channel, in the order of the record (sample,)."""
        judged, misses = self.members[0], []
        for number, case in enumerate(judged.before.problem.cases):
            if channel in case.noise:
                order = case.noise[channel].order
                order = order[judged.masks[number][channel][order] == held_out]
                misses.append((case.values(channel) - self.predicted(channel, number, kind))[order])
        return np.concatenate(misses)

    def error(self, channel: str, kind: Kind, *, held_out: bool) -> float:
        """Root mean square of measured minus predicted; NaN without samples."""
        return rms(self.misses(channel, kind, held_out=held_out))


def mixture_of(
    judged: Judged,
    explanations: Sequence[Explanation],
    erring: Container[frozenset[Term]],
    masks: Sequence[Mapping[str, Mask]],
) -> Mixture:
    """The answer with the explanations that stand beside it, the base model among them.

    Those that raise an error, or with a parameter that the data press against a bound, predict nothing.
    """
    answer = judged.explanation
    every = [m for m in explanations if m.labels == answer.labels or not (m.labels in erring or m.fit.at_bound)]
    weight = dict(zip((m.labels for m in every), _by_evidence(every), strict=True))
    beside = [m for m in every if m.labels != answer.labels and weight[m.labels] > RESAMPLING.rival_share]
    beside = by_falling_share(beside, [weight[m.labels] for m in beside])[: RESAMPLING.most_mixed - 1]
    weight[answer.labels] = max(weight[answer.labels], RESAMPLING.rival_share)
    members = [judged, *(judge(m, judged.before, judged.unseen_before, masks) for m in beside)]
    share = np.array([weight[j.explanation.labels] for j in members])
    places = [jumps(member.explanation) for member in members]
    return Mixture(members, share / share.sum(), _fitted(judged.unseen_before), places)


def jumps(explanation: Explanation) -> list[tuple[str, Floats]]:
    """Where an explanation jumps, and over which covariate: steps of laws, and transitions that may be jumps.

    These are effects the 90 % interval of whose width reaches its lower bound, where all but their place follow to
    first order: it is somewhere between two samples.
    """
    fitted = explanation.fit
    places = [(law.covariate, law.jumps) for law in explanation.laws.values() if law.jumps.size]
    for name in (name for name in explanation.terms if name not in explanation.laws):
        effect = explanation.effect(name)
        widths = [p for p in effect.params if p.width_of and _may_jump(fitted, name, p.name)]
        places.extend((effect.over, np.ravel(fitted.values(name)[width.width_of])) for width in widths)
    return places


def _may_jump(fitted: Fit, name: str, width: str) -> bool:
    """Whether a transition of no width stays within the 90 % interval, all but what shapes it fitted beside it."""
    problem = fitted.problem
    shapes = [i for i, p in enumerate(problem.parameters) if p.term == name and p.off is None]
    number = next(i for i, p in enumerate(problem.parameters) if (p.term, p.key) == (name, width))
    theta = fitted.theta.copy()
    theta[number] = problem.bounds[0][number]
    left = problem.discount(problem.white(problem.predict(theta[None])) - problem.measured)[0]
    others = span_of(np.delete(fitted.jacobian, shapes, axis=1))
    left -= others @ (others.T @ left)
    return float(left @ left) < fitted.chi2 + INTERVAL * fitted.excess


def _unbounded(explanation: Explanation) -> list[str]:
    """The covariates over which laws of an explanation grow without bound: lines and powers."""
    return [law.covariate for law in explanation.laws.values() if law.shape in ("linear", "power")]


def _beyond(known: Floats, values: Floats) -> Mask:
    """Which covariates (value,) are beyond all that are known, sorted (sample,), by more than rounding."""
    return np.asarray((values < known[0] * (1.0 - ROUNDING)) | (values > known[-1] * (1.0 + ROUNDING)))


def _fitted(fitted: Fit) -> dict[tuple[str, str], Floats]:
    """Sizes of each covariate of the samples of a fit, sorted (sample,), by channel and covariate."""
    sizes: dict[tuple[str, str], list[Floats]] = {}
    predictions = fitted.problem.predict(fitted.theta[None])
    for number, channel in fitted.problem.parts:
        over = channels()[channel].covariates(fitted.problem.cases[number].model, predictions[number])
        for name, values in over.items():
            sizes.setdefault((channel, name), []).append(np.abs(values))
    return {key: np.sort(np.concatenate(values)) for key, values in sizes.items()}


def _by_evidence(every: Sequence[Explanation]) -> Floats:
    """Weights of explanations (member,)."""
    evidence = np.array([m.evidence for m in every])
    best = every[first_of_most(evidence)]
    excess = min(m.fit.excess for m in every)
    cost = np.array([np.log(len(every)) - m.plausibility if m.terms else 0.0 for m in every])
    relative = np.exp((evidence - best.evidence) / (best.tempering * excess) - cost)
    return np.asarray(relative / relative.sum())
