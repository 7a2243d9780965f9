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
DISTINCT, STRETCH = 0.5, 20
"""Share of the others that differ from each other, of readings of fine resolution, and among how many in a row: a long
record repeats each of its numbers, however fine they are."""
TURNING = 0.25
"""Share of the others, at least, behind which a rise turns into a fall or the reverse: of white noise two thirds."""
BETWEEN = 2
"""Half of the number of rows between readings at a limit that are one-sided."""


def at_limit(readings: Floats) -> Bools:
    """Readings (row,) that equal the largest or the smallest, where this is a limit, and those between."""
    result = np.zeros(len(readings), dtype=bool)
    for extreme in (readings.max(initial=-np.inf), readings.min(initial=np.inf)):
        equal = readings == extreme
        if np.sum(equal) >= FEWEST_EQUAL and _is_limit(float(extreme), readings[~equal], int(np.sum(equal))):
            result |= equal | binary_closing(equal, iterations=BETWEEN)
    return result


def _is_limit(extreme: float, others: Floats, equal: int) -> bool:
    """Whether an extreme is farther from 0 than most others, and these scatter so that it would not be read that often.

    Discs that roll without traction, and a rig at rest, give a small number again and again.
    """
    beyond = len(others) > 0 and abs(extreme) > np.median(np.abs(others))
    return beyond and scatter(others) and equal >= OFTEN * int(np.unique(others, return_counts=True)[1].max())


def scatter(readings: Floats) -> bool:
    """Whether readings (row,) are of fine resolution and scatter, and are enough to show it."""
    if len(readings) < FEWEST_OTHERS:
        return False
    change, length = np.diff(readings), min(len(readings), STRETCH)
    stretches = np.sort(readings[: len(readings) // length * length].reshape(-1, length), axis=1)
    distinct = 1.0 + np.mean(np.sum(np.diff(stretches, axis=1) > 0.0, axis=1))
    turning = np.sum(change[1:] * change[:-1] < 0.0) / len(readings)
    return bool(distinct >= DISTINCT * length and turning >= TURNING)
