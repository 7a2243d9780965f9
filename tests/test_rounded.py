"""Rounded readings against the arithmetic of rounding: what lasts of the error, and what no law may be made of."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs import Instruments, Plant, experiment, history, one_of, spread, traction_samples

from twindisc_cli.loop.averaging import MOST_SAMPLES, averaged
from twindisc_cli.loop.channels import traction
from twindisc_cli.loop.channels.temperature import noise
from twindisc_cli.loop.diagnose import diagnose
from twindisc_cli.loop.diagnosis import Diagnosis
from twindisc_cli.loop.noise import Noise
from twindisc_cli.measurement.rig_log import log_temperature
from twindisc_cli.model.experiment import Experiment, Floats, Measured, TemperatureSamples
from twindisc_cli.model.rounded import is_coarse, lasting, middles, scatter_before, step_of

COURSE = history((0.012, 0.03, 0.018, 0.05, 0.024, 0.04, 0.014, 0.02), 6)
PLANT = Plant(COURSE)


def cooled(seed: int) -> Plant:
    """A plant whose discs warm to other places of the scale."""
    return replace(PLANT, convection=1.6 * np.exp(0.2 * np.random.default_rng(seed).standard_normal()))


def recorded(step: float, before: float, seed: int, *, every: float = 10.0, heat: float = 0.0) -> Experiment:
    """A test whose thermometer rounds to a step [K], with a scatter before that [steps]; heat beside friction [W]."""
    rng = np.random.default_rng(seed)
    plant = replace(cooled(seed), heat=lambda time: heat + 0.0 * time)
    test = Instruments(channels=("traction", "temperature")).record(plant, rng)
    time = np.arange(0.5 * every, COURSE.end_time[-1], every)
    kelvin = plant.temperature(time) + before * step * rng.standard_normal(len(time))
    shown = TemperatureSamples(time, 273.15 + step * np.round((kelvin - 273.15) / step))
    return replace(test, measured=replace(test.measured, temperature=shown))


def found(tests: list[Experiment]) -> Diagnosis:
    return diagnose(tests, validate=None, progress=lambda stage, part: None)


def thermometer(test: Experiment) -> TemperatureSamples:
    assert test.measured.temperature is not None
    return test.measured.temperature


def readings(test: Experiment) -> Floats:
    return thermometer(test).temperature


@given(step=st.sampled_from([0.1, 0.2, 0.25, 0.5, 1.0, 2.0]), before=st.floats(0.0, 0.25), seed=st.integers(0, 999))
def test_the_step_of_readings_is_found_and_what_scatters_before_it(step: float, before: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    kelvin = 290.0 + 40.0 * step * (1.0 - np.exp(-np.arange(3000) / 600.0)) + rng.uniform(0.0, step)
    shown = step * np.round((kelvin + before * step * rng.standard_normal(3000)) / step)
    assert step_of(shown) == pytest.approx(step, rel=1e-9)
    assert step_of(kelvin) == 0.0
    assert is_coarse(shown)
    if before > 0.1:
        # where it stays, what is measured may stand near the middle of a reading or near its end
        assert scatter_before(shown) == pytest.approx(before * step, rel=0.5)


def test_noise_larger_than_the_step_is_not_coarse() -> None:
    rng = np.random.default_rng(0)
    for scatter in (0.5, 1.0, 3.0, 10.0):
        assert not is_coarse(np.round(300.0 + scatter * rng.standard_normal(2000)))


@pytest.mark.parametrize("seed", range(3))
def test_spikes_do_not_hide_that_readings_are_rounded(seed: int) -> None:
    """Steps of one reading leave no scatter to estimate, and spikes in them make what has to be assumed no better."""
    random = np.random.default_rng(seed)
    course = history((0.02, 0.05, 0.03, 0.08, 0.04, 0.06), 2)
    time = spread(course, 6)
    ratio = np.round(0.453 + 0.002 * random.standard_normal(len(time)), 2)
    ratio[random.choice(len(time), 3, replace=False)] += 0.2
    test = experiment(course, measured=Measured(traction=traction_samples(course, time, ratio)))
    result = traction.noise(test)
    assert result.rounded == pytest.approx(0.01)
    assert result.std == pytest.approx(np.hypot(0.01 / np.sqrt(12.0), 0.002), rel=0.3)
    assert np.sum(~result.kept) == 3


@pytest.mark.parametrize("before", [0.02, 0.1, 0.2, 0.3])
def test_what_lasts_is_the_variance_of_the_mean_error_over_all_places(before: float) -> None:
    """Integrated: the mean reading at each place between two readings is a sum over normal probabilities."""
    place, unit = np.linspace(-0.5, 0.5, 2001), np.linspace(-6.0, 6.0, 4001)
    weight = np.exp(-0.5 * unit**2) / np.exp(-0.5 * unit**2).sum()
    mean = np.round(place[:, None] + before * unit) @ weight
    assert lasting(1.0, before) == pytest.approx(np.mean((mean - place) ** 2), rel=0.02)


def test_nothing_before_the_rounding_leaves_all_of_it() -> None:
    assert lasting(1.0, 0.0) == pytest.approx(1.0 / 12.0, rel=0.02)
    assert lasting(2.0, 0.4) == pytest.approx(4.0 * lasting(1.0, 0.2), rel=1e-12)


def test_the_middle_of_each_block() -> None:
    np.testing.assert_array_equal(middles(np.array([0, 0, 0, 1, 2, 2, 2, 2])), [1, 3, 5])


def squared(found: Noise, error: Floats) -> float:
    """Length of an error in the noise, squared."""
    return float(np.sum(found.whiten(error) ** 2))


def test_an_error_that_lasts_counts_once_however_often_it_is_read() -> None:
    """Readings ten times as often say hardly more of where the temperature stands between two of them."""
    counts = []
    for every in (10.0, 1.0):
        test = recorded(1.0, 0.0, 3, every=every)
        time = thermometer(test).time
        last = COURSE.iteration_at(time) >= COURSE.driven.size - 6
        counts.append(squared(noise(test), 0.3 * last))
    assert counts[1] < 3.0 * counts[0], "ten times, if readings were independent"
    assert counts[0] < 8.0, "0.3 K of an error of 0.29 K, over the few readings of a step"


def test_the_error_of_rounding_is_as_long_as_its_noise() -> None:
    """Over many places of the scale: no longer than white noise, and along the steps as a law would need it."""
    chi2, along = [], []
    for seed in range(12):
        test = recorded(1.0, 0.03, seed)
        found, time = noise(test), thermometer(test).time
        error = readings(test) - cooled(seed).temperature(time)
        step = COURSE.step[COURSE.iteration_at(time)]
        columns = found.whiten((step == np.arange(8)[:, None]).astype(float)).T
        span = np.linalg.svd(columns, full_matrices=False)[0]
        white = found.whiten(error - error.mean())
        chi2.append(float(white @ white) / len(white))
        along.append(float(np.sum((span.T @ white) ** 2)))
    assert 0.1 < np.mean(chi2) < 1.2
    assert np.mean(along) < 12.0, "eight steps, whose mean errors are uniform from - half a degree to half a degree"


def test_a_long_record_of_whole_degrees_is_thinned_and_not_averaged() -> None:
    test = recorded(1.0, 0.03, 1, every=0.5)
    fewer, notes = averaged(test)
    shown = readings(fewer)
    assert 0.5 * MOST_SAMPLES < len(shown) <= 1.1 * MOST_SAMPLES
    np.testing.assert_allclose(shown - 273.15, np.round(shown - 273.15), atol=1e-9)
    assert any("rounded too far to be averaged" in note for note in notes)


def test_a_log_of_whole_degrees_keeps_its_readings() -> None:
    time = np.arange(0.5, COURSE.end_time[-1], 1.0)
    celsius = np.round(PLANT.temperature(time) - 273.15)
    text = "time [s],temperature [degC]\n" + "\n".join(f"{t},{c:.0f}" for t, c in zip(time, celsius, strict=True))
    samples, rows = log_temperature(text.encode(), "t.csv", history=COURSE, begin=0.0)
    assert len(samples.time) < len(time)
    np.testing.assert_allclose(samples.temperature - 273.15, np.round(samples.temperature - 273.15), atol=1e-9)
    assert any("rounded too far to be averaged" in note for note in rows.notes)


@pytest.mark.parametrize("seed", one_of([10, 11]))
def test_no_law_is_made_of_whole_degrees(seed: int) -> None:
    """Had been a lag of the thermocouple, laws of the convection, or no answer in five minutes."""
    assert found([recorded(1.0, 0.05, seed)]).verdict == "no_missing_effect"


def test_heat_is_found_by_a_thermometer_of_whole_degrees() -> None:
    heated = recorded(1.0, 0.05, 20, heat=12.0)
    assert "parasitic_heat" in [effect.name for effect in found([heated]).effects]
