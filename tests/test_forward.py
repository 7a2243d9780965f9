"""The forward model against closed forms: full sliding, linear theory, heating, and balances of energy and volume."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from rigs import HARDNESS, LOAD, RADIUS, ROOM, SPEED, experiment, history, rig, running, spread, traction_samples

from twindisc_cli.laws.law import Law
from twindisc_cli.model.base import BaseParameters
from twindisc_cli.model.experiment import (
    Contact,
    Experiment,
    History,
    Measured,
    Options,
    ProfileSamples,
    TemperatureSamples,
    TractionSamples,
)
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.model.prediction import Prediction

Floats = np.ndarray[Any, np.dtype[np.float64]]
SLIDING = history((0.03, 0.05, 0.08, 0.05), (2, 2, 3, 2))
CREEPING = history((0.0008, 0.002, 0.0035, 0.001), 2)
ACROSS = np.linspace(-1.5e-3, 1.5e-3, 301)
STOPS = (3, 7, 9)
CIRCUMFERENCE_HARDNESS = 2.0 * np.pi * RADIUS * HARDNESS


def measured(course: History, each: int = 5, stops: tuple[int, ...] = (), **changes: Any) -> Experiment:
    """A test sampled so many times an iteration; the values do not matter to the model."""
    time = spread(course, each)
    depth = np.minimum(ACROSS**2 - 0.6e-3**2, 0.0) / (2.0 * RADIUS)
    profile = ProfileSamples(
        np.tile(ACROSS, len(stops)), np.tile(depth, len(stops)),
        np.full(len(ACROSS) * len(stops), 2), np.repeat(stops, len(ACROSS)),
    )  # fmt: skip
    recorded = Measured(
        traction=traction_samples(course, time, np.full(len(time), 0.5)),
        profile=profile if stops else None,
        temperature=TemperatureSamples(time, np.full(len(time), 300.0)),
    )
    return experiment(course, measured=recorded, **changes)


def predict(test: Experiment, effects: dict[str, dict[str, float]] | None = None, **base: float) -> Prediction:
    """One prediction, mu 0.6, K 2e-4 and hS 1.6 W/K unless given."""
    values = {"mu": 0.6, "K": 2e-4, "convection_W_K": 1.6, **base}
    switched = {name: {key: np.array([v]) for key, v in table.items()} for name, table in (effects or {}).items()}
    return ForwardModel(test).predict({key: np.array([v]) for key, v in values.items()}, switched)


def sliding_energy(course: History, until: float | None = None, mu: float = 0.6) -> float:
    """mu N v V t [J] over whole iterations."""
    kept = course.end_time <= (until or np.inf) + 1e-6
    return float(np.sum(mu * LOAD * course.creepage[kept] * SPEED * course.duration[kept]))


def exponential(course: History, time: Floats, capacity: float = 100.0, convection: float = 1.6) -> Floats:
    """Disc temperature of Eq. 18 under mu N v V, step by step in closed form."""
    found, start = np.empty(len(time)), ROOM
    begin = course.end_time - course.duration
    for first, last, creepage in zip(begin, course.end_time, course.creepage, strict=True):
        level = ROOM + 0.6 * LOAD * creepage * SPEED / convection
        here = (time > first) & (time <= last)
        found[here] = level + (start - level) * np.exp(-(time[here] - first) * convection / capacity)
        start = level + (start - level) * np.exp(-(last - first) * convection / capacity)
    return found


# ------------------------------------------------------------------------------------------------ full sliding


def test_full_sliding_is_coulomb_with_its_power_and_energy() -> None:
    found = predict(measured(SLIDING))
    assert found.traction[0] == pytest.approx(np.full(found.traction.shape[1], 0.6), rel=1e-9)
    creepage = SLIDING.creepage[ForwardModel(measured(SLIDING)).points.iteration]
    assert found.state.power[0] == pytest.approx(0.6 * LOAD * creepage * SPEED, rel=1e-9)
    assert found.state.energy[0, -1] == pytest.approx(sliding_energy(SLIDING), rel=1e-9)


@pytest.mark.parametrize("contact", ["hertz", "half_space"])
def test_worn_volume_is_archard_at_every_stop(contact: Any) -> None:
    test = measured(SLIDING, stops=STOPS, options=Options(contact=contact))
    height = predict(test).profile[0].reshape(len(STOPS), -1)
    ends = SLIDING.end_time[np.array(STOPS) - 1]
    expected = [2e-4 * sliding_energy(SLIDING, end) / CIRCUMFERENCE_HARDNESS for end in ends]
    assert -np.trapezoid(height, ACROSS, axis=1) == pytest.approx(expected, rel=2e-3)
    assert predict(test).section[0, -1] == pytest.approx(expected[-1], rel=1e-9)


def test_where_k_is_uniform_the_profile_knows_only_k_times_energy() -> None:
    """Two histories and two K with one K E; mu counts only through E, which rises with it in full sliding."""
    other = history((0.09, 0.02), (4, 3))
    scale = sliding_energy(SLIDING) / sliding_energy(other)
    one = predict(measured(SLIDING, stops=(9,)))
    two = predict(measured(other, stops=(7,)), K=2e-4 * scale)
    assert two.profile == pytest.approx(one.profile, abs=1e-6 * np.ptp(one.profile))
    half = predict(measured(SLIDING, stops=(9,)), K=4e-4, mu=0.3)
    assert half.profile == pytest.approx(one.profile, abs=1e-6 * np.ptp(one.profile))


def test_temperature_is_the_exponential_of_every_step_however_it_is_sampled() -> None:
    for each in (1, 7):
        test = measured(SLIDING, each)
        assert test.measured.temperature is not None
        closed = exponential(SLIDING, test.measured.temperature.time)
        assert predict(test).temperature[0] == pytest.approx(closed, abs=1e-8)


def test_energy_of_partial_slip_is_traction_times_sliding() -> None:
    found = predict(measured(CREEPING, each=1), K=0.0)
    assert np.all(found.traction[0] < 0.6)
    each = np.sum(found.traction[0] * LOAD * CREEPING.creepage * SPEED * CREEPING.duration)
    assert found.state.energy[0, -1] == pytest.approx(each, rel=1e-9)


# ------------------------------------------------------------------------------------------------ partial slip


def test_small_creepage_is_linear_theory() -> None:
    """T = G a b C11 v, of CONTACT (2025-07-23, rev 2707): a b = 0.170591303 * 0.270524050 mm2 and C11 = 3.9388 at 72 N.

    FASTSIM's first correction is of the order of the creepage over that of saturation.
    """
    course = history((1e-6, 1e-5, 2e-5), 1)
    found = predict(measured(course, each=1), K=0.0)
    slope = 79.3e9 * 0.170591303e-3 * 0.270524050e-3 * 3.9388 / LOAD * (206.0 / (79.3 * 2.6)) ** (1 / 3)
    assert found.traction[0] / course.creepage == pytest.approx(np.full(3, slope), rel=0.01)
    assert found.traction[0, 2] / found.traction[0, 1] == pytest.approx(2.0, rel=0.005)


@pytest.mark.parametrize(("yaw", "expected"), [(1.0, 18.640139), (-1.0, 18.787739)])
def test_misalignment_is_contacts_exact_theory_with_its_sign(yaw: float, expected: float) -> None:
    """CONTACT rev 2707, 0.2 % along, yaw of either sign, spin 13.965 rad/m, mu = 0.6, 72 N; its grid errs by 0.3 %."""
    test = measured(history((0.002,), 1), each=1, options=Options(traction="exact"))
    found = predict(test, {"misalignment": {"yaw_mrad": yaw, "tilt_mrad": 1e3 * 13.964966 * RADIUS}}, K=0.0, mu=0.6)
    assert found.traction[0, 0] * LOAD == pytest.approx(expected, abs=0.007 * 0.6 * LOAD)


def test_yaw_against_tilt_transmits_more_than_yaw_with_it() -> None:
    """CONTACT: 18.64 N with both of one sign, 18.79 N with opposite signs."""
    test = measured(history((0.002,), 1), each=1, options=Options(traction="exact"))
    given = {"tilt_mrad": 1e3 * 13.964966 * RADIUS}
    one, other = (
        float(predict(test, {"misalignment": {"yaw_mrad": yaw, **given}}, K=0.0, mu=0.6).traction[0, 0]) * LOAD
        for yaw in (1.0, -1.0)
    )
    assert 0.05 < other - one < 0.3


def test_a_layer_only_softens_what_sticks() -> None:
    layer = {"third_body_layer": {"slope_ratio": 0.5}}
    course = history((1e-5, 0.05), 1)
    ratio = predict(measured(course, each=1), layer, K=0.0).traction / predict(measured(course, each=1), K=0.0).traction
    assert ratio[0] == pytest.approx([0.5, 1.0], rel=0.01)


def test_two_slope_factors_are_polachs_curve() -> None:
    """Polach (2005) over his law without factors; initial slope k_A (1 + r) / 2, and all slides in the end."""
    course = history((1e-5, 0.003, 0.05, 30.0), 1)
    factors = {"two_slope_factors": {"adhesion": 0.6, "slip_to_adhesion": 0.3}}
    layer = {"third_body_layer": {"slope_ratio": 0.6}}
    found, plain, soft = (predict(measured(course, each=1), e, K=0.0).traction[0] for e in (factors, {}, layer))
    assert found[0] / plain[0] == pytest.approx(0.6 * 1.3 / 2.0, rel=0.01)
    assert found[3] == pytest.approx(0.6, rel=0.003)
    # G a b C11 v / (mu N) as above, times pi / 4 and k_A
    e = 0.6 * 0.25 * np.pi * (plain[0] / 1e-5) * course.creepage / 0.6
    polach = [e / (1.0 + e**2) + np.arctan(r * e) for r in (0.3, 1.0)]
    assert found / soft == pytest.approx(polach[0] / polach[1], rel=0.003)


def test_saturating_friction_is_one_less_an_exponential_once_all_slides() -> None:
    course = history((0.05, 0.1, 0.2), 1)
    found = predict(measured(course, each=1), {"saturating_friction": {"rise_percent": 10.0}}, K=0.0).traction[0]
    assert found == pytest.approx(0.6 * (1.0 - np.exp(-np.array([0.5, 1.0, 2.0]))), rel=0.005)


def test_a_film_that_shears_by_eyring_grows_with_the_logarithm_of_the_sliding_speed() -> None:
    course = history((0.02, 0.04, 0.08), 1)
    film = {"share": 1.0, "eyring_speed_m_s": 1e-3, "slope_ratio": 1.0}
    first, middle, last = predict(measured(course, each=1), {"lubricated_film": film}, K=0.0).traction[0]
    assert last - middle == pytest.approx(middle - first, rel=1e-3)
    # asinh(x) = ln(2 x) where x is large; mu_0 is the friction at a tenth of the rolling speed
    assert (last - middle) / 0.6 == pytest.approx(np.log(2.0) / np.log(2.0 * 0.1 * SPEED / 1e-3), rel=1e-3)


def test_traction_turns_with_the_creepage_and_heats_either_way() -> None:
    ahead, behind = (
        predict(measured(replace(CREEPING, creepage=sign * CREEPING.creepage)), K=0.0) for sign in (1.0, -1.0)
    )
    assert behind.traction == pytest.approx(-ahead.traction, rel=1e-12)
    assert behind.temperature == pytest.approx(ahead.temperature, rel=1e-12)
    still = predict(measured(history((0.0, 0.0), 1)))
    assert np.all(still.traction == 0.0)
    assert still.temperature == pytest.approx(np.full(still.temperature.shape, ROOM), abs=1e-9)


def test_a_worn_patch_is_stiffer() -> None:
    fresh, worn = (predict(measured(CREEPING), K=k).traction[0] for k in (0.0, 0.05))
    assert np.all(worn >= fresh)
    assert worn[-1] > 1.05 * fresh[-1]


# ------------------------------------------------------------------------------------------------ time steps


def test_twice_the_samples_give_the_same_test() -> None:
    """Half steps and double steps agree where traction, wear and temperature feed each other."""
    effects = {"temperature_dependent_friction": {"per_kelvin": -0.01}}
    course = history((0.001, 0.03, 0.002, 0.004), 2)
    coarse, fine = (measured(course, each, stops=(8,)) for each in (4, 32))
    one, two = (predict(test, effects, K=2e-3) for test in (coarse, fine))
    assert coarse.measured.traction is not None
    assert fine.measured.traction is not None
    at = [np.interp(course.end_time, t, v[0]) for t, v in (
        (coarse.measured.traction.time, one.traction), (fine.measured.traction.time, two.traction),
    )]  # fmt: skip
    assert one.state.energy[0, -1] == pytest.approx(two.state.energy[0, -1], rel=0.02)
    assert at[0] == pytest.approx(at[1], abs=0.01)
    assert one.profile == pytest.approx(two.profile, abs=0.02 * np.ptp(two.profile))


@pytest.mark.parametrize("per_kelvin", [-0.06, -0.02, 0.005])
def test_friction_that_depends_on_the_heat_it_makes(per_kelvin: float) -> None:
    course = history((0.03, 0.09, 0.05), 2)
    test = measured(course, each=8)
    rise = warming_in_small_steps(test, lambda warming: 0.6 * np.exp(per_kelvin * warming))
    found = predict(test, {"temperature_dependent_friction": {"per_kelvin": per_kelvin}}, K=0.0)
    assert found.temperature[0] - ROOM == pytest.approx(rise, abs=0.012 * rise.max())
    assert found.traction[0] == pytest.approx(0.6 * np.exp(per_kelvin * rise), abs=0.003)


@pytest.mark.parametrize(("size", "width"), [(-0.45, 1.5), (-0.88, 1.5), (-0.7, 0.7)])
def test_friction_that_falls_steeply_at_a_temperature(size: float, width: float) -> None:
    """The disc then stays near that temperature, and each pass settles the next few points only."""
    creepages = (0.01, 0.03, 0.09, 0.015, 0.15, 0.06, 0.24, 0.025, 0.12, 0.045, 0.09, 0.24, 0.06)
    test = measured(history(creepages, 2), each=8)
    rise = warming_in_small_steps(test, lambda warming: 0.6 * (1.0 + size / (1.0 + np.exp((30.0 - warming) / width))))
    law = Law("mu", "temperature", "logistic", {"size": size, "at_C": 50.0, "width_C": width})
    found = predict(replace(test, laws={"mu_over_temperature": law}), K=0.0)
    assert found.temperature[0] - ROOM == pytest.approx(rise, abs=0.03 * rise.max())


def warming_in_small_steps(test: Experiment, mu: Callable[[float], float]) -> Floats:
    """C dT/dt = mu(T - T_0) N v V - hS (T - T_0) in 20 ms steps of Euler, at the samples of the temperature [K]."""
    course, step = test.history, 0.02
    instants = np.arange(0.0, course.end_time[-1], step)
    creepage = course.creepage[running(course, instants + 0.5 * step)]
    rise = np.zeros(len(instants) + 1)
    for i, sliding in enumerate(creepage * SPEED):
        rise[i + 1] = rise[i] + step / 100.0 * (mu(rise[i]) * LOAD * sliding - 1.6 * rise[i])
    assert test.measured.temperature is not None
    return np.interp(test.measured.temperature.time, np.append(instants, course.end_time[-1]), rise)


# ------------------------------------------------------------------------------------------------ effects


def test_load_error_is_a_larger_load_over_the_nominal_one() -> None:
    test = measured(SLIDING, stops=(9,))
    plain, heavier = predict(test), predict(test, {"load_error": {"error_percent": 10.0}})
    assert heavier.traction == pytest.approx(1.1 * plain.traction, rel=1e-9)
    assert heavier.state.energy[0, -1] == pytest.approx(1.1 * sliding_energy(SLIDING), rel=1e-9)
    own = predict(replace(test, rig=rig(load=1.1 * LOAD)))
    assert heavier.profile == pytest.approx(own.profile, abs=0.01 * np.ptp(own.profile))


def test_declared_and_passed_effects_are_one_thing_and_passing_wins() -> None:
    falling = {"falling_friction": {"ratio": 0.4, "decay_s_m": 2.0}, "torque_offset": {"offset": 0.02}}
    test = measured(SLIDING)
    passed, declared = predict(test, falling), predict(replace(test, effects=falling))
    assert np.array_equal(passed.traction, declared.traction)
    assert np.array_equal(passed.temperature, declared.temperature)
    closed = 0.6 * (0.4 + 0.6 * np.exp(-2.0 * SLIDING.creepage[running(SLIDING, spread(SLIDING, 5))] * SPEED)) + 0.02
    assert passed.traction[0] == pytest.approx(closed, rel=1e-9)
    other = predict(replace(test, effects=falling), {"torque_offset": {"offset": 0.0}})
    assert other.traction[0] == pytest.approx(closed - 0.02, rel=1e-9)


def test_parameter_sets_do_not_know_of_each_other() -> None:
    test = measured(history((0.002, 0.05, 0.003), 2), stops=(6,))
    model = ForwardModel(test)
    mu, K, wander = np.array([0.2, 0.6, 0.4]), np.array([1e-4, 3e-4, 1e-3]), np.array([0.0, 0.03, 0.12])
    share, lag = np.array([1.0, 0.0, 0.5]), np.array([0.0, 30.0, 200.0])
    together = model.predict(
        {"mu": mu, "K": K, "convection_W_K": np.full(3, 1.6)},
        {"lateral_wander": {"std_mm": wander}, "half_space_contact": {"share": share},
         "thermocouple_lag": {"time_constant_s": lag}},
    )  # fmt: skip
    for i in range(3):
        alone = predict(
            test, {"lateral_wander": {"std_mm": wander[i]}, "half_space_contact": {"share": share[i]},
                   "thermocouple_lag": {"time_constant_s": lag[i]}}, mu=mu[i], K=K[i],
        )  # fmt: skip
        for channel in ("traction", "temperature"):
            assert getattr(together, channel)[i] == pytest.approx(getattr(alone, channel)[0], rel=1e-6)
        # the surface is sampled on strips that hold the widest track of all sets: equal to a strip's own rounding
        assert together.profile[i] == pytest.approx(alone.profile[0], abs=3e-3 * np.ptp(alone.profile))


def test_mu_of_every_iteration_and_creepage_off_nominal() -> None:
    test = measured(SLIDING)
    mu = np.linspace(0.3, 0.7, len(SLIDING.step))
    base = {"mu": mu[None], "K": np.zeros(1), "convection_W_K": np.ones(1)}
    at = running(SLIDING, spread(SLIDING, 5))
    assert ForwardModel(test).predict(base).traction[0] == pytest.approx(mu[at], rel=1e-9)
    factors = np.linspace(0.9, 1.1, len(SLIDING.step))
    off = ForwardModel(test).predict({**base, "creepage_factor": factors[None]})
    expected = np.sum(mu * LOAD * SLIDING.creepage * factors * SPEED * SLIDING.duration)
    assert off.state.energy[0, -1] == pytest.approx(expected, rel=1e-9)


def test_a_shaft_takes_heat_as_two_bodies_do() -> None:
    """Two heat capacities joined by G under constant power: the eigenvalues of the linear system."""
    course = history((0.05,), 5)
    test = measured(course, each=24)
    assert test.measured.temperature is not None
    capacity, convection, joint, shaft = 100.0, 1.6, 0.6, 800.0
    rates = np.array([[-(convection + joint) / capacity, joint / capacity], [joint / shaft, -joint / shaft]])
    steady = np.linalg.solve(rates, [-0.6 * LOAD * 0.05 * SPEED / capacity, 0.0])
    values, vectors = np.linalg.eig(rates)
    weights = np.linalg.solve(vectors, -steady)
    closed = ROOM + steady[0] + np.exp(test.measured.temperature.time[:, None] * values) @ (weights * vectors[0])
    found = predict(test, {"shaft_conduction": {"conductance_W_K": joint, "shaft_capacity_J_K": shaft}})
    assert found.temperature[0] == pytest.approx(closed, abs=1e-8)


def test_an_environment_that_drifts_is_followed_with_the_lag_of_the_disc() -> None:
    """T - T_0 = c [t - tau (1 - exp(-t / tau))], tau = C / hS."""
    course = history((0.05,), 20)
    test = measured(course, each=12)
    assert test.measured.temperature is not None
    time, tau, rate = test.measured.temperature.time, 100.0 / 1.6, 6.0 / 3600.0
    found = predict(test, {"ambient_drift": {"K_per_hour": 6.0}}, mu=1e-9)
    closed = ROOM + rate * (time - tau * (1.0 - np.exp(-time / tau)))
    assert found.temperature[0] == pytest.approx(closed, abs=0.02)


@pytest.mark.parametrize("lag", [20.0, 60.0, 300.0])
def test_a_thermocouple_is_a_first_order_lag(lag: float) -> None:
    """Two lags in a row: T = T_0 + A [1 - (tau e^(-t / tau) - lag e^(-t / lag)) / (tau - lag)], tau = C / hS."""
    test = measured(history((0.05,), 5), each=12)
    assert test.measured.temperature is not None
    time, tau = test.measured.temperature.time, 100.0 / 1.6
    rise = 0.6 * LOAD * 0.05 * SPEED / 1.6
    closed = ROOM + rise * (1.0 - (tau * np.exp(-time / tau) - lag * np.exp(-time / lag)) / (tau - lag))
    found = predict(test, {"thermocouple_lag": {"time_constant_s": lag}})
    assert found.temperature[0] == pytest.approx(closed, abs=0.02)


@pytest.mark.parametrize("offset", [40.0, -40.0])
def test_a_clock_that_is_off_records_another_time(offset: float) -> None:
    """T_r = T_0 + A [1 - exp(-(t - t_0) / tau)] after t_0, tau = C / hS; T_0 before."""
    test = measured(history((0.05,), 5), each=24)
    assert test.measured.temperature is not None
    time = test.measured.temperature.time
    rise, tau = 0.6 * LOAD * 0.05 * SPEED / 1.6, 100.0 / 1.6
    closed = ROOM + rise * -np.expm1(-np.maximum(time - offset, 0.0) / tau)
    found = predict(test, {"clock_offset": {"offset_s": offset}})
    recorded = time - offset < time[-1]
    assert found.temperature[0][recorded] == pytest.approx(closed[recorded], abs=0.03)


# ------------------------------------------------------------------------------------------------ what is not there


def test_a_test_without_heat_or_profile_is_predicted_all_the_same() -> None:
    time = spread(SLIDING, 2)
    samples = traction_samples(SLIDING, time, np.full(len(time), 0.5))
    found = predict(experiment(SLIDING, thermal=None, measured=Measured(traction=samples)))
    assert found.traction[0] == pytest.approx(np.full(len(time), 0.6))
    assert found.profile.shape == found.temperature.shape == (1, 0)
    nothing = predict(experiment(SLIDING))
    assert nothing.traction.shape == (1, 0)
    assert nothing.state.energy[0, -1] == pytest.approx(sliding_energy(SLIDING))


def test_what_is_not_asked_of_the_profile_changes_nothing_else() -> None:
    test = measured(history([0.002, 0.02], 2), stops=(2, 4), options=Options(contact="half_space"))
    base = {"mu": np.array([0.6]), "K": np.array([6e-5]), "convection_W_K": np.array([1.6])}
    effects = {"torque_offset": {"offset": np.array([0.01])}, "lateral_offset": {"offset_mm": np.array([0.1])}}
    whole, part = (ForwardModel(test).predict(base, effects, profiled=profiled) for profiled in (True, False))
    assert whole.profile.size > 0
    assert part.profile.size == 0
    for name in ("traction", "temperature", "section"):
        np.testing.assert_array_equal(getattr(part, name), getattr(whole, name))


def test_a_sample_at_another_creepage_neither_wears_nor_warms() -> None:
    time = spread(SLIDING, 2)
    samples = traction_samples(SLIDING, time, np.full(len(time), 0.5))
    aside = replace(samples, creepage=np.where(np.arange(len(time)) == 4, 1e-4, samples.creepage))
    plain, other = (predict(experiment(SLIDING, measured=Measured(traction=s))) for s in (samples, aside))
    assert other.traction[0, 4] < 0.1
    assert np.delete(other.traction[0], 4) == pytest.approx(np.delete(plain.traction[0], 4), rel=1e-12)
    assert other.state.energy[0, -1] == pytest.approx(plain.state.energy[0, -1], rel=1e-12)


def test_samples_without_times_see_the_creepage_of_their_step() -> None:
    step = np.array([0, 1, 2, 3])
    untimed = TractionSamples(np.full(4, np.nan), step, CREEPING.step_creepage, np.full(4, 0.3), np.full(4, np.nan))
    found = predict(experiment(CREEPING, measured=Measured(traction=untimed)), K=0.0)
    timed = predict(measured(CREEPING, each=1), K=0.0)
    assert found.traction[0] == pytest.approx(timed.traction[0, 1::2], rel=1e-9)


@pytest.mark.parametrize("contact", ["hertz", "half_space"])
def test_a_track_worn_beyond_the_tables_of_the_exact_theory_is_still_predicted(contact: Contact) -> None:
    """A patch far more than twenty times as wide as long: full sliding is mu whatever the ratio of the axes."""
    test = measured(SLIDING, options=Options(contact=contact, traction="exact"))
    assert predict(test, K=0.01).traction[0] == pytest.approx(np.full(5 * len(SLIDING.step), 0.6), rel=1e-3)


def test_without_a_convection_nothing_is_known_of_the_temperature_and_the_rest_stays():
    model = ForwardModel(measured(SLIDING, stops=STOPS))
    mu, wear = np.full(3, 0.6), np.full(3, 2e-4)
    cold = {"per_kelvin": np.full(3, -0.01)}
    found = model.predict(BaseParameters(mu, wear, np.array([1.6, np.nan, 3.2])))
    assert np.all(np.isnan(found.temperature[1]))
    assert np.all(np.isfinite(found.temperature[[0, 2]]))
    assert found.temperature[2] == pytest.approx(
        model.predict(BaseParameters(mu, wear, np.full(3, 3.2))).temperature[2]
    )
    assert found.traction[1] == pytest.approx(found.traction[0], abs=1e-12)
    assert found.profile[1] == pytest.approx(found.profile[0], abs=1e-15)
    left_out = model.predict(BaseParameters(mu, wear), {"temperature_dependent_friction": cold})
    assert left_out.traction == pytest.approx(found.traction, abs=1e-12)


def test_without_a_wear_coefficient_nothing_is_known_of_the_profile_and_the_contact_is_unworn():
    model = ForwardModel(measured(CREEPING, stops=(3,)))
    found = model.predict(BaseParameters(np.full(2, 0.6), np.array([np.nan, 0.0]), np.full(2, 1.6)))
    assert np.all(np.isnan(found.profile[0]))
    assert np.all(found.profile[1] == 0.0)
    assert np.array_equal(found.traction[0], found.traction[1])
    assert np.array_equal(found.temperature[0], found.temperature[1])
