"""Stylus smoothing: the profilometer averages over the width of its tip and filter.

    h recorded (y) = integral of h(y - e) g(e; s) de

    g    normal distribution of standard deviation s (given in mm); s = 0 is off

Leaves behind, when it is missing: a profile residual even in y at the edges of the worn zone.
Valid for: tips and filters much narrower than the worn zone.
"""

from __future__ import annotations

import numpy as np

from twindisc_cli.effects._effect import Effect, Param
from twindisc_cli.effects._state import Floats, State


def apply(s: State, *, std_mm: Floats) -> State:
    """Average the recorded surface over the stylus."""
    if s.surface is None:
        return s
    frequency = np.fft.rfftfreq(2 * len(s.surface.y), s.surface.y[1] - s.surface.y[0])
    damping = np.exp(-0.5 * (2.0 * np.pi * frequency * 1e-3 * std_mm[..., None]) ** 2)
    mirrored = np.concatenate([s.surface.height, s.surface.height[..., ::-1]], axis=-1)
    smooth = np.fft.irfft(np.fft.rfft(mirrored) * damping, n=2 * len(s.surface.y))
    return s.on_surface(smooth[..., : len(s.surface.y)])


EFFECT = Effect(
    stage="sensor",
    channel="profile",
    params=(Param("std_mm", "mm", off=0.0, start=0.05, lower=0.0, upper=0.4, meaning="width of the tip and filter"),),
    apply=apply,
    source="ISO 16610-21:2011",
)
