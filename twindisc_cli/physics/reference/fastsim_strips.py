"""What each strip of an ellipse transmits by FASTSIM without spin, in closed form.

    q(y) = 2 mu N / (pi b) [4 k h (h - k) + 4 k^3 / 3]  where h > k,   else 2 mu N / (pi b) 4 h^3 / 3
    h = sqrt(1 - y^2/b^2),   k = min(1, xi / FULL_SLIP)

Its integral over y is mu N saturation(xi); times V |v| it is the dissipated power per length P_l(y) [W/m].
Source: integration of the strips of `fastsim`, each of which sticks for s < 2 a(y) - 2 k a, then slides.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from twindisc_cli.physics._arrays import Floats, arrays
from twindisc_cli.physics.fastsim import FULL_SLIP


def traction_per_length(*, y: ArrayLike, b: ArrayLike, normal_load: ArrayLike, mu: ArrayLike, xi: ArrayLike) -> Floats:
    """The force per length [N/m] of the strip at `y` [m] at the normalised creepage xi [1]; all broadcast."""
    y, b, load, mu, xi = arrays(y, b, normal_load, mu, xi)
    k = np.minimum(xi / FULL_SLIP, 1.0)
    half_length = np.sqrt(np.maximum(1.0 - (y / b) ** 2, 0.0))
    stuck = 4.0 * k * half_length * (half_length - k) + (4.0 / 3.0) * k**3
    shape = np.where(half_length > k, stuck, (4.0 / 3.0) * half_length**3)
    return 2.0 / np.pi * mu * load / b * shape
