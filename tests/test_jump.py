"""What a jump of friction may come from: the best rising curve against closed forms, and what twelve steps can say."""

from __future__ import annotations

import numpy as np
import pytest
from definitions import outcome

from twindisc_cli.identify.jump import largest_jump, rising_curve

CREEPAGE = np.array([0.005, 0.01, 0.015, 0.02, 0.03, 0.04, 0.05, 0.06])
MU = np.array([0.05, 0.05, 0.06, 0.07, 0.35, 0.45, 0.55, 0.58])


def test_the_best_rising_curve_beats_every_other_rising_one() -> None:
    rng = np.random.default_rng(1)
    x, y = rng.permutation(12).astype(float), rng.random(12)
    curve = rising_curve(x, y)
    order = np.argsort(x)
    assert np.all(np.diff(curve[order]) >= 0.0)
    assert curve.sum() == pytest.approx(y.sum())
    best = np.sum((y - curve) ** 2)
    for _ in range(2000):
        other = np.empty(12)
        other[order] = np.sort(curve[order] + 0.1 * rng.standard_normal(12))
        assert np.sum((y - other) ** 2) >= best


def test_friction_that_follows_the_disc_is_told_from_creepage_and_flash() -> None:
    # creepage goes up and down, and friction is a rising function of the disc's temperature alone
    creepage, disc = np.array([1, 6, 2, 5, 1, 4, 2, 3]) / 100.0, 300.0 + np.arange(8.0)
    jump = largest_jump(creepage=creepage, mu=MU, disc=disc, flash=500.0 * creepage * MU)
    assert jump is not None
    assert (jump.step, jump.before, jump.after) == (4, 0.07, 0.35)
    assert jump.best.name == "temperature of the disc"
    assert jump.best.left == pytest.approx(0.0, abs=1e-12)
    assert min(cause.left for cause in jump.causes if cause is not jump.best) > 0.05


def test_the_flash_counts_as_it_was_with_the_friction_before() -> None:
    jump = largest_jump(creepage=CREEPAGE, mu=MU, disc=300.0 + np.arange(8.0), flash=1000.0 * CREEPAGE * MU)
    assert jump is not None
    flash = next(cause for cause in jump.causes if cause.name == "flash temperature")
    assert flash.values[4] == pytest.approx(1000.0 * 0.03 * 0.07)


def test_friction_without_a_jump_says_nothing() -> None:
    smooth = np.linspace(0.5, 0.6, 8)
    assert largest_jump(creepage=CREEPAGE, mu=smooth, disc=CREEPAGE, flash=CREEPAGE) is None
    assert "friction_jump" not in outcome("ambient", "thermal").json


def test_in_nitrogen_the_twelve_steps_cannot_tell_the_causes_apart() -> None:
    result = outcome("cryogenic", "thermal")
    found = result.json["friction_jump"]
    assert found["step"] == 6
    assert (found["mu_before"], found["mu_after"]) == pytest.approx((0.07, 0.35), abs=2e-3)
    before = {cause["covariate"]: cause["before_the_jump"] for cause in found["causes"]}
    # steady: P / (h S) = 0.07 x 72 N x 9.4248 m/s x 2 % / (3.5 W/K), above -196 degC
    assert before["temperature of the disc"] - 77.15 == pytest.approx(0.07 * 72.0 * 9.4248 * 0.02 / 3.5, rel=0.01)
    assert before["flash temperature"] < 10.0
    assert any("cannot be separated by these 12 steps" in line for line in result.summary)


def test_a_curve_has_one_value_where_steps_share_a_covariate() -> None:
    """Up and down at the same creepages: their mean; a curve in the order of the steps had gone through both."""
    assert rising_curve(np.array([1.0, 1.0, 2.0]), np.array([0.1, 0.3, 0.4])) == pytest.approx([0.2, 0.2, 0.4])
    assert rising_curve(np.array([1.0, 2.0, 1.0]), np.array([0.2, 0.1, 0.3])) == pytest.approx([0.2, 0.2, 0.2])
