"""The closed loop in one picture, a row a channel: measured and modelled, what is left over, and what was tried."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

from twindisc_cli.figures._loop_view import View, samples_over, views_of
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
from twindisc_cli.loop.channels import channels
from twindisc_cli.loop.diagnosis import Diagnosis, FoundLaw, Tried
from twindisc_cli.loop.thresholds import THRESHOLDS
from twindisc_cli.model.experiment import Experiment, Floats
from twindisc_cli.report import told
from twindisc_cli.report.words import p_value, percent, plain_name, unit

WIDE = 11.0
ROW = 2.75
LINE = 125
COLUMNS = 3
PARTS = (1.35, 1.0, 1.05)
BINS = 20
FEWEST = 5
"""Places in a ranking, so that two bars do not fill it."""
SHOWN, LONGEST, TITLE = 9, 44, 60
ROOM = 1.42
"""Width of a ranking over its longest bar, so that the remarks find room."""
SHADE, BAND, REMARK = "#F1F1F1", "#E3E3E3", "#444444"
CHOSEN, HOLDS = "#8FC1E3", "#A5D8C6"


def figure(diagnosis: Diagnosis, tests: Sequence[Experiment], *, title: str, provenance: str) -> Figure:
    """Draw all channels and the laws that were learnt. provenance: of the data, printed on the figure."""
    views, laws = views_of(diagnosis, tests), diagnosis.laws
    rows = len(views) + -(-len(laws) // COLUMNS)
    drawn, panels = page(rows, COLUMNS, height=0.6 + ROW * rows, title=fill(title, LINE), provenance=provenance)
    drawn.set_figwidth(WIDE)
    grid = panels[0].get_gridspec()
    assert grid is not None
    grid.set_width_ratios(PARTS)
    for number, view in enumerate(views):
        left, middle, right = panels[COLUMNS * number : COLUMNS * (number + 1)]
        _course(left, view)
        _leftover(middle, view)
        _ranking(right, view)
    below = panels[COLUMNS * len(views) :]
    for axes, found in zip(below, laws, strict=False):
        _law(axes, found, diagnosis)
    for axes in below[len(laws) :]:
        axes.remove()
    return drawn


def _course(axes: Axes, view: View) -> None:
    """Measured samples with the model before and after, over the history or across the track."""
    _history(axes, view)
    several = len(view.traces) > 1
    for trace, colour in zip(view.traces, family(len(view.traces)), strict=True):
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
    if view.is_wide(view.along):
        _logarithmic(axes)
    name_axes(axes, view.scale(view.along).label, view.drawn.label, f"{view.channel}: measured and model")
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


def _history(axes: Axes, view: View) -> None:
    """The steps shaded in turn, their creepage on an axis of its own at the right."""
    if not view.spans:
        return
    beside = axes.twinx()
    for span in view.spans[1::2]:
        beside.axvspan(span.begin, span.end, color=SHADE, linewidth=0.0, zorder=0)
    gaps = [before.end < span.begin for before, span in pairwise(view.spans)]
    pause = np.flatnonzero(gaps) * 2 + 2
    edges = np.insert(np.array([[span.begin, span.end] for span in view.spans]).ravel(), pause, np.nan)
    levels = np.insert(np.repeat([span.creepage for span in view.spans], 2), pause, np.nan)
    beside.plot(edges, levels, color=GREEN, linewidth=0.8, alpha=0.7)
    beside.set_ylabel("creepage [%]", fontsize=TEXT, color=GREEN)
    beside.tick_params(labelsize=SMALL, length=2.0, width=0.5, colors=GREEN)
    least, most = (reach(span.creepage for span in view.spans) for reach in (min, max))
    beside.set_ylim(1.15 * min(least, 0.0), 1.15 * max(most, 1e-9))
    for side in ("top", "left", "bottom"):
        beside.spines[side].set_visible(False)
    beside.spines["right"].set_color(GREEN)
    beside.set_zorder(axes.get_zorder() - 1)
    axes.patch.set_visible(False)
    axes.set_xlim(view.spans[0].begin, view.spans[-1].end)


def _leftover(axes: Axes, view: View) -> None:
    """Measured minus model, before and after, with the band of the noise and the mean course."""
    axes.axhspan(-2.0 * view.noise, 2.0 * view.noise, color=BAND, linewidth=0.0, zorder=0, label="noise, ±2 std")
    over = np.concatenate([trace.over[trace.kept] for trace in view.traces])
    measured = np.concatenate([trace.measured[trace.kept] for trace in view.traces])
    for name, colour, width in (("before", ORANGE, 2.4), ("after", BLUE, 1.2)):
        model = np.concatenate([getattr(trace, name)[trace.kept] for trace in view.traces])
        _dots(axes, over, measured - model, colour, "", among=2 * len(over))
        axes.plot(*_mean_course(over, measured - model), color=colour, linewidth=width, label=name)
    if view.is_wide(view.over):
        _logarithmic(axes)
    axes.axhline(0.0, color=BLACK, linewidth=0.5)
    name_axes(axes, view.scale(view.over).label, channels()[view.channel].rest, "what the model leaves")
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


def _ranking(axes: Axes, view: View) -> None:
    """How much of the misfit each explanation takes away, and why it was refused."""
    ranked = told.ranked(view.diagnosis, view.channel)[:SHOWN]
    title = _outcome(view.diagnosis, view.channel)
    axes.set_yticks([])
    axes.spines["left"].set_visible(False)
    if not ranked:
        axes.set_axis_off()
        axes.text(0.5, 0.5, title, transform=axes.transAxes, ha="center", va="center", fontsize=TEXT)
        return
    gains = [told.length(tried.gain) for tried in ranked]
    colours = [CHOSEN if t.chosen else BAND if t.refused else HOLDS for t in ranked]
    axes.barh(range(len(ranked)), gains, color=colours, height=0.78)
    longest = max(*gains, 1e-9)
    for place, tried in enumerate(ranked):
        label = fill(plain_name(tried.label), LONGEST)
        weight = "bold" if tried.chosen else "normal"
        size = SMALL - 1.5 * min(label.count("\n"), 1)
        axes.text(0.012 * longest, place, label, va="center", fontsize=size, fontweight=weight, linespacing=0.95)
        axes.text(ROOM * longest, place, _remark(tried), va="center", ha="right", fontsize=SMALL - 0.5, color=REMARK)
    axes.set_xlim(0.0, ROOM * longest)
    axes.set_ylim(max(len(ranked), FEWEST) - 0.4, -0.6)
    name_axes(axes, "misfit taken away [noise units]", "", title)


def _remark(tried: Tried) -> str:
    """What came of an explanation, in a word."""
    if tried.refused:
        return "at a bound" if tried.at_bound else tried.refused.partition(" of ")[0]
    return percent(tried.probability)


def _outcome(diagnosis: Diagnosis, channel: str) -> str:
    """What came of the search in this channel, as the title of its panel."""
    if channel in told.together(diagnosis):
        return "what was tried: explained"
    if channel in [left.channel for left in diagnosis.unexplained]:
        return "what was tried: unexplained"
    p = diagnosis.p_values.get(channel, float("nan"))
    if not np.isfinite(p):
        return "not searched"
    if diagnosis.effects or diagnosis.laws:
        return "nothing else is missing here"
    return f"nothing is missing here\n({p_value(p)}; alarm below {THRESHOLDS.alarm:g})"


def _law(axes: Axes, found: FoundLaw, diagnosis: Diagnosis) -> None:
    """A law that was learnt: its curve with the 90 % band, its formula, and where data were."""
    law, curve = found.law, found.curve
    axes.fill_between(curve.at, curve.low, curve.high, color=BLUE, alpha=0.2, linewidth=0.0, label="90 %")
    axes.plot(curve.at, curve.value, color=BLUE, linewidth=1.4, label="learnt")
    if law.shape is None:
        axes.plot(law.at, law.value, linestyle="none", marker="o", markersize=2.5, color=BLUE)
    one = 1.0 if law.of.kind == "factor" else 0.0
    axes.axhline(one, color=BLACK, linewidth=0.5)
    data = samples_over(diagnosis, found)
    if len(data):
        axes.plot(data, np.full(len(data), 0.015), linestyle="none", marker="|", markersize=5.0, markeredgewidth=0.4,
                  color=GREY, alpha=0.6, transform=axes.get_xaxis_transform(), label="data")  # fmt: skip
    low, high = axes.get_ylim()
    axes.set_ylim(low - 0.08 * (high - low), high + 0.12 * (high - low))
    across = f"{law.over.label} {law.over.symbol} [{unit(law.over.unit) or '1'}]"
    what = f"{'factor on' if one else 'shift of'} {law.of.label} [{unit(law.of.unit) or '1'}]"
    name_axes(axes, across, fill(what, 34), fill(f"{found.formula} ({told.sureness(found)})", TITLE))
    legend(axes)
