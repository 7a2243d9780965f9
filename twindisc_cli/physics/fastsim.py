"""FASTSIM, Kalker's simplified theory of rolling contact (Eqs. 10, 11): each strip marched from its leading edge.

    d tau_x / ds = vx / L1 - phi y / L3,   d tau_y / ds = vy / L2 + phi x / L3    where |tau| stays below mu p
    L1 = 8 a / (3 C11 G),   L2 = 8 a / (3 C22 G),   L3 = pi a sqrt(a/b) / (4 C23 G)
    p(x, y) = 2 N / (pi a b) (1 - x^2/a^2 - y^2/b^2)                              parabolic, as the paper argues

    s = a(y) - x   way from the leading edge, which lies at +x [m];  a(y) half-length of the strip at y [m]
    vx, vy, phi    longitudinal and lateral creepage [1], spin [1/m]
    tau            traction [Pa], positive where creepage is (the paper's sign; on body 1 it acts the other way)
    w              sliding velocity [m/s], w = V (v - L d tau / ds), parallel to tau;  v = (vx - phi y, vy + phi x)

Where it slides, the single L of Eq. 11 takes the place of the three, each of which alone would turn the traction of
full sliding away from the rigid slip v. It is their mean,

    1/L = sqrt[(vx/L1)^2 + (vy/L2)^2 + a b (phi/L3)^2] / sqrt[vx^2 + vy^2 + a b phi^2]

and L1 without lateral creepage and spin. The slip is scaled to close the energy balance: the integral of tau . w over
the patch is V (vx Tx + vy Ty + phi Mz).

Without spin the strips have a closed form, and every case falls on one curve T/(mu N) = f(xi) of the force of linear
theory, xi = |T_linear|/(mu N):

    f = (2/pi) [asin k + (13/3 + 2 k^2/3) k sqrt(1 - k^2) - 4 k^2 acos k],  k = min(1, 3 pi xi / 32)

Source: J. J. Kalker, A fast algorithm for the simplified theory of rolling contact, Vehicle System Dynamics 11
(1982) 1-13. The closed form follows by integrating the strips: each sticks for s < 2 a(y) - 2 k a, then slides.
Valid for: Hertzian patches, steady rolling, quasi-identical bodies; within about 5 % of mu N of the exact theory.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from twindisc_cli.physics._arrays import Floats, together

Rates = tuple[Floats, ...]
"""(rx, ry, sx, sy), each (point,): d tx/ds = rx - sx y, d ty/ds = ry + sy x on the unit disc."""

FULL_SLIP = 32.0 / (3.0 * np.pi)  # normalised creepage above which no point of the patch sticks
_TOGETHER = 200  # operating points that march together: their arrays then stay in the processor's cache


@dataclass(frozen=True)
class Patch:
    """A Hertzian patch and what FASTSIM needs to know of it; all broadcast.

    a, b semi-axes [m]; normal_load [N]; mu [1]; shear_modulus of Eq. 7 [Pa]; c11, c22, c23 Kalker's coefficients [1].
    """

    a: ArrayLike
    b: ArrayLike
    normal_load: ArrayLike
    mu: ArrayLike
    shear_modulus: ArrayLike
    c11: ArrayLike
    c22: ArrayLike
    c23: ArrayLike


@dataclass(frozen=True)
class Solution:
    """What the operating points transmit and dissipate; S is the shape the arguments broadcast to.

    force_x, force_y [N], moment [N m], stick_fraction of the patch [1], power [W]: (S);
    y of the strips [m], power_per_length P_l [W/m]: (S, strip).
    """

    force_x: Floats
    force_y: Floats
    moment: Floats
    stick_fraction: Floats
    power: Floats
    y: Floats
    power_per_length: Floats


@dataclass(frozen=True)
class Fields:
    """Tractions [Pa], sliding velocity [m/s], stick at x, y [m], each (S, cell along x, strip); their sums."""

    x: Floats
    y: Floats
    traction_x: Floats
    traction_y: Floats
    slip_x: Floats
    slip_y: Floats
    sticks: NDArray[np.bool_]
    solution: Solution


def saturation(xi: ArrayLike) -> Floats:
    """T/(mu N) without spin over the normalised creepage xi [1]: G a b C11 |vx|/(mu N) for longitudinal creepage."""
    k = np.minimum(np.asarray(xi, dtype=float) / FULL_SLIP, 1.0)
    root = np.sqrt((1.0 - k) * (1.0 + k))
    full: Floats = np.arcsin(k) + k * root * (13.0 + 2.0 * k**2) / 3.0 - 4.0 * k**2 * np.arccos(k)
    return full * (2.0 / np.pi)


def unsaturation(fraction: ArrayLike) -> Floats:
    """The smallest normalised creepage xi at which T/(mu N) is `fraction`, 0 ... 1: the inverse of `saturation`.

    (1 - f)^(2/7) is nearly straight in k up to full slip, where f itself is flat; Newton's steps are made in it.
    """
    target = np.asarray(fraction, dtype=float)
    with np.errstate(divide="ignore"):
        k = -np.expm1(np.log1p(-target) * 2.0 / 7.0)
    for _ in range(5):
        reached = saturation(FULL_SLIP * k)
        room = 1.0 - reached
        root = np.sqrt((1.0 - k) * (1.0 + k))
        slope = (16.0 / (3.0 * np.pi)) * (root * (2.0 + k**2) - 3.0 * k * np.arccos(k))
        excess = np.log1p(np.maximum((reached - target) / np.where(room > 0.0, room, np.inf), -1.0 + 1e-16))
        step = -3.5 * room * np.expm1(excess * 2.0 / 7.0) / np.where(slope > 0.0, slope, np.inf)
        k = np.clip(k + step, 0.0, 1.0)
    creepage: Floats = FULL_SLIP * k
    return creepage


def march(
    rates: Rates, *, y: Floats, nx: int, sliding: Rates | None = None
) -> Iterator[tuple[Floats, Floats, Floats, Floats]]:
    """March the unit disc at the given rates; in cells behind one that slides at the rates `sliding`, if given.

    Strips at y (strip,) are cut into nx cells; tractions live at the cells' centres and may not exceed
    1 - x^2 - y^2. Yields, cell by cell from the leading edge, x (strip,), tx, ty and the factor by which that bound cut
    them, 1 where they stick (point, strip); views, reused.
    """
    half_length = np.sqrt(1.0 - y**2)
    tx, ty, cut, scratch, slides = (np.zeros((rates[0].size, y.size)) for _ in range(5))
    turned = None
    if sliding is not None:
        turned = _gains(tuple(to - of for to, of in zip(sliding, rates, strict=True)), y, half_length, nx)
    for cell, (gain_x, gain_y) in enumerate(_gains(rates, y, half_length, nx)):
        tx += gain_x
        ty += gain_y
        if turned is not None:
            for traction, more in zip((tx, ty), next(turned), strict=True):
                np.multiply(more, slides, out=scratch)
                traction += scratch
        x = half_length * (1.0 - (2 * cell + 1) / nx)
        limit = half_length**2 - x**2
        np.multiply(tx, tx, out=cut)
        np.multiply(ty, ty, out=scratch)
        cut += scratch
        np.sqrt(cut, out=cut)
        if turned is not None:
            np.greater(cut, limit, out=slides)
        np.maximum(cut, limit, out=cut)
        np.divide(limit, cut, out=cut)
        tx *= cut
        ty *= cut
        yield x, tx, ty, cut


def _gains(rates: Rates, y: Floats, half_length: Floats, nx: int) -> Iterator[tuple[Floats, Floats]]:
    """What tx and ty gain up to the centre of each cell from the one before, (point, strip); views, reused."""
    rx, ry, sx, sy = (np.asarray(r, dtype=float)[:, None] for r in rates)
    step = 2.0 * half_length / nx
    turn = sy * step * half_length
    gain_x, gain_y = (rx - sx * y) * step, ry * step + turn
    yield 0.5 * gain_x, 0.5 * (gain_y - turn / (2 * nx))
    turn *= 2.0 / nx
    for _ in range(1, nx):
        gain_y -= turn
        yield gain_x, gain_y


def solve(
    patch: Patch,
    *,
    creepage_x: ArrayLike,
    creepage_y: ArrayLike = 0.0,
    spin: ArrayLike = 0.0,
    speed: ArrayLike,
    nx: int = 50,
    ny: int = 50,
) -> Solution:
    """Forces, moment and dissipated power of every operating point.

    Creepages [1], spin [1/m] and rolling speed [m/s] broadcast with the patch.
    It is cut into ny strips of equal width, each into nx cells.
    """
    drive = _Drive.of(patch, creepage_x=creepage_x, creepage_y=creepage_y, spin=spin, speed=speed)
    chunks = [
        _solve_points(drive.points(slice(first, first + _TOGETHER)), nx=nx, ny=ny)
        for first in range(0, drive.a.size, _TOGETHER)
    ]
    fx, fy, mz, stick, power, y, power_per_length = (np.concatenate(parts) for parts in zip(*chunks, strict=True))
    strips = (*drive.shape, ny)
    return Solution(
        force_x=fx.reshape(drive.shape),
        force_y=fy.reshape(drive.shape),
        moment=mz.reshape(drive.shape),
        stick_fraction=stick.reshape(drive.shape),
        power=power.reshape(drive.shape),
        y=y.reshape(strips),
        power_per_length=power_per_length.reshape(strips),
    )


def fields(
    patch: Patch,
    *,
    creepage_x: ArrayLike,
    creepage_y: ArrayLike = 0.0,
    spin: ArrayLike = 0.0,
    speed: ArrayLike,
    nx: int = 50,
    ny: int = 50,
) -> Fields:
    """Tractions and slip over the patch of every operating point; arguments as for `solve`."""
    drive = _Drive.of(patch, creepage_x=creepage_x, creepage_y=creepage_y, spin=spin, speed=speed)
    solution = solve(patch, creepage_x=creepage_x, creepage_y=creepage_y, spin=spin, speed=speed, nx=nx, ny=ny)
    y = _strips(ny)
    step = 2.0 * np.sqrt(1.0 - y**2) / nx
    cells = [
        (np.broadcast_to(x, tx.shape), tx.copy(), ty.copy(), cut.copy())
        for x, tx, ty, cut in march(drive.rates, y=y, nx=nx, sliding=drive.sliding)
    ]
    x, tx, ty, cut = (np.stack(parts, axis=1) for parts in zip(*cells, strict=True))
    undone = (1.0 / cut - 1.0) / step  # what the bound takes away of a traction, per length of the strip
    undone[:, 0] *= 2.0  # the first centre is half a step from the edge
    work = np.sum((tx**2 + ty**2) * undone * step, axis=(1, 2)) * 2.0 / ny
    flexible = np.divide(solution.power.ravel(), work, out=np.zeros_like(work), where=work > 0.0)
    slip = flexible / (drive.peak * drive.a * drive.b)
    shape = (*drive.shape, nx, ny)

    def spread(values: Floats, scale: Floats) -> Floats:
        return (values * scale[:, None, None]).reshape(shape)

    return Fields(
        x=spread(x, drive.a),
        y=spread(np.broadcast_to(y, tx.shape), drive.b),
        traction_x=spread(tx, drive.peak),
        traction_y=spread(ty, drive.peak),
        slip_x=spread(tx * undone, slip),
        slip_y=spread(ty * undone, slip),
        sticks=(cut == 1.0).reshape(shape),
        solution=solution,
    )


@dataclass(frozen=True)
class _Drive:
    """Operating points laid flat: patch, peak of the bound [Pa], creepages, speed, and the rates of the unit disc.

    sliding: the rates where it slides; None where no point has lateral creepage or spin, and both are the same.
    """

    shape: tuple[int, ...]
    a: Floats
    b: Floats
    peak: Floats
    creepage: tuple[Floats, Floats, Floats]
    speed: Floats
    rates: Rates
    sliding: Rates | None

    @classmethod
    def of(
        cls, patch: Patch, *, creepage_x: ArrayLike, creepage_y: ArrayLike, spin: ArrayLike, speed: ArrayLike
    ) -> _Drive:
        """The rates at which the unit disc of each operating point is driven, from the flexibilities of Eq. 10."""
        values = (patch.a, patch.b, patch.normal_load, patch.mu, patch.shear_modulus, patch.c11, patch.c22, patch.c23)
        given = together(*values, creepage_x, creepage_y, spin, speed)
        a, b, load, mu, shear, c11, c22, c23, vx, vy, phi, v = (g.ravel() for g in given)
        peak = 2.0 * mu * load / (np.pi * a * b)
        stiffness = shear / peak
        turn = 4.0 / np.pi * c23 * np.sqrt(b / a) * phi * stiffness
        rates = (0.375 * c11 * vx * stiffness, 0.375 * c22 * vy * stiffness, turn * b, turn * a)
        if not (np.any(vy) or np.any(phi)):
            return cls(given[0].shape, a, b, peak, (vx, vy, phi), v, rates, None)
        rigid = np.sqrt(vx**2 + vy**2 + a * b * phi**2)
        driven = np.sqrt(rates[0] ** 2 + rates[1] ** 2 + rates[2] * rates[3])
        mean = np.divide(driven, rigid, out=np.zeros_like(rigid), where=rigid > 0.0)
        sliding = (mean * vx, mean * vy, mean * phi * b, mean * phi * a)
        return cls(given[0].shape, a, b, peak, (vx, vy, phi), v, rates, sliding)

    def points(self, some: slice) -> _Drive:
        """A few of the points."""
        a, b, peak, speed = (v[some] for v in (self.a, self.b, self.peak, self.speed))
        vx, vy, phi = (v[some] for v in self.creepage)
        rates = tuple(rate[some] for rate in self.rates)
        sliding = None if self.sliding is None else tuple(rate[some] for rate in self.sliding)
        return _Drive(a.shape, a, b, peak, (vx, vy, phi), speed, rates, sliding)


def _strips(ny: int) -> Floats:
    """The middles of ny strips of equal width across the unit disc."""
    return (2.0 * np.arange(ny) + 1.0) / ny - 1.0


def _solve_points(drive: _Drive, *, nx: int, ny: int) -> tuple[Floats, ...]:
    """Force x, y, moment, stick fraction, power (point,), y and power per length (point, strip) of a few points."""
    y = _strips(ny)
    half_length = np.sqrt(1.0 - y**2)
    rx, ry, sx, sy = (r[:, None] for r in drive.rates)
    sum_x, sum_y, sums_of_y = (np.zeros((drive.a.size, ny)) for _ in range(3))
    slides = np.zeros((drive.a.size, ny), dtype=np.uint16)
    for _, tx, ty, cut in march(drive.rates, y=y, nx=nx, sliding=drive.sliding):
        sum_x += tx
        sum_y += ty
        sums_of_y += sum_y
        slides += cut < 1.0
    x_sum_y = half_length * (2.0 * sums_of_y / nx - (1.0 + 1.0 / nx) * sum_y)  # the sum of x ty over the cells
    cell = (2.0 * half_length / nx) * (2.0 / ny)
    scale = drive.peak * drive.a * drive.b
    fx = scale * (sum_x @ cell)
    fy = scale * (sum_y @ cell)
    mz = scale * (drive.a * (x_sum_y @ cell) - drive.b * ((y * sum_x) @ cell))
    vx, vy, phi = drive.creepage
    power = drive.speed * (vx * fx + vy * fy + phi * mz)
    work = (sum_x * (rx - sx * y) + ry * sum_y + sy * x_sum_y) * cell
    total = work.sum(axis=1)
    share = np.divide(power, total * drive.b * (2.0 / ny), out=np.zeros_like(power), where=total > 0.0)
    stick = 1.0 - (slides @ cell) / cell.sum() / nx
    return fx, fy, mz, stick, power, drive.b[:, None] * y, work * share[:, None]
