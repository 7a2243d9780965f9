"""Inversions: friction from traction, K from a depth and from a profile, and the interval of a mean."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from definitions import shipped
from rigs import ROOM, experiment, history, rig, traction_samples

from twindisc_cli.consistency import findings
from twindisc_cli.errors import MeasurementError, ValidityError
from twindisc_cli.identify import coupled_steps
from twindisc_cli.identify.friction import mean_and_interval, mu_from_traction, states
from twindisc_cli.identify.law import unworn_law
from twindisc_cli.identify.least_squares import fit_positive
from twindisc_cli.identify.roots import bracketed_root
from twindisc_cli.identify.steps import (
    FrictionInUse,
    against_creepage,
    energy_of_steps,
    friction_in_use,
    identify_friction,
    refuse_reversed,
    softness,
)
from twindisc_cli.identify.track import worn_track
from twindisc_cli.identify.wear_coefficient import bisect_depth
from twindisc_cli.model.base import BaseParameters
from twindisc_cli.model.experiment import Experiment, Measured, Options, Thermal, TractionSamples
from twindisc_cli.model.forward import ForwardModel


@pytest.fixture(scope="module")
def ambient() -> Experiment:
    return shipped("ambient").experiment


def with_traction(
    test: Experiment, mu: np.ndarray, *, samples: int = 1, noise: float = 0.0, seed: int = 0
) -> Experiment:
    """The test with the T/N that its own law makes of mu (step,), some samples a step, and white noise."""
    step = np.repeat(np.arange(len(mu)), samples)
    creepage = test.history.step_creepage[step]
    ratio = unworn_law(test).apparent(mu[step], creepage)
    ratio = ratio + noise * np.random.default_rng(seed).standard_normal(len(step))
    unknown = np.full(len(step), np.nan)
    traction = TractionSamples(time=unknown, step=step, creepage=creepage, ratio=ratio, uncertainty=unknown)
    return replace(test, measured=replace(test.measured, traction=traction))


@pytest.mark.parametrize("crown", [0.03, np.inf])
def test_the_patch_grows_with_the_load_as_hertz_has_it(crown):
    discs = replace(rig(crown=crown), disc1=replace(rig().disc1, width=0.01))
    pressed = replace(discs, normal_load=5.0 * discs.normal_load)
    assert discs.area_ratio(np.array([1.0, 5.0])) == pytest.approx([1.0, pressed.patch.area / discs.patch.area])


def test_roots_are_found_to_rounding_and_ends_where_there_is_none():
    low, high = np.zeros(4), np.array([2.0, 3.0, 1.0, 50.0])
    root = bracketed_root(lambda x: x**3 - np.array([2.0, 5.0, 8.0, 1e-9]), low, high)
    assert root[[0, 1, 3]] == pytest.approx(np.cbrt([2.0, 5.0, 1e-9]), rel=1e-14)
    assert root[2] == 1.0


def test_roots_take_few_evaluations():
    calls = []

    def curved(x):
        calls.append(1)
        return np.tanh(x) - np.array([0.3, -0.9, 0.999])

    assert bracketed_root(curved, np.full(3, -30.0), np.full(3, 30.0)) == pytest.approx(np.arctanh([0.3, -0.9, 0.999]))
    asked = len(calls)
    assert asked < 25
    low, high = np.full(3, -30.0), np.full(3, 30.0)
    ends = curved(low), curved(high)
    assert bracketed_root(curved, low, high, ends) == pytest.approx(np.arctanh([0.3, -0.9, 0.999]))
    assert len(calls) - asked == asked, "two at the ends, which are not asked for again"


@pytest.mark.parametrize("law", ["fastsim", "fastrip", "exact"])
def test_identification_undoes_the_traction_law(ambient, law):
    test = replace(ambient, options=replace(ambient.options, traction=law))
    for scale in (0.2, 1.0, 3.0):
        mu = scale * np.linspace(0.7, 0.05, 12)
        found = identify_friction(ForwardModel(with_traction(test, mu)))
        assert found.mu == pytest.approx(mu, rel=1e-9)
    assert {"partial_slip", "saturated"} == set(found.state)


def test_identification_undoes_it_with_effects_and_wear_acting(ambient):
    effects = {"third_body_layer": {"slope_ratio": 0.6}, "torque_offset": {"offset": 0.02}}
    test = replace(ambient, effects=effects, options=replace(ambient.options, wear_coefficient=6e-5))
    mu = np.linspace(0.3, 0.6, 12)
    model = ForwardModel(with_traction(test, mu))
    base = {"mu": mu[test.history.step][None], "K": np.array([6e-5]), "convection_W_K": np.array([3.5])}
    samples = model.experiment.measured.traction
    made = replace(samples, ratio=model.predict(base).traction[0])
    again = replace(model.experiment, measured=replace(test.measured, traction=made))
    assert identify_friction(ForwardModel(again)).mu == pytest.approx(mu, rel=1e-6)


@pytest.mark.parametrize("factor", [8.0, 1.0 / 16.0])
@pytest.mark.parametrize("crown", [0.03, np.inf])
def test_smooth_discs_have_the_slope_of_the_theory_under_any_load(factor, crown):
    """Exact data in partial slip and in full sliding; of a step under yaw T/N says nothing of the slope."""
    course = history([0.08, 0.0001, 0.0002, 0.0001], 1)
    course = replace(course, load_factor=np.array([1.0, factor, factor, 1.0]), yaw=np.array([0.0, 0.0, 0.0, 0.02]))
    blank = traction_samples(course, course.end_time - 40.0, np.zeros(4))
    discs = replace(rig(crown=crown), disc1=replace(rig().disc1, width=0.01))
    test = experiment(course, rig=discs, options=Options(traction="exact"), measured=Measured(traction=blank))
    made = ForwardModel(test).predict({"mu": np.array([0.6])}, profiled=False).traction[0]
    again = replace(test, measured=Measured(traction=replace(blank, ratio=made)))
    slope = softness(again, identify_friction(ForwardModel(again)))
    assert slope[np.isfinite(slope)] == pytest.approx([1.0, 1.0], rel=1e-3)


@pytest.mark.parametrize(
    ("declared", "loads"),
    [
        ({"options": Options(wear_coefficient=7e-5)}, 1.0),
        ({"options": Options(wear_coefficient=2e-3), "rig": rig(load=800.0)}, 1.0),
        ({"options": Options(wear_coefficient=7e-5)}, [1.0, 2.0, 1.0, 3.0, 1.0, 0.5]),
        ({"effects": {"temperature_dependent_friction": {"per_kelvin": -0.03}}}, 1.0),
        ({"effects": {"temperature_dependent_friction": {"per_kelvin": 0.02}}}, 1.0),
    ],
)
def test_identification_undoes_what_steps_leave_to_later_ones(declared, loads):
    """Partial slip after steps that have worn and warmed the discs: the model takes mu to T/N, these to mu."""
    course = history([0.02, 0.001, 0.04, 0.002, 0.08, 0.001], 5)
    course = replace(course, load_factor=np.broadcast_to(loads, 6)[course.step])
    thermal = Thermal(ROOM, 100.0, ROOM, convection=0.2)
    blank = traction_samples(course, course.end_time - 40.0, np.zeros(30))
    test = experiment(course, thermal=thermal, measured=Measured(traction=blank), **declared)
    mu = np.array([0.6, 0.55, 0.5, 0.6, 0.55, 0.6])
    made = ForwardModel(test).predict(BaseParameters.declared(test, mu[None]), profiled=False).traction[0]
    again = replace(test, measured=Measured(traction=replace(blank, ratio=made)))
    assert identify_friction(ForwardModel(again)).mu == pytest.approx(mu, rel=1e-5)


def test_a_friction_with_which_the_model_makes_another_traction_is_refused(monkeypatch):
    monkeypatch.setattr(coupled_steps, "MET", 0.0)
    course = history([0.04, 0.001], 2)
    samples = traction_samples(course, course.end_time - 40.0, np.array([0.6, 0.6, 0.2, 0.2]))
    test = experiment(course, options=Options(wear_coefficient=7e-5), measured=Measured(traction=samples))
    with pytest.raises(ValidityError, match="no friction of the steps was found"):
        identify_friction(ForwardModel(test))


def test_a_step_without_traction_wears_with_the_declared_friction_or_that_of_the_step_before():
    course = history([0.04, 0.04, 0.001], 5)
    course = replace(course, step=np.repeat([0, 1, 2], 5))
    options = Options(wear_coefficient=2e-4)
    blank = traction_samples(course, course.end_time - 40.0, np.zeros(15))
    for given, second in ((np.nan, 0.6), (0.3, 0.3)):
        given_mu = np.where(course.step == 1, given, np.nan)
        test = experiment(replace(course, given_mu=given_mu), options=options, measured=Measured(traction=blank))
        mu = np.array([0.6, second, 0.5])
        made = ForwardModel(test).predict(BaseParameters.declared(test, mu[None]), profiled=False).traction[0]
        seen = course.step != 1
        samples = traction_samples(course, course.end_time[seen] - 40.0, made[seen])
        found = identify_friction(ForwardModel(replace(test, measured=Measured(traction=samples))))
        assert np.isnan(found.mu[1])
        assert found.mu[[0, 2]] == pytest.approx([0.6, 0.5], rel=1e-6)


def test_five_hundred_steps_that_wear_have_their_friction():
    """Trials of mu also wear: the largest must not take off more than any track is deep."""
    course = history(np.where(np.arange(500) % 3, 0.09, 0.005), 1)
    samples = traction_samples(course, course.end_time - 40.0, np.full(500, 0.55))
    options = Options(wear_coefficient=1e-3)
    found = identify_friction(ForwardModel(experiment(course, measured=Measured(traction=samples), options=options)))
    assert found.mu[np.arange(500) % 3 != 0] == pytest.approx(0.55, rel=1e-9)
    assert np.all((found.mu >= 0.55 * (1.0 - 1e-9)) & (found.mu < 0.65))


def test_a_braking_disc_has_the_friction_of_a_driving_one(ambient):
    mu = np.linspace(0.7, 0.05, 12)
    braking = replace(ambient, history=replace(ambient.history, creepage=-ambient.history.creepage))
    model = ForwardModel(with_traction(braking, mu))
    assert np.all(model.experiment.measured.traction.ratio < 0.0)
    assert identify_friction(model).mu == pytest.approx(mu, rel=1e-9)


def test_more_traction_than_linear_theory_allows_has_no_mu(ambient):
    test = with_traction(ambient, np.full(12, 0.5))
    samples = test.measured.traction
    limit = unworn_law(ambient).slope * samples.creepage[0]
    ratio = samples.ratio.copy()
    ratio[0] = 1.001 * limit
    found = identify_friction(
        ForwardModel(replace(test, measured=replace(test.measured, traction=replace(samples, ratio=ratio))))
    )
    assert found.state[0] == "above_elastic_limit"
    assert np.isinf(found.mu[0])
    ratio[0] = 0.999 * limit
    found = identify_friction(
        ForwardModel(replace(test, measured=replace(test.measured, traction=replace(samples, ratio=ratio))))
    )
    assert found.state[0] == "partial_slip"
    assert found.mu[0] > 10.0


def test_the_saturated_state_begins_at_98_percent():
    mu = np.array([0.5, 0.5, np.inf, np.nan, 0.0, 0.0, 0.0])
    high = np.array([0.6, 0.6, np.inf, np.nan, 0.1, 0.0, np.nan])
    assert states(mu, high, np.array([0.979, 0.981, 1.0, 1.0, 1.0, 1.0, 1.0])) == [
        "partial_slip",
        "saturated",
        "above_elastic_limit",
        None,
        "saturated",
        "against_creepage",
        "against_creepage",
    ]


def test_interval_of_a_mean_is_students():
    # t for 90 % and 4 degrees of freedom: 2.132; the normal's 1.645
    values = np.array([1.0, 2.0, 3.0, 4.0, 5.0, 7.0, 9.0])
    group = np.array([0, 0, 0, 0, 0, 1, 3])
    mean, half = mean_and_interval(values, np.array([np.nan] * 5 + [0.5, np.nan]), group, 4)
    assert mean[[0, 1, 3]] == pytest.approx([3.0, 7.0, 9.0])
    assert np.isnan(mean[2])
    assert half[0] == pytest.approx(2.131847 * np.sqrt(2.5 / 5), rel=1e-6)
    assert half[1] == pytest.approx(1.644854 * 0.5, rel=1e-6)
    assert np.isnan(half[3])


def test_intervals_of_mu_cover_the_truth(ambient):
    mu = np.linspace(0.3, 0.7, 12)
    inside = []
    for seed in range(200):
        found = identify_friction(ForwardModel(with_traction(ambient, mu, samples=6, noise=0.01, seed=seed)))
        inside.append((found.low <= mu) & (mu <= found.high))
    assert 0.88 < np.mean(inside) < 0.92


def test_the_interval_holds_mu_where_the_mean_creepage_errs(ambient):
    """In partial slip an error of the creepage, too, is one of T/N; 90 % of the intervals hold the true mu."""
    history_ = replace(ambient.history, creepage=np.where(ambient.history.step % 2 == 0, 2e-3, 0.03))
    test = replace(ambient, history=history_)
    random = np.random.default_rng(3)
    inside = []
    for seed in range(60):
        made = with_traction(test, np.full(12, 0.5), samples=20, noise=0.002, seed=seed)
        recorded = made.measured.traction.creepage + np.repeat(2e-5 * random.standard_normal(12), 20)
        samples = replace(made.measured.traction, creepage=recorded)
        measured = replace(made.measured, traction=samples, creepage_noise=2e-5 * np.sqrt(20.0))
        found = identify_friction(ForwardModel(replace(made, measured=measured)))
        assert found.state[0] == "partial_slip"
        inside.append((found.low <= 0.5) & (found.high >= 0.5))
    assert 0.87 < np.mean(inside) < 0.93


def test_no_mu_is_given_where_a_step_has_the_other_sign(ambient):
    """A torque that counts the other way round in one step is none that friction makes there."""
    test = with_traction(ambient, np.full(12, 0.5), samples=6, noise=0.01)
    samples = test.measured.traction
    sign = np.where(samples.step == 4, -1.0, 1.0)
    turned = replace(test, measured=replace(test.measured, traction=replace(samples, ratio=sign * samples.ratio)))
    friction = identify_friction(ForwardModel(turned))
    assert friction.state[4] == "against_creepage"
    assert np.isnan([friction.mu[4], friction.low[4], friction.high[4], friction.share[4]]).all()
    assert np.isfinite(np.delete(friction.mu, 4)).all()
    (finding,) = (f for f in findings(turned) if not f.ok and f.rule == "sign")
    assert finding.subject == "T/N of step 5"


@pytest.mark.parametrize(("reversed_", "refused"), [(1.0, True), (0.5, False)])
def test_a_traction_counted_the_other_way_round_is_refused(ambient, reversed_, refused):
    test = with_traction(ambient, np.full(12, 0.5))
    samples = test.measured.traction
    sign = np.where(samples.step < reversed_ * 12, -1.0, 1.0)
    turned = replace(test, measured=replace(test.measured, traction=replace(samples, ratio=sign * samples.ratio)))
    assert against_creepage(turned, turned.measured.traction) == reversed_
    if refused:
        with pytest.raises(MeasurementError, match="100 % of the T/N lie against the creepage"):
            identify_friction(ForwardModel(turned))
    refuse_reversed(test)


def test_interval_is_open_above_where_the_elastic_limit_is_near():
    ratio = np.array([0.39, 0.45])
    found = mu_from_traction(ratio, traction=lambda mu: np.minimum(mu, 0.4 * mu / (mu + 0.1)))
    assert np.isfinite(found[0])
    assert np.isinf(found[1])


def test_a_given_mu_goes_before_an_identified_and_that_before_the_constant(ambient):
    test = with_traction(ambient, np.full(12, 0.5))
    given = np.where(test.history.step == 3, 0.33, np.nan)
    samples = test.measured.traction
    some = samples.step != 7
    fewer = TractionSamples(
        **{key: getattr(samples, key)[some] for key in ("time", "step", "creepage", "ratio", "uncertainty")}
    )
    test = replace(
        test,
        history=replace(test.history, given_mu=given),
        options=replace(test.options, friction_coefficient=0.61),
        measured=replace(test.measured, traction=fewer),
    )
    mu, source, *_ = friction_in_use(ForwardModel(test))
    assert mu[[2, 3, 7]] == pytest.approx([0.5, 0.33, 0.61])
    assert [source[i] for i in (2, 3, 7)] == ["identified", "given", "constant"]


def test_errors_of_steps_add_in_squares_and_those_of_the_zero_add_up():
    """E = E_1 + E_2: its own errors sqrt((3 %)^2 + (4 %)^2) of each half, the zero's 1 % and -0.5 % of each half."""
    friction = FrictionInUse(
        np.full(2, 0.5), ["identified"] * 2, own=np.array([0.06, 0.08]), of_zero=np.array([0.02, -0.01])
    )
    assert friction.error_of(np.array([7.0, 7.0])) == pytest.approx(np.hypot(0.05, 0.005))
    assert friction.error_of(np.zeros(2)) == 0.0


def test_the_error_of_the_energy_is_how_far_it_scatters(ambient):
    energies, errors = [], []
    for seed in range(100):
        model = ForwardModel(with_traction(ambient, np.full(12, 0.5), samples=30, noise=0.03, seed=seed))
        friction = friction_in_use(model)
        of_steps = energy_of_steps(model, friction.mu)
        energies.append(np.sum(of_steps))
        errors.append(friction.error_of(of_steps))
    assert np.std(energies) / np.mean(energies) == pytest.approx(np.mean(errors), rel=0.25)


def test_bisection_follows_the_papers_rule():
    found = bisect_depth(lambda k: 1e-4 * k**0.7, measured_depth=1e-4 * 6e-5**0.7, start=3e-6)
    assert found.converged
    assert abs(found.trail[-1][1]) < 1.0 <= min(abs(error) for _, error in found.trail[:-1])
    assert found.bracket[0] < 6e-5 < found.bracket[1]
    for (k, error), (following, _) in zip(found.trail[:-1], found.trail[1:], strict=True):
        assert (following > k) == (error > 0.0)
    low, high = found.bracket
    assert found.trail[0][0] == pytest.approx(0.5 * (low + high))


def test_bisection_says_where_no_k_reaches_the_depth():
    assert not bisect_depth(lambda _: 1e-6, measured_depth=2e-6, start=1e-4).converged


def test_least_squares_of_a_line_is_the_closed_form():
    rng = np.random.default_rng(3)
    x = np.linspace(0.5, 2.0, 400)
    noise = 0.05 * rng.standard_normal(400)
    found = fit_positive(lambda p: p[:, None] * x, measured=7.0 * x + noise, weights=np.ones(400), start=1.0)
    best = float((x * (7.0 * x + noise)).sum() / (x**2).sum())
    assert found.value == pytest.approx(best, rel=1e-9)
    assert found.std == pytest.approx(0.05 / np.sqrt((x**2).sum()), rel=0.25)
    assert found.rms == pytest.approx(0.05, rel=0.1)


def test_a_rough_model_only_says_where_to_begin():
    x, asked = np.linspace(0.5, 2.0, 40), []

    def line(p):
        asked.append(len(p))
        return p[:, None] * x

    found = fit_positive(line, measured=7.0 * x, weights=np.ones(40), start=1.0, rough=lambda p: 1.3 * p[:, None] * x)
    assert found.value == pytest.approx(7.0, rel=1e-9)
    assert max(asked) == 2


def test_samples_of_no_weight_do_not_count():
    x = np.linspace(0.5, 2.0, 40)
    spoiled = np.where(x > 1.5, 100.0, 3.0 * x)
    found = fit_positive(lambda p: p[:, None] * x, measured=spoiled, weights=(x <= 1.5).astype(float), start=50.0)
    assert found.value == pytest.approx(3.0, rel=1e-9)


def test_standard_error_covers_with_correlated_noise():
    # AR(1) of 0.8: an error that took the samples as independent would be three times too small
    x, inside = np.linspace(0.5, 2.0, 400), []
    for seed in range(150):
        rng = np.random.default_rng(seed)
        noise = np.zeros(400)
        for i in range(1, 400):
            noise[i] = 0.8 * noise[i - 1] + 0.05 * rng.standard_normal()
        found = fit_positive(lambda p: p[:, None] * x, measured=7.0 * x + noise, weights=np.ones(400), start=5.0)
        inside.append(abs(found.value - 7.0) < 2.0 * found.std)
    assert 0.85 < np.mean(inside) <= 1.0


def test_depth_and_width_of_a_facet():
    y = np.linspace(-2e-3, 2e-3, 801)
    height = -np.maximum(6e-6 - y**2 / 0.06, 0.0)
    track = worn_track(y, height, smooth=False)
    assert track.depth == pytest.approx(6e-6, rel=1e-4)
    assert track.width == pytest.approx(2 * np.sqrt(0.95 * 6e-6 * 0.06), rel=1e-3)
    rough = height + 0.2e-6 * np.random.default_rng(1).standard_normal(len(y))
    smoothed = worn_track(y, rough, smooth=True)
    assert smoothed.depth == pytest.approx(6e-6, rel=0.03)
    assert smoothed.width == pytest.approx(track.width, rel=0.03)
    assert worn_track(y, np.zeros_like(y), smooth=False).depth == 0.0
