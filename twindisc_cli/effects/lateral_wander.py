"""Lateral wander: the contact moves sideways during the test and spreads the wear.

    du/dn (y) = integral of du_0/dn (y - e) g(e; s) de

    g    normal distribution of the lateral position e, of standard deviation s (given in mm); s = 0 is off

Leaves behind, when it is missing: a profile residual even in y: predicted too deep and too narrow.
Valid for: axial play or run-out that is fast against an iteration.
"""

from __future__ import annotations

import numpy as np

from twindisc_cli.effects._effect import Effect, Param
from twindisc_cli.effects._state import Floats, State


def apply(s: State, *, std_mm: Floats) -> State:
    """Spread the wear of every revolution sideways."""
    return s.replace(wander=np.hypot(s.wander, 1e-3 * std_mm))


EFFECT = Effect(
    stage="contact",
    params=(
        Param("std_mm", "mm", off=0.0, start=0.15, lower=0.0, upper=0.6,
              meaning="standard deviation of the lateral position"),
    ),
    apply=apply,
    source="R. Enblom, M. Berg, Wear 258 (2005) 1055-1063",
)  # fmt: skip
