"""Which samples of a record are held out, as masks (sample,) by channel. Chosen by SEED, before anything is fitted."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from twindisc_cli.loop.channels import channels, measured_channels
from twindisc_cli.loop.holdout import without
from twindisc_cli.model.experiment import Experiment
from twindisc_cli.model.points import sample_times

from .student import varies

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]
SEED = 2006
BLOCKS, FOLDS = 3, 5
FEWEST_KNOWN = 5
"""A split that would leave fewer samples of the traction is left out."""
LOCOMOTIVE = (0.01, 0.06)
"""Where the locomotive's curve is cut: it rises, is flat, and falls."""


def held_out(test: Experiment, kind: str) -> Iterator[tuple[str, Mapping[str, Mask]]]:
    """Name and held-out samples of each split of one kind, `blocks` or `folds`."""
    place = _places(test)
    for number in range(BLOCKS if kind == "blocks" else FOLDS):
        masks = {c: (_block(test, x) if kind == "blocks" else _fold(x)) == number for c, x in place.items()}
        if np.sum(~masks["traction"]) < FEWEST_KNOWN or not masks["traction"].any():
            continue
        yield f"{kind[:-1]} {number + 1}", masks


def part(test: Experiment, parts: int, number: int, *, seed: int) -> Experiment:
    """One of several parts of the samples of every channel, pairs of neighbours drawn at random; together the whole."""
    masks = {}
    for channel in measured_channels(test):
        count = len(channels()[channel].values(channels()[channel].samples(test)))
        drawn = np.random.default_rng(seed).integers(0, parts, count // 2 + 1)
        masks[channel] = np.repeat(drawn, 2)[:count] != number
    return without(test, masks)


def by_creepage(test: Experiment) -> bool:
    """Whether a record goes over the creepage; else over time."""
    samples = test.measured.traction
    assert samples is not None
    return varies(samples.creepage)


def _places(test: Experiment) -> dict[str, Floats]:
    """Creepage or time of the samples of every channel (sample,); of other channels as the history has it."""
    samples, history = test.measured.traction, test.history
    assert samples is not None
    found = {"traction": samples.creepage if by_creepage(test) else sample_times(history, samples)}
    if test.measured.temperature is not None:
        time = test.measured.temperature.time
        found["temperature"] = history.creepage[history.iteration_at(time)] if by_creepage(test) else time
    return found


def _block(test: Experiment, place: Floats) -> Floats:
    """Number of the block of each sample: thirds of the creepage's logarithm or of the time, both ends among them."""
    if test.name == "eurosprinter":
        return np.searchsorted(LOCOMOTIVE, place).astype(float)
    x = np.log(np.abs(place)) if by_creepage(test) else place
    edges = np.linspace(x.min(), x.max(), BLOCKS + 1)[1:-1]
    return np.searchsorted(edges, x).astype(float)


def _fold(place: Floats) -> Floats:
    """Number of the fold of each sample, drawn at random."""
    return np.random.default_rng(SEED).permutation(np.arange(len(place)) % FOLDS).astype(float)
