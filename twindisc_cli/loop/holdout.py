"""Which samples are withheld to judge what is found without them: whole steps, last iterations, bands of a profile.

Chosen before anything is fitted and never at random, since neighbouring samples tell about each other: the steps next
to both ends of the range of creepages and the one in the middle, the last iteration of every second other step, and
every fifth band across the track.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace

import numpy as np

from twindisc_cli.loop.channels import channels, measured_channels
from twindisc_cli.loop.noise import Mask
from twindisc_cli.model.experiment import Experiment, History

MANY_STEPS = 8
FEWEST_LEFT = 8
"""Nothing is held out of a channel where fewer samples would stay to be fitted."""


def held_out_steps(history: History) -> tuple[int, ...]:
    """Steps held out whole (index from 0): by the size of the creepage none of the extremes, and no pause.

    The extremes say most about both ends of the model. Nor is the second lowest creepage held out: what happens below
    saturation is seen in few steps.
    """
    driven = np.flatnonzero(history.step_driven)
    count = len(driven)
    order = driven[np.lexsort((driven, np.abs(history.step_creepage[driven])))]
    if count >= MANY_STEPS:
        chosen = [order[2], order[count // 2], order[-2]]
    elif count >= 5:
        chosen = [order[count // 2]]
    else:
        chosen = []
    return tuple(sorted(int(step) for step in chosen))


def steps_withheld(test: Experiment) -> tuple[int, ...]:
    """The steps held out whole: those that the definition asks for, else those chosen here."""
    return test.hold_out_steps or held_out_steps(test.history)


def withheld(test: Experiment) -> dict[str, Mask]:
    """Samples of every measured channel that are held out (sample,)."""
    steps = steps_withheld(test)
    masks = {name: channels()[name].withheld(test, steps) for name in measured_channels(test)}
    return {name: mask if np.sum(~mask) >= FEWEST_LEFT else np.zeros_like(mask) for name, mask in masks.items()}


def without(test: Experiment, masks: Mapping[str, Mask]) -> Experiment:
    """The test as if the samples of these masks had never been measured."""
    measured = test.measured
    for name, dropped in masks.items():
        samples = channels()[name].samples(test)
        kept = {column.name: getattr(samples, column.name)[~dropped] for column in fields(samples)}
        measured = measured.with_samples(name, replace(samples, **kept))
    return replace(test, measured=measured)
