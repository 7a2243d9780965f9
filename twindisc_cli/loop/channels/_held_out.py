"""Parts of a record that are held out: never at random, since neighbouring samples predict each other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from twindisc_cli.model.experiment import Experiment, Floats, Ints

BANDS = 40  # narrow beside a track, wide beside the roughness
EVERY = 5  # a fifth of the bands is held out


def held_out_bands(y: Floats) -> NDArray[np.bool_]:
    """Every fifth of the bands across the track (sample,)."""
    band = np.floor(BANDS * (y - y.min()) / max(float(np.ptp(y)), 1e-30)).astype(np.int64)
    return np.asarray(band % EVERY == 2)


def held_out_samples(test: Experiment, step: Ints, times: Floats, steps: tuple[int, ...]) -> NDArray[np.bool_]:
    """Samples in the held-out steps; where the program chose these, in the last iteration of the others, too.

    That is held out of a step of three iterations and more, with three samples each.

    Without a time the iteration of a sample is not known: only whole steps are held out.
    """
    held = np.isin(step, steps)
    if test.hold_out_steps is not None:
        return np.asarray(held)
    history = test.history
    last = int(step[~held].max(initial=-1))
    iterations, inside = np.flatnonzero(history.step == last), step == last
    if len(iterations) >= 3 and inside.sum() >= 3 * len(iterations):
        begin = history.end_time[iterations[-1]] - history.duration[iterations[-1]]
        held |= inside & (times > begin * (1.0 + 1e-12))
    return np.asarray(held)
