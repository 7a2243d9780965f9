"""The panels of close-loop as numbers, for plots that a reader zooms: measured, before, after, and what is left."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from twindisc_cli.figures._loop_view import View, views_of
from twindisc_cli.loop.diagnosis import Diagnosis
from twindisc_cli.model.experiment import Experiment, Floats

MOST = 3000
"""Samples of a channel that a page carries; more are thinned evenly."""
DIGITS = 6  # below a pixel at any zoom that a page offers


def plots_of(diagnosis: Diagnosis, tests: Sequence[Experiment]) -> list[dict[str, Any]]:
    """Two plots for each channel: its course over the axis of the figure, and the residual over its covariate."""
    return [plot for view in views_of(diagnosis, tests) for plot in (_course(view), _residual(view))]


def _course(view: View) -> dict[str, Any]:
    x = np.concatenate([trace.x for trace in view.traces])
    measured, before, after = _joined(view)
    order = _thinned(np.argsort(x, kind="stable"))
    return {
        "title": f"{view.channel}: measured and model",
        "x": view.scale(view.along).axis_label,
        "y": view.quantity.axis_label,
        "log": view.is_wide(view.along),
        "lines": len(view.traces) == 1,
        "names": ["measured", "model before", "model after"],
        "data": [_plain(values) for values in view.broken(*(of[order] for of in (x, measured, before, after)))],
    }


def _residual(view: View) -> dict[str, Any]:
    over = np.concatenate([trace.over for trace in view.traces])
    measured, before, after = _joined(view)
    order = _thinned(np.argsort(over, kind="stable"))
    return {
        "title": f"{view.channel}: measured minus model",
        "x": view.scale(view.over).axis_label,
        "y": "residual",
        "log": view.is_wide(view.over),
        "lines": False,
        "names": ["", "before", "after"],
        "data": [_plain(over[order]), None, *(_plain((measured - model)[order]) for model in (before, after))],
    }


def _joined(view: View) -> tuple[Floats, Floats, Floats]:
    """Measured, before and after of all traces, in the units of the panels."""
    every = [(trace.measured, trace.before, trace.after) for trace in view.traces]
    measured, before, after = (np.concatenate(parts) for parts in zip(*every, strict=True))
    return measured, before, after


def _thinned(order: np.ndarray[Any, np.dtype[np.int64]]) -> np.ndarray[Any, np.dtype[np.int64]]:
    return order if len(order) <= MOST else order[np.linspace(0, len(order) - 1, MOST).round().astype(int)]


def _plain(values: Floats) -> list[float | None]:
    """Numbers with a few digits; what is not finite is a gap."""
    return [float(f"{value:.{DIGITS}g}") if np.isfinite(value) else None for value in values.tolist()]
