"""The public interface: its examples run, it says what it holds, and it is what the commands compute."""

from __future__ import annotations

import doctest
import inspect
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from rigs import Instruments, Plant, history, rig

import twindisc_cli
from twindisc_cli import api, creep_curve, disc_temperature, experiment, identify_friction, wear_track
from twindisc_cli.identify.steps import identify_friction as by_command
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.physics import kalker

NAMES = sorted(set(twindisc_cli.__all__) - {"__version__"})
SPHERES = rig()


def test_every_example_runs() -> None:
    found = doctest.testmod(api)
    assert found.attempted >= 25
    assert found.failed == 0


def test_what_is_public_is_declared_in_both_places() -> None:
    assert sorted(api.__all__) == NAMES
    for name in NAMES:
        public = getattr(twindisc_cli, name)
        assert public is getattr(api, name)
        assert not inspect.isfunction(public) or ">>>" in (public.__doc__ or "")
    with pytest.raises(AttributeError, match="no attribute 'creep'"):
        _ = twindisc_cli.creep


def test_nothing_heavy_is_imported_before_it_is_asked_for() -> None:
    program = "import sys, twindisc_cli; sys.exit(any(m in sys.modules for m in ('numpy', 'scipy', 'pandas', 'typer')))"
    assert subprocess.run([sys.executable, "-c", program]).returncode == 0


def test_mu_is_that_of_the_command() -> None:
    """Samples without scatter: each is the mean of its step, which the command inverts."""
    test = Instruments(channels=("traction",), traction=0.0).record(
        Plant(history((0.01, 0.03), 2)), np.random.default_rng(0)
    )
    samples = test.measured.traction
    assert samples is not None
    own = identify_friction(test.rig, samples.creepage, samples.ratio)
    assert own == pytest.approx(by_command(ForwardModel(test)).mu[samples.step], rel=1e-6)
    assert own == pytest.approx(0.6, rel=1e-5)


def test_the_creep_curve_has_the_slope_of_linear_theory_and_the_plateau_of_coulomb() -> None:
    """T = G a b C11 v for small creepages."""
    curve = creep_curve(SPHERES, [-1e-7, 1e-7, 1.0], mu=[0.2, 0.5])
    assert curve[:, 2] == pytest.approx([0.2, 0.5])
    assert curve[:, 0] == pytest.approx(-curve[:, 1])
    assert curve[0, 1] == pytest.approx(curve[1, 1], rel=1e-3)
    patch = SPHERES.patch
    c11 = float(kalker.coefficients(patch.a / patch.b, 0.3).c11)
    stiffness = SPHERES.shear_modulus * patch.a * patch.b * c11
    assert curve[1, 1] == pytest.approx(stiffness * 1e-7 / SPHERES.normal_load, rel=1e-3)


def test_wear_follows_archard_and_heat_the_energy_balance() -> None:
    worn = wear_track(SPHERES, [0.02, 0.05], 4200, mu=[0.3, 0.6], wear_coefficient=1e-4)
    turns = 4200 * 2.0 * np.pi * 0.03
    energy = np.cumsum([0.3 * 0.02, 0.6 * 0.05]) * SPHERES.normal_load * turns
    assert worn.energy == pytest.approx(energy, rel=1e-9)
    assert worn.volume == pytest.approx(1e-4 * energy / SPHERES.disc2.hardness, rel=1e-3)
    warm = disc_temperature(5.0, [30.0, 30.0, 60.0], heat_capacity=100.0, convection=0.0, initial=300.0)
    assert warm == pytest.approx([301.5, 303.0, 306.0])


def test_a_track_takes_one_mu_or_one_for_each_step() -> None:
    """Two iterations of the first step and one of the second, in full sliding."""
    worn = wear_track(SPHERES, [0.02, 0.02, 0.05], 4200, mu=[0.3, 0.6], wear_coefficient=1e-4)
    assert worn.mu.tolist() == [0.3, 0.3, 0.6]
    assert worn.traction_ratio == pytest.approx([0.3, 0.3, 0.6])
    assert wear_track(SPHERES, [0.02, 0.02, 0.05], 4200, mu=0.4, wear_coefficient=1e-4).mu.tolist() == [0.4] * 3
    with pytest.raises(ValueError, match="3 mu for 2 steps: give one mu for each step, or one for all"):
        wear_track(SPHERES, [0.02, 0.02, 0.05], 4200, mu=[0.3, 0.3, 0.6], wear_coefficient=1e-4)


def test_without_creepage_the_friction_is_not_known() -> None:
    found = identify_friction(SPHERES, [0.0, 0.05], [0.3, 0.3])
    assert np.isnan(found[0])
    assert found[1] == pytest.approx(0.3)


def test_discs_of_two_radii_turn_as_often_as_the_mean_of_their_turns() -> None:
    """At one surface speed V each disc turns V / (2 pi R) times a second; revolutions count the mean of both."""
    discs = replace(SPHERES, disc2=replace(SPHERES.disc2, rolling_radius=0.06))
    test = experiment(discs, [0.01], [1000])
    turns = 0.5 * (1.0 / 0.03 + 1.0 / 0.06) * discs.rolling_speed / (2.0 * np.pi)
    assert test.history.duration == pytest.approx([1000.0 / turns])


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (
            lambda: creep_curve(SPHERES, 0.001, mu=0.3, traction="Exact"),
            "traction is one of fastsim, fastrip, exact, not Exact",
        ),  # type: ignore[arg-type]
        (lambda: creep_curve(SPHERES, [[0.001, 0.002], [0.003, 0.004]], mu=0.3), r"shape \(2, 2\): give one axis"),
        (lambda: creep_curve(SPHERES, 0.001, mu=-0.3), "mu must be finite and not negative"),
        (
            lambda: creep_curve(replace(SPHERES, normal_load=0.0), 0.001, mu=0.3),
            "normal_load must be finite and greater than 0",
        ),
        (lambda: identify_friction(SPHERES, [0.01, 0.02], [0.3]), "1 T/N for 2 creepages"),
        (
            lambda: wear_track(SPHERES, 0.01, -10, mu=0.3, wear_coefficient=1e-4),
            "revolutions must be finite and greater",
        ),
        (lambda: wear_track(SPHERES, 0.01, 10, mu=0.3, wear_coefficient=-1e-4), "wear_coefficient must be finite and"),
        (
            lambda: wear_track(SPHERES, 0.01, 10, mu=np.nan, wear_coefficient=1e-4),
            "mu must be finite and greater than 0",
        ),
        (
            lambda: wear_track(SPHERES, 0.01, 10, mu=0.3, wear_coefficient=1e-4, contact="herz"),
            "contact is one of hertz, half",
        ),  # type: ignore[arg-type]
        (lambda: wear_track(SPHERES, [], 10, mu=0.3, wear_coefficient=1e-4), "no iterations"),
        (lambda: disc_temperature(1.0, -1.0, heat_capacity=100.0, convection=1.0), "duration must be finite and not"),
        (
            lambda: disc_temperature(1.0, 1.0, heat_capacity=0.0, convection=1.0),
            "heat_capacity must be finite and greater",
        ),
        (lambda: experiment(SPHERES, 0.01, 100, traction_ratio=np.nan), "T/N must be finite numbers"),
        (
            lambda: experiment(SPHERES, 0.01, 100, traction_ratio=[0.3, 0.3], traction_time=[1.0, 0.5]),
            "must rise, and lie in",
        ),
        (
            lambda: experiment(SPHERES, 0.01, 100, traction_ratio=[0.3], traction_time=[1e6]),
            "must rise, and lie in the history",
        ),
        (lambda: experiment(SPHERES, 0.01, 100, profile=([0.0, 1e-3], [0.0])), "1 heights for 2 places"),
        (lambda: experiment(SPHERES, 0.01, 100, temperature=([1.0], [293.0])), "a temperature needs thermal"),
        (lambda: experiment(SPHERES, 0.01, 100, mu=-0.3), "mu must be finite and greater than 0"),
    ],
)
def test_what_no_test_can_have_is_refused(call: Callable[[], object], says: str) -> None:
    with pytest.raises(ValueError, match=says):
        call()


def test_samples_that_do_not_fit_their_places_are_refused() -> None:
    with pytest.raises(ValueError, match="2 T/N for 3 places: give one T/N for each iteration"):
        experiment(SPHERES, [0.01] * 3, 100, traction_ratio=[0.5, 0.5])
