"""The wear path: how profile and contact change together as material goes (Eqs. 12-15).

    du/dS (y) = g(y) / N        S = K E / (2 pi R H)

    u    worn depth of both discs together [m], (node, strip);   y across the track [m], (strip,)
    S    worn section: worn volume over the circumference [m2], (node,)
    g    load of the strip per width [N/m]; in full sliding the energy a strip dissipates is proportional to it
    E    dissipated energy [J], K wear coefficient [1], H hardness [Pa], R mean rolling radius [m]

Where K is uniform over y the profile depends on K and the history only through S, so one path serves every K and
every history. Contact "hertz" refits the best circle inside the patch and keeps the ellipse; contact "half_space"
lets the patch follow the worn profile. Partial slip moves the wear towards the trailing strips' edges; it is left out,
since what is dissipated there is a small part of any test that wears.

Steps: the half-space path is implicit (two-stage, L-stable, order 2), since sharp features of a profile die out much
faster than it grows; the Hertz path is an explicit midpoint rule with small steps. `error` is the difference to a path
of twice the step, over three; `pressure_error` is such a difference as it stands.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache, partial

import numpy as np
from scipy.optimize import brentq
from scipy.special import erf

from twindisc_cli.model.experiment import Contact, Floats, Rig
from twindisc_cli.model.traction_law import creep_stiffness
from twindisc_cli.physics import hertz, line_contact
from twindisc_cli.physics.half_space import NoConvergenceError, OutOfRangeError
from twindisc_cli.physics.half_space.strips import StripContact, equivalent_ellipse, solve_strips

STRIPS, MOST_STRIPS = 121, 901
STRIPS_ACROSS = 10
"""Strips that the unworn patch spans at least: a track far wider than it needs more than STRIPS."""
GROWTH = 0.06
FLAT = np.geomspace(1e-10, 1e-4, 300, endpoint=False)
GAMMA = 1.0 - np.sqrt(0.5)
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


@dataclass(frozen=True)
class WearPath:
    """Profile and contact at every node of the path.

    section S [m2], a, b [m] semi-axes (in half-space contact those of `equivalent_ellipse`), p0 [Pa] peak
    pressure, area of the patch [m2], stiffness G a b C11 and stiffness_y G a b C22 [N], edge [m] half-width of the
    worn zone: each (node,); y [m] (strip,); depth [m], line_load [N/m]: (node, strip); error: relative error of the
    greatest depth; pressure_error: of p0, at the node where it is largest.
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
    edge: Floats
    error: float
    pressure_error: float
    scaling: Scaling = CROWNED

    @property
    def wander_unit(self) -> float:
        """Width of the border of the worn zone [m], by which a wander is small or large."""
        return float(self.b[0]) * (0.1 if self.scaling is STRAIGHT else 1.0)

    def at(self, values: Floats, section: Floats) -> Floats:
        """Values (node, ...) at worn sections (...) [m2], linear between the nodes: (section..., ...)."""
        if values.ndim == 1:
            return np.interp(section, self.section, values)
        right = np.clip(np.searchsorted(self.section, section), 1, len(self.section) - 1)
        start, end = self.section[right - 1], self.section[right]
        part = np.clip((section - start) / (end - start), 0.0, 1.0)[..., None]
        return np.asarray((1.0 - part) * values[right - 1] + part * values[right])


@dataclass(frozen=True)
class _Patch:
    """The contact at one node: line load (strip,), semi-axes, peak pressure and area."""

    line_load: Floats
    a: float
    b: float
    p0: float
    area: float


def wear_path(rig: Rig, *, contact: Contact, section: float, wander: float = 0.0) -> WearPath:
    """Return the path from the unworn discs to at least `section` [m2]; paths are remembered."""
    tier = 2.0 ** np.ceil(np.log2(max(section, first_section(rig))))
    return _path(rig, contact, float(tier), float(wander))


@lru_cache(maxsize=64)
def first_section(rig: Rig) -> float:
    """The section [m2] on which the contact begins to change: a facet as wide as the unworn patch.

    Straight discs have none; of them it is what is as deep as the ends of their strip press in.
    """
    if rig.is_line:
        return float(rig.normal_load / (np.pi * rig.effective_modulus))
    return float(rig.curvature_y * (2.0 * rig.patch.b) ** 3 / 12.0)


@lru_cache(maxsize=64)
def _path(rig: Rig, contact: Contact, section: float, wander: float) -> WearPath:
    if rig.is_line:
        return _worn_strip(rig, section, wander)
    march = _march_half_space if contact == "half_space" else _march_hertz
    y = _grid(rig, section, wander)
    nodes, depth, patches = march(rig, y, section, wander, GROWTH)
    a, b, p0, area = (np.array([getattr(p, name) for p in patches]) for name in ("a", "b", "p0", "area"))
    stiffness, stiffness_y = creep_stiffness(rig, a, b)
    if wander:
        plain = _path(rig, contact, section, 0.0)
        error, pressure_error = plain.error, plain.pressure_error
    else:
        coarse_nodes, coarse, coarse_patches = march(rig, y, section, wander, 2.0 * GROWTH)
        error = abs(depth[-1].max() / coarse[-1].max() - 1.0) / 3.0
        coarse_p0 = np.interp(nodes, coarse_nodes, [patch.p0 for patch in coarse_patches])
        pressure_error = np.max(np.abs(coarse_p0 / p0 - 1.0))
    return WearPath(
        section=nodes,
        y=y,
        depth=depth,
        line_load=np.array([p.line_load for p in patches]),
        a=a,
        b=b,
        p0=p0,
        area=area,
        stiffness=stiffness,
        stiffness_y=stiffness_y,
        edge=_edges(y, depth, b),
        error=float(error),
        pressure_error=float(pressure_error),
    )


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
        edge=np.full_like(nodes, half + 2.0 * wander),
        error=0.0,
        pressure_error=0.0,
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
    return np.linspace(-half, half, count)


def _spreading(y: Floats, wander: float) -> Floats:
    """Matrix (strip, strip) that spreads a line load over a normal distribution of the lateral position."""
    if wander <= 0.0:
        return np.eye(len(y))
    kernel = np.exp(-0.5 * ((y[:, None] - y) / wander) ** 2)
    return np.asarray(kernel / kernel.sum(axis=0))


def _nodes(rig: Rig, section: float, growth: float) -> Floats:
    """Nodes from 0 to `section` [m2] whose steps grow with the section."""
    first = 0.3 * first_section(rig)
    count = int(np.ceil(np.log1p(section / first) / np.log1p(growth)))
    return np.asarray(first * np.expm1(np.linspace(0.0, np.log1p(section / first), count + 1)))


def _march_half_space(
    rig: Rig, y: Floats, section: float, wander: float, growth: float
) -> tuple[Floats, Floats, list[_Patch]]:
    nodes, spread = _nodes(rig, section, growth), _spreading(y, wander) / rig.normal_load
    gap = 0.5 * rig.curvature_y * y**2
    press = partial(
        solve_strips,
        y=y,
        curvature_x=rig.curvature_x,
        normal_load=rig.normal_load,
        effective_modulus=rig.effective_modulus,
    )
    found = press(gap=gap)
    worn = np.zeros_like(y)
    depths, contacts = [worn], [found]
    for step in np.diff(nodes):
        compliance = GAMMA * step * spread
        first = press(gap=gap + worn, compliance=compliance, start=found)
        worn = worn + (1.0 - GAMMA) * step * spread @ first.line_load
        found = press(gap=gap + worn, compliance=compliance, start=first)
        worn = worn + compliance @ found.line_load
        depths.append(worn)
        contacts.append(found)
    return nodes, np.array(depths), [_patch_of(contact) for contact in contacts]


def _patch_of(contact: StripContact) -> _Patch:
    a, b = equivalent_ellipse(contact)
    return _Patch(contact.line_load, float(a), float(b), _peak_pressure(contact), float(contact.area))


def _peak_pressure(contact: StripContact) -> float:
    """Largest pressure [Pa] that hangs on no single strip.

    At the edge of a patch line load and half-length are not resolved: the last strip's pressure depends on where the
    edge lies in it. What counts are the strips further from the edges than half of the largest half-length
    along rolling (or of the half-width, if less), and the means over bands twice as wide anywhere, the edges included.
    """
    y, width = contact.y, contact.strip_width
    first, last = (float(edge) for edge in contact.extent)
    reach = 0.5 * min(float(contact.half_length.max()), 0.5 * (last - first))
    inner = (y > first + reach) & (y < last - reach)
    borders, starts = np.append(y - 0.5 * width, y[-1] + 0.5 * width), np.linspace(first, last - 2.0 * reach, len(y))
    sums = [np.append(0.0, np.cumsum(v)) for v in (contact.line_load, 0.5 * np.pi * contact.half_length)]
    load, area = (np.interp(starts + 2.0 * reach, borders, s) - np.interp(starts, borders, s) for s in sums)
    band = np.divide(load, area, out=np.zeros_like(load), where=area > 0.0)
    return float(max(contact.centre_pressure[inner].max(initial=0.0), band.max()))


def _march_hertz(
    rig: Rig, y: Floats, section: float, wander: float, growth: float
) -> tuple[Floats, Floats, list[_Patch]]:
    nodes, spread = _nodes(rig, section, growth), _spreading(y, wander) / rig.normal_load
    worn, patch = np.zeros_like(y), _ellipse_on(rig, y, rig.curvature_y)
    powers = np.stack([np.ones_like(y), y**2, y**4])
    depths, patches = [worn], [patch]
    for step in np.diff(nodes):
        middle = _best_ellipse(rig, y, powers, worn + 0.5 * step * spread @ patch.line_load, patch)
        worn = worn + step * spread @ middle.line_load
        patch = _best_ellipse(rig, y, powers, worn, middle)
        depths.append(worn)
        patches.append(patch)
    return nodes, np.array(depths), patches


def _best_ellipse(rig: Rig, y: Floats, powers: Floats, worn: Floats, patch: _Patch) -> _Patch:
    """Refit the best circle inside the patch, whose own half-width must follow from that circle.

    A wider patch sees more of the unworn flanks and a sharper circle, so that the half-width is unique.
    """
    widths, curvatures = _hertz_table(rig)
    sums = np.concatenate([powers, powers[:2] * worn])
    outward, spacing = np.abs(y), y[1] - y[0]

    def fitted(half_width: float) -> float:
        """Relative transverse curvature [1/m] of the best circle through the worn gap, which is symmetric."""
        inside = np.minimum(np.maximum((half_width - outward) / spacing + 0.5, 0.0), 1.0)
        weight, second, fourth, height, bow = sums @ inside
        curvature = 2.0 * (bow - second / weight * height) / (fourth - second / weight * second)
        return float(max(rig.curvature_y + curvature, FLAT[0] * rig.curvature_y))

    def excess(half_width: float) -> float:
        return float(np.log(np.interp(np.log(fitted(half_width)), curvatures, widths)) - np.log(half_width))

    try:
        width = brentq(excess, 0.3 * patch.b, y[-1], rtol=1e-5)
    except ValueError as error:
        raise NoConvergenceError(f"no ellipse fits the worn track: {error}") from error
    return _ellipse_on(rig, y, fitted(width))


@lru_cache(maxsize=8)
def _hertz_table(rig: Rig) -> tuple[Floats, Floats]:
    """Half-width b [m] over the logarithm of the relative transverse curvature."""
    curvatures = rig.curvature_y * np.concatenate([FLAT, np.geomspace(1e-4, 10.0, 400)])
    ellipse = hertz.contact_ellipse(
        curvature_x=rig.curvature_x,
        curvature_y=curvatures,
        normal_load=rig.normal_load,
        effective_modulus=rig.effective_modulus,
    )
    return np.asarray(ellipse.b), np.log(curvatures)


def _ellipse_on(rig: Rig, y: Floats, curvature_y: float) -> _Patch:
    """Hertz ellipse for a transverse curvature [1/m], its line load integrated over each strip."""
    ellipse = hertz.contact_ellipse(
        curvature_x=rig.curvature_x,
        curvature_y=curvature_y,
        normal_load=rig.normal_load,
        effective_modulus=rig.effective_modulus,
    )
    a, b = float(ellipse.a), float(ellipse.b)
    half_strip = 0.5 * (y[1] - y[0])
    outer, inner = (np.clip((y + side) / b, -1.0, 1.0) for side in (half_strip, -half_strip))
    integral = 0.75 * rig.normal_load * ((outer - outer**3 / 3.0) - (inner - inner**3 / 3.0))
    return _Patch(line_load=integral / (2.0 * half_strip), a=a, b=b, p0=float(ellipse.p0), area=np.pi * a * b)


def _edges(y: Floats, depth: Floats, b: Floats) -> Floats:
    """Half-width of the worn zone [m], (node,): where the depth falls below 2 % of its greatest value."""
    deepest = depth.max(axis=1)
    inwards = np.flatnonzero(y >= 0.0)[::-1]
    half = [np.interp(0.02 * d, row[inwards], y[inwards]) for d, row in zip(deepest, depth, strict=True)]
    return np.where(deepest > 0.0, half, b)
