"""Temperature-dependent wear: the wear coefficient follows the disc temperature.

    K(T) = K exp(beta (T - T_env))

    T - T_env  disc temperature above the environment [K], (set, point)
    beta       relative change of K per kelvin [1/K]; beta = 0 switches the effect off

Leaves behind, when it is missing: wear predicted too small where the disc is hot; seen in profiles of several stops.
Valid for: moderate changes of temperature.
"""

from __future__ import annotations

import numpy as np

from twindisc_cli.effects._effect import Effect, Param
from twindisc_cli.effects._state import Floats, State


def apply(s: State, *, per_kelvin: Floats) -> State:
    """Scale the wear coefficient by the warming of the disc."""
    return s.replace(wear_factor=s.wear_factor * np.exp(np.clip(per_kelvin * s.warming, -5.0, 5.0)))


EFFECT = Effect(
    stage="wear",
    params=(
        Param("per_kelvin", "K-1", off=0.0, start=0.05, lower=-0.4, upper=0.4,
              meaning="relative change of K per kelvin"),
    ),
    apply=apply,
    over="temperature",
    source="S. C. Lim, M. F. Ashby, Acta Metallurgica 35 (1987) 1-24",
    needs_stops=True,
    needs_temperature=True,
)  # fmt: skip
