"""What a set of directions can reach."""

from __future__ import annotations

import numpy as np

from twindisc_cli.model.experiment import Floats

NOTHING = 1e-9  # length of a unit column that others leave over by rounding


def span_of(columns: Floats) -> Floats:
    """Orthonormal basis (sample, rank) of columns (sample, column), whatever their lengths; zeros reach nothing."""
    lengths = np.linalg.norm(columns, axis=0)
    unit = columns[:, lengths > 0.0] / lengths[lengths > 0.0]
    if not unit.shape[1]:
        return np.empty((len(columns), 0))
    left, size, _ = np.linalg.svd(unit, full_matrices=False)
    return np.asarray(left[:, size > NOTHING])
