"""Lateral offset: the middle of the worn zone is not at y = 0 of the recorded profile.

    h recorded (y) = h(y - y_0)

    y_0  lateral position of the contact in the profile's own coordinate (given in mm); y_0 = 0 switches the effect off

Leaves behind, when it is missing: a profile residual odd in y, in proportion to the slope of the profile.
Valid for: an axial misplacement of a disc or of the profile's origin.
"""

from __future__ import annotations

import numpy as np

from twindisc_cli.effects._effect import Effect, Param
from twindisc_cli.effects._state import Floats, State


def shifted(y: Floats, height: Floats, offset: Floats) -> Floats:
    """Return height (set, stop, strip) moved by offset (set, 1, 1) [m] along the uniform grid y (strip,)."""
    step = y[1] - y[0]
    position = np.clip((y - offset - y[0]) / step, 0.0, len(y) - 1.0)
    left = np.minimum(position.astype(int), len(y) - 2)
    left = np.broadcast_to(left, height.shape)
    part = position - left
    return np.asarray(
        (1.0 - part) * np.take_along_axis(height, left, -1) + part * np.take_along_axis(height, left + 1, -1)
    )


def apply(s: State, *, offset_mm: Floats) -> State:
    """Shift the recorded surface sideways."""
    if s.surface is None:
        return s
    return s.on_surface(shifted(s.surface.y, s.surface.height, 1e-3 * offset_mm[..., None]))


EFFECT = Effect(
    stage="sensor",
    channel="profile",
    params=(
        Param("offset_mm", "mm", off=0.0, start=0.05, lower=-1.0, upper=1.0,
              meaning="position of the middle of the worn zone"),
    ),
    apply=apply,
    source="ISO 25178-600:2019",
)  # fmt: skip
