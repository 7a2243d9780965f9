"""How far each check of a test uses up the range that the physics allows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from twindisc_cli.figures.style import BLACK, GREEN, RED, SMALL, legend, logarithmic, page

_SHOWN = (1e-2, 1e3)  # of its margin, from far inside to hopeless; the rest stands at the ends


def consistency(labels: Sequence[str], strains: Sequence[float], *, title: str, note: str) -> Figure:
    """One bar a check on a logarithmic axis; beyond 1 a value contradicts the others. note: where the data are from."""
    figure, (axes,) = page(1, 1, height=1.35 + 0.22 * len(labels), title=title, provenance=note)
    values = np.clip(np.asarray(strains, dtype=float), *_SHOWN)
    places, beyond = np.arange(len(labels)), values > 1.0
    for which, colour, label in ((~beyond, GREEN, "agrees"), (beyond, RED, "contradicts")):
        if which.any():
            axes.barh(places[which], values[which] - _SHOWN[0], left=_SHOWN[0], height=0.7, color=colour, label=label)
    axes.axvline(1.0, color=BLACK, linewidth=0.9)
    for place, strain in zip(places, strains, strict=True):
        axes.text(
            0.995,
            float(place),
            f"{strain:.2g}",
            transform=axes.get_yaxis_transform(),
            fontsize=SMALL,
            va="center",
            ha="right",
        )
    axes.text(0.995, 1.01, "ratio", transform=axes.transAxes, fontsize=SMALL, va="bottom", ha="right")
    logarithmic(axes.xaxis, _SHOWN[0], max(10.0, 4.0 * float(values.max(initial=1.0))))
    axes.set_yticks(places, labels, fontsize=SMALL)
    axes.grid(False, axis="y")
    axes.invert_yaxis()
    axes.set_xlabel("value over what the physics allows [1]")
    legend(axes, 2)
    return figure
