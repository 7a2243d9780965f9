"""How often an explanation comes back when the data are drawn again: a bootstrap of blocks by linear algebra.

    chi2_w = r'W r - g'(J'W J + P)^-1 g,   g = J'W r + m

    r, J  white residual and Jacobian of an explanation at its own minimum, P the precision of its priors
    m     the parameters with a unit normal prior, zero for the others: where each block is drawn once, g is zero
    W     how often each block of neighbouring samples was drawn

A parameter that the data press against a bound stays there.

Each draw weighs all explanations by their tempered evidence; the probability of one is its mean weight, less the part
that belongs to what is among none of them.
Source: H. R. Kuensch, Annals of Statistics 17 (1989) 1217-1241.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from twindisc_cli.loop.explanation import Explanation
from twindisc_cli.loop.fit import Fit, precision
from twindisc_cli.loop.thresholds import RESAMPLING
from twindisc_cli.model.experiment import Floats, Ints

SEED = 20061139  # the same draws in every run
ROUNDING = 1e-12  # of each parameter's precision: what a draw does not fix stays where it is


def blocks(fitted: Fit) -> Ints:
    """Block of each white sample (sample,): runs of neighbours in time or across the track, of every channel."""
    result, first = [], 0
    for part in fitted.problem.places.values():
        size = part.stop - part.start
        count = int(np.clip(size // RESAMPLING.block_samples, 5, RESAMPLING.blocks))
        result.append(first + np.arange(size) * count // max(size, 1))
        first += count
    return np.concatenate(result).astype(np.int64)


def weights(explanations: Sequence[Explanation], draws: int = RESAMPLING.draws) -> Floats:
    """Weights (draw, explanation) of explanations of the same samples, each row of sum one."""
    block = blocks(explanations[0].fit)
    generator = np.random.default_rng(SEED)
    drawn = _drawn(explanations[0].fit, block, generator, draws)
    evidence = np.array([_evidence(e, block, drawn) for e in explanations]).T
    weight = softened(evidence, explanations) * np.exp([e.plausibility for e in explanations])
    return np.asarray(weight / weight.sum(axis=1, keepdims=True))


def shares(explanations: Sequence[Explanation]) -> Floats:
    """Probabilities of explanations of the same samples (explanation,); one less their sum is that of none of these."""
    return np.asarray((1.0 - RESAMPLING.none_of_these) * np.mean(weights(explanations), axis=0))


def softened(evidence: Floats, explanations: Sequence[Explanation]) -> Floats:
    """Weights (draw, explanation) from evidences, tempered by the scale of the best."""
    scale = np.array([e.evidence_scale for e in explanations])[np.argmax(evidence, axis=1)][:, None]
    relative = np.exp((evidence - evidence.max(axis=1, keepdims=True)) / scale)
    return np.asarray(relative / relative.sum(axis=1, keepdims=True))


def _drawn(fitted: Fit, block: Ints, generator: np.random.Generator, draws: int) -> Floats:
    """How often each block is drawn (draw, block), among the blocks of its own channel."""
    columns = []
    for part in fitted.problem.places.values():
        count = len(np.unique(block[part]))
        columns.append(generator.multinomial(count, np.full(count, 1.0 / count), size=draws))
    return np.concatenate(columns, axis=1).astype(float)


def _evidence(explanation: Explanation, block: Ints, drawn: Floats) -> Floats:
    """Evidence of an explanation in every draw (draw,)."""
    fitted = explanation.fit
    chi2, _ = _drawn_again(fitted, block, drawn)
    return np.asarray(explanation.evidence + 0.5 * (fitted.chi2 - chi2))


def _drawn_again(fitted: Fit, block: Ints, drawn: Floats) -> tuple[Floats, Floats]:
    """chi2 in every draw (draw,), and how far its parameters are from those of the fit (draw, parameter)."""
    count = drawn.shape[1]
    J, r, k = fitted.jacobian * ~fitted.pressed, fitted.residual, len(fitted.theta)
    # Blocks' own sums; a draw is a weighted sum of them.
    order = np.argsort(block, kind="stable")
    starts = np.searchsorted(block[order], np.arange(count))
    A = np.add.reduceat((J[:, :, None] * J[:, None, :])[order].reshape(len(r), -1), starts, axis=0)
    g = np.add.reduceat((J * r[:, None])[order], starts, axis=0)
    s = np.add.reduceat((r**2)[order], starts)
    prior = precision(fitted.problem)
    both = (drawn @ A).reshape(len(drawn), k, k) + np.diag(prior)
    pull = drawn @ g + np.where(fitted.problem.normal & ~fitted.pressed, fitted.theta, 0.0)
    scale = 1.0 / np.sqrt(np.maximum(np.einsum("dii->di", both), 1e-300))
    scaled = both * scale[:, :, None] * scale[:, None, :] + ROUNDING * np.eye(k)
    step = scale * np.linalg.solve(scaled, (scale * pull)[..., None])[..., 0]
    return np.asarray(drawn @ s - np.sum(pull * step, axis=1)), np.asarray(step)


def scatter(fitted: Fit) -> tuple[Floats, Floats]:
    """Standard deviation of the parameters over the draws (parameter,), and its own relative error by chance.

    What a formula misses is correlated over a whole block, so that blocks scatter more than their samples do.
    """
    block = blocks(fitted)
    drawn = _drawn(fitted, block, np.random.default_rng(SEED), RESAMPLING.draws)
    _, step = _drawn_again(fitted, block, drawn)
    leverage = np.add.reduceat(fitted.jacobian**2, np.searchsorted(block, np.arange(drawn.shape[1])), axis=0)
    seen = np.sum(leverage, axis=0) ** 2 / np.maximum(np.sum(leverage**2, axis=0), 1e-300)
    return np.std(step, axis=0), np.asarray(1.0 / np.sqrt(2.0 * np.maximum(seen, 1.0)))
