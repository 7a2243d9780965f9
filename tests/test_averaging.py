"""Long records as means: blocks inside iterations, their size, and the same answer as from all samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rigs import Experiment, Instruments, Plant, history

from twindisc_cli.loop import averaging
from twindisc_cli.loop.averaging import averaged
from twindisc_cli.loop.channels import channels
from twindisc_cli.loop.diagnose import diagnose
from twindisc_cli.loop.diagnosis import Diagnosis

COURSE = history((0.02, 0.04, 0.09, 0.03, 0.06, 0.015), (3, 1, 2, 3, 2, 1))
PLANT = Plant(COURSE, mu=lambda t, c, n: 0.6 * (0.6 + 0.4 * np.exp(-3.0 * c * 9.42)))


def recorded(each: int, *channels: str, correlation: float = 0.0) -> Experiment:
    rods = Instruments(each=each, channels=channels, correlation=correlation)
    return rods.record(PLANT, np.random.default_rng(4))


def test_a_short_record_stays_as_it_is() -> None:
    test = recorded(6, "traction", "profile", "temperature")
    assert averaged(test) == (test, [])


def test_means_are_of_neighbours_within_one_iteration(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(averaging, "MOST_SAMPLES", 60)
    test = recorded(40, "traction", "temperature")
    shuffled = np.random.default_rng(2).permutation(40 * 12)
    samples = test.measured.traction
    assert samples is not None
    mixed = replace(samples, **{key: value[shuffled] for key, value in vars(samples).items()})
    for measured in (samples, mixed):
        short, notes = averaged(replace(test, measured=replace(test.measured, traction=measured)))
        means = short.measured.traction
        assert means is not None
        for key in ("time", "ratio", "creepage"):
            np.testing.assert_allclose(getattr(means, key), getattr(samples, key).reshape(60, 8).mean(axis=1))
        np.testing.assert_array_equal(means.step, samples.step[::8])
        assert [("480 samples" in n and "60 means" in n) for n in notes] == [True, True]


def test_blocks_that_do_not_fit_end_with_their_iteration(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(averaging, "MOST_SAMPLES", 60)
    test = recorded(37, "traction")
    samples, means = test.measured.traction, averaged(test)[0].measured.traction
    assert samples is not None
    assert means is not None
    assert np.bincount(COURSE.iteration_at(means.time)).tolist() == [5] * 12, "37 samples as 5 blocks of 7 or 8"
    np.testing.assert_allclose(means.creepage, COURSE.creepage[COURSE.iteration_at(means.time)], rtol=1e-12)


def test_a_stated_uncertainty_falls_with_the_root_of_the_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(averaging, "MOST_SAMPLES", 12)
    test = recorded(25, "traction")
    samples = test.measured.traction
    assert samples is not None
    stated = replace(samples, uncertainty=np.full(len(samples.time), 0.01))
    means = averaged(replace(test, measured=replace(test.measured, traction=stated)))[0].measured.traction
    assert means is not None
    np.testing.assert_allclose(means.uncertainty, 0.01 / 5.0, rtol=1e-12)


def test_the_noise_of_means_is_that_of_means(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(averaging, "MOST_SAMPLES", 200)
    short = averaged(recorded(200, "traction"))[0]
    noise = channels()["traction"].noise(short)
    samples = 12 * 200 / len(noise.kept)
    assert noise.std == pytest.approx(0.004 / np.sqrt(samples), rel=0.2)


def test_profiles_are_averaged_by_themselves(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(averaging, "MOST_SAMPLES", 50)
    test = recorded(6, "profile")
    profile = test.measured.profile
    assert profile is not None
    two = replace(
        profile,
        **{key: np.concatenate([value, value]) for key, value in vars(profile).items()}
        | {"iteration": np.repeat([3, 12], len(profile.y)), "height": np.repeat([-1.0, -5.0], len(profile.y))},
    )
    means = averaged(replace(test, measured=replace(test.measured, profile=two)))[0].measured.profile
    assert means is not None
    np.testing.assert_array_equal(np.where(means.iteration == 3, -1.0, -5.0), means.height)
    assert 40 < len(means.y) < 60


def test_samples_without_a_time_stay(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(averaging, "MOST_SAMPLES", 12)
    test = recorded(25, "traction")
    samples = test.measured.traction
    assert samples is not None
    timeless = replace(test, measured=replace(test.measured, traction=replace(samples, time=samples.time * np.nan)))
    assert averaged(timeless)[1] == []


def test_means_say_what_all_samples_say(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same terms; each parameter of one within the 90 % interval of the other."""
    monkeypatch.setattr(averaging, "MOST_SAMPLES", 72)
    test = recorded(30, "traction", correlation=0.3)

    def found(of: Experiment) -> Diagnosis:
        return diagnose([of], validate=None, progress=lambda what, part: None, quick=True)

    whole, means = found(test), found(averaged(test)[0])
    assert [e.name for e in whole.effects] == [e.name for e in means.effects] == ["falling_friction"]
    for one, other in ((whole, means), (means, whole)):
        for key, estimate in one.effects[0].parameters.items():
            assert estimate.low <= other.effects[0].parameters[key].value <= estimate.high
