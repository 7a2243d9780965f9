"""The best circle through a worn profile, by least squares (the paper's way to update the curvatures).

    minimise sum_i w_i (z_i - c0 - c1 y_i - kappa y_i^2 / 2)^2

    y      across the track [m], (point,) or (..., point);   z  height, away from the axis is positive [m], (..., point)
    kappa  d2z/dy2 of the best circle [1/m]: a bump's is negative; minus it is the disc's transverse curvature

A circle and its parabola differ by the share (kappa y)^2/4 of the height: 2e-5 for a track 0.5 mm wide on 30 mm.
Source: section 3.2. Valid for: tracks narrow against the radius.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from twindisc_cli.physics._arrays import Floats, together


def fit_curvature(y: ArrayLike, z: ArrayLike, weights: ArrayLike) -> Floats:
    """The curvature d2z/dy2 [1/m] of the best circle through z(y) [m], weighted by `weights`, (...) of (..., point).

    NaN where fewer than three points have a weight.
    """
    y, z, w = together(y, z, weights)
    total = w.sum(axis=-1, keepdims=True)
    offset = y - (w * y).sum(axis=-1, keepdims=True) / total
    spread = (w * offset**2).sum(axis=-1, keepdims=True) / total
    skew = (w * offset**3).sum(axis=-1, keepdims=True) / total
    enough = np.count_nonzero(w, axis=-1) > 2
    skewed = np.divide(skew, spread, out=np.full_like(skew, np.nan), where=enough[..., None])
    bow = offset**2 - spread - skewed * offset  # orthogonal to a constant and a tilt
    curvature: Floats = 2.0 * (w * bow * z).sum(axis=-1) / (w * bow**2).sum(axis=-1)
    return curvature
