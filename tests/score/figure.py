"""Detection and attribution over effect size, and probability told against frequency right, as a figure."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from .judging import Row
from .scoring import calibration_error, is_sized, reliability, told_of

Counted = tuple[str, Callable[[Row], bool], str]
_KNOWN: tuple[Counted, ...] = (
    ("something is missing", lambda f: f["alarm"], "0.55"),
    ("true effect in a set of at most three", lambda f: f["found_0"], "C0"),
    ("true effect named first", lambda f: f["first_0"], "C1"),
)
_UNKNOWN: tuple[Counted, ...] = (
    ("something is missing", lambda f: f["alarm"], "0.55"),
    ("stage right", lambda f: f["stage"], "C0"),
    ("quantity and covariate in the set", lambda f: f["pair"], "C2"),
    ("a wrong name", lambda f: f["wrong_name"], "C3"),
)


def draw(rows: Sequence[Row]) -> Figure:
    """One effect of the catalogue; a law that is in none; probabilities told. Bars: 68 % of the binomial."""
    figure = Figure(figsize=(13.0, 4.4), layout="constrained")
    known, unknown, told = figure.subplots(1, 3)
    answered = [row for row in rows if not row["judged"]["failed"]]
    sized = [row for row in answered if is_sized(row)]
    _panel(known, [r for r in sized if r["group"] in ("single", "sizes")], _KNOWN)
    _panel(unknown, [r for r in sized if r["group"] == "unknown"], _UNKNOWN)
    nothing = [r["judged"]["alarm"] for r in answered if r["group"] == "null"]
    if nothing:
        known.axhline(float(np.mean(nothing)), color="0.7", linestyle=":", label="alarm where nothing is missing")
    known.set(title="one effect of the catalogue", ylabel="share of tests")
    unknown.set(title="a law that is in no catalogue")
    for axes in (known, unknown):
        axes.set(xlabel="effect size / detection threshold", ylim=(-0.03, 1.03))
        axes.legend(fontsize=7, loc="upper center", bbox_to_anchor=(0.5, -0.2), ncols=2, frameon=False)
    _reliability(told, told_of(answered))
    return figure


def _panel(axes: Axes, rows: Sequence[Row], counted: Sequence[Counted]) -> None:
    sizes = sorted({row["truth"]["target_size"] for row in rows})
    for label, flag, colour in counted:
        shares = [[flag(r["judged"]) for r in rows if r["truth"]["target_size"] == size] for size in sizes]
        _shares(axes, sizes, [np.mean(s) for s in shares], [len(s) for s in shares], colour, label)
    axes.set_xscale("log")
    axes.set_xticks(sizes, [f"{size:g}" for size in sizes])
    axes.minorticks_off()


def _shares(
    axes: Axes, x: Sequence[float], shares: Sequence[float], counts: Sequence[int], colour: str, label: str = ""
) -> None:
    """Shares with their standard deviations, which are not zero at 0 and 1 and end there."""
    mean, count = np.array(shares), np.array(counts)
    spread = np.sqrt((mean * (1.0 - mean) + 0.25 / (count + 1)) / (count + 1))
    bars = np.minimum(spread, [mean, 1.0 - mean])
    axes.errorbar(x, mean, bars, color=colour, marker="o", markersize=4, capsize=2, label=label)


def _reliability(axes: Axes, told: Sequence[tuple[float, bool]]) -> None:
    """How often what was told with a probability was right, in bins of a fifth, with the count of each."""
    axes.plot([0.0, 1.0], [0.0, 1.0], color="0.7", linestyle=":")
    parts = reliability(told)
    if parts:
        probability, share, count = zip(*parts, strict=True)
        _shares(axes, probability, share, count, "C0")
        for x, _, n in parts:
            axes.annotate(f"{n:d}", (x, 0.02), xycoords=("data", "axes fraction"), ha="center", fontsize=7, color="0.4")
    axes.set(
        title=f"probabilities: calibration error {calibration_error(told):.3f}",
        xlabel="reported probability", ylabel="share that was right", xlim=(-0.03, 1.03), ylim=(-0.13, 1.03),
    )  # fmt: skip
