"""Which samples are never used to fit or to choose: whole steps, last iterations, and bands of the profile.

Chosen before anything is fitted and never at random, since neighbouring samples tell about each other: the steps next
to both ends of the range of creepages and the one in the middle, the last iteration of the other steps, and every
fifth band across the track.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from twindisc_cli.effects._effect import Channel
from twindisc_cli.model.experiment import Experiment, Floats, History, Ints
from twindisc_cli.model.points import sample_times

Mask = NDArray[np.bool_]

BANDS = 40
EVERY = 5
MANY_STEPS = 8


def held_out_steps(history: History) -> tuple[int, ...]:
    """Steps held out whole (index from 0): none of the extremes, which say most about both ends of the model.

    Nor the second lowest creepage: what happens below saturation is seen in few steps.
    """
    creepage = history.step_creepage
    count = len(creepage)
    order = np.lexsort((np.arange(count), creepage))
    if count >= MANY_STEPS:
        chosen = [order[2], order[count // 2], order[-2]]
    elif count >= 5:
        chosen = [order[count // 2]]
    else:
        chosen = []
    return tuple(sorted(int(step) for step in chosen))


def training_masks(test: Experiment, steps: tuple[int, ...]) -> Mapping[Channel, Mask]:
    """Samples of every measured channel that may be used to fit (sample,)."""
    masks: dict[Channel, Mask] = {}
    measured = test.measured
    if measured.traction is not None:
        times = sample_times(test.history, measured.traction)
        held = _held(test.history, measured.traction.step, times, steps)
        masks["traction"] = ~_unless_everything(held)
    if measured.profile is not None:
        y = measured.profile.y
        band = np.floor(BANDS * (y - y.min()) / max(float(np.ptp(y)), 1e-30)).astype(np.int64)
        masks["profile"] = ~_unless_everything(band % EVERY == 2)
    if measured.temperature is not None and test.thermal is not None:
        times = measured.temperature.time
        iteration = np.minimum(np.searchsorted(test.history.end_time, times), len(test.history.step) - 1)
        masks["temperature"] = ~_unless_everything(_held(test.history, test.history.step[iteration], times, steps))
    return masks


def _held(history: History, step: Ints, times: Floats, steps: tuple[int, ...]) -> Mask:
    """Samples in the held-out steps, and in the last iteration of the others where these are long enough."""
    held = np.isin(step, steps)
    for number in np.unique(step):
        iterations = np.flatnonzero(history.step == number)
        inside = step == number
        if len(iterations) >= 3 and inside.sum() >= 3 * len(iterations):
            begin = history.end_time[iterations[-1]] - history.duration[iterations[-1]]
            held |= inside & (times > begin * (1.0 + 1e-12))
    return np.asarray(held)


def _unless_everything(held: Mask) -> Mask:
    """Hold nothing out where too little would stay to be fitted."""
    return held if np.sum(~held) >= 8 else np.zeros_like(held)
