"""The figure of wear by weight: volume over energy, and the wear rate over T gamma / A as railways plot it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from twindisc_cli.figures.style import BLACK, BLUE, GREY, ORANGE, legend, logarithmic, measured_points, name_axes, page
from twindisc_cli.identify.least_squares import NINETY
from twindisc_cli.identify.regimes import FEWEST

if TYPE_CHECKING:
    from twindisc_cli.identify.mass import MassFit
    from twindisc_cli.identify.regimes import Regime
    from twindisc_cli.model.experiment import Floats

ENERGY = "$T\\gamma/A$ [N/mm²]"
DISCS = {1: ORANGE, 2: BLUE}


def weighed(fit: MassFit, regimes: Sequence[Regime], *, name: str, provenance: str) -> Figure:
    """Volume as weighed and at K over the dissipated energy, and the wear rate of each disc."""
    figure, (left, right) = page(1, 2, height=3.4, title=f"{name}: wear by weight", provenance=provenance)
    volume(left, fit, provenance=provenance)
    wear_rate(right, fit, regimes)
    return figure


def volume(axes: Axes, fit: MassFit, *, provenance: str) -> None:
    """Volume as weighed and at K, over the dissipated energy."""
    half = NINETY * fit.error * 1e9
    measured_points(axes, fit.energy * 1e-3, fit.volume * 1e9, half, label=f"{provenance}, 90 % interval")
    misses = "" if fit.is_one_k else ", does not describe all"
    axes.plot(np.insert(fit.energy * 1e-3, 0, 0.0), np.insert(fit.predicted * 1e9, 0, 0.0), color=BLUE, marker=".",
              label=f"$K$ = {fit.wear_coefficient:.3g}{misses}")  # fmt: skip
    axes.set_xlim(0.0, None)
    axes.set_ylim(0.0, None)
    legend(axes, 2)
    name_axes(axes, "dissipated energy [kJ]", "worn volume [mm³]", "weighed volume")


def wear_rate(axes: Axes, fit: MassFit, regimes: Sequence[Regime]) -> None:
    """The wear rate from weighing to weighing, with the regimes that the data show."""
    rates = fit.rates
    for disc in np.unique(rates.disc):
        mine = (rates.disc == disc) & (rates.rate > 0.0)
        half = NINETY * rates.error[mine] * 1e3
        axes.errorbar(rates.index[mine] * 1e-6, rates.rate[mine] * 1e3, yerr=np.nan_to_num(half), linestyle="none",
                      marker="o", markersize=4.0, markerfacecolor="white", color=DISCS[int(disc)],
                      label=f"disc {disc}")  # fmt: skip
    shown = rates.rate > 0.0
    regime_lines(axes, regimes, points=int(np.sum(shown)))
    if np.any(shown):
        logarithmic(axes.xaxis, *around(rates.index[shown] * 1e-6))
        logarithmic(axes.yaxis, *around(rates.rate[shown] * 1e3))
    name_axes(axes, ENERGY, "wear rate [µg/m/mm²]", regimes_text(regimes, points=int(np.sum(shown))))
    legend(axes, 3)


def around(values: Floats) -> tuple[float, float]:
    """Limits of a logarithmic axis, a little outside of positive values."""
    return float(np.min(values)) / 1.15, float(np.max(values)) * 1.15


def regimes_text(regimes: Sequence[Regime], *, points: int) -> str:
    """How many regimes the points show, or that they are too few to show any."""
    if points < 2 * FEWEST:
        return f"{points} points, too few to show a break"
    return f"{len(regimes)} regimes" if len(regimes) > 1 else "one regime: no break shown"


def regime_lines(axes: Axes, regimes: Sequence[Regime], *, points: int) -> None:
    """The line of each regime that has points enough, and the probability by chance of each break."""
    for regime in regimes if points >= FEWEST else ():
        ends = np.array([regime.low, regime.high])
        axes.plot(np.exp(ends), np.exp(regime.intercept + regime.slope * ends), color=BLACK, linewidth=1.0)
        if np.isfinite(regime.p_value):
            axes.axvline(np.exp(regime.low), color=GREY, linewidth=0.8, linestyle=":",
                         label=f"break, p = {regime.p_value:.2g}")  # fmt: skip
