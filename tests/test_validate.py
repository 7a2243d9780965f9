"""A test that was not fitted: where a law goes beyond what it was learnt on, and where it cannot be carried over."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from rigs import Floats, Instruments, Plant, history, running

from twindisc_cli.laws.law import Law, warnings
from twindisc_cli.loop.explain import _raised_elsewhere, explain
from twindisc_cli.loop.fit import fit, linearised
from twindisc_cli.loop.problem import Problem, case_of
from twindisc_cli.loop.terms import LawTerm
from twindisc_cli.loop.thresholds import ACCEPTANCE, SEARCH
from twindisc_cli.loop.validate import Elsewhere, drawn_levels, predict_test
from twindisc_cli.model.experiment import History
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.model.prediction import Prediction

COURSE = history((0.01, 0.02, 0.05, 0.08), 1)
LAW = Law("mu", "creepage", "linear", {"size": 0.1, "begin_percent": 0.0, "end_percent": 9.0}, valid=(0.5, 9.0))


@pytest.fixture(scope="module")
def foretold() -> Prediction:
    test = Instruments(channels=("traction",)).record(Plant(COURSE), np.random.default_rng(0))
    base = {"mu": np.array([0.6]), "K": np.array([0.0]), "convection_W_K": np.array([1.6])}
    return ForwardModel(test).predict(base)


def test_a_law_inside_its_range_is_used_without_a_word(foretold: Prediction) -> None:
    assert warnings({"friction": LAW}, foretold.state, "other") == []
    slightly = replace(LAW, valid=(1.1, 9.0))
    assert warnings({"friction": slightly}, foretold.state, "other") == [], "by less than a fiftieth of the range"


@pytest.mark.parametrize(("valid", "share"), [((0.5, 4.0), 50), ((1.5, 6.0), 50), ((6.0, 9.0), 75)])
def test_a_law_beyond_its_range_is_told_with_the_share_of_the_time(
    valid: tuple[float, float], share: int, foretold: Prediction
) -> None:
    (told,) = warnings({"friction": replace(LAW, valid=valid)}, foretold.state, "other")
    assert "friction" in told
    assert "other" in told
    assert f"{share} %" in told
    assert f"{valid[0]:g} to {valid[1]:g}" in told


def test_a_law_of_its_own_history_is_not_carried_over_in_silence(foretold: Prediction) -> None:
    law = Law("mu", "time", "linear", {"size": 0.1, "begin_s": 0.0, "end_s": 99.0}, transfer="same_history")
    (told,) = warnings({"settling": law}, foretold.state, "other")
    assert "cannot be carried over" in told
    assert "time" in told


def test_what_is_foretold_is_judged_by_the_covariance_of_noise_parameters_and_repeats() -> None:
    """Against S = 1 + J (C + R) J' written out; a repeat whose mu is 2 % off costs little, a worse one much more."""
    rig = Instruments(channels=("traction",))
    first = Problem([case_of(rig.record(Plant(COURSE), np.random.default_rng(1)))], ("traction",))
    fitted = fit(first)
    told = {}
    for off in (0.0, 0.02, 0.3):
        test = rig.record(Plant(COURSE), np.random.default_rng(2))
        traction = test.measured.traction
        assert traction is not None
        samples = replace(traction, ratio=traction.ratio * (1.0 + off))
        problem = Problem([case_of(replace(test, measured=replace(test.measured, traction=samples)))], ("traction",))
        miss, J, _ = linearised(problem, fitted.theta, problem.measured)
        S = np.eye(len(miss)) + J @ (fitted.covariance + ACCEPTANCE.repeat_scatter**2 * np.eye(len(fitted.theta))) @ J.T
        chi2 = float(miss @ np.linalg.solve(S, miss))
        told[off] = Elsewhere(problem).density(fitted)
        assert told[off][1] == pytest.approx(chi2)
        excess, blocks = max(chi2 - len(miss), 0.0), ACCEPTANCE.judged_blocks
        density = -0.5 * (min(chi2, len(miss)) + blocks * np.log1p(excess / blocks) + np.linalg.slogdet(S)[1])
        assert told[off][0] == pytest.approx(density)
    assert told[0.0][0] - told[0.02][0] < 2.0
    assert told[0.0][0] - told[0.3][0] > SEARCH.effect_evidence


def test_what_only_the_predicted_test_separates_is_separated_by_it() -> None:
    """Friction over the greatest creepage so far, which on a rising ramp is the creepage, and up and down is not."""

    def friction(of: History) -> Callable[[Floats, Floats, Floats], Floats]:
        greatest = np.maximum.accumulate(of.creepage)
        return lambda time, _c, _n: 0.6 - 0.15 * np.exp(-(((greatest[running(of, time)] - 0.03) / 0.015) ** 2))

    rising, falling = (0.005, 0.01, 0.02, 0.03, 0.05, 0.08), (0.03, 0.01, 0.05, 0.02, 0.08, 0.005)
    tests = [
        Instruments(channels=("traction",)).record(Plant(of, mu=friction(of)), np.random.default_rng(seed))
        for seed, of in enumerate((history(rising, 2), history(falling, 2)))
    ]
    alone, both = (
        explain(tests[:1], validate=other, quick=True, progress=lambda _what, _share: None)
        for other in (None, case_of(tests[1]))
    )
    assert LawTerm("mu", "greatest_creepage") not in alone.answer.labels
    assert both.answer.labels == {LawTerm("mu", "greatest_creepage")}


def test_the_level_of_a_test_that_is_only_predicted_is_that_of_the_middle_of_those_fitted() -> None:
    rig, levels = Instruments(channels=("traction",)), (0.5, 0.62, 0.6)
    cases = [
        case_of(rig.record(Plant(COURSE, mu=lambda t, c, n, m=mu: m + 0.0 * t), np.random.default_rng(seed)))
        for seed, mu in enumerate(levels)
    ]
    fitted = fit(Problem(cases, ("traction",)))
    told = predict_test(rig.record(Plant(COURSE), np.random.default_rng(9)), fitted)
    assert told.case.held["mu"] == pytest.approx(np.median(levels), rel=0.01)


def test_the_level_of_one_more_test_is_drawn_from_the_scatter_of_those_fitted() -> None:
    """Of one test by what repeats scatter; of several by Student's t of their own levels, wide where these are few."""
    rig, levels = Instruments(channels=("traction",)), (0.5, 0.62, 0.6, 0.55, 0.58)
    cases = [
        case_of(rig.record(Plant(COURSE, mu=lambda t, c, n, m=mu: m + 0.0 * t), np.random.default_rng(seed)))
        for seed, mu in enumerate(levels)
    ]
    low, high = drawn_levels(fit(Problem(cases[:1], ("traction",))))["mu"]
    assert np.log([low / 0.5, high / 0.5]) == pytest.approx(
        1.645 * ACCEPTANCE.repeat_scatter * np.array([-1, 1]), abs=0.003
    )
    low, high = drawn_levels(fit(Problem(cases, ("traction",))))["mu"]
    y = np.log(levels)
    half = 2.353 * np.std(y, ddof=1) * np.sqrt(1.0 + 1.0 / 5.0)  # t of three degrees of freedom, noise is small
    assert np.log([low, high]) == pytest.approx(np.mean(y) + half * np.array([-1, 1]), abs=0.03)


def test_a_predicted_test_keeps_the_friction_that_it_gives_for_its_steps() -> None:
    """In full slip T/N is mu: of a step that gives none, that of the fit."""
    rig = Instruments(channels=("traction",))
    fitted = fit(Problem([case_of(rig.record(Plant(COURSE), np.random.default_rng(1)))], ("traction",)))
    test = rig.record(Plant(COURSE), np.random.default_rng(2))
    own = np.array([np.nan, 0.3, 0.2, 0.4])[COURSE.step]
    predicted = predict_test(replace(test, history=replace(test.history, given_mu=own)), fitted)
    step = np.searchsorted(COURSE.end_time, predicted.case.test.measured.traction.time)  # type: ignore[union-attr]
    ratio = predicted.prediction.traction[0]
    assert ratio[step == 2] == pytest.approx(0.2, rel=1e-3)
    assert ratio[step == 3] == pytest.approx(0.4, rel=1e-3)
    assert ratio[step == 0].max() > 0.5


@pytest.mark.parametrize(
    ("channel", "lost", "refused"),
    [("profile", 1.0, False), ("profile", 5.0, True), ("traction", 1.0, False), ("traction", 5.0, True)],
)
def test_a_rise_that_the_other_test_does_not_speak_against_refuses_nothing(
    monkeypatch: pytest.MonkeyPatch, channel: str, lost: float, refused: bool
) -> None:
    """How uncertain the prediction is, and how K scatters from test to test, is in the density of what was measured."""
    noise = np.random.default_rng(4).standard_normal(240)

    def foretold(size: float) -> SimpleNamespace:
        missed = size * noise
        case = SimpleNamespace(noise={channel: SimpleNamespace(std=1.0)})
        return SimpleNamespace(case=case, misses=lambda c: missed, error=lambda c: float(np.std(missed)))

    def made(there: float) -> SimpleNamespace:
        return SimpleNamespace(there=there)

    monkeypatch.setattr("twindisc_cli.loop.explain.predict_test", lambda test, size: foretold(size))
    monkeypatch.setattr("twindisc_cli.loop.explain.at_its_own_level", lambda predicted: foretold(1.0))
    judged = SimpleNamespace(unseen_before=1.1, unseen_after=1.5, fall=0.0, explanation=made(-lost))
    assert bool(_raised_elsewhere(judged, made(0.0), SimpleNamespace())) == refused  # type: ignore[arg-type]
