"""Kalker's creepage coefficients, and the exact full-adhesion solution they come from.

CONTACT: open-source release 2025-07-23, rev 2707, exact theory with full adhesion, 60 and 120 elements carried to the
limit (its own estimated error: 0.005 in C11 and C22, 0.002 in C23, 0.01 in C33; C33 is not converged above a/b = 3).
"""

import numpy as np
import pytest
from rigs import solve_rolling

from table_makers import rolling as tabulated
from table_makers.adhesion import creepage_coefficients
from twindisc_cli.physics.kalker import coefficients

# nu, a/b, C11, C22, C23, C33
CONTACT = np.loadtxt(
    """
0 0.1 2.51198 2.51198 0.33464 6.45312
0 0.2 2.59070 2.59070 0.48316 3.46729
0 0.3 2.68226 2.68226 0.60649 2.49656
0 0.4 2.77995 2.77995 0.71905 2.02125
0 0.5 2.88073 2.88073 0.82599 1.74125
0 0.6 2.98301 2.98301 0.92977 1.55767
0 0.7 3.08590 3.08590 1.03173 1.42854
0 0.8 3.18886 3.18886 1.13264 1.33310
0 0.9 3.29158 3.29158 1.23302 1.25990
0 1 3.39385 3.39385 1.33320 1.20211
0 1.11111 3.50682 3.50682 1.44453 1.15082
0 1.25 3.64688 3.64688 1.58405 1.10031
0 1.42857 3.82496 3.82496 1.76440 1.05077
0 1.66667 4.05882 4.05882 2.00710 1.00242
0 2 4.37955 4.37955 2.35189 0.95559
0 2.5 4.84719 4.84719 2.88091 0.91076
0 3.33333 5.59596 5.59596 3.79437 nan
0 5 7.00609 7.00609 5.73239 nan
0 10 10.81815 10.81815 12.27376 nan
0.25 0.1 3.31622 2.52674 0.47121 8.33058
0.25 0.2 3.37451 2.63162 0.60241 4.29215
0.25 0.3 3.44915 2.75234 0.71451 2.96976
0.25 0.4 3.53337 2.87995 0.82162 2.31856
0.25 0.5 3.62351 3.01063 0.92747 1.93281
0.25 0.6 3.71746 3.14250 1.03342 1.67840
0.25 0.7 3.81387 3.27456 1.14007 1.49834
0.25 0.8 3.91186 3.40623 1.24769 1.36436
0.25 0.9 4.01083 3.53720 1.35641 1.26087
0.25 1 4.11038 3.66727 1.46629 1.17858
0.25 1.11111 4.22130 3.81063 1.58975 1.10493
0.25 1.25 4.36000 3.98800 1.74613 1.03171
0.25 1.42857 4.53788 4.21302 1.95047 0.95894
0.25 1.66667 4.77350 4.50789 2.22849 0.88665
0.25 2 5.09944 4.91139 2.62789 0.81488
0.25 2.5 5.57869 5.49853 3.24766 0.74361
0.25 3.33333 6.35218 6.43698 4.33041 nan
0.25 5 7.81919 8.20230 6.65638 nan
0.25 10 11.80499 12.97674 14.62428 nan
0.28 0.1 3.44825 2.52810 0.49330 8.63265
0.28 0.2 3.50099 2.63606 0.62107 4.42089
0.28 0.3 3.57102 2.76041 0.73089 3.04198
0.28 0.4 3.65148 2.89187 0.83673 2.36321
0.28 0.5 3.73859 3.02648 0.94204 1.96125
0.28 0.6 3.83006 3.16230 1.04799 1.69621
0.28 0.7 3.92445 3.29829 1.15505 1.50865
0.28 0.8 4.02077 3.43389 1.26340 1.36910
0.28 0.9 4.11838 3.56875 1.37311 1.26129
0.28 1 4.21679 3.70269 1.48420 1.17556
0.28 1.11111 4.32669 3.85030 1.60922 1.09881
0.28 1.25 4.46441 4.03294 1.76782 1.02247
0.28 1.42857 4.64137 4.26464 1.97538 0.94657
0.28 1.66667 4.87625 4.56826 2.25822 0.87111
0.28 2 5.20180 4.98377 2.66520 0.79609
0.28 2.5 5.68137 5.58843 3.29778 0.72143
0.28 3.33333 6.45673 6.55502 4.40481 nan
0.28 5 7.92950 8.37372 6.78743 nan
0.28 10 11.93559 13.29499 14.96814 nan
0.3 0.1 3.54221 2.52893 0.50896 8.84659
0.3 0.2 3.59063 2.63893 0.63420 4.51143
0.3 0.3 3.65707 2.76573 0.74234 3.09252
0.3 0.4 3.73463 2.89978 0.84723 2.39433
0.3 0.5 3.81938 3.03706 0.95211 1.98102
0.3 0.6 3.90892 3.17556 1.05802 1.70858
0.3 0.7 4.00172 3.31424 1.16532 1.51582
0.3 0.8 4.09675 3.45252 1.27414 1.37240
0.3 0.9 4.19327 3.59004 1.38451 1.26162
0.3 1 4.29080 3.72663 1.49640 1.17352
0.3 1.11111 4.39988 3.87716 1.62248 1.09465
0.3 1.25 4.53678 4.06341 1.78257 1.01619
0.3 1.42857 4.71298 4.29971 1.99233 0.93815
0.3 1.66667 4.94721 4.60937 2.27847 0.86054
0.3 2 5.27232 5.03318 2.69064 0.78331
0.3 2.5 5.75193 5.64998 3.33202 0.70638
0.3 3.33333 6.52834 6.63612 4.45580 nan
0.3 5 8.00478 8.49202 6.87766 nan
0.3 10 12.02426 13.51596 15.20649 nan
0.5 0.1 4.86385 2.53292 0.72377 11.76695
0.5 0.2 4.81947 2.66241 0.80649 5.69591
0.5 0.3 4.81092 2.81445 0.88717 3.73463
0.5 0.4 4.82882 2.97614 0.97590 2.78178
0.5 0.5 4.86575 3.14218 1.07222 2.22374
0.5 0.6 4.91653 3.31005 1.17489 1.85909
0.5 0.7 4.97754 3.47843 1.28285 1.60290
0.5 0.8 5.04624 3.64659 1.39533 1.41336
0.5 0.9 5.12079 3.81409 1.51176 1.26761
0.5 1 5.19984 3.98069 1.63168 1.15210
0.5 1.11111 5.29171 4.16458 1.76862 1.04898
0.5 1.25 5.41105 4.39246 1.94472 0.94666
0.5 1.42857 5.56966 4.68212 2.17839 0.84511
0.5 1.66667 5.78691 5.06258 2.50125 0.74423
0.5 2 6.09686 5.58470 2.97238 0.64387
0.5 2.5 6.56562 6.34712 3.71548 0.54366
0.5 3.33333 7.34124 7.57117 5.03635 nan
0.5 5 8.84341 9.88749 7.92945 nan
0.5 10 12.98883 16.20911 18.08500 nan
""".strip().splitlines()
)
# J. J. Kalker, Three-Dimensional Elastic Bodies in Rolling Contact (1990), Table E.3: nu, a/b, C11, C22, C23
KALKER = np.array([[0.25, 1.0, 4.12, 3.67, 1.47], [0.25, 0.5, 3.62, 3.01, 0.929], [0.5, 2.0, 6.11, 5.56, 2.96]])


@pytest.mark.parametrize(("column", "name", "tolerance"), [(2, "c11", 0.01), (3, "c22", 0.01), (4, "c23", 0.01)])
def test_contacts_exact_coefficients(column, name, tolerance):
    found = getattr(coefficients(CONTACT[:, 1], CONTACT[:, 0]), name)
    np.testing.assert_allclose(found, CONTACT[:, column], rtol=tolerance)


def test_contacts_spin_coefficient():
    rows = CONTACT[np.isfinite(CONTACT[:, 5])]
    assert rows[:, 1].max() > 2.0
    np.testing.assert_allclose(coefficients(rows[:, 1], rows[:, 0]).c33, rows[:, 5], rtol=0.02)


def test_kalkers_printed_table():
    found = coefficients(KALKER[:, 1], KALKER[:, 0])
    np.testing.assert_allclose(np.stack([found.c11, found.c22, found.c23], 1), KALKER[:, 2:], rtol=0.005)


def test_reference_rig():
    """CONTACT, this rig: grids of 60 to 200 elements carried to the limit."""
    found = coefficients(0.170591303 / 0.270524050, 0.3)
    assert found.c11 == pytest.approx(3.9388, abs=2e-3)
    assert found.c22 == pytest.approx(3.2194, abs=2e-3)
    assert found.c23 == pytest.approx(1.0911, abs=2e-3)
    assert found.c33 == pytest.approx(1.6471, abs=3e-3)


def test_without_poisson_effect_both_directions_are_alike():
    found = coefficients(np.geomspace(0.05, 20.0, 41), 0.0)
    np.testing.assert_allclose(found.c11, found.c22, rtol=1e-5)


def test_broadcasts_and_runs_smoothly():
    found = coefficients(np.geomspace(0.05, 20.0, 400)[:, None], np.array([0.0, 0.3, 0.5]))
    for values in (found.c11, found.c22, found.c23, found.c33):
        assert values.shape == (400, 3)
        assert (values > 0.0).all()
        assert np.abs(np.diff(np.log(values), n=2, axis=0)).max() < 1e-3


@pytest.mark.parametrize(("ratio", "poisson"), [(0.0, 0.3), (20.1, 0.3), (1.0, -0.01), (1.0, 0.51), (np.nan, 0.3)])
def test_outside_the_table(ratio, poisson):
    with pytest.raises(ValueError, match="must lie in"):
        coefficients(ratio, poisson)


@pytest.mark.parametrize(("ratio", "poisson"), [(0.13, 0.45), (0.630596, 0.3), (4.7, 0.12)])
def test_table_between_its_nodes_against_the_polynomial_solution(ratio, poisson):
    table, exact = coefficients(ratio, poisson), creepage_coefficients(a_over_b=ratio, poisson=poisson, degree=14)
    assert table.c11 == pytest.approx(exact.c11, rel=5e-4)
    assert table.c22 == pytest.approx(exact.c22, rel=5e-4)
    assert table.c23 == pytest.approx(exact.c32, rel=5e-4)
    assert table.c33 == pytest.approx(exact.c33, rel=1e-3)


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.5])
def test_a_slender_patch_against_the_polynomial_solution_and_its_limit(poisson):
    ratio = 0.025
    known, exact = coefficients(ratio, poisson), creepage_coefficients(a_over_b=ratio, poisson=poisson, degree=10)
    assert (known.c11, known.c22) == pytest.approx((exact.c11, exact.c22), rel=1e-3)
    assert (known.c23, known.c33) == pytest.approx((exact.c32, exact.c33), rel=5e-3)
    limit = coefficients(1e-7, poisson)
    assert (limit.c11, limit.c22) == pytest.approx((np.pi**2 / (4.0 * (1.0 - poisson)), np.pi**2 / 4.0), rel=1e-9)
    beside = coefficients(np.array([0.05 - 1e-9, 0.05]), poisson)
    for values in (beside.c11, beside.c22, beside.c23, beside.c33):
        assert values[0] == pytest.approx(values[1], rel=1e-6)


def test_reciprocity():
    """C23 and C32 come from different loads; they agree ever better as the degree grows."""
    gaps = []
    for degree in (6, 10, 14):
        found = creepage_coefficients(a_over_b=0.5, poisson=0.4, degree=degree)
        gaps.append(abs(found.c23 / found.c32 - 1.0))
    assert gaps[0] > 3.0 * gaps[1] > 6.0 * gaps[2]
    assert gaps[2] < 3e-4


@pytest.mark.parametrize(("ratio", "poisson"), [(0.4, 0.3), (2.5, 0.5)])
def test_the_element_solution_converges_to_the_polynomial_one(ratio, poisson):
    """Two methods that share nothing but the point force. First order in 1/n, the area of the grid allowed for."""
    exact = creepage_coefficients(a_over_b=ratio, poisson=poisson, degree=16)
    a, b = np.sqrt(ratio), 1.0 / np.sqrt(ratio)
    error = []
    for n in (40, 80, 160):
        x, y = a * tabulated.centres(n), b * tabulated.centres(n)
        inside = (x / a) ** 2 + (y[:, None] / b) ** 2 < 1.0
        area = inside.sum() * (x[1] - x[0]) * (y[1] - y[0]) / np.pi
        found = solve_rolling(
            x=x, y=y, pressure=1e9 * inside, mu=1.0, shear_modulus=1.0, poisson=poisson, creepage_x=1.0, creepage_y=1.0
        )
        error.append([found.force_x / area / exact.c11 - 1.0, found.force_y / area / exact.c22 - 1.0])
    assert np.abs(error[-1]).max() < 0.6 / 160
    order = np.log2(np.abs(error[0]) / np.abs(error[2])) / 2.0
    assert (order > 0.8).all()
    assert (order < 1.5).all()
