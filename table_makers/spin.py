"""Make twindisc_cli/physics/spin.npz: `python -m table_makers.spin FOLDER`, 18 minutes on one core.

Every ratio a/b is a file in FOLDER, so that what was broken off goes on where it was. Each value is a quotient of two
cases of the rolling solver on the same grid, with all creepages or with the longitudinal one alone, which takes most of
the grid's error away; two grids carry what is left to the limit. For the ends, no creepage and full slip, linear theory
(adhesion.py, by its table) and a sum over the patch stand in. Standard error, against grids three times as
fine: 0.07 % (Fx), 0.16 % (Fy), 0.2 % (moment) of what the longitudinal creepage alone would transmit.

Where nearly all of the drive is sideways, forces turn over within less than two nodes. There the table is solved at
twice as many angles psi, and at twice as many sizes where slip begins; the rest of these finer nodes, and twice as many
ratios a/b, are interpolated with the place at which the lateral force changes its sign held fast.

For nu other than 0.3 the table adds the difference at nu = 0 and 0.5, solved at fewer nodes.

Made again from nothing, one departure in 50,000 differed, by one of its units (2e-4); the differences by nu did by 6e-5
(root mean square), 0.003 at most, since the solver stops at a tolerance.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from table_makers.rolling import centres
from twindisc_cli.physics import kalker, spin
from twindisc_cli.physics._arrays import Floats
from twindisc_cli.physics._drive_table import POISSON
from twindisc_cli.physics._even_grid import cubic_weights, polynomials, through
from twindisc_cli.physics.half_space import rolling
from twindisc_cli.physics.spin import COARSE, FINE, RATIO_RANGE, Nodes

_GRIDS = (20, 40)
_BOUND = 1e-3  # mu p0 over G of the cases solved; the result does not depend on it
_SUM = 400  # elements a side of the sum in full slip
SOLVED = Nodes(RATIO_RANGE, 10, 14, 10, 16)
_STEEP = 2  # rows of theta in which nearly all of the drive is sideways
_BEGUN = slice(5, 14, 2)  # sizes of the table, between those solved, at which slip begins


@dataclass(frozen=True)
class _Ellipse:
    """An ellipse of a b = 1 on n by n elements, G = 1."""

    ratio: float
    poisson: float
    n: int

    @cached_property
    def axes(self) -> tuple[Floats, Floats]:
        return np.sqrt(self.ratio) * centres(self.n), centres(self.n) / np.sqrt(self.ratio)

    @cached_property
    def bound(self) -> Floats:
        inside = 1.0 - centres(self.n) ** 2 - centres(self.n)[:, None] ** 2
        return _BOUND * np.sqrt(np.maximum(0.0, inside))

    @cached_property
    def load(self) -> float:
        x, y = self.axes
        return float(self.bound.sum() * (x[1] - x[0]) * (y[1] - y[0]))

    @cached_property
    def stiffness(self) -> tuple[float, float]:
        """C11 and C22 of this grid."""
        sticking = np.where(self.bound > 0.0, 1e6, 0.0)
        return self._solve(sticking, 1.0, 0.0, 0.0)[0], self._solve(sticking, 0.0, 1.0, 0.0)[1]

    def _solve(self, pressure: Floats, vx: float, vy: float, phi: float) -> tuple[float, float, float]:
        x, y = self.axes
        found = rolling.solve(
            x=x, y=y, pressure=pressure, mu=1.0, discs=rolling.Discs(1.0, self.poisson),
            creepage=rolling.Creepage(vx, vy, phi), tolerance=1e-4,
        )  # fmt: skip
        return found.force_x, found.force_y, found.moment

    def forces(self, size: float, direction: Floats) -> Floats:
        """Forces and moment over the load and its arm, driven by `size` times a unit vector (3,)."""
        a, b = np.sqrt(self.ratio), 1.0 / np.sqrt(self.ratio)
        c11, c22 = self.stiffness
        per_spin = float(spin.stiffness(c11, c22, a, b))
        vx, vy, phi = size * self.load * direction / np.array([c11, c22, per_spin])
        found = np.array(self._solve(self.bound, vx, vy, phi)) / self.load
        return np.asarray(found / np.array([1.0, 1.0, spin.arm(a, b)]))


def _departures(forces: Floats, direction: Floats) -> Floats:
    """What a table holds: how forces over the longitudinal law depart from the direction that drives them (..., 3)."""
    east = direction[..., :1]
    sideways = np.hypot(direction[..., 1:2], direction[..., 2:])
    along = (forces[..., :1] / east - 1.0) / sideways**2
    return np.concatenate([along, (forces[..., 1:] - direction[..., 1:]) / sideways], axis=-1)


def _directions(nodes: Nodes) -> Floats:
    """Unit vectors at the angles, (theta, psi, 3)."""
    return _directions_at(nodes.theta, nodes.psi)


def _directions_at(theta: Floats, psi: Floats) -> Floats:
    theta = theta[:, None]
    return np.stack(np.broadcast_arrays(np.cos(theta), np.sin(theta) * np.cos(psi), np.sin(theta) * np.sin(psi)), -1)


def _at_ratio(ratio: float, poisson: float, nodes: Nodes) -> Floats:
    """The table at one a/b and nu, (size, theta, psi, 3)."""
    directions = _directions(nodes)
    inner = [_between(ratio, poisson, size, directions) for size in nodes.sizes[1:-1]]
    ends = [_linear(ratio, poisson, directions), _full_slip(ratio, poisson, directions)]
    return _departures(np.stack([ends[0], *inner, ends[1]]), directions)


def _between(ratio: float, poisson: float, size: float, directions: Floats) -> Floats:
    """Quotients at one size of the drive, carried from two grids to the limit, (theta, psi, 3)."""
    found = []
    for n in _GRIDS:
        ellipse = _Ellipse(ratio, poisson, n)
        alone = ellipse.forces(size, np.array([1.0, 0.0, 0.0]))[0]
        flat = [ellipse.forces(size, direction) / alone for direction in directions.reshape(-1, 3)]
        found.append(np.reshape(flat, directions.shape))
    coarse, fine = found
    return np.asarray(2.0 * fine - coarse)


def _linear(ratio: float, poisson: float, directions: Floats) -> Floats:
    """Quotients as the drive goes to nothing."""
    a, b, c = np.sqrt(ratio), 1.0 / np.sqrt(ratio), kalker.coefficients(ratio, poisson)
    x, y, z = np.moveaxis(directions, -1, 0)
    vy, phi = y / c.c22, z / spin.stiffness(c.c11, c.c22, a, b)
    return np.stack([x, y + c.c23 * phi, (c.c33 * phi - c.c23 * vy) / spin.arm(a, b)], axis=-1)


def _full_slip(ratio: float, poisson: float, directions: Floats) -> Floats:
    """Quotients where every point slips along the rigid slip."""
    ellipse, c = _Ellipse(ratio, poisson, _SUM), kalker.coefficients(ratio, poisson)
    a, b, (x, y) = np.sqrt(ratio), 1.0 / np.sqrt(ratio), ellipse.axes
    share = ellipse.bound / ellipse.bound.sum()
    found = []
    for drive in directions.reshape(-1, 3):
        vx, vy, phi = drive / np.array([c.c11, c.c22, spin.stiffness(c.c11, c.c22, a, b)])
        slip = np.stack(np.broadcast_arrays(vx - phi * y[:, None], vy + phi * x))
        tx, ty = share * slip / np.hypot(*slip)
        found.append([tx.sum(), ty.sum(), (x * ty - y[:, None] * tx).sum() / spin.arm(a, b)])
    return np.reshape(found, directions.shape)


def make(folder: Path) -> None:
    """Write spin.npz from the parts in the folder, solving those that are not there."""
    folder.mkdir(parents=True, exist_ok=True)
    middle = POISSON[1]
    rows = [_kept(folder / _name(SOLVED, ratio, middle), _at_ratio, ratio, middle, SOLVED) for ratio in SOLVED.ratios]
    sideways = [_kept(folder / f"sideways_{ratio:.6f}.npy", _sideways, ratio, middle) for ratio in SOLVED.ratios]
    begun = [_kept(folder / f"begun_{ratio:.6f}.npy", _begun, ratio, middle) for ratio in SOLVED.ratios]
    solved = _finer_in_size(_finer_in_psi(np.stack(rows), np.stack(sideways)), np.stack(begun))
    of = {
        nu: np.stack(
            [_kept(folder / _name(COARSE, ratio, nu), _at_ratio, ratio, nu, COARSE) for ratio in COARSE.ratios]
        )
        for nu in POISSON
    }
    away = np.stack([of[nu] - of[middle] for nu in (POISSON[0], POISSON[2])])
    departure = np.round(_finer_in_ratio(solved, middle) / spin.UNIT).astype(np.int16)
    np.savez_compressed(
        Path(spin.__file__).with_name("spin.npz"), departure=departure, by_poisson=away.astype(np.float32)
    )


def _name(nodes: Nodes, ratio: float, poisson: float) -> str:
    return f"{nodes.theta.size}_{ratio:.6f}_{poisson:g}.npy"


def _kept(path: Path, solve: Callable[..., Floats], *case: Any) -> Floats:
    """A part of a table, from its file or solved."""
    if not path.exists():
        np.save(path, solve(*case))
    return np.asarray(np.load(path))


def _steep(psi: Floats) -> Floats:
    """Unit vectors in the rows that are nearly all sideways, (theta, psi, 3)."""
    return _directions_at(SOLVED.theta[-_STEEP:], psi)


def _sideways(ratio: float, poisson: float) -> Floats:
    """What those rows are between the angles psi of the table, (size, theta, psi, 3)."""
    directions = _steep(FINE.psi[1::2])
    found = [_between(ratio, poisson, size, directions) for size in SOLVED.sizes[1:-1]]
    return _departures(np.stack(found), directions)


def _begun(ratio: float, poisson: float) -> Floats:
    """What those rows are between the sizes where slip begins, (size, theta, psi, 3)."""
    directions = _steep(SOLVED.psi)
    found = [_between(ratio, poisson, size, directions) for size in FINE.sizes[_BEGUN]]
    return _departures(np.stack(found), directions)


def _finer_in_psi(solved: Floats, sideways: Floats) -> Floats:
    """The solved table at twice as many angles psi: solved in the steep rows, between two others by its waves."""
    finer = _psi_at(solved, np.broadcast_to(FINE.psi, (*solved.shape[:2], FINE.psi_count)))
    finer[:, 1:-1, -_STEEP:, 1::2] = sideways
    return finer


def _finer_in_size(solved: Floats, begun: Floats) -> Floats:
    """The same at twice as many sizes: solved in the steep rows where slip begins, else by cubics."""
    onto = cubic_weights(np.arange(float(SOLVED.rho_count)), FINE.rho * (SOLVED.rho_count - 1))
    finer = np.moveaxis(np.tensordot(onto, solved, axes=(1, 1)), 0, 1)
    off = begun - finer[:, _BEGUN, -_STEEP:, ::2]
    finer[:, _BEGUN, -_STEEP:] += _psi_at(off, np.broadcast_to(FINE.psi, (*off.shape[:2], FINE.psi_count)))
    return finer


def _finer_in_ratio(solved: Floats, poisson: float) -> Floats:
    """The same at twice as many ratios, by polynomials along lines on which the sideways force keeps its sign.

    Where the drive is nearly all sideways, the lateral forces of spin and of lateral creepage cancel at an angle psi0
    that moves with the ratio; the table is read at  psi = t + (psi0 - pi/2) sin^2 t  for one t at all ratios.
    Where nothing or everything slides the solver is not needed.
    """
    onto = through(polynomials(SOLVED.unit, SOLVED.ratio_count), polynomials(FINE.unit, SOLVED.ratio_count))
    turned = _cancelling(solved) - 0.5 * np.pi
    directions = _directions(FINE)
    total = solved + _of_the_drive(FINE)
    found = np.empty((FINE.ratio_count, *solved.shape[1:]))
    for number, (ratio, weights) in enumerate(zip(FINE.ratios, onto, strict=True)):
        t = _unturned(FINE.psi, (weights @ turned)[:, None])
        read = _psi_at(total, t + turned[..., None] * np.sin(t) ** 2)
        found[number] = np.tensordot(weights, read, axes=1) - _of_the_drive(FINE)
        ends = np.stack([_linear(ratio, poisson, directions), _full_slip(ratio, poisson, directions)])
        found[number, [0, -1]] = _departures(ends, directions)
    return found


def _of_the_drive(nodes: Nodes) -> Floats:
    """What the direction of the drive adds to the departures to make them quotients over the sine, (psi, 3)."""
    return np.stack([np.zeros(nodes.psi_count), np.cos(nodes.psi), np.sin(nodes.psi)], axis=-1)


def _cancelling(solved: Floats) -> Floats:
    """The angle psi0 at which the lateral force of the steepest row changes its sign, (ratio, size)."""
    psi = np.linspace(0.0, np.pi, 1801)
    row = solved[:, :, -1:] + _of_the_drive(FINE)
    lateral = _psi_at(row, np.broadcast_to(psi, (*row.shape[:2], psi.size)))[:, :, 0, :, 1]
    return np.asarray(psi[np.argmax((lateral[..., :-1] > 0.0) & (lateral[..., 1:] <= 0.0), axis=-1)])


def _unturned(psi: Floats, turned: Floats) -> Floats:
    """t of  psi = t + turned sin^2 t,  by halving."""
    low = np.zeros(np.broadcast_shapes(psi.shape, turned.shape))
    high = low + np.pi
    for _ in range(50):
        middle = 0.5 * (low + high)
        below = middle + turned * np.sin(middle) ** 2 <= psi
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return low


def _psi_at(values: Floats, psi: Floats) -> Floats:
    """Values (ratio, size, theta, node, 3) at other angles psi (ratio, size, angle), through their waves."""
    count = values.shape[3]
    nodes = np.arange(count) * (np.pi / count)
    parts = []
    for part, odd in enumerate((0, 1, 1)):
        waves = spin._harmonics(psi.ravel(), count, odd) @ np.linalg.inv(spin._harmonics(nodes, count, odd))
        matrix = waves.reshape(*psi.shape, count)
        parts.append(np.einsum("kjan,kjtn->kjta", matrix, values[..., part]))
    return np.stack(parts, axis=-1)


if __name__ == "__main__":
    make(Path(sys.argv[1]))
