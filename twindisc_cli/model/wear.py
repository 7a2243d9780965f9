"""The wear path: how profile and contact change together as material goes (Eqs. 12-15).

    du/dS (y) = g(y) / N        S = K E / (2 pi R H)

    u    worn depth of both discs together [m], (node, strip);   y across the track [m], (strip,)
    S    worn section: worn volume over the circumference [m2], (node,)
    g    load of the strip per width [N/m]; in full sliding the energy a strip dissipates is proportional to it
    E    dissipated energy [J], K wear coefficient [1], H hardness [Pa], R mean rolling radius [m]

Where K is uniform over y the profile depends on K and the history only through S, so one path serves every K and
every history. Contact "hertz" refits the best circle inside the patch and keeps the ellipse; contact "half_space"
lets the patch follow the worn profile. Partial slip moves the wear from strip to strip; this is left out of the
profile, since what is dissipated there is a small part of any test that wears. The wear index of a strip has it, by
`partial_slip`.

A path comes from `path_table` where that reaches, and else from a march. Of a marched one `error` is the difference to
a path of twice the step, over three; `pressure_error` is such a difference as it stands.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf

from twindisc_cli.model import partial_slip, path_table
from twindisc_cli.model.experiment import Contact, Floats, Rig, Start
from twindisc_cli.model.march import Loaded, March, march, spreading
from twindisc_cli.model.traction_law import creep_stiffness
from twindisc_cli.physics import line_contact
from twindisc_cli.physics.half_space import OutOfRangeError

STRIPS, MOST_STRIPS = 121, 901
STRIPS_ACROSS = 10
"""Strips that the unworn patch spans at least: a track far wider than it needs more than STRIPS."""
GROWTH = 0.06
_EDGES = np.linspace(0.0, 1.0, 33)
PLACES = 0.5 * (_EDGES[1:] + _EDGES[:-1])
"""Places y/b of Hertz's ellipse, from its middle to its edge. In any patch: where the same share of the energy is
dissipated in strips of a higher wear index."""
SHARES = np.diff(0.5 * _EDGES * (3.0 - _EDGES**2))
"""Share of the energy that each of the PLACES stands for."""
CREEPAGES = np.array([0.2, 0.6, 1.0, 1.35, 1.7, 2.0, 2.36])
"""Normalised creepages at which the wear index of strips is known; from the last one on all slides."""
SAMPLES = 4
"""How often in a step of a march the history is asked."""
BEYOND = 1.2
"""How far beyond the sections that are counted a march of local wear goes."""
FEWEST_STEPS = 32
"""Steps of a march of local wear, at least."""
PASSING = 0.1
"""Where a step of a march of local wear is left, as `march.SETTLED`: ten times less moves depths by up to 0.08 %."""
EVEN_STEPS = 8
"""The even march beside it goes on to a multiple of so many steps, to serve others."""
LINE_STRIPS, LINE_NODES = 401, 9
"""Strips over the width of straight discs, and nodes of their path, along which all is linear but the radius."""


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
        return Scaled(load_ratio**self.along, load_ratio**self.across, load_ratio**self.section)


CROWNED, STRAIGHT = Scaling(1.0 / 3.0, 1.0 / 3.0, 1.0), Scaling(0.5, 0.0, 0.0)


OF_NODES = (
    "depth", "line_load", "a", "b", "p0", "area", "stiffness", "stiffness_y", "square", "edge", "spread",
)  # fmt: skip
"""What a path holds for each of its nodes."""


@dataclass(frozen=True)
class WearPath:
    """Profile and contact at every node of the path.

    section S [m2], a, b [m] semi-axes (in half-space contact those of `equivalent_ellipse`), p0 [Pa] peak
    pressure, area of the patch [m2], stiffness and stiffness_y [N], force per creepage along and across rolling of a
    patch that sticks all over, square [1] its squareness (`worn`), edge [m] half-width of the worn zone: each (node,);
    y [m] (strip,); depth [m], line_load [N/m]: (node, strip); spread: wear index of a strip over the mean of the patch,
    at CREEPAGES and PLACES (node, creepage, place); error: relative error of the greatest depth; pressure_error: of
    p0, at the node where it is largest. contact, wander [m] and start are those of the march.
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

    @property
    def wander_unit(self) -> float:
        """Width of the border of the worn zone [m], by which a wander is small or large."""
        return float(self.b[0]) * (0.1 if self.scaling is STRAIGHT else 1.0)

    def on(self, section: Floats) -> WearPath:
        """The path with other nodes [m2], linear between its own."""
        values: dict[str, Any] = {name: self.at(getattr(self, name), section) for name in OF_NODES}
        return replace(self, section=section, **values)

    def at(self, values: Floats, section: Floats) -> Floats:
        """Values (node, ...) at worn sections (...) [m2], linear between the nodes: (section..., ...)."""
        if values.ndim == 1:
            return np.interp(section, self.section, values)
        right, part = _between(self.section, section)
        part = part[(..., *[None] * (values.ndim - 1))]
        return np.asarray((1.0 - part) * values[right - 1] + part * values[right])

    def spread_at(self, section: Floats, creepage: Floats) -> Floats:
        """`spread` at worn sections [m2] and normalised creepages (...), linear between what is known: (..., place)."""
        found = self.at(self.spread[:, -1], section)
        partly = creepage < CREEPAGES[-1]
        if partly.any():
            (node, part), (column, share) = (
                _between(known, values[partly]) for known, values in ((self.section, section), (CREEPAGES, creepage))
            )
            below, above = (
                (1.0 - share)[:, None] * self.spread[row, column - 1] + share[:, None] * self.spread[row, column]
                for row in (node - 1, node)
            )
            found[partly] = (1.0 - part)[:, None] * below + part[:, None] * above
        return found


def _between(known: Floats, values: Floats) -> tuple[NDArray[np.intp], Floats]:
    """The first of ascending numbers behind each value, and how far from the one before to it the value lies."""
    right = np.clip(np.searchsorted(known, values), 1, len(known) - 1)
    start, end = known[right - 1], known[right]
    return right, np.clip((values - start) / (end - start), 0.0, 1.0)


def wear_path(
    rig: Rig, *, contact: Contact, section: float, wander: float = 0.0, start: Start | None = None
) -> WearPath:
    """Return the path from the unworn discs to at least `section` [m2]; paths are remembered."""
    return _path(rig, contact, tier(rig, section), float(wander), start)


def tier(rig: Rig, section: float) -> float:
    """The section [m2] up to which a path is made so that it may serve others: a power of two, at least the first."""
    return float(2.0 ** np.ceil(np.log2(max(section, first_section(rig)))))


@lru_cache(maxsize=64)
def first_section(rig: Rig) -> float:
    """The section [m2] on which the contact begins to change: a facet as wide as the unworn patch.

    Straight discs have none; of them it is what is as deep as the ends of their strip press in.
    """
    if rig.is_line:
        return float(rig.normal_load / (np.pi * rig.effective_modulus))
    return float(rig.curvature_y * (2.0 * rig.patch.b) ** 3 / 12.0)


@lru_cache(maxsize=64)
def _path(rig: Rig, contact: Contact, section: float, wander: float, start: Start | None) -> WearPath:
    if rig.is_line:
        if start is not None:
            raise OutOfRangeError("along a line contact the profile of the new discs is not followed")
        return _worn_strip(rig, section, wander)
    scaled = section / first_section(rig), wander / float(rig.patch.b)
    if start is None and path_table.is_covered(rig.curvature_y / rig.curvature_x, *scaled):
        return tabulated_path(rig, contact, section, wander)
    return marched_path(rig, contact, section, wander, start)


def tabulated_path(rig: Rig, contact: Contact, section: float, wander: float) -> WearPath:
    """The path read off the table, which must cover it."""
    y, nodes, b = _grid(rig, section, wander), _nodes(rig, section, GROWTH), float(rig.patch.b)
    halves = np.insert(nodes, np.arange(1, len(nodes)), 0.5 * (nodes[1:] + nodes[:-1]))
    ratio, sections = rig.curvature_y / rig.curvature_x, halves / first_section(rig)
    found = path_table.tabulated(contact, ratio=ratio, section=sections, wander=wander / b, y=y / b)
    share = found.load / (y[1] - y[0])
    rate = share @ spreading(y, wander).T
    steps = np.diff(nodes)[:, None] * (rate[:-2:2] + 4.0 * rate[1::2] + rate[2::2]) / 6.0
    depth = np.concatenate([np.zeros((1, len(y))), np.cumsum(steps, axis=0)])
    node = slice(None, None, 2)
    patch_a, patch_b = found.a[node] * rig.patch.a, found.b[node] * b
    stiffness, stiffness_y = creep_stiffness(rig, patch_a, patch_b)
    return WearPath(
        section=nodes,
        y=y,
        depth=depth,
        line_load=rig.normal_load * share[node],
        a=patch_a,
        b=patch_b,
        p0=found.p0[node] * rig.patch.p0,
        area=found.area[node] * np.pi * rig.patch.a * b,
        stiffness=stiffness * found.stiffening[node],
        stiffness_y=stiffness_y * found.stiffening[node],
        square=found.square[node],
        edge=_edges(y, depth, patch_b),
        spread=found.spread[node],
        error=path_table.ERRORS[contact],
        pressure_error=found.pressure_error,
        contact=contact,
        wander=wander,
    )


@lru_cache(maxsize=64)
def marched_path(rig: Rig, contact: Contact, section: float, wander: float, start: Start | None = None) -> WearPath:
    """The path marched through, for what the table does not cover."""
    y = _grid(rig, section, wander)
    nodes = _nodes(rig, section, GROWTH)
    marched = march(rig, contact, y, nodes, wander=wander, start=start)
    if wander:
        plain = marched_path(rig, contact, section, 0.0, start)
        error, pressure_error = plain.error, plain.pressure_error
    else:
        coarse_nodes = _nodes(rig, section, 2.0 * GROWTH)
        coarse = march(rig, contact, y, coarse_nodes, start=start)
        error = abs(marched.depth[0, -1].max() / coarse.depth[0, -1].max() - 1.0) / 3.0
        coarse_p0 = np.interp(nodes, coarse_nodes, coarse.contact.p0[0])
        pressure_error = np.max(np.abs(coarse_p0 / marched.contact.p0[0] - 1.0))
    errors = float(error), float(pressure_error)
    return _read(rig, marched, y=y, nodes=nodes, contact=contact, wander=wander, start=start, errors=errors)[0]


Factors = Callable[[Floats, Floats, Floats], Floats]
"""K over its base value for wear indices [N/m2], places across the track [m] and passes of strips, (case, any)."""


@dataclass(frozen=True)
class Course:
    """A history as the strips see it, of each case after each of its pieces, (case, point).

    section   worn [m2], of the discs under the path's load;   pace  energy dissipated per length rolled [N]
    creepage  normalised [1];   cycles  revolutions so far
    """

    section: Floats
    pace: Floats
    creepage: Floats
    cycles: Floats


def local_paths(rig: Rig, path: WearPath, course: Course, factors: Factors, *, by_place: bool) -> list[WearPath]:
    """The path of each case (case,) on which every strip wears by its own K, which may hang on its place.

    Where K is the same in all strips, it is the path itself; along a line its wear index and passes are.
    The sections are those before anything is known of the own paths, on which more may be worn.
    """
    section = course.section
    if path.scaling is STRAIGHT:
        if by_place:
            raise OutOfRangeError(
                "along a line contact a wear coefficient that changes across the track is not followed"
            )
        return [path] * len(section)
    path, steps = _divided(path, BEYOND * float(section.max()))
    nodes = path.section[: steps + 1]
    along = nodes[:-1, None] + (np.arange(SAMPLES) + 0.5) / SAMPLES * np.diff(nodes)[:, None]
    piece = np.minimum([np.searchsorted(own, along) for own in section], section.shape[1] - 1)
    pace, creepage = (np.take_along_axis(of[:, None, :], piece, axis=-1) for of in (course.pace, course.creepage))
    cycles = [np.interp(along, own, passed) for own, passed in zip(section, course.cycles, strict=True)]
    favoured = _Favoured(pace, creepage, np.array(cycles), factors, np.full((len(section), len(path.y)), np.inf))
    marched = march(
        rig, path.contact, path.y, nodes,
        wander=path.wander, cases=len(section), weights=favoured, mirrored=not by_place, start=path.start,
        settled=PASSING,
    )  # fmt: skip
    further = path.section[: EVEN_STEPS * -(-steps // EVEN_STEPS) + 1]
    even = _marched_evenly(
        rig, path.contact, path.wander, path.start, float(path.y[-1]), len(path.y), tuple(further.tolist())
    )
    own = _read(
        rig, marched, y=path.y, nodes=nodes, contact=path.contact, wander=path.wander, start=path.start,
        errors=(path.error, path.pressure_error), creepages=CREEPAGES[-1:],
    )  # fmt: skip
    path, even = path.on(nodes), even.on(nodes)
    return [_moved(path, one, even) for one in own]


def _divided(path: WearPath, section: float) -> tuple[WearPath, int]:
    """A path whose steps are divided so that FEWEST_STEPS go up to a section [m2], and how many go."""
    last = len(path.section) - 1
    steps = min(last, max(1, int(np.searchsorted(path.section, section, side="right"))))
    parts = -(-FEWEST_STEPS // steps)
    return path.on(np.interp(np.arange(parts * last + 1) / parts, np.arange(last + 1), path.section)), parts * steps


@lru_cache(maxsize=64)
def _marched_evenly(
    rig: Rig, contact: Contact, wander: float, start: Start | None, half: float, count: int, nodes: tuple[float, ...]
) -> WearPath:
    """The path marched through nodes [m2] on so many strips within a half-width [m], all of which wear by one K."""
    y, along = np.linspace(-half, half, count), np.array(nodes)
    marched = march(rig, contact, y, along, wander=wander, start=start, settled=PASSING)
    (own,) = _read(
        rig, marched, y=y, nodes=along, contact=contact, wander=wander, start=start,
        errors=(np.nan, np.nan), creepages=CREEPAGES[-1:],
    )  # fmt: skip
    return own


def _share(part: Floats, whole: Floats) -> Floats:
    """Part of a whole (node, strip), at most 1; beyond the outermost strips where there is any, as in these."""
    there, strip = whole > 0.0, np.arange(whole.shape[1])
    first, last = np.argmax(there, axis=1), len(strip) - 1 - np.argmax(there[:, ::-1], axis=1)
    inside = np.clip(strip, first[:, None], last[:, None])
    share = np.divide(part, whole, out=np.zeros_like(whole), where=there)
    return np.asarray(np.minimum(np.take_along_axis(share, inside, axis=1), 1.0))


def _moved(path: WearPath, own: WearPath, even: WearPath) -> WearPath:
    """The path, moved as far as the march with own wear coefficients lies from that with even ones, node by node.

    What the steps of both marches leave of error is the same to first order, and falls out. Wear indices of both are
    known where all slides; in partial slip they lie as far apart.
    """

    def ratio(name: str) -> Floats:
        return np.asarray(getattr(path, name) * getattr(own, name) / getattr(even, name))

    depth = own.depth + _share(own.depth, even.depth) * (path.depth - even.depth)
    worn = depth.sum(axis=1, keepdims=True) * (path.y[1] - path.y[0])
    depth *= np.divide(own.section[:, None], worn, out=np.ones_like(worn), where=worn > 0.0)
    b = ratio("b")
    return replace(
        own,
        depth=depth,
        a=ratio("a"),
        b=b,
        p0=ratio("p0"),
        area=ratio("area"),
        stiffness=ratio("stiffness"),
        stiffness_y=ratio("stiffness_y"),
        square=path.square + own.square - even.square,
        edge=_edges(path.y, depth, b),
        spread=ratio("spread"),
    )


@dataclass(frozen=True)
class _Favoured:
    """Weights of a march by the wear index of each strip, its place and the passes over it.

    pace: energy per length rolled [N], creepage: normalised [1], cycles: revolutions so far, at SAMPLES of each step
    (case, step, sample); first: revolutions before the first contact of each strip (case, strip), filled in as the
    march goes.
    """

    pace: Floats
    creepage: Floats
    cycles: Floats
    factors: Factors
    first: Floats

    def __call__(self, step: int, y: Floats, loaded: Loaded) -> Floats:
        """K of each strip over the mean of the energy's, (case, strip), itself a mean over the step."""
        load, intensity = loaded.line_load[:, None, :], loaded.intensity[:, None, :]
        power = _power_over_load(y, load, intensity, self.creepage[:, step, :, None])
        factor = self._factor(step, y, loaded, self.pace[:, step, :, None] * intensity * power)
        share = power * load * _sides(y)
        mean = np.sum(factor * share, axis=-1, keepdims=True) / share.sum(axis=-1, keepdims=True)
        return np.asarray(np.where(mean > 0.0, factor / np.where(mean > 0.0, mean, 1.0), 1.0).mean(axis=1))

    def _factor(self, step: int, y: Floats, loaded: Loaded, index: Floats) -> Floats:
        """K over its base value in each strip, (case, sample, strip)."""
        cycles, first = self.cycles[:, step, :, None], self.first[:, : len(y)]
        np.minimum(first, np.where(loaded.line_load > 0.0, cycles[:, 0], np.inf), out=first)
        passes = np.maximum(cycles - first[:, None, :], 0.0)
        place = np.broadcast_to(y, index.shape)
        flat = (values.reshape(len(index), -1) for values in (index, place, passes))
        return self.factors(*flat).reshape(index.shape)


def _read(
    rig: Rig,
    marched: March,
    *,
    y: Floats,
    nodes: Floats,
    contact: Contact,
    wander: float,
    start: Start | None,
    errors: tuple[float, float],
    creepages: Floats = CREEPAGES,
) -> list[WearPath]:
    """The path of each case of a march, with the wear index of strips at some of the CREEPAGES."""
    found = marched.contact
    stiffness, stiffness_y = creep_stiffness(rig, found.a, found.b)
    return [
        WearPath(
            section=nodes,
            y=y,
            depth=depth,
            line_load=found.line_load[i],
            a=found.a[i],
            b=found.b[i],
            p0=found.p0[i],
            area=found.area[i],
            stiffness=stiffness[i] * found.stiffening[i],
            stiffness_y=stiffness_y[i] * found.stiffening[i],
            square=found.square[i],
            edge=_edges(y, depth, found.b[i]),
            spread=_spread(y, found.line_load[i], found.intensity[i], found.area[i], creepages),
            error=errors[0],
            pressure_error=errors[1],
            contact=contact,
            wander=wander,
            start=start,
        )
        for i, depth in enumerate(marched.depth)
    ]


def _spread(y: Floats, line_load: Floats, intensity: Floats, area: Floats, creepages: Floats = CREEPAGES) -> Floats:
    """Wear index over the mean of the patch (node, creepage, place), of strips (node, strip) and the area (node,)."""
    load, intensity = line_load[:, None, :], intensity[:, None, :]
    power = _power_over_load(y, load, intensity, creepages[:, None])
    energy, index = power * load, power * intensity * area[:, None, None]
    shares, order = 0.5 * PLACES * (3.0 - PLACES**2), np.argsort(-index, axis=-1)
    energy, index = (np.take_along_axis(v, order, axis=-1).reshape(-1, len(y)) for v in (energy, index))
    middle = (np.cumsum(energy, axis=-1) - 0.5 * energy) / energy.sum(axis=-1, keepdims=True)
    found = [np.interp(shares, *strips) for strips in zip(middle, index, strict=True)]
    return np.array(found).reshape(*power.shape[:-1], len(PLACES))


def _power_over_load(y: Floats, line_load: Floats, intensity: Floats, creepage: Floats) -> Floats:
    """`partial_slip.power_over_load` by the intensity of strips, of one side of the track where y starts at 0."""
    if creepage.min() >= CREEPAGES[-1]:
        return np.ones_like(line_load)
    carried = np.sum(line_load * _sides(y), axis=-1, keepdims=True) * (y[1] - y[0])
    length = np.divide(line_load, 2.0 * carried * intensity, out=np.zeros_like(line_load), where=intensity > 0.0)
    return partial_slip.power_over_load(y, length, line_load, creepage, mirrored=bool(y[0] == 0.0))


def _sides(y: Floats) -> Floats:
    """How many strips of the track each of y is: two where y starts at 0 and lies on one side of it."""
    return np.where((y > 0.0) & (y[0] == 0.0), 2.0, 1.0)


def _worn_strip(rig: Rig, section: float, wander: float) -> WearPath:
    """Straight discs wear evenly over the width: u = S / w, disc 2's radius shrinks by it; wander softens the ends.

    The pressure stays Hertz's over the whole width, ends included.
    """
    half = 0.5 * rig.width
    strip = rig.width / LINE_STRIPS
    beyond = max(LINE_STRIPS // 20, int(np.ceil(4.0 * wander / strip)))
    y = np.asarray(strip * np.arange(-beyond - LINE_STRIPS // 2, beyond + LINE_STRIPS // 2 + 1), dtype=float)
    spread = max(wander, 1e-3 * strip) * np.sqrt(2.0)
    shape = 0.5 * (erf((y + half) / spread) - erf((y - half) / spread))
    nodes = np.linspace(0.0, section, LINE_NODES)
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


def _grid(rig: Rig, section: float, wander: float) -> Floats:
    """Strips that hold the facet of this section (width^3 = 12 S / curvature) and the patch around it."""
    facet, b = 0.5 * np.cbrt(12.0 * section / rig.curvature_y), float(rig.patch.b)
    half = max(1.1 * facet + 1.3 * b, 1.25 * facet) + 3.0 * wander
    count = max(STRIPS, 2 * int(np.ceil(0.5 * STRIPS_ACROSS * half / b)) + 1)
    if count > MOST_STRIPS:
        raise OutOfRangeError(
            f"the track would become {facet / b:.3g} times as wide as the unworn patch; the wear path follows it up to "
            f"{MOST_STRIPS / STRIPS_ACROSS / 1.25:.0f} times: do load, wear coefficient and profile belong together?"
        )
    return np.asarray(half / (count // 2) * np.arange(-(count // 2), count // 2 + 1), dtype=float)


def _nodes(rig: Rig, section: float, growth: float) -> Floats:
    """Nodes from 0 to `section` [m2] whose steps grow with the section."""
    first = 0.3 * first_section(rig)
    count = int(np.ceil(np.log1p(section / first) / np.log1p(growth)))
    return np.asarray(first * np.expm1(np.linspace(0.0, np.log1p(section / first), count + 1)))


def _edges(y: Floats, depth: Floats, b: Floats) -> Floats:
    """Half-width of the worn zone [m], (node,): where the depth falls below 2 % of its greatest value."""
    deepest = depth.max(axis=1)
    inwards = np.flatnonzero(y >= 0.0)[::-1]
    half = [np.interp(0.02 * d, row[inwards], y[inwards]) for d, row in zip(deepest, depth, strict=True)]
    return np.where(deepest > 0.0, half, b)
