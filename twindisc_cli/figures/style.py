"""The house style of every figure: sizes for print, colours that the colour-blind tell apart, and where data are from.

Colours: M. Okabe and K. Ito, Color Universal Design (2008); families of curves follow matplotlib's "viridis".
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from string import ascii_lowercase
from textwrap import wrap
from typing import Literal

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from numpy.typing import ArrayLike

from twindisc_cli import __version__

BLUE, ORANGE, GREEN, RED, PURPLE, GREY = "#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#7F7F7F"
BLACK = "#222222"
WIDTH, LINE, FOOT = 7.2, 120, 0.24
"""Width and foot of a page [inch], and characters of a line below its panels."""
TEXT, SMALL = 8.5, 7.0
Place = Literal["best", "upper left", "upper right", "lower left", "lower right", "center right", "upper center"]


@contextmanager
def house_style() -> Iterator[None]:
    """Figures that are drawn inside are the same on every machine, whatever its matplotlibrc says."""
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        yield


def page(rows: int, columns: int, *, height: float, title: str, provenance: str = "") -> tuple[Figure, list[Axes]]:
    """A figure of text width with its panels, row by row; provenance "" where no recorded data are in it."""
    foot = FOOT / height
    layout = ConstrainedLayoutEngine(rect=(0.0, foot, 1.0, 1.0 - foot), w_pad=0.06, h_pad=0.06)
    figure = Figure(figsize=(WIDTH, height), layout=layout)
    figure.suptitle(title, fontsize=TEXT + 1.0, x=0.01, ha="left", fontweight="bold")
    figure.text(
        0.99, 0.06 / height, f"twindisc {__version__}", fontsize=SMALL - 1.0, color=GREY, ha="right", va="bottom"
    )
    if provenance:
        stamp = f"{provenance} data"
        shade = GREY if provenance == "measured" else RED
        figure.text(0.01, 0.06 / height, stamp, fontsize=SMALL, color=shade, ha="left", va="bottom", fontweight="bold")
    grid = figure.subplots(rows, columns, squeeze=False)
    panels = list(grid.ravel())
    for place, axes in enumerate(panels):
        _dress(axes, f"({ascii_lowercase[place]})" if len(panels) > 1 else "")
    return figure, panels


def said(figure: Figure, sentence: str) -> None:
    """A sentence below the panels, in lines that fit the page."""
    lines, height = wrap(sentence, LINE), figure.get_figheight()
    figure.text(0.5, FOOT / height, "\n".join(lines), fontsize=SMALL, ha="center", va="bottom")
    foot = (FOOT + 0.16 * len(lines)) / height
    figure.set_layout_engine(ConstrainedLayoutEngine(rect=(0.0, foot, 1.0, 1.0 - foot), w_pad=0.06, h_pad=0.06))


def _dress(axes: Axes, letter: str) -> None:
    """Small ticks, light grid, two spines, and the panel's letter."""
    axes.tick_params(labelsize=SMALL + 0.5, direction="out", length=2.5, width=0.6)
    axes.tick_params(which="minor", length=1.5, width=0.4)
    axes.grid(True, color="#DDDDDD", linewidth=0.4)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_linewidth(0.6)
    axes.set_title(letter, fontsize=TEXT, loc="left", fontweight="bold", pad=3.0)


def name_axes(axes: Axes, x: str, y: str, what: str = "") -> None:
    """Label both axes, with their units, and say what the panel shows."""
    axes.set_xlabel(x, fontsize=TEXT)
    axes.set_ylabel(y, fontsize=TEXT)
    if what:
        axes.set_title(what, fontsize=TEXT, pad=3.0)


def legend(axes: Axes, place: Place = "best", columns: int = 1) -> None:
    """The legend of a panel, small and without a frame in its way."""
    handles, labels = axes.get_legend_handles_labels()
    axes.legend(handles, labels, fontsize=SMALL, loc=place, ncols=columns, framealpha=0.85, edgecolor="none")


def legend_below(axes: Axes, columns: int) -> None:
    """The legend of a panel that is too full to hold it: under the horizontal axis."""
    handles, labels = axes.get_legend_handles_labels()
    axes.legend(handles, labels, fontsize=SMALL, loc="upper center", bbox_to_anchor=(0.5, -0.2), ncols=columns,
                frameon=False, handlelength=1.4, columnspacing=1.2)  # fmt: skip


def family(count: int) -> Sequence[tuple[float, float, float, float]]:
    """Colours of an ordered family of curves."""
    return [matplotlib.colormaps["viridis"](float(place)) for place in np.linspace(0.0, 0.88, max(count, 1))]


def measured_points(axes: Axes, x: ArrayLike, y: ArrayLike, half: ArrayLike | None = None, *, label: str) -> None:
    """Measured points, with half the length of their error bars where that is known."""
    bars = None if half is None else np.nan_to_num(np.asarray(half, dtype=float))
    axes.errorbar(x, y, yerr=bars, linestyle="none", marker="o", markersize=4.0, color=BLACK, markerfacecolor="white",
                  ecolor=GREY, elinewidth=0.7, label=label)  # fmt: skip
