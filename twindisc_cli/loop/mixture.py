"""Predictions averaged over the explanations that the data leave, by their weight.

    prediction = sum over i of w_i f_i,   sum of w_i = 1

    f_i   prediction of explanation i, its parameters fitted to the same samples
    w_i   its mean weight over the resamples of the data; without resampling its tempered evidence

An average predicts the ends of a curve better than any rule that picks one of several explanations that fit alike.
Source: K. P. Burnham, D. R. Anderson, Sociological Methods & Research 33 (2004) 261-304.
"""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from twindisc_cli.loop.alternatives import Compared
from twindisc_cli.loop.channels import channels
from twindisc_cli.loop.judge import Judged, Kind, judge, rises
from twindisc_cli.loop.noise import Mask
from twindisc_cli.loop.terms import Term
from twindisc_cli.loop.thresholds import THRESHOLDS
from twindisc_cli.loop.validate import rms
from twindisc_cli.model.experiment import Floats


@dataclass(frozen=True)
class Mixture:
    """Explanations as judged, the answer first, and their weights (member,), which sum to one."""

    members: Sequence[Judged]
    weights: Floats

    def predicted(self, channel: str, number: int, kind: Kind) -> Floats:
        """Predicted samples of a channel of one test (sample,)."""
        model = self.members[0].before.problem.cases[number].model
        rows = [channels()[channel].predicted(model, m.prediction(kind)[number])[0] for m in self.members]
        return np.asarray(self.weights @ np.array(rows))

    def misses(self, channel: str, kind: Kind, *, held_out: bool) -> Floats:
        """Measured minus predicted of a channel, in the order of the record (sample,)."""
        return np.asarray(self.weights @ np.array([m.misses(channel, kind, held_out=held_out) for m in self.members]))

    def error(self, channel: str, kind: Kind, *, held_out: bool) -> float:
        """Root mean square of measured minus predicted; NaN without samples."""
        return rms(self.misses(channel, kind, held_out=held_out))


def mixture_of(
    judged: Judged,
    compared: Compared,
    refused: Container[frozenset[Term]],
    masks: Sequence[Mapping[str, Mask]],
) -> Mixture:
    """The answer with the explanations that stand beside it; alone where it is the base model, or where they err more.

    An explanation that was refused, or with a parameter at a bound, predicts nothing.
    """
    answer = judged.explanation
    weight = {m.labels: float(share) for m, share in zip(compared.members, compared.weights, strict=True)}
    beside = [m for m in compared.members if m.terms and m.labels != answer.labels and m.labels not in refused]
    beside = [m for m in beside if weight[m.labels] > THRESHOLDS.rival_share and not m.fit.at_bound]
    beside = sorted(beside, key=lambda m: -weight[m.labels])[: THRESHOLDS.mixed - 1] if answer.terms else []
    every = [judged, *(judge(m, judged.before, judged.unseen_before, masks) for m in beside)]
    share = np.array([max(weight[j.explanation.labels], THRESHOLDS.rival_share) for j in every])
    mixture = Mixture(every, share / share.sum())
    return mixture if not _errs_more(mixture) else Mixture([judged], np.ones(1))


def _errs_more(mixture: Mixture) -> bool:
    """Whether the average is farther from the samples it was fitted to than the answer alone."""
    answer = mixture.members[0]
    pairs = [
        tuple(of.misses(channel, "unseen_after", held_out=False) for of in (answer, mixture))
        for channel in answer.before.problem.channels
    ]
    return any(rises(alone, mixed) for alone, mixed in pairs)
