"""Falling friction: the local coefficient of friction drops as the sliding speed grows.

    mu(w) = mu_0 [A + (1 - A) exp(-B w)]

    w    sliding speed [m/s], (set, point)
    A    mu at infinite speed over mu_0 [1]; A = 1 switches the effect off
    B    decay [s/m]

Leaves behind, when it is missing: traction predicted too high at large creepage, too low at small.
Valid for: dry and wet steel; not for full-film lubrication. w is that of rigid discs. With the local slip at each place
of the patch in its stead the exact theory transmits up to 0.4 % of mu_0 N less just before full slip, and 0.1 % more
beyond (A = 0.6, B = 2 s/m); 1.6 % less with A = 0.3, B = 5 s/m, 2.5 % with 10 s/m.
"""

from __future__ import annotations

import numpy as np

from twindisc_cli.effects._effect import Effect, Param
from twindisc_cli.effects._state import Floats, State


def apply(s: State, *, ratio: Floats, decay_s_m: Floats) -> State:
    """Scale the coefficient of friction of every operating point."""
    return s.replace(mu=s.mu * (ratio + (1.0 - ratio) * np.exp(-decay_s_m * s.sliding_speed)))


EFFECT = Effect(
    stage="friction",
    params=(
        Param("ratio", "1", off=1.0, start=0.6, lower=0.05, upper=1.0,
              meaning="mu at infinite sliding speed over mu at rest"),
        Param("decay_s_m", "s m-1", start=2.0, lower=0.05, upper=30.0, log=True, meaning="decay with sliding speed"),
    ),
    apply=apply,
    over="creepage",
    source="O. Polach, Wear 258 (2005) 992-1000",
)  # fmt: skip
