"""Profile: what the record of a worn track shows where it is whole.

upside down         wear takes material away: a track is cut in, and does not stand up
unit of the track   a track is about as deep as a facet of its width on the discs
hole in the track   a depth is known where heights were recorded
lone height         the deepest height of a track has neighbours that are nearly as deep
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from twindisc_cli.consistency.facts import Facts
from twindisc_cli.consistency.finding import Finding, number
from twindisc_cli.identify.track import UPSIDE_DOWN, Track, last_profile

IN_THE_TRACK = 0.3  # of the depth: deeper is no flank
WIDE_HOLE = 5.0  # times what is usual between neighbours of a profile
LARGEST_HOLE = 0.1  # of the width: over it a parabola falls by a hundredth of the depth about its deepest point
UNIT = 100.0  # times the depth of a facet of the track's width, or its width: no wear, but a unit
WIDER = 1.15  # times the patch of new discs: where a worn zone ends is a matter of reading
LONE = 2.0  # times the deepest height but one
FEWEST_HEIGHTS = 12  # of a profile, of which two are neighbours at its deepest point


def upside_down(facts: Facts) -> Iterator[Finding]:
    """The worn zone lies below the rest."""
    if facts.standing_up:
        yield Finding(
            rule="upside down",
            subject="what stands up in place of a track",
            value=facts.standing_up * 1e6,
            low=0.0,
            high=0.0,
            unit="µm",
            why="wear, which takes material away,",
            sentence=f"the {facts.test.measured.provenance} profile stands up by {number(facts.standing_up * 1e6)} µm "
            "where a track would be cut in",
            hint=UPSIDE_DOWN,
        )


def unit_of_the_track(facts: Facts) -> Iterator[Finding]:
    """Depth and width of the track are not hundreds of times off what discs of these radii make of each other."""
    if not facts.track or not off_in_unit(facts, facts.track):
        return
    depth, width = facts.track.depth, facts.track.width
    curvature, patch = facts.test.rig.curvature_y, 2.0 * float(facts.heaviest.patch.b)
    most = float(np.sqrt(8.0 * depth / curvature + patch**2))
    column = "y" if width > UNIT * most else "height"
    yield Finding(
        rule="unit of the track",
        subject="the width of the track",
        value=width * 1e3,
        low=0.0,
        high=most * 1e3,
        unit="mm",
        why=f"a depth of {number(depth * 1e6)} µm",
        sentence=f"the track is {width * 1e3:.4g} mm wide and {depth * 1e6:.4g} µm deep, where the new discs touch "
        f"over {number(patch * 1e3)} mm and a depth of {number(depth * 1e6)} µm makes a facet of "
        f"{number(np.sqrt(8.0 * depth / curvature) * 1e3)} mm",
        hint=f"is the column {column} of the profile in the unit of its header?",
    )


def off_in_unit(facts: Facts, track: Track) -> bool:
    """Whether depth and width of a track are so far apart that one of them is in another unit."""
    if facts.test.rig.is_line or not track.depth > 0.0:
        return False
    facet, patch = 8.0 * track.depth / facts.test.rig.curvature_y, 2.0 * float(facts.heaviest.patch.b)
    too_wide = track.width**2 - (WIDER * patch) ** 2 > UNIT * facet
    return bool(too_wide or facet > UNIT * track.width**2)


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
