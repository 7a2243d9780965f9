"""Sensor drift: the zero of the torque meter moves steadily with time.

    T/N recorded = T/N + c t N_0 / N

    t    time [s], (point,)
    c    drift of the torque over N_0 and the radius (given per hour); c = 0 switches the effect off
    N_0  nominal load of the rig, N the load of the step, by which the traction is divided [N]

Leaves behind, when it is missing: a traction residual that grows with time; no trace in wear and heat.
Valid for: strain gauges that warm up; zero checked only before the test.
"""

from __future__ import annotations

from twindisc_cli.effects._effect import Effect, Param
from twindisc_cli.effects._state import Floats, State


def apply(s: State, *, per_hour: Floats) -> State:
    """Add the drift to the recorded traction ratio."""
    drift = per_hour * s.time / 3600.0
    return s.replace(traction_ratio=s.traction_ratio + drift * s.nominal_load / s.recorded_load)


EFFECT = Effect(
    stage="sensor",
    channel="traction",
    params=(
        Param("per_hour", "h-1", off=0.0, start=0.02, lower=-0.5, upper=0.5,
              meaning="drift of the recorded traction ratio at the nominal load per hour"),
    ),
    apply=apply,
    over="time",
    needs_time=True,
    source="ISO/IEC Guide 98-3:2008, section F.2.4",
)  # fmt: skip
