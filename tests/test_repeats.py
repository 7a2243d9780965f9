"""Separate tests at one setting: how far their friction scatters, and that the scatter does not count as evidence."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs import SPEED, Floats, experiment, history, one_of, spread, traction_samples

from twindisc_cli.identify.repeats import repeats_of
from twindisc_cli.loop.diagnose import diagnose
from twindisc_cli.loop.diagnosis import Diagnosis
from twindisc_cli.model.experiment import Experiment, Measured, TractionSamples

LOOMS = np.array(
    [[98.0, 97.0, 99.0, 96.0], [91.0, 90.0, 93.0, 92.0], [96.0, 95.0, 97.0, 95.0], [95.0, 96.0, 99.0, 98.0]]
)
"""Strength of fabric from four looms, four samples each: variance between the looms 6.96, within them 1.90.

D. C. Montgomery, Design and Analysis of Experiments, on random effects."""
CREEPAGES = (0.01, 0.02, 0.04, 0.07)
NOISE, SCATTER = 0.004, 0.04


def of_means(values: Floats, *, separate: bool = True, creepage: Floats | None = None) -> Experiment:
    """Tests with these T/N (test, sample)."""
    course = replace(history(np.full(len(values), 0.05) if creepage is None else creepage, 1), separate=separate)
    samples = traction_samples(course, spread(course, values.shape[1]), values.ravel())
    return experiment(course, thermal=None, measured=Measured(traction=samples))


def repeats(seed: int, *, falling: bool = False, drift: float = 0.0, by: float = SCATTER) -> Experiment:
    """Four tests at each of four creepages in an order by chance, 20 samples each."""
    rng = np.random.default_rng(seed)
    creepage = np.concatenate([rng.permutation(CREEPAGES) for _ in range(4)])
    mu = 0.45 * (0.6 + 0.4 * np.exp(-4.0 * SPEED * creepage)) if falling else np.full(16, 0.45)
    mu = mu * (1.0 + by * rng.standard_normal(16)) * (1.0 + drift * np.arange(16))
    return of_means(mu[:, None] + NOISE * rng.standard_normal((16, 20)), creepage=creepage)


def scatter(test: Experiment) -> float:
    return repeats_of(test).scatter


def table_of(test: Experiment) -> Experiment:
    """The same as a table of means: one T/N for each of sixteen tests, without times."""
    samples, unknown = test.measured.traction, np.full(16, np.nan)
    assert samples is not None
    means = samples.ratio.reshape(16, -1).mean(axis=1)
    rows = TractionSamples(unknown, np.arange(16), test.history.step_creepage, means, unknown)
    return replace(test, measured=Measured(traction=rows))


def answer(test: Experiment) -> Diagnosis:
    return diagnose([test], validate=None, progress=lambda stage, part: None)


def test_the_scatter_is_that_of_a_textbook() -> None:
    assert scatter(of_means(LOOMS / 200.0)) == pytest.approx(np.sqrt(6.96) / LOOMS.mean(), rel=0.02)


def test_what_was_not_repeated_shows_no_scatter() -> None:
    rng = np.random.default_rng(1)
    levels = 0.4 + 0.02 * rng.standard_normal((8, 1)) + 0.001 * rng.standard_normal((8, 20))
    assert np.isnan(scatter(of_means(levels, creepage=np.linspace(0.02, 0.09, 8))))
    assert scatter(of_means(levels, separate=False)) == 0.0
    assert scatter(of_means(levels[:, :1])) == 0.0, "its noise holds what single samples scatter by"
    assert scatter(of_means(levels)) == pytest.approx(0.05, rel=0.5)


@given(st.floats(-0.02, 0.04), st.integers(0, 100))
def test_a_steady_drift_is_no_scatter(drift: float, seed: int) -> None:
    """Of tests that follow a line exactly the logarithms are nearly a parabola."""
    assert scatter(repeats(seed, drift=drift, by=0.0)) < 0.01


def test_the_variance_is_right_in_the_mean() -> None:
    squares = [scatter(repeats(seed, drift=0.01 * (seed % 3))) ** 2 for seed in range(300)]
    assert np.mean(squares) == pytest.approx(SCATTER**2, rel=0.08)


@pytest.mark.parametrize("seed", one_of(range(6)))
def test_scatter_between_repeats_is_not_evidence(seed: int) -> None:
    found = answer(repeats(seed))
    assert found.verdict == "no_missing_effect"
    assert any("separate tests at one setting scatter by" in note for note in found.notes)


@pytest.mark.parametrize("seed", one_of(range(6)))
def test_falling_friction_stands_out_of_the_scatter(seed: int) -> None:
    found = answer(repeats(seed, falling=True))
    assert [effect.name for effect in found.effects] == ["falling_friction"]
    assert found.effects[0].strength in ("probable", "established")


@pytest.mark.parametrize("seed", one_of(range(6)))
def test_a_drift_over_the_order_stands_out_of_the_scatter(seed: int) -> None:
    found = answer(repeats(seed, drift=0.02))
    assert [(law.law.quantity, law.law.covariate) for law in found.laws] == [("mu", "order")]


@pytest.mark.parametrize("seed", one_of(range(6)))
def test_a_drift_stands_out_of_a_table_of_means(seed: int) -> None:
    """Repeats scatter about the drift that all settings share, and not by what it makes of them."""
    found = answer(table_of(repeats(seed, drift=0.02)))
    assert [(law.law.quantity, law.law.covariate) for law in found.laws] == [("mu", "order")]


@pytest.mark.parametrize("seed", one_of(range(6)))
def test_falling_friction_stands_out_of_a_table_of_means(seed: int) -> None:
    found = answer(table_of(repeats(seed, falling=True)))
    assert [effect.name for effect in found.effects] == ["falling_friction"]
