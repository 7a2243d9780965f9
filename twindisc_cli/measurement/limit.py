"""Readings at the limit of an instrument: beyond the end of its range it gives the same number for whatever it sees.

Such rows are no measurements: they have no scatter, and what they would have been is not known. Readings of fine
resolution that scatter do not repeat one number; where many of them equal the largest or the smallest, it is a limit.
What is read between such rows scattered away from the limit, and is one-sided.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import binary_closing

from twindisc_cli.measurement.sheet import Bools, Floats

LIMIT = "at the limit of the instrument"
"""Why a row was left out."""
FEWEST_EQUAL, FEWEST_OTHERS = 5, 10
"""Equal readings that show a limit, and others that show how these scatter."""
OFTEN = 4
"""How often a limit is read, over the most frequent of the other readings."""
DISTINCT = 0.5
"""Share of the others that differ from each other, of readings of fine resolution."""
TURNING = 0.25
"""Share of the others, at least, behind which a rise turns into a fall or the reverse: of white noise two thirds."""
BETWEEN = 2
"""Half of the number of rows between readings at a limit that are one-sided."""


def at_limit(readings: Floats) -> Bools:
    """Readings (row,) that equal the largest or the smallest, where this is a limit and not 0, and those between."""
    result = np.zeros(len(readings), dtype=bool)
    for extreme in (readings.max(initial=-np.inf), readings.min(initial=np.inf)):
        equal = readings == extreme
        if extreme != 0.0 and np.sum(equal) >= FEWEST_EQUAL and _scatter(readings[~equal], int(np.sum(equal))):
            result |= equal | binary_closing(equal, iterations=BETWEEN)
    return result


def _scatter(others: Floats, equal: int) -> bool:
    """Whether the readings that are not the extreme scatter so that it would not be read that often."""
    return scatter(others) and equal >= OFTEN * int(np.unique(others, return_counts=True)[1].max())


def scatter(readings: Floats) -> bool:
    """Whether readings (row,) are of fine resolution and scatter, and are enough to show it."""
    if len(readings) < FEWEST_OTHERS:
        return False
    change, distinct = np.diff(readings), len(np.unique(readings))
    turning = np.sum(change[1:] * change[:-1] < 0.0) / len(readings)
    return bool(distinct >= DISTINCT * len(readings) and turning >= TURNING)
