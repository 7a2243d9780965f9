"""The fitting problem against linear-Gaussian theory: evidence, covariance, coverage, nuisances; what is shared."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from rigs import (
    HARDNESS,
    LOAD,
    RADIUS,
    ROOM,
    SPEED,
    Floats,
    Instruments,
    Plant,
    experiment,
    history,
    spread,
    traction_samples,
)

from twindisc_cli.effects import catalogue
from twindisc_cli.identify.energy import measured_energy
from twindisc_cli.identify.mass import worn_mass
from twindisc_cli.laws.trial import curve, formula
from twindisc_cli.loop.explain import as_estimated
from twindisc_cli.loop.fit import TYPICAL, Fit, at, fit, linearised, plain_fit, refit, remembered
from twindisc_cli.loop.judge import revised_case
from twindisc_cli.loop.problem import Case, Problem, case_of, parameters_of, problem_of
from twindisc_cli.loop.term_intervals import estimate_of
from twindisc_cli.loop.thresholds import TOLERANCES
from twindisc_cli.loop.tolerances import with_nuisances
from twindisc_cli.model.experiment import MassSamples, Measured, Options, TemperatureSamples, TractionSamples
from twindisc_cli.model.forward import ForwardModel

HISTORY = history((0.02, 0.04, 0.09, 0.03, 0.06, 0.015), 2)
TIME = spread(HISTORY, 5)
SIGMA = 0.004
FALLING = Plant(HISTORY, mu=lambda time, creepage, cycles: 0.6 * (0.5 + 0.5 * np.exp(-4.0 * creepage * SPEED)))


def traction_case(ratio: Floats, *, uncertainty: float = SIGMA, friction: float = np.nan) -> Case:
    samples = traction_samples(HISTORY, TIME, ratio, uncertainty)
    options = Options(friction_coefficient=friction)
    return case_of(experiment(HISTORY, measured=Measured(traction=samples), thermal=None, options=options))


def linear_problem(seed: int, effects: Sequence[str], noise: float = 1.0) -> Problem:
    """mu is given, so that an offset and a drift of the sensor are all there is: a problem linear in its parameters."""
    ratio = 0.6 + 0.015 - 0.03 * TIME / 3600.0 + noise * SIGMA * np.random.default_rng(seed).standard_normal(len(TIME))
    return Problem([traction_case(ratio, friction=0.6)], ("traction",), tuple(effects))


def columns(problem: Problem) -> Floats:
    """White change of the traction per unit of each inner parameter (sample, parameter), written down by hand."""
    by_name = {"torque_offset.offset": np.ones(len(TIME)), "sensor_drift.per_hour": TIME / 3600.0}
    return np.stack([by_name[p.name] * p.scale / SIGMA for p in problem.parameters], axis=1)


# ------------------------------------------------------------------------------------------------ linear theory


@pytest.mark.parametrize("effects", [("torque_offset",), ("sensor_drift",), ("torque_offset", "sensor_drift")])
@pytest.mark.parametrize("seed", range(3))
def test_evidence_of_a_linear_problem_is_its_marginal_likelihood(effects: tuple[str, ...], seed: int) -> None:
    """Against y ~ N(0, 1 + X n (X'X)^-1 X'), the prior as wide as one sample's worth: without (2 pi)^(-n/2).

    |1 + n P| = (1 + n)^k for a projection P of rank k, and of its chi2 a share n / (1 + n) of what P holds is gone.
    """
    problem = linear_problem(seed, effects)
    design, count = columns(problem), len(TIME)
    residual = problem.measured - 0.6 / SIGMA
    reached = design @ np.linalg.solve(design.T @ design, design.T)
    covariance = np.eye(count) + count * reached
    exact = -0.5 * residual @ np.linalg.solve(covariance, residual) - 0.5 * np.linalg.slogdet(covariance)[1]
    slack = 0.5 * residual @ reached @ residual / (1.0 + count) + 0.5 * len(effects) * np.log1p(1.0 / count)
    assert fit(problem).evidence == pytest.approx(exact + slack, abs=1e-4)


@pytest.mark.parametrize("settling", [2e3, 2e4, 2e5])
def test_evidence_of_an_effect_is_its_likelihood_averaged_over_what_shapes_it(settling: float) -> None:
    """Against the average over the prior of the settling cycles, which only the first course fixes.

    In full sliding T/N is mu, so that the size of the excess follows from a line for each number of cycles.
    """
    time, scatter = spread(HISTORY, 250), 7.0 * SIGMA
    cycles = 50.0 * time
    ratio = 0.6 * (1.0 - 0.05 * np.exp(-cycles / settling))
    ratio += scatter * np.random.default_rng(0).standard_normal(len(time))
    measured = Measured(traction=traction_samples(HISTORY, time, ratio, scatter))
    test = experiment(HISTORY, measured=measured, thermal=None, options=Options(friction_coefficient=0.6))
    problem = Problem([case_of(test)], ("traction",), ("running_in_friction",))
    (course,) = (p for p in problem.parameters if p.key == "settling_cycles")
    residual = (ratio - 0.6) / scatter
    columns = np.exp(-cycles / np.geomspace(course.lower, course.upper, 500)[:, None])
    taken = (columns @ residual) ** 2 / np.sum(columns**2, axis=1)
    exact = -0.5 * residual @ residual + np.log(np.mean(np.exp(0.5 * (taken - taken.max())))) + 0.5 * taken.max()
    assert fit(problem).evidence == pytest.approx(exact - 0.5 * np.log(len(time)), abs=0.5)


@pytest.mark.parametrize("seed", range(3))
def test_evidence_of_a_curve_is_its_marginal_likelihood(seed: int) -> None:
    """y ~ N(0, 1 + X X') for the coordinates of a curve, normal of unit variance: Laplace is exact there.

    A curve through two places is a line between them: X = L (hat functions) / s, written down by hand.
    """
    at_places, mix = np.array([0.0, 1008.0]), np.array([[0.02, 0.0], [0.01, 0.015]])
    problem = linear_problem(seed, ())
    trial = curve("traction_ratio", "time", at_places, mix)
    problem = problem.with_terms("a curve", trial={"a curve": trial})
    hats = np.stack([1.0 - TIME / 1008.0, TIME / 1008.0], axis=1)
    design, residual = hats @ mix / SIGMA, problem.measured - 0.6 / SIGMA
    covariance = np.eye(len(TIME)) + design @ design.T
    exact = -0.5 * residual @ np.linalg.solve(covariance, residual) - 0.5 * np.linalg.slogdet(covariance)[1]
    assert fit(problem).evidence == pytest.approx(exact, abs=1e-3)


def test_what_changes_nothing_at_its_bound_does_not_hold_up_the_others() -> None:
    """Discs that do not wear: the patch is Hertz's, whichever share of the half-space's is asked for."""
    alone = linear_problem(4, ("torque_offset", "sensor_drift"))
    beside = linear_problem(4, ("torque_offset", "sensor_drift", "half_space_contact"))
    expected, found = fit(alone), fit(beside)
    assert beside.parameters[-1].upper == beside.start()[-1] and not found.jacobian[:, -1].any()
    assert found.theta[:-1] == pytest.approx(expected.theta, rel=1e-6)
    assert beside.effort.spent <= 4.0 / 3.0 * alone.effort.spent, "as many steps, of one more parameter"


def test_a_linear_fit_is_the_normal_equations() -> None:
    problem = linear_problem(4, ("torque_offset", "sensor_drift"))
    found = fit(problem)
    design = columns(problem)
    expected, left, *_ = np.linalg.lstsq(design, problem.measured - 0.6 / SIGMA, rcond=None)
    assert found.theta == pytest.approx(expected, rel=1e-5)
    assert found.chi2 == pytest.approx(left[0], rel=1e-9)
    assert found.jacobian == pytest.approx(-design, rel=1e-6)
    widths = np.array([TYPICAL * abs(p.inner(p.start)) for p in problem.parameters])
    assert found.covariance == pytest.approx(np.linalg.inv(design.T @ design + np.diag(widths**-2.0)), rel=1e-5)


@pytest.mark.parametrize("seed", [2, 7])
def test_a_linear_interval_is_one_and_two_thirds_standard_deviations(seed: int) -> None:
    """Widened where more is left than the noise, and not narrowed where less is."""
    found = fit(linear_problem(seed, ("torque_offset",)))
    estimate = estimate_of(found, 0)
    wide = max(found.chi2 / (len(TIME) - 1), 1.0)
    std = SIGMA / np.sqrt(len(TIME)) * np.sqrt(wide)
    assert estimate.std == pytest.approx(std, rel=1e-3)
    assert estimate.high - estimate.value == pytest.approx(1.6449 * std, rel=2e-3)
    assert estimate.value - estimate.low == pytest.approx(1.6449 * std, rel=2e-3)


def test_chi2_is_the_number_of_samples_less_that_of_the_parameters() -> None:
    found = [fit(linear_problem(seed, ("torque_offset", "sensor_drift"))).chi2 for seed in range(60)]
    free = len(TIME) - 2
    assert np.mean(found) == pytest.approx(free, abs=4.0 * np.sqrt(2.0 * free / 60))
    assert np.var(found) == pytest.approx(2.0 * free, rel=0.6)


def test_more_parameters_than_the_data_need_are_paid_for() -> None:
    """Occam: with nothing there, an effect costs half the logarithm of the samples but what noise gives it, 1/2."""
    lost = []
    for seed in range(30):
        ratio = 0.6 + SIGMA * np.random.default_rng(seed).standard_normal(len(TIME))
        problem = Problem([traction_case(ratio, friction=0.6)], ("traction",))
        lost.append(fit(problem).evidence - fit(problem.with_terms("torque_offset")).evidence)
    assert np.mean(np.array(lost) > 0.0) > 0.9
    assert np.mean(lost) == pytest.approx(0.5 * np.log(len(TIME)) - 0.5, abs=4.0 * np.sqrt(0.5 / 30))


# ------------------------------------------------------------------------------------------------ coverage


@pytest.mark.long
def test_ninety_percent_intervals_cover() -> None:
    """120 draws of the noise on one test; the noise is estimated anew in each, the laws are not the program's code."""
    truth = {"mu": 0.6, "falling_friction.ratio": 0.5, "falling_friction.decay_s_m": 4.0}
    level, hits = FALLING.traction(TIME), []
    for seed in range(120):
        ratio = level + SIGMA * np.random.default_rng(seed).standard_normal(len(TIME))
        problem = Problem([traction_case(ratio, uncertainty=np.nan)], ("traction",), ("falling_friction",))
        found = as_estimated(refit(problem))
        intervals = {p.name: estimate_of(found, i) for i, p in enumerate(problem.parameters)}
        hits.append([intervals[name].low <= value <= intervals[name].high for name, value in truth.items()])
    covered = np.mean(hits, axis=0)
    assert np.all(covered >= 0.85), covered
    assert np.all(covered <= 0.95), covered


# ------------------------------------------------------------------------------------------------ nuisances


def with_nuisance(problem: Problem) -> tuple[Problem, Fit]:
    found = fit(problem)
    return with_nuisances(problem, found.theta, found.jacobian), found


def test_discount_is_the_inverse_root_of_the_covariance() -> None:
    problem, _ = with_nuisance(Problem([traction_case(FALLING.traction(TIME))], ("traction",)))
    assert problem.nuisance is not None
    root = problem.discount(np.eye(len(TIME)))
    covariance = np.eye(len(TIME)) + problem.nuisance.columns @ problem.nuisance.columns.T
    assert root == pytest.approx(root.T, abs=1e-12)
    assert root @ covariance @ root == pytest.approx(np.eye(len(TIME)), abs=1e-9)


def test_an_input_is_as_far_off_as_the_posterior_of_a_linear_gaussian_model_says() -> None:
    """Drawn from its prior, and one tolerance by itself; the mean by the normal equations."""
    problem, _ = with_nuisance(Problem([traction_case(FALLING.traction(TIME))], ("traction",)))
    assert problem.nuisance is not None
    columns, generator = problem.nuisance.columns, np.random.default_rng(5)
    white = columns @ generator.standard_normal(columns.shape[1]) + generator.standard_normal(len(TIME))
    precision = np.eye(columns.shape[1]) + columns.T @ columns
    expected = np.linalg.solve(precision, columns.T @ white)
    assert problem.nuisance.off(problem.discount(white)) == pytest.approx(expected, abs=1e-9)
    assert len(problem.nuisance.names) == len(expected)


def test_what_base_parameters_imitate_is_no_nuisance() -> None:
    problem, found = with_nuisance(Problem([traction_case(FALLING.traction(TIME))], ("traction",)))
    assert problem.nuisance is not None
    assert np.abs(found.jacobian.T @ problem.nuisance.columns).max() < 1e-6 * np.linalg.norm(found.jacobian)


def test_a_creepage_within_its_tolerance_is_forgiven_and_one_beyond_is_not() -> None:
    """In partial slip T grows with the creepage of a step: an error of one tolerance must cost next to nothing."""
    creeping = history((0.001, 0.0015, 0.002, 0.0012), 3)
    time = spread(creeping, 8)
    costs = []
    tolerance = np.hypot(TOLERANCES.step_creepage[0], TOLERANCES.step_creepage[1] / 0.002)
    for errors in (0.0, tolerance, 12.0 * tolerance):
        off = creeping.creepage * (1.0 + errors * (creeping.step == 2))
        true = experiment(
            replace(creeping, creepage=off),
            thermal=None, measured=Measured(traction=traction_samples(creeping, time, np.zeros(len(time)))),
        )  # fmt: skip
        samples = true.measured.traction
        assert samples is not None
        moved = replace(samples, creepage=off[np.searchsorted(creeping.end_time, time)])
        true = replace(true, measured=Measured(traction=moved))
        base = {"mu": np.array([0.6]), "K": np.zeros(1), "convection_W_K": np.ones(1)}
        ratio = ForwardModel(true).predict(base).traction[0]
        seen = replace(samples, ratio=ratio, uncertainty=np.full(len(time), 2e-4))
        problem = Problem(
            [case_of(experiment(creeping, thermal=None, measured=Measured(traction=seen)))], ("traction",)
        )
        costs.append((fit(problem).chi2, refit(problem).chi2))
    (_, exact), (blind, forgiven), (_, beyond) = costs
    assert exact < 1e-3
    assert forgiven < 1.0 < 0.1 * blind, "an error of one standard deviation costs one at most"
    assert beyond > 15.0


# ------------------------------------------------------------------------------------------------ what is fitted


def test_values_come_back_in_their_own_units() -> None:
    for name, effect in catalogue().items():
        for parameter, declared in zip(parameters_of(name, effect), effect.params, strict=True):
            for value in (declared.lower, declared.start, declared.upper):
                assert parameter.outer(np.array(parameter.inner(value))) == pytest.approx(value, rel=1e-12, abs=1e-15)


def test_wear_coefficient_starts_at_archards() -> None:
    """K = W 2 pi R H / E, with the section of the recorded segment and the energy as it was measured."""
    plant = Plant(HISTORY, wear_coefficient=7e-4)
    case = case_of(Instruments(profile=1e-8, traction=1e-4).record(plant, np.random.default_rng(0)))
    energy = 0.6 * LOAD * SPEED * float(np.sum(HISTORY.creepage * HISTORY.duration))
    assert measured_energy(case.test) == pytest.approx(energy, rel=1e-3)
    assert case.guesses["K"] == pytest.approx(7e-4, rel=0.01)
    assert plant.section(np.inf) == pytest.approx(7e-4 * energy / (2.0 * np.pi * RADIUS * HARDNESS), rel=1e-9)


def test_the_energy_of_yawed_discs_is_that_of_all_forces() -> None:
    """Full slip: T is v / w of mu N, and mu N V w is dissipated, with w^2 = v^2 + yaw^2; T/N of others is the mean."""
    ran = replace(history((0.03, 0.06), 1), yaw=np.array([0.04, 0.08]))
    for measured, energy in (([0, 1], 0.05 + 0.10), ([0], 0.05 + 0.6 * 0.06)):
        step = np.array(measured)
        samples = TractionSamples(np.nan * step, step, ran.creepage[step], 0.36 + 0.0 * step, np.nan * step)
        test = experiment(ran, measured=Measured(traction=samples))
        assert measured_energy(test) == pytest.approx(0.6 * LOAD * SPEED * 84.0 * energy, rel=2e-3)


def test_base_parameters_are_found_from_their_channels() -> None:
    plant = Plant(HISTORY, mu=lambda time, creepage, cycles: 0.45 + 0.0 * time, wear_coefficient=1.5e-3, convection=2.4)
    case = case_of(Instruments(traction=1e-3, profile=5e-8, temperature=0.02).record(plant, np.random.default_rng(1)))
    problem = Problem([case], ("traction", "profile", "temperature"))
    found = fit(problem)
    values = {p.name: found.value(p) for p in problem.parameters}
    assert set(values) == {"mu", "K", "convection_W_K"}
    assert values["mu"][0] == pytest.approx(0.45, abs=4.0 * values["mu"][1])
    assert values["convection_W_K"][0] == pytest.approx(2.4, rel=2e-3)
    assert values["K"][0] == pytest.approx(1.5e-3, rel=0.02), "the chord leaves out the elastic rounding of the edges"


def test_what_is_given_is_not_fitted() -> None:
    plant = Plant(HISTORY)
    test = Instruments().record(plant, np.random.default_rng(2))
    assert test.thermal is not None
    given = replace(
        test, thermal=replace(test.thermal, convection=1.6),
        options=replace(test.options, friction_coefficient=0.6, wear_coefficient=1e-3),
    )  # fmt: skip
    channels = ("traction", "profile", "temperature")
    assert Problem([case_of(given)], channels).parameters == ()
    assert fit(Problem([case_of(given)], channels)).theta.size == 0
    assert [p.name for p in Problem([case_of(test)], ("temperature",)).parameters] == ["convection_W_K"]


def test_two_tests_share_the_material_and_not_the_friction() -> None:
    cases = [
        case_of(Instruments().record(Plant(HISTORY, mu=lambda t, c, n, m=mu: m + 0.0 * t), np.random.default_rng(seed)))
        for seed, mu in enumerate((0.5, 0.6))
    ]
    repeats = Problem(cases, ("traction", "profile", "temperature"))
    assert [p.case for p in repeats.parameters if p.name == "K"] == [0, 1], "K scatters between repeats"
    problem = replace(repeats, unlike=True)
    assert sorted((p.name, p.case) for p in problem.parameters if p.case is not None) == [
        ("convection_W_K", 0), ("convection_W_K", 1), ("mu", 0), ("mu", 1),
    ]  # fmt: skip
    assert [p.name for p in problem.parameters if p.case is None] == ["K"]
    found = fit(problem)
    assert [found.value(p)[0] for p in problem.parameters if p.name == "mu"] == pytest.approx([0.5, 0.6], abs=0.003)
    assert [found.value(p)[0] for p in problem.parameters if p.name == "K"] == pytest.approx([1e-3], rel=0.03)
    for channel, parts in problem.slices.items():
        assert [part.stop - part.start for part in parts] == [len(case.values(channel)) for case in cases]
    assert sum(part.stop - part.start for parts in problem.slices.values() for part in parts) == len(problem.measured)


def test_what_was_fitted_predicts_the_same_when_it_is_declared() -> None:
    """An effect and a law: declared with their values, with the base parameters held, nothing is left to be fitted."""
    case = case_of(Instruments().record(FALLING, np.random.default_rng(3)))
    start = {"size": 0.1, "at_s": 500.0, "width_s": 100.0}
    law = {"heat_over_time": formula("heat", "time", "bump", start, (0.0, 1008.0), 1.0)}
    problem = Problem([case], ("traction", "profile", "temperature"))
    problem = problem.with_terms("falling_friction", "heat_over_time", trial=law)
    found = fit(problem)
    (declared,) = remembered([revised_case(case, found)], found)
    again = Problem([declared], ())
    assert again.parameters == ()
    assert declared.test.effects["falling_friction"]["ratio"] == pytest.approx(0.5, abs=0.05)
    assert declared.test.laws["heat_over_time"].shape == "bump"
    one, two = problem.predict(found.theta[None])[0], again.predict(np.empty((1, 0)))[0]
    for channel in problem.channels:
        before, after = getattr(one, channel), getattr(two, channel)
        assert after == pytest.approx(before, abs=1e-6 * max(float(np.ptp(before)), 1e-6))


def test_a_parameter_pressed_against_its_bound_is_told() -> None:
    """An offset of the torque beyond what its file allows, and one well inside."""
    bound = catalogue()["torque_offset"].params[0].upper
    for offset, told in ((bound + 0.1, ("torque_offset.offset",)), (0.5 * bound, ())):
        case = traction_case(0.3 + offset + 0.0 * TIME, friction=0.3)
        assert fit(Problem([case], ("traction",), ("torque_offset",))).at_bound == told


def test_a_fit_ends_where_it_is_said_to() -> None:
    problem = Problem([traction_case(FALLING.traction(TIME))], ("traction",), ("falling_friction",))
    found = fit(problem)
    there = at(problem, found.theta)
    assert there.chi2 == pytest.approx(found.chi2, rel=1e-12)
    assert there.evidence == pytest.approx(found.evidence, rel=1e-9)
    assert found.chi2 < 0.01
    values = [found.value(p)[0] for p in problem.parameters]
    assert values == pytest.approx([0.6, 0.5, 4.0], rel=0.01)


def test_where_the_passes_begin_changes_nothing_that_is_fitted() -> None:
    """Friction and convection that follow the temperature, begun where other parameters have settled."""
    case = case_of(Instruments(channels=("traction", "temperature")).record(FALLING, np.random.default_rng(3)))
    terms = ("temperature_dependent_friction", "nonlinear_convection")
    problem = Problem([case], ("traction", "temperature"), terms)
    theta, target = problem.start(), problem.discount(problem.measured)
    *_, elsewhere = linearised(problem, theta + 0.1, target)
    cold, warm = linearised(problem, theta, target), linearised(problem, theta, target, elsewhere)
    assert all(state is not None and len(state.energy) == 1 for state in elsewhere)
    assert warm[0] == pytest.approx(cold[0], abs=1e-3)
    assert warm[1] == pytest.approx(cold[1], abs=1e-3 * float(np.abs(cold[1]).max()))


def test_a_fit_where_every_strip_wears_by_its_own_k_ends_where_nothing_is_to_be_had() -> None:
    """On the track that belongs to its parameters a step of Gauss and Newton would lower chi2 by less than 0.05."""
    case = case_of(Instruments(channels=("traction", "profile")).record(FALLING, np.random.default_rng(3)))
    problem = Problem([case], ("traction", "profile"), ("falling_friction", "severe_wear_transition"))
    fitted = fit(problem)
    here = at(problem, fitted.theta)
    assert here.chi2 == pytest.approx(fitted.chi2, abs=0.01)
    slope = here.jacobian.T @ here.residual
    assert not here.pressed.any()
    assert slope @ here.covariance @ slope < 0.05


def test_profile_and_weighings_share_the_wear_coefficient_by_their_weights() -> None:
    """Weighings that are a fifth too heavy, uncertain by as much, beside a profile that is known to a few per cent."""
    plant = Plant(HISTORY)
    test = Instruments(profile=0.1e-6).record(plant, np.random.default_rng(5))
    test = replace(test, rig=replace(test.rig, disc2=replace(test.rig.disc2, density=7850.0)))
    alone = plain_fit(problem_of([test]))
    (K,) = (i for i, p in enumerate(alone.problem.parameters) if p.key == "K")
    stops = np.array([4, 8, 12])
    mass = MassSamples(stops, np.zeros(3), np.full(3, 2), np.ones(3))
    model = ForwardModel(replace(test, measured=replace(test.measured, mass=mass)))
    lost = worn_mass(model, model.predict({key: np.array([value]) for key, value in alone.base(0).items()}))[0]
    mass = replace(mass, loss=1.2 * lost, uncertainty=np.full(3, 0.2 * lost[-1]))
    problem = problem_of([replace(test, measured=replace(test.measured, mass=mass))])
    assert ("profile", "mass") in problem.sharing
    assert sorted(name for group in problem.sharing for name in group) == sorted(problem.channels)
    both = plain_fit(problem)
    assert both.theta[K] == pytest.approx(alone.theta[K], abs=1.5 * np.sqrt(alone.covariance[K, K]))
    assert both.theta[K] > alone.theta[K]


def test_channels_that_an_effect_couples_agree_in_the_end() -> None:
    """With mu that falls with the temperature: mu and the convection that made the record, whatever they start from."""
    effects = {"temperature_dependent_friction": {"per_kelvin": -0.007}}
    plain = experiment(HISTORY, effects=effects)
    samples = traction_samples(HISTORY, TIME, 0.0 * TIME, SIGMA)
    warm = TemperatureSamples(TIME, np.full(len(TIME), ROOM))
    test = replace(plain, measured=Measured(traction=samples, temperature=warm))
    true = ForwardModel(test).predict({"mu": np.array([0.5]), "convection_W_K": np.array([1.5])})
    noise = 0.01 * np.random.default_rng(1).standard_normal(len(TIME))
    made = replace(samples, ratio=true.traction[0]), replace(warm, temperature=true.temperature[0] + noise)
    test = replace(test, measured=Measured(traction=made[0], temperature=made[1]))
    without = plain_fit(problem_of([replace(test, effects={})]))
    fitted = plain_fit(problem_of([test]), without)
    assert without.base(0)["convection_W_K"] > 1.55
    assert fitted.base(0)["mu"] == pytest.approx(0.5, rel=2e-3)
    assert fitted.base(0)["convection_W_K"] == pytest.approx(1.5, rel=2e-3)
