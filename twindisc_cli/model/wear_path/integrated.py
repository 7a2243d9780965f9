"""A wear path integrated with one wear coefficient all over, for what the table does not cover.

Its `error` is the difference to a path of twice the step, over three; `pressure_error` is such a difference as it
stands.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from twindisc_cli.model.experiment import Contact, Rig, Start
from twindisc_cli.model.integration import Setup, integrate
from twindisc_cli.model.wear_path import grid
from twindisc_cli.model.wear_path.grid import nodes_to, strips_of
from twindisc_cli.model.wear_path.path import WearPath, paths_of


@lru_cache(maxsize=64)
def integrated_path(rig: Rig, contact: Contact, section: float, wander: float, start: Start | None = None) -> WearPath:
    """The path by integration, for what the table does not cover."""
    setup = Setup(rig, contact, wander, start)
    y = strips_of(rig, section, wander)
    nodes = nodes_to(rig, section)
    integrated = integrate(setup, y, nodes)
    if wander:
        plain = integrated_path(rig, contact, section, 0.0, start)
        error, pressure_error = plain.error, plain.pressure_error
    else:
        coarse_nodes = nodes_to(rig, section, 2.0 * grid.GROWTH)
        coarse = integrate(setup, y, coarse_nodes)
        error = abs(integrated.depth[0, -1].max() / coarse.depth[0, -1].max() - 1.0) / 3.0
        coarse_p0 = np.interp(nodes, coarse_nodes, coarse.contact.p0[0])
        pressure_error = np.max(np.abs(coarse_p0 / integrated.contact.p0[0] - 1.0))
    errors = float(error), float(pressure_error)
    return paths_of(setup, integrated, y=y, nodes=nodes, errors=errors)[0]
