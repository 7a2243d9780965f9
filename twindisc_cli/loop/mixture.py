"""Predictions averaged over the explanations that the data leave, by their weight.

    prediction = sum over i of w_i f_i,   sum of w_i = 1

    f_i   prediction of explanation i, its parameters fitted to the same samples
    w_i   its mean weight over the resamples of the data; without resampling exp[E_i / (t c)] p_i
    E_i   evidence, t its temperature; c variance of what is left by the best over that of the noise, at least one
    p_i   prior odds: that of the base model against that of all others together are one

Beyond the covariates of the samples that were fitted, lines and powers over these, which grow without bound, have no
weight beside other explanations; a curve stays what it was at the last of them.

An average predicts the ends of a curve better than any rule that picks one of several explanations of equal fit.
Source: K. P. Burnham, D. R. Anderson, Sociological Methods & Research 33 (2004) 261-304, with c in their QAIC.
"""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from twindisc_cli.laws.trial import Trial
from twindisc_cli.loop.alternatives import Compared
from twindisc_cli.loop.channels import channels
from twindisc_cli.loop.fit import Fit
from twindisc_cli.loop.judge import Judged, Kind, judge, rises
from twindisc_cli.loop.noise import Mask
from twindisc_cli.loop.search import Explanation
from twindisc_cli.loop.term_intervals import INTERVAL
from twindisc_cli.loop.terms import Term
from twindisc_cli.loop.thresholds import RESAMPLING
from twindisc_cli.loop.validate import rms
from twindisc_cli.model.experiment import Floats
from twindisc_cli.model.forward import ForwardModel, Prediction

ROUNDING = 1e-6  # relative, of a covariate


@dataclass(frozen=True)
class Mixture:
    """Explanations as judged, the answer first, and their weights (member,), which sum to one.

    spans: lowest and highest size of each covariate of the samples that were fitted, by channel and covariate.
    """

    members: Sequence[Judged]
    weights: Floats
    spans: Mapping[tuple[str, str], tuple[float, float]] = field(default_factory=dict)

    def weights_at(self, channel: str, model: ForwardModel, prediction: Prediction) -> Floats:
        """Weights at the samples of a channel of a test (member, sample); its covariates are those of a prediction.

        Beyond the covariates it was learnt on, what grows there without bound gives way to what does not.
        """
        over = channels()[channel].covariates(model, prediction)
        beyond = {name: self._beyond(channel, name, np.abs(values)) for name, values in over.items()}
        count = len(next(iter(beyond.values())))
        weights = np.repeat(self.weights[:, None], count, axis=1)
        for number, member in enumerate(self.members):
            for law in _unbounded(member.explanation):
                weights[number, beyond.get(law.covariate, np.zeros(count, dtype=bool))] = 0.0
        weights = np.where(weights.sum(axis=0) > 0.0, weights, self.weights[:, None])
        return np.asarray(weights / weights.sum(axis=0))

    def _beyond(self, channel: str, covariate: str, values: Floats) -> Mask:
        """Which samples have a covariate (sample,) beyond those that were fitted, by more than rounding."""
        low, high = self.spans.get((channel, covariate), (-np.inf, np.inf))
        return np.asarray((values < low * (1.0 - ROUNDING)) | (values > high * (1.0 + ROUNDING)))

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
    compared: Compared,
    refused: Container[frozenset[Term]],
    masks: Sequence[Mapping[str, Mask]],
) -> Mixture:
    """The answer with the explanations that stand beside it, the base model among them; alone where they err more.

    An explanation that was refused, that jumps, or with a parameter at a bound predicts nothing; an answer that jumps
    little beside others.
    """
    answer = judged.explanation
    silent = [m.labels in refused or bool(m.fit.at_bound) or _jumps(m) for m in compared.members]
    every = [m for m, no in zip(compared.members, silent, strict=True) if not no or m.labels == answer.labels]
    weight = dict(zip((m.labels for m in every), _weights(every, compared), strict=True))
    beside = [m for m in every if m.labels != answer.labels and weight[m.labels] > RESAMPLING.rival_share]
    beside = sorted(beside, key=lambda m: -weight[m.labels])[: RESAMPLING.most_mixed - 1]
    doubtful = beside and _jumps(answer)
    weight[answer.labels] = RESAMPLING.rival_share if doubtful else max(weight[answer.labels], RESAMPLING.rival_share)
    members = [judged, *(judge(m, judged.before, judged.unseen_before, masks) for m in beside)]
    share = np.array([weight[j.explanation.labels] for j in members])
    mixture = Mixture(members, share / share.sum(), _spans(judged.unseen_before))
    return mixture if not _errs_more(mixture) else Mixture([judged], np.ones(1))


def _jumps(explanation: Explanation) -> bool:
    """Whether the 90 % interval of the width of an effect's transition reaches a jump.

    It is somewhere between two samples; where, and how wide, these do not say.
    """
    fitted, problem = explanation.fit, explanation.fit.problem
    widths = {(name, p.name) for name in explanation.terms for p in explanation.effect(name).params if p.is_width}
    for number in (i for i, p in enumerate(problem.parameters) if (p.term, p.key) in widths):
        theta = fitted.theta.copy()
        theta[number] = problem.bounds[0][number]
        left = problem.discount(problem.white(problem.predict(theta[None])) - problem.measured)[0]
        if float(left @ left) < fitted.chi2 + INTERVAL * fitted.excess:
            return True
    return False


def _unbounded(explanation: Explanation) -> list[Trial]:
    """The laws of an explanation that grow without bound: lines and powers."""
    return [law for law in explanation.laws.values() if law.shape in ("linear", "power")]


def _spans(fitted: Fit) -> dict[tuple[str, str], tuple[float, float]]:
    """Lowest and highest size of each covariate of the samples of a fit, by channel and covariate."""
    sizes: dict[tuple[str, str], list[Floats]] = {}
    predictions = fitted.problem.predict(fitted.theta[None])
    for number, channel in fitted.problem.parts:
        over = channels()[channel].covariates(fitted.problem.cases[number].model, predictions[number])
        for name, values in over.items():
            sizes.setdefault((channel, name), []).append(np.abs(values))
    return {key: (float(np.concatenate(v).min()), float(np.concatenate(v).max())) for key, v in sizes.items()}


def _weights(every: Sequence[Explanation], compared: Compared) -> Floats:
    """Weights of explanations (member,): how often they are chosen in the resamples, else by their evidence."""
    if np.isfinite(compared.shares).all():
        share = {m.labels: float(s) for m, s in zip(compared.members, compared.shares, strict=True)}
        return np.array([share[m.labels] for m in every])
    evidence = np.array([m.evidence for m in every])
    best = every[int(np.argmax(evidence))]
    left = min(m.fit.chi2 / max(len(m.fit.residual) - len(m.fit.theta), 1) for m in every)
    price = np.array([np.log(len(every)) - m.plausibility if m.terms else 0.0 for m in every])
    relative = np.exp((evidence - best.evidence) / (best.temperature * max(left, 1.0)) - price)
    return np.asarray(relative / relative.sum())


def _errs_more(mixture: Mixture) -> bool:
    """Whether the average is farther from the samples it was fitted to than the answer alone."""
    answer = mixture.members[0]
    pairs = [
        tuple(of.misses(channel, "unseen_after", held_out=False) for of in (answer, mixture))
        for channel in answer.before.problem.channels
    ]
    return any(rises(alone, mixed) for alone, mixed in pairs)
