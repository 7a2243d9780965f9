"""The house style of every figure: sizes for print, colours that the colour-blind tell apart, and where data are from.

Colours: M. Okabe and K. Ito, Color Universal Design (2008); families of curves follow matplotlib's "viridis".
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from string import ascii_lowercase
from textwrap import wrap

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis, XAxis
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter, NullLocator
from matplotlib.transforms import ScaledTranslation
from numpy.typing import ArrayLike

from twindisc_cli.version import __version__

BLUE, ORANGE, GREEN, RED, PURPLE, GREY = "#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#7F7F7F"
BLACK = "#222222"
WIDTH, LINE, FOOT = 7.2, 120, 0.24
"""Width and foot of a page [inch], and characters of a line below its panels."""
TEXT, SMALL = 8.5, 7.0
HEADLINE, HEADLINES = 84, 4
"""Characters of a line of the title."""
ROOM = 1.07
"""The end of an axis that begins at zero, over the highest value on it."""
UNDER = 30.0
"""From the horizontal axis down to the legend under its numbers and label [point]."""


@contextmanager
def house_style() -> Iterator[None]:
    """Figures that are drawn inside are the same on every machine, whatever its matplotlibrc says."""
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams["axes.formatter.useoffset"] = False
        yield


def page(rows: int, columns: int, *, height: float, title: str, provenance: str = "") -> tuple[Figure, list[Axes]]:
    """A figure of text width with its panels, row by row; provenance "" where no recorded data are in it."""
    figure = sheet(height=height, title=title, provenance=provenance)
    panels = list(figure.subplots(rows, columns, squeeze=False).ravel())
    dress(panels)
    return figure, panels


def sheet(*, height: float, title: str, provenance: str) -> Figure:
    """A figure of text width without panels yet: its title, where its data are from, and what drew it."""
    foot = FOOT / height
    layout = ConstrainedLayoutEngine(rect=(0.0, foot, 1.0, 1.0 - foot), w_pad=0.06, h_pad=0.06)
    figure = Figure(figsize=(WIDTH, height), layout=layout)
    headline = "\n".join(wrap(title, HEADLINE, max_lines=HEADLINES, placeholder=" …"))
    figure.suptitle(headline, fontsize=TEXT + 1.0, x=0.01, ha="left", fontweight="bold")
    figure.text(
        0.99, 0.06 / height, f"twindisc {__version__}", fontsize=SMALL - 1.0, color=GREY, ha="right", va="bottom"
    )
    if provenance:
        stamp = f"{provenance} data"
        shade = GREY if provenance == "measured" else RED
        figure.text(0.01, 0.06 / height, stamp, fontsize=SMALL, color=shade, ha="left", va="bottom", fontweight="bold")
    return figure


def said(figure: Figure, sentence: str) -> None:
    """A sentence below the panels, in lines that fit the page."""
    lines, height = wrap(sentence, LINE), figure.get_figheight()
    figure.text(0.5, FOOT / height, "\n".join(lines), fontsize=SMALL, ha="center", va="bottom")
    foot = (FOOT + 0.16 * len(lines)) / height
    figure.set_layout_engine(ConstrainedLayoutEngine(rect=(0.0, foot, 1.0, 1.0 - foot), w_pad=0.06, h_pad=0.06))


def dress(panels: Sequence[Axes]) -> None:
    """Small ticks, light grid, two spines, and the letter of each panel where there are several."""
    for place, axes in enumerate(panels):
        axes.tick_params(labelsize=SMALL + 0.5, direction="out", length=2.5, width=0.6)
        axes.tick_params(which="minor", length=1.5, width=0.4)
        axes.grid(True, color="#DDDDDD", linewidth=0.4)
        axes.set_axisbelow(True)
        for side in ("top", "right"):
            axes.spines[side].set_visible(False)
        for side in ("left", "bottom"):
            axes.spines[side].set_linewidth(0.6)
        if len(panels) > 1:
            axes.set_title(f"$\\mathbf{{({ascii_lowercase[place]})}}$", fontsize=TEXT, loc="left", pad=3.0)


def name_axes(axes: Axes, x: str, y: str, what: str = "") -> None:
    """Label both axes, with their units, and say behind the panel's letter what it shows."""
    axes.set_xlabel(x, fontsize=TEXT)
    axes.set_ylabel(y, fontsize=TEXT)
    letter = axes.get_title(loc="left")
    axes.set_title("  ".join(part for part in (letter, what) if part), fontsize=TEXT, loc="left", pad=3.0)


def legend(axes: Axes, columns: int = 1) -> None:
    """The legend of a panel, each label once: under the horizontal axis, where no curve can be behind it."""
    handles, labels = axes.get_legend_handles_labels()
    once = dict(zip(labels, handles, strict=True))
    drop = ScaledTranslation(0.0, -UNDER / 72.0, axes.figure.dpi_scale_trans)
    axes.legend(
        list(once.values()), list(once), fontsize=SMALL, loc="upper center", ncols=columns, frameon=False,
        handlelength=1.5, columnspacing=1.2, borderpad=0.0, borderaxespad=0.0, labelspacing=0.3,
        bbox_to_anchor=(0.5, 0.0), bbox_transform=axes.transAxes + drop,
    )  # fmt: skip


def from_zero(axes: Axes) -> None:
    """The vertical axis from zero to above the highest point, with room for its marker."""
    top = float(axes.dataLim.y1)
    axes.set_ylim(0.0, ROOM * top if top > 0.0 else None)


def logarithmic(axis: Axis, low: float, high: float) -> None:
    """A logarithmic axis from low to high, both positive, numbered at 1, 2 and 5 or at a few even places."""
    low, high = (low / 1.4, high * 1.4) if high < 1.4 * low else (low, high)
    name = "x" if isinstance(axis, XAxis) else "y"
    axis.axes.set(**{f"{name}scale": "log", f"{name}lim": (low, high)})
    decades = np.log10(high / low)
    subs = (1.0,) if decades > 2.5 else (1.0, 3.0) if decades > 1.6 else (1.0, 2.0, 5.0)
    axis.set_major_locator(LogLocator(subs=subs) if decades > 0.8 else MaxNLocator(4))
    axis.set_major_formatter(FuncFormatter(lambda value, _: plain_number(value, low)))
    axis.set_minor_locator(LogLocator(subs="all") if decades > 0.8 else NullLocator())
    axis.set_minor_formatter(NullFormatter())


def plain_number(value: float, least: float = 1.0) -> str:
    """`0.02`, `150`; powers of ten on an axis whose least number has many zeros."""
    if least >= 1e-3 and abs(value) < 1e5:
        return f"{value:g}"
    mantissa, _, power = f"{value:e}".partition("e")
    raised = f"10^{{{int(power)}}}"
    return f"${raised}$" if float(mantissa) == 1.0 else f"${float(mantissa):g}\\times {raised}$"


def family(count: int) -> Sequence[tuple[float, float, float, float]]:
    """Colours of an ordered family of curves."""
    return [matplotlib.colormaps["viridis"](float(place)) for place in np.linspace(0.0, 0.88, max(count, 1))]


def measured_points(axes: Axes, x: ArrayLike, y: ArrayLike, half: ArrayLike | None = None, *, label: str) -> None:
    """Measured points, with half the length of their error bars where that is known."""
    bars = None if half is None else np.nan_to_num(np.asarray(half, dtype=float))
    axes.errorbar(x, y, yerr=bars, linestyle="none", marker="o", markersize=4.0, color=BLACK, markerfacecolor="white",
                  ecolor=GREY, elinewidth=0.7, label=label)  # fmt: skip
