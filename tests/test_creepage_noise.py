"""Errors of the tachometers are told from slip that the contact really has by whether the traction follows."""

from __future__ import annotations

import numpy as np
import pytest

from twindisc_cli.measurement.creepage_noise import steadied

LEVELS = np.array([0.0005, 0.001, 0.002, 0.004])
STEP = np.repeat(np.arange(4), 40)
TIME = np.arange(160.0)
ERROR = 2e-4


def curve(v: np.ndarray) -> np.ndarray:
    """A creep curve that saturates."""
    return 0.4 * np.tanh(v / 0.002)


def scattered(seed: int, *, real: bool, noise: float = 0.002) -> tuple[np.ndarray, np.ndarray]:
    """Recorded creepage and T/N, in which the scatter of the creepage is the contact's or the tachometers'."""
    rng = np.random.default_rng(seed)
    recorded = LEVELS[STEP] + ERROR * rng.standard_normal(160)
    return recorded, curve(recorded if real else LEVELS[STEP]) + noise * rng.standard_normal(160)


@pytest.mark.parametrize("seed", range(6))
def test_what_the_tachometers_err_by_is_taken_off(seed: int) -> None:
    found = steadied(*scattered(seed, real=False), TIME, STEP)
    assert found.std == pytest.approx(ERROR, rel=0.2)
    assert found.is_noise
    assert np.abs(found.creepage - LEVELS[STEP]).max() < 3.5 * ERROR / np.sqrt(40)


@pytest.mark.parametrize("seed", range(6))
def test_slip_that_the_traction_follows_stays(seed: int) -> None:
    recorded, ratio = scattered(seed, real=True)
    found = steadied(recorded, ratio, TIME, STEP)
    assert (found.std, found.note) == (0.0, None)
    assert np.array_equal(found.creepage, recorded)


@pytest.mark.parametrize("noise", [0.2, 20.0])
def test_scatter_without_memory_that_the_traction_does_not_show_is_left_out(noise: float) -> None:
    """It would flatten the model's curve; but nobody says that it is the tachometers'."""
    found = steadied(*scattered(1, real=False, noise=noise), TIME, STEP)
    assert not found.is_noise
    assert found.note is not None
    assert "too little for the traction to separate" in found.note
    assert np.abs(found.creepage - LEVELS[STEP]).max() < 3.5 * ERROR / np.sqrt(40)


def test_a_creepage_with_a_memory_stays_where_the_traction_does_not_show_it() -> None:
    """As of a wheel that hunts; and a sweep in full sliding."""
    recorded, ratio = scattered(2, real=False, noise=0.2)
    hunting = recorded + 3e-4 * np.sin(TIME / 4.0)
    sweep = np.geomspace(0.01, 0.05, 160)
    for creepage, step in ((hunting, STEP), (sweep, np.zeros(160, dtype=int))):
        assert np.array_equal(steadied(creepage, ratio, TIME, step).creepage, creepage)


def test_few_samples_stay_as_they_are() -> None:
    recorded, ratio = scattered(2, real=False)
    assert np.array_equal(steadied(recorded[::40], ratio[::40], TIME[::40], STEP[::40]).creepage, recorded[::40])


def test_a_creepage_that_drifts_within_its_step_still_does() -> None:
    recorded, ratio = scattered(3, real=False)
    drift = 2e-3 * (TIME % 40.0 - 19.5) / 40.0
    found = steadied(recorded + drift, ratio, TIME, STEP)
    assert found.std == pytest.approx(ERROR, rel=0.2)
    assert np.abs(found.creepage - LEVELS[STEP] - drift).max() < 8.0 * ERROR / np.sqrt(40)
