"""The bootstrap of blocks against linear theory: weights, twins, what a single block carries."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from rigs import Floats, autoregressive, experiment, history, spread, traction_samples

from twindisc_cli.laws.trial import curve
from twindisc_cli.loop.explanation import Explanation
from twindisc_cli.loop.fit import fit, precision
from twindisc_cli.loop.problem import Problem, case_of
from twindisc_cli.loop.resample import blocks, scatter, shares, softened, weights
from twindisc_cli.loop.term_intervals import estimate_of
from twindisc_cli.model.experiment import Measured, Options

COURSE = history((0.02, 0.04, 0.09, 0.03, 0.06, 0.015), 2)
TIME = spread(COURSE, 20)
SIGMA = 0.004


def problem_of(change: Floats, seed: int = 0) -> Problem:
    ratio = 0.6 + change + SIGMA * np.random.default_rng(seed).standard_normal(len(TIME))
    samples = traction_samples(COURSE, TIME, ratio, SIGMA)
    options = Options(friction_coefficient=0.6)
    test = experiment(COURSE, thermal=None, options=options, measured=Measured(traction=samples))
    return Problem([case_of(test)], ("traction",))


def explanation(problem: Problem, *terms: str) -> Explanation:
    return Explanation(fit(problem.with_terms(*terms)), {}, fit(problem).chi2)


def test_every_draw_is_shared_out() -> None:
    problem = problem_of(0.002 * np.sin(TIME / 90.0))
    found = weights([explanation(problem, *terms) for terms in ((), ("torque_offset",), ("sensor_drift",))])
    assert found.min() >= 0.0
    assert found.sum(axis=1) == pytest.approx(1.0)
    assert len(np.unique(np.round(found[:, 0], 6))) > 10, "draws differ"


def test_what_all_draws_choose_is_not_certain() -> None:
    """What is missing may be among none of the explanations."""
    problem = problem_of(np.full_like(TIME, 0.0))
    certain = explanation(problem, "torque_offset")
    assert shares([certain]) == pytest.approx([0.95])
    assert shares([certain, replace(certain, costs={"torque_offset": 1e3})]) == pytest.approx([0.95, 0.0])


def test_twins_share() -> None:
    problem = problem_of(0.01 * TIME / 1000.0)
    one = explanation(problem, "sensor_drift")
    found = weights([one, replace(one), explanation(problem)])
    assert found[:, 0] == pytest.approx(found[:, 1])
    assert np.mean(found[:, 0]) == pytest.approx(0.5, abs=0.05)


@pytest.mark.parametrize(("offset", "weight"), [(0.02, -1.0 / 18.0), (-0.06, -0.5), (-0.18, -4.5)])
def test_a_zero_far_above_the_typical_one_is_implausible_whatever_it_explains(offset: float, weight: float) -> None:
    """Prior of the size: normal, three typical offsets of 0.02 wide, relative to no offset."""
    problem = problem_of(offset + 0.0 * TIME)
    zero, plain = explanation(problem, "torque_offset"), explanation(problem)
    assert zero.plausibility == pytest.approx(weight, rel=0.1)
    assert plain.plausibility == explanation(problem, "falling_friction").plausibility == 0.0


def test_a_clear_effect_comes_back_and_nothing_stays_nothing() -> None:
    clear, nothing = (
        np.mean(weights([explanation(p), explanation(p, "sensor_drift")]), axis=0)
        for p in (problem_of(0.05 * TIME / 1000.0), problem_of(0.0 * TIME, seed=2))
    )
    assert clear[1] > 0.99
    assert nothing[1] < 0.5


def test_what_a_single_block_carries_is_unstable() -> None:
    """A drift seen only in the last minutes: a draw without them has nothing for it; one all along is in every draw."""
    size = 0.05 * (0.965 * TIME[-1] < TIME)
    steady = 0.0075 * TIME / TIME[-1]
    shares = [
        weights([explanation(p), explanation(p, "sensor_drift")])[:, 1] for p in (problem_of(size), problem_of(steady))
    ]
    assert np.mean(shares[0] < 0.5) > 0.2, "a block is not drawn in one of e draws"
    assert np.mean(shares[1] < 0.5) < 0.1


def test_drawing_a_sample_twice_is_measuring_it_twice() -> None:
    """chi2 of a linear model over a draw, against least squares with the samples as often as drawn."""
    problem = problem_of(0.004 * np.sin(TIME / 120.0))
    one = explanation(problem, "torque_offset", "sensor_drift")
    drawn = np.random.default_rng(3).multinomial(len(TIME), np.full(len(TIME), 1.0 / len(TIME))).astype(float)
    root = np.sqrt(drawn)
    prior = np.diag(np.sqrt(precision(one.fit.problem)))
    rows = np.concatenate([root[:, None] * one.fit.jacobian, prior])
    target = np.concatenate([root * one.fit.residual, np.zeros(2)])
    left = target - rows @ np.linalg.lstsq(rows, target, rcond=None)[0]
    from twindisc_cli.loop.resample import _evidence

    found = _evidence(one, np.arange(len(TIME)), drawn[None])[0]
    assert 0.5 * float(left @ left) == pytest.approx(one.evidence - found + 0.5 * one.fit.chi2, rel=1e-9)


def test_where_each_block_is_drawn_once_nothing_is_gained() -> None:
    """Not beyond a bound, where the data press a parameter against it, and not from the prior of a curve's places."""
    rising = problem_of(0.5 * COURSE.creepage[np.searchsorted(COURSE.end_time, TIME)])
    falls = explanation(rising, "falling_friction")
    assert falls.fit.pressed.any()
    sloped = problem_of(0.05 * TIME / TIME[-1])
    law = curve("mu", "time", np.linspace(0.0, float(TIME[-1]), 4), 0.01 * np.eye(4))
    bent = Explanation(fit(sloped.with_terms("law", trial={"law": law})), {}, fit(sloped).chi2)
    assert bent.fit.problem.normal.all()
    from twindisc_cli.loop.resample import _evidence

    for one in (falls, bent):
        block = blocks(one.fit)
        found = _evidence(one, block, np.ones((1, block.max() + 1)))[0]
        assert found == pytest.approx(one.evidence, abs=0.05)


def test_blocks_are_neighbours_of_one_channel() -> None:
    block = blocks(explanation(problem_of(0.0 * TIME)).fit)
    assert block[0] == 0
    assert set(np.diff(block)) <= {0, 1}
    counts = np.bincount(block)
    assert counts.max() - counts.min() <= 1
    assert counts.min() >= 8


@dataclass(frozen=True)
class Said:
    """What softening asks of an explanation."""

    evidence_scale: float


def test_weights_are_bayes_factors_tempered_by_the_best() -> None:
    found = softened(np.array([[4.0, 3.0, 1.0]]), [Said(2.0), Said(9.0), Said(5.0)])  # type: ignore[list-item]
    assert found[0, 1] / found[0, 0] == pytest.approx(np.exp(-0.5))
    assert found[0, 2] / found[0, 0] == pytest.approx(np.exp(-1.5))


def test_intervals_hold_where_what_is_missed_is_alike_over_blocks() -> None:
    """Slow errors that the noise told knows nothing of: a level is fixed by as many blocks, not by as many samples."""
    held, alone = [], []
    for seed in range(40):
        slow = 3.0 * SIGMA * autoregressive(np.random.default_rng(100 + seed), len(TIME), 0.8)
        found = fit(problem_of(slow, seed).with_terms("torque_offset"))
        interval = estimate_of(found, 0)
        held.append(interval.low <= 0.0 <= interval.high)
        even = np.sqrt(found.chi2 / len(TIME) * found.covariance[0, 0])
        alone.append(abs(found.theta[0]) < 1.645 * even)
    assert np.mean(held) > np.mean(alone) + 0.2


def test_the_scatter_of_white_noise_is_that_of_its_samples() -> None:
    found = [fit(problem_of(0.0 * TIME, seed).with_terms("torque_offset", "sensor_drift")) for seed in range(30)]
    ratio = np.array([scatter(one)[0] / np.sqrt(np.diag(one.covariance)) for one in found])
    assert np.mean(ratio, axis=0) == pytest.approx(1.0, abs=0.12)
