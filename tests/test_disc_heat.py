"""The disc as one heat capacity: closed forms, the balance of energy, and the order of the paper's implicit step."""

import numpy as np
import pytest
from scipy.linalg import expm

from twindisc_cli.physics import disc_heat

DISC = {"capacity": 100.0, "convection": 1.6, "environment": 293.15}


def test_constant_power_is_the_exponential():
    duration = np.array([10.0, 52.5, 337.5, 4600.0])
    time = np.cumsum(duration)
    found = disc_heat.temperatures(power=16.0, duration=duration, initial=293.15, **DISC)[0]
    assert found == pytest.approx(293.15 + 10.0 * (1 - np.exp(-time * 1.6 / 100.0)), rel=1e-13)


def test_without_convection_all_heat_stays():
    found = disc_heat.temperatures(
        power=[8.0, 2.0], duration=[50.0, 300.0], capacity=100.0, convection=0.0, environment=77.0, initial=77.0
    )[0]
    assert found == pytest.approx([77.0 + 4.0, 77.0 + 10.0], rel=1e-9)


def test_heat_in_less_heat_out_is_what_the_disc_holds():
    power, parts = np.repeat([5.0, 30.0, 0.0, 12.0], 2000), np.repeat([80.0, 40.0, 120.0, 90.0], 2000) / 2000
    warm = disc_heat.temperatures(power=power, duration=parts, initial=300.0, **DISC)[0]
    before = np.concatenate([[300.0], warm[:-1]])
    lost = np.sum(1.6 * (0.5 * (warm + before) - 293.15) * parts)
    assert 100.0 * (warm[-1] - 300.0) == pytest.approx(power @ parts - lost, rel=1e-6)


def test_many_parameter_sets_are_each_alone():
    power, convection = np.array([[5.0, 20.0], [1.0, 0.0], [3.0, 3.0]]), np.array([[0.0], [1.0], [3.0]])
    common = {"duration": [10.0, 20.0], "capacity": 90.0, "environment": 280.0, "initial": 290.0}
    together = disc_heat.temperatures(power=power, convection=convection, **common)
    for i in range(3):
        alone = disc_heat.temperatures(power=power[i], convection=convection[i], **common)[0]
        assert together[i] == pytest.approx(alone, rel=1e-14)


@pytest.mark.parametrize("convection", [1.5, 1e-6, 0.0])
@pytest.mark.parametrize(("conductance", "shaft"), [(0.8, 400.0), (20.0, 20.0), (0.01, 20000.0), (1.5, 100.0)])
def test_a_shaft_is_the_two_body_exponential(convection, conductance, shaft):
    """Disc and shaft through drives and pauses of up to an hour, against the exponential of their matrix."""
    capacity, duration = 100.0, np.array([60.0, 3600.0, 0.5, 900.0, 3600.0])
    power, room = np.array([20.0, 0.0, 300.0, 45.0, 0.0]), np.array([293.15, 290.0, 295.0, 293.15, 288.0])
    found = disc_heat.temperatures(
        power=power, duration=duration, capacity=capacity, convection=convection, environment=room, initial=300.0,
        shaft=disc_heat.Shaft(conductance, shaft),
    )[0]  # fmt: skip
    state, expected = np.array([300.0, 300.0]), []
    for heat, time, outside in zip(power, duration, room, strict=True):
        rates = np.zeros((3, 3))
        rates[:2, :2] = [[-(convection + conductance), conductance], [conductance, -conductance]]
        rates[0, 2] = heat + convection * outside
        rates[:2] /= np.array([[capacity], [shaft]])
        state = (expm(rates * time) @ np.append(state, 1.0))[:2]
        expected.append(state[0])
    assert found == pytest.approx(np.array(expected), abs=1e-8)


def test_disc_and_shaft_keep_the_heat_that_nothing_takes():
    """Without convection both end at one temperature, which holds all the heat."""
    found = disc_heat.temperatures(
        power=[30.0, 0.0], duration=[100.0, 1e6], capacity=100.0, convection=0.0, environment=77.0, initial=300.0,
        shaft=disc_heat.Shaft([[0.5], [0.0]], 400.0),
    )  # fmt: skip
    assert found[0, 1] == pytest.approx(300.0 + 3000.0 / 500.0, rel=1e-12)
    assert found[1] == pytest.approx([330.0, 330.0], rel=1e-8)


def test_implicit_step_of_the_paper_is_of_first_order():
    exact = float(disc_heat.temperatures(power=40.0, duration=[60.0], initial=320.0, **DISC)[0, 0])
    errors = []
    for steps in (50, 100, 200):
        temperature = np.array(320.0)
        for _ in range(steps):
            temperature = disc_heat.implicit_step(temperature, power=40.0, duration=60.0 / steps, **DISC)
        errors.append(abs(float(temperature) - exact))
    assert np.log2(np.array(errors[:-1]) / errors[1:]) == pytest.approx([1.0, 1.0], abs=0.02)


def test_one_implicit_step_is_eq_19():
    later = float(disc_heat.implicit_step(300.0, power=40.0, duration=7.0, **DISC))
    assert later == pytest.approx(300.0 + 7.0 / 100.0 * (40.0 - 1.6 * (later - 293.15)), rel=1e-14)
