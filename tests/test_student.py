"""The student and the Gaussian process that stand beside the loop find what was put in."""

from __future__ import annotations

import numpy as np
import pytest
from records.student import gaussian_process, saturation, student

V = np.geomspace(0.002, 0.2, 80)
UNTIMED = np.full(80, np.nan)
HOURS = np.linspace(0.0, 3600.0, 80)
NOISE = 0.002 * np.random.default_rng(3).normal(size=80)


def polach() -> np.ndarray:
    """Polach's law with the constants of his Table 1 for dry rail, 30 m/s taken out of B."""
    return 0.4 * (0.4 + 0.6 * np.exp(-20.0 * V)) * saturation(150.0 * V, 60.0 * V)


CURVES = {
    "constant": 0.3 * saturation(80.0 * V, 80.0 * V),
    "Polach": polach(),
    "Eyring": 0.02 * np.arcsinh(2000.0 * V),
}


@pytest.mark.long
@pytest.mark.parametrize("name", CURVES)
def test_the_student_finds_the_law_of_a_creep_curve(name: str) -> None:
    best, average = student(V, UNTIMED, CURVES[name] + NOISE)
    finer = np.geomspace(0.002, 0.2, 300)
    truth = np.interp(finer, V, CURVES[name])
    unknown = np.full(300, np.nan)
    assert np.sqrt(np.mean((best.predict(finer, unknown) - truth) ** 2)) < 0.001
    assert np.sqrt(np.mean((average(finer, unknown) - truth) ** 2)) < 0.001
    assert best.name == name


def test_the_student_finds_an_exponential_over_time_and_carries_it_on() -> None:
    truth = 0.1 * (1.0 - 0.4 * np.exp(-HOURS / 900.0))
    best, _ = student(np.full(50, 1.0), HOURS[:50], (truth + 0.1 * NOISE)[:50])
    assert best.name == "running-in"
    assert best.predict(np.ones(80), HOURS)[-1] == pytest.approx(truth[-1], abs=0.003)


def test_a_gaussian_process_draws_the_curve_between_its_samples() -> None:
    curve = polach()
    told = gaussian_process(V[::2], UNTIMED[::2], (curve + NOISE)[::2])(V[1::2], UNTIMED[1::2])
    assert np.sqrt(np.mean((told - curve[1::2]) ** 2)) < 0.002


def test_a_gaussian_process_far_from_its_samples_says_their_mean() -> None:
    values = 0.3 + 0.05 * np.sin(8.0 * np.log(V))
    told = gaussian_process(V, UNTIMED, values)(np.array([200.0]), np.array([np.nan]))
    assert told[0] == pytest.approx(values.mean(), abs=0.01)
