"""Rounded readings: of a thermometer in whole degrees, the error of one reading is that of the next, it lasts.

    e = (q / pi) sum_k (-1)^k / k sin(2 pi k y / q),   of whose mean exp(-2 (pi k s / q)^2) is left

    q   smallest step of the readings, y what is measured, s standard deviation of what scatters before it is rounded

Source: B. Widrow, I. Kollar, M.-C. Liu, IEEE Trans. Instrum. Meas. 45 (1996) 353-361.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import median_filter

from twindisc_cli.model.experiment import Floats, Ints

FEWEST_CHANGES = 8
"""Changes of the reading that must be whole steps: of half the step, one record in 256 would show none."""
WHOLE = 1e-6
"""Part of a step by which a change may miss a whole number of them."""
NEIGHBOURS = 9
"""Samples in whose median a reading is the same though single ones jump to the next."""
_HARMONICS = np.arange(1, 65)


def step_of(readings: Floats) -> float:
    """Smallest step of readings (sample,) in order of time; 0 where they are not seen to be rounded."""
    changes = np.abs(np.diff(readings))
    changes = changes[changes > WHOLE * np.ptp(readings)]
    if len(changes) < FEWEST_CHANGES:
        return 0.0
    steps = changes / changes.min()
    return float(changes.min()) if np.all(np.abs(steps - np.round(steps)) < WHOLE * steps.max()) else 0.0


def usual(readings: Floats) -> Floats:
    """What most readings about each one are (sample,)."""
    return np.asarray(median_filter(readings, NEIGHBOURS, mode="nearest"))


def scatter_before(readings: Floats) -> float:
    """Standard deviation of what scatters before the rounding, by readings (sample,) in order of time.

    By how often they go a step and come back: normal scatter s changes a reading 2 s / (sqrt(pi) q) times a sample in
    the mean, wherever what is measured stands between two of them.
    """
    change = np.diff(readings)
    change = change[change != 0.0]
    back = np.sum(change[1:] * change[:-1] < 0.0)
    return float(0.5 * np.sqrt(np.pi) * step_of(readings) * back / len(readings))


def is_coarse(readings: Floats) -> bool:
    """Whether the rounding is most of what scatters in readings (sample,) in order of time."""
    return bool(scatter_before(readings) < step_of(readings) / np.sqrt(12.0))


def lasting(step: float, before: float) -> float:
    """Variance of what lasts of the error, by the step of the readings and what scatters before the rounding."""
    waves = step / (np.pi * _HARMONICS) * np.exp(-2.0 * (np.pi * _HARMONICS * before / step) ** 2)
    return 0.5 * float(waves @ waves)


def middles(block: Ints) -> Ints:
    """Index of the sample in the middle of each block (block,), of blocks (sample,) numbered from 0 in their order."""
    first, count = np.unique(block, return_index=True, return_counts=True)[1:]
    return np.asarray(first + (count - 1) // 2)
