"""Longitudinal and lateral creepage together, against CONTACT."""

from __future__ import annotations

import numpy as np
import pytest

from twindisc_cli.physics.combined import direction
from twindisc_cli.physics.exact import saturation

# vx, vy, Fx, Fy [N] at mu = 0.6, 72 N, a = 0.170591303 mm, b = 0.270524050 mm, G = 79.3 GPa, nu = 0.3, on a grid of
# 120 x 120. CONTACT, open-source release 2025-07-23, revision 2707.
CONTACT = np.array(
    [
        [0.001, 0.001, 12.646591, 10.41206],
        [0.001, 0.003, 10.673937, 26.728548],
        [0.001, 0.01, 4.602666, 42.922774],
        [0.002, 0.001, 23.044641, 9.546072],
        [0.002, 0.003, 20.15095, 25.358695],
        [0.002, 0.01, 9.029551, 42.213749],
        [0.005, 0.001, 40.275881, 6.93959],
        [0.005, 0.003, 37.133173, 19.408434],
        [0.005, 0.01, 20.145011, 38.181843],
        [0.01, 0.001, 42.982071, 4.056692],
        [0.01, 0.003, 41.529654, 11.797136],
        [0.01, 0.01, 31.025303, 30.032803],
    ]
)
STIFFNESS = 79.3e9 * 0.170591303e-3 * 0.270524050e-3 / (0.6 * 72.0)


def test_forces_under_combined_creepage_are_those_of_contact() -> None:
    vx, vy, fx, fy = CONTACT.T
    along, across = STIFFNESS * 3.9388 * vx, STIFFNESS * 3.2194 * vy
    xi = np.hypot(along, across)
    level = saturation(xi, np.full_like(xi, 0.6306), 0.3)
    east, north = direction(along, across, vx, vy)
    assert level * east == pytest.approx(fx / 43.2, abs=4e-3)
    assert level * north == pytest.approx(fy / 43.2, abs=4e-3)


def test_the_traction_turns_from_the_linear_theory_to_the_slip() -> None:
    for size, angle in ((1e-6, np.arctan2(3.2194, 3.9388)), (10.0, np.pi / 4)):
        one = np.array([size])
        east, north = direction(3.9388 * 85.0 * one, 3.2194 * 85.0 * one, one, one)
        assert np.arctan2(north, east) == pytest.approx(angle, abs=1e-4)
        assert np.hypot(east, north) == pytest.approx(1.0)


def test_one_creepage_alone_is_not_turned() -> None:
    value, nothing = np.array([0.3]), np.zeros(1)
    assert direction(value, nothing, value, nothing) == (pytest.approx(1.0), pytest.approx(0.0))
    assert direction(nothing, value, nothing, value) == (pytest.approx(0.0), pytest.approx(1.0))
