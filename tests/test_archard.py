"""Archard's law: the depth K P_l / (H V) of each revolution (Eq. 15), around the rim, is the volume of Eq. 13."""

import numpy as np
import pytest
from closed_forms import traction_per_length

from twindisc_cli.physics import archard


def test_depth_around_the_rim_is_the_volume_of_the_energy():
    y = np.linspace(-1e-3, 1e-3, 4001)
    traction = traction_per_length(y=y, b=0.3e-3, normal_load=72.0, mu=0.6, xi=50.0)
    power = 9.42 * 0.03 * traction
    depth = 4200 * 6e-5 * power / (6.9e9 * 9.42)
    time = 4200 * 2 * np.pi * 0.03 / 9.42
    energy = 9.42 * 0.03 * 0.6 * 72.0 * time
    volume = archard.worn_volume(y=y, depth=depth, rolling_radius=0.03)
    assert volume == pytest.approx(6e-5 * energy / 6.9e9, rel=1e-6)
    assert archard.allowed_coefficient(volume=volume, energy=energy, hardness=6.9e9) == pytest.approx(6e-5, rel=1e-6)


def test_the_papers_wear_coefficient_needs_too_much_energy():
    # 6 um of a facet on 30 mm, taken from one disc by some 100 kJ: K of 5-7e-5, not the printed 9.89e-4
    y = np.linspace(-1e-3, 1e-3, 2001)
    groove = np.maximum(6e-6 - y**2 / 0.06, 0.0)
    volume = archard.worn_volume(y=y, depth=groove, rolling_radius=0.03)
    assert volume == pytest.approx(2 * np.pi * 0.03 * 4 / 3 * 6e-6 * np.sqrt(6e-6 * 0.06), rel=1e-4)
    assert 5e-5 < archard.allowed_coefficient(volume=volume, energy=100e3, hardness=700 * 9.80665e6) < 7e-5
