"""Nonlinear convection: the heat transfer grows or falls with the disc's own temperature.

    h S = (h S)_0 (1 + g |T - T_env|)

    T - T_env  disc temperature above the environment [K], (set, point)
    g          relative change of h S per kelvin [1/K]; g = 0 switches the effect off; negative towards film boiling

Leaves behind, when it is missing: the disc predicted too hot at high power and too cold at low power, or the reverse.
Valid for: natural convection, radiation and nucleate boiling over a limited range.
"""

from __future__ import annotations

import numpy as np

from twindisc_cli.effects._effect import Effect, Param, seen
from twindisc_cli.effects._state import Floats, State


def apply(s: State, *, per_kelvin: Floats) -> State:
    """Let the convection follow the warming of the disc."""
    return s.replace(convection=s.convection * np.maximum(1.0 + per_kelvin * np.abs(s.warming), 0.05))


EFFECT = Effect(
    stage="heat",
    channel="temperature",
    seen_in=seen("temperature"),
    params=(
        Param(
            "per_kelvin", "K-1", off=0.0, start=0.02, lower=-0.1, upper=1.0, meaning="relative change of h S per kelvin"
        ),
    ),
    apply=apply,
    source="S. W. Churchill, H. H. S. Chu, Int. J. Heat Mass Transf. 18 (1975); R. F. Barron, Cryogenic Heat Transfer",
)
