"""Ambient drift: the environment warms or cools steadily during the test.

    T_env(t) = T_env + c t

    t    time [s], (point,)
    c    drift of the environment (given in K/h); c = 0 switches the effect off

Leaves behind, when it is missing: a temperature residual that grows with time, whatever the power.
Valid for: rooms and cryostats that are not controlled.
"""

from __future__ import annotations

from twindisc_cli.effects._effect import Effect, Param
from twindisc_cli.effects._state import Floats, State


def apply(s: State, *, K_per_hour: Floats) -> State:
    """Let the environment drift."""
    return s.replace(environment=s.environment + K_per_hour * s.time / 3600.0)


EFFECT = Effect(
    stage="heat",
    params=(
        Param("K_per_hour", "K h-1", off=0.0, start=1.0, lower=-60.0, upper=60.0,
              meaning="drift of the environment per hour"),
    ),
    apply=apply,
    over="time",
    source="F. P. Incropera, D. P. DeWitt, Fundamentals of Heat and Mass Transfer, chapter 5",
)  # fmt: skip
