"""Figures of wear: history and profiles (Figs. 8, 12), and the K found from a profile (Figs. 9, 11, 14)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from twindisc_cli.figures.mass import volume, wear_rate
from twindisc_cli.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    RED,
    SMALL,
    dress,
    family,
    from_zero,
    legend,
    logarithmic,
    name_axes,
    page,
    sheet,
)
from twindisc_cli.figures.time_axis import time_axis
from twindisc_cli.report.words import number

if TYPE_CHECKING:
    from twindisc_cli.identify.known_k import KnownK
    from twindisc_cli.identify.mass import MassFit
    from twindisc_cli.identify.regimes import Regime
    from twindisc_cli.identify.sensitivity import Variation
    from twindisc_cli.identify.wear import WearFit
    from twindisc_cli.identify.wear_history import WearHistory
    from twindisc_cli.model.experiment import Experiment

ACROSS, HEIGHT = "$y$ [mm]", "height change [µm]"
_PROFILES = 7  # first to last: as many as can be followed by shade


def worn(
    history: WearHistory, *, test: Experiment, provenance: str, measured: tuple[np.ndarray, np.ndarray] | None
) -> Figure:
    """Creepage and mu of each iteration, profiles on the way, depth, width and patch; measured (y, height) [m]."""
    figure, panels = page(3, 2, height=7.8, title=f"{test.name}: wear", provenance=provenance)
    creepage, friction, profiles, depth, size, pressure = panels
    clock = time_axis(test)
    time = clock.drawn(history.time)
    _loading(creepage, friction, history)
    order = np.unique(np.linspace(0, len(history.time) - 1, _PROFILES).round().astype(int))
    for i, colour in zip(order, family(len(order)), strict=True):
        profiles.plot(
            history.y * 1e3, history.height[i] * 1e6, color=colour, linewidth=1.0, label=clock.text(history.time[i])
        )
    if measured is not None:
        profiles.plot(
            measured[0] * 1e3, measured[1] * 1e6, color=RED, linestyle="--", linewidth=1.1, label=f"{provenance}, end"
        )
    name_axes(profiles, ACROSS, HEIGHT, "profile of disc 2")
    _around_the_track(profiles, history.y, history.height[-1], measured)
    legend(profiles, 4)
    depth.plot(time, [t.depth * 1e6 for t in history.track], color=BLUE)
    name_axes(depth, clock.axis_label, "depth [µm]", "depth of the track")
    size.plot(time, [t.width * 1e3 for t in history.track], color=ORANGE, label="track, at 5 % of its depth")
    size.plot(time, 2e3 * history.b, color=BLUE, label="patch across, $2b$")
    size.plot(time, 2e3 * history.a, color=GREEN, label="patch along, $2a$")
    name_axes(size, clock.axis_label, "width [mm]", "width of track and patch")
    legend(size, 2)
    pressure.plot(time, history.p0 * 1e-6, color=RED)
    name_axes(pressure, clock.axis_label, "$p_0$ [MPa]", "peak pressure")
    for axes in (depth, size, pressure):
        axes.set_xlim(0.0, float(time[-1]))
        from_zero(axes)
    return figure


def _loading(creepage: Axes, friction: Axes, history: WearHistory) -> None:
    """Creepage and mu over the iterations (Fig. 8)."""
    order = np.arange(1, len(history.time) + 1)
    creepage.bar(order, history.creepage * 100.0, width=0.9, color="#BBD7EA")
    name_axes(creepage, "iteration", "creepage [%]", "creepage")
    friction.plot(order, history.mu, color=RED, marker=".", markersize=4.0, linewidth=0.8)
    from_zero(friction)
    name_axes(friction, "iteration", "$\\mu$ [1]", "coefficient of friction")


def _around_the_track(
    axes: Axes, y: np.ndarray, height: np.ndarray, measured: tuple[np.ndarray, np.ndarray] | None
) -> None:
    """Show the worn track and a margin, not the whole width that was recorded."""
    worn_y = [y[height < 0.005 * height.min()]]
    if measured is not None:
        worn_y.append(measured[0][measured[1] < 0.05 * measured[1].min()])
    reach = 1.35e3 * float(np.abs(np.concatenate(worn_y)).max(initial=1e-4))
    axes.set_xlim(-reach, reach)
    axes.locator_params(axis="x", nbins=6)


def fitted(
    fit: WearFit,
    *,
    known: Sequence[KnownK],
    weighed: tuple[MassFit, Sequence[Regime]] | None,
    name: str,
    provenance: str,
) -> Figure:
    """Measured and simulated profile, what is left, the bisection, and every K there is.

    Of weighed discs a row more: the volume over the energy, and the wear rate with its regimes.
    """
    rows = 4 if weighed else 3
    figure = sheet(height=2.75 * rows - 0.6, title=f"{name}: wear coefficient", provenance=provenance)
    grid = figure.add_gridspec(rows, 2)
    profile, left, trail = (figure.add_subplot(grid[row, column]) for row, column in ((0, 0), (0, 1), (1, slice(None))))
    by_weight = [figure.add_subplot(grid[2, column]) for column in (0, 1)] if weighed else []
    all_k = figure.add_subplot(grid[-1, :])
    dress([profile, left, trail, *by_weight, all_k])
    if weighed:
        volume(by_weight[0], weighed[0], provenance=provenance)
        wear_rate(by_weight[1], *weighed)
    _profiles(profile, left, fit, provenance)
    _trail(trail, fit)
    coefficients(all_k, known)
    return figure


def _profiles(profile: Axes, left: Axes, fit: WearFit, provenance: str) -> None:
    """Measured and simulated profile, and their difference."""
    y = fit.y * 1e3
    profile.plot(y, fit.height * 1e6, color=BLACK, linewidth=1.0, label=provenance)
    profile.plot(y, fit.simulated_height * 1e6, color=BLUE, linewidth=1.3, label=f"simulated, {fit.method}")
    if fit.method != "least squares":
        profile.plot(y, fit.squares_height * 1e6, color=ORANGE, linewidth=1.0, linestyle="--", label="least squares")
    name_axes(profile, ACROSS, HEIGHT, "profile of the worn disc")
    left.axhline(0.0, color=GREY, linewidth=0.6)
    left.plot(y, (fit.height - fit.simulated_height) * 1e6, color=BLUE, linewidth=1.0)
    name_axes(left, ACROSS, f"{provenance} − simulated [µm]", f"what {fit.method} misses")
    for axes in (profile, left):
        _around_the_track(axes, fit.y, fit.simulated_height, (fit.y, fit.height))
    legend(profile, 2)


def _trail(axes: Axes, fit: WearFit) -> None:
    """The depth error of each K that the bisection tried."""
    k, error = np.array(fit.bisection.trail).T
    axes.plot(np.arange(1, len(k) + 1), error, color=BLUE, marker="o", markersize=4.0)
    axes.axhspan(-1.0, 1.0, color=GREEN, alpha=0.25, linewidth=0.0, label="|$E_r$| < 1 %")
    shown = np.arange(0, len(k), int(np.ceil(len(k) / 8)))
    axes.set_xticks(shown + 1, [f"{i + 1}\n{number(k[i])}" for i in shown])
    axes.margins(y=0.12)
    name_axes(axes, "", "$E_r$ [%]", "bisection: depth error of each $K$ (its number, and $K$)")
    legend(axes)


def varied(variations: Sequence[Variation], *, k: float, name: str, provenance: str) -> Figure:
    """How far K of the measured depth moves with each assumption, the largest first.

    k: what the bisection found, whose depth may be off by 1 %; the changes are those of the K that makes the depth.
    """
    figure, (axes,) = page(
        1,
        1,
        height=1.6 + 0.21 * len(variations),
        title=f"{name}: what moves the wear coefficient",
        provenance=provenance,
    )
    order = sorted(variations, key=lambda variation: -abs(variation.change))
    places, changes = np.arange(len(order)), np.array([100.0 * variation.change for variation in order])
    axes.barh(places, changes, height=0.7, color=[BLUE if change > 0.0 else ORANGE for change in changes])
    low, high = min(0.0, float(changes.min())), max(0.0, float(changes.max()))
    for place, variation in zip(places, order, strict=True):
        _in_columns(axes, float(place), f"{100.0 * variation.change:+.1f} %", number(variation.wear_coefficient))
    _in_columns(axes, -1.0, "change", "$K$")
    axes.axvline(0.0, color=BLACK, linewidth=0.7)
    axes.set_yticks(places, [variation.what for variation in order])
    axes.grid(False, axis="y")
    axes.set_xlim(1.1 * low, high + 0.36 * (high - low))
    axes.set_xticks([tick for tick in axes.get_xticks() if 1.1 * low <= tick <= high + 0.05 * (high - low)])
    axes.set_ylim(len(order) - 0.4, -1.5)
    axis_label = f"change of the $K$ that makes the {provenance} depth [%]"
    unchanged = variations[0].wear_coefficient / (1.0 + variations[0].change)
    title = f"$K$ = {number(unchanged)} where nothing is changed"
    found = f" (bisection, to 1 % of the depth: {number(k)})" if number(k) != number(unchanged) else ""
    name_axes(axes, axis_label, "", f"{title}{found}")
    return figure


def _in_columns(axes: Axes, place: float, *texts: str) -> None:
    """Two short texts of a row, each at the end of its column at the right."""
    for right, text in zip((0.895, 0.995), texts, strict=True):
        axes.text(right, place, text, transform=axes.get_yaxis_transform(), fontsize=SMALL, va="center", ha="right")


def coefficients(axes: Axes, known: Sequence[KnownK]) -> None:
    """Every K on one logarithmic axis, the one to use first and bold, with its 90 % interval."""
    for place, k in enumerate(known):
        low, high = max(k.low, k.value / 30.0), min(k.high, k.value * 30.0)
        bars = [[k.value - low], [high - k.value]] if np.isfinite(k.low) else None
        colour = BLUE if k.use else GREY if k.from_data else RED
        axes.errorbar(k.value, place, xerr=bars, color=colour, marker="o", markersize=6.0 if k.use else 4.5,
                      elinewidth=0.9, linestyle="none")  # fmt: skip
        axes.annotate(number(k.value), (k.value, place), xytext=(0, 5), textcoords="offset points",
                      fontsize=SMALL, ha="center", fontweight="bold" if k.use else "normal")  # fmt: skip
    axes.set_yticks(np.arange(len(known)), [k.name for k in known])
    for label, k in zip(axes.get_yticklabels(), known, strict=True):
        label.set_fontweight("bold" if k.use else "normal")
    axes.set_ylim(len(known) - 0.5, -0.9)
    values = [k.value for k in known]
    lowest = min(max(k.low, k.value / 30.0) if np.isfinite(k.low) else k.value for k in known)
    logarithmic(axes.xaxis, min(min(values) / 4.0, lowest / 1.2), max(values) * 4.0)
    name_axes(
        axes, "wear coefficient $K$ of $W = K E / H$ [1]", "", "every $K$, bold the one to use; bars: 90 % intervals"
    )
