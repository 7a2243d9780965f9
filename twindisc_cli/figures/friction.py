"""Figures of friction: the chart (Figs. 6, 7) and what each step's traction says (Fig. 2)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from twindisc_cli.figures.style import (
    BLACK,
    BLUE,
    GREY,
    RED,
    SMALL,
    caption,
    family,
    from_zero,
    legend,
    logarithmic,
    measured_points,
    name_axes,
    page,
)
from twindisc_cli.figures.time_axis import time_axis
from twindisc_cli.identify.friction import ABOVE_LIMIT, AGAINST_CREEPAGE

if TYPE_CHECKING:
    from twindisc_cli.identify.chart import Chart
    from twindisc_cli.identify.steps import StepFriction
    from twindisc_cli.model.experiment import Experiment

CREEPAGE, APPARENT = "creepage $\\upsilon_x$ [%]", "apparent friction $T/N$ [1]"


def chart(one: Chart, many: Chart, measured: StepFriction | None, *, name: str, origin: str, provenance: str) -> Figure:
    """Apparent friction of one mu (Fig. 6) and of a family with the 98 % line (Fig. 7), measured points on both.

    origin: where that one mu is from.
    """
    figure, (left, right) = page(1, 2, height=3.8, title=f"{name}: friction chart", provenance=provenance)
    left.plot(one.creepage * 100.0, one.apparent[0], color=BLUE, label=f"$\\mu$ = {one.mu[0]:.3g}")
    if np.isfinite(one.full_slip[0]):
        left.axvline(one.full_slip[0] * 100.0, color=GREY, linewidth=0.8, linestyle=":", label="full slip")
    name_axes(
        left, CREEPAGE, APPARENT, f"$\\mu$ = {one.mu[0]:.3g}, {origin}: full slip from {one.full_slip[0] * 100.0:.2f} %"
    )
    for place, (row, mu, colour) in enumerate(zip(many.apparent, many.mu, family(len(many.mu)), strict=True)):
        right.plot(many.creepage * 100.0, row, color=colour, linewidth=1.0)
        if place % 2:
            right.annotate(f"{mu:.1f}", (many.creepage[-1] * 100.0, row[-1]), xytext=(4, 0), fontsize=SMALL,
                           va="center", textcoords="offset points", color=colour, annotation_clip=False)  # fmt: skip
    reached = many.light_line <= many.creepage[-1]
    right.plot(many.light_line[reached] * 100.0, 0.98 * many.mu[reached], color=RED, linewidth=1.2, linestyle="--",
               label="$T/N$ = 98 % of $\\mu$")  # fmt: skip
    logarithmic(right.xaxis, 15.0 * min(many.light_line[0], many.creepage[-1] / 50.0), many.creepage[-1] * 115.0)
    name_axes(right, CREEPAGE, APPARENT, f"$\\mu$ from {many.mu[0]:.2f} to {many.mu[-1]:.2f}, numbered")
    for axes in (left, right):
        if measured is not None:
            sense = np.where(measured.creepage < 0.0, -1.0, 1.0)
            creepage, ratio = np.abs(measured.creepage) * 100.0, sense * measured.ratio
            back = ", without sign" if np.any(sense < 0.0) else ""
            measured_points(axes, creepage, ratio, measured.half, label=f"{provenance}{back}, 90 % interval")
        axes.set_ylim(0.0 if axes.dataLim.y0 >= 0.0 else None, None)
        legend(axes, 2)
    left.set_xlim(0.0, None)
    return figure


def identified(steps: StepFriction, test: Experiment, *, sentence: str) -> Figure:
    """The measured T/N over creepage (Fig. 2; over time where that is constant), and the mu behind each step."""
    figure, (left, right) = page(
        1, 2, height=3.6, title=f"{test.name}: friction identified", provenance=test.measured.provenance
    )
    caption(figure, sentence)
    _traction(left, steps, test)
    known = np.isfinite(steps.mu)
    unexplained = ~known & np.array([state in (ABOVE_LIMIT, AGAINST_CREEPAGE) for state in steps.state])
    order = np.arange(1, len(steps.mu) + 1)
    mu, low, high = steps.mu[known], steps.low[known], steps.high[known]
    ends = np.nan_to_num(np.array([mu - low, np.where(np.isfinite(high), high, mu) - mu]))
    right.errorbar(order[known], mu, yerr=ends, ecolor=BLUE, elinewidth=0.8,
                   linestyle="none", marker="s", markersize=4.0, color=BLUE, label="identified $\\mu$")  # fmt: skip
    naive = np.abs(steps.ratio)
    right.plot(order, naive, linestyle="none", marker="_", markersize=9.0, color=BLACK, label="$T/N$ taken as $\\mu$")
    if np.any(unexplained):
        where = order[unexplained], naive[unexplained]
        right.plot(*where, linestyle="none", marker="x", color=RED, label="no $\\mu$ fits")
    name_axes(right, "step", "coefficient of friction $\\mu$ [1]", "$\\mu$ behind each $T/N$, 90 % interval")
    right.set_xticks(order[:: int(np.ceil(len(order) / 12))])
    from_zero(right)
    if not np.any(steps.ratio < 0.0):
        from_zero(left)
    for axes in (left, right):
        legend(axes, 2 if axes is right else 1)
    return figure


def _traction(axes: Axes, steps: StepFriction, test: Experiment) -> None:
    """Samples and the mean of each step, over creepage; over time where that alone changes."""
    measured = test.measured
    samples = measured.traction
    if samples is None:
        return
    if np.ptp(samples.creepage) < 0.1 * np.abs(samples.creepage).max() and np.all(np.isfinite(samples.time)):
        clock, creepage = time_axis(test), f"{np.mean(samples.creepage) * 100.0:.3g} % creepage"
        axes.plot(clock.drawn(samples.time), samples.ratio, linestyle="none", marker=".", markersize=3.0, color=GREY,
                  label="samples")  # fmt: skip
        name_axes(axes, clock.axis_label, APPARENT, f"{measured.provenance} at {creepage}")
        return
    if len(samples.ratio) > len(steps.ratio):
        axes.plot(
            samples.creepage * 100.0,
            samples.ratio,
            linestyle="none",
            marker=".",
            markersize=3.0,
            color=GREY,
            label="samples",
        )
    measured_points(
        axes,
        steps.creepage * 100.0,
        steps.ratio,
        steps.half,
        label=f"{measured.provenance}, mean of a step, 90 % interval",
    )
    name_axes(axes, CREEPAGE, APPARENT, f"{measured.provenance} traction")
    if np.any(samples.creepage):
        axes.set_xlim(*(105.0 * np.array([min(0.0, samples.creepage.min()), max(0.0, samples.creepage.max())])))
