"""Parts of a record that are held out: never at random, since neighbouring samples tell about each other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from twindisc_cli.model.experiment import Floats, History, Ints

BANDS = 40
EVERY = 5


def held_out_bands(y: Floats) -> NDArray[np.bool_]:
    """Every fifth of the bands across the track (sample,)."""
    band = np.floor(BANDS * (y - y.min()) / max(float(np.ptp(y)), 1e-30)).astype(np.int64)
    return np.asarray(band % EVERY == 2)


def held_out_samples(history: History, step: Ints, times: Floats, steps: tuple[int, ...]) -> NDArray[np.bool_]:
    """Samples in the held-out steps, and in the last iteration of every second other one that is long enough.

    Without a time the iteration of a sample is not known: only whole steps are held out.
    """
    held = np.isin(step, steps)
    others = np.setdiff1d(step, steps)
    for number in others[1::2]:
        iterations = np.flatnonzero(history.step == number)
        inside = step == number
        if len(iterations) >= 3 and inside.sum() >= 3 * len(iterations):
            begin = history.end_time[iterations[-1]] - history.duration[iterations[-1]]
            held |= inside & (times > begin * (1.0 + 1e-12))
    return np.asarray(held)
