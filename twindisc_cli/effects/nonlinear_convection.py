"""Nonlinear convection: the heat transfer grows or falls with the disc's own temperature.

    h S = (h S)_0 [(T_0 + |T - T_env|) / (T_0 + 10 K)]^n

    T - T_env  disc temperature above the environment [K], (set, point)
    n          exponent [1]: about 1/4 in free convection, up to 2 in nucleate boiling, below 0 towards film boiling;
               n = 0 switches the effect off
    T_0        warming below which the heat transfer stands still [K]; small: a power law; (h S)_0 holds at 10 K

Leaves behind, when it is missing: the disc predicted too hot at high power and too cold at low power, or the reverse.
Valid for: free convection and nucleate boiling, without the jump at the burnout point.
"""

from __future__ import annotations

import numpy as np

from twindisc_cli.effects._effect import Effect, Param
from twindisc_cli.effects._state import Floats, State

_REFERENCE = 10.0  # K


def apply(s: State, *, exponent: Floats, onset_K: Floats) -> State:
    """Let the convection follow the warming of the disc."""
    return s.replace(convection=s.convection * ((onset_K + np.abs(s.warming)) / (onset_K + _REFERENCE)) ** exponent)


EFFECT = Effect(
    stage="heat",
    params=(
        Param("exponent", "1", off=0.0, start=0.25, lower=-2.0, upper=4.0,
              meaning="exponent of the heat transfer over the warming"),
        Param("onset_K", "K", start=10.0, lower=0.1, upper=200.0, log=True,
              meaning="warming below which the heat transfer stands still"),
    ),
    apply=apply,
    over="temperature",
    source="S. W. Churchill, H. H. S. Chu, Int. J. Heat Mass Transf. 18 (1975); R. F. Barron, Cryogenic Heat Transfer",
)  # fmt: skip
