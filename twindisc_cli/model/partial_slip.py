"""Which strips of a patch dissipate the power while a part of it sticks.

    d = xi / (2 <1/h>),   s = (1 - d/h)^2 where h > d, else 0,   P = q (1 - sigma) / (1 - <sigma>)
    q sigma - (l^2 q sigma')' = q s,   no flux over the edges,   l = REACH (h_max - d)

    h, q   half-length [m] and line load [N/m] of the strip at y;   < >  mean over the load;   '  d/dy
    xi     normalised creepage, linear force / (mu N) [1];   d  half of what slides at the end of every strip [m]
    P      power of a strip per width, on the scale of q: its sum is that of q

Alone a strip would do without the share s of its load: where a part of it sticks, the traction is mu p less the
ellipse on h - d (as in `fastrip`), and d, given by the curvature along rolling and the creepage, is the same in all
strips. But strips drag their neighbours along, over about the length that sticks: sigma is s, evened out over l.
Where d reaches the largest h all slides, and power goes as load.

Source: strips of `fastrip`; REACH by half_space.rolling on 18 patches, new and worn (a/b 0.05 to 2.8, sections up to
60 times that of a facet as wide as the patch). On nine others (`make bench`; a/b 0.05 to 1.5) the power of a strip is
within 1.7 % of the largest from xi = 1 on, on the outermost fortieth of the width within 2.7 %; as load it is up to
12 % off. The worst found anywhere are 2.2 %, and 3.5 % at the edges of a deep track with a/b = 1.3. Valid for:
longitudinal creepage, xi >= 1, nu = 0.3; at xi = 0.5 it is up to 17 % off, as load is 19 %. With nu above 0.3, and in
the strips at the edges, 4.5 to 10 % were found.
"""

from __future__ import annotations

import numpy as np

from twindisc_cli.model.experiment import Floats
from twindisc_cli.physics.half_space import NoConvergenceError

REACH = 0.4  # fitted to half_space.rolling, see above
LEAST = 1e-3
"""Normalised creepage that any smaller one is taken for."""


def power_over_load(y: Floats, half_length: Floats, line_load: Floats, xi: Floats, *, mirrored: bool = False) -> Floats:
    """P/q [1] of strips (..., strip) at normalised creepages xi (..., 1), which broadcast.

    mirrored: y starts at 0, and what lies beyond is the mirror image.
    """
    weight = line_load
    if mirrored:
        weight = line_load.copy()
        weight[..., 0] *= 0.5
    total, longest = weight.sum(axis=-1, keepdims=True), half_length.max(axis=-1, keepdims=True)
    inverse = np.divide(1.0, half_length, out=np.zeros_like(half_length), where=line_load > 0.0)
    slid = 0.5 * np.maximum(xi, LEAST) * total / (weight * inverse).sum(axis=-1, keepdims=True)
    sticks = np.maximum(longest - slid, 0.0)
    if not sticks.any():
        return np.ones(np.broadcast_shapes(line_load.shape, slid.shape))
    alone = np.maximum(1.0 - slid * inverse, 0.0) ** 2
    slides = 1.0 - _evened(weight, line_load, alone, (REACH / (y[1] - y[0]) * sticks) ** 2)
    return np.asarray(slides / ((weight * slides).sum(axis=-1, keepdims=True) / total))


def _evened(weight: Floats, line_load: Floats, alone: Floats, reach: Floats) -> Floats:
    """sigma (..., strip) for s, strip by strip; reach: (l over the width of a strip)^2. All rows are one system."""
    from scipy.linalg.lapack import dptsv

    left, right = line_load[..., :-1], line_load[..., 1:]
    between = np.zeros_like(alone)
    between[..., :-1] = reach * (np.where((left > 0.0) & (right > 0.0), 0.5, 0.0) * (left + right))
    diagonal = np.where(line_load > 0.0, weight, 1.0) + between
    diagonal[..., 1:] += between[..., :-1]
    _, _, result, failed = dptsv(diagonal.ravel(), -between.ravel()[:-1], (weight * alone).ravel())
    if failed:
        raise NoConvergenceError("the strips of a patch in partial slip are not connected")
    return np.asarray(result).reshape(alone.shape)
