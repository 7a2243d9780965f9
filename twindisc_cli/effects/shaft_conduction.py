"""Shaft conduction: heat flows from the disc into a shaft that warms up slowly.

    C dT/dt = P_d - hS (T - T_env) - G (T - T_s),    C_s dT_s/dt = G (T - T_s)

    C    heat capacity of the disc [J/K], hS its convection coefficient times surface [W/K]
    T_s  shaft temperature [K], C_s its heat capacity [J/K]
    G    conductance between disc and shaft [W/K]; G = 0 switches the effect off

Leaves behind, when it is missing: a temperature residual with a second, slower time constant.
Valid for: shafts that are long and poorly cooled.
"""

from __future__ import annotations

from twindisc_cli.effects._effect import Effect, Param
from twindisc_cli.effects._state import Floats, State


def apply(s: State, *, conductance_W_K: Floats, shaft_capacity_J_K: Floats) -> State:
    """Connect a shaft to the disc."""
    return s.replace(shaft_conductance=s.shaft_conductance + conductance_W_K, shaft_capacity=shaft_capacity_J_K)


EFFECT = Effect(
    stage="heat",
    params=(
        Param("conductance_W_K", "W K-1", off=0.0, start=0.5, lower=0.0, upper=20.0,
              meaning="conductance between disc and shaft"),
        Param("shaft_capacity_J_K", "J K-1", start=500.0, lower=20.0, upper=20000.0, log=True,
              meaning="heat capacity of the shaft"),
    ),
    apply=apply,
    source="R. Lewis, R. S. Dwyer-Joyce, Proc. IMechE J 218 (2004) 467-478, section 4",
)  # fmt: skip
