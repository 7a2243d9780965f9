"""Long records as means of neighbouring samples: what a channel of any length costs stays bounded.

    x_b = sum of x_i / n_b over the n_b samples of block b,   u_b = sqrt(sum of u_i^2) / n_b

Blocks never cross the end of an iteration, which is where power and friction may jump, nor the end of a profile; inside
one they differ by a sample at most, so that one noise holds for all means. It is estimated from the means themselves,
and what is held out are means. Where the noise has a memory, its neighbours say the same and less than 1 / sqrt(n_b) is
lost; what lasts for less than a block is not seen. Of rounded readings, the error of which a mean does not take out,
the one in the middle of a block is taken.
"""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import numpy as np

from twindisc_cli.loop.channels import channels
from twindisc_cli.model.experiment import Experiment, Floats, Ints
from twindisc_cli.model.rounded import is_coarse, middles

MOST_SAMPLES = 1500
"""Samples of a channel that are kept apart: 25 in each of 60 iterations. Costs go with them, what is seen hardly."""
_PLACES = {"traction": "time", "temperature": "time", "profile": "y"}
"""Channels that may be long, and what their samples follow each other in."""


def averaged(test: Experiment) -> tuple[Experiment, list[str]]:
    """A test in which no channel has many more than MOST_SAMPLES samples, and what is said of those that had.

    Samples without a time are of single points of a curve: they stay.
    """
    measured, notes = test.measured, list[str]()
    for name, place in _PLACES.items():
        samples = channels()[name].samples(test)
        at = None if samples is None else getattr(samples, place)
        if at is None or len(at) <= MOST_SAMPLES or not np.isfinite(at).all():
            continue
        blocks = _blocks(at, _group(test, name, samples), int(np.ceil(len(at) / MOST_SAMPLES)))
        count = int(blocks.max()) + 1
        if count == len(at):
            continue
        begin = f"{test.name}: {len(at)} samples of the {channels()[name].label}"
        if name != "profile" and is_coarse(channels()[name].values(samples)):
            measured = measured.with_samples(name, _some(samples, np.sort(middles(blocks))))
            notes.append(f"{begin} are rounded too far to be averaged: {count} of them are taken")
            continue
        measured = measured.with_samples(name, _means(samples, blocks))
        notes.append(
            f"{begin} are averaged to {count} means, none of them over the end of "
            f"{'a profile' if name == 'profile' else 'an iteration'}; what is shorter is not seen"
        )
    return replace(test, measured=measured), notes


def _group(test: Experiment, name: str, samples: Any) -> Ints:
    """Iteration of each sample, or its profile (sample,)."""
    if name != "profile":
        return np.asarray(test.history.iteration_at(samples.time))
    return np.asarray(np.unique(np.stack([samples.disc, samples.iteration]), axis=1, return_inverse=True)[1]).ravel()


def _blocks(at: Floats, group: Ints, size: int) -> Ints:
    """Number of the block of each sample (sample,): about `size` neighbours of one group."""
    order = np.lexsort((at, group))
    first, count = np.unique(group[order], return_index=True, return_counts=True)[1:]
    parts = np.maximum(np.round(count / size).astype(np.int64), 1)
    own = np.repeat(np.arange(len(count)), count)
    inside = (np.arange(len(at)) - first[own]) * parts[own] // count[own]
    blocks = np.empty(len(at), dtype=np.int64)
    blocks[order] = (np.cumsum(parts) - parts)[own] + inside
    return blocks


def _some(samples: Any, at: Ints) -> Any:
    """Some of the samples, by index (sample,)."""
    return replace(samples, **{column.name: getattr(samples, column.name)[at] for column in fields(samples)})


def _means(samples: Any, blocks: Ints) -> Any:
    """Samples as the means of their blocks; whole numbers, which a block shares, stay what they are."""
    count = np.bincount(blocks)
    columns = {}
    for column in fields(samples):
        values = getattr(samples, column.name)
        if column.name == "uncertainty":
            columns[column.name] = np.sqrt(np.bincount(blocks, values**2)) / count
        elif values.dtype.kind == "i":
            columns[column.name] = values[np.unique(blocks, return_index=True)[1]]
        else:
            columns[column.name] = np.bincount(blocks, values) / count
    return replace(samples, **columns)
