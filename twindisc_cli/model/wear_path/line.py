"""The wear path of straight discs, which wear evenly over their width."""

from __future__ import annotations

import numpy as np
from scipy.special import erf

from twindisc_cli.model.experiment import Rig
from twindisc_cli.model.traction_law import creep_stiffness
from twindisc_cli.model.wear_path.path import CREEPAGES, PLACES, STRAIGHT, WearPath
from twindisc_cli.physics import line_contact

LINE_STRIPS, LINE_NODES = 401, 9
"""Strips over the width of straight discs, and nodes of their path, along which all is linear but the radius."""
DEEPEST = 0.5
"""Depth to which straight discs are followed, over the radius: with less left, the creepage is another."""


def worn_strip(rig: Rig, section: float, wander: float) -> WearPath:
    """Straight discs wear evenly over the width: u = S / w, disc 2's radius shrinks by it; wander softens the ends.

    The pressure stays Hertz's over the whole width, ends included.
    """
    half = 0.5 * rig.width
    strip = rig.width / LINE_STRIPS
    beyond = max(LINE_STRIPS // 20, int(np.ceil(4.0 * wander / strip)))
    y = np.asarray(strip * np.arange(-beyond - LINE_STRIPS // 2, beyond + LINE_STRIPS // 2 + 1), dtype=float)
    spread = max(wander, 1e-3 * strip) * np.sqrt(2.0)
    shape = 0.5 * (erf((y + half) / spread) - erf((y - half) / spread))
    nodes = np.linspace(0.0, min(section, DEEPEST * rig.disc2.rolling_radius * rig.width), LINE_NODES)
    depth = nodes[:, None] / rig.width * shape
    shrunk = 1.0 / rig.disc1.rolling_radius + 1.0 / (rig.disc2.rolling_radius - nodes / rig.width)
    patch = line_contact.line_contact(
        curvature=shrunk, normal_load=rig.normal_load, width=rig.width, effective_modulus=rig.effective_modulus
    )
    stiffness, stiffness_y = creep_stiffness(rig, patch.a, patch.b)
    inside = np.abs(y) < half
    return WearPath(
        section=nodes,
        y=y,
        depth=depth,
        line_load=np.where(inside, rig.normal_load / rig.width, 0.0) * np.ones_like(depth),
        a=patch.a,
        b=patch.b,
        p0=patch.p0,
        area=patch.area,
        stiffness=stiffness,
        stiffness_y=stiffness_y,
        square=np.zeros_like(nodes),
        edge=np.full_like(nodes, half + 2.0 * wander),
        error=0.0,
        pressure_error=0.0,
        spread=np.ones((len(nodes), len(CREEPAGES), len(PLACES))),
        wander=wander,
        scaling=STRAIGHT,
    )
