"""The exact creep curve against CONTACT, against the solver that made its table, and as a function that others invert.

CONTACT: open-source release 2025-07-23, rev 2707, exact theory, 60 and 120 elements carried to the limit (its estimated
error 3e-4). The rig: a = 0.170591303 mm along rolling, b = 0.270524050 mm, G = 79.3 GPa, nu = 0.3, N = 72 N.
"""

import numpy as np
import pytest
from rigs import solve_rolling

from table_makers.rolling import centres
from twindisc_cli.physics import exact
from twindisc_cli.physics.half_space import rolling
from twindisc_cli.physics.kalker import coefficients

A, B, G, NU, LOAD = 0.170591303, 0.270524050, 79300.0, 0.3, 72.0
# mu, then creepage and T/N as often as they fit; creepages beyond full slip are left out but for the largest
CREEP_CURVES = """
0.05 1e-05 0.001979  2e-05 0.003910  5e-05 0.009423  0.0001 0.017711  0.00015 0.024913
0.05 0.0002 0.031074  0.0003 0.040463  0.0004 0.046333  0.0005 0.049210  0.0006 0.049940
0.05 0.0008 0.049966  0.09 0.050000
0.1 1e-05 0.001988  2e-05 0.003957  5e-05 0.009714  0.0001 0.018847  0.00015 0.027409
0.1 0.0002 0.035421  0.0003 0.049826  0.0004 0.062147  0.0005 0.072486  0.0006 0.080926
0.1 0.0008 0.092665  0.001 0.098420  0.0012 0.099879  0.0015 0.099923  0.0018 0.099947
0.1 0.09 0.100000
0.2 1e-05 0.001994  2e-05 0.003976  5e-05 0.009863  0.0001 0.019429  0.00015 0.028703
0.2 0.0002 0.037694  0.0003 0.054818  0.0004 0.070843  0.0005 0.085780  0.0006 0.099652
0.2 0.0008 0.124295  0.001 0.144971  0.0012 0.161852  0.0015 0.180673  0.0018 0.192411
0.2 0.002 0.196840  0.0025 0.199778  0.003 0.199846  0.0035 0.199887  0.09 0.200000
0.3 1e-05 0.001996  2e-05 0.003984  5e-05 0.009911  0.0001 0.019622  0.00015 0.029143
0.3 0.0002 0.038468  0.0003 0.056541  0.0004 0.073849  0.0005 0.090420  0.0006 0.106264
0.3 0.0008 0.135780  0.001 0.162478  0.0012 0.186442  0.0015 0.217457  0.0018 0.242777
0.3 0.002 0.256715  0.0025 0.282017  0.003 0.295260  0.0035 0.299513  0.004 0.299707
0.3 0.0045 0.299769  0.005 0.299813  0.0055 0.299845  0.09 0.299999
0.4 1e-05 0.001996  2e-05 0.003988  5e-05 0.009927  0.0001 0.019725  0.00015 0.029368
0.4 0.0002 0.038858  0.0003 0.057406  0.0004 0.075387  0.0005 0.092794  0.0006 0.109636
0.4 0.0008 0.141686  0.001 0.171560  0.0012 0.199305  0.0015 0.237035  0.0018 0.270237
0.4 0.002 0.289942  0.0025 0.331035  0.003 0.361346  0.0035 0.381821  0.004 0.393680
0.4 0.0045 0.398793  0.005 0.399556  0.0055 0.399633  0.006 0.399692  0.0065 0.399737
0.4 0.007 0.399774  0.0075 0.399803  0.09 0.399999
0.5 1e-05 0.001996  2e-05 0.003990  5e-05 0.009941  0.0001 0.019786  0.00015 0.029493
0.5 0.0002 0.039099  0.0003 0.057941  0.0004 0.076315  0.0005 0.094234  0.0006 0.111698
0.5 0.0008 0.145279  0.001 0.177107  0.0012 0.207203  0.0015 0.249131  0.0018 0.287318
0.5 0.002 0.310737  0.0025 0.362428  0.003 0.404629  0.0035 0.438082  0.004 0.463326
0.5 0.0045 0.481028  0.005 0.492100  0.0055 0.497767  0.006 0.499397  0.0065 0.499486
0.5 0.007 0.499557  0.0075 0.499615  0.008 0.499661  0.009 0.499733  0.09 0.499997
0.6 1e-05 0.001996  2e-05 0.003991  5e-05 0.009949  0.0001 0.019823  0.00015 0.029588
0.6 0.0002 0.039244  0.0003 0.058286  0.0004 0.076936  0.0005 0.095199  0.0006 0.113081
0.6 0.0008 0.147697  0.001 0.180840  0.0012 0.212529  0.0015 0.257339  0.0018 0.298957
0.6 0.002 0.324956  0.0025 0.384040  0.003 0.434913  0.0035 0.477867  0.004 0.513430
0.6 0.0045 0.542019  0.005 0.564034  0.0055 0.579962  0.006 0.590521  0.0065 0.596585
0.6 0.007 0.599026  0.0075 0.599333  0.008 0.599414  0.009 0.599538  0.01 0.599626
0.6 0.09 0.599995
0.7 1e-05 0.001997  2e-05 0.003991  5e-05 0.009957  0.0001 0.019841  0.00015 0.029652
0.7 0.0002 0.039358  0.0003 0.058545  0.0004 0.077388  0.0005 0.095886  0.0006 0.114074
0.7 0.0008 0.149445  0.001 0.183546  0.0012 0.216357  0.0015 0.263275  0.0018 0.307392
0.7 0.002 0.335276  0.0025 0.399816  0.003 0.457097  0.0035 0.507399  0.004 0.550880
0.7 0.0045 0.588015  0.005 0.619034  0.0055 0.644280  0.006 0.664057  0.0065 0.678746
0.7 0.007 0.688941  0.0075 0.695275  0.008 0.698398  0.009 0.699265  0.01 0.699405
0.7 0.0125 0.699620  0.09 0.699993
"""


def creep_curves():
    """mu, creepage and T/N, each (case,)."""
    cases = []
    for line in CREEP_CURVES.split("\n"):
        mu, *pairs = (float(word) for word in line.split() or ["nan"])
        cases += [(mu, creepage, ratio) for creepage, ratio in zip(pairs[::2], pairs[1::2], strict=True)]
    return np.array(cases).T


def test_contacts_creep_curves():
    mu, creepage, ratio = creep_curves()
    assert len(mu) == 193
    xi = G * A * B * float(coefficients(A / B, NU).c11) * creepage / (mu * LOAD)
    np.testing.assert_allclose(mu * exact.saturation(xi, A / B, NU), ratio, atol=1e-3)


# CONTACT's published example of a locomotive wheel (tractcurv): a/b = 0.5, nu = 0.28, some 40 elements: up to 1 % high.
WHEEL = np.array([[1e-5, 247.0], [4e-4, 9112.0], [8e-4, 16700.0], [16e-4, 27570.0], [20e-4, 31040.0], [32e-4, 35130.0]])


def test_contacts_locomotive_wheel():
    creepage, force = WHEEL.T
    capacity = 0.33 * 106700.0
    xi = 82000.0 * 6.304 * 12.61 * float(coefficients(0.5, 0.28).c11) * creepage / capacity
    found = capacity * exact.saturation(xi, 0.5, 0.28)
    np.testing.assert_allclose(found, force, atol=0.01 * capacity, rtol=0.015)
    assert (found <= force + 1e-3 * capacity).all()


@pytest.mark.parametrize(("ratio", "poisson", "xi"), [(0.1, 0.5, 1.2), (2.3, 0.1, 0.7), (7.0, 0.4, 1.9)])
def test_table_against_the_solver(ratio, poisson, xi):
    """Both carried to the limit, by different grids; elsewhere than the nodes of the table."""
    a, b, found = np.sqrt(ratio), 1.0 / np.sqrt(ratio), []
    for n in (60, 120):
        x, y = a * centres(n), b * centres(n)
        pressure = np.sqrt(np.maximum(0.0, 1.0 - (x / a) ** 2 - (y[:, None] / b) ** 2))
        load = pressure.sum() * (x[1] - x[0]) * (y[1] - y[0])
        creepage = 1e-3 * xi * load / float(coefficients(ratio, poisson).c11)
        case = solve_rolling(
            x=x, y=y, pressure=pressure, mu=1e-3, shear_modulus=1.0, poisson=poisson, creepage_x=creepage
        )
        found.append(case.force_x / (1e-3 * load))
    limit, error = rolling.limit(found[0], found[1])
    assert exact.saturation(xi, ratio, poisson) == pytest.approx(limit, abs=0.0015)
    assert error < 0.003


def test_initial_slope_is_that_of_linear_theory():
    xi = np.array([1e-8, 1e-5, 1e-3])
    np.testing.assert_allclose(exact.saturation(xi, 0.63, 0.3) / xi, 1.0, atol=1e-3)
    assert exact.saturation(0.0, 0.63, 0.3) == 0.0


@pytest.mark.parametrize("poisson", [0.0, 0.28, 0.3, 0.5])
def test_rises_all_the_way_and_stays_below_one(poisson):
    xi = np.concatenate([np.linspace(0.0, 4.0, 4001), np.geomspace(4.0, 1e4, 50)])
    for ratio in (0.05, 0.3, 1.0, 4.4, 20.0):
        f = exact.saturation(xi, ratio, poisson)
        assert (np.diff(f) >= -1e-15).all()
        assert f[-1] <= 1.0
        assert f[-1] > 0.999999
        assert f[2600] > 0.96


def test_smooth_in_creepage_and_ratio():
    xi = np.linspace(0.05, 4.0, 2000)
    assert np.abs(np.diff(exact.saturation(xi, 0.63, 0.3), n=2)).max() < 1e-4
    ratio = np.geomspace(0.05, 20.0, 2000)
    assert np.abs(np.diff(exact.saturation(1.0, ratio, 0.3))).max() < 5e-4


def test_the_inverse():
    xi = np.concatenate([np.linspace(0.0, 2.2, 50), [3.0, 3.49, 3.6, 10.0, 100.0]])
    for ratio in (0.1, 0.63, np.linspace(0.2, 3.0, 55)):
        back = exact.unsaturation(exact.saturation(xi, ratio, 0.3), ratio, 0.3)
        np.testing.assert_allclose(back, xi, rtol=1e-9, atol=1e-12)
    assert exact.unsaturation(1.0, 0.63, 0.3) == np.inf


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.5])
def test_below_the_table_it_is_carters_strips(poisson):
    """Carter: T/(mu q) = 1 - (1 - d)^2 of a line contact, d = k / h of its half-length h(y); q goes with h^2."""
    xi = np.array([0.3, 0.8, 1.4, 2.0, 2.3])
    y = np.linspace(-1.0, 1.0, 20002)[1:-1]
    half_length, shift = np.sqrt(1.0 - y**2), xi[:, None] * 4.0 / (3.0 * np.pi)
    share = 1.0 - np.maximum(1.0 - shift / half_length, 0.0) ** 2
    carter = np.trapezoid(0.75 * half_length**2 * share, y, axis=1)
    np.testing.assert_allclose(exact.saturation(xi, 1e-4, poisson), carter, atol=1e-5)
    below, at = (exact.saturation(xi, ratio, poisson) for ratio in (0.02, 0.05))
    assert (np.abs(below - carter) < 0.5 * np.abs(at - carter) + 1e-6).all()
    np.testing.assert_allclose(exact.saturation(xi, 0.05 - 1e-9, poisson), at, atol=1e-9)


def test_shapes():
    assert exact.saturation(0.5, 0.6, 0.3).shape == ()
    assert exact.saturation(np.full((4, 1), 0.5), np.full(3, 0.6), 0.3).shape == (4, 3)
    assert exact.saturation(np.full(4, 0.5), np.full((1, 1), 0.6), 0.3).shape == (1, 4)
    many = exact.saturation(np.linspace(0.0, 3.0, 7), np.linspace(0.1, 2.0, 7), 0.3)
    pairs = zip(np.linspace(0.0, 3.0, 7), np.linspace(0.1, 2.0, 7), strict=True)
    one_by_one = [float(exact.saturation(xi, ratio, 0.3)) for xi, ratio in pairs]
    np.testing.assert_allclose(many, one_by_one, rtol=1e-14)


@pytest.mark.parametrize(("ratio", "poisson"), [(0.0, 0.3), (21.0, 0.3), (np.nan, 0.3), (1.0, 0.6), (1.0, -0.1)])
def test_outside_the_table(ratio, poisson):
    for function in (exact.saturation, exact.unsaturation):
        with pytest.raises(ValueError, match="must lie in"):
            function(0.5, ratio, poisson)
