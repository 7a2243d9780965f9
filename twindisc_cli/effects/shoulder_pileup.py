"""Shoulder pile-up: part of the displaced material stands up beside the worn zone.

    h recorded (y) = h(y) + r d exp(-((|y| - y_e - w) / w)^2)

    d    greatest worn depth, y_e half-width of the worn zone, w width of a shoulder
    r    height of a shoulder over the worn depth [1]; r = 0 switches the effect off

Leaves behind, when it is missing: two humps even in y just outside the worn zone.
Valid for: soft or hot discs that flow plastically.
"""

from __future__ import annotations

import numpy as np

from twindisc_cli.effects._effect import Effect, Param
from twindisc_cli.effects._state import Floats, State


def apply(s: State, *, height_ratio: Floats, width_mm: Floats) -> State:
    """Add a shoulder on both sides of the worn zone."""
    if s.surface is None:
        return s
    surface, width = s.surface, 1e-3 * width_mm[..., None]
    outside = (np.abs(surface.y) - surface.edge - width) / width
    shoulder = height_ratio[..., None] * surface.depth * np.exp(-(outside**2))
    return s.on_surface(surface.height + shoulder)


EFFECT = Effect(
    stage="sensor",
    channel="profile",
    params=(
        Param("height_ratio", "1", off=0.0, start=0.1, lower=0.0, upper=1.0,
              meaning="height of a shoulder over the worn depth"),
        Param("width_mm", "mm", start=0.08, lower=0.005, upper=0.5, log=True, meaning="width of a shoulder"),
    ),
    apply=apply,
    source="K. L. Johnson, Contact Mechanics (1985), section 9.3; A. Kapoor, Wear 175 (1994) 119-127",
)  # fmt: skip
