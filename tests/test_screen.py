"""The screening: honest p-values where nothing is missing, the right covariate where something is."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
from rigs import ROOM, SPEED, Floats, Instruments, Plant, autoregressive, experiment, history, spread, traction_samples

from twindisc_cli.loop import screen
from twindisc_cli.loop.channels import channels
from twindisc_cli.loop.fit import Fit, fit, refit
from twindisc_cli.loop.generic import levels, smooth, waves
from twindisc_cli.loop.problem import Problem, case_of
from twindisc_cli.loop.screen import Residual, groups, unexplained_residual
from twindisc_cli.model.experiment import Experiment, Measured
from twindisc_cli.report.words import KIND

COURSE = history((0.02, 0.04, 0.09, 0.03, 0.06, 0.015), 2)
TIME = spread(COURSE, 6)
SIGMA = 0.004
AT = COURSE.creepage[np.searchsorted(COURSE.end_time, TIME)]
DRAWS = 200


def base_fit(test: Experiment, *names: str) -> Fit:
    return fit(Problem([case_of(test)], names))


def of_traction(ratio: Floats, uncertainty: float = SIGMA) -> Experiment:
    samples = traction_samples(COURSE, TIME, ratio, uncertainty)
    return experiment(COURSE, thermal=None, measured=Measured(traction=samples))


def unit(seed: int) -> Floats:
    return np.random.default_rng(seed).standard_normal(len(TIME))


# ------------------------------------------------------------------------------------------------ nothing missing


@cache
def of_noise(seed: int) -> Residual:
    """What is left of white noise about one constant mu, the noise known."""
    found = base_fit(of_traction(0.6 + SIGMA * unit(seed)), "traction")
    return unexplained_residual(found, "traction")


@pytest.mark.parametrize("level", [0.01, 0.05, 0.2, 0.5, 0.8])
def test_family_wise_p_values_are_uniform_under_the_null(level: float) -> None:
    """The share below a level is binomial about it, for all the groups searched."""
    null_p_values = np.array([of_noise(seed).p_value for seed in range(DRAWS)])
    error = np.sqrt(level * (1.0 - level) / DRAWS)
    assert abs(np.mean(null_p_values <= level) - level) < 3.0 * error + 1.0 / DRAWS


def test_p_values_do_not_depend_on_the_directions_of_a_decomposition(monkeypatch: pytest.MonkeyPatch) -> None:
    """Another processor may find the columns of a projection in another order, with another sign, or turned."""
    expected = [of_noise(seed).p_value for seed in range(20)]
    decomposed, generator = screen._basis, np.random.default_rng(11)

    def turned(*given: Any) -> screen._Basis:
        basis = decomposed(*given)
        rotation = np.linalg.qr(generator.standard_normal((basis.span.shape[1],) * 2))[0]
        return screen._Basis(basis.span @ rotation, rotation.T @ basis.coordinates)

    monkeypatch.setattr(screen, "_basis", turned)
    assert [of_noise.__wrapped__(seed).p_value for seed in range(20)] == expected


def test_unpaid_p_values_would_not_be() -> None:
    """The smallest p of all groups is below 5 % in most draws: that the search is paid for is what keeps it honest."""
    least = [min(score.p_value for score in of_noise(seed).scores) for seed in range(60)]
    assert np.mean(np.array(least) < 0.05) > 0.4


@pytest.mark.long
def test_correlated_noise_that_is_estimated_alarms_rarely() -> None:
    """The noise is estimated in every draw, nuisances and all; at the 5 % level no more than twice that."""
    alarms = []
    for seed in range(60):
        noise = SIGMA * autoregressive(np.random.default_rng(seed), len(TIME), 0.5)
        test = of_traction(0.6 + noise, np.nan)
        alarms.append(unexplained_residual(refit(Problem([case_of(test)], ("traction",))), "traction").p_value < 0.05)
    assert np.mean(alarms) <= 0.10 + 2.0 * np.sqrt(0.1 * 0.9 / 60)


def test_a_score_is_chi_squared_of_its_own_count() -> None:
    """q of every group has mean k and variance 2 k over draws of the noise."""
    draws = [of_noise(seed) for seed in range(80)]
    squared: dict[tuple[str, str, int], list[float]] = {}
    for found in draws:
        for score in found.scores:
            if score.group.kind not in ("wave", "iterations, a span"):
                squared.setdefault((score.group.covariate, score.group.kind, score.count), []).append(score.squared)
    assert {key[:2] for key in squared} >= {("creepage", "smooth"), ("creepage", "levels"), ("time", "smooth")}
    steps = len(np.unique(COURSE.creepage))
    assert ("creepage", "levels", steps - 1) in squared, "one level is what mu can imitate"
    for (_, _, count), values in squared.items():
        if len(values) == len(draws):
            assert np.mean(values) == pytest.approx(count, abs=4.5 * np.sqrt(2.0 * count / len(draws)))


def test_a_span_of_iterations_is_paid_for() -> None:
    """The p-value of the best sum of neighbouring iterations is no smaller than it says."""
    found = [of_noise(seed) for seed in range(100)]
    least = [s.p_value for rest in found for s in rest.scores if s.group.kind == "iterations, a span"]
    assert len(least) == len(found)
    assert np.mean(np.array(least) < 0.1) < 0.1 + 2.0 * np.sqrt(0.1 * 0.9 / len(least))


def test_a_burst_is_one_span() -> None:
    burst = 0.02 * ((TIME > 250.0) & (TIME < 420.0))
    found = unexplained_residual(base_fit(of_traction(0.6 + burst + SIGMA * unit(1)), "traction"), "traction")
    assert found.scores[0].group.kind == "iterations, a span"


# ------------------------------------------------------------------------------------------------ something missing

MISSING: dict[str, tuple[Floats, str]] = {
    "friction falls": (0.05 * np.exp(-4.0 * AT * SPEED), "creepage"),
    "friction rises about one creepage": (0.02 * (AT == 0.03), "creepage"),
    "a burst": (0.02 * ((TIME > 250.0) & (TIME < 400.0)), "time"),
    "a slow swing": (0.01 * np.sin(TIME / 90.0), "time"),
    "running in": (-0.03 * np.exp(-TIME / 200.0), "time"),
}


@pytest.mark.parametrize("name", MISSING)
def test_the_covariate_is_among_the_first_two(name: str) -> None:
    change, covariate = MISSING[name]
    for seed in range(3):
        found = unexplained_residual(base_fit(of_traction(0.6 + change + SIGMA * unit(seed)), "traction"), "traction")
        assert found.significant(0.002)
        assert covariate in [score.group.covariate for score in found.covariates[:2]]


def test_the_length_left_is_the_length_put_in() -> None:
    """Excess of q over its count: |change|^2 in noise units, what mu can imitate taken out."""
    change, _ = MISSING["friction rises about one creepage"]
    put_in = np.linalg.norm((change - change.mean()) / SIGMA)
    lengths = [
        unexplained_residual(base_fit(of_traction(0.6 + change + SIGMA * unit(seed)), "traction"), "traction").length
        for seed in range(10)
    ]
    assert np.mean(lengths) == pytest.approx(put_in, rel=0.1)


def test_what_the_fitted_parameters_imitate_is_not_left() -> None:
    """A level of mu explains itself: without noise nothing is left of a test that the base model fits."""
    found = unexplained_residual(base_fit(of_traction(np.full(len(TIME), 0.43)), "traction"), "traction")
    assert found.length == 0.0
    assert found.p_value == 1.0
    assert found.covariates == []


PROFILES: dict[str, Callable[[Floats], Floats]] = {
    "tilted": lambda y: 2e-3 * y,
    "scratched": lambda y: -3e-6 * np.exp(-0.5 * ((y - 0.3e-3) / 4e-5) ** 2),
}


@pytest.mark.parametrize("name", PROFILES)
def test_profiles_depend_on_y(name: str) -> None:
    change = PROFILES[name]
    test = Instruments(profile=2e-7, channels=("profile", "traction")).record(Plant(COURSE), np.random.default_rng(1))
    profile = test.measured.profile
    assert profile is not None
    before = unexplained_residual(base_fit(test, "traction", "profile"), "profile")
    spoiled = Measured(
        traction=test.measured.traction,
        profile=type(profile)(profile.y, profile.height + change(profile.y), profile.disc, profile.iteration),
    )
    after = unexplained_residual(
        base_fit(experiment(COURSE, measured=spoiled, options=test.options), "traction", "profile"), "profile"
    )
    assert after.p_value < 0.002 < before.p_value
    assert after.covariates[0].group.covariate == "y"


# ------------------------------------------------------------------------------------------------ the functions


def test_smooth_functions_are_legendre_and_no_more_than_there_are_levels() -> None:
    x = np.linspace(-1.0, 1.0, 2001)
    columns = smooth(3.0 + 2.0 * x, 4)
    for order in range(4):
        expected = np.polynomial.legendre.Legendre.basis(order + 1)(x)
        assert columns[:, order] == pytest.approx(expected, abs=1e-9)
    assert smooth(np.array([1.0, 2.0, 2.0, 3.0]), 5).shape == (4, 2)
    assert smooth(np.full(6, 2.0), 5).shape[1] == 1, "a covariate that stands still gives one column, of no use"


def test_levels_and_waves() -> None:
    assert levels(np.array([3, 1, 3, 7])).tolist() == [[0, 1, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    time = np.linspace(5.0, 25.0, 4001)
    for order, wave in enumerate(waves(time, 3), start=1):
        phase = 2.0 * np.pi * order * (time - 5.0) / 20.0
        assert wave == pytest.approx(np.stack([np.cos(phase), np.sin(phase)], axis=1), abs=1e-9)


def test_a_swing_from_one_iteration_to_the_next_but_one_is_seen() -> None:
    """28 periods in 63 iterations, among as many samples as make each of them smooth."""
    course = history(tuple(np.geomspace(0.02, 0.09, 21)), 3)
    time = spread(course, 8)
    swing = 0.006 * np.sin(2.0 * np.pi * 28.0 * time / course.end_time[-1])
    noisy = 0.6 + swing + SIGMA * np.random.default_rng(5).standard_normal(len(time))
    test = experiment(course, thermal=None, measured=Measured(traction=traction_samples(course, time, noisy, SIGMA)))
    found = unexplained_residual(base_fit(test, "traction"), "traction")
    assert found.p_value < 1e-6
    assert (found.scores[0].group.covariate, found.scores[0].group.kind) == ("time", "wave")


def test_no_group_holds_a_column_that_stands_still() -> None:
    test = Instruments().record(Plant(COURSE), np.random.default_rng(0))
    case = case_of(test)
    base = {"mu": np.array([0.6]), "K": np.array([1e-3]), "convection_W_K": np.array([1.6])}
    prediction = case.model.predict(base)
    known = {"creepage", "time", "cycles", "energy", "temperature", "y"}
    for channel, noise in case.noise.items():
        found = list(groups(case, channel, prediction))
        assert found
        for group in found:
            assert group.covariate in known
            assert group.columns.shape[0] == len(noise.kept)
            assert np.isfinite(group.columns).all()
            assert np.ptp(group.columns, axis=0).min() > 0.0


def test_samples_without_times_are_asked_for_creepage_only() -> None:
    samples = traction_samples(COURSE, TIME, 0.6 + SIGMA * unit(0))
    untimed = Measured(
        traction=type(samples)(
            np.full_like(TIME, np.nan), samples.step, samples.creepage, samples.ratio, samples.uncertainty
        )
    )
    found = unexplained_residual(base_fit(experiment(COURSE, thermal=None, measured=untimed), "traction"), "traction")
    assert {score.group.covariate for score in found.scores} == {"creepage"}


def test_a_drifting_room_is_seen_over_time() -> None:
    plant = Plant(COURSE)
    swing = 1.5 * np.sin(TIME / 70.0)
    noisy = plant.temperature(TIME) + swing + 0.1 * unit(3)
    test = Instruments(temperature=0.1).record(plant, np.random.default_rng(3))
    assert test.measured.temperature is not None
    spoiled = Measured(traction=test.measured.traction, temperature=type(test.measured.temperature)(TIME, noisy))
    found = unexplained_residual(
        base_fit(experiment(COURSE, measured=spoiled), "traction", "temperature"), "temperature"
    )
    assert found.significant(0.002)
    assert "time" in [score.group.covariate for score in found.covariates[:2]]
    assert noisy.min() > ROOM - 3.0


def test_what_the_temperature_leaves_is_not_left_of_the_traction() -> None:
    """A level of T/N is absorbed by mu: what is left of it is a temperature, and nothing that the traction leaves."""
    test = Instruments(temperature=0.1).record(Plant(COURSE, lag=60.0), np.random.default_rng(3))
    fitted = base_fit(test, "traction", "temperature")
    assert fitted.power("temperature") > 50.0 * fitted.problem.count("temperature")
    assert fitted.power("traction") < 2.0 * fitted.problem.count("traction")
    assert unexplained_residual(fitted, "temperature", own=True).significant(0.002)
    assert unexplained_residual(fitted, "traction", own=True).p_value > 0.05


@pytest.mark.parametrize("channel", channels())
def test_every_kind_of_leftover_has_words(channel: str) -> None:
    test = Instruments().record(Plant(COURSE), np.random.default_rng(0))
    found = unexplained_residual(base_fit(test, "traction", "profile", "temperature"), channel)
    assert {score.group.kind for score in found.scores} <= set(KIND)
