"""The best circle of parabolas, circles, tilted and uneven profiles."""

import numpy as np
import pytest

from twindisc_cli.physics.best_circle import fit_curvature

Y = np.sort(np.random.default_rng(5).uniform(-0.4e-3, 0.7e-3, 57))


def test_a_parabola_is_found_exactly_whatever_its_tilt_and_the_weights():
    weights = np.random.default_rng(6).uniform(0.1, 3.0, Y.size)
    assert float(fit_curvature(Y, 2e-6 + 0.03 * Y - 16.6 * Y**2, weights)) == pytest.approx(-33.2, rel=1e-10)


def test_a_circle_is_found_to_its_difference_from_the_parabola():
    y = np.linspace(-0.5e-3, 0.5e-3, 201)
    drop = np.sqrt(0.03**2 - y**2) - 0.03
    assert float(fit_curvature(y, drop, np.ones_like(y))) == pytest.approx(-1.0 / 0.03, rel=5e-4)


def test_weights_of_zero_leave_points_out():
    z = np.where(Y > 0.3e-3, 1.0, 40.0 * Y**2 / 2)
    assert float(fit_curvature(Y, z, Y <= 0.3e-3)) == pytest.approx(40.0, rel=1e-10)


def test_many_profiles_at_once():
    curvature = np.array([[10.0, -20.0, 0.0], [1.0, 2.0, 3.0]])
    found = fit_curvature(Y, 0.5 * curvature[..., None] * Y**2, np.ones_like(Y))
    assert found == pytest.approx(curvature, abs=1e-9)


def test_least_squares_agrees_with_polyfit_on_a_profile_that_is_no_circle():
    z = 1e-6 * np.cos(Y / 1e-4)
    assert float(fit_curvature(Y, z, np.ones_like(Y))) == pytest.approx(
        2 * np.polyfit(Y * 1e3, z, 2)[0] * 1e6, rel=1e-9
    )


def test_two_points_make_no_circle():
    weights = np.zeros((2, Y.size))
    weights[0, 7], weights[1, :3] = 1.0, 1.0
    found = fit_curvature(Y, 20.0 * Y**2, weights)
    assert np.isnan(found[0])
    assert found[1] == pytest.approx(40.0, rel=1e-6)
