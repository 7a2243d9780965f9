"""The contact at every operating point, read off the wear paths.

A path is computed for one load, or one history of loads, one lateral wander and one crown. Between wanders and crowns
it is interpolated (cubic, on fixed grids in units of the unworn half-width b, and of ln crown); a path of one load is
scaled to another as its `Scaling` says, which is exact without wander where the load never changes.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from twindisc_cli.model.experiment import Contact, Floats, Ints
from twindisc_cli.model.path_table import WANDERS
from twindisc_cli.model.wear_path import CarriedPath, Scaled, WearPath
from twindisc_cli.physics import third_body
from twindisc_cli.physics._even_grid import cubic_weights

ALL_WANDERS = np.append(WANDERS, WANDERS[-1] * 1.2 ** np.arange(1.0, 25.0))
"""Wanders in units of their border: those of the table, and others, whose paths are integrated."""
CROWNS = np.exp(0.05 * np.arange(-28.0, 29.0))
"""Transverse radii over the declared one, between which paths are interpolated."""


@dataclass(frozen=True)
class Patch:
    """Contact at every point, (set, point): stiffness, stiffness_y [N], area [m2], a, b [m], squareness [1].

    layer: slope of the discs alone over that of a third body between them, which is in both stiffnesses [1].
    """

    stiffness: Floats
    stiffness_y: Floats
    area: Floats
    a: Floats
    b: Floats
    square: Floats
    layer: Floats = field(default_factory=lambda: np.zeros((1, 1)))

    @property
    def ratio(self) -> Floats:
        """a/b [1]."""
        return self.a / self.b

    def with_layer(self, compliance: float, *, line: bool) -> Patch:
        """The patch with a third body of this shear compliance [m/Pa] between the discs."""
        if not compliance:
            return self
        layer = third_body.compliance_ratio(compliance, stiffness=self.stiffness, a=self.a, b=self.b, line=line)
        across = third_body.compliance_ratio(compliance, stiffness=self.stiffness_y, a=self.a, b=self.b, line=line)
        return replace(
            self,
            stiffness=self.stiffness * third_body.slope_factor(layer),
            stiffness_y=self.stiffness_y * third_body.slope_factor(across),
            layer=layer,
        )


AnyPath = WearPath | CarriedPath


class Paths(ABC):
    """What contact and profile are on the way of each parameter set."""

    @property
    @abstractmethod
    def first(self) -> Paths:
        """The path of the first set, for any number of them."""

    @property
    @abstractmethod
    def paths(self) -> Sequence[AnyPath]:
        """The wear paths that are added up, of the first set where each has its own."""

    @abstractmethod
    def of_sets(self, chosen: Ints) -> Paths:
        """The paths of some of the parameter sets, in any order and number (set,)."""

    @abstractmethod
    def of_each(self, quantity: Callable[..., Floats], section: Floats, load_ratio: Floats, *where: Floats) -> Floats:
        """The weighted sum of what `quantity` reads off each path, as it stands there, (set, point, ...).

        section: worn so far [m2]; load_ratio: load over the rig's [1]; and whatever else is asked for, (set, point).
        """

    @abstractmethod
    def through(self, section: Floats) -> Paths:
        """The profiles of histories whose sections (set, point) [m2] are not those of these paths, but near."""

    def at(self, values: Callable[[WearPath], Floats], section: Floats, load_ratio: Floats | float = 1.0) -> Floats:
        """A quantity (node, ...) of the paths at worn sections (set, point) [m2] and loads: (set, point, ...)."""

        def read(path: AnyPath, own: Floats, ratio: Floats) -> Floats:
            return path.read(lambda level, worn: level.at(values(level), worn), own, ratio)

        return self.of_each(read, section, np.asarray(load_ratio))

    def spread(self, section: Floats, load_ratio: Floats, creepage: Floats) -> Floats:
        """`WearPath.spread` at worn sections [m2], loads and normalised creepages (set, point): (set, point, place)."""

        def read(path: AnyPath, *where: Floats) -> Floats:
            return path.read(WearPath.spread_at, *where)

        return self.of_each(read, section, load_ratio, creepage)

    def patch(self, section: Floats, load_ratio: Floats) -> Patch:
        """The contact at worn sections (set, point) [m2] under `load_ratio` times the rig's load."""
        scaled = self.contact_scale(load_ratio)
        area = scaled.along * scaled.across
        known = self.of_each(lambda path, *where: path.patch_under(*where), section, load_ratio)
        stiffness, stiffness_y, own, a, b, square = known.transpose(2, 0, 1)
        return Patch(
            stiffness=stiffness * area,
            stiffness_y=stiffness_y * area,
            area=own * area,
            a=a * scaled.along,
            b=b * scaled.across,
            square=square,
        )

    def peak_pressure(self, section: Floats, load_ratio: Floats) -> Floats:
        """p0 [Pa] at worn sections (set, point) [m2] under `load_ratio` times the rig's load."""
        scaled, load = self.contact_scale(load_ratio), self.paths[0].load_scale(load_ratio)
        return self.at(lambda path: path.p0, section, load_ratio) * load / (scaled.along * scaled.across)

    def profile_scale(self, load_ratio: Floats) -> Scaled:
        """From the profiles of these paths to those under so many times the rig's load."""
        return self.paths[0].profile_scale(load_ratio)

    def contact_scale(self, load_ratio: Floats) -> Scaled:
        """From the contacts of these paths to those under so many times the rig's load."""
        return self.paths[0].contact_scale(load_ratio)


@dataclass(frozen=True)
class WeightedPaths(Paths):
    """Wear paths whose weighted sum is the path of each parameter set; weights (set, 1)."""

    parts: Sequence[AnyPath]
    weights: Sequence[Floats]

    @property
    def paths(self) -> Sequence[AnyPath]:
        """The wear paths that are added up."""
        return self.parts

    @property
    def first(self) -> Paths:  # noqa: D102
        return replace(self, weights=[weight[:1] for weight in self.weights])

    def of_each(self, quantity: Callable[..., Floats], section: Floats, load_ratio: Floats, *where: Floats) -> Floats:
        """The sum over the parts, by their weights."""
        results = [quantity(path, section, load_ratio, *where) for path in self.parts]
        extra = results[0].ndim - section.ndim
        parts = [w[(..., *[None] * extra)] * f for w, f in zip(self.weights, results, strict=True)]
        return np.asarray(sum(parts[1:], parts[0]))

    def of_sets(self, chosen: Ints) -> WeightedPaths:  # noqa: D102
        return replace(self, weights=[w if len(w) == 1 else w[chosen] for w in self.weights])

    def through(self, section: Floats) -> WeightedPaths:  # noqa: D102
        return replace(self, parts=[path.through(section) for path in self.parts])


@dataclass(frozen=True)
class OwnPaths(Paths):
    """Paths of each parameter set's own, (set,)."""

    sets: Sequence[WeightedPaths]

    @property
    def paths(self) -> Sequence[AnyPath]:
        """The wear paths that are added up, of the first set."""
        return self.sets[0].parts

    @property
    def first(self) -> Paths:  # noqa: D102
        return self.sets[0].first

    def of_each(self, quantity: Callable[..., Floats], section: Floats, load_ratio: Floats, *where: Floats) -> Floats:
        """Of each set by its own paths."""
        rows = zip(self.sets, section, np.broadcast_to(load_ratio, section.shape), *where, strict=True)
        return np.concatenate([own.of_each(quantity, *(values[None] for values in row)) for own, *row in rows])

    def of_sets(self, chosen: Ints) -> OwnPaths:  # noqa: D102
        return OwnPaths([self.sets[i] for i in chosen])

    def through(self, section: Floats) -> Paths:  # noqa: D102
        return OwnPaths([own.through(section[i : i + 1]) for i, own in enumerate(self.sets)])


def strips_passed(paths: Paths, section: Floats, load_ratio: Floats, cycles: Floats) -> tuple[Floats, Floats, Floats]:
    """Strips across the track, (set, point, strip): place [m], share of the load, passes of the contact over them.

    section: worn so far (set, point) [m2]; cycles: revolutions so far (point,). Passes count from the first contact.
    """
    load_ratio = np.broadcast_to(load_ratio, section.shape)
    y = max((path.y for path in paths.paths), key=lambda strips: float(strips[-1]))

    def on_strips(path: WearPath) -> Floats:
        return np.array([np.interp(y, path.y, row, left=0.0, right=0.0) for row in path.line_load])

    load = paths.at(on_strips, section, load_ratio)
    before = np.broadcast_to(np.append(0.0, cycles[:-1])[:, None], load.shape)
    first = np.minimum.accumulate(np.where(load > 0.0, before, np.inf), axis=1)
    passes = np.maximum(cycles[:, None] - first, 0.0)
    place = np.broadcast_to(y * paths.profile_scale(load_ratio).across[..., None], load.shape)
    return place, load / load.sum(axis=-1, keepdims=True), passes


def weighted_paths(
    path: Callable[[Contact, float, float], WearPath],
    declared: Contact,
    half_space: Floats,
    wander: Floats,
    crown: Floats,
) -> WeightedPaths:
    """The paths needed for a declared contact and shares of half-space contact, wanders [m], crowns [1], (set, 1)."""
    share = np.ones_like(half_space) if declared == "half_space" else half_space
    blend: list[tuple[Contact, Floats]] = [("hertz", 1.0 - share), ("half_space", share)]
    chosen = list[tuple[WearPath, Floats]]()
    for ratio, of_crown in _crowns(crown):
        wanders = _wanders(partial(path, declared, 0.0, ratio), wander)
        chosen += [
            (path(contact, wide, ratio), part * of_wander * of_crown)
            for contact, part in blend
            if np.any(part)
            for wide, of_wander in wanders
        ]
    return WeightedPaths([p for p, _ in chosen], [w for _, w in chosen])


def _wanders(straight: Callable[[], WearPath], wander: Floats) -> list[tuple[float, Floats]]:
    """Wanders [m] of paths, and their weights (set, 1); straight: gives the path without any, where one is needed."""
    if not np.any(wander):
        return [(0.0, np.ones_like(wander))]
    unit = straight().wander_unit
    return _between(ALL_WANDERS, np.clip(wander / unit, 0.0, ALL_WANDERS[-1]), ALL_WANDERS * unit)


def _crowns(crown: Floats) -> list[tuple[float, Floats]]:
    """Crowns of paths over the declared one, and their weights (set, 1)."""
    if np.all(crown == 1.0):
        return [(1.0, np.ones_like(crown))]
    logs = np.log(CROWNS)
    return _between(logs, np.clip(np.log(crown), logs[0], logs[-1]), CROWNS)


def _between(nodes: Floats, at: Floats, values: Floats) -> list[tuple[float, Floats]]:
    """What stands at those of the nodes (node,) that have any weight at places (set, 1), and the weights (set, 1)."""
    spread = cubic_weights(nodes, at)
    return [(float(v), spread[..., i]) for i, v in enumerate(values) if np.any(spread[..., i])]
