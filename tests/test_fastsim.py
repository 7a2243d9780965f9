"""FASTSIM against CONTACT's, Kalker's published check values, its closed form, and the balance of energy."""

from dataclasses import replace

import numpy as np
import pytest
from closed_forms import traction_per_length
from scipy.integrate import quad

from twindisc_cli.physics import fastsim
from twindisc_cli.physics.kalker import coefficients

SPEED = 9.42
RIG = fastsim.Patch(
    a=0.170591303e-3,
    b=0.270524050e-3,
    normal_load=72.0,
    mu=0.6,
    shear_modulus=79.3e9,
    c11=3.9388,
    c22=3.2194,
    c23=1.0911,
)
STIFFNESS = 79.3e9 * RIG.a * RIG.b * 3.9388  # G a b C11 [N]

# T/N of CONTACT's FASTSIM, parabolic bound, 400 x 400 cells (open-source release 2025-07-23, rev 2707): mu by creepage
MU = np.array([0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7])[:, None]
CREEPAGE = np.array([1e-5, 1e-4, 5e-4, 1e-3, 2e-3, 3e-3, 5e-3, 1e-2])
# fmt: off
CONTACT = np.array(
    [
        [0.00197956, 0.01741704, 0.04768382, 0.05000002, 0.05000002, 0.05000002, 0.05000002, 0.05000002],
        [0.00199344, 0.01870931, 0.06977722, 0.09536764, 0.10000005, 0.10000005, 0.10000005, 0.10000005],
        [0.00200041, 0.01938284, 0.08398364, 0.13955444, 0.19073527, 0.19989230, 0.20000010, 0.20000010],
        [0.00200278, 0.01961181, 0.08920010, 0.15801315, 0.24597833, 0.28610291, 0.30000000, 0.30000015],
        [0.00200395, 0.01972652, 0.09189719, 0.16796728, 0.27910887, 0.34621935, 0.39608761, 0.40000019],
        [0.00200472, 0.01979558, 0.09354654, 0.17417044, 0.30079939, 0.38816953, 0.47683818, 0.50000024],
        [0.00200519, 0.01984160, 0.09465917, 0.17840021, 0.31602630, 0.41866331, 0.54139778, 0.60000000],
        [0.00200553, 0.01987473, 0.09545999, 0.18146706, 0.32728297, 0.44169364, 0.59299809, 0.69886701],
    ]
)
# fmt: on


def test_closed_form_agrees_with_contact():
    assert pytest.approx(CONTACT, abs=1e-3) == MU * fastsim.saturation(STIFFNESS * CREEPAGE / (MU * 72.0))


def test_marching_agrees_with_contact():
    marched = fastsim.solve(replace(RIG, mu=MU), creepage_x=CREEPAGE, speed=SPEED)
    assert marched.force_x / 72.0 == pytest.approx(CONTACT, abs=1e-3)


EVEN = np.full(6, 1.0 / 3.0)
HALVES = ((1 / 3, 1 / 3, 1 / 6, 1 / 6), (1 / 6, 1 / 6, 1 / 3, 1 / 3))
UNEVEN = ((0.25, 0.125, 0.125), (0.09375, 0.09375, 0.1875, 0.375, 0.375, 0.375))


@pytest.mark.parametrize(
    ("rates", "widths", "force"),
    [
        ((0, -2, 2, 4), EVEN, (0.0, 0.1843)),
        ((0, -2, 2, 4), np.concatenate(HALVES), (0.0, 0.1850)),
        ((1, -2, 2, 4), np.concatenate(UNEVEN), (0.5720, 0.1838)),
        ((1, -2, 2, 4), np.array([0.25, 0.25, 0.375, 0.375, 0.375, 0.375]), (0.5684, 0.1857)),
        ((1, -2, 2, 1), np.full(5, 0.4), (0.4530, 0.8299)),
    ],
)
def test_kalkers_published_check_values(rates, widths, force):
    # J. J. Kalker, Vehicle System Dynamics 11 (1982) 1-13: unit disc, five cells a strip, strips laid from +1 to -1
    # to both sides of the pole y = ux/fx as his program lays them; forces over the total of the bound, pi/2
    y = 1.0 - np.cumsum(widths) + 0.5 * widths
    cell = 2.0 * np.sqrt(1.0 - y**2) / 5 * widths
    driven = tuple(np.array([rate], dtype=float) for rate in rates)
    total = sum(np.array([(tx * cell).sum(), (ty * cell).sum()]) for _, tx, ty, _ in fastsim.march(driven, y=y, nx=5))
    assert np.abs(total) * 2.0 / np.pi == pytest.approx(force, rel=5e-3, abs=1e-12)


def test_saturation_is_the_integral_of_the_strips():
    for xi in (0.01, 0.7, 2.0, 3.3, 5.0):
        force = quad(
            lambda y, xi=xi: float(traction_per_length(y=y, b=2.0, normal_load=3.0, mu=0.4, xi=xi)),
            -2.0,
            2.0,
            points=[-2.0 * np.sqrt(max(1 - (xi / fastsim.FULL_SLIP) ** 2, 0)), 0.0],
        )[0]
        assert force == pytest.approx(1.2 * float(fastsim.saturation(xi)), rel=1e-7)


def test_saturation_starts_linear_and_ends_at_full_slip():
    assert float(fastsim.saturation(1e-9)) == pytest.approx(1e-9, rel=1e-8)
    assert float(fastsim.saturation(fastsim.FULL_SLIP)) == 1.0
    assert float(fastsim.saturation(100.0)) == 1.0
    assert float(fastsim.saturation(0.999 * fastsim.FULL_SLIP)) < 1.0


def test_unsaturation_inverts_saturation_to_machine_precision():
    fraction = np.concatenate([np.geomspace(1e-12, 0.5, 50), np.linspace(0.5, 1.0, 200)])
    assert fastsim.saturation(fastsim.unsaturation(fraction)) == pytest.approx(fraction, rel=1e-14)
    xi = np.concatenate([np.geomspace(1e-12, 0.5, 50), np.linspace(0.5, 2.5, 100)])
    assert fastsim.unsaturation(fastsim.saturation(xi)) == pytest.approx(xi, rel=1e-13)


def test_marching_converges_to_the_closed_form():
    creepage = np.array([0.001, 0.002, 0.004, 0.008])
    xi = STIFFNESS * creepage / (0.6 * 72.0)
    errors = [
        np.abs(
            fastsim.solve(RIG, creepage_x=creepage, speed=SPEED, nx=n, ny=n).force_x / 43.2 - fastsim.saturation(xi)
        ).max()
        for n in (25, 50, 100, 200)
    ]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(orders > 1.2)
    assert errors[1] < 5e-4


def combined():
    """Longitudinal and lateral creepage and spin together, as in CONTACT's reference cases: both signs of spin."""
    size = np.sqrt(RIG.a * RIG.b)
    vx, vy, turn = np.meshgrid([0.0, 0.001, 0.01], [0.0, 0.001, 0.003], [-0.003, -0.0005, 0.0005, 0.003])
    return {"creepage_x": vx, "creepage_y": vy, "spin": turn / size, "speed": SPEED}


def test_power_over_the_strips_is_the_power_of_the_forces():
    case = combined()
    found = fastsim.solve(RIG, **case)
    strip = 2.0 * RIG.b / 50
    expected = SPEED * (
        case["creepage_x"] * found.force_x + case["creepage_y"] * found.force_y + case["spin"] * found.moment
    )
    assert found.power_per_length.sum(axis=-1) * strip == pytest.approx(expected, rel=1e-12)
    assert np.all(found.power_per_length >= 0.0)


def test_power_without_spin_converges_to_the_closed_form():
    creepage = np.array([0.001, 0.002, 0.004, 0.02])
    xi = STIFFNESS * creepage / (0.6 * 72.0)
    exact = SPEED * creepage * 43.2 * fastsim.saturation(xi)
    errors = []
    for n in (50, 100):
        found = fastsim.solve(RIG, creepage_x=creepage, speed=SPEED, nx=n, ny=n)
        errors.append(np.abs(found.power_per_length.sum(axis=-1) * 2.0 * RIG.b / n / exact - 1.0).max())
        strips = traction_per_length(y=found.y, b=RIG.b, normal_load=72.0, mu=0.6, xi=xi[:, None])
        wanted = SPEED * creepage[:, None] * strips
        assert found.power_per_length == pytest.approx(wanted, abs=1e-3 * wanted.max())
    assert errors[0] < 0.005
    assert errors[1] < 0.5 * errors[0]


def test_flexibility_that_closes_the_energy_balance_lies_among_kalkers_three():
    # slip = V L (driven - gained): the L that the balance asks for must be a mean of L1, L2, L3
    shear = 79.3e9
    flexibilities = [8 * RIG.a / (3 * c * shear) for c in (RIG.c11, RIG.c22)]
    flexibilities.append(np.pi * RIG.a * np.sqrt(RIG.a / RIG.b) / (4 * RIG.c23 * shear))
    case = combined()
    field = fastsim.fields(RIG, **case)
    found = fastsim.solve(RIG, **case)
    sliding = np.hypot(field.slip_x, field.slip_y) > 0.0
    work = np.where(sliding, field.traction_x * field.slip_x + field.traction_y * field.slip_y, 0.0)
    cell = 4.0 * RIG.a * RIG.b * np.sqrt(1 - (field.y / RIG.b) ** 2) / 50**2
    assert (work * cell).sum(axis=(-1, -2)) == pytest.approx(found.power, rel=1e-10)
    rigid = np.abs(case["creepage_x"][..., None, None] - case["spin"][..., None, None] * field.y)
    full = case["creepage_x"] >= 0.01
    implied = np.median(field.slip_x[full] / (SPEED * rigid[full]), axis=(-1, -2))
    assert np.all(implied > 0.95 * min(flexibilities) / flexibilities[0])
    assert np.all(implied < 1.02 * max(flexibilities) / flexibilities[0])


def test_combined_creepages_stay_near_the_exact_theory():
    # CONTACT rev 2707, exact theory, 120 x 120, mu = 0.6; vx, vy, phi c [1]; -Fx, -Fy [N], -Mz [N mm]
    exact = np.array(
        [
            [0.0, 0.0, 0.0005, 0.0, 1.997604, 0.610614],
            [0.0, 0.001, 0.0, 0.0, 10.887542, -0.659424],
            [0.0, 0.001, 0.0005, 0.0, 12.752767, -0.067333],
            [0.0, 0.003, 0.0, 0.0, 27.249600, -1.066002],
            [0.0, 0.003, -0.003, 0.0, 15.878603, -3.367952],
            [0.0, 0.01, 0.0005, 0.0, 43.198787, -0.038965],
        ]
    )
    size = np.sqrt(RIG.a * RIG.b)
    vx, vy, turn, fx, fy, mz = exact.T
    found = fastsim.solve(RIG, creepage_x=vx, creepage_y=vy, spin=turn / size, speed=SPEED, nx=100, ny=100)
    assert found.force_x == pytest.approx(fx, abs=0.05 * 43.2)
    assert found.force_y == pytest.approx(fy, abs=0.05 * 43.2)
    assert found.moment == pytest.approx(mz * 1e-3, abs=0.07 * 43.2 * size)


def test_fields_obey_coulomb_and_slide_along_the_traction():
    field = fastsim.fields(RIG, creepage_x=0.002, creepage_y=-0.001, spin=3.0, speed=SPEED)
    bound = 0.6 * 2 * 72 / (np.pi * RIG.a * RIG.b) * (1 - (field.x / RIG.a) ** 2 - (field.y / RIG.b) ** 2)
    traction = np.hypot(field.traction_x, field.traction_y)
    assert np.all(traction <= bound * (1 + 1e-12))
    assert np.allclose(traction[~field.sticks], bound[~field.sticks], rtol=1e-12)
    assert np.all(np.hypot(field.slip_x, field.slip_y)[field.sticks] == 0.0)
    across = field.traction_x * field.slip_y - field.traction_y * field.slip_x
    assert np.abs(across).max() < 1e-10 * (traction * np.hypot(field.slip_x, field.slip_y)).max()


def test_slip_of_the_fields_is_the_rigid_slip_less_the_elastic():
    field = fastsim.fields(RIG, creepage_x=0.02, speed=SPEED, nx=400, ny=10)
    flexibility = 8 * RIG.a / (3 * 3.9388 * 79.3e9)
    elastic = -flexibility * np.gradient(field.traction_x[:, 5], field.x[:, 5])
    assert field.slip_x[5:-5, 5] == pytest.approx(SPEED * (0.02 - elastic[5:-5]), rel=2e-3)
    assert field.slip_x[0, 5] == pytest.approx(2 * field.slip_x[1, 5] - field.slip_x[2, 5], rel=2e-3)


@pytest.mark.parametrize("ratio", [0.2, 0.63, 5.0])
@pytest.mark.parametrize("angle", [30.0, 60.0, 85.0])
def test_in_full_sliding_the_traction_opposes_the_slip(ratio, angle):
    known = coefficients(ratio, 0.3)
    patch = fastsim.Patch(1e-3 * ratio, 1e-3, 1e3, 0.3, 80e9, known.c11, known.c22, known.c23)
    east, north = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    found = fastsim.solve(patch, creepage_x=0.3 * east, creepage_y=0.3 * north, speed=SPEED)
    assert (float(found.force_x), float(found.force_y)) == pytest.approx((300.0 * east, 300.0 * north), rel=2e-3)


def test_in_full_sliding_with_spin_too():
    """Rigid slip (vx - phi y, vy + phi x) at every point: no flexibility is left that could turn it."""
    field = fastsim.fields(RIG, creepage_x=0.2, creepage_y=0.1, spin=600.0, speed=SPEED)
    slip_x, slip_y = 0.2 - 600.0 * field.y, 0.1 + 600.0 * field.x
    along = field.traction_x * slip_x + field.traction_y * slip_y
    inner = np.hypot(field.x / RIG.a, field.y / RIG.b) < 0.9
    assert (along / np.hypot(field.traction_x, field.traction_y) / np.hypot(slip_x, slip_y))[inner].min() > 0.999


def test_forces_and_moment_are_the_sums_of_the_fields():
    case = {"creepage_x": 0.002, "creepage_y": -0.001, "spin": 12.0, "speed": SPEED, "nx": 12, "ny": 14}
    field, found = fastsim.fields(RIG, **case), fastsim.solve(RIG, **case)
    cell = 4.0 * RIG.a * RIG.b * np.sqrt(1 - (field.y / RIG.b) ** 2) / (12 * 14)
    assert float(found.force_x) == pytest.approx((field.traction_x * cell).sum(), rel=1e-12)
    assert float(found.force_y) == pytest.approx((field.traction_y * cell).sum(), rel=1e-12)
    moment = field.x * field.traction_y - field.y * field.traction_x
    assert float(found.moment) == pytest.approx((moment * cell).sum(), rel=1e-12)


def test_stick_fraction_of_the_closed_form():
    # strips stick over 2 (a(y) - k a): the stuck part of the ellipse is that between it and itself moved by 2 k a
    creepage = np.array([0.001, 0.004])
    k = STIFFNESS * creepage / 43.2 / fastsim.FULL_SLIP
    stuck = 2.0 / np.pi * (np.arccos(k) - k * np.sqrt(1 - k**2))
    found = fastsim.solve(RIG, creepage_x=creepage, speed=SPEED, nx=200, ny=200)
    assert found.stick_fraction == pytest.approx(stuck, abs=2e-3)


def test_no_creepage_gives_nothing_and_opposite_creepage_the_opposite():
    still = fastsim.solve(RIG, creepage_x=0.0, speed=SPEED)
    assert (float(still.force_x), float(still.power), still.power_per_length.max()) == (0.0, 0.0, 0.0)
    there = fastsim.solve(RIG, creepage_x=0.002, creepage_y=0.001, spin=2.0, speed=SPEED)
    back = fastsim.solve(RIG, creepage_x=-0.002, creepage_y=-0.001, spin=-2.0, speed=SPEED)
    assert (float(back.force_x), float(back.force_y)) == pytest.approx((-float(there.force_x), -float(there.force_y)))
    assert float(back.power) == pytest.approx(float(there.power))
