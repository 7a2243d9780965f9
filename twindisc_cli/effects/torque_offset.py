"""Torque offset: the torque meter reads a constant besides the traction of the contact.

    T/N recorded = T/N + t_0

    t_0  offset of the recorded traction ratio [1]; t_0 = 0 switches the effect off

Leaves behind, when it is missing: the same traction residual at every creepage; no trace in wear and heat.
Valid for: zero errors and constant bearing drag.
"""

from __future__ import annotations

from twindisc_cli.effects._effect import Effect, Param, seen
from twindisc_cli.effects._state import Floats, State


def apply(s: State, *, offset: Floats) -> State:
    """Add the offset to the recorded traction ratio."""
    return s.replace(traction_ratio=s.traction_ratio + offset)


EFFECT = Effect(
    stage="sensor",
    channel="traction",
    seen_in=seen("traction"),
    params=(
        Param("offset", "1", off=0.0, start=0.02, lower=-0.3, upper=0.3, meaning="recorded minus true traction ratio"),
    ),
    apply=apply,
    source="R. S. Dwyer-Joyce, R. Lewis, Proc. IMechE J 218 (2004) 467-478",
)
