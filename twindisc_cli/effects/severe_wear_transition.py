"""Severe wear transition: K jumps where the wear index exceeds a critical value.

    K_eff = K [1 + (r - 1) phi],   phi = (3 e - e^3) / 2,   e^2 = 1 - (c / i_max)^2,   i_max = (3 pi / 8) T gamma / A

    T gamma / A  energy dissipated per length rolled and area of the patch, (set, point)
    i_max        its value in the middle strip of an elliptic patch; the strips |y| < e b exceed c
    phi          share of the energy dissipated in those strips
    c            critical T gamma / A of a strip (given in N/mm2), passed gradually: e^2 is rounded off over 0.03
    r            K above over K below [1]; r = 1 switches the effect off

Leaves behind, when it is missing: too little wear predicted in the severe part of the history, too much before.
Valid for: dry steels passing from mild to severe wear.
"""

from __future__ import annotations

import numpy as np

from twindisc_cli.effects._effect import Effect, Param, seen
from twindisc_cli.effects._state import Floats, State

_WIDTH = 0.03


def apply(s: State, *, ratio: Floats, critical_N_mm2: Floats) -> State:
    """Scale the wear coefficient by the share of the energy that is dissipated above the transition."""
    middle = 3.0 * np.pi / 8.0 * s.wear_index
    excess = 1.0 - (1e6 * critical_N_mm2 / np.maximum(middle, 1e-6)) ** 2
    severe = np.sqrt(np.minimum(_WIDTH * np.logaddexp(0.0, excess / _WIDTH), 1.0))
    return s.replace(wear_factor=s.wear_factor * (1.0 + (ratio - 1.0) * (3.0 * severe - severe**3) / 2.0))


EFFECT = Effect(
    stage="wear",
    channel="profile",
    seen_in=seen("traction", "profile", "temperature"),
    params=(
        Param(
            "ratio",
            "1",
            off=1.0,
            start=3.0,
            lower=0.1,
            upper=30.0,
            meaning="K above the transition over K below",
            log=True,
        ),
        Param(
            "critical_N_mm2",
            "N mm-2",
            off=None,
            start=6.0,
            lower=0.1,
            upper=60.0,
            meaning="critical T gamma / A",
            log=True,
        ),
    ),
    apply=apply,
    source="R. Lewis, R. S. Dwyer-Joyce, Proc. IMechE J 218 (2004) 467-478",
    needs_stops=True,
)
