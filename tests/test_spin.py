"""Rolling with lateral creepage and spin by the table: linear theory, full slip, symmetry, power, and CONTACT.

CONTACT, open-source release 2025-07-23, revision 2707: exact theory on 120 by 120 elements, a = 0.170591303 mm, b =
0.270524050 mm, G = 79.3 GPa, nu = 0.3, mu N = 43.2 N. Its forces act on body 1 and are minus those here.
"""

from __future__ import annotations

import numpy as np
import pytest
from closed_forms import adhesion
from rigs import solve_rolling

from twindisc_cli.physics import exact, kalker, spin

A, B, G, NU, CAPACITY = 0.170591303e-3, 0.270524050e-3, 79.3e9, 0.3, 43.2

# vx, vy, phi [rad/mm], CONTACT's Fx, Fy [N], Mz [N mm]
CONTACT = np.array(
    [
        [0, 0, 0.0023274943, 0.0, -1.997604, -0.610614],
        [0, 0, 0.013964966, 0.0, -11.165021, -2.649937],
        [0, 0.001, 0.013964966, 0.0, -20.401271, -2.164276],
        [0, 0.001, -0.013964966, 0.0, 1.287046, 3.123427],
        [0, 0.003, 0.013964966, 0.0, -34.016780, -1.535818],
        [0, 0.003, -0.013964966, 0.0, -15.878603, 3.367952],
        [0, 0.01, -0.013964966, 0.0, -41.760758, 1.250761],
        [0.001, 0, 0.013964966, -9.745350, -11.058776, -2.519808],
        [0.001, 0.001, 0, -12.646591, -10.412060, 0.547335],
        [0.001, 0.001, -0.013964966, -9.645720, 1.295612, 2.977972],
        [0.001, 0.003, 0.013964966, -8.662749, -33.606707, -1.477568],
        [0.001, 0.01, -0.013964966, -4.819653, -41.541738, 1.226491],
        [0.002, 0, 0.013964966, -18.958427, -10.731672, -2.158188],
        [0.002, 0.001, 0.013964966, -18.640139, -19.470336, -1.769832],
        [0.002, 0.001, -0.013964966, -18.787739, 1.317112, 2.570240],
        [0.005, 0.001, 0.013964966, -37.227629, -14.926338, -0.743359],
        [0.01, 0, 0.0023274943, -43.164232, -0.529152, -0.051726],
    ]
)


def rolled(vx, vy, phi, *, a=A, b=B, poisson=NU, capacity=CAPACITY):
    """Tx, Ty over mu N and M over mu N times its arm, of creepages and spin [rad/m] that broadcast; (3, ...)."""
    c = kalker.coefficients(a / b, poisson)
    per_vx, per_vy = G * a * b * c.c11 / capacity, G * a * b * c.c22 / capacity
    x, y, z = per_vx * vx, per_vy * vy, spin.stiffness(per_vx, per_vy, a, b) * phi
    level = exact.saturation(np.sqrt(x**2 + y**2 + z**2), a / b, poisson)
    return level * np.array(spin.quotients(x, y, z, a / b, poisson))


def test_forces_and_moment_are_those_of_contact() -> None:
    """Its grid of 120 is 0.004 mu N off the limit for longitudinal creepage."""
    vx, vy, phi, *forces = CONTACT.T
    arm = spin.arm(A, B) * 1e3
    expected = -np.array(forces) / CAPACITY / np.array([1.0, 1.0, arm])[:, None]
    assert rolled(vx, vy, phi * 1e3) == pytest.approx(expected, abs=7e-3)


@pytest.mark.parametrize("ratio", [0.05, 0.63, 5.0])
@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.5])
def test_small_creepages_follow_linear_theory(ratio, poisson) -> None:
    a, b = 1e-3 * np.sqrt(ratio), 1e-3 / np.sqrt(ratio)
    c = kalker.coefficients(ratio, poisson)
    rng = np.random.default_rng(1)
    vx, vy, turn = 1e-8 * rng.normal(size=(3, 20))
    found = rolled(vx, vy, turn / 1e-3, a=a, b=b, poisson=poisson, capacity=1e3)
    known = adhesion(
        creepage_x=vx, creepage_y=vy, spin=turn / 1e-3, a=a, b=b, shear_modulus=G,
        coefficients=c,
    )  # fmt: skip
    expected = np.array([known.longitudinal, known.lateral, known.moment / spin.arm(a, b)]) / 1e3
    assert found == pytest.approx(expected, abs=3e-3 * np.abs(expected).max())


@pytest.mark.parametrize(("ratio", "accuracy"), [(0.08, 0.02), (0.3, 5e-3), (0.63, 5e-3), (3.0, 5e-3)])
def test_large_creepages_slide_along_the_rigid_slip(ratio, accuracy) -> None:
    a, b = 1e-3 * np.sqrt(ratio), 1e-3 / np.sqrt(ratio)
    n = 300
    unit = (2.0 * np.arange(n) + 1.0) / n - 1.0
    x, y = a * unit, b * unit[:, None]
    share = np.sqrt(np.maximum(0.0, 1.0 - unit**2 - unit[:, None] ** 2))
    share /= share.sum()
    for vx, vy, turn in ((1.0, 0.2, 0.5), (0.1, 1.0, -0.8), (0.3, 0.2, 1.0), (0.0, 0.4, 1.0)):
        slip = np.array([vx - turn / 1e-3 * y + 0 * x, vy + turn / 1e-3 * x + 0 * y])
        tx, ty = share * slip / np.hypot(*slip)
        expected = [tx.sum(), ty.sum(), (x * ty - y * tx).sum() / spin.arm(a, b)]
        assert rolled(1e4 * vx, 1e4 * vy, 1e7 * turn, a=a, b=b) == pytest.approx(np.array(expected), abs=accuracy)


def test_longitudinal_creepage_alone_is_left_as_it_is() -> None:
    x, nothing = np.array([-3.0, -0.1, 0.2, 40.0]), np.zeros(4)
    along, across, turn = spin.quotients(x, nothing, nothing, [0.04, 0.3, 1.0, 6.0], 0.28)
    assert (along == np.sign(x)).all()
    assert not across.any()
    assert not turn.any()


def test_mirror_images_and_reversal() -> None:
    drives = np.random.default_rng(2).normal(size=(3, 50))
    ratio = np.geomspace(0.06, 4.0, 50)
    found = np.array(spin.quotients(*drives, ratio, NU))
    for signs in ((1, -1, -1), (-1, 1, 1), (-1, -1, -1)):
        turned = np.array(signs)[:, None]
        other = spin.quotients(*(turned * drives), ratio, NU)
        assert np.array(other) == pytest.approx(turned * found, abs=1e-6)


def test_the_sign_of_yaw_against_spin_tells() -> None:
    """CONTACT: 18.64 N with yaw and spin of one sign, 18.79 N of opposite signs; laterally 19.5 and -1.3 N."""
    one, other = rolled(0.002, np.array([0.001, -0.001]), 13.964966).T
    assert other[0] > one[0]
    assert one[1] > 0.4
    assert other[1] > 0.0
    assert one[1] - other[1] > 0.3


def test_nothing_is_gained() -> None:
    """What forces and moment do is dissipated: positive, and no more than mu N at the fastest slip of the patch."""
    rng = np.random.default_rng(3)
    for ratio in (0.05, 0.4, 2.0, 5.0):
        a, b = 1e-3 * np.sqrt(ratio), 1e-3 / np.sqrt(ratio)
        vx, vy, turn = rng.normal(size=(3, 400)) * 10.0 ** rng.uniform(-5.0, -1.0, 400)
        phi = turn / 1e-3
        along, across, moment = rolled(vx, vy, phi, a=a, b=b, capacity=1e3)
        work = along * vx + across * vy + moment * spin.arm(a, b) * phi
        fastest = np.hypot(np.abs(vx) + np.abs(phi) * b, np.abs(vy) + np.abs(phi) * a)
        assert (work > 0.0).all()
        assert (work < fastest).all()
        assert (np.hypot(along, across) < 1.004).all()


# a/b, nu, mu, p0/G, sqrt(ab) [m], vx, vy, phi [rad/m]: lateral creepage against spin; the lateral force turns over
TURNING = [
    (0.54080182, 0.31581092, 0.13456826, 0.015012823, 2.75931534e-3, 2.14495038e-4, 2.49422289e-3, -2.27427855),
    (4.68720439, 0.376879721, 0.485114771, 0.0111569942, 7.27086604e-4, 4.64851511e-4, 1.56829013e-2, -2.27053976),
]


@pytest.mark.parametrize("case", TURNING)
def test_where_yaw_and_spin_cancel_the_table_is_the_solver(case) -> None:
    """On 40 and 80 elements, carried to the limit; creepage follows each grid's own load."""
    ratio, poisson, mu, p0, size, vx, vy, phi = case
    a, b, forces = size * np.sqrt(ratio), size / np.sqrt(ratio), []
    for n in (40, 80):
        unit = (2.0 * np.arange(n) + 1.0) / n - 1.0
        pressure = p0 * np.sqrt(np.maximum(0.0, 1.0 - unit**2 - unit[:, None] ** 2))
        found = solve_rolling(
            x=a * unit, y=b * unit, pressure=pressure, mu=mu, shear_modulus=1.0, poisson=poisson,
            creepage_x=vx, creepage_y=vy, spin=phi,
        )  # fmt: skip
        capacity = mu * pressure.sum() * found.element_area
        forces.append(np.array([found.force_x, found.force_y, found.moment / spin.arm(a, b)]) / capacity)
    whole = 2.0 / 3.0 * np.pi * a * b * p0 * mu * G
    law = rolled(vx, vy, phi, a=a, b=b, poisson=poisson, capacity=whole)
    assert law == pytest.approx(2.0 * forces[1] - forces[0], abs=0.015)
