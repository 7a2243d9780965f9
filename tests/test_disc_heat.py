"""The disc as one heat capacity: closed forms, the balance of energy, and the order of the paper's implicit step."""

import numpy as np
import pytest

from twindisc_cli.physics import disc_heat

DISC = {"capacity": 100.0, "convection": 1.6, "environment": 293.15}


def test_constant_power_is_the_exponential():
    time = np.array([0.0, 10.0, 62.5, 400.0, 5000.0])
    found = disc_heat.respond(time, power=[16.0], duration=[1e4], initial=293.15, **DISC)
    assert found == pytest.approx(293.15 + 10.0 * (1 - np.exp(-time * 1.6 / 100.0)), rel=1e-13)


def test_without_convection_all_heat_stays():
    found = disc_heat.respond(
        [50.0, 300.0],
        power=[8.0, 2.0],
        duration=[100.0, 100.0],
        capacity=100.0,
        convection=0.0,
        environment=77.0,
        initial=77.0,
    )
    assert found == pytest.approx([77.0 + 4.0, 77.0 + 10.0], rel=1e-14)


def test_heat_in_less_heat_out_is_what_the_disc_holds():
    power, duration = np.array([5.0, 30.0, 0.0, 12.0]), np.array([80.0, 40.0, 120.0, 90.0])
    time = np.linspace(0.0, 330.0, 33001)
    warm = disc_heat.respond(time, power=power, duration=duration, initial=300.0, **DISC)
    lost = np.trapezoid(1.6 * (warm - 293.15), time)
    assert 100.0 * (warm[-1] - warm[0]) == pytest.approx(power @ duration - lost, rel=1e-6)


def test_many_parameter_sets_are_each_alone():
    power = np.array([[5.0, 20.0], [1.0, 0.0], [3.0, 3.0]])
    sets = {"capacity": np.array([90.0, 100.0, 110.0]), "convection": np.array([0.0, 1.0, 3.0])}
    time = np.array([0.0, 3.0, 10.0, 15.0, 40.0])
    together = disc_heat.respond(time, power=power, duration=[10.0, 20.0], environment=280.0, initial=290.0, **sets)
    for i in range(3):
        alone = disc_heat.respond(
            time,
            power=power[i],
            duration=[10.0, 20.0],
            environment=280.0,
            initial=290.0,
            capacity=sets["capacity"][i],
            convection=sets["convection"][i],
        )
        assert together[i] == pytest.approx(alone, rel=1e-14)


def test_implicit_step_of_the_paper_is_of_first_order():
    exact = float(disc_heat.advance(320.0, power=40.0, duration=60.0, **DISC))
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
