"""The closed loop in one picture, a row a channel: measured and modelled, what is left over, and what was tried."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator
from numpy.typing import NDArray

from twindisc_cli.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    RED,
    SMALL,
    TEXT,
    family,
    legend,
    name_axes,
    page,
)

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

WIDE = 11.0
ROW = 2.75
LINE = 125
PARTS = (1.35, 1.0, 1.05)
BINS = 20
FEWEST = 5
"""Places in a ranking, so that two bars do not fill it."""
SHADE, BAND, REMARK = "#F1F1F1", "#E3E3E3", "#444444"
CHOSEN, HOLDS = "#8FC1E3", "#A5D8C6"


@dataclass(frozen=True)
class Trace:
    """Samples of one test, or of one recorded profile, in the units of the panels; each (sample,).

    x is the abscissa of the left panel, over that of the middle one. kept is False for outliers.
    """

    label: str
    x: Floats
    over: Floats
    measured: Floats
    before: Floats
    after: Floats
    held_out: Mask
    kept: Mask


@dataclass(frozen=True)
class Span:
    """A step of the history along x, with its creepage [%]."""

    begin: float
    end: float
    creepage: float


@dataclass(frozen=True)
class Ranked:
    """One explanation that was tried: how much of the misfit it takes away [noise units], and what came of it."""

    label: str
    gain: float
    note: str
    passed: bool
    chosen: bool


@dataclass(frozen=True)
class Row:
    """One channel: axis labels, traces, steps of the history (none where x is no time), noise, and what was tried."""

    what: str
    x: str
    y: str
    over: str
    rest: str
    noise: float
    traces: Sequence[Trace]
    spans: Sequence[Span]
    ranking: Sequence[Ranked]
    outcome: str
    x_log: bool = False
    over_log: bool = False


def figure(rows: Sequence[Row], *, title: str, provenance: str) -> Figure:
    """Draw all channels. provenance: what kind of data these are, printed on the figure."""
    drawn, panels = page(len(rows), 3, height=0.6 + ROW * len(rows), title=fill(title, LINE), provenance=provenance)
    drawn.set_figwidth(WIDE)
    grid = panels[0].get_gridspec()
    assert grid is not None
    grid.set_width_ratios(PARTS)
    for row, left, middle, right in zip(rows, panels[0::3], panels[1::3], panels[2::3], strict=True):
        _course(left, row)
        _leftover(middle, row)
        _ranking(right, row)
    return drawn


def _course(axes: Axes, row: Row) -> None:
    """Measured samples with the model before and after, over the history or across the track."""
    _history(axes, row)
    several = len(row.traces) > 1
    for trace, colour in zip(row.traces, family(len(row.traces)), strict=True):
        for chosen, what, shade in (
            (trace.kept & ~trace.held_out, "measured, fitted", colour if several else GREY),
            (trace.kept & trace.held_out, "measured, held out", PURPLE),
            (~trace.kept, "outlier", RED),
        ):
            if chosen.any():
                _dots(axes, trace.x[chosen], trace.measured[chosen], shade, what, among=len(trace.x))
        order = np.argsort(trace.x, kind="stable")
        for values, style_of, shade, width, what in (
            (trace.before, "--", ORANGE, 1.6, "model before"),
            (trace.after, "-", colour if several else BLUE, 1.1, "model after"),
        ):
            axes.plot(trace.x[order], values[order], linestyle=style_of, color=shade, linewidth=width, label=what)
        if several and trace.label:
            axes.plot([], [], color=colour, linewidth=3.0, label=trace.label)
    if row.x_log:
        _logarithmic(axes)
    name_axes(axes, row.x, row.y, f"{row.what}: measured and model")
    _distinct(axes)


def _dots(axes: Axes, x: Floats, y: Floats, colour: object, label: str, *, among: int) -> None:
    """Samples, small and pale where there are thousands, large and dark where there are a dozen."""
    crowd = 1.0 / np.sqrt(max(among, 1))
    size, opacity = float(np.clip(75.0 * crowd, 2.4, 6.0)), float(np.clip(10.0 * crowd, 0.35, 0.8))
    axes.plot(x, y, linestyle="none", marker=".", markersize=size, markeredgewidth=0.0, alpha=opacity,
              color=colour, label=label or None)  # fmt: skip


def _logarithmic(axes: Axes) -> None:
    """A logarithmic abscissa with plain numbers at 1, 2 and 5."""
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_locator(NullLocator())


def _distinct(axes: Axes) -> None:
    """A legend that names everything once."""
    handles, labels = axes.get_legend_handles_labels()
    once = dict(zip(labels, handles, strict=True))
    axes.legend(
        list(once.values()), list(once), fontsize=SMALL - 0.5, loc="best", framealpha=0.85, edgecolor="none",
        markerscale=2.5, handlelength=1.6,
    )  # fmt: skip


def _history(axes: Axes, row: Row) -> None:
    """The steps shaded in turn, their creepage on an axis of its own at the right."""
    if not row.spans:
        return
    beside = axes.twinx()
    for span in row.spans[1::2]:
        beside.axvspan(span.begin, span.end, color=SHADE, linewidth=0.0, zorder=0)
    gaps = [before.end < span.begin for before, span in pairwise(row.spans)]
    pause = np.flatnonzero(gaps) * 2 + 2
    edges = np.insert(np.array([[span.begin, span.end] for span in row.spans]).ravel(), pause, np.nan)
    levels = np.insert(np.repeat([span.creepage for span in row.spans], 2), pause, np.nan)
    beside.plot(edges, levels, color=GREEN, linewidth=0.8, alpha=0.7)
    beside.set_ylabel("creepage [%]", fontsize=TEXT, color=GREEN)
    beside.tick_params(labelsize=SMALL, length=2.0, width=0.5, colors=GREEN)
    beside.set_ylim(0.0, 1.15 * max(max(span.creepage for span in row.spans), 1e-9))
    for side in ("top", "left", "bottom"):
        beside.spines[side].set_visible(False)
    beside.spines["right"].set_color(GREEN)
    beside.set_zorder(axes.get_zorder() - 1)
    axes.patch.set_visible(False)
    axes.set_xlim(row.spans[0].begin, row.spans[-1].end)


def _leftover(axes: Axes, row: Row) -> None:
    """Measured minus model, before and after, with the band of the noise and the mean course."""
    axes.axhspan(-2.0 * row.noise, 2.0 * row.noise, color=BAND, linewidth=0.0, zorder=0, label="noise, ±2 std")
    over = np.concatenate([trace.over[trace.kept] for trace in row.traces])
    measured = np.concatenate([trace.measured[trace.kept] for trace in row.traces])
    for name, colour, width in (("before", ORANGE, 2.4), ("after", BLUE, 1.2)):
        model = np.concatenate([getattr(trace, name)[trace.kept] for trace in row.traces])
        _dots(axes, over, measured - model, colour, "", among=2 * len(over))
        axes.plot(*_mean_course(over, measured - model), color=colour, linewidth=width, label=name)
    if row.over_log:
        _logarithmic(axes)
    axes.axhline(0.0, color=BLACK, linewidth=0.5)
    name_axes(axes, row.over, row.rest, "what the model leaves")
    legend(axes)


def _mean_course(over: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Means of values (sample,) at each level of a covariate, or in bins of as many samples where it has many."""
    levels, level = np.unique(over, return_inverse=True)
    if len(levels) > BINS:
        bounds = np.quantile(over, np.linspace(0.0, 1.0, BINS + 1)[1:-1])
        level = np.searchsorted(bounds, over)
    count = np.bincount(level)
    used = count > 0
    means = [np.bincount(level, weights=array)[used] / count[used] for array in (over, values)]
    return means[0], means[1]


def _ranking(axes: Axes, row: Row) -> None:
    """How much of the misfit each explanation takes away, and why it was refused."""
    axes.set_yticks([])
    axes.spines["left"].set_visible(False)
    if not row.ranking:
        axes.set_axis_off()
        axes.text(0.5, 0.5, row.outcome, transform=axes.transAxes, ha="center", va="center", fontsize=TEXT)
        return
    places = [float(place) for place in range(len(row.ranking))]
    colours = [CHOSEN if r.chosen else HOLDS if r.passed else BAND for r in row.ranking]
    axes.barh(places, [r.gain for r in row.ranking], color=colours, height=0.78)
    longest = max(max(r.gain for r in row.ranking), 1e-9)
    for place, ranked in zip(places, row.ranking, strict=True):
        weight = "bold" if ranked.chosen else "normal"
        size = SMALL - 1.5 * ranked.label.count("\n")
        axes.text(0.012 * longest, place, ranked.label, va="center", fontsize=size, fontweight=weight, linespacing=0.95)
        axes.text(1.42 * longest, place, ranked.note, va="center", ha="right", fontsize=SMALL - 0.5, color=REMARK)
    axes.set_xlim(0.0, 1.42 * longest)
    axes.set_ylim(max(len(row.ranking), FEWEST) - 0.4, -0.6)
    name_axes(axes, "misfit taken away [noise units]", "", row.outcome)
