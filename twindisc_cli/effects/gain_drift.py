"""Gain drift: the torque meter reads ever more, or less, of the torque that there is.

    T/N recorded = T/N (1 + c t)

    t   time [s], (point,)
    c   drift of the gain (given per hour); c = 0 switches the effect off

Leaves behind, when it is missing: a traction residual that grows with time in proportion to T/N, where a zero that
moves leaves one that is the same at all creepages; no trace in wear and heat.
Valid for: strain gauges and amplifiers that warm up; a load cell that reads ever less or more of the load.
"""

from __future__ import annotations

from twindisc_cli.effects._effect import Effect, Param
from twindisc_cli.effects._state import Floats, State


def apply(s: State, *, per_hour: Floats) -> State:
    """Scale the recorded traction ratio."""
    return s.replace(traction_ratio=s.traction_ratio * (1.0 + per_hour * s.time / 3600.0))


EFFECT = Effect(
    stage="sensor",
    channel="traction",
    params=(
        Param("per_hour", "h-1", off=0.0, start=0.05, lower=-1.0, upper=1.0,
              meaning="drift of the recorded over the true traction ratio per hour"),
    ),
    apply=apply,
    over="time",
    needs_time=True,
    source="ISO/IEC Guide 98-3:2008, section F.2.4",
)  # fmt: skip
