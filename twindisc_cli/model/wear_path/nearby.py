"""Wear paths through histories of loads near each other: linear between a few that are integrated.

    path(s) = path(s0) + sum_k w_k (path(s0 (1 + d_k)) - path(s0)),   s = s0 (1 + sum_k w_k d_k)

    s     section worn in each piece of the history, under one load [m2], (piece,)
    d_k   how much longer the pieces of a probe are, (piece,): all of them, or one

A fit asks for one history after another in which the pieces are a little longer or shorter. What is worn and the
contact change evenly with them. s0 is a place of a lattice over the whole section and the shares of the pieces: it
depends on the history alone, not on what was asked for before. Histories of one Jacobian share the place of the first,
so that no derivative sees where one place takes over from another. What unworn discs make of a history scales with all
its loads together, where the wander does, too: its place is that of the loads over the first.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from twindisc_cli.model.experiment import Floats
from twindisc_cli.model.integration import Setup
from twindisc_cli.model.wear_path.carried import DIGITS, CarriedPath, LoadHistory, carried_through, in_groups
from twindisc_cli.model.wear_path.path import OF_NODES, WearPath

SPACING = 0.1
"""Distance of the places of the lattice, of the logarithm of the whole section."""
ROOT_SPACING = 0.07
"""The same of the root of a piece over the largest: the less is worn in a piece, the more it may differ."""
PROBE = 0.1
"""How much longer one piece is in a probe; all of them are as much as leads to the next place."""
REMEMBERED = 64  # places that have been asked for
OF_CONTACT = tuple(name for name in OF_NODES if name not in ("depth", "line_load", "spread"))
"""What is linear in the sections under each load; what single strips carry stays that of the place: only how local wear
begins is found by it."""


def paths_near(setup: Setup, histories: Sequence[LoadHistory]) -> list[CarriedPath]:
    """The paths through histories of loads where one K holds for all strips.

    The wander of unworn discs is that under the rig's load: under another first load of a history it is scaled, as all
    lengths are. Of discs whose profiles were recorded it is the wander as it is.
    """
    scales = setup.start is None

    def through(near: list[int], ends: Floats, ratios: Floats) -> list[CarriedPath]:
        load = float(ratios[0]) if scales else 1.0
        sizes = np.diff(ends, prepend=0.0, axis=1) / load
        whole = float(np.floor(np.log(sizes[0].sum()) / SPACING))
        shape = np.maximum(np.round(np.sqrt(sizes[0] / sizes[0].max()) / ROOT_SPACING), 1.0)
        around = _around(setup, tuple(np.round(ratios / load, DIGITS).tolist()), whole, tuple(shape.tolist()))
        return [path.under(load) for path in around.through(sizes)]

    return in_groups(histories, through)


@dataclass(frozen=True)
class _Around:
    """Paths around a place: that of its own pieces, and those that probe how they change.

    sizes: worn section in each piece of the first [m2], (piece,); probes: how much longer the pieces of the others are,
    relative (probe, piece), one all over and one for each but the last.
    """

    sizes: Floats
    probes: Floats
    paths: list[CarriedPath]

    def through(self, sizes: Floats) -> list[CarriedPath]:
        """The paths of pieces in which these sections are worn [m2], (case, piece)."""
        probed = np.linalg.solve(self.probes.T, (sizes / self.sizes - 1.0).T).T
        weights = np.column_stack([1.0 - probed.sum(axis=1), probed])
        return [self._weighted(own) for own in weights]

    def _weighted(self, weights: Floats) -> CarriedPath:
        """The weighted sum of the paths."""

        def total(name: str, paths: Iterable[WearPath]) -> Floats:
            parts = (weight * getattr(path, name) for weight, path in zip(weights, paths, strict=True))
            return np.asarray(sum(parts))

        profiles = [path.levels[0] for path in self.paths]
        section, y, depth = (total(name, profiles) for name in ("section", "y", "depth"))
        depth = _worn_to(section, y, depth)
        levels = tuple(
            replace(of[0], section=section, y=y, depth=depth, **{name: total(name, of) for name in OF_CONTACT})
            for of in zip(*(path.levels for path in self.paths), strict=True)
        )
        return replace(self.paths[0], levels=levels, end=float(weights @ [path.end for path in self.paths]))


def _worn_to(section: Floats, y: Floats, depth: Floats) -> Floats:
    """Depths (node, strip) [m] on strips y [m], changed so that each step takes off what is worn in it (node,) [m2]."""
    steps = np.maximum(np.diff(depth, axis=0), 0.0)
    taken = steps.sum(axis=1) * (y[1] - y[0])
    steps *= np.divide(np.diff(section), taken, out=np.zeros_like(taken), where=taken > 0.0)[:, None]
    return np.concatenate([depth[:1], depth[0] + np.cumsum(steps, axis=0)])


@lru_cache(maxsize=REMEMBERED)
def _around(setup: Setup, ratios: tuple[float, ...], whole: float, shape: tuple[float, ...]) -> _Around:
    """The paths around a place of the lattice, in its spacings: whole, shape (piece,); ratios: loads over the rig's."""
    shares = np.square(shape)
    sizes = np.exp(SPACING * whole) * shares / shares.sum()
    probes = PROBE * np.eye(len(sizes), k=-1)
    probes[0] = np.expm1(SPACING)
    longer = np.concatenate([sizes[None], sizes * (1.0 + probes)])
    paths = carried_through(setup, np.cumsum(longer, axis=1), np.array(ratios), first_strips=True)
    return _Around(sizes, probes, paths)
