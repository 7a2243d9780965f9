"""Temperature-dependent friction: the local coefficient of friction follows the disc temperature.

    mu(T) = mu_0 exp(beta (T - T_env))

    T - T_env  disc temperature above the environment [K], (set, point)
    beta       relative change of mu per kelvin [1/K]; beta = 0 switches the effect off

Leaves behind, when it is missing: a traction residual that follows the temperature, which lags the power.
Valid for: moderate changes of temperature, below softening of the steel.
"""

from __future__ import annotations

import numpy as np

from twindisc_cli.effects._effect import Effect, Param
from twindisc_cli.effects._state import Floats, State


def apply(s: State, *, per_kelvin: Floats) -> State:
    """Scale the coefficient of friction by the warming of the disc."""
    return s.replace(mu=s.mu * np.exp(np.clip(per_kelvin * s.warming, -5.0, 5.0)))


EFFECT = Effect(
    stage="friction",
    params=(
        Param("per_kelvin", "K-1", off=0.0, start=-0.01, lower=-0.15, upper=0.15,
              meaning="relative change of mu per kelvin"),
    ),
    apply=apply,
    over="temperature",
    needs_time=True,
    source="K. Six, A. Meierhofer, G. Mueller, P. Dietmaier, Vehicle System Dynamics 53 (2015) 726-747",
    needs_temperature=True,
)  # fmt: skip
