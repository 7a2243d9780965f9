"""The contact over one gap on strips in one call; a gap that is its own mirror image is solved on one side."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from twindisc_cli.model.experiment import Floats
from twindisc_cli.physics.half_space.normal import NormalContact
from twindisc_cli.physics.half_space.strips import FEWEST_STRIPS, StripContact, Strips


def solve_strips(
    *,
    y: Floats,
    gap: Floats,
    curvature_x: ArrayLike,
    normal_load: ArrayLike,
    effective_modulus: ArrayLike,
    compliance: Floats | None = None,
    start: StripContact | None = None,
    relative_accuracy: float = 1e-3,
) -> StripContact:
    """Line load and half-length of every strip, and the approach; symbols as in `Strips`.

    y (strip,), gap (..., strip), the three numbers (...), compliance (..., strip, strip).
    """
    y, gap = np.asarray(y, dtype=float), np.asarray(gap, dtype=float)
    fold = compliance is None and start is None and _is_symmetric(y, gap)
    side = slice(y.size // 2 if fold else 0, None)
    stacked = () if compliance is None else np.shape(compliance)[:-2]
    strips = Strips.of(
        y=y[side],
        cases=np.broadcast_shapes(gap.shape[:-1], stacked),
        curvature_x=curvature_x,
        normal_load=normal_load,
        effective_modulus=effective_modulus,
        mirrored=fold,
    )
    one = strips.pressed(gap[..., side], compliance=compliance, start=start, relative_accuracy=relative_accuracy)
    if not fold:
        return one
    return replace(one, y=y, half_length=_unfolded(one.half_length, y), line_load=_unfolded(one.line_load, y))


def _is_symmetric(y: Floats, gap: Floats) -> bool:
    """Whether places and gap are their own mirror images, to rounding."""
    if y.ndim != 1 or y.size < 2 * FEWEST_STRIPS or gap.shape[-1:] != y.shape or not np.isfinite(gap).all():
        return False
    places, gaps = (np.abs(one - other).max() for one, other in ((y, -y[::-1]), (gap, gap[..., ::-1])))
    return bool(places < 1e-9 * np.ptp(y) and gaps <= 1e-12 * np.ptp(gap))


def _unfolded(values: Floats, y: Floats) -> Floats:
    """Both sides of the strips y from one, (..., strip); an odd one in the middle is no twin."""
    return np.concatenate([values[..., y.size % 2 :][..., ::-1], values], axis=-1)


def semi_width(contact: StripContact | NormalContact) -> float:
    """Half the distance between the outer edges of one patch [m]."""
    first, last = contact.extent
    return 0.5 * float(last - first)
