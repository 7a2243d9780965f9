"""Rolling of an ellipse with longitudinal and lateral creepage and spin by the exact theory: forces and spin moment.

    (Tx, Ty, M / l) = mu N f(r) q(X, Y, Z; a/b, nu),     r = |(X, Y, Z)|
    X = G a b C11 vx / (mu N),   Y = G a b C22 vy / (mu N),   Z = G a b |(C11 b, C22 a)| / sqrt(5) phi / (mu N)

    vx, vy, phi  longitudinal, lateral creepage [1], spin [rad/m];   X, Y, Z their drives [1]
    f            the law of longitudinal creepage alone: T/(mu N) over the normalised creepage r
    q            quotient by which the others change it, from a table: (1, 0, 0) for longitudinal creepage alone
    l            arm sqrt((a^2 + b^2) / 5) of the moment M, the integral of x ty - y tx [m]

a^2/5 and b^2/5 are the means of x^2 and y^2 under the pressure: Z is the size of the slip that the spin makes. Forces
are positive where creepage is (those on body 1 act the other way), and dissipate V (vx Tx + vy Ty + phi M). A patch and
its lateral mirror image, and slip and its reverse, are one case: q1/X is even in X and in (Y, Z), q2 and q3 are even in
X and odd in (Y, Z). The table is over log(a/b), rho = r / (r + 2.5), which ends in linear theory and in full slip, and
the angles of the drive; it holds q less the unit vector of the drive, over the sines that vanish with it.

Source: table of half_space.rolling (table_makers/spin.py). Against that solver on 40 and 80 elements, carried to the
limit, forces are within 0.3 % of mu N in 95 % of 500 cases and 1.4 % at worst, where yaw and spin nearly cancel (of
500 others 0.25 % and 0.9 %); a/b from 0.05 to 5, nu from 0.2 to 0.4. In full slip of slender patches forces are off by
up to 1.7 % of mu N, and near a/b = 5 by 2.1 % (0.688 for 0.667 at a spin of 0.5). Beyond these a/b the departures of
the end are taken.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property, lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from twindisc_cli.physics import _drive_table
from twindisc_cli.physics._arrays import Floats, arrays, stored, together
from twindisc_cli.physics._drive_table import away_from_middle, place_of_ratio, place_of_size
from twindisc_cli.physics._even_grid import cubic_weights, polynomials, read, through
from twindisc_cli.physics.kalker import POISSON_RANGE, require, require_ratio

RATIO_RANGE = (0.05, 5.0)  # of semi-axes in the table
_EVEN = (21, 40, 21, 41)  # points over log(a/b), rho, theta and psi on which a table is laid out, linear between them


@dataclass(frozen=True)
class Nodes(_drive_table.Nodes):
    """The nodes of a table, uniform in both angles."""

    theta_count: int
    psi_count: int

    @cached_property
    def theta(self) -> Floats:
        """Angle of the drive from X, 0 ... pi/2."""
        return np.asarray((np.arange(self.theta_count) + 0.5) * (0.5 * np.pi / self.theta_count))

    @cached_property
    def psi(self) -> Floats:
        """Angle of (Y, Z) from Y, 0 ... pi."""
        return np.asarray(np.arange(self.psi_count) * (np.pi / self.psi_count))


FINE, COARSE = Nodes(RATIO_RANGE, 19, 27, 10, 32), Nodes(RATIO_RANGE, 5, 7, 5, 8)
UNIT = 2e-4
"""Of the departures in the table."""


def stiffness(per_vx: ArrayLike, per_vy: ArrayLike, a: ArrayLike, b: ArrayLike) -> Floats:
    """Drive per spin, from those per longitudinal and lateral creepage, and the semi-axes [m]."""
    per_vx, per_vy, a, b = arrays(per_vx, per_vy, a, b)
    return np.asarray(np.hypot(per_vx * b, per_vy * a) / np.sqrt(5.0))


def arm(a: ArrayLike, b: ArrayLike) -> Floats:
    """Arm of the moment [m]."""
    return np.asarray(np.hypot(a, b) / np.sqrt(5.0))


def quotients(
    x: ArrayLike, y: ArrayLike, z: ArrayLike, a_over_b: ArrayLike, poisson: float
) -> tuple[Floats, Floats, Floats]:
    """q1, q2, q3 [1] of the drives X, Y, Z [1] at the ratio a/b [1], which broadcast; 0 where nothing drives.

    Raises OutOfRangeError where kalker does.
    """
    x, y, z, ratio = together(x, y, z, a_over_b)
    require_ratio(ratio)
    require("Poisson's ratio", np.asarray(poisson), POISSON_RANGE)
    sideways = np.hypot(y, z)
    size = np.hypot(x, sideways)
    per_size = 1.0 / np.maximum(size, np.finfo(float).tiny)
    psi = np.arctan2(z, y)
    side = np.where(psi < 0.0, -1.0, 1.0)
    unit = (
        place_of_ratio(ratio, RATIO_RANGE),
        place_of_size(size),
        np.arctan2(sideways, np.abs(x)) / (0.5 * np.pi),
        np.where(psi < 0.0, psi + np.pi, psi) / np.pi,
    )
    along, across, turn = read(_laid_out(poisson), unit)
    sine = sideways * per_size
    return (
        x * per_size * (1.0 + sine**2 * along),
        y * per_size + side * sine * across,
        z * per_size + side * sine * turn,
    )


@lru_cache(maxsize=4)
def _laid_out(poisson: float) -> NDArray[np.float32]:
    """The departures of one nu on a fine even grid over the whole of each axis, (ratio, rho, theta, psi, 3)."""
    kept = _table()
    away = away_from_middle(kept["by_poisson"], poisson)
    return (_refined(UNIT * kept["departure"], FINE) + _refined(away, COARSE)).astype(np.float32)


def _refined(values: Floats, nodes: Nodes) -> Floats:
    """Values (ratio, rho, theta, psi, 3) at the nodes carried to the even grid."""
    ratio, rho, theta, psi = (np.linspace(0.0, 1.0, count) for count in _EVEN)
    turns = np.arange(nodes.theta_count)
    onto = [
        through(polynomials(nodes.unit, nodes.ratio_count), polynomials(2.0 * ratio - 1.0, nodes.ratio_count)),
        cubic_weights(np.arange(float(nodes.rho_count)), rho * (nodes.rho_count - 1)),
        through(np.cos(2.0 * np.outer(nodes.theta, turns)), np.cos(np.pi * np.outer(theta, turns))),
    ]
    for axis, matrix in enumerate(onto):
        values = np.moveaxis(np.tensordot(matrix, values, axes=(1, axis)), 0, axis)
    even, odd = (
        through(_harmonics(nodes.psi, nodes.psi_count, odd), _harmonics(np.pi * psi, nodes.psi_count, odd))
        for odd in (0, 1)
    )
    parts = [np.tensordot(values[..., part], (even, odd, odd)[part], axes=(-1, 1)) for part in range(3)]
    return np.stack(parts, axis=-1)


def _harmonics(angle: Floats, count: int, odd: int) -> Floats:
    """`count` functions of the angle that repeat (odd = 0) or change sign (odd = 1) after half a turn."""
    orders = 2 * np.arange(count // 2 + 1 - odd) + odd
    waves = np.outer(angle, orders)
    return np.concatenate([np.cos(waves), np.sin(waves)[:, 1 - odd : count - orders.size + 1 - odd]], axis=1)


@cache
def _table() -> dict[str, Floats]:
    """Departures (a/b, rho, theta, psi, 3) at nu = 0.3 in UNITs; by_poisson, (2, ...), the others less these."""
    return stored("twindisc_cli.physics", "spin.npz")
