"""Operating points: the history is covered once, and every sample finds its instant."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from rigs import experiment, history, running, traction_samples

from twindisc_cli.model.experiment import Experiment, History, Measured, TemperatureSamples, TractionSamples
from twindisc_cli.model.points import (
    FEWEST_PARTS,
    MOST_PARTS,
    Points,
    operating_points,
    sample_times,
    stand_for_steps,
)

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


def test_a_time_that_is_rounded_over_the_end_of_its_step_stays_in_it() -> None:
    """Its load, speed and creepage are those of the step that its row names; half an iteration off is another time."""
    end = float(UNEVEN.end_time[1])
    time = np.array([end - 0.004, end + 0.004, end - 0.004, end + 0.004, end + 50.0])
    step = np.array([0, 0, 1, 1, 0])
    samples = TractionSamples(time, step, UNEVEN.step_creepage[step], np.full(5, 0.5), np.full(5, np.nan))
    at = sample_times(UNEVEN, samples)
    assert UNEVEN.step[UNEVEN.iteration_at(at)].tolist() == [0, 0, 1, 1, 1]
    assert at == pytest.approx([end - 0.004, end, end, end + 0.004, end + 50.0], abs=1e-5)


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


UNSORTED = (0.02, 0.05, 0.01, 0.03)


def untimed(course: History, step: Sequence[int]) -> TractionSamples:
    """Samples of some steps without a time."""
    unknown, at = np.full(len(step), np.nan), np.array(step)
    return TractionSamples(unknown, at, course.step_creepage[at], np.full(len(step), 0.5), unknown)


def test_the_mean_of_a_step_is_at_the_middle_of_it() -> None:
    """A friction that changes evenly over a step has its mean there."""
    course = history(UNSORTED, (1, 3, 2, 1))
    ends = np.cumsum([84.0, 252.0, 168.0, 84.0])
    times = sample_times(course, untimed(course, range(4)))
    np.testing.assert_allclose(times, ends - 0.5 * np.array([84.0, 252.0, 168.0, 84.0]))


@pytest.mark.parametrize(
    ("creepage", "step", "known"),
    [
        (UNSORTED, (0, 1, 2, 3), True),
        (UNSORTED, (0, 1, 2), True),  # one was not recorded
        ((0.02, 0.02, 0.02), (0, 1, 2), True),  # there is no order of creepage
        ((0.01, 0.02, 0.03, 0.05), (0, 1, 2, 3), False),  # a curve: the order may be that of its creepages
        ((0.05, 0.03, 0.01, 0.01), (0, 1, 2, 3), False),
        ((-0.05, -0.01, 0.03), (0, 1, 2), False),
        (UNSORTED, (0, 0, 1, 2, 3), False),  # several of a step
        ((0.02, 0.05, 0.01, 0.02), (0, 1, 2), False),  # which of the two steps of 2 % is not known
    ],
)
def test_which_samples_stand_for_steps(creepage: Sequence[float], step: Sequence[int], known: bool) -> None:
    course = history(creepage, 1)
    samples = untimed(course, step)
    assert stand_for_steps(course, samples) == known
    assert not stand_for_steps(replace(course, separate=True), samples)
    assert not stand_for_steps(replace(course, per_iteration=np.nan), samples), "steps that were found have no length"
    assert not stand_for_steps(course, replace(samples, time=1.0 + np.arange(len(step))))


@pytest.mark.parametrize("count", [300, 4000, 4001, 20_000])
def test_any_number_of_samples_is_read_as_exactly(count: int) -> None:
    """What relaxes with a time constant of a tenth of the test is read to 1e-4 of it, however many samples."""
    many = np.linspace(0.1, UNEVEN.end_time[-1], count)
    points = operating_points(sampled(UNEVEN, traction_samples(UNEVEN, many, np.full(count, 0.5)), many))
    relaxing = np.exp(-points.time / (0.1 * UNEVEN.end_time[-1]))
    expected = np.exp(-many / (0.1 * UNEVEN.end_time[-1]))
    for read in (points.traction, points.temperature):
        assert read(relaxing[None])[0] == pytest.approx(expected, abs=1e-4)
    assert len(points.time) <= len(UNEVEN.step) * FEWEST_PARTS + min(count, MOST_PARTS)
    assert np.all(points.iteration[points.of_traction] == running(UNEVEN, many))


@pytest.mark.parametrize("count", [0, 300, 20_000])
def test_what_is_asked_strip_by_strip_is_on_lines_within_each_iteration(count: int) -> None:
    """A change of 0.05 an iteration, along a parabola, is read to 0.002; a jump between iterations is kept."""
    many = np.linspace(0.1, UNEVEN.end_time[-1], count)
    points = operating_points(
        sampled(UNEVEN, traction_samples(UNEVEN, many, np.full(count, 0.5)) if count else None, many)
    )
    begin = UNEVEN.end_time - UNEVEN.duration
    share = (points.time - begin[points.iteration]) / UNEVEN.duration[points.iteration]
    changes = points.iteration + 0.05 * share**2
    assert np.isin(points.of_iteration, points.of_strips).all()
    assert points.strips(changes[None, points.of_strips])[0] == pytest.approx(changes, abs=2e-3)
    assert len(points.of_strips) < 400


@pytest.mark.parametrize("count", [3000, 9000])
def test_every_sample_is_read_at_its_own_creepage(count: int) -> None:
    """Samples at the history's creepage lie between others that have their own."""
    many = np.linspace(0.1, UNEVEN.end_time[-1], count)
    samples = traction_samples(UNEVEN, many, np.full(count, 0.5))
    own = samples.creepage * np.where(np.arange(count) % 3 == 0, 1.01, 1.0)
    points = operating_points(sampled(UNEVEN, replace(samples, creepage=own)))
    assert points.traction(points.creepage[None])[0] == pytest.approx(own, rel=1e-12)


def test_as_many_steps_as_samples() -> None:
    count = 20_000
    course = history(np.where(np.arange(count) % 2, 0.01, 0.02), 1, duration=0.1)
    times = course.end_time - 0.03
    points = operating_points(sampled(course, traction_samples(course, times, np.full(count, 0.5)), times))
    assert len(points.time) <= 2 * count
    assert points.traction(points.creepage[None])[0] == pytest.approx(course.creepage, rel=1e-12)
    assert points.temperature(points.time[None])[0] == pytest.approx(times, rel=1e-9)


def test_what_the_history_alone_says_of_the_past() -> None:
    """Steps of 1, -3 and 2 %, the second in two iterations: 10 s an iteration."""
    course = history([0.01, -0.03, 0.02], [1, 2, 1], duration=10.0)
    points = operating_points(sampled(course, None, np.array([2.0, 13.0, 25.0, 36.0])))
    at = points.of_temperature
    assert points.time_in_step[at] == pytest.approx([2.0, 3.0, 15.0, 6.0])
    assert points.greatest_creepage[at] == pytest.approx([0.01, 0.03, 0.03, 0.03])
    assert points.time_in_step[points.of_iteration] == pytest.approx([10.0, 10.0, 20.0, 10.0])
    assert points.order[at].tolist() == [1.0, 2.0, 2.0, 3.0]
    assert points.direction[at].tolist() == [1.0, 1.0, 1.0, -1.0]


def test_a_pause_does_not_turn_the_creepage() -> None:
    """Down, then still, then up again: what it did before the pause counts until it changes."""
    course = history([0.03, 0.01, 0.0, 0.01, 0.02], 1)
    still = replace(course, revolutions=course.revolutions * (np.arange(5) != 2))
    points = operating_points(sampled(still, None))
    assert points.direction[points.of_iteration].tolist() == [1.0, -1.0, -1.0, -1.0, 1.0]


def test_time_since_the_last_pause_begins_anew_after_it() -> None:
    course = history([0.01, 0.02, 0.0, 0.02, 0.03], 1, duration=10.0)
    still = replace(course, revolutions=course.revolutions * (np.arange(5) != 2))
    points = operating_points(sampled(still, None))
    assert points.time_since_pause[points.of_iteration] == pytest.approx([10.0, 20.0, 0.0, 10.0, 20.0])
    assert points.time_since_pause[points.of_cut] == pytest.approx(
        np.where(points.time <= 20.0, points.time, np.maximum(points.time - 30.0, 0.0))[points.of_cut]
    )


def test_nothing_measured_still_has_points() -> None:
    points = operating_points(sampled(UNEVEN, None))
    assert points.of_traction.size == points.of_temperature.size == 0
    assert len(points.time) >= 4 * len(UNEVEN.step)
