"""The wear path of a history whose load changes: one profile, which every load finds as the others left it.

    du/dS (y) = g(y; u, N(S)) / N(S)

    N(S)  load [N] at the worn section S [m2]; the other symbols as in `wear_path`

A path under one load scales to any other, but the profile that one load has made is not the one that another would
have made with the same section: a change of load would give back what is worn. So the integration itself goes through
the history's loads. It leaves the profile as a function of the section, and the contact of that profile under each load
of the history as a function of both; in between, contacts are linear in ln N. Beyond the smallest and the greatest
load they go as Hertz's.

Loads that stay within PIECE of their mean count as one load, and where a history has more than MOST_LEVELS of them,
they are rounded to as many.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np

from twindisc_cli.model import integration
from twindisc_cli.model.experiment import Floats, Ints, Rig
from twindisc_cli.model.integration import Pressed, Setup, WearIntegration, Weights, integrate, pressed_on
from twindisc_cli.model.wear_path import grid
from twindisc_cli.model.wear_path.path import CROWNED, OF_PATCH, Scaled, WearPath, between, lifted, paths_of

PIECE = 0.03
"""Relative change of the load that is none."""
MOST_LEVELS = 16  # different loads of one history
BEYOND = 1.2
"""How far beyond the history's last section a path goes on under its last load."""
GROWTH = 0.09
"""Growth of what was worn since the load changed, in a step."""
SETTLED = 1e-3
"""Where a step in half-space contact is left where one K holds for all strips, as `integration.SETTLED`: what changes
from one path to another asks for more than a path does."""
DIGITS = 12
"""To which a load is one of the levels, and is read there alone."""
SMALLEST = 1e-9
"""A section over the history's that is as good as none."""
NEAR = 1e-2
"""Relative difference of the sections of histories that are integrated together."""
APART = 3
"""Nodes under another load of which the contact of one is found, of the first of histories that are near each other."""
STRIPS_ACROSS = 20
"""Strips that the unworn patch of the smallest load spans at least."""
ERROR, PRESSURE_ERROR = 3e-3, 0.03
"""Of the greatest depth and of the peak pressure, relative: against other integrations in many small steps."""


@dataclass(frozen=True)
class LoadHistory:
    """The loads of one case: section worn by the end of each point [m2], and load over the rig's [1], each (point,)."""

    section: Floats
    ratio: Floats

    @property
    def changes(self) -> bool:
        """Whether the load changes from where anything is worn on: what rolls without wear is on that profile, too."""
        worn = self.section > 0.0
        return bool(worn.any() and np.ptp(np.log(self.ratio[worn])) > PIECE)

    @property
    def departs(self) -> bool:
        """Whether anything is worn under another load than the rig's."""
        return bool(np.any(np.abs(np.log(self.ratio[self.section > 0.0])) > PIECE))

    @property
    def first(self) -> float:
        """The load over the rig's under which wear begins [1]; where nothing wears, that of the first point."""
        _, loads = self.pieces()
        return float(loads[0] if len(loads) else self.ratio[0])

    def pieces(self) -> tuple[Floats, Floats]:
        """Sections at which pieces of one load end [m2], and that load over the rig's [1], each (piece,).

        The load is the mean over the points of a piece, however much is worn at each: no parameter of wear moves it.
        """
        worn = np.diff(self.section, prepend=0.0) > 0.0
        section, logs = self.section[worn], np.log(self.ratio[worn])
        begins = np.flatnonzero(np.diff(logs, prepend=np.nan) != 0.0)
        ends: list[float] = []
        loads: list[float] = []
        points = 0
        for begin, end in zip(begins, np.append(begins, len(logs))[1:], strict=True):
            if ends and abs(logs[begin] - loads[-1]) <= PIECE:
                points += end - begin
                loads[-1] += (logs[begin] - loads[-1]) * (end - begin) / points
                ends[-1] = section[end - 1]
            else:
                ends, loads, points = [*ends, section[end - 1]], [*loads, logs[begin]], end - begin
        return np.array(ends), np.exp(_rounded(np.array(loads)))


def _rounded(logs: Floats) -> Floats:
    """The loads of pieces, at most MOST_LEVELS different ones."""
    if len(np.unique(logs)) <= MOST_LEVELS:
        return logs
    low, high = logs.min(), logs.max()
    step = max(PIECE, (high - low) / (MOST_LEVELS - 1))
    return np.asarray(low + step * np.round((logs - low) / step))


@dataclass(frozen=True)
class CarriedPath:
    """A profile through a history of loads, and its contact under each of them.

    ratios: loads over the rig's, rising (level,); levels: sections and depths that are the same in all, and the contact
    under each load. end: worn by the history's last point [m2]; grown: what is worn by it where the path is read, over
    that, (set, 1).
    """

    ratios: Floats
    levels: tuple[WearPath, ...]
    end: float
    grown: Floats = field(default_factory=lambda: np.ones((1, 1)))

    @property
    def y(self) -> Floats:
        """Strips across the track [m], (strip,)."""
        return self.levels[0].y

    @property
    def error(self) -> float:
        """Relative error of the greatest depth [1]."""
        return self.levels[0].error

    @property
    def pressure_error(self) -> float:
        """Relative error of the peak pressure [1]."""
        return self.levels[0].pressure_error

    @property
    def b(self) -> Floats:
        """Semi-axis across rolling under the greatest load [m], (node,)."""
        return self.levels[-1].b

    def through(self, section: Floats) -> CarriedPath:
        """The path for histories (set, point) [m2] of the same loads: all that is worn grows as at the end."""
        return replace(self, grown=np.maximum(section[:, -1:] / self.end, SMALLEST))

    def under(self, load_ratio: float) -> CarriedPath:
        """The path that so many times all loads make of unworn discs: all lengths scale, the wander among them."""
        levels = tuple(level.under(load_ratio) for level in self.levels)
        return replace(self, ratios=self.ratios * load_ratio, levels=levels, end=self.end * load_ratio)

    def profile_scale(self, load_ratio: Floats) -> Scaled:
        """The profile is that of the history, whatever the load."""
        one = np.ones_like(load_ratio)
        return Scaled(one, one, one * self.grown)

    def contact_scale(self, load_ratio: Floats) -> Scaled:
        """Hertz's factors beyond the loads of the history."""
        beyond = self.load_scale(load_ratio)
        return replace(CROWNED.to(beyond), section=np.ones_like(beyond))

    def load_scale(self, load_ratio: Floats) -> Floats:
        """The load over the nearest of the history's [1]."""
        return np.asarray(load_ratio / np.clip(load_ratio, self.ratios[0], self.ratios[-1]))

    def read(self, quantity: Callable[..., Floats], section: Floats, load_ratio: Floats, *where: Floats) -> Floats:
        """What `quantity` reads at sections [m2] under loads over the rig's (set, point): (set, point, ...)."""
        total: Floats | float = 0.0
        at = self._level(np.broadcast_to(load_ratio, section.shape))
        for number, path in enumerate(self.levels):
            weight = np.maximum(1.0 - np.abs(at - number), 0.0)
            if weight.any():
                result = quantity(path, section / self.grown, *where)
                total = total + weight[(..., *[None] * (result.ndim - weight.ndim))] * result
        return np.asarray(total)

    def patch_under(self, section: Floats, load_ratio: Floats) -> Floats:
        """The quantities OF_PATCH at worn sections [m2] under loads over the rig's (set, point): (..., quantity)."""
        level = self._level(np.broadcast_to(load_ratio, section.shape))
        lower, nodes = level.astype(np.intp), self.levels[0].section
        right, part = between(nodes, section / self.grown)
        below = lower * len(nodes) + right - 1
        result, share = lifted(*self._of_patch, below, part), level - lower
        if share.any():
            above = lifted(*self._of_patch, np.where(share > 0.0, below + len(nodes), below), part)
            result += share[..., None] * (above - result)
        return result

    def _level(self, load_ratio: Floats) -> Floats:
        """Number of the level of each load over the rig's, with its part of the way to the next."""
        level = np.interp(np.log(load_ratio), np.log(self.ratios), np.arange(len(self.ratios)))
        return np.asarray(np.round(level, DIGITS))

    @cached_property
    def _of_patch(self) -> tuple[Floats, Floats]:
        """The quantities OF_PATCH at the nodes of each level, and their rises to the next (quantity, level * node)."""
        values = np.array([[getattr(path, name) for path in self.levels] for name in OF_PATCH])
        rises = np.diff(values, append=values[..., -1:])
        return values.reshape(len(OF_PATCH), -1), rises.reshape(len(OF_PATCH), -1)


def carried_paths(
    setup: Setup,
    histories: Sequence[LoadHistory],
    *,
    weights: Callable[[list[int], Floats, Floats], Weights] | None = None,
    by_place: bool = False,
) -> list[CarriedPath]:
    """Wear the new discs through histories of loads, those together that go under the same loads nearly as far.

    weights: where K differs from strip to strip, those of the integration of some of the histories, by their numbers,
    from its nodes (case, node) [m2] and strips [m]; by_place: on each side of the track in its own way.
    """

    def through(near: list[int], ends: Floats, ratios: Floats) -> list[CarriedPath]:
        own = None if weights is None else partial(weights, near)
        return carried_through(setup, ends, ratios, own, by_place=by_place)

    return in_groups(histories, through)


def in_groups(
    histories: Sequence[LoadHistory], through: Callable[[list[int], Floats, Floats], list[CarriedPath]]
) -> list[CarriedPath]:
    """The paths through histories, of those together that go under the same loads nearly as far.

    through: the paths of some of them, by their numbers, the sections at which their pieces end (case, piece) [m2] and
    the loads over the rig's there (piece,)
    """
    pieces = [history.pieces() for history in histories]
    paths: dict[int, CarriedPath] = {}
    for number, first in enumerate(pieces):
        if number in paths:
            continue
        near = [i for i, of in enumerate(pieces) if i not in paths and _are_near(of, first)]
        paths.update(zip(near, through(near, np.array([pieces[i][0] for i in near]), first[1]), strict=True))
    return [paths[i] for i in range(len(pieces))]


def _are_near(one: tuple[Floats, Floats], other: tuple[Floats, Floats]) -> bool:
    """Whether pieces are of the same loads and end nearly where others do, so that nodes of one number serve both."""
    (ends, loads), (other_ends, other_loads) = one, other
    return np.array_equal(loads, other_loads) and np.allclose(ends, other_ends, rtol=NEAR, atol=0.0)


def carried_through(
    setup: Setup,
    ends: Floats,
    ratios: Floats,
    weights: Callable[[Floats, Floats], Weights] | None = None,
    *,
    by_place: bool = False,
    first_strips: bool = False,
) -> list[CarriedPath]:
    """Paths through pieces of histories that end at sections (case, piece) [m2], under the same loads (piece,).

    first_strips: what single strips carry is that of the first case in all.
    """
    rig = setup.rig
    nodes, load = _nodes(rig, ends, ratios)
    y, scale = _strips(rig, nodes[:, -1], ratios, setup)
    local: Weights = integration.even if weights is None else weights(nodes, y)
    settled, apart = (SETTLED, _apart(nodes, ends)) if weights is None else (integration.SETTLED, None)
    result = integrate(
        setup,
        y,
        nodes,
        cases=len(ends),
        loads=load,
        mirrored=not by_place,
        weights=local,
        settled=settled,
        scale=scale,
        apart=apart,
    )
    rise = np.zeros_like(y) if setup.start is None else setup.start.on(y)
    kept = np.flatnonzero(np.diff(nodes[0], append=np.inf) > 0.0)
    gap = 0.5 * rig.curvature_y * y**2 + result.depth[0] - rise
    levels, strips, paths = np.unique(ratios), scale[:, None] * y, list[list[WearPath]]()
    depth = result.depth[:, kept]
    for level in levels:
        pressed = _pressed_under(
            setup, y, gap, float(level), result.contact, nodes=nodes, loads=load, kept=kept, scale=scale
        )
        under_load = WearIntegration(depth, pressed, result.carried)
        errors = (ERROR, PRESSURE_ERROR)
        paths.append(
            paths_of(setup, under_load, y=strips, nodes=nodes[:, kept], errors=errors, first_strips=first_strips)
        )
    return [CarriedPath(levels, of, float(end)) for of, end in zip(zip(*paths, strict=True), ends[:, -1], strict=True)]


def _apart(nodes: Floats, ends: Floats) -> Ints:
    """How many cases go their own way in each step of their nodes (case, node), for `integrate` (step,).

    They are those up to the last of which a piece has ended, or ends, elsewhere than that of the first; ends (case,
    piece).
    """
    shared = np.cumprod(ends == ends[0], axis=1).sum(axis=1)
    shared[0] = 0
    piece = np.cumsum(np.diff(nodes[0]) == 0.0)
    return np.array([1 + np.flatnonzero(shared <= number)[-1] for number in piece])


def _nodes(rig: Rig, ends: Floats, ratios: Floats) -> tuple[Floats, Floats]:
    """Sections (case, node) [m2] at which the integration stops, twice where the load changes, and the load over the
    rig's there (node,) [1], for pieces that end at sections (case, piece) [m2]."""
    nodes, loads = [np.zeros((len(ends), 1))], [ratios[:1]]
    begins = np.column_stack([np.zeros(len(ends)), ends[:, :-1]])
    ends = np.column_stack([ends[:, :-1], BEYOND * ends[:, -1]])
    for begin, end, ratio in zip(begins.T[..., None], ends.T[..., None], ratios, strict=True):
        if np.any(begin > 0.0):
            nodes, loads = [*nodes, begin], [*loads, np.array([ratio])]
        first = grid.FIRST * grid.first_section(rig) * ratio
        reach = np.log1p((end - begin) / first)
        count = max(2, int(np.ceil(reach[0, 0] / np.log1p(GROWTH))))
        inside = begin + first * np.expm1(reach * np.linspace(0.0, 1.0, count + 1)[1:-1])
        nodes, loads = [*nodes, inside, end], [*loads, np.full(count, ratio)]
    return np.concatenate(nodes, axis=1), np.concatenate(loads)


def _strips(rig: Rig, sections: Floats, ratios: Floats, setup: Setup) -> tuple[Floats, Floats]:
    """Strips [m] that hold the track and the patch of the greatest load, narrow enough for that of the smallest.

    They are those of the first of the sections (case,) [m2]; beside them their scale in each case (case,): strips that
    scale with what is worn see the edges of a patch at the same places, and what they err by falls out of derivatives.
    """
    narrowest, widest = (float(rig.patch.b) * float(np.cbrt(ratio)) for ratio in (ratios.min(), ratios.max()))
    y = grid.strips_over(
        rig, float(sections[0]), setup.wander, widest=widest, narrowest=narrowest, fewest=STRIPS_ACROSS
    )
    if setup.contact == "hertz":
        return y, np.ones(len(sections))
    halves = np.array([grid.half_width(rig, float(section), setup.wander, widest) for section in sections])
    return y, halves / halves[0]


def _pressed_under(
    setup: Setup,
    y: Floats,
    gap: Floats,
    level: float,
    integrated: Pressed,
    *,
    nodes: Floats,
    loads: Floats,
    kept: Ints,
    scale: Floats,
) -> Pressed:
    """The contact of all kept nodes under one of the loads, (case, node, ...), from the first's gaps (node, strip) [m].

    Where the integration went under this load, its own. Of the others that of the first case on strips of a scale
    (case,), every so many and both ends, and linear in between: they are asked for only where a history departs from
    that of the integration.
    """
    own = np.flatnonzero(loads == level)
    places = np.searchsorted(nodes[0, kept], nodes[0, own])
    others = np.union1d(np.setdiff1d(np.arange(len(kept)), places)[::APART], [0, len(kept) - 1])
    first = pressed_on(setup.rig, setup.contact, y, gap[kept[others]], setup.rig.normal_load * level)
    found = first.on_strips(scale[:, None])
    order = np.argsort(np.concatenate([others, places]), kind="stable")
    known = nodes[0, kept][np.concatenate([others, places])[order]]
    right, part = between(known, nodes[0, kept])
    values = {}
    for name, other in vars(found).items():
        inside = getattr(integrated, name)[:, own]
        outside = np.broadcast_to(other, (len(nodes), *other.shape[1:]))
        at = np.concatenate([outside, inside], axis=1)[:, order]
        share = part[(..., *[None] * (at.ndim - 2))]
        values[name] = (1.0 - share) * at[:, right - 1] + share * at[:, right]
    return Pressed(**values)
