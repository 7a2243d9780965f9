"""Detection and attribution over effect size, as a figure."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from .scoring import Row

_KNOWN: tuple[tuple[str, Callable[[Row], bool], str], ...] = (
    ("something is missing", lambda f: f["alarm"], "0.55"),
    ("true effect in a set of at most three", lambda f: f["found_0"], "C0"),
    ("true effect named first", lambda f: f["first_0"], "C1"),
)
_UNKNOWN: tuple[tuple[str, Callable[[Row], bool], str], ...] = (
    ("something is missing", lambda f: f["alarm"], "0.55"),
    ("right quantity and covariate in the set", lambda f: f["pair"], "C2"),
    ("a wrong name", lambda f: f["wrong_name"], "C3"),
)


def draw(rows: Sequence[Row]) -> Figure:
    """Left: one effect of the catalogue. Right: an effect in no catalogue. Bars: 68 % of the binomial."""
    figure = Figure(figsize=(9.0, 4.2), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    answered = [row for row in rows if not row["judged"]["failed"]]
    _panel(left, [r for r in answered if r["group"] in ("single", "sizes")], _KNOWN)
    _panel(right, [r for r in answered if r["group"] == "unknown"], _UNKNOWN)
    nothing = [r["judged"]["alarm"] for r in answered if r["group"] == "null"]
    if nothing:
        left.axhline(float(np.mean(nothing)), color="0.7", linestyle=":", label="alarm where nothing is missing")
    left.set(title="one effect of the catalogue", ylabel="share of tests", ylim=(-0.03, 1.03))
    right.set(title="an effect that is in no catalogue")
    for axes in (left, right):
        axes.set_xlabel("effect size / detection threshold")
        axes.legend(fontsize=7, loc="upper center", bbox_to_anchor=(0.5, -0.2), ncols=2, frameon=False)
    return figure


def _panel(axes: Axes, rows: Sequence[Row], counted: Sequence[tuple[str, Callable[[Row], bool], str]]) -> None:
    sizes = sorted({row["truth"]["target_size"] for row in rows})
    for label, flag, colour in counted:
        shares = [[flag(r["judged"]) for r in rows if r["truth"]["target_size"] == size] for size in sizes]
        mean = np.array([np.mean(s) for s in shares])
        count = np.array([len(s) for s in shares])
        spread = np.sqrt((mean * (1 - mean) + 0.25 / (count + 1)) / (count + 1))
        axes.errorbar(sizes, mean, spread, color=colour, marker="o", markersize=4, capsize=2, label=label)
    axes.set_xscale("log")
    axes.set_xticks(sizes, [f"{size:g}" for size in sizes])
    axes.minorticks_off()
