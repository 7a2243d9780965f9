"""Figures over a campaign: friction with its repeats, wear with its regimes, effects found, maps of what was varied."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from twindisc_cli.campaign.groups import points_of
from twindisc_cli.campaign.outcome import RATE, Outcome
from twindisc_cli.figures.mass import ENERGY, around, regime_lines, regimes_text
from twindisc_cli.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    RED,
    family,
    is_wide,
    legend,
    legend_below,
    logarithmic,
    name_axes,
    page,
)
from twindisc_cli.identify.least_squares import NINETY
from twindisc_cli.quantities import for_reading, split_key

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from twindisc_cli.campaign.groups import Effect, Group, Points
    from twindisc_cli.campaign.shared import Common
    from twindisc_cli.campaign.table import Table
    from twindisc_cli.identify.regimes import Regime
    from twindisc_cli.loop.members import SharedParameter
    from twindisc_cli.model.experiment import Floats

COLOURS = (BLUE, ORANGE, GREEN, PURPLE, RED, BLACK)
MOST_NAMED = 8
"""Lines of a map that are named one by one."""
MOST_PARAMETERS = 3
"""Parameters of groups that are drawn."""
_RESULTS = {
    "simulate-wear": ("depth [um]", "width [mm]", RATE),
    "fit-k": ("K [1]", "depth [um]", "width [mm]"),
    "thermal": ("rise [K]", "flash [K]"),
    "contact": ("exact T over N [1]", "exact stick fraction [1]", "exact p0 [MPa]"),
}
"""What a map of each command shows."""


def friction(table: Table, points: Points, groups: Sequence[Group], *, title: str, provenance: str) -> Figure:
    """mu over creepage of every test; of a group its mean, and the band in which 90 % of such tests lie."""
    figure, (axes,) = page(1, 1, height=3.9, title=title, provenance=provenance)
    names = _names(table)
    pooled = {group.name: group for group in groups if group.curve is not None}
    tests = np.array(table.texts("test"))[points.row]
    group_of = np.array(names)[points.row]
    for place, name in enumerate(dict.fromkeys(names)):
        colour = COLOURS[place % len(COLOURS)] if name else GREY
        out = np.isin(tests, [test for group in groups if group.name == name for test in group.outliers])
        _points(axes, points, (group_of == name) & ~out, "o", colour, name or "tests of no group")
        _points(
            axes,
            points,
            (group_of == name) & out,
            "x",
            colour,
            f"not one of them: {', '.join(sorted(set(tests[out])))}",
        )
        curve = pooled[name].curve if name in pooled else None
        if curve is not None:
            axes.plot(curve.creepage, curve.mu, color=colour, linewidth=1.2)
            axes.fill_between(curve.creepage, curve.low, curve.high, color=colour, alpha=0.15, linewidth=0.0)
    bands = "bands: 90 % of such tests" if pooled else ""
    name_axes(axes, "creepage $\\upsilon_x$ [%]", "coefficient of friction $\\mu$ [1]", bands)
    creepage = points.creepage[np.isfinite(points.creepage)]
    if is_wide(creepage):
        logarithmic(axes.xaxis, *around(creepage))
    axes.set_ylim(0.0, None)
    legend(axes, 4)
    return figure


def _names(table: Table) -> list[str]:
    """What points are named by: their group, or without groups the test, where there are colours enough."""
    groups = table.texts("group")
    return groups if any(groups) or table.rows > len(COLOURS) else table.texts("test")


def _points(axes: Axes, points: Points, inside: np.ndarray, style: str, colour: str, label: str) -> None:
    if not np.any(inside):
        return
    mu = points.mu[inside]
    bars = np.nan_to_num(np.maximum([mu - points.low[inside], points.high[inside] - mu], 0.0), posinf=0.0)
    axes.errorbar(points.creepage[inside], mu, yerr=bars, linestyle="none", marker=style, markersize=4.0, color=colour,
                  elinewidth=0.6, markerfacecolor="white", label=label)  # fmt: skip


def wear(table: Table, k: Sequence[Regime], rate: Sequence[Regime], *, title: str, provenance: str) -> Figure:
    """K and the wear rate over T gamma / A, with the regimes that the data show."""
    figure, (left, right) = page(1, 2, height=3.5, title=title, provenance=provenance)
    x = table.numbers("T gamma / A [N/mm2]")
    column = "K [1]" if np.any(table.numbers("K [1]") > 0.0) else "wear coefficient [1]"
    panels = (
        (left, table.numbers(column), table.numbers("K std [1]"), k, "wear coefficient $K$ [1]"),
        (right, table.numbers("wear rate [um/km]"), np.full(table.rows, np.nan), rate, "wear rate [µm/km]"),
    )
    names = _names(table)
    for axes, y, std, result, label in panels:
        for place, name in enumerate(dict.fromkeys(names)):
            inside = np.array([other == name for other in names])
            colour = COLOURS[place % len(COLOURS)] if name else GREY
            axes.errorbar(x[inside], y[inside], yerr=np.nan_to_num(std[inside]), linestyle="none", marker="o",
                          markersize=4.5, elinewidth=0.8, markerfacecolor="white", color=colour,
                          label=name or "tests of no group")  # fmt: skip
        shown = (x > 0.0) & (y > 0.0)
        regime_lines(axes, result, points=int(np.sum(shown)))
        if np.any(shown):
            logarithmic(axes.xaxis, *around(x[shown]))
            low = np.maximum(y - np.nan_to_num(std), 0.3 * y)
            logarithmic(axes.yaxis, *around(np.concatenate([low[shown], (y + np.nan_to_num(std))[shown]])))
        bars = "; bars: ± σ" if np.any(std > 0.0) else ""
        name_axes(axes, ENERGY, label, regimes_text(result, points=int(np.sum(shown))) + bars)
        legend(axes, 3)
    return figure


def effects(result: Sequence[Effect], shared: Sequence[Common], *, title: str, provenance: str) -> Figure:
    """The effects found over the tests, how probable in each; of a group, each parameter of what it shares."""
    panels = [(common, term, key) for common in shared for term in common.found.shared for key in term.parameters]
    panels = panels[:MOST_PARAMETERS]
    rows = max([len(result), *(len(common.found.tests) for common, _, _ in panels), 1])
    figure, (axes, *further) = page(1, 1 + len(panels), height=1.6 + 0.3 * rows, title=title, provenance=provenance)
    name_axes(axes, "probability in a test [1]", "", "" if result else "no effect was found in any test")
    labels = []
    for place, effect in enumerate(result):
        axes.plot(effect.probability, np.full(len(effect.probability), place), linestyle="none", marker="o",
                  markersize=4.5, color=BLUE, alpha=0.6)  # fmt: skip
        group = f"{effect.group}: " if effect.group else ""
        labels.append(f"{group}{effect.name.replace('_', ' ')}, {len(effect.tests)} of {effect.of}")
    axes.set_yticks(range(len(labels)), labels)
    axes.set_xlim(-0.02, 1.02)
    axes.set_ylim(max(len(labels), 1) - 0.5, -0.5)
    shown = None
    for panel, (common, term, key) in zip(further, panels, strict=True):
        name_axes(panel, f"{term.name.replace('_', ' ')}:\n{labelled(key, term.parameters[key].unit)}", "")
        _parameter(panel, term.acts, term.parameters[key])
        named = common.found.tests if common is not shown else [""] * len(common.found.tests)
        panel.set_yticks(range(len(named)), named)
        panel.set_ylim(len(named) - 0.5, -0.5)
        shown = common
    return figure


def labelled(key: str, unit: str) -> str:
    """`decay [s m⁻¹]` of decay_s_m."""
    return f"{split_key(key)[0].replace('_', ' ')} [{for_reading(unit) or '1'}]"


def _parameter(axes: Axes, places: Sequence[int], shared: SharedParameter) -> None:
    """A parameter in each test that has it, with its 90 % interval, and its mean over them."""
    axes.errorbar(shared.value, places, xerr=NINETY * shared.std, linestyle="none", marker="o", markersize=3.5,
                  markerfacecolor="white", elinewidth=0.7, color=BLUE)  # fmt: skip
    if np.isfinite(shared.low):
        axes.axvspan(shared.low, shared.high, color=GREY, alpha=0.3, linewidth=0.0)
    axes.axvline(shared.mean, color=BLACK, linewidth=0.8)
    low, high = np.min(shared.value), np.max(shared.value)
    typical = NINETY * float(np.median(np.nan_to_num(shared.std, posinf=0.0)))
    room = max(high - low, typical, 1e-9 * abs(high)) or 1.0
    axes.set_xlim(low - room, high + room)


def map_of(table: Table, varied: Sequence[str], results: Sequence[str], *, title: str, provenance: str) -> Figure:
    """Results over the first key that was varied; a line for each combination of the others."""
    lines = f"; lines: {', '.join(_last(name) for name in varied[1:])}" if varied[1:] else ""
    x = table.numbers(varied[0])
    others = list(zip(*(table.texts(name) for name in varied[1:]), strict=True)) if varied[1:] else [()] * table.rows
    kinds = list(dict.fromkeys(others))
    figure, panels = page(1, len(results), height=3.6, title=f"{title}{lines}", provenance=provenance)
    for axes, name in zip(panels, results, strict=True):
        y: Floats = table.numbers(name)
        for kind, colour in zip(kinds, family(len(kinds)), strict=True):
            inside = np.flatnonzero([other == kind for other in others] & np.isfinite(y))
            if not len(inside):
                continue
            inside = inside[np.argsort(x[inside])]
            axes.plot(x[inside], y[inside], marker="o", markersize=3.0, linewidth=1.0, color=colour,
                      label=", ".join(map(_value, kind)))  # fmt: skip
        name_axes(axes, _last(varied[0]), name.replace("[um", "[µm"))
    if varied[1:] and len(kinds) <= MOST_NAMED:
        legend_below(figure, panels)
    return figure


def _value(text: str) -> str:
    """What a test was varied to; a variation that leaves a key alone has the base's value."""
    return text if text not in ("", "nan") else "base"


def _last(name: str) -> str:
    """`normal load [N]` of `rig.normal load [N]`."""
    return name.rpartition(".")[2]


def figure_of(
    command: str, table: Table, outcome: Outcome, shared: Sequence[Common], provenance: str
) -> Callable[[], Figure] | None:
    """The figure of a campaign, drawn when called; None where there is nothing to draw."""
    title, points = f"{table.rows} tests: {command}", points_of(table)
    varied = [name for name in table.columns if name.partition(".")[2] and len(set(table.texts(name))) > 1]
    shown = [name for name in _RESULTS.get(command, ()) if np.any(np.isfinite(table.numbers(name)))]
    if len(points.mu):
        return lambda: friction(table, points, outcome.groups, title=title, provenance=provenance)
    if varied and shown:
        return lambda: map_of(table, varied, shown, title=title, provenance=provenance)
    if outcome.rate:
        return lambda: wear(table, outcome.k, outcome.rate, title=title, provenance=provenance)
    if command == "close-loop":
        return lambda: effects(outcome.effects, shared, title=title, provenance=provenance)
    return None
