"""The eight slips of Lewis and Dwyer-Joyce (2004): heat as printed, and what is said where the theory misses them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from definitions import CONFIGS, outcome
from matplotlib.figure import Figure
from rigs import experiment, history

from twindisc_cli.definition import load
from twindisc_cli.loop.diagnose import diagnose
from twindisc_cli.loop.extend import too_few_samples
from twindisc_cli.loop.fit import Fit, plain_fit
from twindisc_cli.loop.holdout import without
from twindisc_cli.loop.problem import problem_of
from twindisc_cli.loop.screen import is_beyond_assumed, unexplained_residual
from twindisc_cli.loop.thresholds import ACCEPTANCE, RESAMPLING
from twindisc_cli.model.experiment import Measured, TractionSamples

HEAT_W = (1.3, 9.2, 25.7, 102.6, 246.0, 327.8, 492.1, 728.4)
BULK_C = np.array([20.6, 22.9, 27.5, 48.6, 89.0, 111.9, 136.8, 202.1])


def words(figure: Figure) -> str:
    """All that a figure says outside its panels."""
    return " ".join(" ".join(text.get_text().split()) for text in figure.texts)


def test_the_heat_is_the_tables() -> None:
    found = outcome("lewis2004", "thermal").json["iterations"]
    assert [row["power_W"] for row in found] == pytest.approx(HEAT_W, rel=5e-3)


def test_one_convection_balances_the_bulk_and_what_it_leaves_is_said() -> None:
    result = outcome("lewis2004", "thermal")
    heat = np.array(HEAT_W)
    squares = np.sum(heat**2) / np.sum(heat * (BULK_C - 20.0))  # steady: T - 20 = P / hS
    assert result.json["convection_W_K"] == pytest.approx(squares, rel=5e-3)
    missed = BULK_C - 20.0 - heat / squares
    (line,) = [line for line in result.summary if "one convection leaves" in line]
    assert f"{np.sqrt(np.mean(missed**2)):.2g} K rms" in line
    assert "one convection leaves" in words(result.figure())


def test_carter_is_too_stiff_for_the_lower_slips_and_the_figure_says_so() -> None:
    """T/N / mu = 1 - (1 - k v / v_full)^2 with v_full = mu a kappa."""
    half_length = np.sqrt(8 * 7233 / 0.01 * 0.0235 / 2 * 0.91 / (np.pi * 209e9))
    mu = np.mean([0.480, 0.461, 0.460, 0.461, 0.512])
    full = mu * half_length * 2 / 0.0235
    ask = [full / v * (1 - np.sqrt(1 - t / mu)) for v, t in ((0.002, 0.091), (0.005, 0.258), (0.01, 0.361))]
    result = outcome("lewis2004", "identify-mu")
    (line,) = [line for line in result.summary if "theoretical initial slope" in line]
    assert f"{min(ask):.2f} to {max(ask):.2f}" in line
    assert "theoretical initial slope" in words(result.figure())


def test_the_loop_gives_a_reduced_slope_and_no_more_than_eight_points_fix() -> None:
    """Below 1 % T/N is lower than Carter's; the bulk at 15 and 20 % is off the balance of heat; two parameters each."""
    found = diagnose([load(CONFIGS / "lewis2004.toml").experiment], validate=None, progress=quiet, quick=True)
    named = {str(term) for e in found.effects for term in (e.name, *(a.term for a in e.alternatives))}
    assert named & {"third_body_layer", "saturating_friction"}, "either lowers the slope"
    assert sum(len(effect.parameters) for effect in found.effects) == 1
    assert not found.laws
    (bulk,) = (curve for curve in found.curves if curve.channel == "temperature")
    assert set(np.argsort(np.abs(bulk.measured - bulk.after))[-2:]) == {6, 7}, "the slips of 15 and 20 %"
    assert "temperature" in {left.channel for left in found.unexplained}
    assert any("no more than 2 parameters" in note for note in found.notes)


def test_six_points_cannot_tell_a_zero_from_a_reduced_slope() -> None:
    """Two of them are below saturation; they scatter by five times the noise that has to be assumed about either."""
    test = load(CONFIGS / "lewis2004.toml").experiment
    some = np.isin(np.arange(8), (2, 3))
    six = without(test, {"traction": some, "temperature": some})
    found = diagnose([six], validate=None, progress=quiet, quick=False)
    (effect,) = found.effects
    chance = {effect.name: effect.probability, **{str(a.term): a.probability for a in effect.alternatives}}
    assert chance.keys() >= {"torque_offset", "third_body_layer"}
    assert max(chance.values()) < RESAMPLING.probable


def test_noise_that_was_assumed_is_as_large_as_what_is_left() -> None:
    """About a mean the variance is the sum of squares over n - 1; noise that was estimated counts as it is."""
    test = load(CONFIGS / "lewis2004.toml").experiment
    high = without(test, {"traction": np.arange(8) < 3})
    fitted = plain_fit(replace(problem_of([high]), channels=("traction",)))
    ratio = np.array([0.480, 0.461, 0.460, 0.461, 0.512])
    (noise,) = (case.noise["traction"] for case in fitted.problem.cases)
    assert fitted.excess_of_assumed("traction") == pytest.approx(np.var(ratio, ddof=1) / noise.std**2, rel=1e-2)
    (case,) = fitted.problem.cases
    known = replace(case, noise={"traction": replace(noise, estimated=True)})
    assert replace(fitted, problem=replace(fitted.problem, cases=[known])).excess_of_assumed("traction") == 1.0


STEPS = history(0.02 + 0.01 * np.arange(8), 1)


def of_eight_steps(scatter: float, uncertainty: float = np.nan) -> Fit:
    """One mu for eight T/N in full sliding, one of a step without time, in turn above and below 0.45 by a share."""
    unknown = np.full(8, np.nan)
    ratio = 0.45 * (1.0 + scatter * (-1.0) ** np.arange(8))
    samples = TractionSamples(unknown, np.arange(8), STEPS.step_creepage, ratio, np.full(8, uncertainty))
    return plain_fit(problem_of([experiment(STEPS, thermal=None, measured=Measured(traction=samples))]))


@pytest.mark.parametrize(
    ("scatter", "uncertainty", "left"), [(0.018, np.nan, False), (0.018, 0.0045, True), (0.05, np.nan, True)]
)
def test_what_a_noise_twice_the_assumed_one_leaves_is_not_unexplained(
    scatter: float, uncertainty: float, left: bool
) -> None:
    """Eight times 1.8^2 is 26 of chi2 with 7 degrees of freedom, p = 5e-4, and a quarter of it p = 0.5."""
    fitted = of_eight_steps(scatter, uncertainty)
    assert unexplained_residual(fitted, "traction").significant(ACCEPTANCE.unexplained_alone)
    assert is_beyond_assumed(fitted, "traction") == left


def test_eight_samples_without_scatter_leave_effects_untried() -> None:
    """Two parameters in all, mu one of them; with a noise that is known all effects are tried."""
    assert too_few_samples(of_eight_steps(0.05).problem) == ["traction"]
    assert too_few_samples(of_eight_steps(0.05, 0.0045).problem) == []


def quiet(_what: str, _share: float) -> None:
    """Progress that nobody watches."""
