"""The noise of rounded readings, whose error lasts as long as what is measured stays where it is.

    corr(e_i, e_j) = f exp(-|y_i - y_j| / m q) for samples of one reading, 0 for others, and for those of another step

    q   smallest change of the readings, y what is measured, f share of what lasts in the variance, m the memory

Where y stands between two readings is not known, so that the errors of different readings have nothing in common. While
y passes from one to the next, the error goes from half a step to half a step the other way.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from twindisc_cli.loop.noise import Mask, Noise, Slow
from twindisc_cli.loop.noise_estimate import FAR, detrended
from twindisc_cli.model.experiment import Floats, Ints
from twindisc_cli.model.rounded import is_coarse, lasting, scatter_before, step_of, usual

MEMORY = 0.25
"""Of the error, in steps of the reading: a straight rise through one step is then as likely as white noise."""
APART = 16.0
"""From one reading to the next, in such steps: nothing in common."""
UNSEEN = 0.5
"""By how much what is measured changes when a step begins and no reading does, in steps of the reading."""
FEW = 0.1
"""Of the step: scatter before the rounding below which few readings jump to the next and back. They are left out."""


def with_rounding(noise: Noise, readings: Floats, trend: Floats, step: Ints) -> Noise:
    """The noise of readings (sample,), in order of time, no less than their rounding; what lasts of it is slow.

    trend: the richest that they may follow (sample, column); step: of the history (sample,), at the change of which
    what is measured may change by less than a reading. A jump to the next reading is neither an outlier nor new.
    Noise that is known, and beside which the rounding is the lesser part, stays as it is.
    """
    if not is_coarse(readings):
        return noise
    size, before = step_of(readings), scatter_before(readings)
    rare = before < FEW * size
    rounded = float(np.hypot(size / np.sqrt(12.0), before))
    std = max(noise.std, rounded) if noise.estimated else rounded
    if size**2 / 12.0 < 0.5 * std**2:
        return noise
    share = lasting(size, 0.0 if rare else before) / std**2
    level = usual(readings)
    kept = np.abs(readings - level) <= FAR * std
    if rare:
        kept &= (readings == level) | ~_there_and_back(readings)
        level = np.where(kept, readings, level)
    course = readings - detrended(readings, trend, kept)
    begins = np.diff(step, prepend=step[0] - 1) != 0
    new = begins | (np.diff(level, prepend=level[0]) != 0.0)
    seen = np.abs(np.diff(course, prepend=course[0])) / size
    position = np.cumsum(seen + APART * new) + UNSEEN * _settling(new, begins)
    slow = Slow(share, (MEMORY,))
    known = replace(noise, std=std, correlation=share, cautious=None, estimated=True, rivals=())
    return replace(known, kept=kept, position=position, slow=slow, rounded=size)


def _settling(new: Mask, begins: Mask) -> Floats:
    """How far what is measured has settled (sample,), in runs of one reading with which a step begins, from 0 to 1.

    new, begins: where a run begins, and a step.
    """
    run = np.cumsum(new) - 1
    first = np.flatnonzero(new)
    since = np.log1p(np.arange(len(run)) - first[run])
    return np.asarray(begins[first][run] * since / np.log1p(np.bincount(run))[run])


def _there_and_back(readings: Floats) -> Mask:
    """Samples of a run of one reading between two runs of another one (sample,)."""
    begin = np.flatnonzero(np.diff(readings, prepend=np.nan) != 0.0)
    value = readings[begin]
    back = np.zeros(len(begin), dtype=bool)
    back[1:-1] = value[:-2] == value[2:]
    return np.repeat(back, np.diff(begin, append=len(readings)))
