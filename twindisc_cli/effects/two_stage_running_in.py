"""Running-in of friction in two stages: what settles within the first cycles, and what goes on settling.

    mu(n) = mu_0 [1 + d_1 exp(-n / n_1) + d_2 exp(-n / (r n_1))]

    n         revolutions so far, (point,)
    d_1, d_2  relative excess of mu of the fast and of the slow stage at the start [1]; both 0 switch the effect off
    n_1       revolutions of the fast stage
    r         revolutions of the slow stage over those of the fast one [1]

Stages of opposite sign let friction rise to a peak and fall again, or dip.
Leaves behind, when it is missing: a traction residual that changes quickly first and slowly afterwards, whatever the
creepage.
Valid for: surfaces whose films are worn off or built up while their roughness settles.
"""

from __future__ import annotations

import numpy as np

from twindisc_cli.effects._effect import Effect, Param
from twindisc_cli.effects._state import Floats, State


def apply(s: State, *, fast_excess: Floats, fast_cycles: Floats, slow_excess: Floats, slow_to_fast: Floats) -> State:
    """Scale the coefficient of friction of every operating point."""
    fast = fast_excess * np.exp(-s.cycles / fast_cycles)
    slow = slow_excess * np.exp(-s.cycles / (slow_to_fast * fast_cycles))
    return s.replace(mu=s.mu * (1.0 + fast + slow))


EFFECT = Effect(
    stage="friction",
    params=(
        Param("fast_excess", "1", off=0.0, start=-0.2, lower=-0.45, upper=2.0,
              meaning="relative excess of mu of the fast stage at the first revolution"),
        Param("fast_cycles", "1", start=8000.0, lower=20.0, upper=1e5, log=True,
              meaning="revolutions of the fast stage"),
        Param("slow_excess", "1", off=0.0, start=-0.2, lower=-0.45, upper=2.0,
              meaning="relative excess of mu of the slow stage at the first revolution"),
        Param("slow_to_fast", "1", start=8.0, lower=3.0, upper=50.0, log=True,
              meaning="revolutions of the slow stage over those of the fast one"),
    ),
    apply=apply,
    over="time",
    needs_time=True,
    source="P. J. Blau, Tribology International 38 (2005) 1007-1012; P. J. Blau, Wear 71 (1981) 29-43",
)  # fmt: skip
