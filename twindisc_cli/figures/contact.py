"""Figure of a contact (Figs. 4, 5): traction and slip over the patch by two theories, and sections through them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from twindisc_cli.figures.style import BLACK, BLUE, ORANGE, RED, SMALL, TEXT, dress, legend, name_axes, sheet
from twindisc_cli.physics import shakedown

Floats = NDArray[np.float64]

ARROWS = 12  # each way: more would touch each other
SLENDER = 4.0
"""Width over length of a patch from which on its map is stretched along rolling."""
NAMES = {"exact": "exact theory", "fastsim": "FASTSIM"}
COLOURS = {"exact": BLUE, "fastsim": ORANGE}


class Field(Protocol):
    """Fields (strip, cell) of one theory: x, y [m], pressure [Pa], traction [Pa] and slip [m/s] (2, ...), sticks."""

    @property
    def theory(self) -> str: ...  # noqa: D102
    @property
    def x(self) -> Floats: ...  # noqa: D102
    @property
    def y(self) -> Floats: ...  # noqa: D102
    @property
    def pressure(self) -> Floats: ...  # noqa: D102
    @property
    def traction(self) -> Floats: ...  # noqa: D102
    @property
    def slip(self) -> Floats: ...  # noqa: D102
    @property
    def sticks(self) -> NDArray[np.bool_]: ...  # noqa: D102
    @property
    def stick_fraction(self) -> float: ...  # noqa: D102
    @property
    def force_x(self) -> float: ...  # noqa: D102
    @property
    def power_per_length(self) -> Floats: ...  # noqa: D102


class Subsurface(Protocol):
    """How hard the softer disc is pressed, p0/k at T/N [1], its state, and the semi-axes of the patch [m]."""

    @property
    def pressed(self) -> float: ...  # noqa: D102
    @property
    def traction_ratio(self) -> float: ...  # noqa: D102
    @property
    def state(self) -> str: ...  # noqa: D102
    @property
    def along(self) -> float: ...  # noqa: D102
    @property
    def across(self) -> float: ...  # noqa: D102


def fields_and_sections(
    fields: Sequence[Field], under: Subsurface, *, mu: float, name: str, case: str, provenance: str
) -> Figure:
    """A row of maps for each theory, traction and sliding velocity; sections through the patch; the shakedown map."""
    rows = len(fields) + 2
    figure = sheet(height=2.45 * rows, title=f"{name}: contact at {case}", provenance=provenance)
    grid = figure.add_gridspec(rows, 2)
    panels = [figure.add_subplot(grid[row, column]) for row in range(rows - 1) for column in (0, 1)]
    lowest = figure.add_subplot(grid[-1, :])
    dress([*panels, lowest])
    _shakedown(lowest, under)
    traction = 1e-6 * max(float(np.hypot(*field.traction).max()) for field in fields)
    slip = max(float(np.hypot(*field.slip).max()) for field in fields)
    for field, left, right in zip(fields, panels[0::2], panels[1::2], strict=False):
        _map(left, field, 1e-6 * field.traction, traction, f"{NAMES[field.theory]}: traction", "MPa")
        _map(right, field, field.slip, slip, f"{NAMES[field.theory]}: sliding velocity", "m/s")
    _frame(panels[:-2], fields)
    _middle(panels[-2], fields, mu)
    _power(panels[-1], fields)
    return figure


def _shakedown(axes: Axes, under: Subsurface) -> None:
    """Where this contact lies between first yield and shakedown."""
    ratio = np.linspace(0.0, max(0.65, 1.2 * under.traction_ratio), 200)
    yields, shakes = shakedown.limits(ratio, under.along, under.across)
    top = 1.15 * max(float(shakes[0]), under.pressed)
    axes.fill_between(ratio, shakes, top, color=RED, alpha=0.12, linewidth=0.0, label="beyond shakedown")
    axes.plot(ratio, shakes, color=RED, linewidth=1.2, label="shakedown limit")
    axes.plot(ratio, yields, color=BLUE, linewidth=1.0, linestyle="--", label="first yield")
    axes.plot([under.traction_ratio], [under.pressed], linestyle="none", marker="o", color=BLACK,
              label=f"this contact: {under.state}")  # fmt: skip
    axes.set_xlim(0.0, float(ratio[-1]))
    axes.set_ylim(0.0, top)
    name_axes(axes, "$T/N$ [1]", "$p_0/k$ [1]", "yield and shakedown, $k = H / (3 \\sqrt{3})$")
    legend(axes, 4)


def _map(axes: Axes, field: Field, vector: Floats, largest: float, what: str, unit: str) -> None:
    """The size of a vector in colours, its direction in arrows, the border of stick and slip; rolling is upward."""
    x, y, inside = 1e3 * field.x, 1e3 * field.y, field.pressure > 0.0
    size = np.where(inside, np.hypot(*vector), np.nan)
    drawn = axes.pcolormesh(y.T, x.T, size.T, shading="nearest", vmin=0.0, vmax=largest, rasterized=True)
    bar = axes.figure.colorbar(drawn, ax=axes, pad=0.02, aspect=18, shrink=0.9)
    bar.set_label(unit, fontsize=SMALL)
    bar.ax.tick_params(labelsize=SMALL)
    if largest > 0.0:
        _arrows(axes, field, vector / largest, size > 0.03 * largest)
    marked_zones(axes, field)
    axes.set_aspect("equal" if np.abs(y[inside]).max() < SLENDER * np.abs(x[inside]).max() else "auto")
    axes.grid(False)
    name_axes(axes, "$y$ [mm]", "$x$, rolling up [mm]", what)


def _arrows(axes: Axes, field: Field, vector: Floats, shown: NDArray[np.bool_]) -> None:
    """A vector (2, strip, cell) of length 1 at most, where it is shown, at places of an even grid over the patch."""
    x, y, inside = 1e3 * field.x, 1e3 * field.y, field.pressure > 0.0
    rows = ((np.arange(ARROWS) + 0.5) / ARROWS * x.shape[0]).astype(int)
    reach = float(np.abs(x[inside]).max())
    places = reach * (2.0 * (np.arange(ARROWS) + 0.5) / ARROWS - 1.0)
    across = np.repeat(rows, ARROWS)
    along = np.concatenate([np.argmin(np.abs(x[row][:, None] - places), axis=0) for row in rows])
    near = np.abs(x[across, along] - np.tile(places, ARROWS)) < 0.5 * reach / ARROWS
    chosen = near & shown[across, along]
    at = across[chosen], along[chosen]
    axes.quiver(
        y[at], x[at], vector[1][at], vector[0][at],
        color="white", scale=1.1 * ARROWS, width=0.006, headwidth=3.5, pivot="tail",
    )  # fmt: skip


def _frame(panels: Sequence[Axes], fields: Sequence[Field]) -> None:
    """The same limits for all maps, just outside the patch."""
    touching = [field.pressure > 0.0 for field in fields]
    across = 1.03e3 * max(float(np.abs(f.y[inside]).max()) for f, inside in zip(fields, touching, strict=True))
    along = 1.03e3 * max(float(np.abs(f.x[inside]).max()) for f, inside in zip(fields, touching, strict=True))
    for axes in panels:
        axes.set_xlim(-across, across)
        axes.set_ylim(-along, along)


def marked_zones(axes: Axes, field: Field) -> None:
    """The border between stick and slip; both zones are named where they are large enough."""
    x, y, inside = 1e3 * field.x, 1e3 * field.y, field.pressure > 0.0
    if field.sticks.any() and not field.sticks[inside].all():
        axes.contour(y, x, np.where(field.sticks, 1.0, 0.0), levels=[0.5], colors="white", linewidths=1.4)
    for zone, label in ((field.sticks, "stick"), (inside & ~field.sticks, "slip")):
        if zone.sum() > 0.08 * inside.sum():
            strips = np.where(zone.any(axis=1), np.abs(y.mean(axis=1) - y[zone].mean()), np.inf)
            cells = np.flatnonzero(zone[np.argmin(strips)])
            place = (int(np.argmin(strips)), int(cells[len(cells) // 2]))
            axes.text(
                y[place], x[place], label, fontsize=TEXT, color="white", ha="center", va="center", fontweight="bold",
                bbox={"facecolor": BLACK, "alpha": 0.55, "edgecolor": "none", "pad": 1.5}, zorder=5,
            )  # fmt: skip


def _middle(axes: Axes, fields: Sequence[Field], mu: float) -> None:
    """Longitudinal traction along the middle strip, under its bound."""
    for field in fields:
        row = field.x.shape[0] // 2
        order = np.argsort(field.x[row])
        x = 1e3 * field.x[row, order]
        colour, label = COLOURS[field.theory], NAMES[field.theory]
        axes.plot(x, 1e-6 * mu * field.pressure[row, order], color=colour, linestyle=":", linewidth=0.9,
                  label=f"$\\mu p$, {label}")  # fmt: skip
        axes.plot(x, 1e-6 * field.traction[0, row, order], color=colour, linewidth=1.3, label=label)
    name_axes(axes, "$x$ [mm]", "traction [MPa]", "traction along the middle strip")
    axes.set_ylim(0.0, None)
    legend(axes, 2)


def _power(axes: Axes, fields: Sequence[Field]) -> None:
    """Dissipated power per length over the width (what wears, Eq. 15)."""
    for field in fields:
        y = 1e3 * field.y.mean(axis=1)
        share = f"sticks over {field.stick_fraction * 100.0:.1f} %"
        axes.plot(y, 1e-3 * field.power_per_length, color=COLOURS[field.theory], linewidth=1.3,
                  label=f"{NAMES[field.theory]}: {share}")  # fmt: skip
    axes.set_ylim(0.0, 1.25e-3 * max(float(field.power_per_length.max()) for field in fields))
    name_axes(axes, "$y$ [mm]", "$P_l$ [W/mm]", "dissipated power per length")
    legend(axes)
