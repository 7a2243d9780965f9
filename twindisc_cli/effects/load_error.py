"""Load error: the true normal load differs from the nominal one, by which the traction was divided.

    N = N_nominal (1 + e),   T/N recorded = T / N_nominal

    e    relative error of the load (given in percent); e = 0 switches the effect off

Leaves behind, when it is missing: a traction residual in proportion to T, less of it below saturation.
Valid for: static load cells with a wrong factor; friction in the loading arm.
"""

from __future__ import annotations

from twindisc_cli.effects._effect import Effect, Param
from twindisc_cli.effects._state import Floats, State


def apply(s: State, *, error_percent: Floats) -> State:
    """Scale the normal load of every operating point."""
    return s.replace(normal_load=s.normal_load * (1.0 + error_percent / 100.0))


EFFECT = Effect(
    stage="operation",
    params=(
        Param("error_percent", "%", off=0.0, start=5.0, lower=-40.0, upper=40.0,
              meaning="true load over nominal load, minus one"),
    ),
    apply=apply,
    source="K. L. Johnson, Contact Mechanics (1985), section 4.2",
)  # fmt: skip
