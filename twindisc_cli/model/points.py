"""Operating points: the instants at which the model is evaluated, and where each measured sample lies among them.

An iteration is cut into a few equal parts, and further at its samples; where these are more than its share of
MOST_PARTS, at the first in every such part, so that a flood of samples is no flood of points. A point is the interval
that ends at `time`; a sample between two points is read on the line through them. A sample whose own creepage is not
the history's gets a point of no duration, which neither wears nor warms.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from twindisc_cli.effects._state import summed
from twindisc_cli.model.experiment import Experiment, Floats, History, Ints, RecordedColumn, TractionSamples

Mask = NDArray[np.bool_]

ROUNDED = 0.5
"""Of an iteration, by which the time of a sample may lie outside its step: clocks of two recorders, rounding."""
FEWEST_PARTS = 4  # operating points of an iteration without samples
MOST_PARTS = 768
"""Parts of the whole history that samples may cut: a sample is at most two of them from its points, so that the line
between these errs by (2 T / (768 tau))^2 / 8 of what relaxes with a time constant tau; 3e-3 for tau = T/60. In seven
synthetic tests samples moved by at most 0.13 of the noise against 4096 parts, in the mean square by 0.003."""
OF_STRIPS, FEWEST_OF_STRIPS = 320, 6
"""Points of the history, and of an iteration at least, at which the strips of a patch are asked one by one: between
them the mean over the strips is on a line, which errs less than the integration of the wear."""


@dataclass(frozen=True)
class Reading:
    """Where samples lie: `part` of the way from point `other` to point `of`, each (sample,); beyond 1 past `of`."""

    of: Ints
    other: Ints
    part: Floats

    def __call__(self, values: Floats) -> Floats:
        """Values (set, point) at the samples, (set, sample)."""
        if np.all(self.part == 1.0):
            return np.asarray(values[:, self.of])
        return np.asarray(self.part * values[:, self.of] + (1.0 - self.part) * values[:, self.other])


@dataclass(frozen=True)
class Points:
    """time [s], duration [s], creepage [1], cycles, iteration (index from 0), each (point,) in order of time.

    begins: 1 where a test begins, otherwise 0; own_time: time since then [s]; cycles are counted from there.
    time_in_step: time since the creepage of the history changed [s]; time_since_pause: since the test began or went on
    after a pause, 0 in it [s]; greatest_creepage: the largest of the history so far, without its sign [1]; order:
    number of the step, from 1; direction of the last change of the creepage's size: 1 up, -1 down, 0 before all;
    columns of the user's file; each (point,).
    of_traction: the point of every traction sample; of_temperature likewise; of_iteration: the last point of each.
    of_cut: the points at which the history is cut, which are all but those of samples with a creepage of their own.
    of_strips: of these, some of each iteration, its first and its last among them.
    traction, temperature: how values at the points are read at the samples; strips: how those of_strips at all points.
    """

    time: Floats
    own_time: Floats
    begins: Floats
    duration: Floats
    creepage: Floats
    cycles: Floats
    iteration: Ints
    time_in_step: Floats
    time_since_pause: Floats
    greatest_creepage: Floats
    order: Floats
    direction: Floats
    columns: Mapping[str, Floats]
    of_traction: Ints
    of_temperature: Ints
    of_iteration: Ints
    of_cut: Ints
    of_strips: Ints
    traction: Reading
    temperature: Reading
    strips: Reading

    def reading(self, history: History, times: Floats, *, within: bool) -> Reading:
        """Where samples at times [s] (sample,) lie; `within`: between points of their own iteration."""
        return _replaced(_reading(history, self.time[self.of_cut], times, within=within), self.of_cut)


def operating_points(experiment: Experiment) -> Points:
    """Cut the history of a test at its samples."""
    history, measured = experiment.history, experiment.measured
    ends = history.end_time
    traction_times = sample_times(history, measured.traction)
    temperature_times = measured.temperature.time if measured.temperature else np.empty(0)
    others = [np.asarray(getattr(samples, "time", [])) for samples in measured.others.values()]
    cuts = _cuts(history, np.concatenate([traction_times, temperature_times, *others]))
    own = _own_creepage(history, measured.traction, traction_times)
    times, place = _merge(cuts, traction_times[own])
    of_cut, of_own = place[: len(cuts)], place[len(cuts) :]
    iteration = np.empty(len(times), dtype=np.int64)
    iteration[of_cut], iteration[of_own] = history.iteration_at(cuts), history.iteration_at(traction_times[own])
    creepage = history.creepage[iteration]
    if measured.traction is not None:
        creepage[of_own] = measured.traction.creepage[own]
    duration = np.diff(times, prepend=0.0)
    rate = history.revolutions / history.duration
    begin = ends - history.duration
    begins = np.diff(history.begin_time[iteration], prepend=-1.0) != 0.0
    changed = np.concatenate([[True], np.diff(history.creepage) != 0.0]) | (begin == history.begin_time)
    went_on = (begin == history.begin_time) | (np.diff(history.driven, prepend=False) & history.driven)

    def since(begun: Mask) -> Floats:
        return np.asarray(times - np.maximum.accumulate(np.where(begun, begin, 0.0))[iteration])

    traction = _replaced(_reading(history, cuts, traction_times, within=True), of_cut, own, of_own)
    temperature = _replaced(_reading(history, cuts, temperature_times, within=False), of_cut)
    of_strips = of_cut[_few(iteration[of_cut], max(FEWEST_OF_STRIPS, OF_STRIPS // len(ends)))]
    return Points(
        time=times,
        own_time=times - history.begin_time[iteration],
        begins=begins.astype(float),
        duration=duration,
        creepage=creepage,
        cycles=summed(rate[iteration] * duration, begins),
        iteration=iteration,
        time_in_step=since(changed),
        time_since_pause=np.where(history.driven[iteration], since(went_on), 0.0),
        greatest_creepage=_greatest(history)[iteration],
        order=np.asarray(history.step[iteration], dtype=float) + 1.0,
        direction=_direction(history)[iteration],
        columns={name: _at(column, times, history.step[iteration]) for name, column in measured.columns.items()},
        of_traction=traction.of,
        of_temperature=temperature.of,
        of_iteration=of_cut[np.searchsorted(cuts, ends - history.slack)],
        of_cut=of_cut,
        of_strips=of_strips,
        traction=traction,
        temperature=temperature,
        strips=_reading(history, times[of_strips], times, within=False),
    )


def _few(iteration: Ints, most: int) -> Ints:
    """Places of so many points of each iteration (point,) at most, evenly among them, with the first and the last."""
    begin, count = np.unique(iteration, return_index=True, return_counts=True)[1:]
    share = np.linspace(0.0, 1.0, most)
    return np.unique(begin[:, None] + np.round((count[:, None] - 1) * share).astype(np.int64))


def _at(column: RecordedColumn, times: Floats, steps: Ints) -> Floats:
    """A column at the points (point,): on the line between the rows of their step; of all where it has none."""
    result = np.empty(len(times))
    for step in np.unique(steps):
        points, rows = steps == step, column.step == step
        rows = rows if np.any(rows) else np.ones_like(rows)
        result[points] = np.interp(times[points], column.time[rows], column.values[rows])
    return result


def _greatest(history: History) -> Floats:
    """Largest creepage of each test so far, without its sign (iteration,)."""
    size = np.abs(history.creepage)
    return size if history.separate else np.asarray(np.maximum.accumulate(size))


def _direction(history: History) -> Floats:
    """Sign of the last change of the creepage's size in each test (iteration,); pauses change nothing.

    A test begins at rest: its first creepage has grown from 0.
    """
    result, last, sign = np.zeros(len(history.step)), 0.0, 0.0
    begins = np.diff(history.begin_time, prepend=-1.0) != 0.0
    for i, size in enumerate(np.abs(history.creepage)):
        last, sign = (0.0, 0.0) if begins[i] else (last, sign)
        if history.driven[i]:
            sign = float(np.sign(size - last)) or sign
            last = size
        result[i] = sign
    return result


def stand_for_steps(history: History, samples: TractionSamples) -> bool:
    """Whether samples without a time are means of steps whose place in time is known: one of each step.

    It is not known of steps that are separate, that were found in the samples, whose creepage rises or falls
    throughout, as in a curve that was put in order, or is that of other steps without a sample.
    """
    if np.isfinite(samples.time).any() or history.separate or history.per_iteration is not None:
        return False
    sampled, count = np.unique(samples.step, return_counts=True)
    creepage, others = history.step_creepage[sampled], np.delete(history.step_creepage, sampled)
    orders = [np.diff(values) for values in (creepage, np.abs(creepage))]
    in_order = any(np.all(order >= 0.0) or np.all(order <= 0.0) for order in orders)
    is_curve = np.ptp(creepage) > 0.0 and in_order
    return bool(count.max() == 1 and not is_curve and not np.isin(creepage, others).any())


def knows_times(history: History, samples: TractionSamples) -> bool:
    """Whether samples are known to be of a time each, or of a step."""
    return bool(np.isfinite(samples.time).all()) or stand_for_steps(history, samples)


def sample_times(history: History, samples: TractionSamples | None) -> Floats:
    """Time of every traction sample [s]; where none was recorded, the samples of a step are spread over it.

    One that is the mean of its step is at the middle of it, where what changes evenly has its mean. A time that is
    rounded over the beginning or the end of its step is there.
    """
    if samples is None:
        return np.empty(0)
    ends, times = history.end_time, samples.time.copy()
    last = 0.5 if stand_for_steps(history, samples) else 1.0
    for step in np.unique(samples.step[np.isnan(times)]):
        here = np.isnan(times) & (samples.step == step)
        inside = np.flatnonzero(history.step == step)
        begin, end = ends[inside[0]] - history.duration[inside[0]], ends[inside[-1]]
        times[here] = begin + (end - begin) * (np.arange(int(here.sum())) + last) / int(here.sum())
    first = history.step_begin
    end = ends[np.append(first[1:], len(ends)) - 1][samples.step]
    begin = (ends - history.duration)[first][samples.step] + 2.0 * history.slack
    inside = np.clip(times, begin, end)
    return np.where(np.abs(times - inside) <= ROUNDED * history.duration[first][samples.step], inside, times)


def _own_creepage(history: History, samples: TractionSamples | None, times: Floats) -> Mask:
    """Samples whose creepage is not the one the history has at their time."""
    if samples is None:
        return np.zeros(0, dtype=bool)
    expected = history.creepage[history.iteration_at(times)]
    return np.asarray(np.abs(samples.creepage - expected) > 1e-9)


def _cuts(history: History, samples: Floats) -> Floats:
    """Where the history is cut [s]: equal parts of each iteration, and its samples, or the first in each finer part."""
    ends, most = history.end_time, max(1, MOST_PARTS // len(history.step))
    begin, parts = ends - history.duration, np.linspace(0.0, 1.0, min(FEWEST_PARTS, most) + 1)[1:]
    samples = np.sort(samples[(samples > 0.0) & (samples < ends[-1])])
    iteration = history.iteration_at(samples)
    crowded = np.bincount(iteration, minlength=len(ends))[iteration] > most
    part = np.floor(most * (samples - begin[iteration]) / history.duration[iteration])
    first = np.unique(iteration * most + np.clip(part, 0, most - 1), return_index=True)[1]
    chosen = ~crowded
    chosen[first] = True
    regular = (begin[:, None] + parts * history.duration[:, None]).ravel()
    return _distinct(np.concatenate([regular, samples[chosen]]), ends)


def _distinct(times: Floats, ends: Floats) -> Floats:
    """Sorted times without near-doubles; the ends of the iterations stay."""
    close = 1e-6 * ends[-1]
    times = np.unique(times)
    after = np.minimum(np.searchsorted(ends, times), len(ends) - 1)
    nearest = np.minimum(np.abs(ends[after] - times), np.abs(times - ends[np.maximum(after - 1, 0)]))
    inner = times[nearest > close]
    inner = inner[np.diff(inner, prepend=-np.inf) > close]
    return np.sort(np.concatenate([inner, ends]))


def _merge(times: Floats, extra: Floats) -> tuple[Floats, Ints]:
    """Both lists in order of time, and where each of `times` and then of `extra` came; at equal times `times` first."""
    both = np.concatenate([times, extra])
    order = np.lexsort((np.arange(len(both)) >= len(times), both))
    place = np.empty(len(order), dtype=np.int64)
    place[order] = np.arange(len(order))
    return both[order], place


def _reading(history: History, cuts: Floats, samples: Floats, *, within: bool) -> Reading:
    """Read samples between the cuts around them; `within`: between cuts of their own iteration, while it has two."""
    last, close = len(cuts) - 1, 1e-6 * history.end_time[-1]
    of = np.clip(np.searchsorted(cuts, samples - history.slack), 0, last)
    other = np.maximum(of - 1, 0)
    if within:
        iteration, running = history.iteration_at(cuts), history.iteration_at(samples)
        next_one = np.minimum(of + 1, last)
        next_one = np.where(iteration[next_one] == running, next_one, of)
        other = np.where(iteration[other] == running, other, next_one)
    else:
        other = np.where(of > 0, other, min(1, last))
    way = cuts[of] - cuts[other]
    apart = (np.abs(cuts[of] - samples) > close) & (way != 0.0)
    part = np.where(apart, (samples - cuts[other]) / np.where(apart, way, 1.0), 1.0)
    return Reading(of=of, other=other, part=part)


def _replaced(reading: Reading, of_cut: Ints, own: Mask | None = None, of_own: Ints | None = None) -> Reading:
    """The reading among all points; samples with a point of their own are read there."""
    of, other, part = of_cut[reading.of], of_cut[reading.other], reading.part.copy()
    if own is not None and of_own is not None:
        of[own], other[own], part[own] = of_own, of_own, 1.0
    return Reading(of=of, other=other, part=part)
