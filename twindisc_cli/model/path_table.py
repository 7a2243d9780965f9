"""Wear paths that were integrated once, for rigs of any size, crown, load and modulus.

The integration along a wear path knows five numbers of a rig: curvatures kappa_x, kappa_y, load, E* and the wander.
Hertz's unworn patch (a, b, p0) takes up the scales, and what is left is

    q = kappa_y / kappa_x,   s = S / S1,   w = wander / b,   S1 = kappa_y (2 b)^3 / 12, a facet as wide as the patch
    lengths along rolling over a, across over b;  pressure over p0;  line load over N / b;  depth over S / b

Two rigs with one q and one w are integrated along the same path over s to rounding, whatever their radii, load, moduli
and Poisson's ratios. So the paths of all rigs are one function of q, s and w for each contact. It is known at ln q and
t = ln(1 + s / FIRST) on uniform grids, cubic between them, and at the WANDERS, between which `patch.weighted_paths`
interpolates.

    C(eta) = 3/4 eta - 1/4 eta^3 + sum_k c_k M_k(eta),   eta = y / W         load within |y| < eta W over 2 N
    u(y)   = integral of (the load of the strip, spread by the wander, over N) dS                       (Eqs. 12-15)

W is the half-width of the patch, beyond which nothing is loaded. In contact "hertz" W = b and c_k = 0. Since the depth
is the integral of the loads, what is worn off is the section, and no wear comes back.

Source: table_makers/paths.py says its errors. Valid for ln q within RATIOS (a/b from 0.025 to 6.9), s up to MOST.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from twindisc_cli.model.experiment import Contact, Floats
from twindisc_cli.physics._arrays import stored
from twindisc_cli.physics._even_grid import cubic_weights, linear_at

WANDERS = np.array([0.0, 0.15, 0.3, 0.5, 0.75, 1.0, 1.5, 2.2])
"""Wanders over the half-width of the unworn patch."""
RATIOS = np.linspace(-6.0, 3.0, 13)
"""ln q."""
FIRST, MOST = 0.3, 2048.0
NODES = np.linspace(0.0, np.log1p(MOST / FIRST), 91)
"""t."""
ETA = np.sin(0.5 * np.pi * np.linspace(0.0, 1.0, 257))
"""Places over the half-width, denser towards the edge, at which the M_k are known."""
ERRORS: dict[Contact, float] = {"hertz": 1e-4, "half_space": 4e-4}
"""Of the greatest depth, relative."""
CLOSE = 1e-6
"""Difference of wanders over b that is none."""


@dataclass(frozen=True)
class Tabulated:
    """A path at worn sections (node,), on strips (strip,), dimensionless but for what the strips are measured in.

    a, b over those of the unworn patch, area and p0 likewise; square, stiffening [1] as in `worn`; load: share of N on
    each strip (node, strip); spread: wear index over the mean of the patch, as in `wear` (node, creepage, place);
    pressure_error: of p0, relative.
    """

    a: Floats
    b: Floats
    p0: Floats
    area: Floats
    square: Floats
    stiffening: Floats
    load: Floats
    spread: Floats
    pressure_error: float


def is_covered(ratio: float, section: float, wander: float) -> bool:
    """Whether the table reaches a curvature ratio q, a section over S1 and a wander over b."""
    inside = np.exp(RATIOS[0]) <= ratio <= np.exp(RATIOS[-1]) and section <= MOST
    return bool(inside and np.abs(WANDERS - wander).min() < CLOSE)


def tabulated(contact: Contact, *, ratio: float, section: Floats, wander: float, y: Floats) -> Tabulated:
    """The path of curvature ratio q at sections over S1 (node,), on uniform strips y over b, an odd number about 0."""
    known = _table(contact)
    values = _at(known, ratio, section, wander)
    half_width, along, across, p0, area = np.exp(values[:, :5]).T
    modes, places = known["modes"], known["places"]
    first = 8 + len(modes)
    return Tabulated(
        a=along,
        b=across,
        p0=p0,
        area=area,
        square=values[:, 5],
        stiffening=1.0 + values[:, 6],
        pressure_error=float(values[-1, 7]),
        load=_shares(half_width, values[:, 8:first] @ modes, y),
        spread=known["spread"] + np.tensordot(values[:, first:], places, axes=1),
    )


def _at(known: dict[str, Floats], ratio: float, section: Floats, wander: float) -> Floats:
    """The table's numbers (node, number)."""
    values = known["values"][np.argmin(np.abs(WANDERS - wander))]
    by_node = np.tensordot(cubic_weights(RATIOS, np.log([ratio]))[0], values, axes=1)
    return np.asarray(cubic_weights(NODES, np.log1p(section / FIRST)) @ by_node)


def _shares(half_width: Floats, departure: Floats, y: Floats) -> Floats:
    """Share of the load on each strip (node, strip), of half-widths (node,) and C less a parabola's (node, ETA)."""
    outward = y[len(y) // 2 :]
    border = outward + 0.5 * (y[1] - y[0])
    eta = np.minimum(border / half_width[:, None], 1.0)
    position = np.arcsin(eta) * ((len(ETA) - 1) / (0.5 * np.pi))
    within = 0.75 * eta - 0.25 * eta**3 + linear_at(departure, position)
    one_side = np.maximum(np.diff(within, axis=1), 0.0)
    middle = 2.0 * np.maximum(within[:, :1], 0.0)
    both = np.concatenate([one_side[:, ::-1], middle, one_side], axis=1)
    return np.asarray(both / both.sum(axis=1, keepdims=True))


@cache
def _table(contact: Contact) -> dict[str, Floats]:
    """values (wander, ratio, node, number), modes (mode, ETA), spread (creepage, place), places (mode, ...)."""
    known = stored("twindisc_cli.model", f"paths_{contact}.npz")
    return {**known, "values": known["step"] * known["codes"]}
