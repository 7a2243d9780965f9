"""The closed loop in one picture, a row a channel: measured and modelled, what is left over, and what was tried."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import GridSpec, SubplotSpec
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from twindisc_cli.figures._loop_view import View, samples_over, views_of
from twindisc_cli.figures.style import (
    BLACK,
    BLUE,
    FEW,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    RED,
    SMALL,
    caption,
    dress,
    family,
    legend,
    logarithmic,
    name_axes,
    sheet,
)
from twindisc_cli.laws.law import Law
from twindisc_cli.laws.shapes import SHAPES
from twindisc_cli.loop.channels import channels
from twindisc_cli.loop.diagnosis import CandidateResult, Diagnosis, FoundLaw, LawCurve
from twindisc_cli.loop.thresholds import ACCEPTANCE
from twindisc_cli.model.experiment import Experiment, Floats
from twindisc_cli.report import sentences
from twindisc_cli.report.words import p_value, percent, unit

PANEL, STRIP, BAR, AXIS = 2.35, 0.62, 0.19, 0.72
"""Height of a row of panels, of the steps above one, of a bar of a ranking, and of what is around the bars [inch]."""
COLUMNS = 2  # of panels: the width of a page
BINS, MOST_BINS = 20, 60
"""Bins of the mean of what the model leaves; across the track a fifth of the samples, and at most so many."""
SHOWN, LONGEST, TITLE = 8, 66, 44
LEFT, RIGHT = 1.35, 1.45
"""Room of a ranking left of its bars for their names, and from their foot to the remarks, over the longest bar."""
SHADE, BAND, REMARK = "#F1F1F1", "#E3E3E3", "#444444"
BARS = (("#8FC1E3", "added to the model"), ("#A5D8C6", "not excluded in its place"), (BAND, "not given, and why"))
"""Colours of what was tried, and what came of it."""
JUMPING = ("step", "window")
"""Formulas whose parameters are the places where they jump."""


def figure(
    diagnosis: Diagnosis,
    tests: Sequence[Experiment],
    *,
    title: str,
    provenance: str,
    verdict: str = "",
    channel: str = "",
    short: bool = False,
) -> Figure:
    """Draw all channels, or one, and the laws that were learnt, the verdict below.

    provenance: of the data, printed on it. short: the samples and what the model leaves alone.
    """
    views = [view for view in views_of(diagnosis, tests) if channel in ("", view.channel)]
    laws = [] if short else [law for law in diagnosis.laws if channel in ("", law.channel)]
    rows = [row for number, view in enumerate(views) for row in _rows(number, view)]
    rows = [row for row in rows if not (short and row[0] == "tried")]
    steps = [row for row in rows if row[0] == "steps"]
    rows = [row for row in rows if row not in steps[1:]]
    rows += [("law", number, PANEL) for number in range(0, len(laws), COLUMNS)]
    heights = [height for _, _, height in rows]
    drawn = sheet(height=0.45 + sum(heights) + 0.16 * (1 + len(verdict) // 120), title=title, provenance=provenance)
    caption(drawn, verdict)
    grid = drawn.add_gridspec(len(rows), COLUMNS, height_ratios=heights)
    panels = {place: drawn.add_subplot(where) for place, where in _places(rows, grid, len(laws))}
    dress([axes for (kind, _, _), axes in panels.items() if kind != "steps"])
    for (kind, number, column), axes in panels.items():
        if kind == "law":
            _law(axes, laws[number + column], diagnosis, TITLE if len(laws) > number + 1 else COLUMNS * TITLE)
        else:
            DRAW[kind, column](axes, views[number])
        if kind == "steps":
            axes.sharex(panels["course", number, 0])
    return drawn


def _rows(number: int, view: View) -> list[tuple[str, int, float]]:
    """The rows of a channel: its steps where they change over time, its course, what was tried; with their heights."""
    ranked = len(_ranked(view))
    steps = [("steps", number, STRIP)] if _levels(view) > 1 else []
    tried = [("tried", number, AXIS + BAR * ranked)] if ranked else []
    return [*steps, ("course", number, PANEL), *tried]


def _places(
    rows: Sequence[tuple[str, int, float]], grid: GridSpec, laws: int
) -> Iterator[tuple[tuple[str, int, int], SubplotSpec]]:
    """Every panel, by what it shows, of which channel or law, in which column; and where it stands."""
    for row, (kind, number, _) in enumerate(rows):
        if kind == "tried":
            yield (kind, number, 0), grid[row, :]
        elif kind == "steps":
            yield (kind, number, 0), grid[row, 0]
        else:
            columns = COLUMNS if kind == "course" else min(COLUMNS, laws - number)
            for column in range(columns):
                yield (kind, number, column), grid[row, column if columns > 1 else slice(None)]


def _levels(view: View) -> int:
    """How many creepages the steps drawn over time have."""
    return len({round(span.creepage, 9) for span in view.spans})


def _course(axes: Axes, view: View) -> None:
    """Measured samples with the model before and after, over the history or across the track."""
    for span in view.spans[1::2]:
        axes.axvspan(span.begin, span.end, color=SHADE, linewidth=0.0, zorder=0)
    several = len(view.traces) > 1
    fitted, held_out = f"{view.kind}, fitted", f"{view.kind}, held out"
    for trace, colour in zip(view.traces, family(len(view.traces)), strict=True):
        for chosen, what, shade in (
            (trace.kept & ~trace.held_out, fitted, colour if several else GREY),
            (trace.kept & trace.held_out, held_out, colour if several else PURPLE),
            (~trace.kept, "outlier", RED),
        ):
            crosses = several and what == held_out
            if chosen.any():
                x, y = trace.x[chosen], trace.measured[chosen]
                _dots(axes, x, y, shade, what, among=len(trace.x), crosses=crosses)
        order = np.argsort(trace.x, kind="stable")
        for values, style_of, shade, width, what in (
            (trace.before, "--", ORANGE, 1.6, "model before"),
            (trace.after, "-", colour if several else BLUE, 1.1, "model after"),
        ):
            x, y = view.broken(trace.x[order], values[order])
            axes.plot(x, y, linestyle=style_of, color=shade, linewidth=width, label=what)
        if several and trace.label:
            axes.plot([], [], color=colour, linewidth=3.0, label=trace.label)
    if view.is_wide(view.along):
        _wide(axes, np.concatenate([trace.x for trace in view.traces]))
    if view.spans:
        axes.set_xlim(view.spans[0].begin, view.spans[-1].end)
    at = f", creepage {view.spans[0].creepage:.3g} %" if _levels(view) == 1 else ""
    name_axes(
        axes, view.scale(view.along).axis_label, view.quantity.axis_label, f"{view.channel}: {view.kind} and model{at}"
    )
    legend(axes, 2)
    drawn = axes.get_legend()
    for handle in drawn.get_lines() if drawn else []:
        if handle.get_marker() == ".":
            handle.set(markersize=6.0, alpha=1.0)
    if several:
        _in_black(axes, fitted, held_out, "model after")


def _in_black(axes: Axes, *labels: str) -> None:
    """Names in the legend that hold for every test, each drawn in a colour of its own, without the colour of one."""
    drawn = axes.get_legend()
    for handle, text in zip(drawn.legend_handles, drawn.get_texts(), strict=True) if drawn else ():
        if isinstance(handle, Line2D) and text.get_text() in labels:
            handle.set(color=BLACK, markeredgecolor=BLACK)


def _dots(axes: Axes, x: Floats, y: Floats, colour: object, label: str, *, among: int, crosses: bool = False) -> None:
    """Samples: circles where there are a few dozen, small and pale points where there are thousands; or crosses."""
    if crosses:
        axes.plot(x, y, linestyle="none", marker="x", markersize=5.0 if among <= FEW else 3.0, markeredgewidth=0.9,
                  color=colour, label=label or None, zorder=3)  # fmt: skip
        return
    if among <= FEW:
        axes.plot(x, y, linestyle="none", marker="o", markersize=4.5, markerfacecolor="white", markeredgecolor=colour,
                  markeredgewidth=1.0, label=label or None, zorder=3, clip_on=False)  # fmt: skip
        return
    crowd = 1.0 / np.sqrt(among)
    size, opacity = float(np.clip(75.0 * crowd, 2.4, 6.0)), float(np.clip(10.0 * crowd, 0.35, 0.8))
    axes.plot(x, y, linestyle="none", marker=".", markersize=size, markeredgewidth=0.0, alpha=opacity,
              color=colour, label=label or None)  # fmt: skip


def _wide(axes: Axes, x: Floats) -> None:
    """A logarithmic abscissa a little longer than its samples."""
    logarithmic(axes.xaxis, float(np.min(x)) / 1.15, float(np.max(x)) * 1.15)


def _steps(axes: Axes, view: View) -> None:
    """The creepage of each step over time."""
    gaps = [before.end < span.begin for before, span in pairwise(view.spans)]
    pause = np.flatnonzero(gaps) * 2 + 2
    edges = np.insert(np.array([[span.begin, span.end] for span in view.spans]).ravel(), pause, np.nan)
    levels = np.insert(np.repeat([span.creepage for span in view.spans], 2), pause, np.nan)
    axes.plot(edges, levels, color=GREEN, linewidth=1.0)
    axes.set_ylabel("creepage\n[%]", fontsize=SMALL)
    axes.tick_params(labelsize=SMALL, length=2.0, width=0.5)
    axes.tick_params(axis="x", labelbottom=False)
    least, most = (reach(span.creepage for span in view.spans) for reach in (min, max))
    axes.set_ylim(1.15 * min(least, 0.0), 1.15 * max(most, 1e-9))
    axes.locator_params(axis="y", nbins=3)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def _leftover(axes: Axes, view: View) -> None:
    """Measured minus model, before and after, with the band of the noise and the mean course of each test."""
    axes.axhspan(-2.0 * view.noise, 2.0 * view.noise, color=BAND, linewidth=0.0, zorder=0, label="noise, ±2 std")
    over = np.concatenate([trace.over[trace.kept] for trace in view.traces])
    several = len(view.traces) > 1
    coloured = [each for each in zip(view.traces, family(len(view.traces)), strict=True) if each[0].kept.any()]
    for name, own, width in (("before", ORANGE, 2.4), ("after", BLUE, 1.2)):
        for trace, colour in coloured:
            shade = colour if several and name == "after" else own
            x, left = trace.over[trace.kept], (trace.measured - getattr(trace, name))[trace.kept]
            _dots(axes, x, left, shade, "", among=len(over))
            bins = int(np.clip(len(x) // 5, BINS, MOST_BINS)) if view.over == "y" else BINS
            axes.plot(*_mean_course(x, left, bins), color=shade, linewidth=width, label=f"{name}, mean")
    if view.is_wide(view.over):
        _wide(axes, over)
    axes.axhline(0.0, color=BLACK, linewidth=0.5)
    rest = f"{view.kind}\n− model [{unit(channels()[view.channel].unit) or '1'}]"
    name_axes(axes, view.scale(view.over).axis_label, rest, fill(_outcome(view), TITLE))
    legend(axes, 3)
    if several:
        _in_black(axes, "after, mean")


def _mean_course(over: Floats, values: Floats, bins: int) -> tuple[Floats, Floats]:
    """Means of values (sample,) at each level of a covariate, or in bins of as many samples where it has many."""
    levels, level = np.unique(over, return_inverse=True)
    if len(levels) > bins:
        bounds = np.quantile(over, np.linspace(0.0, 1.0, bins + 1)[1:-1])
        level = np.searchsorted(bounds, over)
    count = np.bincount(level)
    used = count > 0
    means = [np.bincount(level, weights=array)[used] / count[used] for array in (over, values)]
    return means[0], means[1]


def _ranked(view: View) -> list[CandidateResult]:
    """The explanations that are drawn: all that were chosen, and those that come first beside them."""
    ranked = sentences.ranked(view.diagnosis, view.channel)
    out = [sentences.is_out(view.diagnosis, tried) for tried in ranked]
    first = sorted(range(len(ranked)), key=lambda i: (not ranked[i].chosen, out[i], i))[:SHOWN]
    return [ranked[i] for i in sorted(first)]


def _ranking(axes: Axes, view: View) -> None:
    """How much better each explanation makes the fit, and what came of it."""
    ranked = _ranked(view)
    gains = [sentences.length(tried.gain) for tried in ranked]
    kinds = [0 if t.chosen else 2 if sentences.is_out(view.diagnosis, t) else 1 for t in ranked]
    for kind, (colour, what) in enumerate(BARS):
        if kind in kinds:
            here = np.flatnonzero(np.equal(kinds, kind))
            axes.barh(here, np.take(gains, here), color=colour, height=0.78, label=what)
    longest = max(*gains, 1e-9)
    axes.set_yticks([])
    axes.spines["left"].set_position(("data", 0.0))
    axes.spines["bottom"].set_bounds(0.0, RIGHT * longest)
    for place, tried in enumerate(ranked):
        label = fill(sentences.tried_name(view.diagnosis, tried), LONGEST)
        weight = "bold" if tried.chosen else "normal"
        size = "x-small" if "\n" in label else SMALL
        axes.text(-0.02 * longest, place, label, va="center", ha="right", fontsize=size, fontweight=weight,
                  linespacing=0.95)  # fmt: skip
        axes.text(RIGHT * longest, place, _remark(view.diagnosis, tried), va="center", ha="right", fontsize=SMALL,
                  color=REMARK)  # fmt: skip
    head = "probability, or why not" if any(np.isfinite(tried.probability) for tried in ranked) else "outcome"
    axes.text(RIGHT * longest, -0.75, head, va="bottom", ha="right", fontsize=SMALL, color=REMARK, fontstyle="italic")
    axes.set_xlim(-LEFT * longest, RIGHT * longest)
    axes.set_xticks([tick for tick in MaxNLocator(5).tick_values(0.0, longest) if tick <= 1.02 * longest])
    axes.set_ylim(len(ranked) - 0.4, -0.7)
    better = "improvement of the fit, $\\sqrt{\\Delta\\chi^2}$ (about 1 by chance)"
    name_axes(axes, better, "", f"{view.channel}: explanations that were tried")
    axes.xaxis.label.set_x((LEFT + 0.5) / (LEFT + RIGHT))
    axes.legend(loc="upper left", bbox_to_anchor=(0.0, 0.0), handlelength=1.5, borderpad=0.0, borderaxespad=0.5,
                labelspacing=0.3)  # fmt: skip


def _remark(diagnosis: Diagnosis, tried: CandidateResult) -> str:
    """What came of an explanation, in a word."""
    reason = tried.refused.reason if tried.refused else ""
    if reason and sentences.is_out(diagnosis, tried):
        return reason
    probability = sentences.probability(diagnosis, tried)
    said = percent(probability) if np.isfinite(probability) else "added" if tried.chosen else "not excluded"
    return f"{said} ({reason})" if reason else said


def _outcome(view: View) -> str:
    """What came of the search in this channel, as the title of what the model leaves."""
    diagnosis, channel = view.diagnosis, view.channel
    if channel in [left.channel for left in diagnosis.unexplained]:
        return "what the model leaves: part unexplained"
    if channel in sentences.together(diagnosis):
        return "what the model leaves"
    p = diagnosis.p_values.get(channel, float("nan"))
    if not np.isfinite(p):
        return "what the model leaves (not searched)"
    if diagnosis.effects or diagnosis.laws:
        return "left: nothing else is missing here"
    return f"left: nothing is missing ({p_value(p)}; alarm\u00a0<\u00a0{ACCEPTANCE.unexplained_alone:g})"


DRAW: Mapping[tuple[str, int], Callable[[Axes, View], None]] = {
    ("steps", 0): _steps,
    ("course", 0): _course,
    ("course", 1): _leftover,
    ("tried", 0): _ranking,
}


def _law(axes: Axes, result: FoundLaw, diagnosis: Diagnosis, width: int) -> None:
    """A law that was learnt: its curve with the 90 % band, its formula in lines of a width, and where data were."""
    law, curve = result.law, result.curve
    at, value, low_band, high_band = _with_jumps(law, curve)
    axes.fill_between(at, low_band, high_band, color=BLUE, alpha=0.2, linewidth=0.0, label="90 %")
    axes.plot(at, value, color=BLUE, linewidth=1.4, label="learnt")
    if law.shape is None:
        axes.plot(law.at, law.value, linestyle="none", marker="o", markersize=2.5, color=BLUE)
    one = 1.0 if law.of.kind == "factor" else 0.0
    axes.axhline(one, color=BLACK, linewidth=0.5)
    data = samples_over(diagnosis, result)
    if len(data):
        axes.plot(data, np.full(len(data), 0.015), linestyle="none", marker="|", markersize=5.0, markeredgewidth=0.4,
                  color=GREY, alpha=0.6, transform=axes.get_xaxis_transform(), label="data")  # fmt: skip
    low, high = axes.get_ylim()
    axes.set_ylim(low - 0.08 * (high - low), high + 0.12 * (high - low))
    across = f"{law.over.title} [{unit(law.over.unit) or '1'}]"
    what = f"{'factor on' if one else 'shift of'} {law.of.label} [{unit(law.of.unit) or '1'}]"
    name_axes(axes, across, fill(what, 28), fill(f"learnt: {result.formula} ({sentences.sureness(result)})", width))
    legend(axes, 3)


def _with_jumps(law: Law, curve: LawCurve) -> list[Floats]:
    """Places, values and band of a curve, with upright sides where its formula jumps between two places."""
    edges = [law.parameters[law.over.key(name)] for name in SHAPES[law.shape].along] if law.shape in JUMPING else []
    jumps = [(edge, int(np.searchsorted(curve.at, edge))) for edge in sorted(edges)]
    inside = [(edge, place) for edge, place in jumps if 0 < place < len(curve.at)]
    where = np.repeat([place for _, place in inside], 2).astype(np.int64)
    at = np.insert(curve.at, where, np.repeat([edge for edge, _ in inside], 2))
    sides = where - np.tile([1, 0], len(inside))
    return [at, *(np.insert(values, where, values[sides]) for values in (curve.value, curve.low, curve.high))]
