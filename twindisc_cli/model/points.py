"""Operating points: the instants at which the model is evaluated, and where each measured sample lies among them.

An iteration is cut at every sample and at least into a few parts; a point is the interval that ends at `time`. A sample
whose own creepage is not the history's gets a point of no duration, which neither wears nor warms.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twindisc_cli.model.experiment import Experiment, Floats, History, Ints, TractionSamples

FEWEST_PARTS = 4
MOST_CUTS = 4000


@dataclass(frozen=True)
class Points:
    """time [s], duration [s], creepage [1], cycles, iteration (index from 0), each (point,) in order of time.

    of_traction: the point of every traction sample; of_temperature likewise; of_iteration: the last point of each.
    """

    time: Floats
    duration: Floats
    creepage: Floats
    cycles: Floats
    iteration: Ints
    of_traction: Ints
    of_temperature: Ints
    of_iteration: Ints


def operating_points(experiment: Experiment) -> Points:
    """Cut the history of a test at its samples."""
    history, measured = experiment.history, experiment.measured
    ends = history.end_time
    traction_times = sample_times(history, measured.traction)
    temperature_times = measured.temperature.time if measured.temperature else np.empty(0)
    parts = np.linspace(0.0, 1.0, FEWEST_PARTS + 1)[1:]
    regular = ((ends - history.duration)[:, None] + parts * history.duration[:, None]).ravel()
    samples = np.concatenate([traction_times, temperature_times])
    if len(samples) > MOST_CUTS:
        samples = np.empty(0)
    times = _distinct(np.concatenate([regular, samples[(samples > 0.0) & (samples < ends[-1])]]), ends)
    iteration = history.iteration_at(times)
    own = _own_creepage(history, measured.traction, traction_times)
    times, order = _merge(times, traction_times[own])
    iteration = np.concatenate([iteration, history.iteration_at(traction_times[own])])[order]
    creepage = history.creepage[iteration]
    position = np.empty(len(order), dtype=np.int64)
    position[order] = np.arange(len(order))
    extra = position[len(order) - int(own.sum()) :]
    if measured.traction is not None:
        creepage[extra] = measured.traction.creepage[own]
    of_traction = np.clip(np.searchsorted(times, traction_times - 1e-9 * ends[-1]), 0, len(times) - 1)
    of_traction[own] = extra
    duration = np.diff(times, prepend=0.0)
    rate = history.revolutions / history.duration
    return Points(
        time=times,
        duration=duration,
        creepage=creepage,
        cycles=np.cumsum(rate[iteration] * duration),
        iteration=iteration,
        of_traction=of_traction,
        of_temperature=np.clip(np.searchsorted(times, temperature_times - 1e-9 * ends[-1]), 0, len(times) - 1),
        of_iteration=np.searchsorted(times, ends - 1e-9 * ends[-1]),
    )


def sample_times(history: History, samples: TractionSamples | None) -> Floats:
    """Time of every traction sample [s]; where none was recorded, the samples of a step are spread over it."""
    if samples is None:
        return np.empty(0)
    ends, times = history.end_time, samples.time.copy()
    for step in np.unique(samples.step[np.isnan(times)]):
        here = np.isnan(times) & (samples.step == step)
        inside = np.flatnonzero(history.step == step)
        begin, end = ends[inside[0]] - history.duration[inside[0]], ends[inside[-1]]
        times[here] = begin + (end - begin) * (np.arange(int(here.sum())) + 1.0) / int(here.sum())
    return times


def _own_creepage(
    history: History, samples: TractionSamples | None, times: Floats
) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Samples whose creepage is not the one the history has at their time."""
    if samples is None:
        return np.zeros(0, dtype=bool)
    expected = history.creepage[history.iteration_at(times)]
    return np.asarray(np.abs(samples.creepage - expected) > 1e-9)


def _distinct(times: Floats, ends: Floats) -> Floats:
    """Sorted times without near-doubles; the ends of the iterations stay."""
    close = 1e-6 * ends[-1]
    times = np.unique(times)
    far = np.min(np.abs(times[:, None] - ends), axis=1) > close
    inner = times[far]
    inner = inner[np.diff(inner, prepend=-np.inf) > close]
    return np.sort(np.concatenate([inner, ends]))


def _merge(times: Floats, extra: Floats) -> tuple[Floats, Ints]:
    """Both lists in order of time; at equal times the history's point comes first."""
    both = np.concatenate([times, extra])
    order = np.lexsort((np.arange(len(both)) >= len(times), both))
    return both[order], order
