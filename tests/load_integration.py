"""A worn profile integrated over a history of loads in many small steps, with none of the model's paths.

Wear goes strip by strip with the load, du/dS = g / N, by backward differences of order 1 in half-space contact and by
explicit steps with the best circle in Hertz's; force by the law of the patch as it is at each step.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from table_makers.strips import solve_strips
from twindisc_cli.model.experiment import Contact, Rig
from twindisc_cli.model.traction_law import creep_stiffness, traction_law
from twindisc_cli.physics import hertz
from twindisc_cli.physics.best_circle import fit_curvature
from twindisc_cli.physics.half_space.strips import StripContact, equivalent_ellipse

Floats = NDArray[np.float64]


def hertz_line_load(rig: Rig, y: Floats, worn: Floats, load: float) -> tuple[Floats, float, float]:
    """Line load (strip,) and semi-axes of the ellipse whose own half-width fits the best circle inside it."""

    def ellipse(curvature: float) -> hertz.Ellipse:
        return hertz.contact_ellipse(
            curvature_x=rig.curvature_x, curvature_y=curvature, normal_load=load,
            effective_modulus=rig.effective_modulus,
        )  # fmt: skip

    def excess(log: float) -> float:
        b = float(ellipse(np.exp(log)).b)
        inside = np.clip((b - np.abs(y)) / (y[1] - y[0]) + 0.5, 0.0, 1.0)
        fitted = rig.curvature_y + float(fit_curvature(y, worn, inside))
        return float(np.exp(log)) - fitted

    curvature = float(np.exp(brentq(excess, np.log(1e-7 * rig.curvature_y), np.log(1.5 * rig.curvature_y), xtol=1e-9)))
    found = ellipse(curvature)
    a, b = float(found.a), float(found.b)
    half = 0.5 * (y[1] - y[0])
    outer, inner = (np.clip((y + side) / b, -1.0, 1.0) for side in (half, -half))
    share = 0.75 * ((outer - outer**3 / 3.0) - (inner - inner**3 / 3.0))
    return load * share / (2.0 * half), a, b


def integrated(
    rig: Rig, contact: Contact, y: Floats, *, loads: Floats, creepage: Floats, mu: float, wear: float, steps: int
) -> tuple[Floats, Floats]:
    """Greatest depth [m] and T/N [1] at the end of each piece (piece,).

    loads [N], creepage [1] of each piece; wear: section worn per energy and length rolled, S = wear * integral T v,
    per piece [m2/N]; steps: of each piece, which grow with the way from its beginning.
    """
    law = traction_law(rig, "exact")
    worn, depths, ratios = np.zeros_like(y), [], []
    warm: StripContact | None = None
    for load, slip in zip(loads, creepage, strict=True):
        ways = np.diff(np.linspace(0.0, 1.0, steps + 1) ** 2)
        for way in ways:
            if contact == "hertz":
                line, a, b = hertz_line_load(rig, y, worn, load)
                stiffness = float(creep_stiffness(rig, np.array(a), np.array(b))[0])
            else:
                warm = pressed(rig, y, worn, load, None, None)
                line, (a, b) = warm.line_load, (float(axis) for axis in equivalent_ellipse(warm))
                stiffness = float(creep_stiffness(rig, np.array(a), np.array(b))[0])
            xi = stiffness * slip / (mu * load)
            force = mu * load * float(law.saturation(np.array(xi), np.array(a / b)))
            section = wear * force * slip * way
            if contact == "half_space":
                spread = section / load * np.eye(len(y))
                line = pressed(rig, y, worn, load, spread, warm).line_load
            worn = worn + section * line / load
        if contact == "hertz":
            line, a, b = hertz_line_load(rig, y, worn, load)
        depths.append(worn.max())
        ratios.append(force / load)
    return np.array(depths), np.array(ratios)


def pressed(
    rig: Rig, y: Floats, worn: Floats, load: float, compliance: Floats | None, start: StripContact | None
) -> StripContact:
    """The contact of a worn profile, or after a step of wear that is taken with it."""
    return solve_strips(
        y=y, gap=0.5 * rig.curvature_y * y**2 + worn, curvature_x=rig.curvature_x, normal_load=load,
        effective_modulus=rig.effective_modulus, compliance=compliance, start=start, relative_accuracy=1e-5,
    )  # fmt: skip
