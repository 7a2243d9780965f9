"""Wear threshold: only that by which the wear index exceeds a threshold wears the surface.

    K(y) = K max(0, 1 - c / i)

    i    wear index of the strip at y: energy dissipated per length rolled and area of the strip, (set, strip); in the
         middle of an elliptic patch 3 pi / 8 times the T gamma / A of the whole
    c    threshold of the wear index (given in N/mm2); c = 0 switches the effect off

Leaves behind, when it is missing: wear predicted, but not recorded, where the creepage is small and at the edges of the
track.
Valid for: surfaces with a protective layer or an endurance limit.
"""

from __future__ import annotations

import numpy as np

from twindisc_cli.effects._effect import Effect, Param
from twindisc_cli.effects._state import Floats, State


def apply(s: State, *, threshold_N_mm2: Floats) -> State:
    """Scale the wear coefficient of each strip by the excess of its wear index."""
    excess = 1.0 - 1e6 * threshold_N_mm2 / np.maximum(s.wear_index, 1e-30)
    return s.replace(wear_factor=s.wear_factor * np.maximum(excess, 0.0))


EFFECT = Effect(
    stage="wear",
    params=(
        Param("threshold_N_mm2", "N mm-2", off=0.0, start=2.0, lower=0.0, upper=120.0,
              meaning="wear index below which a strip does not wear"),
    ),
    apply=apply,
    over="wear_index",
    source="S. Fouvry, P. Kapsa, L. Vincent, Wear 200 (1996) 186-205",
    needs_stops=True,
    local=True,
)  # fmt: skip
