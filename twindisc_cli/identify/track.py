"""Depth and width of a worn track, from a measured or a simulated profile: the same in every command.

depth   of the deepest point [m], of a profile smoothed over a fortieth of its length against roughness
width   of the part around it that is deeper than 5 % of the depth [m]
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from twindisc_cli.model.experiment import Floats, ProfileSamples

WIDTH_LEVEL = 0.05  # of the depth: below it a track's edge is roughness
UP = 3.0  # times as high as deep: roughness and shoulders beside a track are less
SMOOTHED_OVER = 40  # parts of a profile: a mean over one keeps a track of 20 of them

UPSIDE_DOWN = (
    "is the column height of its file depth, or upside down? Then columns.height = { sign = -1 } under [measured] "
    "turns it; or is the crown of the disc still in it?"
)
"""What to look at where material stands in place of a track."""


@dataclass(frozen=True)
class Track:
    """Depth and width of a worn track [m]."""

    depth: float
    width: float


def last_profile(profile: ProfileSamples) -> NDArray[np.intp]:
    """The samples of the last profile of disc 2, or of disc 1 where only that was measured, in order of y."""
    mine = profile.disc == profile.disc.max()
    mine &= profile.iteration == profile.iteration[mine].max()
    return np.flatnonzero(mine)[np.argsort(profile.y[mine])]


def worn_track(y: Floats, height: Floats, *, smooth: bool) -> Track:
    """The track in a profile: height [m], negative where material is gone, at increasing y [m]; each (point,).

    `smooth` is for measured profiles. The edges lie between points, where the profile crosses the 5 % level.
    """
    depth = _smoothed(-height) if smooth else -height
    bottom = int(np.argmax(depth))
    deepest = float(depth[bottom])
    if not deepest > 0.0:
        return Track(depth=0.0, width=0.0)
    level = WIDTH_LEVEL * deepest
    left = _edge(y[bottom::-1], depth[bottom::-1], level)
    right = _edge(y[bottom:], depth[bottom:], level)
    return Track(depth=deepest, width=right - left)


def standing_up(y: Floats, height: Floats) -> float:
    """Height [m] by which a measured profile, as of `worn_track`, stands up where a track would be cut in, else 0."""
    up, down = (worn_track(y, sign * height, smooth=True).depth for sign in (-1.0, 1.0))
    return up if float(np.trapezoid(height, y)) > 0.0 and up > UP * down else 0.0


def _edge(y: Floats, depth: Floats, level: float) -> float:
    """Where the depth first falls below a level on the way out from the deepest point."""
    outside = np.flatnonzero(depth < level)
    if not len(outside):
        return float(y[-1])
    i = int(outside[0])
    part = (depth[i - 1] - level) / (depth[i - 1] - depth[i])
    return float(y[i - 1] + part * (y[i] - y[i - 1]))


def _smoothed(depth: Floats) -> Floats:
    """Running mean over a fortieth of the profile."""
    width = 2 * (len(depth) // (2 * SMOOTHED_OVER)) + 1
    padded = np.pad(depth, width // 2, mode="edge")
    return np.convolve(padded, np.full(width, 1.0 / width), mode="valid")
