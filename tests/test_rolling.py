"""Exact steady rolling, against closed forms and against CONTACT on the same grids.

CONTACT: open-source release 2025-07-23, rev 2707, double precision. The rig: a = 0.170591303 mm along rolling,
b = 0.270524050 mm, p0 = 744.92254 MPa, G = 79.3 GPa, nu = 0.3, N = 72 N, mu = 0.6, V = 9.42 m/s.
"""

import numpy as np
import pytest
from rigs import solve_rolling
from scipy.optimize import brentq

from twindisc_cli.physics.half_space import NoConvergenceError, ProfileError, rolling
from twindisc_cli.physics.half_space.influence_tangential import strain_by_pressure, straining
from twindisc_cli.physics.half_space.normal import solve_gap

A, B, P0 = 0.170591303e-3, 0.270524050e-3, 744.9225410e6
G, NU, LOAD, MU, SPEED = 79.3e9, 0.3, 72.0, 0.6, 9.42


def centres(n, guard=0):
    """Centres of n elements over -1 ... 1, and `guard` more on each side."""
    return (2.0 * np.arange(-guard, n + guard) + 1.0) / n - 1.0


def hertz(n, guard=0):
    x, y = A * centres(n, guard), B * centres(n, guard)
    return x, y, P0 * np.sqrt(np.maximum(0.0, 1.0 - (x / A) ** 2 - (y[:, None] / B) ** 2))


def solve(x, y, pressure, **given):
    given = {"mu": MU, "shear_modulus": G, "poisson": NU, "creepage_x": 0.0, **given}
    return solve_rolling(x=x, y=y, pressure=pressure, **given)


# --- the operator -----------------------------------------------------------------------------------------------------


def mindlin(n):
    """A hemisphere of tractions q0 sqrt(1 - r^2), q0 = G, along x on a unit circle inside a wider grid."""
    x = 1.25 * centres(n)
    return x, np.stack([np.sqrt(np.maximum(0.0, 1.0 - x**2 - x[:, None] ** 2)), np.zeros((n, n))])


def test_strain_under_a_hemisphere_of_tractions():
    """Johnson, Contact Mechanics, Eq. 3.91: quadratic displacement, doubled since both bodies deform."""
    errors = []
    for n in (40, 80, 160):
        x, tractions = mindlin(n)
        ahead = x + 0.5 * (x[1] - x[0])
        strain = straining(shape=(n, n), aspect=1.0, poisson=NU)(tractions)
        inside = ahead**2 + x[:, None] ** 2 < 0.5
        expected = np.stack([(4.0 - 3.0 * NU) * ahead + 0.0 * x[:, None], -NU * x[:, None] + 0.0 * x]) * np.pi / 8.0
        errors.append(np.sqrt(np.mean((strain - expected)[:, inside] ** 2)))
    assert errors[-1] < 1e-3
    assert np.log2(errors[0] / errors[2]) / 2.0 > 1.3


def test_cattaneos_tractions_leave_the_stick_circle_unstrained():
    """Cattaneo-Mindlin: a hemisphere minus a smaller one, q = sqrt(1 - r^2) - c sqrt(1 - (r/c)^2), sticks in r < c."""
    c, residues = 0.6, []
    for n in (40, 80, 160):
        x, outer = mindlin(n)
        inner = c * np.sqrt(np.maximum(0.0, 1.0 - (x**2 + x[:, None] ** 2) / c**2))
        strain = straining(shape=(n, n), aspect=1.0, poisson=NU)(outer - np.stack([inner, 0.0 * inner]))
        sticks = x**2 + x[:, None] ** 2 < (0.7 * c) ** 2
        residues.append(np.sqrt(np.mean(strain[:, sticks] ** 2)))
        assert np.abs(strain[0, n // 2, np.abs(x) > 0.9]).min() > 0.1
    assert residues[-1] < 1e-3
    assert np.log2(residues[0] / residues[2]) / 2.0 > 1.3


def test_normal_pressure_strains_dissimilar_bodies():
    """Under a line load the strain along rolling is 2 K p / G everywhere in the patch."""
    n = 200
    pressure = np.tile(np.sqrt(1.0 - centres(n) ** 2), (2, 1))
    strain = strain_by_pressure(pressure, aspect=2.0 / n / 5000.0)
    middle = 0.5 * (pressure[0, 1:] + pressure[0, :-1])
    np.testing.assert_allclose(strain[0, 0, 10:-11], -2.0 * middle[10:-10], rtol=2e-3)


# --- line contact: closed forms ---------------------------------------------------------------------------------------


def line_contact(n, *, a, load, width):
    """Semi-elliptic pressure [Pa] of a line load [N/m] on two rows that together are far longer than wide."""
    x, y = a * centres(n), width * np.array([-0.25, 0.25])
    return x, y, np.tile(2.0 * load / (np.pi * a) * np.sqrt(1.0 - centres(n) ** 2), (2, 1))


def test_carter_converges_at_first_order():
    """Carter: T/(mu N) = 1 - (1 - vx R/(mu a))^2 and stick over 1 - vx R/(mu a) of the patch; 0.64 here."""
    a, radius, mu, creepage, width, load = 1e-3, 0.5, 0.3, 2.4e-4, 0.2, 178.9e3
    expected = 1.0 - (1.0 - creepage * radius / (mu * a)) ** 2
    errors = []
    for n in (50, 100, 200, 400):
        x, y, pressure = line_contact(n, a=a, load=load, width=width)
        found = solve(x, y, pressure, mu=mu, shear_modulus=82e9, poisson=0.28, creepage_x=creepage)
        errors.append(found.force_x / (mu * pressure.sum() * found.element_area) - expected)
        assert found.stick_fraction == pytest.approx(1.0 - creepage * radius / (mu * a), abs=1.0 / n)
    assert errors[-1] < 1e-3
    np.testing.assert_allclose(np.log2(np.array(errors[:-1]) / errors[1:]), 1.0, atol=0.1)


def bentall_johnson(creepage, *, mu, n=200):
    """Aluminium on steel, R = 50 mm both, 16201.9 N/m: Fx/(mu N)."""
    g, nu, k = 35924e6, 0.3034, 0.100191
    x, y, pressure = line_contact(n, a=0.1e-3, load=16201.9, width=1.0)
    found = solve(
        x, y, pressure, mu=mu, shear_modulus=g, poisson=nu, creepage_x=creepage, stiffness_difference=k, tolerance=1e-7
    )
    return found.force_x / (mu * 16201.9)


def test_bentall_johnson_free_rolling_nearly_without_friction():
    """The slip -vx = 2 K p / G must change sign where half of the load lies inside: 5.259e-4 (Bentall and Johnson)."""
    x = brentq(lambda t: 2.0 / np.pi * (t * np.sqrt(1.0 - t**2) + np.arcsin(t)) - 0.5, 0.0, 1.0)
    closed = 2.0 * 0.100191 / 35924e6 * np.sqrt(1.0 - x**2) * 2.0 * 16201.9 / (np.pi * 1e-4)
    assert closed == pytest.approx(5.259e-4, rel=2e-3)
    found = brentq(lambda v: bentall_johnson(-v, mu=1e-4, n=400), 4e-4, 6e-4, xtol=1e-8)
    assert found == pytest.approx(closed, rel=2e-3)


@pytest.mark.parametrize(("share", "creepage"), [(0.0, 4.294e-4), (-0.75, 5.392e-4), (0.75, 2.108e-4)])
def test_bentall_johnson_with_traction(share, creepage):
    """CONTACT, mu = 0.05; it also lets the tractions change the pressure, which is left out here (pmax + 0.5 %)."""
    found = brentq(lambda v: bentall_johnson(-v, mu=0.05) - share, 1e-4, 7e-4, xtol=1e-8)
    assert found == pytest.approx(creepage, abs=0.01 * 4.294e-4)


# --- CONTACT on the same grids ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("n", "creepage", "ratio"),
    [
        (30, 0.001, 0.18556941),
        (30, 0.004, 0.52124330),
        (60, 1e-5, 0.00201093),
        (60, 0.001, 0.18273090),
        (60, 0.002, 0.32835067),
        (60, 0.004, 0.51753040),
        (60, 0.006, 0.59236568),
        (120, 0.002, 0.32670419),
    ],
)
def test_traction_on_a_prescribed_hertz_pressure(n, creepage, ratio):
    found = solve(*hertz(n), creepage_x=creepage)
    assert found.force_x / LOAD == pytest.approx(ratio, rel=5e-5)
    assert found.force_y == pytest.approx(0.0, abs=1e-5 * LOAD)


@pytest.mark.parametrize(
    ("creepage", "ratio"),
    [(0.0005, 0.095199), (0.001, 0.180840), (0.002, 0.324956), (0.004, 0.513430), (0.006, 0.590521)],
)
def test_the_limit_and_its_error(creepage, ratio):
    """CONTACT, 60 and 120 elements carried to the limit (its estimated error 3e-4)."""
    coarse, fine = (solve(*hertz(n), creepage_x=creepage).force_x / LOAD for n in (60, 120))
    limit, error = rolling.limit(coarse, fine)
    assert limit == pytest.approx(ratio, abs=0.001)
    assert abs(limit - ratio) - 3e-4 < error < 0.002


def test_any_friction_gives_one_curve():
    low, high = (solve(*hertz(40), mu=mu, creepage_x=0.003 * mu) for mu in (0.05, 0.7))
    assert low.force_x / 0.05 == pytest.approx(high.force_x / 0.7, rel=1e-4)


@pytest.fixture(scope="module")
def pressed():
    """The normal contact of the rig on 60 by 60 elements and two more around, by this package's own solver."""
    x, y = A * centres(60, guard=2), B * centres(60, guard=2)
    gap = x**2 / 0.03 + y[:, None] ** 2 / 0.06
    return solve_gap(x=x, y=y, gap=gap, normal_load=LOAD, effective_modulus=G / (1.0 - NU))


# vx, vy, spin [rad/mm], then CONTACT's Fx, Fy [N], Mz [N mm] on 120 and on 60 elements
COMBINED = np.loadtxt(
    """
0 0 0.0023274943  0.000000 -1.997604 -0.610614  -0.000000 -2.013337 -0.618147
0 0 0.013964966  -0.000000 -11.165021 -2.649937  -0.000000 -11.230336 -2.671588
0 0.001 -0.013964966  0.000000 1.287046 3.123427  0.000000 1.313431 3.144789
0 0.003 0.0023274943  -0.000000 -28.805466 0.578243  -0.000000 -28.962350 0.563204
0 0.01 0.013964966  -0.000000 -42.818374 -0.690649  -0.000000 -42.816874 -0.691923
0.001 0.001 0  -12.646591 -10.412060 0.547335  -12.724631 -10.475068 0.544409
0.001 0.003 0.013964966  -8.662749 -33.606707 -1.477568  -8.670074 -33.685934 -1.492745
0.001 0.01 -0.0023274943  -4.665825 -42.845285 0.352987  -4.667888 -42.845336 0.352660
0.002 0.001 0.013964966  -18.640139 -19.470336 -1.769832  -18.666526 -19.550386 -1.784491
0.002 0.003 -0.0023274943  -20.082525 -23.819801 1.107216  -20.188481 -23.937206 1.098328
0.002 0.01 -0.0023274943  -9.146483 -42.122040 0.334959  -9.151063 -42.121468 0.334558
0.005 0.001 0.013964966  -37.227629 -14.926338 -0.743359  -37.294950 -14.966448 -0.742508
0.005 0.01 0  -20.145011 -38.181843 0.131327  -20.157768 -38.175686 0.130587
0.01 0 0.0023274943  -43.164232 -0.529152 -0.051726  -43.164441 -0.528829 -0.051334
0.01 0.003 0  -41.529654 -11.797136 0.021913  -41.532280 -11.788915 0.021212
0.01 0.01 0  -31.025303 -30.032803 0.065939  -31.037722 -30.020427 0.065258
""".strip().splitlines()
)


@pytest.mark.parametrize("row", COMBINED, ids=lambda row: "{:g} {:g} {:.3g}".format(*row))
def test_combined_creepages(pressed, row):
    found = solve(pressed.x, pressed.y, pressed.pressure, creepage_x=row[0], creepage_y=row[1], spin=row[2] * 1e3)
    capacity, arm = MU * LOAD, np.sqrt(A * B)
    assert found.force_x == pytest.approx(-row[6], abs=5e-5 * capacity)
    assert found.force_y == pytest.approx(-row[7], abs=5e-5 * capacity)
    assert found.moment * 1e3 == pytest.approx(-row[8], abs=5e-5 * capacity * arm * 1e3)


@pytest.mark.parametrize("row", COMBINED[[2, 8, 12]], ids=lambda row: "{:g} {:g} {:.3g}".format(*row))
def test_combined_creepages_on_a_fine_grid(row):
    found = solve(*hertz(120), creepage_x=row[0], creepage_y=row[1], spin=row[2] * 1e3)
    capacity, arm = MU * LOAD, np.sqrt(A * B)
    assert found.force_x == pytest.approx(-row[3], abs=5e-4 * capacity)
    assert found.force_y == pytest.approx(-row[4], abs=5e-4 * capacity)
    assert found.moment * 1e3 == pytest.approx(-row[5], abs=5e-4 * capacity * arm * 1e3)


def test_field_of_figure_4(pressed):
    """CONTACT, 60 by 60: 1856 of 2848 elements stick, peak traction 395.740 MPa at x = -0.0768, y = -0.0316 mm."""
    found = solve(pressed.x, pressed.y, pressed.pressure, creepage_x=0.002)
    size = np.hypot(*found.traction)
    assert found.contact.sum() == 2848
    assert found.slipping.sum() == pytest.approx(992, abs=4)
    assert size.max() == pytest.approx(395.740e6, rel=1e-4)
    row, column = np.unravel_index(size.argmax(), size.shape)
    assert 1e3 * found.x[column] == pytest.approx(-0.076766, abs=1e-5)
    assert 1e3 * abs(found.y[row]) == pytest.approx(0.031561, abs=1e-5)


def test_field_of_figure_4_in_the_limit():
    """Stick fraction 0.655 and peak traction 397.5 MPa on fine grids."""
    found = solve(*hertz(120), creepage_x=0.002)
    assert found.stick_fraction == pytest.approx(0.655, rel=0.01)
    assert np.hypot(*found.traction).max() == pytest.approx(397.5e6, rel=0.01)


def worn_patch():
    """The worn profile with a flat of 0.6 mm, elements of 0.005 by 0.01 mm, E* = G/(1 - nu)."""
    x, y = 5e-6 * (np.arange(72) - 35.5), 1e-5 * (np.arange(92) - 45.5)
    depth, smooth = 1.5e-3, 1.5e-4
    across = smooth * np.log1p(np.exp(((1e3 * y) ** 2 / 60.0 - depth) / smooth)) * 1e-3
    return solve_gap(x=x, y=y, gap=x**2 / 0.03 + across[:, None], normal_load=LOAD, effective_modulus=G / (1.0 - NU))


@pytest.mark.parametrize(("creepage", "ratio"), [(0.0005, 0.11271757), (0.002, 0.37720725), (0.01, 0.59980270)])
def test_worn_profile(creepage, ratio):
    contact = worn_patch()
    found = solve(contact.x, contact.y, contact.pressure, creepage_x=creepage)
    assert found.force_x / LOAD == pytest.approx(ratio, rel=1e-3)


# --- laws -------------------------------------------------------------------------------------------------------------

CASES = [(0.002, 0.0, 0.0), (0.002, -0.001, 14.0e0), (0.0, 0.0, 2.3), (-0.005, 0.003, 14.0), (0.02, 0.0, 0.0)]


@pytest.mark.parametrize("creepage", CASES)
def test_coulomb_and_stick(creepage):
    vx, vy, spin = creepage
    x, y, pressure = hertz(40)
    found = solve(x, y, pressure, creepage_x=vx, creepage_y=vy, spin=spin, tolerance=1e-7)
    size, strain = (
        np.hypot(*found.traction),
        straining(shape=(40, 40), aspect=(x[1] - x[0]) / (y[1] - y[0]), poisson=NU),
    )
    ahead = x + (x[1] - x[0]) / 6.0
    slip = np.stack([vx - spin * y[:, None] + 0 * x, vy + spin * ahead + 0 * y[:, None]]) - strain(found.traction / G)
    assert (size <= found.bound * (1.0 + 1e-9)).all()
    np.testing.assert_allclose(size[found.slipping], found.bound[found.slipping], rtol=1e-9)
    sticks = found.contact & ~found.slipping
    scale = np.abs(slip[:, found.contact]).max()
    assert np.abs(slip[:, sticks]).max(initial=0.0) < 1e-5 * scale
    along = (found.traction * slip).sum(axis=0) / np.where(size > 0.0, size, 1.0)
    np.testing.assert_allclose(along[found.slipping], np.hypot(*slip)[found.slipping], atol=1e-5 * scale)


@pytest.mark.parametrize("creepage", CASES)
def test_dissipation_balances_the_work_of_the_forces(creepage):
    vx, vy, spin = creepage
    x, y, pressure = hertz(40)
    found = solve(x, y, pressure, creepage_x=vx, creepage_y=vy, spin=spin)
    work = vx * found.force_x + vy * found.force_y + spin * found.moment
    assert found.dissipation.sum() * (y[1] - y[0]) == pytest.approx(work, rel=1e-12)
    assert (found.dissipation >= -1e-4 * found.dissipation.max()).all()


def test_dissipation_per_length_in_full_sliding():
    """P_l(y) = mu V vx times the load per length, when everything slides and the tractions hardly turn the slip."""
    x, y, pressure = hertz(60)
    found = solve(x, y, pressure, creepage_x=0.5)
    per_length = 0.5 * np.pi * P0 * A * (1.0 - (y / B) ** 2)
    expected = MU * SPEED * 0.5 * per_length
    np.testing.assert_allclose((SPEED * found.dissipation)[1:-1], expected[1:-1], rtol=0.01)


@pytest.mark.parametrize("ratio", [0.05, 20.0])
@pytest.mark.parametrize("poisson", [0.0, 0.5])
def test_slender_patches(ratio, poisson):
    """Elements twenty times longer than wide, or the other way round, still converge and balance."""
    x, y = np.sqrt(ratio) * centres(40), centres(40) / np.sqrt(ratio)
    pressure = np.sqrt(np.maximum(0.0, 1.0 - x**2 / ratio - y[:, None] ** 2 * ratio))
    given = {"creepage_x": 2e-4, "creepage_y": 1e-4, "spin": 2e-4}
    found = solve(x, y, pressure, mu=1e-3, shear_modulus=1.0, poisson=poisson, **given)
    work = 2e-4 * found.force_x + 1e-4 * found.force_y + 2e-4 * found.moment
    assert found.dissipation.sum() * (y[1] - y[0]) == pytest.approx(work, rel=1e-10)
    assert 0.1 < np.hypot(found.force_x, found.force_y) / (1e-3 * pressure.sum() * found.element_area) < 1.0


def test_mirror_images():
    """y to -y turns lateral force and moment; the sign of all creepages turns everything."""
    one, mirrored, opposite = (
        solve(*hertz(30), creepage_x=sx * 0.002, creepage_y=sy * 0.001, spin=sy * 5.0, tolerance=1e-7)
        for sx, sy in ((1, 1), (1, -1), (-1, -1))
    )
    for other, signs in ((mirrored, (1, -1, -1)), (opposite, (-1, -1, -1))):
        np.testing.assert_allclose(
            [other.force_x, other.force_y, other.moment * 1e4],
            np.array(signs) * [one.force_x, one.force_y, one.moment * 1e4],
            rtol=1e-5,
        )


def test_a_start_near_by_changes_nothing_but_the_way():
    x, y, pressure = hertz(40)
    first = solve(x, y, pressure, creepage_x=0.002)
    again = solve(x, y, pressure, creepage_x=0.0021, start=first.traction)
    assert again.force_x == pytest.approx(solve(x, y, pressure, creepage_x=0.0021).force_x, rel=1e-4)


# --- friction that falls with the local slip --------------------------------------------------------------------------


def falling(ratio, decay):
    """Polach's mu over the slip relative to the rolling speed."""
    return lambda slip: MU * (ratio + (1.0 - ratio) * np.exp(-decay * SPEED * slip))


def test_a_law_of_the_local_slip_without_a_drop_is_one_mu():
    x, y, pressure = hertz(30)
    given = {"creepage_x": 0.002, "spin": 4.0, "tolerance": 1e-5}
    one, law = (solve(x, y, pressure, mu=mu, **given) for mu in (MU, falling(1.0, 2.0)))
    np.testing.assert_allclose(law.traction, one.traction, atol=1e-9 * P0)


@pytest.mark.parametrize(("creepage", "off"), [(0.02, 2e-3), (0.08, 7e-4)])
def test_in_full_slip_the_local_slip_is_the_rigid_one(creepage, off):
    """The strain that is added to it is odd along rolling: its mean under the pressure, and the first order, vanish."""
    x, y, pressure = hertz(40)
    law = falling(0.4, 2.0)
    found = solve(x, y, pressure, creepage_x=creepage, mu=law)
    assert law(creepage) < 0.85 * MU
    assert found.force_x / (pressure.sum() * found.element_area) == pytest.approx(float(law(creepage)), rel=off)
    local = found.bound[found.contact] / pressure[found.contact]
    assert np.ptp(local) > 10.0 * off * MU


@pytest.mark.parametrize(("ratio", "decay"), [(0.6, 2.0), (0.3, 10.0)])
def test_where_it_slips_the_traction_is_that_of_the_local_slip(ratio, decay):
    """Stick below mu at rest, t = mu(|s|) p s / |s| elsewhere."""
    x, y, pressure = hertz(40)
    law = falling(ratio, decay)
    found = solve(x, y, pressure, creepage_x=0.002, creepage_y=0.0005, spin=3.0, mu=law)
    strain = straining(shape=pressure.shape, aspect=(x[1] - x[0]) / (y[1] - y[0]), poisson=NU)
    rigid = np.stack(np.broadcast_arrays(0.002 - 3.0 * y[:, None], 0.0005 + 3.0 * (x + (x[1] - x[0]) / 6.0)))
    slip = rigid - strain(found.traction / G)
    size = np.hypot(*slip)
    wanted = law(size) * pressure * slip / np.where(size > 0.0, size, 1.0)
    np.testing.assert_allclose(found.traction[:, found.slipping], wanted[:, found.slipping], atol=1e-3 * MU * P0)
    sticks = found.contact & ~found.slipping
    assert sticks.any() and (np.hypot(*found.traction)[sticks] <= MU * pressure[sticks] * (1.0 + 1e-6)).all()
    assert size[sticks].max() < 1e-3 * size.max()


def test_at_rest_nothing_is_transmitted():
    found = solve(*hertz(30))
    assert found.force_x == 0.0
    assert found.stick_fraction == 1.0


@pytest.mark.parametrize("spoil", ["nan", "negative", "empty", "grid", "size"])
def test_bad_input(spoil):
    x, y, pressure = hertz(20)
    if spoil == "nan":
        pressure[3, 4] = np.nan
    elif spoil == "negative":
        pressure[3, 4] = -1.0
    elif spoil == "empty":
        pressure[:] = 0.0
    elif spoil == "grid":
        x = np.sort(x**3)
    else:
        y = y[:-1]
    with pytest.raises(ProfileError):
        solve(x, y, pressure, creepage_x=0.002)


def test_an_impossible_tolerance_is_an_error_and_no_number():
    with pytest.raises(NoConvergenceError):
        solve(*hertz(20), creepage_x=0.002, tolerance=1e-30)


def test_friction_that_falls_too_steeply_is_an_error_and_no_number():
    with pytest.raises(NoConvergenceError, match="steeply"):
        solve(*hertz(40), creepage_x=0.002, creepage_y=0.0005, spin=3.0, mu=falling(0.05, 60.0))


def test_steps_in_single_precision_end_where_double_precision_does():
    """Only the residual, in double precision, says what is solved: T/N comes to 1e-9 and less of itself."""
    rough, fine = (solve(*hertz(30), creepage_x=0.002, spin=5.0, tolerance=t) for t in (1e-5, 1e-11))
    assert fine.residual < 1e-11
    assert rough.force_x == pytest.approx(fine.force_x, rel=1e-5)
    again = solve(*hertz(30), creepage_x=0.002, spin=5.0, tolerance=1e-11, start=rough.traction)
    assert again.force_x == pytest.approx(fine.force_x, rel=1e-9)


@pytest.mark.parametrize("n", [20, 40, 80])
def test_the_solver_stops_a_hundredth_of_the_grids_error_short(n):
    """The limit of T/N is 0.3255, from grids of 160 and 320 elements."""
    found, settled = (solve(*hertz(n), creepage_x=0.002, **given).force_x / LOAD for given in ({}, {"tolerance": 1e-8}))
    assert abs(found - settled) < 0.02 * abs(settled - 0.3255)
