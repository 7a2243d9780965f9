"""Screening: is anything left in a channel, and what does it depend on?

    q_g = |P_g r|^2 / k_g-scaled,   p = share of simulated noise whose best score beats the best of the data

    r    white residual after the fit, P_g projection on the generic functions of a group that the fitted
         parameters cannot absorb (Frisch-Waugh), k_g their number

The smallest of all p-values is compared with the smallest of each draw, which pays for the size of the search
(P. H. Westfall, S. S. Young, 1993). Noise is drawn sample by sample: the directions of a projection are those of a
decomposition, which a processor's rounding may turn. How much a group says is its evidence with a normal prior of the
best size: (q - k) / 2 - (k / 2) log(q / k).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy.special import chdtrc

from twindisc_cli.loop.channels import channels
from twindisc_cli.loop.fit import Fit
from twindisc_cli.loop.problem import Case
from twindisc_cli.loop.thresholds import ACCEPTANCE
from twindisc_cli.model.experiment import Floats
from twindisc_cli.model.prediction import Prediction

SPANS = ("iterations", "heat by iteration")
DRAWS = 1000  # the least p-value is 0.001
OWN = 0.5  # share of a direction in its channel [1], above which what lies along it there is left of that channel
MOST_ENDS = 30  # groups of generic functions whose largest is tested
SEED = 20061139  # the same draws in every run


@dataclass(frozen=True)
class Group:
    """Columns (sample, column) over a channel of one test, functions of one covariate.

    `spans`: the columns follow each other along the covariate, and sums of neighbours, one at a time, are a group too.
    """

    channel: str
    covariate: str
    kind: str
    columns: Floats
    spans: bool = False


def groups(case: Case, channel: str, prediction: Prediction) -> Iterator[Group]:
    """Every generic function of a channel that varies over its samples."""
    for covariate, kind, columns in channels()[channel].generic(case.model, prediction):
        varied = columns[:, np.ptp(columns, axis=0) > 1e-9]
        if varied.shape[1]:
            yield Group(channel, covariate, kind, varied, spans=kind in SPANS)


@dataclass(frozen=True)
class Score:
    """What one generic group says: q its squared length in noise units, k its columns, p its own p-value, evidence."""

    group: Group
    squared: float
    count: int
    p_value: float
    evidence: float
    share: float


@dataclass(frozen=True)
class Residual:
    """What is left in a channel: scores by falling evidence, family-wise p-value, excess length in noise units."""

    channel: str
    scores: Sequence[Score]
    p_value: float
    length: float

    def significant(self, level: float) -> bool:
        """Whether something is left beyond the noise."""
        return self.p_value < level

    @property
    def covariates(self) -> list[Score]:
        """The best score of every covariate, by falling evidence."""
        best: dict[str, Score] = {}
        for score in self.scores:
            if score.evidence > 0.0:
                best.setdefault(score.group.covariate, score)
        return list(best.values())


def unexplained_residual(fitted: Fit, channel: str, *, own: bool = False) -> Residual:
    """Test the generic functions of a channel on the residual of a fit; own: of the samples of that channel alone.

    A level of T/N that mu absorbs leaves the temperature that goes with mu: what the temperature is missed by asks for
    such a level, too, though the traction is not missed.
    """
    problem = fitted.problem
    span = _reached(fitted)
    bases: list[tuple[Group, _Basis]] = []
    for number, (case, prediction) in enumerate(zip(problem.cases, problem.predict(fitted.theta[None]), strict=True)):
        if channel in case.noise:
            for group in groups(case, channel, prediction):
                basis = _basis(fitted, number, group, span)
                basis = _of_channel(fitted, channel, basis) if own else basis
                if basis.span.shape[1]:
                    bases.append((group, basis))
    if not bases:
        return Residual(channel, [], 1.0, 0.0)
    drawn_along = _noise(len(fitted.residual)) @ np.concatenate([basis.span for _, basis in bases], axis=1)
    ends = np.cumsum([basis.span.shape[1] for _, basis in bases])[:-1]
    total = fitted.power(channel)
    scores, smallest = [], np.ones(DRAWS)
    for (group, basis), draws in zip(bases, np.split(drawn_along, ends, axis=1), strict=True):
        for tested in (_together, _spans) if group.spans else (_together,):
            score, drawn = tested(group, basis, fitted.residual, draws, total)
            smallest = np.minimum(smallest, drawn)
            scores.append(score)
    scores.sort(key=lambda s: -s.evidence)
    least = min(s.p_value for s in scores)
    family = float(np.mean(smallest <= least))
    if family == 0.0:
        family = min(least * len(scores), 1.0 / DRAWS)
    excess = max((s.squared - s.count for s in scores), default=0.0)
    return Residual(channel, scores, family, float(np.sqrt(max(excess, 0.0))))


def is_unexplained(rest: Residual, fitted: Fit, base: Fit) -> bool:
    """Whether what a fit leaves of a channel is more than noise, and than the own error of the formulas in it."""
    if not fitted.terms:
        return rest.significant(ACCEPTANCE.unexplained_alone)
    mean = fitted.power(rest.channel) / max(fitted.problem.count(rest.channel), 1)
    large = left_over_explained(rest, fitted, base) > ACCEPTANCE.formula_error or mean > ACCEPTANCE.mean_square_left
    return bool(large and rest.significant(ACCEPTANCE.unexplained_beside))


def is_beyond_assumed(fitted: Fit, channel: str) -> bool:
    """Whether something is left of a channel though its noise, if it had to be assumed, were several times as large."""
    if not fitted.problem.assumed(channel).any():
        return True
    level = ACCEPTANCE.unexplained_beside if fitted.terms else ACCEPTANCE.unexplained_alone
    louder = replace(fitted, residual=fitted.residual / ACCEPTANCE.assumed_noise)
    return unexplained_residual(louder, channel).significant(level)


def left_over_explained(rest: Residual, fitted: Fit, base: Fit) -> float:
    """Length of what a fit leaves of a channel, over that of what its formulas explain there that can err [1]."""
    explained = fitted.explained(rest.channel, base.power(rest.channel))
    return float(rest.length / np.sqrt(explained)) if explained > 0.0 else np.inf


def _reached(fitted: Fit) -> Floats:
    """Orthonormal directions (sample, direction) where the parameters go beyond the noise within their bounds.

    A parameter that the data press against a bound goes nowhere.
    """
    lower, upper = fitted.problem.bounds
    left, size, _ = np.linalg.svd((fitted.jacobian * (upper - lower))[:, ~fitted.pressed], full_matrices=False)
    return np.asarray(left[:, size > 1.0])


@lru_cache(maxsize=2)
def _noise(count: int) -> Floats:
    """Draws of white noise (draw, sample), the same in every call."""
    return np.random.default_rng(SEED).standard_normal((DRAWS, count))


@dataclass(frozen=True)
class _Basis:
    """White columns of a group without what the fitted parameters can absorb: columns = span coordinates.

    span (sample, direction) is orthonormal, coordinates are (direction, column).
    """

    span: Floats
    coordinates: Floats


def _basis(fitted: Fit, number: int, group: Group, span: Floats) -> _Basis:
    problem = fitted.problem
    case = problem.cases[number]
    rows = np.zeros((group.columns.shape[1], len(fitted.residual)))
    rows[:, problem.places[number, group.channel]] = case.noise[group.channel].whiten(group.columns.T)
    columns = problem.discount(rows).T
    columns = columns - span @ (span.T @ columns)
    left, size, right = np.linalg.svd(columns, full_matrices=False)
    seen = size > 1e-6 * max(float(size.max(initial=0.0)), 1e-300)
    return _Basis(left[:, seen], size[seen, None] * right[seen])


def _of_channel(fitted: Fit, channel: str, basis: _Basis) -> _Basis:
    """The part of a basis in the samples of its channel, along the directions that are mostly theirs."""
    own = np.zeros_like(basis.span)
    for part in fitted.problem.slices[channel]:
        own[part] = basis.span[part]
    share, turned = np.linalg.eigh(own.T @ own)
    root, turned = np.sqrt(share[share > OWN]), turned[:, share > OWN]
    return _Basis(own @ turned / root, root[:, None] * (turned.T @ basis.coordinates))


def _together(group: Group, basis: _Basis, residual: Floats, draws: Floats, total: float) -> tuple[Score, Floats]:
    """All columns at once; the p-values of the draws (draw,)."""
    count = basis.span.shape[1]
    squared = float(np.sum((basis.span.T @ residual) ** 2))
    evidence = 0.5 * (squared - count) - 0.5 * count * np.log(squared / count) if squared > count else 0.0
    share = min(max(squared - count, 0.0) / max(total, 1e-30), 1.0)
    score = Score(group, squared, count, float(chdtrc(count, squared)), float(evidence), share)
    return score, chdtrc(count, np.sum(draws**2, axis=1))


def _spans(group: Group, basis: _Basis, residual: Floats, draws: Floats, total: float) -> tuple[Score, Floats]:
    """The best sum of neighbouring columns, paid for the number of such sums; the p-values of the draws (draw,)."""
    columns = basis.coordinates.shape[1]
    ends = np.unique(np.linspace(0, columns, min(columns, MOST_ENDS) + 1).astype(int))
    running = np.concatenate([np.zeros((len(basis.coordinates), 1)), np.cumsum(basis.coordinates, axis=1)], axis=1)
    first, last = np.triu_indices(len(ends), 1)
    sums = running[:, ends[last]] - running[:, ends[first]]
    length = np.linalg.norm(sums, axis=0)
    sums = sums[:, length > 1e-6 * length.max()] / length[length > 1e-6 * length.max()]
    tries = sums.shape[1]
    squared = float(np.max((sums.T @ (basis.span.T @ residual)) ** 2))
    evidence = max(0.5 * (squared - 1.0) - 0.5 * np.log(max(squared, 1.0)) - np.log(tries), 0.0)
    share = min(max(squared - 1.0, 0.0) / max(total, 1e-30), 1.0)
    named = replace(group, kind=f"{group.kind}, a span")
    score = Score(named, squared, 1, min(1.0, tries * float(chdtrc(1, squared))), float(evidence), share)
    return score, np.minimum(1.0, tries * chdtrc(1, np.max((draws @ sums) ** 2, axis=1)))
