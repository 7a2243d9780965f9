"""Make spin.npz, shipped beside this file: `python -m twindisc_cli.physics.make_spin FOLDER`, some 20 minutes.

Every ratio a/b is a file in FOLDER, so that what was broken off goes on where it was. Each value is a quotient of two
cases of the rolling solver on the same grid, with all creepages or with the longitudinal one alone, which takes most of
the grid's error away; two grids carry what is left to the limit. For the ends, no creepage and full slip, linear theory
(half_space.adhesion, by its table) and a sum over the patch stand in. Standard error, against grids three times as
fine: 0.07 % (Fx), 0.16 % (Fy), 0.2 % (moment) of what the longitudinal creepage alone would transmit.

other than nu = 0.3: the difference at nu = 0 and 0.5, on a coarser table.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from twindisc_cli.physics import kalker, spin
from twindisc_cli.physics._arrays import Floats
from twindisc_cli.physics.half_space import rolling
from twindisc_cli.physics.make_tables import centres
from twindisc_cli.physics.spin import COARSE, FINE, Nodes

_GRIDS = (20, 40)
_BOUND = 1e-3  # mu p0 over G of the cases solved; the result does not depend on it
_SUM = 400  # elements a side of the sum in full slip


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
            x=x, y=y, pressure=pressure, mu=1.0, shear_modulus=1.0, poisson=self.poisson,
            creepage_x=vx, creepage_y=vy, spin=phi, tolerance=1e-4,
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
    theta, psi = nodes.theta[:, None], nodes.psi
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
    middle = [_kept(folder, ratio, spin.POISSON[1], FINE) for ratio in FINE.ratios]
    of = {nu: np.stack([_kept(folder, ratio, nu, COARSE) for ratio in COARSE.ratios]) for nu in spin.POISSON}
    away = np.stack([of[nu] - of[spin.POISSON[1]] for nu in (spin.POISSON[0], spin.POISSON[2])])
    departure, away = np.stack(middle).astype(np.float32), away.astype(np.float32)
    np.savez_compressed(Path(__file__).with_name("spin.npz"), departure=departure, by_poisson=away)


def _kept(folder: Path, ratio: float, poisson: float, nodes: Nodes) -> Floats:
    """One ratio of a table, from its file or solved."""
    path = folder / f"{nodes.theta.size}_{ratio:.6f}_{poisson:g}.npy"
    if not path.exists():
        np.save(path, _at_ratio(ratio, poisson, nodes))
    return np.asarray(np.load(path))


if __name__ == "__main__":
    make(Path(sys.argv[1]))
