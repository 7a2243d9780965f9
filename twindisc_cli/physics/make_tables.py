"""Make the tables that are shipped beside this file: `python -m twindisc_cli.physics.make_tables kalker exact`.

kalker.npz   creepage coefficients by polynomials of degree 20 (half_space.adhesion), as Chebyshev coefficients of
             log C over log(a/b) and nu. Error below 1e-4 for 0.1 <= a/b <= 10, below 4e-4 at 0.05 and 20: found by
             comparing degrees 16, 20 and 24, C23 with C32, and the interpolation with direct values between its nodes.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from numpy.polynomial import chebyshev

from twindisc_cli.physics import kalker
from twindisc_cli.physics.half_space.adhesion import creepage_coefficients

_HERE = Path(__file__).parent
_RATIO_NODES, _POISSON_NODES = 24, 6


def make_kalker() -> None:
    """Write kalker.npz; takes some five minutes."""
    t, s = chebyshev.chebpts1(_RATIO_NODES), chebyshev.chebpts1(_POISSON_NODES)
    low, high = np.log(kalker.RATIO_RANGE)
    ratios, poissons = np.exp(low + 0.5 * (t + 1.0) * (high - low)), 0.25 * (s + 1.0)
    values = np.array([[_coefficients(ratio, nu) for nu in poissons] for ratio in ratios])
    along = np.linalg.inv(chebyshev.chebvander(t, _RATIO_NODES - 1))
    across = np.linalg.inv(chebyshev.chebvander(s, _POISSON_NODES - 1))
    table = np.einsum("gi,nj,ijk->gnk", along, across, np.log(values))
    np.savez(_HERE / "kalker.npz", chebyshev=table)


def _coefficients(ratio: float, nu: float) -> tuple[float, float, float, float]:
    """C11, C22, C23, C33; of C23 and C32 the one that converges faster."""
    found = creepage_coefficients(a_over_b=ratio, poisson=nu)
    return found.c11, found.c22, found.c32, found.c33


if __name__ == "__main__":
    for name in sys.argv[1:]:
        {"kalker": make_kalker}[name]()
