"""One contact by two theories, in one form: the exact solution on elements, and FASTSIM on the strips of an ellipse.

Along a line both are closed forms. Under lateral creepage or spin, and of unlike discs, the exact theory is solved on
the strip with its ends, and FASTSIM turns as a whole into the direction of the combined law.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from twindisc_cli.errors import ValidityError
from twindisc_cli.model.chain import SPIN_ARM_OF_A_LINE
from twindisc_cli.model.experiment import Floats, Rig
from twindisc_cli.model.traction_law import creep_stiffness
from twindisc_cli.physics import fastsim, kalker, line_contact, third_body
from twindisc_cli.physics._arrays import arrays
from twindisc_cli.physics.combined import direction
from twindisc_cli.physics.half_space import rolling
from twindisc_cli.physics.half_space.normal import solve_gap, solve_profile
from twindisc_cli.physics.half_space.rolling import Creepage

ELEMENTS = 120  # along the patch, half as many across: the border of the slip is drawn without steps
STRIPS = 100  # of FASTSIM each way, drawn beside the exact fields
LINE_STRIPS = 21  # an odd number: one lies in the middle
_STANDING = 1e-15
"""A creepage that is none [1]."""


@dataclass(frozen=True)
class Grid:
    """Pressure [Pa] (y, x) at the centres x, y [m] of elements."""

    x: Floats
    y: Floats
    pressure: Floats


@dataclass(frozen=True)
class Patch:
    """A normal contact, and on half the elements a side; semi-axes [m] of the ellipse of its area and width.

    Of a line: half-length and half-width of the strip.
    """

    fine: Grid
    coarse: Grid
    a: float
    b: float
    normal_load: float
    origin: str
    line: bool = False


@dataclass(frozen=True)
class Field:
    """What a theory says: fields (strip, cell), vectors (2, strip, cell), forces [N], moment [N m], power [W].

    x, y [m]; pressure [Pa] that bounds the traction [Pa]; slip [m/s]; sticks; error of force_x [N], 0 where unknown;
    power_per_length P_l [W/m] (strip,).
    """

    theory: str
    x: Floats
    y: Floats
    pressure: Floats
    traction: Floats
    slip: Floats
    sticks: NDArray[np.bool_]
    force_x: float
    force_y: float
    moment: float
    error: float
    stick_fraction: float
    power_per_length: Floats
    power: float


def hertz_patch(rig: Rig, normal_load: float) -> Patch:
    """The ellipse, or the strip, of the unworn discs."""
    result = replace(rig, normal_load=normal_load).patch
    a, b, p0 = float(result.a), float(result.b), float(result.p0)
    across = 0.0 if rig.is_line else 1.0

    def on(elements: int) -> Grid:
        x, y = (side * ((2.0 * np.arange(elements) + 1.0) / elements - 1.0) for side in (a, b))
        return Grid(x, y, p0 * np.sqrt(np.maximum(0.0, 1.0 - (x / a) ** 2 - across * (y[:, None] / b) ** 2)))

    origin = "the unworn discs (Hertz, along a line)" if rig.is_line else "the unworn discs (Hertz)"
    return Patch(on(ELEMENTS), on(ELEMENTS // 2), a, b, normal_load, origin, rig.is_line)


def profile_patch(rig: Rig, normal_load: float, *, y: Floats, height: Floats, origin: str) -> Patch:
    """The half-space patch where one disc has changed by `height` [m] at y [m], both (point,)."""
    within = np.abs(y) <= 0.5 * rig.width
    y, gap = y[within], (0.5 * rig.curvature_y * y**2 - height)[within]
    normal_contact = solve_profile(
        y=y,
        gap=gap,
        curvature_x=rig.curvature_x,
        normal_load=normal_load,
        effective_modulus=rig.effective_modulus,
    )
    fine = Grid(normal_contact.x, normal_contact.y, normal_contact.pressure)
    rows = np.flatnonzero((normal_contact.pressure > 0.0).any(axis=1))
    dx, dy = float(normal_contact.x[1] - normal_contact.x[0]), float(normal_contact.y[1] - normal_contact.y[0])
    b = 0.5 * dy * (rows[-1] - rows[0] + 1)
    a = float((normal_contact.pressure > 0.0).sum()) * dx * dy / (np.pi * b)
    across, along = (
        points[: points.size // 2 * 2].reshape(-1, 2).mean(axis=1) for points in (normal_contact.y, normal_contact.x)
    )
    half = solve_gap(
        x=along,
        y=across,
        gap=0.5 * rig.curvature_x * along**2 + np.interp(across, y, gap)[:, None],
        normal_load=normal_load,
        effective_modulus=rig.effective_modulus,
    )
    coarse = Grid(half.x, half.y, half.pressure)
    return Patch(fine, coarse, a, b, normal_load, f"{origin} (half-space)")


def exact_field(
    patch: Patch,
    rig: Rig,
    *,
    mu: float | rolling.SlipLaw,
    creepage: Creepage,
    layer_compliance: float = 0.0,
) -> Field:
    """The exact theory on the patch, its force carried to the limit from this grid and one of half the fineness."""
    if patch.line and creepage.y == creepage.spin == rig.dundurs == layer_compliance == 0.0 and not callable(mu):
        return _line_field(patch, rig, "exact", mu=mu, creepage=creepage)
    difference = -stiffness_difference(rig)  # the solver's creepage is positive where body 1 is the slower
    discs = rolling.Discs(rig.shear_modulus, rig.poisson_ratio, difference, layer_compliance)
    fine, coarse = (
        rolling.solve(x=grid.x, y=grid.y, pressure=grid.pressure, mu=mu, discs=discs, creepage=creepage)
        for grid in (patch.fine, patch.coarse)
    )
    force_x, error = rolling.limit(coarse.force_x, fine.force_x)
    force_y, _ = rolling.limit(coarse.force_y, fine.force_y)
    moment, _ = rolling.limit(coarse.moment, fine.moment)
    work, _ = rolling.limit(coarse.work, fine.work)
    x, y = np.meshgrid(patch.fine.x, patch.fine.y)
    per_length = fine.dissipation * rig.rolling_speed
    return Field(
        theory="exact",
        x=x,
        y=y,
        pressure=patch.fine.pressure,
        traction=fine.traction,
        slip=fine.slip * rig.rolling_speed,
        sticks=fine.contact & ~fine.slipping,
        force_x=float(force_x),
        force_y=float(force_y),
        moment=float(moment),
        error=float(error),
        stick_fraction=fine.stick_fraction,
        power_per_length=per_length,
        power=rig.rolling_speed * float(work),
    )


def fastsim_field(
    patch: Patch,
    rig: Rig,
    *,
    mu: float,
    creepage: Creepage,
    layer_compliance: float = 0.0,
) -> Field:
    """FASTSIM on the ellipse of the patch's area and width, or on a line's strip, with a parabolic bound.

    A layer adds its compliance to those of the theory.
    """
    if patch.line:
        return _line_field(patch, rig, "fastsim", mu=mu, creepage=creepage, layer_compliance=layer_compliance)
    shape = _fastsim_patch(patch, rig, mu, layer_compliance)
    vx, vy, turn, speed = creepage.x, creepage.y, creepage.spin, rig.rolling_speed
    fields = fastsim.fields(shape, creepage_x=vx, creepage_y=vy, spin=turn, speed=speed, nx=STRIPS, ny=STRIPS)
    x, y, whole = fields.x.T, fields.y.T, fields.solution
    bound = 1.0 - (x / patch.a) ** 2 - (y / patch.b) ** 2
    return Field(
        theory="fastsim",
        x=x,
        y=y,
        pressure=2.0 * patch.normal_load / (np.pi * patch.a * patch.b) * bound,
        traction=np.stack([fields.traction_x.T, fields.traction_y.T]),
        slip=np.stack([fields.slip_x.T, fields.slip_y.T]),
        sticks=fields.sticks.T,
        force_x=float(whole.force_x),
        force_y=float(whole.force_y),
        moment=float(whole.moment),
        error=0.0,
        stick_fraction=float(whole.stick_fraction),
        power_per_length=whole.power_per_length,
        power=float(whole.power),
    )


def _fastsim_patch(patch: Patch, rig: Rig, mu: float, layer_compliance: float) -> fastsim.Patch:
    """The ellipse with Kalker's coefficients, each in series with the layer's."""
    try:
        c = kalker.coefficients(patch.a / patch.b, rig.poisson_ratio)
    except ValueError as error:
        raise ValidityError(f"FASTSIM has no creepage coefficients for this patch: {error}") from error
    layer = layer_compliance * rig.shear_modulus / patch.a
    of_spin = 4.0 / np.pi * np.sqrt(patch.b / patch.a)
    coefficients = (
        own / (1.0 + layer * part * own) for own, part in ((c.c11, 0.375), (c.c22, 0.375), (c.c23, of_spin))
    )
    return fastsim.Patch(patch.a, patch.b, patch.normal_load, mu, rig.shear_modulus, *coefficients)


def _line_field(
    patch: Patch,
    rig: Rig,
    theory: line_contact.Theory,
    *,
    mu: float,
    creepage: Creepage,
    layer_compliance: float = 0.0,
) -> Field:
    """The closed form of a theory on each strip of a line, which spin gives a creepage of its own."""
    y = patch.b * (2.0 * np.arange(LINE_STRIPS) + 1.0 - LINE_STRIPS) / LINE_STRIPS
    along, sideways = creepage.x - creepage.spin * y, SPIN_ARM_OF_A_LINE * creepage.spin * patch.a
    across = float(np.hypot(creepage.y, sideways))
    stiffness = _line_stiffness(patch, rig, layer_compliance)
    strips = [_line_strip(patch, stiffness, theory, mu, (float(slip), across)) for slip in along]
    forces = mu * patch.normal_load * np.array([strip.share * strip.direction for strip in strips])
    slips = np.stack([along, np.full_like(y, across)], axis=1)
    power = rig.rolling_speed * np.sum(forces * slips, axis=1)
    x, place = np.meshgrid(patch.fine.x, y)
    vectors = np.array([strip.direction for strip in strips]).T[:, :, None]
    return Field(
        theory=theory,
        x=x,
        y=place,
        pressure=np.array([strip.cells.bound for strip in strips]) / mu,
        traction=vectors * np.array([strip.cells.traction for strip in strips]),
        slip=vectors * np.array([strip.cells.slip for strip in strips]) * rig.rolling_speed,
        sticks=np.array([strip.cells.sticks for strip in strips]),
        force_x=float(forces[:, 0].mean()),
        force_y=float(forces[:, 1].mean()),
        moment=float(-np.mean(y * forces[:, 0])),
        error=0.0,
        stick_fraction=float(np.mean([strip.sticks for strip in strips])),
        power_per_length=power / (2.0 * patch.b),
        power=float(power.mean()),
    )


@dataclass(frozen=True)
class _LineStrip:
    """A strip of a line: tractions along it, direction of the force (2,), its share of mu N, and what sticks [1]."""

    cells: line_contact.Traction
    direction: Floats
    share: float
    sticks: float


def _line_stiffness(patch: Patch, rig: Rig, layer_compliance: float) -> list[float]:
    """Force per creepage along and across [N], the layer in series with the discs."""
    a, b = np.asarray(patch.a), np.asarray(patch.b)
    discs = creep_stiffness(rig, a, b)
    layer = (third_body.compliance_ratio(layer_compliance, stiffness=k, a=a, b=b, line=True) for k in discs)
    return [float(k / (1.0 + ratio)) for k, ratio in zip(discs, layer, strict=True)]


def _line_strip(
    patch: Patch, stiffness: list[float], theory: line_contact.Theory, mu: float, creepage: tuple[float, float]
) -> _LineStrip:
    """A strip at its creepages along and across rolling."""
    capacity, width, slips = mu * patch.normal_load, 2.0 * patch.b, max(float(np.hypot(*creepage)), _STANDING)
    along, across = (k * v / capacity for k, v in zip(stiffness, creepage, strict=True))
    xi = float(np.hypot(along, across))
    cells = line_contact.along_the_patch(
        patch.fine.x,
        a=patch.a,
        bound=capacity / width,
        stiffness=max(xi * capacity / slips, min(stiffness)) / width,
        creepage=slips,
        theory=theory,
    )
    return _LineStrip(
        cells=cells,
        direction=np.array([float(part) for part in direction(*arrays(along, across, *creepage))]),
        share=float(line_contact.saturation(xi, theory)),
        sticks=float(line_contact.stick_fraction(xi, theory)),
    )


def stiffness_difference(rig: Rig) -> float:
    """K of two bodies, by which pressure alone makes them slip: G/4 [(1 - 2 nu_1)/G_1 - (1 - 2 nu_2)/G_2] [1]."""
    return 0.25 * rig.shear_modulus * rig.mismatch
