"""A wear path read off the table of `path_table`, on the strips and nodes of a rig."""

from __future__ import annotations

import numpy as np

from twindisc_cli.model import path_table
from twindisc_cli.model.experiment import Contact, Rig
from twindisc_cli.model.integration import spreading
from twindisc_cli.model.traction_law import creep_stiffness
from twindisc_cli.model.wear_path.grid import first_section, nodes_to, strips_of
from twindisc_cli.model.wear_path.path import WearPath, edges_of


def tabulated_path(rig: Rig, contact: Contact, section: float, wander: float) -> WearPath:
    """The path read off the table, which must cover it."""
    y, nodes, b = strips_of(rig, section, wander), nodes_to(rig, section), float(rig.patch.b)
    halves = np.insert(nodes, np.arange(1, len(nodes)), 0.5 * (nodes[1:] + nodes[:-1]))
    ratio, sections = rig.curvature_y / rig.curvature_x, halves / first_section(rig)
    tabulated = path_table.tabulated(contact, ratio=ratio, section=sections, wander=wander / b, y=y / b)
    share = tabulated.load / (y[1] - y[0])
    rate = share @ spreading(y, wander).T
    steps = np.diff(nodes)[:, None] * (rate[:-2:2] + 4.0 * rate[1::2] + rate[2::2]) / 6.0
    depth = np.concatenate([np.zeros((1, len(y))), np.cumsum(steps, axis=0)])
    node = slice(None, None, 2)
    patch_a, patch_b = tabulated.a[node] * rig.patch.a, tabulated.b[node] * b
    stiffness, stiffness_y = creep_stiffness(rig, patch_a, patch_b)
    return WearPath(
        section=nodes,
        y=y,
        depth=depth,
        line_load=rig.normal_load * share[node],
        a=patch_a,
        b=patch_b,
        p0=tabulated.p0[node] * rig.patch.p0,
        area=tabulated.area[node] * np.pi * rig.patch.a * b,
        stiffness=stiffness * tabulated.stiffening[node],
        stiffness_y=stiffness_y * tabulated.stiffening[node],
        square=tabulated.square[node],
        edge=edges_of(y, depth, patch_b),
        spread=tabulated.spread[node],
        error=path_table.ERRORS[contact],
        pressure_error=tabulated.pressure_error,
        contact=contact,
        wander=wander,
    )
