"""Running-in of wear: the wear coefficient settles over the first cycles.

    K(n) = K [1 + d exp(-n / n_0)]

    n    revolutions so far, (point,)
    d    relative excess of K at the start [1]; d = 0 switches the effect off
    n_0  revolutions of the settling

Leaves behind, when it is missing: early profiles predicted too shallow; a single final profile cannot show it.
Valid for: surfaces whose asperities are worn flat once.
"""

from __future__ import annotations

import numpy as np

from twindisc_cli.effects._effect import Effect, Param
from twindisc_cli.effects._state import Floats, State


def apply(s: State, *, excess: Floats, settling_cycles: Floats) -> State:
    """Scale the wear coefficient of every operating point."""
    return s.replace(wear_factor=s.wear_factor * (1.0 + excess * np.exp(-s.cycles / settling_cycles)))


EFFECT = Effect(
    stage="wear",
    params=(
        Param("excess", "1", off=0.0, start=2.0, lower=-0.95, upper=20.0,
              meaning="relative excess of K at the first revolution"),
        Param("settling_cycles", "1", start=30000.0, lower=20.0, upper=1e6, log=True,
              meaning="revolutions of the settling"),
    ),
    apply=apply,
    over="time",
    source="P. J. Blau, Wear 26 (1981) 29-43; M. M. Khruschov, Wear 28 (1974) 69-88",
    needs_stops=True,
)  # fmt: skip
