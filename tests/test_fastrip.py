"""FaStrip's closed form against CONTACT's FaStrip (open-source release 2025-07-23, rev 2707, mode M5, 400 x 400)."""

import numpy as np
import pytest

from twindisc_cli.physics import fastrip

# a = 0.170591303 mm, b = 0.270524050 mm, G = 79.3 GPa, nu = 0.3, N = 72 N; the program's own C11 = 3.9375.
LINEAR_FORCE = 79300.0 * 0.170591303 * 0.270524050 * 3.9375 / 72.0  # over N, per unit of creepage
CONTACT = np.array(
    [  # mu, creepage, T/N
        [0.05, 1e-05, 0.00198015],
        [0.05, 0.0002, 0.03145453],
        [0.05, 0.001, 0.05000042],
        [0.05, 0.002, 0.05000042],
        [0.05, 0.004, 0.05000042],
        [0.05, 0.006, 0.05000042],
        [0.3, 1e-05, 0.00198871],
        [0.3, 0.0002, 0.03859693],
        [0.3, 0.001, 0.16430312],
        [0.3, 0.002, 0.25999107],
        [0.3, 0.004, 0.30000253],
        [0.3, 0.006, 0.30000253],
        [0.6, 1e-05, 0.00204389],
        [0.6, 0.0002, 0.03928735],
        [0.6, 0.001, 0.18215925],
        [0.6, 0.002, 0.32860625],
        [0.6, 0.004, 0.51998215],
        [0.6, 0.006, 0.59415178],
    ]
)
# The exact theory on the same rig (creep_curves, extrapolated), mu = 0.6.
EXACT = np.array(
    [  # creepage, T/N
        [1e-05, 0.001996],
        [2e-05, 0.003991],
        [5e-05, 0.009949],
        [0.0001, 0.019823],
        [0.00015, 0.029588],
        [0.0002, 0.039244],
        [0.0003, 0.058286],
        [0.0004, 0.076936],
        [0.0005, 0.095199],
        [0.0006, 0.113081],
        [0.0008, 0.147697],
        [0.001, 0.180840],
        [0.0012, 0.212529],
        [0.0015, 0.257339],
        [0.0018, 0.298957],
        [0.002, 0.324956],
        [0.0025, 0.384040],
        [0.003, 0.434913],
        [0.0035, 0.477867],
        [0.004, 0.513430],
        [0.0045, 0.542019],
        [0.005, 0.564034],
        [0.0055, 0.579962],
        [0.006, 0.590521],
        [0.0065, 0.596585],
        [0.007, 0.599026],
        [0.0075, 0.599333],
        [0.008, 0.599414],
        [0.009, 0.599538],
        [0.01, 0.599626],
    ]
)


def test_contacts_fastrip():
    mu, creepage, ratio = CONTACT.T
    found = mu * fastrip.saturation(LINEAR_FORCE * creepage / mu)
    np.testing.assert_allclose(found, ratio, atol=1e-4)


def test_nearer_to_exact_than_two_percent_of_mu():
    creepage, ratio = EXACT.T
    found = 0.6 * fastrip.saturation(LINEAR_FORCE * creepage / 0.6)
    assert np.abs(found - ratio).max() < 0.012 * 0.6


def test_slope_is_that_of_linear_theory_and_full_slip_is_full():
    xi = np.array([1e-6, 1e-4])
    np.testing.assert_allclose(fastrip.saturation(xi) / xi, 1.0, atol=1e-4)
    np.testing.assert_array_equal(fastrip.saturation([fastrip.FULL_SLIP, 10.0]), 1.0)


@pytest.mark.parametrize("fraction", [0.0, 1e-9, 0.1, 0.5, 0.9, 0.999, 1.0 - 1e-9, 1.0])
def test_unsaturation_is_the_inverse(fraction):
    assert fastrip.saturation(fastrip.unsaturation(fraction)) == pytest.approx(fraction, abs=1e-14)
