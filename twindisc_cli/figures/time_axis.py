"""The axis of time of a figure: a unit of time, the revolutions of the disc, or the distance rolled."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any

import numpy as np

from twindisc_cli.model.experiment import Experiment, Floats
from twindisc_cli.quantities import UNITS
from twindisc_cli.time_axes import TIME_AXES

_ASKED: ContextVar[str] = ContextVar("asked", default="")


@contextmanager
def time_drawn_over(over: str) -> Iterator[None]:
    """Figures that are drawn inside show time over `s`, `min`, `h`, `cycles` or `km`; over their own unit where ""."""
    token = _ASKED.set(over)
    try:
        yield
    finally:
        _ASKED.reset(token)


@dataclass(frozen=True)
class TimeAxis:
    """What the times of a test are drawn over."""

    test: Experiment
    over: str

    @property
    def axis_label(self) -> str:
        """Label of the axis, with its unit."""
        return TIME_AXES[self.over]

    def drawn(self, times: Any) -> Floats:
        """Times [s] (...) as places on the axis (...); pauses have no length over revolutions or distance."""
        seconds = np.asarray(times, dtype=float)
        if self.over in UNITS:
            return UNITS[self.over].of_si(seconds)
        history = self.test.history
        grown = history.revolutions if self.over == "cycles" else 1e-3 * self.test.rolled
        return np.asarray(np.interp(seconds, np.append(0.0, history.end_time), np.append(0.0, np.cumsum(grown))))

    def text(self, time: float) -> str:
        """A time [s] with its unit, for a legend."""
        value = float(self.drawn(time))
        if self.over in ("s", "cycles"):
            return f"{value:.0f} {'rev.' if self.over == 'cycles' else 's'}"
        return f"{value:.3g} {self.over}"


def time_axis(test: Experiment, usual: str = "s") -> TimeAxis:
    """The axis that was asked for, `usual` where none was."""
    return TimeAxis(test, _ASKED.get() or usual)
