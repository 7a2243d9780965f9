"""Running-in of friction: the coefficient of friction settles over the first cycles.

    mu(n) = mu_0 [1 + d exp(-n / n_0)]

    n    revolutions so far, (point,)
    d    relative excess of mu at the start [1], negative where friction grows; d = 0 switches the effect off
    n_0  revolutions of the settling

Leaves behind, when it is missing: a traction residual that fades over the cycles, whatever the creepage.
Valid for: surfaces that run in or build a tribofilm once.
"""

from __future__ import annotations

import numpy as np

from twindisc_cli.effects._effect import Effect, Param
from twindisc_cli.effects._state import Floats, State


def apply(s: State, *, excess: Floats, settling_cycles: Floats) -> State:
    """Scale the coefficient of friction of every operating point."""
    return s.replace(mu=s.mu * (1.0 + excess * np.exp(-s.cycles / settling_cycles)))


EFFECT = Effect(
    stage="friction",
    params=(
        Param("excess", "1", off=0.0, start=-0.2, lower=-0.95, upper=3.0,
              meaning="relative excess of mu at the first revolution"),
        Param("settling_cycles", "1", start=30000.0, lower=20.0, upper=1e6, log=True,
              meaning="revolutions of the settling"),
    ),
    apply=apply,
    over="time",
    needs_time=True,
    source="P. J. Blau, Tribology International 38 (2005) 1007-1012",
)  # fmt: skip
