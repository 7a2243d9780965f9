"""Which samples are withheld to judge what is found without them: whole steps, last iterations, bands of a profile.

Chosen before anything is fitted and never at random, since neighbouring samples predict each other: of the steps in
order of their creepage a block at each end and one in the middle, the last iteration, and every fifth band across the
track. An end is what a model must extrapolate to.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields, replace

import numpy as np

from twindisc_cli.loop.channels import channels, measured_channels
from twindisc_cli.loop.noise import Mask
from twindisc_cli.model.experiment import Experiment, History

FEW_STEPS, SOME_STEPS, MANY_STEPS = 5, 8, 24
"""Steps from which on one, two and three blocks of them are held out."""
FEWEST_LEFT = 8
"""Nothing is held out of a channel where fewer samples would stay to be fitted."""


def held_out_steps(history: History) -> tuple[int, ...]:
    """Steps held out whole (index from 0): the lowest, the highest and the middle creepages, and no pause.

    A 24th of the steps each, one at least; of fewer than 24 steps both ends, of fewer than eight the middle one, of
    fewer than five none.
    """
    driven = np.flatnonzero(history.step_driven)
    count = len(driven)
    order = driven[np.lexsort((driven, np.abs(history.step_creepage[driven])))]
    size = max(count // MANY_STEPS, 1)
    middle = (count - size + 1) // 2
    chosen: list[int] = []
    if count >= SOME_STEPS:
        chosen += [*order[:size], *order[count - size :]]
    if count >= MANY_STEPS or FEW_STEPS <= count < SOME_STEPS:
        chosen += [*order[middle : middle + size]]
    return tuple(sorted(int(step) for step in chosen))


def steps_withheld(test: Experiment) -> tuple[int, ...]:
    """The steps held out whole: those that the definition asks for, else those chosen here."""
    return held_out_steps(test.history) if test.hold_out_steps is None else test.hold_out_steps


def withheld(test: Experiment) -> dict[str, Mask]:
    """Samples of every measured channel that are held out (sample,); none where the definition asks for none."""
    steps = steps_withheld(test)
    masks = {name: channels()[name].withheld(test, steps) for name in measured_channels(test)}
    if test.hold_out_steps == ():
        return {name: np.zeros_like(mask) for name, mask in masks.items()}
    return {name: mask if np.sum(~mask) >= FEWEST_LEFT else np.zeros_like(mask) for name, mask in masks.items()}


def without(test: Experiment, masks: Mapping[str, Mask]) -> Experiment:
    """The test as if the samples of these masks had never been measured."""
    measured = test.measured
    for name, dropped in masks.items():
        samples = channels()[name].samples(test)
        kept = {column.name: getattr(samples, column.name)[~dropped] for column in fields(samples)}
        measured = measured.with_samples(name, replace(samples, **kept))
    return replace(test, measured=measured)


def holds_out(masks: Sequence[Mapping[str, Mask]]) -> bool:
    """Whether any sample of any test is withheld; masks by channel, of each test."""
    return any(mask.any() for test in masks for mask in test.values())
