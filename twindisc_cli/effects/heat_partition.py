"""Heat partition: only a part of the dissipated power enters the disc whose temperature is recorded.

    C dT/dt = q P_d - hS (T - T_env)

    C    heat capacity of the disc [J/K], hS its convection coefficient times surface [W/K]
    q    part of the dissipated power [1]; q = 1 switches the effect off

Leaves behind, when it is missing: the disc predicted to warm too fast (the convection makes up for the level).
Valid for: q = 1/2 for equal discs; less where debris or coolant takes heat away.
"""

from __future__ import annotations

from twindisc_cli.effects._effect import Effect, Param
from twindisc_cli.effects._state import Floats, State


def apply(s: State, *, share: Floats) -> State:
    """Scale the dissipated power that enters the disc."""
    return s.replace(heat=s.heat - (1.0 - share) * s.power)


EFFECT = Effect(
    stage="heat",
    params=(
        Param("share", "1", off=1.0, start=0.7, lower=0.05, upper=1.5,
              meaning="part of the dissipated power that enters the disc"),
    ),
    apply=apply,
    same_as="a heat capacity of the disc that is off, or the gain of a thermometer, does the same with another "
            "convection; a share above 1 can only be one of these",
    source="H. Blok, Proc. General Discussion on Lubrication, IMechE 2 (1937) 222-235",
)  # fmt: skip
