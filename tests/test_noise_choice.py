"""Noise and answer judged together: volumes by hand, and which of several noises another set of samples has."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from rigs import Floats, experiment, history, spread, traction_samples
from scipy.stats import multivariate_normal

from twindisc_cli.loop.noise import Noise, Slow
from twindisc_cli.loop.noise_choice import with_noise_like
from twindisc_cli.loop.nuisances import Nuisances
from twindisc_cli.loop.problem import Problem, problem_of
from twindisc_cli.model.experiment import Measured

COUNT, OUTLIER = 40, 7
POSITION = np.cumsum(np.random.default_rng(0).uniform(0.3, 3.0, COUNT))
SERIES = np.repeat([0, 1], [25, 15])
KEPT = np.arange(COUNT) != OUTLIER
SIZES = np.linspace(0.6, 1.4, COUNT)
WHITE = Noise(0.004, 0.0, KEPT, POSITION, SERIES, estimated=True)
NOISES: Mapping[str, Noise] = {
    "white": WHITE,
    "of one memory": replace(WHITE, correlation=0.6),
    "of one memory, cautious": replace(WHITE, cautious=(0.005, 0.8)),
    "that grows": replace(WHITE, correlation=0.3, sizes=SIZES),
    "with a slow part": replace(WHITE, slow=Slow(0.7, (9.0,))),
}


def covariance(noise: Noise) -> Floats:
    """The covariance of the samples that are kept (kept sample, kept sample), written down entry by entry."""
    std, correlation = noise.cautious or (noise.std, noise.correlation)
    distance = np.abs(POSITION[:, None] - POSITION)
    falls = np.eye(COUNT) if correlation == 0.0 else correlation**distance
    if noise.slow is not None:
        falls = (1.0 - noise.slow.share) * np.eye(COUNT) + noise.slow.share * np.exp(-distance / noise.slow.memories[0])
    sizes = std * (np.ones(COUNT) if noise.sizes is None else noise.sizes)
    whole = np.where(SERIES[:, None] == SERIES, falls, 0.0) * sizes[:, None] * sizes
    return np.asarray(whole[np.ix_(KEPT, KEPT)])


@pytest.mark.parametrize("kind", NOISES)
def test_white_residual_and_volume_are_a_normal_density(kind: str) -> None:
    """log p = -|white|^2 / 2 - volume - n log(2 pi) / 2; samples are predicted from the nearest 16 and by octaves."""
    noise, values = NOISES[kind], 0.004 * np.random.default_rng(1).standard_normal(COUNT)
    white = noise.whiten(values)
    density = -0.5 * white @ white - noise.volume - 0.5 * len(white) * np.log(2.0 * np.pi)
    expected = multivariate_normal(cov=covariance(noise)).logpdf(values[KEPT])
    assert density == pytest.approx(expected, abs=1e-6 if noise.slow is None else 0.05)


def test_discounted_residual_and_volume_of_the_nuisances_are_a_normal_density() -> None:
    rng = np.random.default_rng(2)
    columns, residual = rng.standard_normal((12, 3)) * [0.1, 1.0, 10.0], rng.standard_normal(12)
    nuisances = Nuisances(("load", "crown", "creepage"), columns, np.zeros((12, 0)))
    left = nuisances.discounted(residual)
    density = -0.5 * left @ left - nuisances.volume - 6.0 * np.log(2.0 * np.pi)
    assert density == pytest.approx(multivariate_normal(cov=np.eye(12) + columns @ columns.T).logpdf(residual))


def test_other_samples_have_the_noise_of_the_same_kind() -> None:
    """Where all samples leave other noises open than those that are not held out: the kind first, then the size."""
    steps = history((0.02, 0.04, 0.09), 3)
    time = spread(steps, 12)
    test = experiment(steps, measured=Measured(traction=traction_samples(steps, time, np.full(len(time), 0.6))))
    own = Noise(0.003, 0.0, np.ones(len(time), dtype=bool), time, np.zeros(len(time), np.int64), estimated=True)
    quick, slow, slower = (replace(own, std=std, slow=part) for std, part in
                           ((0.004, None), (0.005, Slow(0.5, (16.0,))), (0.005, Slow(0.8, (64.0,)))))  # fmt: skip

    def with_traction(noise: Noise) -> Problem:
        (case,) = (problem := problem_of([test])).cases
        return replace(problem, cases=[replace(case, noise={"traction": noise})])

    def chosen(noise: Noise, other: Noise) -> Noise:
        return with_noise_like(with_traction(noise), with_traction(other)).cases[0].noise["traction"]

    left_open = replace(own, rivals=(quick, slow, slower))
    assert chosen(left_open, slow) is slow
    assert chosen(left_open, replace(slower, std=0.9)) is slower
    assert chosen(left_open, replace(quick, std=0.0041)) is quick
    assert chosen(left_open, own) is left_open
    assert chosen(own, slow) is own
