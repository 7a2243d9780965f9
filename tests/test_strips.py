"""The strip form of normal contact against Hertz, CONTACT's worn profile, and its own limits.

Worn profile and its patch: CONTACT, open-source release of 2025-07-23, revision 2707, elements of 1.25 by 2.5 um.
"""

import numpy as np
import pytest

from table_makers.strips import semi_width, solve_strips
from twindisc_cli.physics import hertz
from twindisc_cli.physics.half_space import CoarseGridError, DataEdgeError, NoContactError, ProfileError
from twindisc_cli.physics.half_space.strips import Strips, equivalent_ellipse

SHEAR_MODULUS, POISSON = 79.3e9, 0.3
RIG = {
    "curvature_x": 2.0 / 30e-3,
    "normal_load": 72.0,
    "effective_modulus": SHEAR_MODULUS / (1.0 - POISSON),
}
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


def worn_gap(y):
    """Flat of nominally 0.6 mm with smooth shoulders on a transverse radius of 30 mm [m]."""
    depth, smoothing = 1.5e-6, 0.1
    return smoothing * depth * np.logaddexp(0.0, (y**2 / 60e-3 - depth) / (smoothing * depth))


@pytest.mark.parametrize("strips", [128, 200, 256])
def test_sphere_on_cylinder_is_hertz(strips):
    y = np.linspace(-0.6e-3, 0.6e-3, strips)
    contact = solve_strips(y=y, gap=y**2 / 60e-3, **RIG)
    found = (contact.half_length.max(), semi_width(contact), contact.peak_pressure, contact.approach)
    assert found == pytest.approx(HERTZ, rel=5e-3)
    assert contact.area == pytest.approx(np.pi * HERTZ[0] * HERTZ[1], rel=5e-3)


def test_one_side_of_a_symmetric_track_is_all_of_it():
    """Mirror images press on each other as the other half of the same problem does, in its rows for y >= 0."""
    y = np.arange(-80, 81) * 7.5e-6
    compliance = 1e-12 / 72.0 * np.exp(-0.5 * ((y[:, None] - y) / 5e-5) ** 2)
    whole = solve_strips(y=y, gap=worn_gap(y), compliance=compliance, relative_accuracy=1e-10, **RIG)
    half = compliance[80:, 80:].copy()
    half[:, 1:] += compliance[80:, :80][:, ::-1]
    side = Strips.of(y=y[80:], mirrored=True, **RIG)
    one = side.pressed(worn_gap(y[80:]), compliance=half, relative_accuracy=1e-10)
    assert one.line_load == pytest.approx(whole.line_load[80:], rel=1e-9, abs=1e-9 * whole.line_load.max())
    assert one.half_length == pytest.approx(whole.half_length[80:], rel=1e-9)
    assert one.approach == pytest.approx(float(whole.approach), rel=1e-9)


@pytest.mark.parametrize("strips", [160, 161])
def test_both_sides_of_a_symmetric_gap_are_solved_as_one(strips):
    """What breaks the symmetry by less than counts finds the same on all strips."""
    y = np.linspace(-0.6e-3, 0.6e-3, strips)
    given = {"y": y, "relative_accuracy": 1e-10, **RIG}
    one, other = (solve_strips(gap=worn_gap(y) + tilt * y, **given) for tilt in (0.0, 1e-12))
    assert np.array_equal(one.line_load, one.line_load[::-1])
    assert one.line_load == pytest.approx(other.line_load, rel=1e-6, abs=1e-6 * other.line_load.max())
    assert one.half_length == pytest.approx(other.half_length, rel=1e-6, abs=1e-6 * other.half_length.max())
    assert float(one.approach) == pytest.approx(float(other.approach), rel=1e-9)


@pytest.mark.parametrize("strips", [128, 256])
def test_worn_flat_agrees_with_contact(strips):
    y = np.linspace(-0.6e-3, 0.6e-3, strips)
    contact = solve_strips(y=y, gap=worn_gap(y), **RIG)
    assert contact.peak_pressure == pytest.approx(723.2e6, rel=0.01)
    assert abs(y[np.argmax(contact.centre_pressure)]) == pytest.approx(0.296e-3, abs=np.diff(y)[0])
    assert np.interp(0.0, y, contact.centre_pressure) == pytest.approx(467e6, rel=0.01)
    assert semi_width(contact) == pytest.approx(0.355e-3, rel=0.01)
    assert contact.area == pytest.approx(0.173937e-6, rel=0.01)
    assert contact.approach == pytest.approx(1.59113e-6, rel=0.002)


def test_outline_and_pressure_of_the_worn_flat_agree_with_contact():
    y = np.linspace(-0.6e-3, 0.6e-3, 256)
    contact = solve_strips(y=y, gap=worn_gap(y), **RIG)
    for at, half_length, pressure, line_load in WORN_OUTLINE:
        # The outline is known to one element of 1.25 um.
        assert np.interp(at * 1e-3, y, contact.half_length) == pytest.approx(half_length * 1e-3, abs=2e-6)
        assert np.interp(at * 1e-3, y, contact.centre_pressure) == pytest.approx(pressure * 1e6, rel=0.01)
        assert np.interp(at * 1e-3, y, contact.line_load) == pytest.approx(line_load * 1e3, rel=0.01)


def test_equivalent_ellipse_of_an_ellipse_is_itself_and_of_the_flat_rolls_as_stiffly():
    y = np.linspace(-0.6e-3, 0.6e-3, 256)
    both = solve_strips(y=y, gap=np.stack([y**2 / 60e-3, worn_gap(y)]), **RIG)
    a, b = equivalent_ellipse(both)
    assert (a[0], b[0]) == pytest.approx(HERTZ[:2], rel=5e-3)
    # CONTACT: T/N = 0.11159 on the flat at mu = 0.6, creepage 0.05 % (elements as above, 0.0003 above the limit). All
    # strips with Carter's stick zone, 1 - c/a = creepage a / (mu q L), carry N mu (1 - (c/a)^2). C11(0.363) = 3.705.
    flexibility = 8.0 * a[1] / (3.0 * 3.705 * SHEAR_MODULUS)
    loaded = both.line_load[1] > 0.0
    load, length = both.line_load[1][loaded], both.half_length[1][loaded]
    slip = np.minimum(1.0, 5e-4 * length**2 / (0.6 * load * flexibility))
    traction = (0.6 * load * (1.0 - (1.0 - slip) ** 2)).sum() * both.strip_width
    assert traction / 72.0 == pytest.approx(0.1113, rel=0.01)


def test_long_cylinder_is_the_line_contact_of_hertz():
    """Far from the ends a^2 = 4 q R / (pi E*): the ends of a 4 mm long crowned roller disturb little of its middle."""
    y = np.linspace(-2.4e-3, 2.4e-3, 160)
    contact = solve_strips(
        y=y, gap=(y / 2e-3) ** 12 * 2e-6, curvature_x=200.0, normal_load=100.0, effective_modulus=113e9
    )
    middle = np.argmin(np.abs(y))
    expected = np.sqrt(4.0 * contact.line_load[middle] / (np.pi * 113e9 * 200.0))
    assert contact.half_length[middle] == pytest.approx(expected, rel=2e-3)


def test_load_is_carried_and_nothing_overlaps_for_two_patches():
    y = np.linspace(-1.2e-3, 1.2e-3, 256)
    gap = np.minimum((y - 0.5e-3) ** 2, (y + 0.5e-3) ** 2 + 8e-9) / 20e-3
    contact = solve_strips(y=y, gap=gap, **RIG)
    loaded = contact.line_load > 0.0
    assert contact.normal_load == pytest.approx(72.0, rel=1e-12)
    assert np.count_nonzero(np.diff(loaded.astype(int)) == 1) == 2
    assert not loaded[np.abs(y) < 0.1e-3].any()
    assert contact.line_load[y > 0].sum() > contact.line_load[y < 0].sum()


def test_shift_and_mirror_of_the_profile_shift_and_mirror_the_patch():
    y = np.linspace(-0.8e-3, 0.8e-3, 161)
    step = y[1] - y[0]
    gap = worn_gap(y - 7 * step) + 1e-3 * y
    one = solve_strips(y=y, gap=gap, relative_accuracy=1e-8, **RIG)
    other = solve_strips(y=y, gap=gap[::-1], relative_accuracy=1e-8, **RIG)
    assert np.allclose(one.line_load, other.line_load[::-1], rtol=1e-5, atol=1.0)
    assert one.extent[0] == pytest.approx(-other.extent[1], abs=1e-9)


def test_leading_dimensions_are_independent_contacts():
    y = np.linspace(-0.6e-3, 0.6e-3, 96)
    gaps = np.stack([y**2 / 60e-3, worn_gap(y), worn_gap(y - 0.1e-3)])[:, None, :]
    loads = np.array([20.0, 72.0, 150.0, 100.0])
    both = solve_strips(y=y, gap=gaps, **RIG | {"normal_load": loads}, relative_accuracy=1e-7)
    assert both.line_load.shape == (3, 4, 96)
    for i, k in ((0, 2), (1, 0), (2, 3)):
        alone = solve_strips(y=y, gap=gaps[i, 0], **RIG | {"normal_load": loads[k]}, relative_accuracy=1e-7)
        assert np.allclose(both.half_length[i, k], alone.half_length, rtol=1e-5, atol=1e-9)
        assert both.approach[i, k] == pytest.approx(alone.approach, rel=1e-6)


def test_a_contact_ends_by_itself_whatever_is_solved_beside_it():
    y = np.linspace(-0.6e-3, 0.6e-3, 200)
    gaps = np.stack([y**2 / 60e-3, worn_gap(y), y**2 / 40e-3 + 2e-7 * np.cos(5e4 * y)])
    together = solve_strips(y=y, gap=gaps, relative_accuracy=0.05, **RIG)
    for number, gap in enumerate(gaps):
        alone = solve_strips(y=y, gap=gap, relative_accuracy=0.05, **RIG)
        largest = alone.line_load.max()
        assert together.line_load[number] == pytest.approx(alone.line_load, rel=1e-9, abs=1e-9 * largest)
        assert together.approach[number] == pytest.approx(float(alone.approach), rel=1e-9)


def test_warm_start_changes_nothing_but_the_time():
    y = np.linspace(-0.6e-3, 0.6e-3, 96)
    before = solve_strips(y=y, gap=y**2 / 60e-3, **RIG)
    cold = solve_strips(y=y, gap=worn_gap(y), relative_accuracy=1e-8, **RIG)
    warm = solve_strips(y=y, gap=worn_gap(y), relative_accuracy=1e-8, start=before, **RIG)
    assert np.allclose(cold.line_load, warm.line_load, rtol=1e-5, atol=1.0)


def test_far_patch_that_comes_into_contact_is_found_from_a_start_without_it():
    y = np.linspace(-1.2e-3, 1.2e-3, 256)
    one = (y - 0.7e-3) ** 2 / 20e-3
    before = solve_strips(y=y, gap=one, **RIG)
    gap = np.minimum(one, (y + 0.7e-3) ** 2 / 20e-3 + 0.3e-6)
    warm = solve_strips(y=y, gap=gap, start=before, relative_accuracy=1e-7, **RIG)
    cold = solve_strips(y=y, gap=gap, relative_accuracy=1e-7, **RIG)
    assert warm.line_load[y < 0.0].max() > 1e4
    assert np.allclose(warm.line_load, cold.line_load, rtol=1e-3, atol=1.0)


def test_gap_that_grows_with_its_load_is_solved_along():
    y = np.linspace(-0.6e-3, 0.6e-3, 120)
    growth = 2e-12 * np.eye(y.size)
    implicit = solve_strips(y=y, gap=y**2 / 60e-3, compliance=growth, relative_accuracy=1e-8, **RIG)
    worn = y**2 / 60e-3 + growth @ implicit.line_load
    explicit = solve_strips(y=y, gap=worn, relative_accuracy=1e-8, **RIG)
    assert np.allclose(implicit.line_load, explicit.line_load, rtol=1e-5, atol=1.0)


def test_errors_say_what_is_wrong():
    y = np.linspace(-0.2e-3, 0.2e-3, 64)
    with pytest.raises(DataEdgeError, match="end of the profile"):
        solve_strips(y=y, gap=y**2 / 60e-3, **RIG)
    with pytest.raises(CoarseGridError, match="strips carry load"):
        solve_strips(y=8.0 * y, gap=64.0 * y**2 / 60e-3, **RIG | {"normal_load": 1.0})
    with pytest.raises(ProfileError, match="NaN"):
        solve_strips(y=y, gap=np.where(y > 0, np.nan, 0.0), **RIG)
    with pytest.raises(ProfileError, match="equal steps"):
        solve_strips(y=y**3, gap=y**2 / 60e-3, **RIG)
    with pytest.raises(NoContactError, match="positive"):
        solve_strips(y=y, gap=y**2 / 60e-3, **RIG | {"normal_load": 0.0})


@pytest.mark.parametrize("strips", [121, 241, 481])
@pytest.mark.parametrize("crown", [20.0, 200.0, 1000.0])
def test_patches_far_longer_than_wide_settle(crown: float, strips: int) -> None:
    """a/b of 6.9, 27 and 68, in strips a hundredth to a thousandth as wide as long: Hertz within 1 %."""
    expected = hertz.contact_ellipse(
        curvature_x=33.0, curvature_y=33.0 * crown, normal_load=72.0, effective_modulus=113e9
    )
    y = np.linspace(-1.6, 1.6, strips) * float(expected.b)
    found = solve_strips(y=y, gap=16.5 * crown * y**2, curvature_x=33.0, normal_load=72.0, effective_modulus=113e9)
    assert float(found.peak_pressure) == pytest.approx(float(expected.p0), rel=0.01)
    assert float(found.half_length.max()) == pytest.approx(float(expected.a), rel=0.01)
