"""Figures of wear: history and profiles (Figs. 8, 12), and the K found from a profile (Figs. 9, 11, 14)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from twindisc_cli.figures.mass import volume, wear_rate
from twindisc_cli.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    RED,
    SMALL,
    TEXT,
    family,
    legend,
    legend_below,
    name_axes,
    page,
)

if TYPE_CHECKING:
    from twindisc_cli.identify.mass import MassFit
    from twindisc_cli.identify.regimes import Regime
    from twindisc_cli.identify.wear import WearFit
    from twindisc_cli.identify.wear_history import WearHistory

ACROSS, HEIGHT = "$y$ [mm]", "height change [µm]"
_PROFILES = 7


def worn(history: WearHistory, *, name: str, provenance: str, measured: tuple[np.ndarray, np.ndarray] | None) -> Figure:
    """Creepage and mu of each iteration, profiles on the way, depth, width and patch; measured (y, height) [m]."""
    figure, (top, profiles, size, patch) = page(2, 2, height=6.0, title=f"{name}: wear", provenance=provenance)
    _loading(top, history)
    order = np.unique(np.linspace(0, len(history.time) - 1, _PROFILES).round().astype(int))
    for i, colour in zip(order, family(len(order)), strict=True):
        profiles.plot(
            history.y * 1e3, history.height[i] * 1e6, color=colour, linewidth=1.0, label=f"{history.time[i]:.0f} s"
        )
    if measured is not None:
        profiles.plot(
            measured[0] * 1e3, measured[1] * 1e6, color=RED, linestyle="--", linewidth=1.1, label=f"{provenance}, end"
        )
    name_axes(profiles, ACROSS, HEIGHT, "profile of disc 2")
    _around_the_track(profiles, history.y, history.height[-1], measured)
    legend_below(profiles, 4)
    size.plot(history.time, [t.depth * 1e6 for t in history.track], color=BLUE, label="depth [µm]")
    size.plot(history.time, [t.width * 1e3 for t in history.track], color=ORANGE, label="width at 5 % depth [mm]")
    name_axes(size, "time [s]", "depth [µm], width [mm]", "depth and width")
    patch.plot(history.time, history.a * 1e3, color=GREEN, label="$a$, along rolling [mm]")
    patch.plot(history.time, history.b * 1e3, color=BLUE, label="$b$, across [mm]")
    patch.plot(history.time, history.p0 * 1e-9, color=RED, label="$p_0$ [GPa]")
    name_axes(patch, "time [s]", "$a$, $b$ [mm], $p_0$ [GPa]", "contact patch")
    for axes in (size, patch):
        axes.set_xlim(0.0, float(history.time[-1]))
        axes.set_ylim(0.0, None)
        legend_below(axes, 3)
    return figure


def _loading(axes: Axes, history: WearHistory) -> None:
    """Creepage as bars and mu as a line over the iterations (Fig. 8)."""
    order = np.arange(1, len(history.time) + 1)
    axes.bar(order, history.creepage * 100.0, width=0.9, color="#BBD7EA")
    name_axes(axes, "iteration", "creepage [%]", "loading history")
    other = axes.twinx()
    other.plot(order, history.mu, color=RED, marker=".", markersize=2.5, linewidth=0.8)
    other.set_ylim(0.0, 1.15 * float(np.nanmax(history.mu)))
    other.set_ylabel("$\\mu$ [1]", fontsize=TEXT, color=RED)
    other.tick_params(labelsize=SMALL + 0.5, length=2.5, width=0.6, colors=RED)
    for side in ("top", "left", "bottom"):
        other.spines[side].set_visible(False)
    other.spines["right"].set(linewidth=0.6, color=RED)


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
    stated: dict[str, float],
    weighed: tuple[MassFit, Sequence[Regime]] | None,
    name: str,
    provenance: str,
) -> Figure:
    """Measured and simulated profile, what is left, the bisection, and every K there is; stated K by what it is.

    Of weighed discs a row more: the volume over the energy, and the wear rate with its regimes.
    """
    rows = 3 if weighed else 2
    title = f"{name}: wear coefficient"
    figure, panels = page(rows, 2, height=2.8 * rows, title=title, provenance=provenance)
    profile, left, trail, all_k = panels[:4]
    if weighed:
        volume(panels[4], weighed[0], provenance=provenance)
        wear_rate(panels[5], *weighed)
        stated = {f"by weight, disc {disc}": k for disc, k in weighed[0].of_disc.items()} | stated
    y = fit.y * 1e3
    profile.plot(y, fit.height * 1e6, color=BLACK, linewidth=1.0, label=provenance)
    profile.plot(y, fit.simulated_height * 1e6, color=BLUE, linewidth=1.3, label=f"simulated, {fit.method}")
    if fit.method != "least squares":
        profile.plot(y, fit.squares_height * 1e6, color=ORANGE, linewidth=1.0, linestyle="--", label="least squares")
    name_axes(profile, ACROSS, HEIGHT, "profile of the worn disc")
    left.axhline(0.0, color=GREY, linewidth=0.6)
    left.plot(y, (fit.height - fit.simulated_height) * 1e6, color=BLUE, linewidth=1.0)
    name_axes(left, ACROSS, "measured - simulated [µm]", "what the simulation misses")
    for axes in (profile, left):
        _around_the_track(axes, fit.y, fit.simulated_height, (fit.y, fit.height))
    legend_below(profile, 3)
    k, error = np.array(fit.bisection.trail).T
    trail.plot(np.arange(1, len(k) + 1), error, color=BLUE, marker="o", markersize=3.5)
    trail.axhspan(-1.0, 1.0, color=GREEN, alpha=0.25, linewidth=0.0, label="|$E_r$| < 1 %")
    shown = np.arange(0, len(k), int(np.ceil(len(k) / 6)))
    trail.set_xticks(shown + 1, [f"{i + 1}\n{k[i]:.2e}" for i in shown], fontsize=SMALL - 0.5)
    trail.margins(y=0.12)
    name_axes(trail, "bisection, and its $K$", "$E_r$ [%]", "depth error of each $K$")
    legend(trail, "lower right")
    _coefficients(all_k, fit, stated)
    return figure


def _coefficients(axes: Axes, fit: WearFit, stated: dict[str, float]) -> None:
    """Every K on one logarithmic axis: found, allowed by volume and energy, and stated elsewhere."""
    squares = fit.least_squares
    rows = {
        "bisection on depth": (fit.bisection.wear_coefficient, 0.0, BLUE),
        "least squares": (squares.value, squares.std, BLUE),
        "$W H / E$ of the profile": (fit.allowed, 0.0, GREEN),
        **{what: (value, 0.0, RED) for what, value in stated.items()},
    }
    for place, (value, std, colour) in enumerate(rows.values()):
        axes.errorbar(value, place, xerr=std or None, color=colour, marker="o", markersize=4.5, elinewidth=0.9)
        axes.annotate(
            f"{value:.2e}", (value, place), xytext=(0, 5), textcoords="offset points", fontsize=SMALL, ha="center"
        )
    axes.set_yticks(np.arange(len(rows)), list(rows))
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.set_xscale("log")
    axes.xaxis.set_minor_formatter(NullFormatter())
    values = [value for value, _, _ in rows.values()]
    axes.set_xlim(min(values) / 3.0, max(values) * 3.0)
    name_axes(axes, "wear coefficient $K$ [1]", "", "what each says")
