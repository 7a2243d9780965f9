"""Strips across the track and nodes along a wear path: what an integration and the table are read on."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from twindisc_cli.model.experiment import Floats, Rig
from twindisc_cli.physics.half_space import OutOfRangeError

STRIPS, MOST_STRIPS = 121, 901
STRIPS_ACROSS = 10
"""Strips that the unworn patch spans at least: a track far wider than it needs more than STRIPS."""
GROWTH, FIRST = 0.06, 0.3
"""Growth of the section in a step, and the section from which on it holds, over that on which the contact changes."""


@lru_cache(maxsize=64)
def first_section(rig: Rig) -> float:
    """The section [m2] on which the contact begins to change: a facet as wide as the unworn patch.

    Straight discs have none; of them it is what is as deep as the ends of their strip press in.
    """
    if rig.is_line:
        return float(rig.normal_load / (np.pi * rig.effective_modulus))
    return float(rig.curvature_y * (2.0 * rig.patch.b) ** 3 / 12.0)


def tier(rig: Rig, section: float) -> float:
    """The section [m2] up to which a path is made so that it may serve others: a power of two, at least the first."""
    return float(2.0 ** np.ceil(np.log2(max(section, first_section(rig)))))


def strips_of(rig: Rig, section: float, wander: float) -> Floats:
    """Strips that hold the facet of this section (width^3 = 12 S / curvature) and the patch around it."""
    b = float(rig.patch.b)
    return strips_over(rig, section, wander, widest=b, narrowest=b, fewest=STRIPS_ACROSS)


def strips_over(rig: Rig, section: float, wander: float, *, widest: float, narrowest: float, fewest: int) -> Floats:
    """The same for unworn patches of several half-widths [m], the narrowest of which spans so many strips at least."""
    half = half_width(rig, section, wander, widest)
    count = max(STRIPS, 2 * int(np.ceil(0.5 * fewest * half / narrowest)) + 1)
    if count > MOST_STRIPS:
        times = _facet(rig, section) / narrowest
        raise OutOfRangeError(
            f"the track would become {times:.3g} times as wide as the unworn patch; it is followed up to "
            f"{MOST_STRIPS / STRIPS_ACROSS / 1.25:.0f} times: do load, wear coefficient and profile belong together?"
        )
    return np.asarray(half / (count // 2) * np.arange(-(count // 2), count // 2 + 1), dtype=float)


def half_width(rig: Rig, section: float, wander: float, widest: float) -> float:
    """Half of the width [m] of strips that hold the facet of a section [m2] and a patch of some half-width [m]."""
    facet = _facet(rig, section)
    return max(1.1 * facet + 1.3 * widest, 1.25 * facet) + 3.0 * wander


def _facet(rig: Rig, section: float) -> float:
    """Half-width of a flat facet [m]."""
    return float(0.5 * np.cbrt(12.0 * section / rig.curvature_y))


def nodes_to(rig: Rig, section: float, growth: float | None = None) -> Floats:
    """Nodes from 0 to `section` [m2] whose steps grow with the section, by GROWTH or as said."""
    first = FIRST * first_section(rig)
    count = int(np.ceil(np.log1p(section / first) / np.log1p(GROWTH if growth is None else growth)))
    return np.asarray(first * np.expm1(np.linspace(0.0, np.log1p(section / first), count + 1)))
