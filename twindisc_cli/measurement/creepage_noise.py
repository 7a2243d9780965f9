"""What tachometers add to the creepage of a log, told by whether the traction follows it.

    l = sum(b dv dT) / sum(b^2 dv^2),   s_l = s_T / sqrt(sum(b^2 dv^2))

    dv, dT  creepage and T/N of the samples about a line over time in each step
    b       slope of the creep curve at the step: the smaller one of those to the steps next to it, the origin among
            them; of the largest creepage nothing is known
    l       part of dv that is creepage of the contact and not of its measurement; s_l its standard error

Where a wheel really slips more, the traction follows by the slope of the creep curve, and l is 1; where the tachometers
err, it does not, and l is 0. The smaller slope makes l rather too large, so that a real change is not taken for noise.

Source: W. A. Fuller, Measurement Error Models (1987), section 1.1 (the reliability ratio).
"""

from __future__ import annotations

import numpy as np

from twindisc_cli.measurement.sheet import Floats, Ints

FEWEST = 6
"""Samples that a step has at least to say anything."""
KNOWN = 0.2
"""Standard error of l above which nothing is said."""
NOISE = 0.4
"""Two standard errors above l are below this where the creepage's scatter is noise."""
DRIFTS = 4.0
"""Standard errors from which a step's creepage is said to change with time."""


def steadied(creepage: Floats, ratio: Floats, time: Floats, step: Ints) -> tuple[Floats, float]:
    """Creepages (sample,) without their noise, and its standard deviation; as they are, and 0, where it is not known.

    Of each step the mean, or a line over time where it changes for certain. Creepage [1], ratio T/N [1], time [s] and
    step (index from 0), each (sample,).
    """
    slope = _slopes(creepage, ratio, step)
    steady, rest, expected = creepage.copy(), np.zeros_like(ratio), np.zeros_like(ratio)
    free = 0
    for number, b in slope.items():
        here = np.flatnonzero(step == number)
        if len(here) < FEWEST:
            continue
        dv, steady[here] = _about_a_line(time[here], creepage[here])
        rest[here], expected[here] = _about_a_line(time[here], ratio[here])[0], b * dv
        free += len(here) - 2
    weight = float(expected @ expected)
    if free < FEWEST or weight == 0.0:
        return creepage, 0.0
    part = float(expected @ rest) / weight
    error = float(np.sqrt(np.sum((rest - part * expected) ** 2) / free / weight))
    if error > KNOWN or part + 2.0 * error > NOISE:
        return creepage, 0.0
    return steady, float(np.sqrt(np.sum((creepage - steady) ** 2) / free))


def _slopes(creepage: Floats, ratio: Floats, step: Ints) -> dict[int, float]:
    """Slope of the creep curve at each step, the smaller of those to its neighbours on the curve."""
    numbers = np.unique(step)
    v = np.array([abs(creepage[step == number].mean()) for number in numbers])
    size = np.array([abs(ratio[step == number].mean()) for number in numbers])
    levels = np.concatenate([[0.0], np.unique(np.round(v, 5))])
    curve = np.array([0.0, *(size[np.round(v, 5) == level].mean() for level in levels[1:])])
    between = np.append(np.diff(curve) / np.maximum(np.diff(levels), 1e-9), 0.0)
    at = np.searchsorted(levels, np.round(v, 5))
    least = np.minimum(np.abs(between[at - 1]), np.abs(between[at]))
    return {int(number): float(b) for number, b in zip(numbers, least, strict=True)}


def _about_a_line(time: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Values about a line over time, and the level without noise: the line where it is sure to rise, else the mean."""
    clock = time - time.mean()
    spread = max(float(clock @ clock), 1e-300)
    slope = float(clock @ values) / spread
    rest = values - values.mean() - slope * clock
    error = float(np.sqrt(rest @ rest / max(len(values) - 2, 1) / spread))
    sure = abs(slope) > DRIFTS * error
    return rest, values.mean() + slope * clock * sure
