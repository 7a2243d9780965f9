"""The figure of a wear coefficient from weighed mass: volume over energy, and over the iterations."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from twindisc_cli.figures.style import BLUE, legend, measured_points, name_axes, page

if TYPE_CHECKING:
    from twindisc_cli.identify.mass import MassFit

VOLUME = "worn volume [mm³]"


def weighed(fit: MassFit, *, name: str, provenance: str) -> Figure:
    """Volume as weighed and at K, over the dissipated energy and over the iterations."""
    figure, (left, right) = page(1, 2, height=3.2, title=f"{name}: wear by weight", provenance=provenance)
    half = 1.645 * fit.error * 1e9
    for axes, x in ((left, fit.energy * 1e-3), (right, fit.iteration.astype(float))):
        measured_points(axes, x, fit.volume * 1e9, half, label=f"{provenance}, 90 % interval")
        axes.plot(np.insert(x, 0, 0.0), np.insert(fit.predicted * 1e9, 0, 0.0), color=BLUE, marker=".",
                  label=f"$K$ = {fit.wear_coefficient:.3g}")  # fmt: skip
        axes.set_xlim(0.0, None)
        axes.set_ylim(0.0, None)
        legend(axes, "upper left")
    name_axes(left, "dissipated energy [kJ]", VOLUME)
    name_axes(right, "iteration", VOLUME)
    return figure
