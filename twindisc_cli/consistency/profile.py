"""Profile: what the record of a worn track shows where it is whole.

hole in the track   a depth is known where heights were recorded
lone height         the deepest height of a track has neighbours that are nearly as deep
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from twindisc_cli.consistency.facts import Facts
from twindisc_cli.consistency.finding import Finding, number
from twindisc_cli.identify.track import last_profile

IN_THE_TRACK = 0.3  # of the depth: deeper is no flank
WIDE_HOLE = 5.0  # times what is usual between neighbours of a profile
LARGEST_HOLE = 0.1  # of the width: over it a parabola falls by a hundredth of the depth about its deepest point
LONE = 2.0  # times the deepest height but one
FEWEST_HEIGHTS = 12  # of a profile, of which two are neighbours at its deepest point


def hole_in_the_track(facts: Facts) -> Iterator[Finding]:
    """Between neighbours deep in the track no more is left out than a small part of its width."""
    profile = facts.test.measured.profile
    if profile is None or not facts.track:
        return
    last = last_profile(profile)
    y, deep = profile.y[last], -profile.height[last] > IN_THE_TRACK * facts.track.depth
    apart = np.diff(y) * (deep[1:] & deep[:-1])
    widest = int(np.argmax(apart))
    if apart[widest] > WIDE_HOLE * np.median(np.diff(y)):
        yield Finding(
            rule="hole in the track",
            subject="what is left out of the track",
            value=float(apart[widest] / facts.track.width),
            low=0.0,
            high=LARGEST_HOLE,
            unit="of its width",
            why="a depth between heights that were recorded",
            sentence=f"no height was recorded over {number(apart[widest] * 1e3)} mm deep in the track",
            hint="how deep it is there is not known, nor the K of its depth",
        )


def lone_height(facts: Facts) -> Iterator[Finding]:
    """No single height is far below all others."""
    profile = facts.test.measured.profile
    if profile is None:
        return
    last = last_profile(profile)
    depth = -profile.height[last]
    if len(depth) < FEWEST_HEIGHTS:
        return
    next_to_it, deepest = 1e6 * np.partition(depth, -2)[-2:]
    if next_to_it > 0.0 and deepest > LONE * next_to_it:
        yield Finding(
            rule="lone height",
            subject="the deepest height of the track",
            value=float(deepest),
            low=0.0,
            high=float(LONE * next_to_it),
            unit="µm",
            why="the deepest but one",
            sentence=f"one height is {number(deepest)} µm deep, and no other deeper than {number(next_to_it)} µm",
            hint="is it a scratch, dirt or an error of the instrument? then take it out of the file",
        )
