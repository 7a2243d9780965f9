"""Linear theory against its own symmetry and the initial slope of FASTSIM."""

import numpy as np
import pytest
from closed_forms import adhesion

from twindisc_cli.physics import fastsim
from twindisc_cli.physics.kalker import Coefficients

RIG = {"a": 0.170591303e-3, "b": 0.270524050e-3, "shear_modulus": 79.3e9}
KALKER = {"coefficients": Coefficients(*np.array([3.9388, 3.2194, 1.0911, 1.6471]))}
"""CONTACT rev 2707, exact theory, rig."""


def test_full_adhesion_of_the_rig():
    # CONTACT rev 2707, exact theory: T/N = 0.001979 at vx = 1e-5, mu = 0.05, which is 1 % below adhesion everywhere
    force = adhesion(creepage_x=1e-5, creepage_y=0.0, spin=0.0, **RIG, **KALKER)
    assert float(force.longitudinal) / 72.0 == pytest.approx(0.002002, abs=2e-6)


def test_coupling_of_lateral_creepage_and_spin_is_reciprocal_and_stores_nothing():
    lateral = adhesion(creepage_x=0.0, creepage_y=1e-4, spin=0.0, **RIG, **KALKER)
    spin = adhesion(creepage_x=0.0, creepage_y=0.0, spin=1.0, **RIG, **KALKER)
    assert float(lateral.moment) / 1e-4 == pytest.approx(-float(spin.lateral), rel=1e-14)


def test_fastsim_starts_with_the_linear_forces():
    patch = fastsim.Patch(**RIG, normal_load=72.0, mu=1e4, c11=3.9388, c22=3.2194, c23=1.0911)
    given = {"creepage_x": [1e-5, 0.0, 0.0], "creepage_y": [0.0, 1e-5, 0.0], "spin": [0.0, 0.0, 0.1]}
    marched = fastsim.solve(patch, **given, speed=9.42, nx=100, ny=100)
    expected = adhesion(**{k: np.array(v) for k, v in given.items()}, **RIG, **KALKER)
    assert marched.force_x == pytest.approx(expected.longitudinal, rel=1e-3)
    assert marched.force_y == pytest.approx(expected.lateral, rel=1e-3)
