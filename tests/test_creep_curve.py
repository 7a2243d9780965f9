"""The noise of swept curves: errors of the creepage that were put in are found, and none are invented."""

from __future__ import annotations

import numpy as np
import pytest
from rigs import Floats, experiment, history, rig

from twindisc_cli.loop.noise import Noise
from twindisc_cli.loop.problem import problem_of
from twindisc_cli.model.experiment import Experiment, Measured, TractionSamples

LEVELS = np.geomspace(0.003, 0.2, 12)
KNEE, MU, STD = 0.03, 0.06, 3e-4


def polach(creepage: Floats) -> Floats:
    """T/N of O. Polach, Wear 258 (2005) 992-1000, Eq. 3, with equal slope factors, on a plateau that rises a little."""
    e = np.abs(creepage) / KNEE * 3.0
    return np.asarray(np.sign(creepage) * MU * (2.0 / np.pi * (e / (1.0 + e**2) + np.arctan(e)) + np.abs(creepage)))


def swept(error: float, seed: int, *, samples: int = 40, way: float = 1.0) -> Experiment:
    """A sweep whose creepages are recorded with an error [1]: samples without time, as a table of a curve has them."""
    rng = np.random.default_rng(seed)
    true = np.sort(rng.uniform(0.004, 0.2, samples))
    seen = true + error * rng.standard_normal(samples)
    step = np.argmin(np.abs(np.log(true[:, None] / LEVELS)), axis=1)
    unknown = np.full(samples, np.nan)
    ratio = way * (polach(true) + STD * rng.standard_normal(samples))
    record = TractionSamples(unknown, step.astype(np.int64), way * seen, ratio, unknown)
    return experiment(history(way * LEVELS, 1), rig=rig(), measured=Measured(traction=record))


def noises(*tests: Experiment) -> list[Noise]:
    return [case.noise["traction"] for case in problem_of(tests).cases]


def sizes(noise: Noise) -> Floats:
    """Standard deviation of each sample."""
    return noise.std * (np.ones(len(noise.kept)) if noise.sizes is None else noise.sizes)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_samples_are_as_uncertain_as_their_creepage_makes_them_where_the_curve_is_steep(way: float) -> None:
    error = 0.004
    tests = [swept(error, seed, way=way) for seed in range(6)]
    ratios = []
    for test, noise in zip(tests, noises(*tests), strict=True):
        samples = test.measured.traction
        assert samples is not None
        v = np.clip(np.abs(samples.creepage), 0.004, None)
        slope = (polach(v + 1e-6) - polach(v - 1e-6)) / 2e-6
        ratios.append(sizes(noise) / np.hypot(STD, error * slope))
        assert noise.kept.mean() > 0.95, "what an error of the creepage does is no outlier"
    every = np.concatenate(ratios)
    assert 0.7 < np.median(every) < 1.4
    assert np.quantile(np.abs(np.log(every)), 0.9) < np.log(2.5)


def test_no_error_of_the_creepage_is_invented() -> None:
    assert all(noise.sizes is None for seed in range(20) for noise in noises(swept(0.0, seed)))


def test_the_sweeps_of_a_rig_tell_together_what_one_of_few_samples_does_not() -> None:
    few = [swept(0.003, seed, samples=18) for seed in range(40, 48)]
    assert sum(noises(test)[0].sizes is None for test in few) > 4
    assert all(noise.sizes is not None for noise in noises(*few))


def test_another_rig_has_errors_of_its_own() -> None:
    other = experiment((own := swept(0.0, 3)).history, rig=rig(radius=0.02), measured=own.measured, thermal=own.thermal)
    *loose, exact = noises(*(swept(0.004, seed) for seed in range(4)), other)
    assert all(noise.sizes is not None for noise in loose)
    assert exact.sizes is None
