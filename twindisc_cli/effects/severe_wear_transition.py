"""Severe wear transition: K jumps where the wear index exceeds a critical value.

    K(y) = K [1 + (r - 1) phi],   phi = 1 / (1 + (c / i)^(1 / w))

    i    wear index of the strip at y: energy dissipated per length rolled and area of the strip, (set, strip); in the
         middle of an elliptic patch 3 pi / 8 times the T gamma / A of the whole
    phi  0 below the transition, 1 above; asperities pass it one after the other
    c    critical wear index of a strip (given in N/mm2)
    w    width of the transition, in the logarithm of the wear index [1]
    r    K above over K below [1]; r = 1 switches the effect off

Leaves behind, when it is missing: too little wear predicted in the severe part of the history, too much before; a track
deeper in its middle, where the patch is pressed most.
Valid for: dry steels passing from mild to severe wear.
"""

from __future__ import annotations

import numpy as np

from twindisc_cli.effects._effect import Effect, Param
from twindisc_cli.effects._state import Floats, State


def apply(s: State, *, ratio: Floats, critical_N_mm2: Floats, width: Floats) -> State:
    """Scale the wear coefficient of the strips above the transition."""
    severe = 0.5 + 0.5 * np.tanh(0.5 * np.log(np.maximum(s.wear_index, 1e-30) / (1e6 * critical_N_mm2)) / width)
    return s.replace(wear_factor=s.wear_factor * (1.0 + (ratio - 1.0) * severe))


EFFECT = Effect(
    stage="wear",
    params=(
        Param("ratio", "1", off=1.0, start=3.0, lower=0.1, upper=30.0, log=True,
              meaning="K above the transition over K below"),
        Param("critical_N_mm2", "N mm-2", start=6.0, lower=0.1, upper=120.0, log=True,
              meaning="critical wear index of a strip"),
        Param("width", "1", start=0.1, lower=0.02, upper=0.6, log=True, width_of="critical_N_mm2",
              meaning="width of the transition in the logarithm of the wear index"),
    ),
    apply=apply,
    over="wear_index",
    source="R. Lewis, R. S. Dwyer-Joyce, Proc. IMechE J 218 (2004) 467-478",
    needs_stops=True,
    local=True,
)  # fmt: skip
