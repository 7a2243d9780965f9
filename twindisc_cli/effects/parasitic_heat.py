"""Parasitic heat: bearings and drag warm the disc whatever the traction.

    C dT/dt = P_d + P_0 - hS (T - T_env)

    C    heat capacity of the disc [J/K], hS its convection coefficient times surface [W/K]
    P_0  constant power [W]; P_0 = 0 switches the effect off

Leaves behind, when it is missing: the disc predicted too cold even where hardly any power is dissipated.
Valid for: constant speed.
"""

from __future__ import annotations

from twindisc_cli.effects._effect import Effect, Param
from twindisc_cli.effects._state import Floats, State


def apply(s: State, *, power_W: Floats) -> State:
    """Add a constant power to what warms the disc while it turns."""
    return s.replace(heat=s.heat + power_W * (s.rolling_speed > 0.0))


EFFECT = Effect(
    stage="heat",
    params=(
        Param("power_W", "W", off=0.0, start=2.0, lower=-20.0, upper=100.0, meaning="constant power into the disc"),
    ),
    apply=apply,
    same_as="an environment that is warmer than declared by the power over h S does the same while the discs turn",
    source="T. A. Harris, M. N. Kotzalas, Rolling Bearing Analysis, chapter 10",
)
