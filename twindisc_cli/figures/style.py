"""The house style of every figure: sizes for print, colours that the colour-blind tell apart, and where data are from.

Colours: M. Okabe and K. Ito, Color Universal Design (2008); families of curves follow matplotlib's "viridis".
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from string import ascii_lowercase
from textwrap import wrap
from typing import Any

import matplotlib
import numpy as np
from cycler import cycler
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis, XAxis
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter, NullLocator
from matplotlib.transforms import ScaledTranslation
from numpy.typing import ArrayLike

from twindisc_cli.errors import DefinitionError, Problem, did_you_mean
from twindisc_cli.results.drawn import PROVENANCE
from twindisc_cli.version import __version__

BLUE, ORANGE, GREEN, RED, PURPLE, GREY = (f"C{i}" for i in range(6))
"""Colours by their place in the cycle: a style sheet may bring others."""
BLACK = "#222222"
STAMPS = ("#D55E00", "#7F7F7F")
"""Colours of where data are from, in every style sheet: not measured, measured."""
WIDTH, LINE, FOOT = 7.2, 120, 0.24
"""Width and foot of a page [inch], and characters of a line below its panels."""
ROW = 0.16
"""Height of a line of small text [inch]."""
KEY = 8
"""What the line before a name in a legend takes, with the room between columns, of the characters of a LINE."""
TEXT, SMALL = "medium", "small"
HOUSE: Any = {
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,
    "axes.grid": True,
    "axes.linewidth": 0.6,
    "axes.prop_cycle": cycler(color=["#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#7F7F7F"]),
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlepad": 3.0,
    "axes.titlesize": "medium",
    "figure.titlesize": 9.5,
    "figure.titleweight": "bold",
    "font.size": 8.5,
    "grid.color": "#DDDDDD",
    "grid.linewidth": 0.4,
    "legend.fontsize": "small",
    "legend.frameon": False,
    **{
        f"{axis}tick.{key}": value
        for axis in "xy"
        for key, value in {
            "labelsize": "small", "major.size": 2.5, "major.width": 0.6, "minor.size": 1.5, "minor.width": 0.4,
        }.items()
    },
}  # fmt: skip
"""What differs from matplotlib's own style; sizes of text in point."""
FIXED = (
    "backend", "figure.autolayout", "figure.constrained", "figure.dpi", "figure.figsize", "interactive", "savefig",
    "svg.hashsalt", "webagg",
)  # fmt: skip
"""What a style sheet does not decide: the size of a figure follows from what it shows, its pixels from --dpi."""
HEADLINE, HEADLINES = 84, 4
"""Characters of a line of the title."""
ROOM = 1.07
"""The end of an axis that begins at zero, over the highest value on it."""
WIDE = 15.0
"""Values that span more than this factor are drawn on a logarithmic axis."""
FEW = 40
"""Samples up to which each is drawn as a point of its own."""
UNDER = 30.0
"""From the horizontal axis down to the legend under its numbers and label [point]."""


@contextmanager
def house_style(sheet: Path | None = None) -> Iterator[None]:
    """Figures that are drawn inside are the same on every machine, whatever its matplotlibrc says.

    sheet: a style sheet of matplotlib that is put over the style of the house; DefinitionError where it is none.
    """
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(HOUSE)
        if sheet is not None:
            matplotlib.rcParams.update(_read(sheet))
        yield


def _read(sheet: Path) -> Any:
    """The settings of a style sheet; every line that is none is an error."""
    try:
        lines = [line.partition("#")[0].strip() for line in sheet.read_text().splitlines()]
    except ValueError:
        what = "no style sheet of matplotlib: it holds bytes that are no text"
        raise DefinitionError(Problem(what, sheet)) from None
    place = {line.partition(":")[0].strip(): number for number, line in enumerate(lines, start=1) if line}
    known = matplotlib.rcParams
    wrong = [
        Problem(f"matplotlib has no such setting{did_you_mean(key, known)}", sheet, number, key)
        for key, number in place.items()
        if key not in known
    ]
    if wrong:
        raise DefinitionError(wrong)
    try:
        settings = matplotlib.rc_params_from_file(sheet, fail_on_error=True, use_default_template=False)
    except ValueError as error:
        key, _, what = str(error).removeprefix("Key ").partition(": ")
        raise DefinitionError(Problem(what or str(error), sheet, place.get(key, 0), key)) from None
    return {key: value for key, value in settings.items() if not key.startswith(FIXED)}


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
    figure.suptitle(headline, x=0.01, ha="left")
    figure.text(
        0.99, 0.06 / height, f"twindisc {__version__}", fontsize="x-small", color=STAMPS[True], ha="right", va="bottom"
    )
    if provenance:
        stamp = f"{provenance} data"
        shade = STAMPS[provenance == "measured"]
        figure.text(0.01, 0.06 / height, stamp, fontsize=SMALL, color=shade, ha="left", va="bottom", fontweight="bold",
                    gid=PROVENANCE)  # fmt: skip
    return figure


def caption(figure: Figure, sentence: str) -> None:
    """A sentence below the panels, in lines that fit the page."""
    lines = wrap(sentence, LINE)
    figure.text(0.5, _foot(figure), "\n".join(lines), fontsize=SMALL, ha="center", va="bottom")
    _lift(figure, len(lines))


def dress(panels: Sequence[Axes]) -> None:
    """The letter of each panel, where there are several."""
    for place, axes in enumerate(panels if len(panels) > 1 else ()):
        axes.set_title(f"$\\mathbf{{({ascii_lowercase[place]})}}$", loc="left")


def name_axes(axes: Axes, x: str, y: str, what: str = "") -> None:
    """Label both axes, with their units, and say behind the panel's letter what it shows."""
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    letter = axes.get_title(loc="left")
    axes.set_title("  ".join(part for part in (letter, what) if part), loc="left")


def legend(axes: Axes, columns: int = 1) -> None:
    """The legend of a panel, each label once: under the horizontal axis, where no curve can be behind it."""
    handles, labels = axes.get_legend_handles_labels()
    once = dict(zip(labels, handles, strict=True))
    drop = ScaledTranslation(0.0, -UNDER / 72.0, axes.figure.dpi_scale_trans)
    axes.legend(
        list(once.values()), list(once), loc="upper center", ncols=columns,
        handlelength=1.5, columnspacing=1.2, borderpad=0.0, borderaxespad=0.0, labelspacing=0.3,
        bbox_to_anchor=(0.5, 0.0), bbox_transform=axes.transAxes + drop,
    )  # fmt: skip


def legend_below(figure: Figure, panels: Sequence[Axes]) -> None:
    """One legend for panels that show the same lines: below all, in as many columns as the page has room for."""
    once = dict[str, Artist]()
    for handle, label in (pair for axes in panels for pair in zip(*axes.get_legend_handles_labels(), strict=True)):
        once.setdefault(label if len(label) <= LINE else f"{label[: LINE - 2]} …", handle)
    columns = max(LINE // (max(map(len, once), default=0) + KEY), 1)
    figure.legend(
        list(once.values()), list(once), loc="lower center", ncols=columns, bbox_to_anchor=(0.5, _foot(figure)),
        handlelength=1.5, columnspacing=1.2, borderpad=0.0, borderaxespad=0.0, labelspacing=0.3,
    )  # fmt: skip
    _lift(figure, -(-len(once) // columns))


def _foot(figure: Figure) -> float:
    """Height of the foot of a page, as a share of it."""
    return float(FOOT / figure.get_figheight())


def _lift(figure: Figure, lines: int) -> None:
    """Leave room for lines of small text between the foot and the panels."""
    foot = _foot(figure) + ROW * lines / figure.get_figheight()
    figure.set_layout_engine(ConstrainedLayoutEngine(rect=(0.0, foot, 1.0, 1.0 - foot), w_pad=0.06, h_pad=0.06))


def from_zero(axes: Axes) -> None:
    """The vertical axis from zero to above the highest point, with room for its marker."""
    top = float(axes.dataLim.y1)
    axes.set_ylim(0.0, ROOM * top if top > 0.0 else None)


def is_wide(values: ArrayLike) -> bool:
    """Whether values are drawn on a logarithmic axis: all positive, and some more than WIDE times others."""
    every = np.asarray(values, dtype=float)
    return bool(every.size and every.min() > 0.0 and every.max() > WIDE * every.min())


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


def many_points(axes: Axes, x: ArrayLike, y: ArrayLike, *, label: str) -> None:
    """Many measured points: small and pale, below the lines."""
    axes.plot(x, y, linestyle="none", marker=".", markersize=7.0, markeredgewidth=0.0, alpha=0.35, color=GREY,
              zorder=1.5, label=label)  # fmt: skip
