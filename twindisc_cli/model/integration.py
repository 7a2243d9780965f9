"""The integration along a wear path: which strip loses how much, step by step, for many cases at once.

    du/dS (y) = w(y) g(y) / N,   mean of w over the load = 1

    u    worn depth [m], (case, strip);   S worn section [m2];   g load of the strip per width [N/m], N its sum
    w    wear coefficient of the strip over the mean of the coefficients, each weighted by its load [1]

Steps: half-space contact is implicit in the load (backward differences of order 2), since sharp features of a profile
die out much faster than it grows; w is that of the node before. With r a step over the one before it, the mean of du/dS
over the step is that of the step before times r / (1 + 2 r), and that at its end times (1 + r) / (1 + 2 r). Contact
"hertz" refits the best circle inside the patch and keeps the ellipse; it goes by an explicit midpoint rule with small
steps. Under a load that changes, a step of no section presses the profile as it is with the new one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from twindisc_cli.model import worn
from twindisc_cli.model.experiment import Contact, Floats, Ints, Rig, Start
from twindisc_cli.physics import hertz
from twindisc_cli.physics._even_grid import linear_at
from twindisc_cli.physics.half_space import NoConvergenceError
from twindisc_cli.physics.half_space.strips import StripContact, Strips, equivalent_ellipse

FLAT = np.geomspace(1e-10, 1e-4, 300, endpoint=False)
SETTLED = 1e-2
"""Change of the line load, over its largest, at which a step of the half-space integration ends; the next sets it
right."""
FEWEST = 2
"""Strips on either side of the middle one that a circle is fitted to, at least; a pressure takes more than these."""
FINE = np.linspace(0.0, 1.0, 9)
MIRRORED = 1e-12
"""Difference of both sides of a gap, over its range, that is none."""


@dataclass(frozen=True)
class Loaded:
    """The strips of every case: line load g [N/m] and intensity g / (2 a(y) N) [1/m2], (case, strip)."""

    line_load: Floats
    intensity: Floats


@dataclass(frozen=True)
class Pressed(Loaded):
    """The contact at the nodes of an integration: strips (case, node, strip), the others (case, node).

    a, b semi-axes [m], in half-space contact those of `equivalent_ellipse`; p0 peak pressure [Pa]; area [m2];
    square, stiffening [1]: squareness of the patch, and its stiffness over that of the ellipse (`worn`).
    """

    a: Floats
    b: Floats
    p0: Floats
    area: Floats
    square: Floats
    stiffening: Floats

    def on_strips(self, scale: Floats) -> Pressed:
        """The contact of each case in metres, from units of so many of them (case, 1)."""
        return replace(
            self,
            line_load=scale[..., None] * self.line_load,
            intensity=self.intensity / scale[..., None] ** 2,
            a=scale * self.a,
            b=scale * self.b,
            area=scale**2 * self.area,
        )


Weights = Callable[[int, Floats, Loaded], Floats]
"""w (case, strip) in a step (its number), on strips y but for their scale, of a contact."""


@dataclass(frozen=True)
class Setup:
    """What wears: the rig, its contact, the standard deviation of the contact's lateral position [m], and how the
    unworn discs depart from their nominal shapes."""

    rig: Rig
    contact: Contact
    wander: float = 0.0
    start: Start | None = None


@dataclass(frozen=True)
class WearIntegration:
    """Depth [m] (case, node, strip), contact at the nodes, mean load carried in each step [N/m] (case, step, strip)."""

    depth: Floats
    contact: Pressed
    carried: Floats


@dataclass(frozen=True)
class _Way:
    """What is integrated: strips y [m], sections [m2], (1 or case, node), the load [N] at each, how the load is spread.

    rise [m] of the new discs (1 or case, strip); spread: shares of the line load of each strip on each (1 or case,
    strip, strip); scale: of the strips of each case, over y (case, 1); apart: number of cases that go their own way in
    each step (step,).
    """

    rig: Rig
    y: Floats
    nodes: Floats
    loads: Floats
    spread: Floats
    rise: Floats
    cases: int
    weights: Weights
    scale: Floats
    apart: Ints

    @property
    def steps(self) -> Floats:
        """From node to node [m2], (step, 1 or case, 1)."""
        return np.diff(self.nodes).T[..., None]

    @property
    def apart_at_nodes(self) -> Ints:
        """`apart` in the step to each node (node,); to the first one as in the first step."""
        return np.append(self.apart[:1], self.apart)

    @property
    def scale_at_nodes(self) -> Floats:
        """`scale` where a case goes its own way, 1 before that, (node, case, 1)."""
        return np.where(np.arange(self.cases)[:, None] < self.apart_at_nodes[:, None, None], self.scale, 1.0)

    def of_all(self, values: Floats) -> Floats:
        """Lengths or line loads (case, strip), in units of the strips of each case, of all cases.

        Those that have gone the way of the first so far have its values, read on their own strips.
        """
        if len(values) == self.cases:
            return values
        more = self.scale[len(values) :]
        return np.concatenate([values, np.interp(more * self.y, self.y, values[0]) / more])


def even(step: int, y: Floats, loaded: Loaded) -> Floats:
    """One wear coefficient all over the track."""
    return np.ones_like(loaded.line_load)


def integrate(
    setup: Setup,
    y: Floats,
    nodes: Floats,
    *,
    cases: int = 1,
    weights: Weights = even,
    mirrored: bool = True,
    settled: float = SETTLED,
    loads: Floats | None = None,
    scale: Floats | None = None,
    apart: Ints | None = None,
) -> WearIntegration:
    """Wear the unworn discs through the sections `nodes` [m2] on uniform strips y, an odd number about 0.

    nodes     (node,), or those of each case (case, node)
    mirrored  the weights are the same on both sides of the track
    settled   change of the line load, over its largest, at which a step in half-space contact is left
    loads     over the rig's load, on the way to each of the nodes [1]; the rig's if not given
    scale     in half-space contact, of the strips of each case over y (case,) [1]; 1 if not given
    apart     in half-space contact with even weights, how many of the cases go their own way in each step (step,), the
              first among them; the others have gone the way of the first so far. All if not given
    """
    rig, start = setup.rig, setup.start
    scale = np.ones(cases) if scale is None else scale
    of_cases = scale[:1] if np.all(scale == scale[0]) else scale
    rise = np.array([np.zeros_like(y) if start is None else start.on(own * y) for own in of_cases])
    spread = np.array([spreading(own * y, setup.wander) for own in of_cases])
    loads = rig.normal_load * (np.ones(nodes.shape[-1]) if loads is None else loads)
    apart = np.full(nodes.shape[-1] - 1, cases) if apart is None else apart
    way = _Way(rig, y, np.atleast_2d(nodes), loads, spread, rise, cases, weights, scale[:, None], apart)
    if setup.contact == "hertz":
        return _integrate_hertz(way)
    if start is not None or not mirrored:
        return _integrate_half_space(way, settled, mirrored=False)
    middle = len(y) // 2
    folded = spread[:, middle:, middle:].copy()
    folded[..., 1:] += spread[:, middle:, :middle][..., ::-1]
    side = replace(way, y=y[middle:], spread=folded, rise=rise[:, middle:])
    half = _integrate_half_space(side, settled, mirrored=True)
    return WearIntegration(_unfolded(half.depth), half.contact, _unfolded(half.carried))


def _unfolded(values: Floats) -> Floats:
    """Both sides of a track from one, which starts at its middle, (..., strip)."""
    return np.concatenate([values[..., :0:-1], values], axis=-1)


def spreading(y: Floats, wander: float) -> Floats:
    """Matrix (strip, strip) that spreads a line load over a normal distribution of the lateral position."""
    if wander <= 0.0:
        return np.eye(len(y))
    kernel = np.exp(-0.5 * ((y[:, None] - y) / wander) ** 2)
    return np.asarray(kernel / kernel.sum(axis=0))


def _integrate_half_space(way: _Way, settled: float, *, mirrored: bool) -> WearIntegration:
    """In units of the strips of each case: lengths over a scale, loads over its square leave the contact as it is."""
    rig, scales = way.rig, way.scale_at_nodes
    gap = 0.5 * rig.curvature_y * way.scale * way.y**2 - way.rise / way.scale
    loads = way.loads[:, None, None] / scales**2
    steps = np.diff(way.nodes, prepend=way.nodes[:, :1]).T[..., None] / scales**2
    loss, depths, contacts, means = np.zeros_like(gap[:1]), list[Floats](), list[StripContact](), list[Floats]()
    for number, count in enumerate(way.apart_at_nodes):
        apart = slice(count)
        step, load, scale = steps[number, apart], loads[number, apart], way.scale[apart]
        if not step.any():
            strips = _strips(rig, way.y, load[:, 0], mirrored=mirrored, scale=scale[:, 0])
            loss = way.of_all(loss)[apart]
            rate = mean = np.zeros_like(loss)
            result = last = strips.pressed(gap[apart] + loss)
            before = np.full((1, 1), np.inf)
        else:
            ratio = step / before
            new = (1.0 + ratio) / (1.0 + 2.0 * ratio)
            loaded = _loaded(result, load)
            weighted = way.weights(number - 1, way.y, Loaded(scale * loaded.line_load, loaded.intensity / scale**2))
            guess = _ahead(last, result, ratio)
            last, before = result, step
            result = strips.pressed(
                gap[apart] + loss + (1.0 - new) * step * rate,
                compliance=(new * step / load)[..., None] * way.spread[apart] * weighted[:, None, :],
                start=guess,
                relative_accuracy=settled,
            )
            own = _worn(way.spread[apart], weighted, result.line_load, mirrored=mirrored) / load
            rate = (1.0 - new) * rate + new * own
            mean = (1.0 - new) * mean + new * result.line_load
            means.append(mean)
            loss = loss + step * rate
        depths.append(loss)
        contacts.append(result)
    pressed = _pressed(_stacked(contacts, way.cases), np.moveaxis(loads, 0, 1), mirrored)
    depth, carried = (
        way.scale[..., None] * np.stack([way.of_all(own) for own in values], axis=1) for values in (depths, means)
    )
    return WearIntegration(depth, pressed.on_strips(scales[..., 0].T), carried)


def _strips(rig: Rig, y: Floats, load: Floats, *, mirrored: bool, scale: Floats | float = 1.0) -> Strips:
    """The strips of a rig under loads (case,) [N], in units of `scale` metres."""
    return Strips.of(
        y=y,
        curvature_x=rig.curvature_x * scale,
        normal_load=load,
        effective_modulus=rig.effective_modulus,
        mirrored=mirrored,
    )


def _stacked(contacts: list[StripContact], cases: int) -> StripContact:
    """Contacts at nodes as one, (case, node)."""
    load, length, approach = (
        np.stack([_as_first(getattr(contact, name), cases) for contact in contacts], axis=1)
        for name in ("line_load", "half_length", "approach")
    )
    return StripContact(contacts[0].y, length, load, approach)


def _as_first(values: Floats, cases: int) -> Floats:
    """Values (case, ...) of so many cases: those that are not there yet have those of the first."""
    if len(values) == cases:
        return values
    return np.concatenate([values, np.repeat(values[:1], cases - len(values), axis=0)])


def pressed_on(rig: Rig, contact: Contact, y: Floats, gap: Floats, load: float) -> Pressed:
    """The contact of worn discs as they are, of gaps (node, strip) [m] under a load [N]; quantities (1, node)."""
    if contact == "hertz":
        circle = _BestCircle.on(replace(rig, normal_load=load), y)
        a, b = circle.axes(circle.curvature(gap - 0.5 * rig.curvature_y * y**2))
        return circle.pressed(a[None], b[None], load)
    mirrored = bool(np.abs(gap - gap[:, ::-1]).max() <= MIRRORED * np.ptp(gap))
    side = slice(len(y) // 2 if mirrored else 0, None)
    strips = _strips(rig, y[side], np.full(len(gap), load), mirrored=mirrored)
    state = strips.pressed(gap[:, side])
    state = replace(
        state,
        line_load=state.line_load[None],
        half_length=state.half_length[None],
        approach=state.approach[None],
    )
    return _pressed(state, np.full((1, 1), load), mirrored)


def _ahead(last: StripContact, contact: StripContact, part: Floats) -> StripContact:
    """The contact on the line through two, so many times their distance further on; strips that come to an end stay."""
    load = contact.line_load + part * (contact.line_load - last.line_load)
    square = contact.half_length**2 + part * (contact.half_length**2 - last.half_length**2)
    held = (load <= 0.5 * contact.line_load) | (square <= 0.5 * contact.half_length**2) | (last.line_load == 0.0)
    return replace(
        contact,
        line_load=np.where(held, contact.line_load, load),
        half_length=np.where(held, contact.half_length, np.sqrt(np.maximum(square, 0.0))),
    )


def _worn(spread: Floats, weights: Floats, line_load: Floats, *, mirrored: bool) -> Floats:
    """Line load that wears [N/m], (case, strip), whose sum is that of the load however the weights are off their mean.

    Where only strips wear that have come out of contact, all in contact do.
    """
    weighted = weights * line_load
    weighted = np.where(_total(weighted, mirrored) > 0.0, weighted, line_load)
    off = _total(line_load, mirrored) / _total(weighted, mirrored)
    return np.asarray(((off * weighted)[:, None, :] @ np.swapaxes(spread, -2, -1))[:, 0])


def _total(values: Floats, mirrored: bool) -> Floats:
    """Sum over the strips of both sides, (case, 1)."""
    whole = values.sum(axis=-1, keepdims=True)
    return np.asarray(2.0 * whole - values[:, :1] if mirrored else whole)


def _loaded(contact: StripContact, normal_load: Floats | float) -> Loaded:
    """The strips of a contact, half-space or one side of it, under loads [N]."""
    load, across = contact.line_load, 2.0 * normal_load * contact.half_length
    return Loaded(load, np.divide(load, across, out=np.zeros_like(load), where=across > 0.0))


def _pressed(contact: StripContact, normal_load: Floats, mirrored: bool) -> Pressed:
    """The contact at the nodes (case, node), under loads (node, 1) [N]."""
    if mirrored:
        y = np.concatenate([-contact.y[:0:-1], contact.y])
        contact = replace(
            contact, y=y, half_length=_unfolded(contact.half_length), line_load=_unfolded(contact.line_load)
        )
    strips, (a, b) = _loaded(contact, normal_load), equivalent_ellipse(contact)
    uneven = worn.unevenness(contact.half_length, contact.line_load)
    return Pressed(
        line_load=strips.line_load,
        intensity=strips.intensity,
        a=a,
        b=b,
        p0=_peak_pressure(contact),
        area=contact.area,
        square=worn.squareness(contact.half_length),
        stiffening=worn.stiffening(a / b, uneven),
    )


def _peak_pressure(contact: StripContact) -> Floats:
    """Largest pressure [Pa], (...), that depends on no single strip.

    At the edges of a patch line load and half-length are not resolved: the last strip's pressure depends on where the
    edge lies in it. What counts are the strips further from any edge than half of the largest half-length along rolling
    (or of the half-width, if less), and the means over bands twice as wide anywhere, the edges included; but nothing
    less than three strips.
    """
    y, (first, last) = contact.y, (edge[..., None] for edge in contact.extent)
    reach = 0.5 * np.minimum(contact.half_length.max(axis=-1, keepdims=True), 0.5 * (last - first))
    reach = np.maximum(reach, 1.5 * contact.strip_width)
    loaded = (contact.line_load > 0.0).astype(float)
    inner = (y > first + reach) & (y < last - reach)
    inner &= _integral(y, 1.0 - loaded, y + reach) == _integral(y, 1.0 - loaded, y - reach)
    starts = first + (last - first - 2.0 * reach) * np.linspace(0.0, 1.0, len(y))
    load, area, strips = (
        _integral(y, values, starts + 2.0 * reach) - _integral(y, values, starts)
        for values in (contact.line_load, 0.5 * np.pi * contact.half_length, loaded)
    )
    band = np.divide(load, area, out=np.zeros_like(load), where=strips > FEWEST)
    return np.asarray(np.maximum(np.max(contact.centre_pressure * inner, axis=-1), band.max(axis=-1)))


def _integral(y: Floats, values: Floats, ends: Floats) -> Floats:
    """Sum over strips (..., strip) up to places `ends` (..., place), in strips; part of a strip counts as that part."""
    sums = np.concatenate([np.zeros_like(values[..., :1]), np.cumsum(values, axis=-1)], axis=-1)
    position = np.clip((ends - y[0]) / (y[1] - y[0]) + 0.5, 0.0, len(y))
    return linear_at(sums, position)


def _integrate_hertz(way: _Way) -> WearIntegration:
    rig, y = way.rig, way.y
    circle = _BestCircle.on(replace(rig, normal_load=float(way.loads[0])), y)
    worn, curvature = np.zeros((way.cases, len(y))), np.full(way.cases, rig.curvature_y)
    if way.rise.any():
        curvature = circle.curvature(worn - way.rise)
    depths, curvatures, means = [worn], [curvature], []
    for number, (step, load) in enumerate(zip(way.steps, way.loads[1:], strict=True)):
        if not step.any():
            circle = _BestCircle.on(replace(rig, normal_load=float(load)), y)
            curvature = circle.curvature(worn - way.rise)
        loss = worn
        for share in (0.5, 1.0) if step.any() else ():
            pressed = circle.pressed(*circle.axes(curvature), load)
            weighted = way.weights(number, y, pressed)
            loss = worn + share * step / load * _worn(way.spread, weighted, pressed.line_load, mirrored=False)
            curvature = circle.curvature(loss - way.rise)
            if share == 1.0:
                means.append(pressed.line_load)
        worn = loss
        depths.append(worn)
        curvatures.append(curvature)
    ellipse = hertz.contact_ellipse(
        curvature_x=rig.curvature_x,
        curvature_y=np.stack(curvatures, axis=1),
        normal_load=way.loads,
        effective_modulus=rig.effective_modulus,
    )
    contact = circle.pressed(ellipse.a, ellipse.b, way.loads)
    return WearIntegration(np.stack(depths, axis=1), contact, np.stack(means, axis=1))


@dataclass(frozen=True)
class _BestCircle:
    """The best circle inside the patch, whose own half-width must follow from that circle.

    A wider patch sees more of the unworn flanks and a sharper circle, so that the half-width is unique. Sums over the
    strips inside, of which the outermost counts by the part of it that is inside, are linear from border to border.

    sums of 1, y^2, y^4 up to the outer border of each strip outwards from y = 0, (3, strip), without the FEWEST
    innermost; wanted: the curvature [1/m] that makes a half-width at FINE from each of these borders to the next,
    (border, fine); table: logarithms of the relative transverse curvature [1/m] and of the semi-axes a and b [m],
    (3, curvature).
    """

    rig: Rig
    y: Floats
    sums: Floats
    wanted: Floats
    table: Floats

    @classmethod
    def on(cls, rig: Rig, y: Floats) -> _BestCircle:
        """The circles of a rig on uniform strips y, an odd number about 0."""
        outward = y[len(y) // 2 :]
        both = np.where(outward > 0.0, 2.0, 1.0)
        sums = np.cumsum(both * np.stack([np.ones_like(outward), outward**2, outward**4]), axis=1)
        borders, table = outward[FEWEST:] + 0.5 * (y[1] - y[0]), _table(rig)
        half_width = _between(borders[:-1], borders[1:])
        known, _, log_b = table[:, ::-1]
        return cls(rig, y, sums[:, FEWEST:], np.exp(np.interp(np.log(half_width), log_b, known)), table)

    def curvature(self, worn: Floats) -> Floats:
        """Relative transverse curvature [1/m], (case,), of the best circle through a worn gap (case, strip)."""
        middle = len(self.y) // 2
        outward, folded = self.y[middle:], worn[:, middle:].copy()
        folded[:, 1:] += worn[:, :middle][:, ::-1]
        height = np.cumsum(folded, axis=-1)[:, FEWEST:]
        bow = np.cumsum(folded * outward**2, axis=-1)[:, FEWEST:]
        beyond = self._fitted(self.sums, height, bow) > self._wanted_at_borders
        if not beyond[:, -1].all() or beyond.all(axis=-1).any():
            raise NoConvergenceError("no ellipse fits the worn track")
        last = beyond.shape[-1] - 1 - np.argmin(beyond[:, ::-1], axis=-1)
        row = np.arange(len(last))
        ends = [(self.sums[:, at], height[row, at], bow[row, at]) for at in (last, last + 1)]
        fine = [_between(low, high) for low, high in zip(*ends, strict=True)]
        part = _crossing(self._fitted(*fine) - self.wanted[last])
        there = [low + part * (high - low) for low, high in zip(*ends, strict=True)]
        return np.maximum(self._fitted(*there), self._flattest)

    @cached_property
    def _wanted_at_borders(self) -> Floats:
        """The curvature [1/m] that makes a half-width up to each border, (border,)."""
        return np.append(self.wanted[:, 0], self.wanted[-1, -1])

    @property
    def _flattest(self) -> float:
        return float(FLAT[0] * self.rig.curvature_y)

    def _fitted(self, powers: Floats, height: Floats, bow: Floats) -> Floats:
        """Relative transverse curvature [1/m] of the best circle through the worn gap.

        powers: sums of 1, y^2, y^4 (3, ...); height, bow: of the gap, and of the gap times y^2, (...).
        """
        weight, second, fourth = powers
        mean = second / weight
        return np.asarray(self.rig.curvature_y + 2.0 * (bow - mean * height) / (fourth - mean * second))

    def axes(self, curvature_y: Floats) -> tuple[Floats, Floats]:
        """Semi-axes a, b [m] of the ellipse for transverse curvatures [1/m]."""
        at, (known, *axes) = np.log(curvature_y), self.table
        a, b = (np.exp(np.interp(at, known, values)) for values in axes)
        return a, b

    def pressed(self, a: Floats, b: Floats, load: Floats | float) -> Pressed:
        """Hertz ellipses with semi-axes (...) [m] under loads (...) [N], their line load integrated over each strip."""
        half_strip, whole = 0.5 * (self.y[1] - self.y[0]), np.asarray(load)[..., None]
        outer, inner = (np.clip((self.y + side) / b[..., None], -1.0, 1.0) for side in (half_strip, -half_strip))
        integral = 0.75 * whole * (outer * (1.0 - outer * outer / 3.0) - inner * (1.0 - inner * inner / 3.0))
        line_load = integral / (2.0 * half_strip)
        # g / (2 a(y) N) with a(y) = a sqrt(1 - y^2 / b^2), and the root is that of g over its largest
        intensity = 0.375 / (a * b)[..., None] * np.sqrt(line_load * b[..., None] / (0.75 * whole))
        area = np.pi * a * b
        return Pressed(line_load, intensity, a, b, 1.5 * load / area, area, np.zeros_like(a), np.ones_like(a))


def _between(low: Floats, high: Floats) -> Floats:
    """Values at FINE from the first to the last of two ends (...), (..., fine)."""
    return np.asarray(low[..., None] + FINE * (high - low)[..., None])


def _crossing(excess: Floats) -> Floats:
    """Where along FINE a rising excess (case, fine) is zero."""
    right = np.clip(np.argmax(excess > 0.0, axis=-1), 1, len(FINE) - 1)
    row = np.arange(len(right))
    low, high = excess[row, right - 1], excess[row, right]
    return np.asarray(FINE[right - 1] - low / (high - low) * (FINE[right] - FINE[right - 1]))


@lru_cache(maxsize=64)
def _table(rig: Rig) -> Floats:
    """Logarithms of the relative transverse curvature [1/m] and of the semi-axes a, b [m], (3, curvature)."""
    curvatures = rig.curvature_y * np.concatenate([FLAT, np.geomspace(1e-4, 10.0, 400)])
    ellipse = hertz.contact_ellipse(
        curvature_x=rig.curvature_x,
        curvature_y=curvatures,
        normal_load=rig.normal_load,
        effective_modulus=rig.effective_modulus,
    )
    return np.log(np.stack([curvatures, ellipse.a, ellipse.b]))
