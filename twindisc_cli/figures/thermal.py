"""Figure of heat: the disc's temperature (Fig. 13), the power that warms it, and the flash temperature above it."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from twindisc_cli.figures.style import (
    BLUE,
    FEW,
    GREEN,
    ORANGE,
    RED,
    caption,
    from_zero,
    legend,
    many_points,
    measured_points,
    name_axes,
    page,
)
from twindisc_cli.figures.time_axis import time_axis
from twindisc_cli.identify.jump import Jump
from twindisc_cli.model.experiment import Experiment, Floats
from twindisc_cli.quantities import CELSIUS


def temperatures(
    *,
    time: Floats,
    disc: Floats,
    steps: tuple[Floats, Floats],
    power: Floats,
    hottest: Floats,
    mean: Floats,
    test: Experiment,
    sentence: str,
) -> Figure:
    """Over time [s]: disc [degC], power [W], the contact's hottest and mean rise above the disc [K], each (point,).

    steps: times [s] and disc [degC] of Eq. 19 as the paper steps it, each (iteration,).
    """
    samples = test.measured.temperature
    provenance = test.measured.provenance if samples is not None or test.measured.traction is not None else ""
    figure, (first, second, third) = page(3, 1, height=6.6, title=f"{test.name}: temperature", provenance=provenance)
    caption(figure, sentence)
    clock = time_axis(test)
    along = clock.drawn(time)
    apart = _apart(time, disc, test)
    first.plot(clock.drawn(apart[0]), apart[1], color=BLUE, label="disc, Eq. 18 exactly")
    first.plot(clock.drawn(steps[0]), steps[1], color=ORANGE, linestyle="none", marker=".", markersize=4.0,
               label="disc, Eq. 19 step by step")  # fmt: skip
    if samples is not None:
        draw = measured_points if len(samples.time) <= FEW else many_points
        draw(first, clock.drawn(samples.time), samples.temperature - CELSIUS, label=provenance)
    if test.thermal is not None:
        environment = test.thermal.environment_temperature - CELSIUS
        first.axhline(environment, color=GREEN, linewidth=0.8, linestyle="--", label="environment")
    name_axes(first, clock.axis_label, "temperature [°C]", "mean temperature of the disc")
    second.plot(along, power, color=ORANGE, drawstyle="steps-pre")
    name_axes(second, clock.axis_label, "power [W]", "dissipated power")
    for rise, color, label in ((hottest, RED, "hottest point"), (mean, ORANGE, "mean of the patch")):
        third.plot(along, rise, color=color, drawstyle="steps-pre", label=label)
    name_axes(third, clock.axis_label, "rise above the disc [K]", "flash temperature of the contact")
    from_zero(second)
    from_zero(third)
    low, high = first.get_ylim()
    if high - low < 1.0:
        first.set_ylim(0.5 * (low + high) - 0.5, 0.5 * (low + high) + 0.5)
    for axes in (first, second, third):
        axes.set_xlim(0.0, 1.01 * float(along[-1]))
    legend(first, 4)
    legend(third, 2)
    return figure


def _apart(time: Floats, disc: Floats, test: Experiment) -> tuple[Floats, Floats]:
    """Times [s] and disc [degC], (point,): where every step is a test of its own, each from its start, with gaps."""
    if not test.history.separate or test.thermal is None:
        return time, disc
    starts = np.unique(test.history.begin_time)
    places = np.repeat(np.searchsorted(time, starts + test.history.slack), 2)
    initial = np.tile([np.nan, test.thermal.initial_temperature - CELSIUS], len(starts))
    return np.insert(time, places, np.repeat(starts, 2)), np.insert(disc, places, initial)


def jump_over(jump: Jump, *, name: str, provenance: str) -> Figure:
    """Friction of each step over what came before it, with the best rising curve; the step of the jump is marked."""
    figure, panels = page(1, 3, height=3.2, title=f"{name}: what the jump of friction goes with", provenance=provenance)
    labels = {"creepage": ("creepage [%]", 100.0, 0.0), "temperature of the disc": ("disc before the step [°C]", 1.0,
              -CELSIUS), "flash temperature": ("flash, friction before it [K]", 1.0, 0.0)}  # fmt: skip
    for axes, cause in zip(panels, jump.causes, strict=True):
        label, factor, offset = labels[cause.name]
        x = cause.values * factor + offset
        order = np.argsort(x, kind="stable")
        axes.plot(x[order], cause.curve[order], color=ORANGE, drawstyle="steps-mid", label="best rising curve")
        measured_points(axes, x, jump.mu, label=provenance)
        axes.plot(
            [x[jump.step]],
            [jump.after],
            linestyle="none",
            marker="o",
            color=RED,
            markersize=5.5,
            zorder=5,
            label="jump",
        )
        from_zero(axes)
        name_axes(axes, label, "$\\mu$ [1]", f"leaves {cause.left:.2g} of $\\mu$ (rms)")
        legend(axes, 2)
    return figure
