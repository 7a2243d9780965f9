"""Make kalker.npz and exact.npz of twindisc_cli/physics: `python -m table_makers.rolling kalker exact`.

kalker.npz   creepage coefficients by polynomials of degree 20 (adhesion.py), as Chebyshev coefficients of
             log C over log(a/b) and nu. Error below 1e-4 for 0.1 <= a/b <= 10, below 4e-4 at 0.05 and 20: found by
             comparing degrees 16, 20 and 24, C23 with C32, and the interpolation with direct values between its nodes.
exact.npz    T/(mu N) over normalised creepage by the rolling solver (half_space.rolling) on nine grids, carried to
             the limit, as Chebyshev coefficients over log(a/b) and nu at each creepage. Standard error 2e-4 at worst.
"""

from __future__ import annotations

import sys
from concurrent.futures import ProcessPoolExecutor
from itertools import product
from pathlib import Path

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from table_makers.adhesion import creepage_coefficients
from twindisc_cli.physics import exact, kalker
from twindisc_cli.physics.half_space import rolling

Floats = NDArray[np.float64]

_HERE = Path(kalker.__file__).parent
_RATIO_NODES, _POISSON_NODES = 24, 6
_CURVE_RATIO_NODES, _CURVE_POISSON_NODES = 11, 3
_GRIDS = (50, 54, 60, 66, 72, 80, 90, 100, 120)
_BOUND = 1e-3  # mu p0 over G of the cases solved; the result does not depend on it


def make_kalker() -> None:
    """Write kalker.npz; takes some five minutes."""
    ratios, poissons = _nodes(_RATIO_NODES, _POISSON_NODES)
    values = [_coefficients(ratio, nu) for ratio, nu in product(ratios, poissons)]
    table = np.log(values).reshape(ratios.size, poissons.size, 4)
    np.savez(_HERE / "kalker.npz", chebyshev=_chebyshev(table))


def _coefficients(ratio: float, nu: float) -> tuple[float, float, float, float]:
    """C11, C22, C23, C33; of C23 and C32 the one that converges faster."""
    found = creepage_coefficients(a_over_b=ratio, poisson=nu)
    return found.c11, found.c22, found.c32, found.c33


def make_exact() -> None:
    """Write exact.npz; takes some twenty minutes."""
    ratios, poissons = _nodes(_CURVE_RATIO_NODES, _CURVE_POISSON_NODES)
    with ProcessPoolExecutor() as pool:
        curves = list(pool.map(_creep_curve, *zip(*product(ratios, poissons), strict=True)))
    limits, errors = np.moveaxis(np.array(curves), 1, 0)
    table = limits.reshape(ratios.size, poissons.size, -1)
    np.savez(_HERE / "exact.npz", chebyshev=_chebyshev(table), standard_error=errors.max())


def _creep_curve(ratio: float, nu: float) -> Floats:
    """T/(mu N) at the creepages of the table without the first, and its standard error: (2, creepage)."""
    grids = [_on_grid(ratio, nu, n) for n in _GRIDS]
    causes = np.array([cause for cause, _ in grids])
    return _limit(causes, np.array([values for _, values in grids]))


def _limit(causes: Floats, values: Floats) -> Floats:
    """Values without any cause of error and their standard error, by least squares over grids that count as n^2."""
    weights = 1.0 / causes[:, :1]
    design = np.column_stack([np.ones(len(causes)), causes])
    fit = np.linalg.lstsq(design * weights, values * weights, rcond=None)[0]
    misfit = (values - design @ fit) * weights
    variance = np.sum(misfit**2, axis=0) / (len(causes) - design.shape[1])
    spread = np.linalg.inv((design * weights).T @ (design * weights))[0, 0]
    return np.stack([fit[0], np.sqrt(variance * spread)])


def _on_grid(ratio: float, nu: float, n: int) -> tuple[Floats, Floats]:
    """What makes the error on n by n elements (1/n, excess of area, excess of load), and T/(mu N) at the creepages.

    Creepage is normalised by the load and by the initial slope of the same grid, which takes most of its error away.
    """
    a, b = np.sqrt(ratio), 1.0 / np.sqrt(ratio)
    x, y = a * centres(n), b * centres(n)
    area = (x[1] - x[0]) * (y[1] - y[0])
    bound = _BOUND * np.sqrt(np.maximum(0.0, 1.0 - (x / a) ** 2 - (y[:, None] / b) ** 2))

    def force(pressure: Floats, creepage: float) -> float:
        discs, driven = rolling.Discs(1.0, nu), rolling.Creepage(creepage)
        return rolling.solve(x=x, y=y, pressure=pressure, mu=1.0, discs=discs, creepage=driven).force_x

    load, stiffness = bound.sum() * area, force(np.where(bound > 0.0, 1e6, 0.0), 1.0)
    found = [force(bound, xi * load / stiffness) for xi in exact.KNOTS[1:]]
    causes = [1.0 / n, (bound > 0.0).sum() * area / np.pi - 1.0, load / (2.0 / 3.0 * np.pi * _BOUND) - 1.0]
    return np.array(causes), np.array(found) / load


def centres(n: int) -> Floats:
    """Centres of n elements that span -1 ... 1."""
    return (2.0 * np.arange(n) + 1.0) / n - 1.0


def _nodes(ratio_count: int, poisson_count: int) -> tuple[Floats, Floats]:
    """Chebyshev nodes of a/b (in its logarithm) and nu."""
    low, high = np.log(kalker.RATIO_RANGE)
    ratios = np.exp(low + 0.5 * (chebyshev.chebpts1(ratio_count) + 1.0) * (high - low))
    return ratios, 0.25 * (chebyshev.chebpts1(poisson_count) + 1.0)


def _chebyshev(values: Floats) -> Floats:
    """Chebyshev coefficients of values at the nodes of (a/b, nu), (a/b, nu, ...)."""
    along, across = (np.linalg.inv(chebyshev.chebvander(chebyshev.chebpts1(n), n - 1)) for n in values.shape[:2])
    coefficients: Floats = np.einsum("gi,nj,ij...->gn...", along, across, values)
    return coefficients


if __name__ == "__main__":
    for name in sys.argv[1:]:
        {"kalker": make_kalker, "exact": make_exact}[name]()
