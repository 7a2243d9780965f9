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
    creepage, std = steadied(*scattered(seed, real=False), TIME, STEP)
    assert std == pytest.approx(ERROR, rel=0.2)
    assert np.abs(creepage - LEVELS[STEP]).max() < 3.5 * ERROR / np.sqrt(40)


@pytest.mark.parametrize("seed", range(6))
def test_slip_that_the_traction_follows_stays(seed: int) -> None:
    recorded, ratio = scattered(seed, real=True)
    creepage, std = steadied(recorded, ratio, TIME, STEP)
    assert std == 0.0
    assert np.array_equal(creepage, recorded)


def test_nothing_is_said_where_the_noise_of_the_traction_hides_it() -> None:
    recorded, ratio = scattered(1, real=False, noise=0.2)
    assert steadied(recorded, ratio, TIME, STEP)[1] == 0.0


def test_nothing_is_said_of_full_sliding_and_of_few_samples() -> None:
    recorded, ratio = scattered(2, real=False)
    assert steadied(recorded, np.full(160, 0.4), TIME, np.zeros(160, dtype=int))[1] == 0.0
    assert steadied(recorded[::40], ratio[::40], TIME[::40], STEP[::40])[1] == 0.0


def test_a_creepage_that_drifts_within_its_step_still_does() -> None:
    recorded, ratio = scattered(3, real=False)
    drift = 2e-3 * (TIME % 40.0 - 19.5) / 40.0
    creepage, std = steadied(recorded + drift, ratio, TIME, STEP)
    assert std == pytest.approx(ERROR, rel=0.2)
    assert np.abs(creepage - LEVELS[STEP] - drift).max() < 8.0 * ERROR / np.sqrt(40)
