"""One quantity of several tests, overlaid; the legend says in what the definitions differ."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import shorten
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from twindisc_cli.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    ORANGE,
    PURPLE,
    RED,
    family,
    legend,
    logarithmic,
    name_axes,
    page,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from twindisc_cli.campaign.comparison import Quantity, Series

COLOURS = (BLUE, ORANGE, GREEN, RED, PURPLE, BLACK)
MARKERS = "osD^v<>P"
WIDE = 10.0
"""From this ratio of largest to smallest on an axis is logarithmic."""
SHOWN = {"um": "µm", "ug/m/mm2": "µg/m/mm²", "mm3": "mm³", "degC": "°C", "N/mm2": "N/mm²"}
"""Units as an axis has them."""
LABEL = 105
"""Characters of a label in the legend."""


def overlaid(quantity: Quantity, tests: Sequence[str], labels: Sequence[str], provenance: str) -> Figure:
    """The series of a quantity in one panel, each test with its colour in every figure."""
    figure, (axes,) = page(1, 1, height=3.4 + 0.14 * len(tests), title=quantity.title, provenance=provenance)
    colours = COLOURS if len(tests) <= len(COLOURS) else family(len(tests))
    place = {name: number for number, name in enumerate(tests)}
    for series in quantity.series:
        number = place[series.test]
        label = shorten(labels[number], LABEL, placeholder=" …")
        _draw(axes, series, colours[number], MARKERS[number % len(MARKERS)], label)
    name_axes(axes, _plain(quantity.x), _plain(quantity.y))
    if quantity.x == "test [1]":
        axes.set_xticks(np.arange(1, len(tests) + 1), tests, rotation=20 if len(tests) > 4 else 0, ha="right")
        axes.set_xlabel("")
        axes.set_xlim(0.5, len(tests) + 0.5)
        axes.ticklabel_format(axis="y", scilimits=(-3, 5))
    elif quantity.logarithmic:
        values = np.concatenate([np.abs(series.x) for series in quantity.series])
        if values.min() > 0.0 and values.max() > WIDE * values.min():
            logarithmic(axes.xaxis, float(values.min()) / 1.2, float(values.max()) * 1.2)
    legend(axes)
    return figure


def _draw(axes: Axes, series: Series, colour: Any, marker: str, label: str) -> None:
    if series.is_line:
        axes.plot(series.x, series.y, color=colour, linewidth=1.1, label=label)
        return
    few = len(series.x) <= 60
    bars = np.nan_to_num(np.stack([series.y - series.low, series.high - series.y])).clip(min=0.0)
    axes.errorbar(series.x, series.y, yerr=bars if bars.any() else None, linestyle="none",
                  marker=marker if few else ".", markersize=4.0 if few else 2.0, color=colour,
                  markerfacecolor="white" if few else colour, elinewidth=0.8, label=label)  # fmt: skip


def _plain(header: str) -> str:
    """`height change [µm]` for `height change [um]`; no unit where it is 1."""
    stem, _, unit = header.rstrip("]").rpartition(" [")
    return stem if unit == "1" else f"{stem} [{SHOWN.get(unit, unit)}]"
