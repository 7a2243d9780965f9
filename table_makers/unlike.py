"""Make twindisc_cli/physics/unlike.npz: `python -m table_makers.unlike`, ten minutes on one core.

Each value is a quotient of two cases of the rolling solver on the same grid, with the slip by pressure or without it,
which takes most of the grid's error away; two grids carry what is left to the limit. Nothing slips in the first row of
the table; all does in the last one, a sum over the patch. A strip is two rows of elements a thousand times as wide as
the patch is long.

For nu other than 0.3 the table adds the difference at nu = 0 and 0.5, solved at fewer nodes.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from table_makers.rolling import centres
from twindisc_cli.physics import unlike
from twindisc_cli.physics._arrays import Floats
from twindisc_cli.physics._drive_table import POISSON
from twindisc_cli.physics.half_space import rolling
from twindisc_cli.physics.half_space.influence_tangential import strain_by_pressure
from twindisc_cli.physics.unlike import COARSE, FINE, Nodes

_GRIDS, _STRIP_GRIDS = (24, 48), (100, 200)
_BOUND = 1e-3  # mu p0 over G of the cases solved; the result does not depend on it
_SUM = {True: 800, False: 4000}  # elements a side of the sum in full slip, of an ellipse and of a strip
_TOLERANCE = 1e-4
_ENDLESS = 1000.0
"""Width of a row of a strip over the half-length."""
_STICKS = 1e9
"""A coefficient of friction at which nothing slips."""


@dataclass(frozen=True)
class _Patch:
    """A patch of a b = 1 on n by n elements, or a strip (ratio 0) of a = 1 on 2 by n; G = mu = 1."""

    ratio: float
    poisson: float
    n: int

    @cached_property
    def axes(self) -> tuple[Floats, Floats]:
        if not self.ratio:
            return centres(self.n), _ENDLESS * np.array([-0.5, 0.5])
        return np.sqrt(self.ratio) * centres(self.n), centres(self.n) / np.sqrt(self.ratio)

    @cached_property
    def area(self) -> float:
        """Of an element."""
        x, y = self.axes
        return float((x[1] - x[0]) * (y[1] - y[0]))

    @cached_property
    def bound(self) -> Floats:
        across = centres(self.n)[:, None] if self.ratio else np.zeros((2, 1))
        return _BOUND * np.sqrt(np.maximum(0.0, 1.0 - centres(self.n) ** 2 - across**2))

    @cached_property
    def load(self) -> float:
        return float(self.bound.sum() * self.area)

    @cached_property
    def stiffness(self) -> float:
        """Force per creepage of this grid where nothing slips."""
        return self._solve(1.0, 0.0, _STICKS).force_x

    @cached_property
    def difference(self) -> float:
        """K for B = 1: v_p = 2 beta p0 / E* / (1 + a/b) with E* = G / (1 - nu) and K = (1 - nu) beta."""
        return 0.5 * self.load / self.stiffness / _BOUND * (1.0 + self.ratio)

    @cached_property
    def by_pressure(self) -> Floats:
        """Slip for B = 1 over that of X = 1, (2, y, x)."""
        x, y = self.axes
        slip = strain_by_pressure(self.bound, aspect=float((x[1] - x[0]) / (y[1] - y[0])))
        return -slip * self.difference * self.stiffness / self.load

    def _solve(self, creepage: float, difference: float, mu: float = 1.0) -> rolling.Rolling:
        x, y = self.axes
        return rolling.solve(
            x=x, y=y, pressure=self.bound, mu=mu, discs=rolling.Discs(1.0, self.poisson, difference),
            creepage=rolling.Creepage(creepage), tolerance=_TOLERANCE,
        )  # fmt: skip

    def _both(self, traction: Floats) -> Floats:
        """Force and work, (2,), of tractions (2, y, x)."""
        work = float((traction * self.by_pressure).sum())
        return np.array([traction[0].sum(), work]) * self.area / self.load

    def forces(self, size: float, angle: float, mu: float = 1.0) -> Floats:
        """T/(mu N), and the work of the slip by pressure likewise, (2,)."""
        result = self._solve(
            size * np.cos(angle) * self.load / self.stiffness, size * np.sin(angle) * self.difference, mu
        )
        return self._both(result.traction)

    def full_slip(self, angle: float) -> Floats:
        """The same where every point slips along the rigid slip."""
        slip = np.array([np.cos(angle), 0.0])[:, None, None] + np.sin(angle) * self.by_pressure
        return self._both(self.bound * slip / np.maximum(np.hypot(*slip), np.finfo(float).tiny))


def _at_ratio(ratio: float, poisson: float, nodes: Nodes) -> Floats:
    """The table at one a/b (0 for a strip) and nu, (size, angle, 2)."""
    grids = _GRIDS if ratio else _STRIP_GRIDS
    coarse, fine = (_on_grid(_Patch(ratio, poisson, n), nodes) for n in grids)
    whole = _Patch(ratio, poisson, _SUM[bool(ratio)])
    angles = _angles(nodes)
    full = np.array([whole.full_slip(angle) for angle in angles])
    values = np.concatenate([2.0 * fine - coarse, full[None]])
    values[..., 0] = (values[..., 0] - np.cos(angles)) / np.sin(angles)
    return values


def _angles(nodes: Nodes) -> Floats:
    """Angles of (X, B) from X at the nodes, which leave out the ends."""
    return np.asarray(((np.arange(nodes.angle_count) + 0.5) / nodes.angle_count - 0.5) * np.pi)


def _on_grid(patch: _Patch, nodes: Nodes) -> Floats:
    """Quotients of force and work but for full slip, (size, angle, 2)."""
    angles = _angles(nodes)
    linear = [patch.forces(1.0, angle, _STICKS) for angle in angles]
    inner = []
    for size in nodes.sizes[1:-1]:
        alone = patch.forces(size, 0.0)[0]
        inner.append([patch.forces(size, angle) / alone for angle in angles])
    return np.array([linear, *inner])


def make() -> None:
    """Write unlike.npz."""
    low, middle, high = POISSON
    ellipse = np.stack([_at_ratio(ratio, middle, FINE) for ratio in FINE.ratios])
    away = [np.stack([_at_ratio(ratio, nu, COARSE) for ratio in COARSE.ratios]) for nu in (low, middle, high)]
    values = {
        "ellipse": ellipse,
        "by_poisson": np.stack([away[0] - away[1], away[2] - away[1]]),
        "strip": _at_ratio(0.0, middle, FINE),
    }
    codes: dict[str, Any] = {name: np.round(value / unlike.UNIT).astype(np.int16) for name, value in values.items()}
    np.savez_compressed(Path(unlike.__file__).with_name("unlike.npz"), **codes)


if __name__ == "__main__":
    make()
