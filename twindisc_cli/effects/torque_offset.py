"""Torque offset: the torque meter reads a constant besides the traction of the contact.

    T/N recorded = T/N + t_0 N_0 / N

    t_0  torque of the zero over N_0 and the radius [1]; t_0 = 0 switches the effect off
    N_0  nominal load of the rig, N the load of the step, by which the traction is divided [N]

The zero is a torque, so that it counts less in T/N where the load is larger.
Leaves behind, when it is missing: at one load the same traction residual at every creepage; no trace in wear and heat.
Valid for: zero errors and constant bearing drag.
"""

from __future__ import annotations

from twindisc_cli.effects._effect import Effect, Param
from twindisc_cli.effects._state import Floats, State


def apply(s: State, *, offset: Floats) -> State:
    """Add the zero to the recorded traction ratio."""
    return s.replace(traction_ratio=s.traction_ratio + offset * s.nominal_load / s.recorded_load)


EFFECT = Effect(
    stage="sensor",
    channel="traction",
    params=(
        Param("offset", "1", off=0.0, start=0.02, lower=-0.3, upper=0.3,
              meaning="recorded minus true traction ratio at the nominal load"),
    ),
    apply=apply,
    exact=True,
    source="R. S. Dwyer-Joyce, R. Lewis, Proc. IMechE J 218 (2004) 467-478",
)  # fmt: skip
