"""The zero of a torque sensor, from the rows in which the discs carry no load, or from slip both ways.

    z_i   median of the torque in the i-th section without load [N m], at its mean time t_i; e_i its standard error

    level   z = sum(z_i / e_i^2) / sum(1 / e_i^2)        where the sections agree within their errors
    step    a level before and another after one of the times between them
    drift   from each section to the next: a meter that warms up follows no line

of which the first is taken that the sections bear (chi-squared at 1 %); a step must lie nearer to them than a line. The
error of a section is that of a median by the means of its stretches, which see noise that is correlated in time. In
between, what a drift may be bent is added, and 1 / sqrt(12) of a step, whose time is not known.

Where the torque stays as the load goes, the discs are pressed together still, and the signal of the load dropped out:

    |z_i - z_0| > 0.3 median |T - z_0|        z_0: of several sections the median nearest to 0, of one 0; T under load
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from twindisc_cli.measurement.sheet import Bools, Floats

UNLOADED = 0.02
"""Share of the nominal load below which a row carries none: the torque of a load being put on is no zero."""
STAYS = 0.3
"""Share of the torque under load by which a section without load may differ from the others: what is off in a zero is
a small part of that torque, what is more is friction."""
FEWEST = 5  # rows: a level and its scatter
_STRETCHES = 20  # means whose scatter shows what a level is worth
_SAME_CREEPAGE = 1.05  # creepages within 5 % are the same both ways
_SURE = 0.01  # share of true levels and lines that are taken for something else
_OF_MEDIAN = float(np.sqrt(np.pi / 2.0))  # standard error of a median over that of the mean, of Gaussian scatter
_EXACT = 1e-9  # of the largest torque: a log without noise is no exacter


@dataclass(frozen=True)
class Zero:
    """The zero [N m] at the mean times of the sections without load [s], its standard errors [N m], each (section,).

    median: of the torque in each section [N m]; between: what is added to the error from each to the next [N m]
    (section - 1,); kind: level, step or drift; rows: how many rows without load.
    """

    time: Floats
    torque: Floats
    error: Floats
    median: Floats
    between: Floats
    kind: str
    rows: int

    def at(self, time: Floats) -> Floats:
        """The zero at times [s], [N m]; before the first and after the last section it is theirs."""
        return np.asarray(np.interp(time, self.time, self.torque))

    def std_at(self, time: Floats) -> Floats:
        """Its standard error at times [s], [N m]."""
        if len(self.time) == 1:
            return np.full(np.shape(time), self.error[0])
        at = np.clip(np.searchsorted(self.time, time) - 1, 0, len(self.between) - 1)
        share = np.clip((time - self.time[at]) / (self.time[at + 1] - self.time[at]), 0.0, 1.0)
        of_ends = np.hypot((1.0 - share) * self.error[at], share * self.error[at + 1])
        of_ends = np.maximum(of_ends, self.error.min()) if self.kind == "level" else of_ends
        return np.hypot(of_ends, self.between[at])

    @property
    def drift(self) -> float:
        """Last less first section [N m]; NaN where only one was recorded."""
        return float(self.median[-1] - self.median[0]) if len(self.time) > 1 else np.nan


def without_load_signal(torque: Floats, load: Floats, nominal: float) -> Bools:
    """Rows (row,) of the sections without load whose torque is that of a load, from torque and load of each (row,)."""
    idle, result = np.abs(load) <= UNLOADED * nominal, np.zeros(len(load), dtype=bool)
    sections = _sections(idle)
    if not sections or np.all(idle):
        return result
    median = np.array([np.median(torque[rows]) for rows in sections])

    def stays(zero: float) -> Bools:
        return np.asarray(np.abs(median - zero) > STAYS * np.median(np.abs(torque[~idle] - zero)))

    loaded = stays(float(median[np.argmin(np.abs(median))]))
    loaded = loaded | stays(0.0) if np.sum(~loaded) == 1 else loaded
    for rows, is_loaded in zip(sections, loaded, strict=True):
        result[rows] = is_loaded
    return result


def find_zero(time: Floats, torque: Floats, load: Floats, nominal: float) -> Zero | None:
    """The zero of a log, each (row,); None where it has no section without load."""
    idle = np.abs(load) <= UNLOADED * nominal
    sections = _sections(idle) if not np.all(idle) else []
    if not sections:
        return None
    at = np.array([time[rows].mean() for rows in sections])
    median = np.array([np.median(torque[rows]) for rows in sections])
    error = _OF_MEDIAN * np.array([_error(torque[rows]) for rows in sections])
    count = sum(rows.stop - rows.start for rows in sections)
    least = _EXACT * (float(np.max(np.abs(torque))) or 1.0)
    return Zero(at, *_curve(at, median, np.maximum(error, least)), count)


def _sections(idle: Bools) -> list[slice]:
    """The stretches of rows without load that are long enough."""
    return [rows for rows in stretches(idle) if rows.stop - rows.start >= FEWEST]


def stretches(mask: Bools) -> list[slice]:
    """Where a mask (row,) holds in rows that follow each other."""
    edges = np.flatnonzero(np.diff(mask, prepend=False, append=False))
    return [slice(int(begin), int(end)) for begin, end in edges.reshape(-1, 2)]


def _curve(at: Floats, median: Floats, error: Floats) -> tuple[Floats, Floats, Floats, Floats, str]:
    """Zero and its error at the sections, the medians, what is added between, and which kind it is."""
    count = len(at)
    level, std = _level(median, error)
    if _bears(median - level, error, count - 1):
        return np.full(count, level), np.full(count, std), median, np.zeros(count - 1), "level"
    if count > 2:
        line = _line(at, median, error)
        steps = [_two_levels(median, error, k) for k in range(1, count)]
        first = int(np.argmin([_chi2(median - values, error) for values, _ in steps])) + 1
        values, stds = steps[first - 1]
        is_step = _chi2(median - values, error) < _chi2(median - line, error)
        if is_step and _bears(median - values, error, count - 2):
            jump = np.where(np.arange(1, count) == first, np.abs(values[first] - values[first - 1]), 0.0)
            return values, stds, median, jump / np.sqrt(12.0), "step"
    return median, error, median, _bent(at, median), "drift"


def _chi2(off: Floats, error: Floats) -> float:
    return float(np.sum((off / error) ** 2))


def _bears(off: Floats, error: Floats, freedom: int) -> bool:
    """Whether the sections lie off a curve by no more than their errors say."""
    return freedom < 1 or _chi2(off, error) <= float(chdtri(freedom, _SURE))


def _level(values: Floats, error: Floats) -> tuple[float, float]:
    """Weighted mean and its standard error."""
    weight = 1.0 / error**2
    return float(np.sum(weight * values) / weight.sum()), float(1.0 / np.sqrt(weight.sum()))


def _two_levels(values: Floats, error: Floats, first: int) -> tuple[Floats, Floats]:
    """A level of the sections before `first` and one of the others, at the sections, with their errors."""
    parts = [(*_level(values[own], error[own]), len(values[own])) for own in (slice(first), slice(first, None))]
    return tuple(np.repeat([part[n] for part in parts], [part[2] for part in parts]) for n in (0, 1))  # type: ignore[return-value]


def _bent(at: Floats, median: Floats) -> Floats:
    """How far a drift may lie off the chord from each section to the next (section - 1,) [N m].

    Of two sections a sixth of the change; of more, the sagitta of the parabola through three.
    """
    if len(at) == 2:
        return np.abs(np.diff(median)) / 6.0
    slope, apart = np.diff(median) / np.diff(at), np.diff(at)
    bend = np.abs(np.diff(slope)) / (apart[1:] + apart[:-1])
    return np.asarray(np.maximum(np.append(bend, 0.0), np.append(0.0, bend)) * apart**2 / 4.0)


def _line(at: Floats, values: Floats, error: Floats) -> Floats:
    """A weighted line through the sections, at them."""
    design = np.column_stack([np.ones(len(at)), (at - at.mean()) / np.ptp(at)])
    covariance = np.linalg.inv(design.T @ (design / error[:, None] ** 2))
    return np.asarray(design @ (covariance @ (design.T @ (values / error**2))))


def _error(values: NDArray[np.float64]) -> float:
    """Standard error of a mean, by the scatter of the means of stretches."""
    stretches = np.array_split(values, min(_STRETCHES, len(values)))
    means = np.array([stretch.mean() for stretch in stretches])
    return float(means.std(ddof=1) / np.sqrt(len(means)))


def zero_of_both_ways(creepage: Floats, ratio: Floats, step: NDArray[np.int64]) -> tuple[float, float] | None:
    """The zero that slip both ways shows, and its standard error, both as T/N; None where none was driven both ways.

    z = (T+ + T-) / 2 over the steps of nearly one size of creepage (step,), from the samples' ratio and step (sample,).
    Of the sizes those above half of the largest, since the least slip is the least sure to be equal both ways. The
    error is the larger of the samples' scatter and of what the sizes disagree by.
    """
    zeros, errors, size = [], [], np.abs(creepage)
    left = [s for s in np.unique(size)[::-1] if s > 0.5 * size.max(initial=0.0)]
    while left:
        chosen = (size <= left[0]) & (size >= left[0] / _SAME_CREEPAGE)
        ways = [ratio[np.isin(step, np.flatnonzero(chosen & (sign * creepage > 0.0)))] for sign in (1.0, -1.0)]
        if min(len(way) for way in ways) >= FEWEST:
            zeros.append(0.5 * float(sum(way.mean() for way in ways)))
            errors.append(0.5 * float(np.hypot(_error(ways[0]), _error(ways[1]))))
        left = [s for s in left if s < left[0] / _SAME_CREEPAGE]
    if not zeros:
        return None
    scatter = float(np.std(zeros, ddof=1)) if len(zeros) > 1 else 0.0
    noise = float(np.sqrt(np.sum(np.square(errors)))) / len(zeros)
    return float(np.mean(zeros)), max(noise, scatter / float(np.sqrt(len(zeros))))
