"""The zero of a torque sensor, from the rows in which the discs carry no load, or from slip both ways.

    z(t) = z_b + (z_a - z_b) (t - t_b) / (t_a - t_b)        a constant where only one end was recorded

    z_b, z_a   medians of the torque before and after [N m], at the mean times t_b, t_a [s]

The standard error of an end is that of the means of its stretches, which sees noise that is correlated in time; of a
drift that is not known to be linear, a sixth is added.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from twindisc_cli.measurement.sheet import Floats

UNLOADED = 0.02
"""Share of the nominal load below which a row carries none: the torque of a load being put on is no zero."""
FEWEST = 5  # rows: a level and its scatter
_STRETCHES = 20  # means whose scatter tells what a level is worth
_ALIKE = 1.05  # creepages within 5 % are the same both ways


@dataclass(frozen=True)
class Zero:
    """Medians of the torque [N m] before and after, their times [s] and standard errors [N m]; one of each or two."""

    time: Floats
    torque: Floats
    error: Floats
    rows: int

    def at(self, time: Floats) -> Floats:
        """The zero at times [s], [N m]."""
        slope = np.diff(self.torque) / np.diff(self.time) if len(self.time) > 1 else np.zeros(1)
        return np.asarray(self.torque[0] + slope[0] * (time - self.time[0]))

    @property
    def drift(self) -> float:
        """After less before [N m]; NaN where only one end was recorded."""
        return float(self.torque[1] - self.torque[0]) if len(self.torque) > 1 else np.nan

    @property
    def std(self) -> float:
        """Standard error of the mean zero [N m]."""
        ends = float(np.sqrt(np.sum(self.error**2))) / len(self.error)
        return float(np.hypot(ends, np.nan_to_num(self.drift) / 6.0))


def find_zero(time: Floats, torque: Floats, load: Floats, nominal: float) -> Zero | None:
    """The zero of a log, each (row,); None where it has no rows without load at either end."""
    carrying = np.flatnonzero(np.abs(load) > UNLOADED * nominal)
    if not len(carrying):
        return None
    ends = [rows for rows in (np.arange(carrying[0]), np.arange(carrying[-1] + 1, len(load))) if len(rows) >= FEWEST]
    if not ends:
        return None
    return Zero(
        time=np.array([time[rows].mean() for rows in ends]),
        torque=np.array([np.median(torque[rows]) for rows in ends]),
        error=np.array([_error(torque[rows]) for rows in ends]),
        rows=sum(len(rows) for rows in ends),
    )


def _error(values: NDArray[np.float64]) -> float:
    """Standard error of a mean, by the scatter of the means of stretches."""
    stretches = np.array_split(values, min(_STRETCHES, len(values)))
    means = np.array([stretch.mean() for stretch in stretches])
    return float(means.std(ddof=1) / np.sqrt(len(means)))


def zero_of_both_ways(creepage: Floats, ratio: Floats, step: NDArray[np.int64]) -> tuple[float, float] | None:
    """The zero that slip both ways shows, and its standard error, both as T/N; None where none was driven both ways.

    z = (T+ + T-) / 2 over the steps of nearly one size of creepage (step,), from the samples' ratio and step (sample,).
    Of the sizes those above half of the largest, since the least slip is the least sure to be alike both ways. The
    error is the larger of the samples' scatter and of what the sizes disagree by.
    """
    zeros, errors, size = [], [], np.abs(creepage)
    left = [s for s in np.unique(size)[::-1] if s > 0.5 * size.max(initial=0.0)]
    while left:
        alike = (size <= left[0]) & (size >= left[0] / _ALIKE)
        ways = [ratio[np.isin(step, np.flatnonzero(alike & (sign * creepage > 0.0)))] for sign in (1.0, -1.0)]
        if min(len(way) for way in ways) >= FEWEST:
            zeros.append(0.5 * float(sum(way.mean() for way in ways)))
            errors.append(0.5 * float(np.hypot(_error(ways[0]), _error(ways[1]))))
        left = [s for s in left if s < left[0] / _ALIKE]
    if not zeros:
        return None
    scatter = float(np.std(zeros, ddof=1)) if len(zeros) > 1 else 0.0
    noise = float(np.sqrt(np.sum(np.square(errors)))) / len(zeros)
    return float(np.mean(zeros)), max(noise, scatter / float(np.sqrt(len(zeros))))
