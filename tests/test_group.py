"""Groups in the loop: in how many tests a term acts, with which parameters, and what the others foretell of a test."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from records.sources import sweeps
from rigs import SPEED, Instruments, Plant, experiment, history, spread, traction_samples
from scipy.special import betaincinv

from twindisc_cli.effects import catalogue
from twindisc_cli.identify import hierarchy
from twindisc_cli.laws.law import Law
from twindisc_cli.loop.group import GroupDiagnosis, diagnose_group
from twindisc_cli.loop.members import changes_sign, mixture, one_set, p_one_set, resized
from twindisc_cli.loop.problem import parameters_of
from twindisc_cli.model.experiment import Experiment, Measured

COURSE = history((0.02, 0.04, 0.09, 0.03, 0.06, 0.015), 2)
TIME = spread(COURSE, 6)
AT = COURSE.creepage[np.searchsorted(COURSE.end_time, TIME)]
GRID = np.linspace(0.0, 0.1, 41)
SIGMA = 0.004
REFERENCE = Path(__file__).parent / "reference"


def repeats(sizes: list[float], decays: list[float], seed: int = 0) -> list[Experiment]:
    """Tests in full sliding whose friction falls with the sliding speed by a share and at a rate of their own."""
    rng = np.random.default_rng(seed)
    tests = []
    for number, (size, decay) in enumerate(zip(sizes, decays, strict=True)):
        mu = 0.6 * np.exp(0.03 * rng.standard_normal())
        ratio = mu * (1.0 - size * -np.expm1(-decay * AT * SPEED)) + SIGMA * rng.standard_normal(len(TIME))
        measured = Measured(traction=traction_samples(COURSE, TIME, ratio))
        tests.append(experiment(COURSE, thermal=None, name=f"t{number}", measured=measured))
    return tests


def quiet(_what: str, _fraction: float) -> None:
    pass


def test_the_share_of_tests_has_its_closed_forms() -> None:
    """One test: P = e^E / (1 + e^E). Tests that say yes or no for certain: the share is Beta(yes + 1, no + 1)."""
    probability, _, gain = mixture(np.array([1.7]))
    assert probability[0] == pytest.approx(1.0 / (1.0 + np.exp(-1.7)), rel=1e-4)
    assert gain == pytest.approx(np.log(0.5 * (1.0 + np.exp(1.7))), rel=1e-4)
    probability, (middle, low, high), gain = mixture(np.array([400.0, 400.0, 400.0, -400.0, -400.0]))
    expected = [betaincinv(4, 3, q) for q in (0.5, 0.05, 0.95)]
    assert (middle, low, high) == pytest.approx(expected, abs=3e-3)
    assert probability == pytest.approx([1, 1, 1, 0, 0], abs=1e-9)
    assert gain == pytest.approx(1200.0 - np.log(60.0), rel=1e-5)  # B(4, 3) = 1 / 60


def test_what_says_nothing_in_any_test_says_nothing_for_the_group() -> None:
    probability, share, gain = mixture(np.zeros(6))
    assert gain == pytest.approx(0.0, abs=1e-9)
    assert probability == pytest.approx(np.full(6, 0.5), abs=1e-9)
    assert share == pytest.approx((0.5, 0.05, 0.95), abs=3e-3)


def test_one_set_of_parameters_is_tested_as_cochran_does() -> None:
    rng = np.random.default_rng(1)
    theta, std = rng.standard_normal((6, 1)), rng.uniform(0.5, 1.5, 6)
    covariance = (std**2)[:, None, None]
    assert p_one_set(theta, covariance) == pytest.approx(hierarchy.pool(theta[:, 0], std).p_one, rel=1e-9)
    mean, together = one_set(np.array([[1.0, 0.0], [3.0, 4.0]]), np.array([np.eye(2), 4.0 * np.eye(2)]))
    assert mean == pytest.approx([1.4, 0.8])  # weights 4 to 1
    assert together == pytest.approx(0.8 * np.eye(2))


DECAYS = [2.7, 3.4, 2.8, 3.0]


@cache
def three_of_four() -> GroupDiagnosis:
    """Falling friction in three of four tests, at rates that scatter; the fourth has a constant mu."""
    tests = repeats([0.5, 0.5, 0.5, 0.0], DECAYS)
    return diagnose_group(tests, quiet)


def test_an_effect_of_some_tests_is_told_from_one_of_all() -> None:
    (found,) = three_of_four().shared
    assert (found.name, found.holds, found.acts) == ("falling_friction", "some", (0, 1, 2))
    assert found.probability[3] < 0.2
    assert found.low < 0.75 < found.high


def test_repeats_whose_k_scatters_lack_nothing() -> None:
    """K scatters by tens of per cent between repeats of a wear test (ASTM G77, G99)."""
    k = np.array([1.0e-3, 1.15e-3, 0.9e-3, 0.8e-3])
    plants = [Plant(COURSE, wear_coefficient=float(each)) for each in k]
    tests = [Instruments().record(plant, np.random.default_rng(10 + i)) for i, plant in enumerate(plants)]
    found = diagnose_group([replace(test, name=f"t{i}") for i, test in enumerate(tests)], quiet)
    assert (found.shared, found.refused) == ([], {})
    np.testing.assert_allclose(found.levels["K"].value, k, rtol=0.03)


def test_parameters_differ_between_tests_where_the_data_say_so() -> None:
    (found,) = three_of_four().shared
    ratio, decay = found.parameters["ratio"], found.parameters["decay_s_m"]
    assert ratio.low < 0.5 < ratio.high
    assert ratio.p_one > 0.05
    assert decay.low < np.exp(np.mean(np.log(DECAYS[:3]))) < decay.high
    assert decay.between == pytest.approx(np.std(np.log(DECAYS[:3]), ddof=1), rel=0.5)
    assert decay.p_one < 0.05
    assert found.p_one < 0.05


def test_a_test_is_foretold_by_the_parameters_of_the_others() -> None:
    error = three_of_four().errors["traction"]
    assert error.constant > 0.03
    assert error.left_out_at_own_level == pytest.approx(SIGMA, rel=0.25)
    assert SIGMA < error.left_out < error.constant, "levels that scatter by 3 % are not known"


def test_one_set_holds_where_the_tests_are_alike() -> None:
    found = diagnose_group(repeats([0.5] * 3, [3.0] * 3, seed=2), quiet).shared[0]
    assert found.holds == "all"
    assert found.p_one > 0.05


def test_an_effect_of_one_test_is_of_one() -> None:
    """In its search some trials heat a test without end: they are far off, and no failure."""
    found = diagnose_group(repeats([0.0, 0.3, 0.0], [3.0] * 3, seed=3), quiet).shared[0]
    assert (found.holds, found.acts) == ("one", (1,))
    assert np.isnan(found.p_one)


def test_a_resized_law_changes_so_many_times_as_much() -> None:
    x = np.linspace(0.0, 8.0, 9)
    parameters = {"size": -0.3, "origin_percent": 0.0, "scale_percent": 3.0}
    for law in (
        Law("mu", "creepage", at=(0.0, 4.0, 8.0), value=(1.0, 0.8, 0.7)),
        Law("mu", "creepage", "exponential", parameters),
        Law("traction_ratio", "creepage", at=(0.0, 8.0), value=(0.01, -0.02)),
    ):
        assert resized(law, 2.5).change(x) == pytest.approx(2.5 * law.change(x))


def test_a_parameter_of_both_signs_is_no_common_cause() -> None:
    """Offsets of the creepage that are certain, of both signs: refused; of one sign, or uncertain: not."""
    own = parameters_of("creepage_offset", catalogue()["creepage_offset"])
    one = np.array([[[0.01]]] * 3)
    assert "changes its sign" in changes_sign(own, np.array([[-1.0], [0.9], [1.1]]), one)
    assert not changes_sign(own, np.array([[0.2], [0.9], [1.1]]), one)
    assert not changes_sign(own, np.array([[-1.0], [0.9], [1.1]]), 100.0 * one)


# A record that nobody made up


@cache
def of_sweeps() -> GroupDiagnosis:
    """What twenty sweeps lack together."""
    return diagnose_group(sweeps(), quiet)


@pytest.mark.long
def test_sweeps_of_one_ball_follow_one_law() -> None:
    """Of the sweeps left out, the others predict all but a third of what a constant mu leaves."""
    found = of_sweeps()
    assert [(term.name, term.holds) for term in found.shared] == [("lubricated_film", "all")]
    error = found.errors["traction"]
    assert error.left_out < 0.35 * error.constant
    assert error.left_out_at_own_level <= error.left_out


@pytest.mark.long
def test_the_level_of_the_sweeps_wanders() -> None:
    """The mean T/N above 10 % of creepage, which no law of this program made, says the same of every level."""
    levels = of_sweeps().levels["mu"]
    plateau = np.array([t.measured.traction.ratio[t.measured.traction.creepage > 0.1].mean() for t in sweeps()])
    assert np.corrcoef(levels.shrunk, plateau)[0, 1] > 0.97
    assert levels.wander.correlation >= 0.9
    assert levels.wander.p_order < 1e-4
    assert levels.range == pytest.approx(plateau.max() / plateau.min() - 1.0, abs=0.03)
