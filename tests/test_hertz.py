"""Hertz contact against CONTACT's solution of the rig, the sphere's closed form, and the limits of slender patches."""

import numpy as np
import pytest

from twindisc_cli.physics import hertz
from twindisc_cli.physics.line_contact import line_contact

RIG = {"normal_load": 72.0, "effective_modulus": 2.0 * 79.3e9 * 1.3 / (2.0 * (1.0 - 0.3**2))}


def test_rig_agrees_with_contact_to_nine_digits():
    # CONTACT open-source release 2025-07-23, rev 2707, hzcalc3d: mm, MPa
    rig = hertz.contact_ellipse(curvature_x=2.0 / 0.03, curvature_y=1.0 / 0.03, **RIG)
    assert float(rig.a) == pytest.approx(0.170591303e-3, rel=5e-9)
    assert float(rig.b) == pytest.approx(0.270524050e-3, rel=5e-9)
    assert float(rig.p0) == pytest.approx(744.9225410e6, rel=1e-9)
    assert float(rig.approach) == pytest.approx(0.0021897674477e-3, rel=1e-9)


def test_sphere_is_the_closed_form():
    sphere = hertz.contact_ellipse(curvature_x=5.0, curvature_y=5.0, normal_load=100.0, effective_modulus=1e11)
    radius = np.cbrt(0.75 * 100.0 / (5.0 * 1e11))
    assert [float(sphere.a), float(sphere.b)] == pytest.approx([radius, radius], rel=1e-14)
    assert float(sphere.approach) == pytest.approx(5.0 * radius**2, rel=1e-14)


@pytest.mark.parametrize(("theta_degrees", "m", "n"), [(30, 2.731, 0.493), (50, 1.754, 0.641), (80, 1.128, 0.893)])
def test_hertz_coefficients_of_the_textbooks(theta_degrees, m, n):
    # H. L. Whittemore and S. N. Petrenko, NBS Technologic Paper 201 (1921): semi-axes m c and n c with
    # c^3 = 3 N/(4 E* (A + B)), gap = A x^2 + B y^2, cos theta = |A - B|/(A + B)
    cosine = np.cos(np.radians(theta_degrees))
    patch = hertz.contact_ellipse(curvature_x=1 + cosine, curvature_y=1 - cosine, normal_load=1, effective_modulus=1)
    unit = np.cbrt(0.75)
    assert float(patch.b) / unit == pytest.approx(m, abs=1.5e-3)
    assert float(patch.a) / unit == pytest.approx(n, abs=1.5e-3)


def test_axes_swap_with_the_curvatures():
    one = hertz.contact_ellipse(curvature_x=7.0, curvature_y=90.0, **RIG)
    other = hertz.contact_ellipse(curvature_x=90.0, curvature_y=7.0, **RIG)
    assert float(one.a) == pytest.approx(float(other.b), rel=1e-14)
    assert float(one.b) == pytest.approx(float(other.a), rel=1e-14)


def test_pressure_carries_the_load_however_slender():
    ratio = np.geomspace(1e-20, 1e20, 81)
    patch = hertz.contact_ellipse(curvature_x=ratio, curvature_y=1.0, **RIG)
    assert 2.0 / 3.0 * np.pi * patch.a * patch.b * patch.p0 == pytest.approx(np.full(81, 72.0), rel=1e-13)
    assert np.all(np.diff(np.log(patch.b / patch.a)) > 0.0)


@pytest.mark.parametrize("power", [-300, -200, 200, 300])
def test_no_patch_is_too_slender(power):
    # K. L. Johnson, eq. 4.35: A/B = (b/a)^2 (ln(4 a/b) - 1) for b << a, the smaller curvature along a
    patch = hertz.contact_ellipse(curvature_x=10.0 ** (power / 2), curvature_y=10.0 ** (-power / 2), **RIG)
    logarithm = -2.0 * abs(np.log(patch.b / patch.a))
    assert logarithm + np.log(np.log(4.0) - logarithm / 2.0 - 1.0) == pytest.approx(
        -abs(power) * np.log(10.0), rel=1e-12
    )


@pytest.mark.parametrize("stiff", [1e-300, 1e297])
def test_a_patch_of_any_modulus_is_similar(stiff):
    # a, b ~ E*^(-1/3), p0 ~ E*^(2/3), approach ~ E*^(-2/3)
    of_steel = hertz.contact_ellipse(curvature_x=66.0, curvature_y=33.0, **RIG)
    modulus = RIG["effective_modulus"] * stiff
    patch = hertz.contact_ellipse(curvature_x=66.0, curvature_y=33.0, **{**RIG, "effective_modulus": modulus})
    assert float(patch.a) == pytest.approx(float(of_steel.a) / np.cbrt(stiff), rel=1e-12)
    assert float(patch.p0) == pytest.approx(float(of_steel.p0) * np.cbrt(stiff) ** 2, rel=1e-12)
    assert float(patch.approach) == pytest.approx(float(of_steel.approach) / np.cbrt(stiff) ** 2, rel=1e-12)


def test_slender_patch_tends_to_the_line_contact():
    long = hertz.contact_ellipse(curvature_x=66.0, curvature_y=np.array([1e-6, 1e-12]), **RIG)
    line = line_contact(
        curvature=66.0, normal_load=0.75 * 72.0, width=long.b, effective_modulus=RIG["effective_modulus"]
    )
    assert long.a == pytest.approx(line.a, rel=2e-7)
    assert long.p0 == pytest.approx(line.p0, rel=2e-7)


def test_straight_profile_is_the_limit_of_an_endless_line():
    flat = hertz.contact_ellipse(curvature_x=66.0, curvature_y=[0.0, 10.0], **RIG)
    assert (flat.a[0], flat.b[0], flat.p0[0], flat.approach[0]) == (0.0, np.inf, 0.0, 0.0)
    assert np.isfinite(flat.b[1])
