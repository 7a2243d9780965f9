"""Operating points: the history is covered once, and every sample finds its instant."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rigs import experiment, history, running, traction_samples

from twindisc_cli.model.experiment import Experiment, History, Measured, TemperatureSamples, TractionSamples
from twindisc_cli.model.points import MOST_CUTS, Points, operating_points, sample_times

UNEVEN = replace(
    history((0.01, 0.03, 0.02), (2, 1, 3)),
    duration=np.array([84.0, 20.0, 300.0, 7.0, 84.0, 50.0]),
    revolutions=np.array([4200.0, 1000.0, 9000.0, 100.0, 4200.0, 3000.0]),
)


def sampled(history: History, traction: TractionSamples | None, temperature: np.ndarray | None = None) -> Experiment:
    warm = None if temperature is None else TemperatureSamples(temperature, np.full(len(temperature), 300.0))
    return experiment(history, measured=Measured(traction=traction, temperature=warm))


def random_times(seed: int, count: int = 60) -> np.ndarray:
    return np.sort(np.random.default_rng(seed).uniform(0.1, UNEVEN.end_time[-1], count))


def points_of(seed: int) -> tuple[Points, np.ndarray, np.ndarray]:
    """Points of the uneven history at random times of traction and temperature."""
    first, second = random_times(seed), random_times(seed + 100, 40)
    samples = traction_samples(UNEVEN, first, np.full(len(first), 0.5))
    return operating_points(sampled(UNEVEN, samples, second)), first, second


@pytest.mark.parametrize("seed", range(4))
def test_points_cover_every_iteration_once(seed: int) -> None:
    points, *_ = points_of(seed)
    assert np.all(points.duration > 0.0)
    assert np.cumsum(points.duration) == pytest.approx(points.time, rel=1e-12)
    per_iteration = np.bincount(points.iteration, points.duration)
    assert per_iteration == pytest.approx(UNEVEN.duration, rel=1e-9)
    assert points.time[points.of_iteration] == pytest.approx(UNEVEN.end_time, rel=1e-12)
    assert points.cycles[points.of_iteration] == pytest.approx(np.cumsum(UNEVEN.revolutions), rel=1e-9)
    assert np.all(points.creepage == UNEVEN.creepage[points.iteration])


@pytest.mark.parametrize("seed", range(4))
def test_every_sample_lies_at_its_point(seed: int) -> None:
    points, traction, temperature = points_of(seed)
    near = 2e-6 * UNEVEN.end_time[-1]
    assert np.abs(points.time[points.of_traction] - traction).max() <= near
    assert np.abs(points.time[points.of_temperature] - temperature).max() <= near
    assert np.all(points.iteration[points.of_traction] == running(UNEVEN, traction))


def test_a_sample_at_the_end_of_a_step_belongs_to_that_step() -> None:
    ends = UNEVEN.end_time
    samples = TractionSamples(ends, UNEVEN.step, UNEVEN.creepage, 0.5 * np.ones(6), np.full(6, np.nan))
    points = operating_points(sampled(UNEVEN, samples, ends))
    assert np.all(points.iteration[points.of_traction] == np.arange(6))
    assert np.all(points.of_traction == points.of_iteration)
    assert np.all(points.of_temperature == points.of_iteration)


def test_a_creepage_of_its_own_takes_no_time() -> None:
    plain, *_ = points_of(0)
    samples = traction_samples(UNEVEN, random_times(0), np.full(60, 0.5))
    own = samples.creepage.copy()
    own[7], own[30] = 0.0013, 0.0557
    points = operating_points(sampled(UNEVEN, replace(samples, creepage=own), random_times(100, 40)))
    assert points.creepage[points.of_traction] == pytest.approx(own, rel=1e-12)
    moments = points.of_traction[[7, 30]]
    assert np.all(points.duration[moments] == 0.0)
    assert points.time[moments] == pytest.approx(random_times(0)[[7, 30]], rel=1e-12)
    assert np.bincount(points.iteration, points.duration) == pytest.approx(UNEVEN.duration, rel=1e-9)
    energy = np.sum(points.creepage * points.duration)
    assert energy == pytest.approx(np.sum(plain.creepage * plain.duration), rel=1e-9)


def test_samples_without_times_are_spread_over_their_step() -> None:
    step = np.array([0, 0, 0, 1, 2, 2])
    untimed = TractionSamples(
        np.full(6, np.nan), step, UNEVEN.step_creepage[step], 0.5 * np.ones(6), np.full(6, np.nan)
    )
    times = sample_times(UNEVEN, untimed)
    ends = np.array([104.0, 404.0, 545.0])
    assert times == pytest.approx([104 / 3, 208 / 3, 104.0, 404.0, 404 + 141 / 2, 545.0])
    assert np.all(np.searchsorted(ends, times - 1e-6) == step)
    assert np.isnan(untimed.time).all(), "the record itself stays as it was"


def test_a_flood_of_samples_does_not_become_a_flood_of_points() -> None:
    many = np.linspace(0.1, UNEVEN.end_time[-1], 2 * MOST_CUTS)
    points = operating_points(sampled(UNEVEN, traction_samples(UNEVEN, many, np.full(len(many), 0.5))))
    assert len(points.time) < 100
    assert np.all(points.time[points.of_traction] >= many - 1e-3)
    assert np.all(points.iteration[points.of_traction] == running(UNEVEN, many))


def test_nothing_measured_still_has_points() -> None:
    points = operating_points(sampled(UNEVEN, None))
    assert points.of_traction.size == points.of_temperature.size == 0
    assert len(points.time) >= 4 * len(UNEVEN.step)
