"""Which samples are withheld to judge what is found without them: whole steps, last iterations, bands of a profile.

Chosen before anything is fitted and never at random, since neighbouring samples tell about each other: the steps next
to both ends of the range of creepages and the one in the middle, the last iteration of every second other step, and
every fifth band across the track.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import TypeVar

import numpy as np

from twindisc_cli.effects._effect import Channel
from twindisc_cli.loop.noise import Mask
from twindisc_cli.model.experiment import (
    Experiment,
    Floats,
    History,
    Ints,
    ProfileSamples,
    TemperatureSamples,
    TractionSamples,
)

Samples = TypeVar("Samples", TractionSamples, ProfileSamples, TemperatureSamples)

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


def withheld(test: Experiment) -> dict[Channel, Mask]:
    """Samples of every measured channel that are held out (sample,)."""
    masks: dict[Channel, Mask] = {}
    measured, history, steps = test.measured, test.history, steps_withheld(test)
    if measured.traction is not None:
        masks["traction"] = _withheld(history, measured.traction.step, measured.traction.time, steps)
    if measured.profile is not None:
        y = measured.profile.y
        band = np.floor(BANDS * (y - y.min()) / max(float(np.ptp(y)), 1e-30)).astype(np.int64)
        masks["profile"] = np.asarray(band % EVERY == 2)
    if measured.temperature is not None:
        times = measured.temperature.time
        step = history.step[history.iteration_at(times)]
        masks["temperature"] = _withheld(history, step, times, steps)
    return {channel: _unless_everything(mask) for channel, mask in masks.items()}


def without(test: Experiment, masks: Mapping[Channel, Mask]) -> Experiment:
    """The test as if the samples of these masks had never been measured."""
    measured = test.measured
    return replace(
        test,
        measured=replace(
            measured,
            traction=_only(measured.traction, masks.get("traction")),
            profile=_only(measured.profile, masks.get("profile")),
            temperature=_only(measured.temperature, masks.get("temperature")),
        ),
    )


def _only(samples: Samples | None, dropped: Mask | None) -> Samples | None:
    """A table of samples, every column of it, without those that are dropped."""
    if samples is None or dropped is None:
        return samples
    return replace(samples, **{column.name: getattr(samples, column.name)[~dropped] for column in fields(samples)})


def steps_withheld(test: Experiment) -> tuple[int, ...]:
    """The steps held out whole: those that the definition asks for, else those chosen here."""
    return test.hold_out_steps or held_out_steps(test.history)


def _withheld(history: History, step: Ints, times: Floats, steps: tuple[int, ...]) -> Mask:
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


def _unless_everything(held: Mask) -> Mask:
    """Hold nothing out where too little would stay to be fitted."""
    return held if np.sum(~held) >= 8 else np.zeros_like(held)
