"""Rolling of discs of unlike elasticity: what the slip that pressure alone makes does to the longitudinal force.

    T = mu N f(r) q(X, B; a/b, nu),     P / V = mu N f(r) (q v + m v_p),     r = |(X, B)|
    X = G a b C11 v / (mu N),           B = G a b C11 v_p / (mu N),          v_p = - 2 beta p0 / E* b / (a + b)

    v            longitudinal creepage [1], positive where disc 1 is the faster
    v_p          slip that the pressure makes at the middle of the patch, over the speed [1], of the same sign
    beta         Dundurs' second constant [1], positive where disc 1 is the softer;  p0  peak pressure [Pa]
    E*           effective modulus [Pa];     P  dissipated power [W];     V  rolling speed [m/s]
    f            the law of like discs: T/(mu N) over the normalised creepage r
    q, m         quotients from a table: of the force, and of the work that this slip does; q = 1 for beta = 0

Pressure shortens the softer surface (that of disc 1 for beta > 0), which is so the slower one; free rolling needs a
creepage near -v_p. Of a strip (a/b = 0) the slip is -2 beta p(x) / E* at each place, and nu does not matter. Slip and
its reverse are one case: q and m change their signs with (X, B). The work beyond T v is the rolling resistance's:
tractions shift the pressure's centre.

The table is over log(a/b), rho = r / (r + 2.5), which ends in linear theory and in full slip, and the angle of
(X, B) from X; it holds (q - cos) / sin and m.

Source: table of half_space.rolling (table_makers/unlike.py); R. H. Bentall, K. L. Johnson, Slip in the rolling contact
of two dissimilar elastic rollers, Int. J. Mech. Sci. 9 (1967) 389-404. Valid for: longitudinal creepage, Hertz's
pressure (the tractions' own effect on it left out), a/b <= 20; below 0.05 the quotients of the end are taken. Against
that solver f q is within 0.008 and the power within 1.6 % of full slip's in 100 drawn cases, |beta| / mu up to 3, a/b
from 0.07 to 10. With lateral creepage or spin too (`acting`) T/(mu N) is up to 0.22 off.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from twindisc_cli.physics import _drive_table
from twindisc_cli.physics._arrays import Floats, arrays, stored, together
from twindisc_cli.physics._drive_table import away_from_middle, place_of_ratio, place_of_size
from twindisc_cli.physics._even_grid import cubic_weights, polynomials, read, through
from twindisc_cli.physics.kalker import POISSON_RANGE, RATIO_RANGE, require, require_ratio

UNIT = 2e-4
"""Of the quotients in the table."""
_EVEN = (33, 43, 193)  # points over log(a/b), rho and the angle on which the table is laid out, linear between them
_AROUND = 2  # nodes of the angle that are repeated beyond either end, for cubics


@dataclass(frozen=True)
class Nodes(_drive_table.Nodes):
    """The nodes of the table, uniform in the angle, whose ends they leave out."""

    angle_count: int


FINE, COARSE = Nodes(RATIO_RANGE, 9, 15, 48), Nodes(RATIO_RANGE, 5, 15, 24)


def slip_of_pressure(beta: ArrayLike, p0: ArrayLike, effective_modulus: float, a_over_b: ArrayLike) -> Floats:
    """Slip by pressure at the middle of the patch over the rolling speed, v_p [1]; a/b = 0 for a strip.

    p0, effective_modulus [Pa]; all broadcast. Exact under Hertz's pressure, a sum of even ones over similar ellipses,
    each of which strains the middle by b / (a + b) of what it does as a strip.
    """
    beta, p0, ratio = arrays(beta, p0, a_over_b)
    return np.asarray(-2.0 * beta * p0 / effective_modulus / (1.0 + ratio))


def quotients(x: ArrayLike, by_pressure: ArrayLike, a_over_b: ArrayLike, poisson: float) -> tuple[Floats, Floats]:
    """q, m [1] of the drives X and B [1] on a patch of the ratio a/b [1], which broadcast; 0 where nothing drives.

    Raises OutOfRangeError outside 0 < a/b <= 20 and 0 <= nu <= 0.5.
    """
    x, by_pressure, ratio = together(x, by_pressure, a_over_b)
    require_ratio(ratio)
    require("Poisson's ratio", np.asarray(poisson), POISSON_RANGE)
    return _of_drive(x, by_pressure, _laid_out(poisson), (place_of_ratio(ratio, RATIO_RANGE),))


def quotients_of_a_strip(x: ArrayLike, by_pressure: ArrayLike) -> tuple[Floats, Floats]:
    """The same of a line contact, whose f is Carter's."""
    x, by_pressure = together(x, by_pressure)
    return _of_drive(x, by_pressure, _strip_laid_out(), ())


@dataclass(frozen=True)
class Acting:
    """What the slip by pressure makes of a drive of any direction: quotients [1] over mu N f(r).

    force      on the quotients of that drive;      own_force  longitudinal, whatever the direction
    work       of the slip by pressure over v_p, times the longitudinal quotient;      own_work  whatever that is
    """

    force: Floats
    own_force: Floats
    work: Floats
    own_work: Floats


def acting(size: ArrayLike, by_pressure: ArrayLike, a_over_b: ArrayLike | None, poisson: float) -> Acting:
    """The parts of q and m that are even in B and odd, at a drive |X| = size; a/b of None for a strip.

    (X, B) makes the longitudinal quotient  force X/|X| + own_force. With lateral creepage and spin, |X| is the size of
    the whole drive and X/|X| its longitudinal quotient, which is an approximation.
    """
    both = [
        quotients_of_a_strip(size, slip) if a_over_b is None else quotients(size, slip, a_over_b, poisson)
        for slip in (np.asarray(by_pressure), -np.asarray(by_pressure))
    ]
    (q, m), (q_back, m_back) = both
    return Acting(0.5 * (q + q_back), 0.5 * (q - q_back), 0.5 * (m + m_back), 0.5 * (m - m_back))


def _of_drive(
    x: Floats, by_pressure: Floats, table: NDArray[np.float32], place: tuple[Floats, ...]
) -> tuple[Floats, Floats]:
    """q and m from a table, whose last axes are rho, the angle and (g, m)."""
    size = np.hypot(x, by_pressure)
    per_size = 1.0 / np.maximum(size, np.finfo(float).tiny)
    backwards = np.where(x < 0.0, -1.0, 1.0)
    angle = np.arctan2(backwards * by_pressure, np.abs(x))
    g, m = read(table, (*place, place_of_size(size), angle / np.pi + 0.5))
    return (x + by_pressure * g) * per_size, backwards * m


@lru_cache(maxsize=4)
def _laid_out(poisson: float) -> NDArray[np.float32]:
    """The table of one nu on a fine even grid over the whole of each axis, (ratio, rho, angle, 2)."""
    kept = _table()
    away = away_from_middle(kept["by_poisson"], poisson)
    like, rest = (_refined(UNIT * _along_ratio(*part)) for part in ((kept["ellipse"], FINE), (away, COARSE)))
    return (like + rest).astype(np.float32)


@cache
def _strip_laid_out() -> NDArray[np.float32]:
    """The table of a strip, (rho, angle, 2)."""
    return _refined(UNIT * _table()["strip"]).astype(np.float32)


def _along_ratio(values: Floats, nodes: Nodes) -> Floats:
    """Values (ratio, ...) at the nodes carried to the even grid of ratios."""
    even = polynomials(np.linspace(-1.0, 1.0, _EVEN[0]), nodes.ratio_count)
    return np.tensordot(through(polynomials(nodes.unit, nodes.ratio_count), even), values, axes=1)


def _refined(values: Floats) -> Floats:
    """Values (..., rho, angle, 2) at the nodes carried to the even grids of rho and of the angle.

    After half a turn g is what it was, and m has changed its sign.
    """
    count, nodes = values.shape[-3], values.shape[-2]
    turned = values * [1.0, -1.0]
    around = np.concatenate([turned[..., -_AROUND:, :], values, turned[..., :_AROUND, :]], axis=-2)
    at = np.linspace(0.0, nodes, _EVEN[2]) - 0.5 + _AROUND
    onto_rho = cubic_weights(np.arange(float(count)), np.linspace(0.0, count - 1.0, _EVEN[1]))
    onto_angle = cubic_weights(np.arange(nodes + 2.0 * _AROUND), at)
    return np.asarray(np.einsum("pr,qa,...rak->...pqk", onto_rho, onto_angle, around, optimize=True))


@cache
def _table() -> dict[str, Floats]:
    """Quotients in UNITs: ellipse (a/b, rho, angle, 2) at nu = 0.3; by_poisson, (2, ...), the others less these;
    strip (rho, angle, 2)."""
    return stored("twindisc_cli.physics", "unlike.npz")
