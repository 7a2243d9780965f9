"""Full normal contact against Hertz, CONTACT's worn profile and closed forms; the strip form against it.

Worn profile and its patch: CONTACT, open-source release of 2025-07-23, revision 2707, elements of 1.25 by 2.5 um.
"""

import numpy as np
import pytest
from scipy.integrate import dblquad
from scipy.special import ellipe, ellipk

from table_makers.strips import semi_width, solve_strips
from twindisc_cli.physics.half_space import (
    CoarseGridError,
    DataEdgeError,
    NoContactError,
    NoConvergenceError,
    ProfileError,
)
from twindisc_cli.physics.half_space.influence import rectangle_influence, strip_functions
from twindisc_cli.physics.half_space.normal import solve_gap, solve_profile

RIG = {"curvature_x": 2.0 / 30e-3, "normal_load": 72.0, "effective_modulus": 79.3e9 / (1.0 - 0.3)}
# Hertz of the rig (CONTACT hzcalc3d and elliptic integrals agree to all digits): a, b [m], p0 [Pa], approach [m].
HERTZ = (0.170591303e-3, 0.270524050e-3, 744.9225410e6, 2.1897674474e-6)
# y [mm], half-length [mm] (outer edges of the elements), pressure on x = 0 [MPa], line load [N/mm].
WORN_OUTLINE = (
    (-0.33375, 0.08875, 463.1280, 64.27232),
    (-0.31875, 0.11375, 620.7921, 111.29700),
    (-0.29625, 0.13500, 723.2052, 153.26278),
    (-0.28125, 0.13750, 694.6659, 150.71875),
    (-0.26375, 0.13750, 632.1546, 135.78067),
)
Y = np.linspace(-1e-3, 1e-3, 401)


def facet(y, half_width=0.3e-3, smoothing=0.1):
    """Transverse radius of 30 mm, worn flat over 2 * half_width; shoulders smoothed over that share of the depth."""
    depth = half_width**2 / 60e-3
    return smoothing * depth * np.logaddexp(0.0, (y**2 / 60e-3 - depth) / (smoothing * depth))


def test_rectangle_influence_is_the_integral_of_one_over_distance():
    for x, y in ((1.7, 0.4), (0.3, -2.1), (0.9, 0.9)):
        expected = dblquad(lambda v, u, x=x, y=y: 1.0 / np.hypot(x - u, y - v), -0.5, 0.5, -0.25, 0.25)[0]
        assert rectangle_influence(x=x, y=y, dx=1.0, dy=0.5) == pytest.approx(expected, rel=1e-7)


def test_strip_functions_meet_their_limits():
    # Narrow strip: the logarithm of K at m = 1, integrated.
    t = np.array([1e-4, 1e-3])
    phi = strip_functions(t).deflection
    assert phi == pytest.approx(4.0 / np.pi * t * np.log(4.0 / t), rel=1e-4)
    # Long strip: a point's logarithm, and the curvature of the line contact (2 on each side).
    far = strip_functions(np.array([1e3, 1e5]))
    assert far.deflection[1] - far.deflection[0] == pytest.approx(np.log(100.0), rel=1e-6)
    assert far.curvature == pytest.approx([2.0, 2.0], rel=1e-5)
    assert strip_functions(-t).deflection == pytest.approx(-phi)
    # Both tangents hold derivatives: dPhi/dt = (4/pi) sqrt(1 + t^2) (K - E), dPsi/dt the same over 1 + t^2.
    t = np.array([0.05, 0.5, 2.0])
    found = strip_functions(t)
    m = 1.0 / (1.0 + t**2)
    difference = 4.0 / np.pi * (ellipk(m) - ellipe(m))
    assert 2.0 * (found.deflection - found.load_tangent) / t == pytest.approx(difference / np.sqrt(m), rel=2e-4)
    assert (found.slope_tangent - found.curvature) / t == pytest.approx(difference * np.sqrt(m), rel=2e-4)


def test_sphere_on_cylinder_is_hertz():
    contact = solve_profile(y=Y, gap=Y**2 / 60e-3, **RIG)
    found = (contact.half_length.max(), semi_width(contact), contact.peak_pressure, contact.approach)
    assert found == pytest.approx(HERTZ, rel=5e-3)
    assert contact.normal_load == pytest.approx(72.0, rel=1e-12)
    lifted = solve_profile(y=Y, gap=Y**2 / 60e-3 - 3e-6, **RIG)
    assert lifted.approach == pytest.approx(contact.approach - 3e-6, abs=1e-11)
    # The pressure is the ellipsoid everywhere.
    x, y = contact.x / HERTZ[0], contact.y[:, None] / HERTZ[1]
    ellipsoid = HERTZ[2] * np.sqrt(np.maximum(0.0, 1.0 - x**2 - y**2))
    assert np.abs(contact.pressure - ellipsoid)[x**2 + y**2 < 0.9].max() < 0.005 * HERTZ[2]


def test_reported_change_shrinks_with_the_accuracy_asked_for_and_covers_the_error():
    for accuracy in (0.02, 0.005):
        contact = solve_profile(y=Y, gap=Y**2 / 60e-3, relative_accuracy=accuracy, **RIG)
        assert contact.relative_change <= accuracy
        for found, exact in ((contact.peak_pressure, HERTZ[2]), (contact.approach, HERTZ[3])):
            assert found == pytest.approx(exact, rel=accuracy)
        assert contact.area == pytest.approx(np.pi * HERTZ[0] * HERTZ[1], rel=accuracy)


def test_approach_converges_with_second_order():
    errors = []
    for count in (32, 64, 128):
        edges = np.linspace(-1.0, 1.0, count + 1)
        x, y = 0.2e-3 * (edges[1:] + edges[:-1]) / 2.0, 0.31e-3 * (edges[1:] + edges[:-1]) / 2.0
        gap = x**2 / 30e-3 + y[:, None] ** 2 / 60e-3
        contact = solve_gap(x=x, y=y, gap=gap, normal_load=72.0, effective_modulus=RIG["effective_modulus"])
        errors.append(abs(contact.approach / HERTZ[3] - 1.0))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders.min() > 1.5


def test_worn_flat_agrees_with_contact():
    contact = solve_profile(y=Y, gap=facet(Y), **RIG)
    largest = contact.pressure.max(axis=1)
    assert contact.peak_pressure == pytest.approx(723.2e6, rel=0.01)
    assert abs(contact.y[largest.argmax()]) == pytest.approx(0.296e-3, abs=contact.element_size[1])
    assert np.interp(0.0, contact.y, largest) == pytest.approx(467e6, rel=0.01)
    assert semi_width(contact) == pytest.approx(0.355e-3, rel=0.01)
    assert contact.area == pytest.approx(0.173937e-6, rel=0.01)
    assert contact.approach == pytest.approx(1.59113e-6, rel=1e-3)
    for at, half_length, pressure, line_load in WORN_OUTLINE:
        # The outline is known to one element of 1.25 um.
        assert np.interp(at * 1e-3, contact.y, contact.half_length) == pytest.approx(half_length * 1e-3, abs=2e-6)
        assert np.interp(at * 1e-3, contact.y, largest) == pytest.approx(pressure * 1e6, rel=0.01)
        assert np.interp(at * 1e-3, contact.y, contact.line_load) == pytest.approx(line_load * 1e3, rel=0.01)


@pytest.mark.parametrize("half_width", [0.2e-3, 0.45e-3, 0.7e-3])
def test_strips_agree_with_the_full_solution_on_growing_facets(half_width):
    gap = facet(Y, half_width)
    full, strips = solve_profile(y=Y, gap=gap, **RIG), solve_strips(y=Y, gap=gap, **RIG)
    assert strips.peak_pressure == pytest.approx(full.peak_pressure, rel=0.01)
    assert strips.area == pytest.approx(full.area, rel=0.01)
    assert semi_width(strips) == pytest.approx(semi_width(full), rel=0.01)
    assert strips.approach == pytest.approx(full.approach, rel=0.002)
    # Where a sharp shoulder lies inside the patch, the pressure along x is not quite a semi-ellipse.
    inner = np.abs(Y) < 0.95 * semi_width(full)
    assert np.interp(Y[inner], full.y, full.line_load) == pytest.approx(
        strips.line_load[inner], abs=0.02 * full.line_load.max()
    )
    assert np.interp(Y[inner], full.y, full.pressure.max(axis=1)) == pytest.approx(
        strips.centre_pressure[inner], abs=0.01 * full.peak_pressure
    )


def test_two_bumps_are_two_hertz_contacts():
    """Each of two equal bumps 0.4 mm apart carries half the load; the other sinks it by N / (2 pi E* 0.4 mm)."""
    y, radius, modulus = 0.3 * Y, 2e-3, 113e9
    gap = np.minimum((y - 0.2e-3) ** 2, (y + 0.2e-3) ** 2) / (2.0 * radius)
    contact = solve_profile(
        y=y, gap=gap, normal_load=4.0, curvature_x=1.0 / radius, effective_modulus=modulus, relative_accuracy=0.01
    )
    semi_axis = (3.0 * 2.0 * radius / (4.0 * modulus)) ** (1.0 / 3.0)
    assert contact.peak_pressure == pytest.approx(1.5 * 2.0 / (np.pi * semi_axis**2), rel=0.01)
    assert contact.area == pytest.approx(2.0 * np.pi * semi_axis**2, rel=0.01)
    assert contact.approach == pytest.approx(semi_axis**2 / radius + 2.0 / (np.pi * modulus * 0.4e-3), rel=0.01)
    assert np.count_nonzero(np.diff(contact.patch.any(axis=1).astype(int)) == 1) == 2


def test_errors_say_what_is_wrong():
    narrow = np.linspace(-0.2e-3, 0.2e-3, 101)
    with pytest.raises(DataEdgeError, match="end of the profile"):
        solve_profile(y=narrow, gap=narrow**2 / 60e-3, **RIG)
    tilted = Y**2 / 60e-3 - 0.03 * Y
    with pytest.raises(DataEdgeError, match="end of the profile"):
        solve_profile(y=Y, gap=tilted, **RIG)
    with pytest.raises(ProfileError, match="NaN"):
        solve_profile(y=Y, gap=np.where(Y > 0, np.nan, 0.0), **RIG)
    with pytest.raises(ProfileError, match="ascend"):
        solve_profile(y=Y[::-1], gap=Y**2 / 60e-3, **RIG)
    with pytest.raises(NoContactError, match="positive"):
        solve_profile(y=Y, gap=Y**2 / 60e-3, **RIG | {"normal_load": -1.0})
    with pytest.raises(CoarseGridError, match="points across the patch"):
        solve_profile(y=Y[::40], gap=Y[::40] ** 2 / 60e-3, **RIG)
    x, y = np.linspace(-1e-3, 1e-3, 31), np.linspace(-1e-3, 1e-3, 31)
    gap = x**2 / 30e-3 + y[:, None] ** 2 / 60e-3
    with pytest.raises(CoarseGridError, match="elements across"):
        solve_gap(x=x, y=y, gap=gap, normal_load=72.0, effective_modulus=113e9)
    with pytest.raises(DataEdgeError, match="end of the gap"):
        solve_gap(x=0.1 * x, y=y, gap=0.0 * gap, normal_load=72.0, effective_modulus=113e9)


def test_sharp_edge_has_no_peak_pressure(monkeypatch):
    monkeypatch.setattr("twindisc_cli.physics.half_space.normal._FINEST", 160)
    with pytest.raises(NoConvergenceError, match="peak pressure still changes"):
        solve_profile(y=Y, gap=np.maximum(0.0, np.abs(Y) - 0.3e-3), **RIG)
