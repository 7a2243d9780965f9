"""What tachometers add to the creepage of a log, known by whether the traction follows it.

    l = sum(b dv dT) / sum(b^2 dv^2),   s_l = s_T / sqrt(sum(b^2 dv^2))

    dv, dT  creepage and T/N of the samples about a line over time in each step
    b       slope of the creep curve at the step: the smaller one of those to the steps next to it, the origin among
            them; of the largest creepage nothing is known
    l       part of dv that is creepage of the contact and not of its measurement; s_l its standard error

Where a wheel really slips more, the traction follows by the slope of the creep curve, and l is 1; where the tachometers
err, it does not, and l is 0. The smaller slope makes l rather too large, so that a real change is not taken for noise.

Where s_l is too large to tell, dv hardly shows in the traction, but flattens the curve of a model that follows it.
It is then left out where it has no memory, as the slip of a wheel has and a tachometer's error has not.

Source: W. A. Fuller, Measurement Error Models (1987), section 1.1 (the reliability ratio).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twindisc_cli.measurement.sheet import Floats, Ints

FEWEST = 6
"""Samples that a step has at least to say anything."""
KNOWN = 0.2
"""Standard error of l above which the traction decides nothing."""
NOISE = 0.4
"""What l is below by two standard errors where the creepage's scatter is noise, and above where it is slip."""
DRIFTS = 4.0
"""Standard errors from which a step's creepage is said to change with time."""
MEMORY = 4.0
"""Standard errors from which neighbours' scatter of the creepage is said to be correlated."""

ROUNDING = 1e-12  # of a mean; less is no scatter


@dataclass(frozen=True)
class Steadied:
    """Creepages (sample,) without the noise of their measurement.

    std: standard deviation of that noise, 0 where none was taken off; is_noise: whether the traction shows that it is.
    """

    creepage: Floats
    std: float = 0.0
    is_noise: bool = False

    @property
    def note(self) -> str | None:
        """A sentence for the reader; None where the creepages are as recorded."""
        if self.std == 0.0:
            return None
        why = (
            "the traction does not follow: error of the tachometers"
            if self.is_noise
            else "without memory, too little for the traction to separate slip from error of the tachometers"
        )
        size = f"the creepage scatters by {100.0 * self.std:.2g} % within the steps"
        return f"{size} and {why}, the mean of each step is taken"


def steadied(creepage: Floats, ratio: Floats, time: Floats, step: Ints) -> Steadied:
    """Creepages without their noise; as they are where it is slip of the contact, or may be.

    Of each step the mean, or a line over time where it changes for certain. Creepage [1], ratio T/N [1], time [s] and
    step (index from 0), each (sample,).
    """
    slope = _slopes(creepage, ratio, step)
    steady, rest, expected = creepage.copy(), np.zeros_like(ratio), np.zeros_like(ratio)
    free, alike, pairs = 0, 0.0, 0
    for number, b in slope.items():
        here = np.flatnonzero(step == number)
        if len(here) < FEWEST:
            continue
        dv, steady[here] = _about_a_line(time[here], creepage[here])
        rest[here], expected[here] = _about_a_line(time[here], ratio[here])[0], b * dv
        free += len(here) - 2
        alike += float(dv[1:] @ dv[:-1]) / max(float(dv @ dv), 1e-300) * (len(here) - 1)
        pairs += len(here) - 1
    if free < FEWEST:
        return Steadied(creepage)
    std = float(np.sqrt(np.sum((creepage - steady) ** 2) / free))
    weight = float(expected @ expected)
    part = float(expected @ rest) / weight if weight > 0.0 else 0.0
    error = float(np.sqrt(np.sum((rest - part * expected) ** 2) / free / weight)) if weight > 0.0 else np.inf
    if error < KNOWN and part + 2.0 * error < NOISE:
        return Steadied(steady, std, is_noise=True)
    slips = part - 2.0 * error > NOISE or alike > MEMORY * np.sqrt(pairs)
    return Steadied(creepage) if slips or std < ROUNDING else Steadied(steady, std)


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
