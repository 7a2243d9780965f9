"""Profile tilt: the recorded profile is inclined and off zero.

    h recorded (y) = h(y) + m y + h_0

    m    slope (given in um/mm), h_0 offset (given in um); both zero switch the effect off

Leaves behind, when it is missing: a straight line under the profile, also outside the worn zone.
Valid for: a disc that does not sit level under the stylus.
"""

from __future__ import annotations

from twindisc_cli.effects._effect import Effect, Param
from twindisc_cli.effects._state import Floats, State


def apply(s: State, *, slope_um_mm: Floats, offset_um: Floats) -> State:
    """Add a straight line to the recorded surface."""
    if s.surface is None:
        return s
    line = 1e-3 * slope_um_mm[..., None] * s.surface.y + 1e-6 * offset_um[..., None]
    return s.on_surface(s.surface.height + line)


EFFECT = Effect(
    stage="sensor",
    channel="profile",
    params=(
        Param("slope_um_mm", "um mm-1", off=0.0, start=0.1, lower=-5.0, upper=5.0,
              meaning="slope of the recorded profile"),
        Param("offset_um", "um", off=0.0, start=0.1, lower=-5.0, upper=5.0,
              meaning="height of the recorded profile at y = 0"),
    ),
    apply=apply,
    exact=True,
    source="ISO 25178-2:2021, form removal",
)  # fmt: skip
