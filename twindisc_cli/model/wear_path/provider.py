"""Where a wear path comes from: the table, an integration, or the closed form of a line."""

from __future__ import annotations

from functools import lru_cache

from twindisc_cli.model import path_table
from twindisc_cli.model.experiment import Contact, Rig, Start
from twindisc_cli.model.wear_path.grid import first_section, tier
from twindisc_cli.model.wear_path.integrated import integrated_path
from twindisc_cli.model.wear_path.line import worn_strip
from twindisc_cli.model.wear_path.path import WearPath
from twindisc_cli.model.wear_path.tabulated import tabulated_path
from twindisc_cli.physics.half_space import OutOfRangeError


def wear_path(
    rig: Rig, *, contact: Contact, section: float, wander: float = 0.0, start: Start | None = None
) -> WearPath:
    """Return the path from the unworn discs to at least `section` [m2]; paths are remembered."""
    return remembered(rig, contact, tier(rig, section), float(wander), start)


def is_tabulated(rig: Rig, section: float, wander: float = 0.0, start: Start | None = None) -> bool:
    """Whether the table holds the path to at least `section` [m2]; none of a line, none from recorded new discs."""
    if rig.is_line or start is not None:
        return False
    scaled = tier(rig, section) / first_section(rig), wander / float(rig.patch.b)
    return path_table.is_covered(rig.curvature_y / rig.curvature_x, *scaled)


@lru_cache(maxsize=64)
def remembered(rig: Rig, contact: Contact, section: float, wander: float, start: Start | None) -> WearPath:
    """The path to a `tier`, from where it comes."""
    if rig.is_line:
        if start is not None:
            raise OutOfRangeError("along a line contact the profile of the new discs is not followed")
        return worn_strip(rig, section, wander)
    if is_tabulated(rig, section, wander, start):
        return tabulated_path(rig, contact, section, wander)
    return integrated_path(rig, contact, section, wander, start)
