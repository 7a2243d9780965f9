"""What a wear path holds: profile and contact at every node, and how both go over to another load.

The wear index of strips across the patch stands in it too, at CREEPAGES and PLACES; partial slip moves it by
`partial_slip`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twindisc_cli.model import partial_slip
from twindisc_cli.model.experiment import Contact, Floats, Start
from twindisc_cli.model.integration import Setup, WearIntegration
from twindisc_cli.model.traction_law import creep_stiffness

_EDGES = np.linspace(0.0, 1.0, 33)
PLACES = 0.5 * (_EDGES[1:] + _EDGES[:-1])
"""Places y/b of Hertz's ellipse, from its middle to its edge. In any patch: where the same share of the energy is
dissipated in strips of a higher wear index."""
SHARES = np.diff(0.5 * _EDGES * (3.0 - _EDGES**2))
"""Share of the energy that each of the PLACES stands for."""
CREEPAGES = np.array([0.2, 0.6, 1.0, 1.35, 1.7, 2.0, 2.36])
"""Normalised creepages at which the wear index of strips is known; from the last one on all slides."""


@dataclass(frozen=True)
class Scaled:
    """Factors from a path to the same contact under another load."""

    along: Floats
    across: Floats
    section: Floats

    @property
    def height(self) -> Floats:
        """Of what is worn off."""
        return self.section / self.across


@dataclass(frozen=True)
class Scaling:
    """Powers of the load by which lengths along and across rolling and the worn section go."""

    along: float
    across: float
    section: float

    def to(self, load_ratio: Floats) -> Scaled:
        """The factors for so many times the path's load."""
        if np.all(load_ratio == 1.0):
            return Scaled(load_ratio, load_ratio, load_ratio)
        return Scaled(load_ratio**self.along, load_ratio**self.across, load_ratio**self.section)


CROWNED, STRAIGHT = Scaling(1.0 / 3.0, 1.0 / 3.0, 1.0), Scaling(0.5, 0.0, 0.0)
OF_NODES = (
    "depth", "line_load", "a", "b", "p0", "area", "stiffness", "stiffness_y", "square", "edge", "spread",
)  # fmt: skip
"""What a path holds for each of its nodes."""
OF_PATCH = ("stiffness", "stiffness_y", "area", "a", "b", "square")
"""What of it is asked for at every operating point, together."""


@dataclass(frozen=True)
class WearPath:
    """Profile and contact at every node of the path.

    section S [m2], a, b [m] semi-axes (in half-space contact those of `equivalent_ellipse`), p0 [Pa] peak
    pressure, area of the patch [m2], stiffness and stiffness_y [N], force per creepage along and across rolling of a
    patch that sticks all over, square [1] its squareness (`worn`), edge [m] half-width of the worn zone: each (node,);
    y [m] (strip,); depth [m], line_load [N/m]: (node, strip); spread: wear index of a strip over the mean of the patch,
    at CREEPAGES and PLACES (node, creepage, place); error: relative error of the greatest depth; pressure_error: of
    p0, at the node where it is largest. contact, wander [m], start and crown (the transverse radius over that of the
    rig) are those of the integration.
    """

    section: Floats
    y: Floats
    depth: Floats
    line_load: Floats
    a: Floats
    b: Floats
    p0: Floats
    area: Floats
    stiffness: Floats
    stiffness_y: Floats
    square: Floats
    edge: Floats
    error: float
    pressure_error: float
    spread: Floats
    contact: Contact = "hertz"
    wander: float = 0.0
    scaling: Scaling = CROWNED
    start: Start | None = None
    crown: float = 1.0

    @property
    def wander_unit(self) -> float:
        """Width of the border of the worn zone [m], by which a wander is small or large."""
        return float(self.b[0]) * (0.1 if self.scaling is STRAIGHT else 1.0)

    def through(self, section: Floats) -> WearPath:
        """The path for histories of sections (set, point) [m2]: itself, which depends on none."""
        return self

    def profile_scale(self, load_ratio: Floats) -> Scaled:
        """From the profile of this path to that which so many times its load makes."""
        return self.scaling.to(load_ratio)

    def contact_scale(self, load_ratio: Floats) -> Scaled:
        """From the contact of this path to that under so many times its load, on the profile that it makes."""
        return self.scaling.to(load_ratio)

    def load_scale(self, load_ratio: Floats) -> Floats:
        """Of the load, likewise."""
        return load_ratio

    def read(self, quantity: Callable[..., Floats], section: Floats, load_ratio: Floats, *where: Floats) -> Floats:
        """What `quantity` reads at worn sections [m2] under so many times the path's load, (set, point, ...)."""
        return quantity(self, section / self.scaling.to(load_ratio).section, *where)

    def under(self, load_ratio: float) -> WearPath:
        """The path that so many times its load makes of unworn discs: all lengths scale, the wander among them."""
        to = self.scaling.to(np.array(load_ratio))
        area, height = to.along * to.across, to.height
        factors = {"section": to.section, "depth": height, "line_load": load_ratio / to.across, "p0": load_ratio / area}
        factors |= {"a": to.along, "y": to.across, "b": to.across, "edge": to.across, "wander": to.across}
        factors |= {"area": area, "stiffness": area, "stiffness_y": area}
        return replace(self, **{name: factor * getattr(self, name) for name, factor in factors.items()})

    def on(self, section: Floats) -> WearPath:
        """The path with other nodes [m2], linear between its own."""
        values: dict[str, Any] = {name: self.at(getattr(self, name), section) for name in OF_NODES}
        return replace(self, section=section, **values)

    def at(self, values: Floats, section: Floats) -> Floats:
        """Values (node, ...) at worn sections (...) [m2], linear between the nodes: (section..., ...)."""
        if values.ndim == 1:
            return np.interp(section, self.section, values)
        right, part = between(self.section, section)
        part = part[(..., *[None] * (values.ndim - 1))]
        below, result = values.take(right - 1, axis=0), values.take(right, axis=0)
        result -= below
        result *= part
        result += below
        return result

    def patch_under(self, section: Floats, load_ratio: Floats) -> Floats:
        """The quantities OF_PATCH at worn sections [m2] under so many times the path's load: (set, point, quantity)."""
        return self.read(WearPath._patch_at, section, load_ratio)

    def _patch_at(self, section: Floats) -> Floats:
        right, part = between(self.section, section)
        return lifted(*self._of_patch, right - 1, part)

    @cached_property
    def _of_patch(self) -> tuple[list[Floats], list[Floats]]:
        """The quantities OF_PATCH at the nodes (node,), and their rises to the next one (node - 1,)."""
        values = [getattr(self, name) for name in OF_PATCH]
        return values, [np.diff(value) for value in values]

    def depth_on(self, grid: Floats) -> Floats:
        """Depth (node, place) [m] at places across the track, zero beyond the strips; the last answer is remembered."""
        asked = grid.tobytes()
        if asked not in self._on_grid:
            place = np.round((grid - self.y[0]) / (self.y[1] - self.y[0]), 9)  # what stands on a strip stands on it
            inside = (place >= 0.0) & (place <= len(self.y) - 1.0)
            left = np.clip(place.astype(np.intp), 0, len(self.y) - 2)
            part = place - left
            self._on_grid.clear()
            self._on_grid[asked] = inside * ((1.0 - part) * self.depth[:, left] + part * self.depth[:, left + 1])
        return self._on_grid[asked]

    @cached_property
    def _on_grid(self) -> dict[bytes, Floats]:
        return {}

    def spread_at(self, section: Floats, creepage: Floats) -> Floats:
        """`spread` at worn sections [m2] and normalised creepages (...), linear between what is known: (..., place)."""
        result = self.at(self.spread[:, -1], section)
        partly = creepage < CREEPAGES[-1]
        if partly.any():
            (node, part), (column, share) = (
                between(known, values[partly]) for known, values in ((self.section, section), (CREEPAGES, creepage))
            )
            below, above = (
                (1.0 - share)[:, None] * self.spread[row, column - 1] + share[:, None] * self.spread[row, column]
                for row in (node - 1, node)
            )
            result[partly] = (1.0 - part)[:, None] * below + part[:, None] * above
        return result


def between(known: Floats, values: Floats) -> tuple[NDArray[np.intp], Floats]:
    """The first of ascending numbers behind each value, and how far from the one before to it the value lies.

    Of NaN that is NaN.
    """
    place = np.interp(values, known, np.arange(len(known)))
    right = np.minimum(np.fmax(place, 0.0).astype(np.intp), len(known) - 2) + 1
    return right, place - (right - 1)


def lifted(values: Iterable[Floats], rises: Iterable[Floats], left: NDArray[np.intp], part: Floats) -> Floats:
    """The quantities OF_PATCH a part of the way behind nodes (...), (..., quantity); in memory one after the other.

    values: at the nodes; rises: to the next one, each (node,)
    """
    result = np.empty((len(OF_PATCH), *part.shape))
    for row, value, rise in zip(result, values, rises, strict=True):
        np.multiply(part, rise.take(left), out=row)
        row += value.take(left)
    return result.transpose(*range(1, result.ndim), 0)


def paths_of(
    setup: Setup,
    integrated: WearIntegration,
    *,
    y: Floats,
    nodes: Floats,
    errors: tuple[float, float],
    creepages: Floats = CREEPAGES,
    first_strips: bool = False,
) -> list[WearPath]:
    """The path of each case of an integration, with the wear index of strips at some of the CREEPAGES.

    y, nodes: (strip,) and (node,), or those of each case (case, strip) and (case, node). first_strips: what single
    strips carry in the first case serves all.
    """
    result, shape = integrated.contact, integrated.depth.shape
    own_y = np.broadcast_to(y, (shape[0], shape[2]))
    line_load = result.line_load[:1].copy() if first_strips else result.line_load
    spread = [
        spread_of(own_y[i], load, result.intensity[i], result.area[i], creepages) for i, load in enumerate(line_load)
    ]
    stiffness, stiffness_y = creep_stiffness(setup.rig, result.a, result.b)
    return [
        WearPath(
            section=section,
            y=own,
            depth=depth,
            line_load=line_load[0 if first_strips else i],
            a=result.a[i],
            b=result.b[i],
            p0=result.p0[i],
            area=result.area[i],
            stiffness=stiffness[i] * result.stiffening[i],
            stiffness_y=stiffness_y[i] * result.stiffening[i],
            square=result.square[i],
            edge=edges_of(own, depth, result.b[i]),
            spread=spread[0 if first_strips else i],
            error=errors[0],
            pressure_error=errors[1],
            contact=setup.contact,
            wander=setup.wander,
            start=setup.start,
        )
        for i, (depth, section, own) in enumerate(
            zip(integrated.depth, np.broadcast_to(nodes, shape[:2]), own_y, strict=True)
        )
    ]


def edges_of(y: Floats, depth: Floats, b: Floats) -> Floats:
    """Half-width of the worn zone [m], (node,): where the depth falls below 2 % of its greatest value."""
    deepest = depth.max(axis=1)
    inwards = np.flatnonzero(y >= 0.0)[::-1]
    half = [np.interp(0.02 * d, row[inwards], y[inwards]) for d, row in zip(deepest, depth, strict=True)]
    return np.where(deepest > 0.0, half, b)


def spread_of(y: Floats, line_load: Floats, intensity: Floats, area: Floats, creepages: Floats = CREEPAGES) -> Floats:
    """Wear index over the mean of the patch (node, creepage, place), of strips (node, strip) and the area (node,)."""
    load, intensity = line_load[:, None, :], intensity[:, None, :]
    power = power_of_strips(y, load, intensity, creepages[:, None])
    energy, index = power * load, power * intensity * area[:, None, None]
    shares, order = 0.5 * PLACES * (3.0 - PLACES**2), np.argsort(-index, axis=-1)
    energy, index = (np.take_along_axis(v, order, axis=-1).reshape(-1, len(y)) for v in (energy, index))
    middle = (np.cumsum(energy, axis=-1) - 0.5 * energy) / energy.sum(axis=-1, keepdims=True)
    results = [np.interp(shares, *strips) for strips in zip(middle, index, strict=True)]
    return np.array(results).reshape(*power.shape[:-1], len(PLACES))


def power_of_strips(y: Floats, line_load: Floats, intensity: Floats, creepage: Floats) -> Floats:
    """`partial_slip.power_over_load` by the intensity of strips, of one side of the track where y starts at 0."""
    if creepage.min() >= CREEPAGES[-1]:
        return np.ones_like(line_load)
    carried = np.sum(line_load * sides_of(y), axis=-1, keepdims=True) * (y[1] - y[0])
    length = np.divide(line_load, 2.0 * carried * intensity, out=np.zeros_like(line_load), where=intensity > 0.0)
    return partial_slip.power_over_load(y, length, line_load, creepage, mirrored=bool(y[0] == 0.0))


def sides_of(y: Floats) -> Floats:
    """How many strips of the track each of y is: two where y starts at 0 and lies on one side of it."""
    return np.where((y > 0.0) & (y[0] == 0.0), 2.0, 1.0)
