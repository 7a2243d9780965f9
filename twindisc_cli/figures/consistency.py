"""How far each check of a test uses up the range that the physics allows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

_SHOWN = (1e-2, 1e3)


def consistency(labels: Sequence[str], strains: Sequence[float], *, title: str, note: str) -> Figure:
    """One bar a check on a logarithmic axis; beyond 1 a value contradicts the others. note: where the data are from."""
    figure = Figure(figsize=(8.0, 1.4 + 0.26 * len(labels)), layout="constrained")
    axes = figure.add_subplot()
    values = np.clip(np.asarray(strains, dtype=float), *_SHOWN)
    colours = ["tab:red" if value > 1.0 else "tab:green" for value in values]
    places = np.arange(len(labels))
    axes.barh(places, values - _SHOWN[0], left=_SHOWN[0], color=colours)
    axes.axvline(1.0, color="black", linewidth=1.0)
    axes.set_xscale("log")
    axes.set_xlim(_SHOWN[0], max(10.0, float(values.max(initial=1.0)) * 2.0))
    axes.set_yticks(places, labels)
    axes.invert_yaxis()
    axes.set_xlabel("value over its limit (beyond 1: contradiction)")
    axes.set_title(f"{title} ({note} data)")
    return figure
