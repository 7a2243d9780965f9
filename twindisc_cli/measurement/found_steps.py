"""The history that a log or a curve shows: steps of constant creepage, load and speed, and pauses.

Rows under load are averaged over short stretches of time. A step begins where two averages in a row leave the mean of
the step so far, where the file names another step, and after a pause, which is a gap in time. What is much shorter than
the steps are, as a ramp between two of them, is none; a ramp that is the test itself is parted into short steps. A
curve without time is grouped into levels of creepage.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from twindisc_cli.measurement.sheet import Bools, Floats, Ints
from twindisc_cli.model.experiment import History, Rig, mean_radius

MOST_AVERAGES = 4000  # places at which a change of step is looked for
GAP = 5.0
"""A gap in time of so many intervals is a pause."""
_RELATIVE, _SCATTERS = 0.12, 3.0
_RAMP, _STRAIGHT, _FEWEST = 0.03, 0.1, 3
"""By how much of its mean a creepage, a load or a speed that ramps changes in a step at most, the scatter about a line
over its rise below which it does, and averages of a step at least."""
_SAME = 0.02
"""Share by which the load or the speed of a step must differ from the rig's to be its own."""
_SHORT = 0.05  # of the usual length: a ramp between two steps
_WAIT = 0.2  # of the first step: a longer rest before it is a pause
_ITERATIONS = 100  # in the history that is found: a hundredth of the wear in each
_LEVEL = 1.3  # creepages within 30 % are of one nominal value
_NOTHING = 2e-3  # of the largest creepage: pure rolling
_REVOLUTIONS = 10.0  # of an iteration of a curve without times
SLIVER = 0.1
"""Share of an iteration by which a weighing may miss its end: a counter and a log agree no better."""
_MOST_COUNTED = 1000  # iterations that are counted: more are no time steps of wear


@dataclass(frozen=True)
class Seen:
    """Averages over short stretches of time, each (average,): time [s], creepage [1], speed [m/s], load [N], label.

    speed is NaN where it was not recorded; label is the number of the step that the file names, else 0.
    """

    time: Floats
    creepage: Floats
    speed: Floats
    load: Floats
    label: Ints


@dataclass(frozen=True)
class FoundSteps:
    """A history, the time [s] at which it begins, and the step of each average (average,), -1 where it is of none."""

    history: History
    begin: float
    step: Ints


def find_steps(seen: Seen, rig: Rig) -> FoundSteps:
    """The history behind the averages of a log."""
    spacing = float(np.median(np.diff(seen.time))) if len(seen.time) > 1 else 1.0
    gap = np.diff(seen.time, prepend=seen.time[0]) > GAP * spacing
    breaks = gap | (np.diff(seen.label, prepend=seen.label[0]) != 0)
    channels = [_channel(values) for values in (seen.creepage, seen.speed, seen.load) if np.isfinite(values).all()]
    edges = _edges(channels, breaks)
    length = seen.time[edges[1:] - 1] - seen.time[edges[:-1]] + spacing
    kept = length >= _SHORT * _median_by_length(length)
    stretches = [(int(a), int(b)) for a, b in zip(edges[:-1][kept], edges[1:][kept], strict=True)]
    stretches = [part for whole in _merged(stretches, channels, breaks) for part in _ramped(whole, channels)]
    return _as_history(seen, stretches, gap, spacing, rig)


def _channel(values: Floats) -> tuple[Floats, float]:
    """A channel, and how far an average may lie from its step's mean whatever this is."""
    scatter = 1.4826 * float(np.median(np.abs(np.diff(values)))) / np.sqrt(2.0) if len(values) > 1 else 0.0
    size = float(np.max(np.abs(values)))
    return values, min(_SCATTERS * scatter, 0.05 * size) + 1e-4 * size


def _edges(channels: Sequence[tuple[Floats, float]], breaks: Bools) -> Ints:
    """The first average of each stretch, and the end."""
    count, edges = len(breaks), [0]
    means = [float(values[0]) for values, _ in channels]

    def beyond(n: int) -> bool:
        own = zip(channels, means, strict=True)
        return any(abs(values[n] - mean) > _RELATIVE * abs(mean) + slack for (values, slack), mean in own)

    for n in range(1, count):
        if breaks[n] or (beyond(n) and (n + 1 == count or breaks[n + 1] or beyond(n + 1))):
            edges.append(n)
            means = [float(values[n]) for values, _ in channels]
        else:
            size = n - edges[-1] + 1
            means = [mean + (float(values[n]) - mean) / size for (values, _), mean in zip(channels, means, strict=True)]
    return np.array([*edges, count])


def _median_by_length(length: Floats) -> float:
    """The length of the stretch in the middle of the time under load."""
    order = np.argsort(length)
    return float(length[order][np.searchsorted(np.cumsum(length[order]), 0.5 * length.sum())])


def _merged(
    stretches: list[tuple[int, int]], channels: Sequence[tuple[Floats, float]], breaks: Bools
) -> list[tuple[int, int]]:
    """Neighbours of one level, with nothing but a short disturbance between them, are one step."""
    merged = stretches[:1]
    for begin, end in stretches[1:]:
        first, last = merged[-1]
        means = [(np.mean(v[first:last]), np.mean(v[begin:end]), slack) for v, slack in channels]
        same = all(abs(one - other) <= 0.5 * _RELATIVE * abs(one) + slack for one, other, slack in means)
        if same and not np.any(breaks[last : begin + 1]):
            merged[-1] = (first, end)
        else:
            merged.append((begin, end))
    return merged


def _ramped(stretch: tuple[int, int], channels: Sequence[tuple[Floats, float]]) -> list[tuple[int, int]]:
    """A stretch in parts over each of which a ramp changes little; itself where nothing ramps in it."""
    first, last = stretch
    place = np.linspace(-0.5, 0.5, last - first)
    most = 1.0
    for values, slack in channels:
        own = values[first:last]
        mean, rise = float(np.mean(own)), float(place @ own) / float(place @ place)
        rest = float(np.std(own - mean - rise * place))
        if abs(rise) > max(_RAMP * abs(mean), slack) and rest < _STRAIGHT * abs(rise):
            most = max(most, abs(rise) / (_RAMP * max(abs(mean), slack)))
    parts = max(1, min(round(most), (last - first) // _FEWEST))
    ends = np.linspace(first, last, parts + 1).round().astype(int).tolist()
    return list(pairwise(ends))


@dataclass(frozen=True)
class _Step:
    """A step as it was found, or a pause, which has no creepage."""

    duration: float
    creepage: float = np.nan
    load: float = np.nan
    speed: float = np.nan


def _as_history(seen: Seen, stretches: Sequence[tuple[int, int]], gap: Bools, spacing: float, rig: Rig) -> FoundSteps:
    """The steps and the pauses between them on one clock; what lies between two steps belongs to the first."""
    steps: list[_Step] = []
    numbers = np.full(len(seen.time), -1, dtype=np.int64)
    begins = [float(seen.time[first]) - 0.5 * spacing for first, _ in stretches]
    follows = [first for first, _ in stretches[1:]] + [len(gap)]
    for (first, last), following, begin, after in zip(stretches, follows, begins, [*begins[1:], None], strict=True):
        gaps = np.flatnonzero(gap[last : following + 1])
        stop = last + int(gaps[0]) if len(gaps) else None
        own_end = float(seen.time[(last if stop is None else stop) - 1]) + 0.5 * spacing
        end = own_end if stop is not None or after is None else after
        numbers[first:last] = len(steps)
        means = (float(np.mean(values[first:last])) for values in (seen.creepage, seen.load, seen.speed))
        steps.append(_Step(end - begin, *means))
        if stop is not None and after is not None:
            steps.append(_Step(after - end))
    return FoundSteps(_history(steps, rig), begins[0], numbers)


def _history(steps: Sequence[_Step], rig: Rig) -> History:
    """Iterations of nearly equal revolutions, at least one a step."""
    driven = np.array([np.isfinite(step.creepage) for step in steps])
    duration = np.array([step.duration for step in steps])
    load = np.array([_own(step.load / rig.normal_load) for step in steps])
    speed = np.where(driven, [_own(abs(step.speed) / rig.rolling_speed) for step in steps], 0.0)
    revolutions = duration * speed * rig.rolling_speed / (2.0 * np.pi * mean_radius(rig.disc1, rig.disc2))
    count = np.maximum(1, np.round(revolutions / (revolutions.sum() / _ITERATIONS))).astype(np.int64)
    entry = np.repeat(np.arange(len(steps)), count)
    return History(
        step=entry,
        creepage=np.nan_to_num([step.creepage for step in steps])[entry],
        duration=(duration / count)[entry],
        revolutions=(revolutions / count)[entry],
        given_mu=np.full(len(entry), np.nan),
        load_factor=load[entry],
        speed_factor=speed[entry],
    )


def counted(history: History, per_iteration: float) -> History:
    """A history that was found, on which iterations of so many revolutions (NaN: nobody said) are counted."""
    ends = np.cumsum(history.revolutions)
    count = 0 if np.isnan(per_iteration) else min(int(ends[-1] / per_iteration + SLIVER), _MOST_COUNTED)
    history = cut_at(history, ends, np.arange(1.0, count + 1.0) * per_iteration) if count else history
    return replace(history, per_iteration=per_iteration)


def cut_at(history: History, ends: Floats, places: Floats) -> History:
    """The history with iterations that end at places; ends: the end of each on the same scale, (iteration,)."""
    begins = np.concatenate([[0.0], ends[:-1]])
    shares: list[list[float]] = [[] for _ in ends]
    for place in np.unique(places):
        at = int(np.searchsorted(ends, place))
        share = (place - begins[at]) / (ends[at] - begins[at]) if at < len(ends) else 0.0
        if SLIVER < share < 1.0 - SLIVER:
            shares[at].append(float(share))
    parts = np.concatenate([np.diff([0.0, *own, 1.0]) for own in shares])
    entry = np.repeat(np.arange(len(ends)), [len(own) + 1 for own in shares])
    names = ("step", "creepage", "duration", "revolutions", "given_mu", "load_factor", "speed_factor", "yaw")
    each: dict[str, Any] = {name: getattr(history, name)[entry] for name in names}
    each |= {name: each[name] * parts for name in ("duration", "revolutions")}
    return replace(history, **each)


def begun_at_zero(found_steps: FoundSteps) -> History:
    """The history on a clock that runs before it begins: a short wait belongs to the first iteration, else a pause."""
    history, wait = found_steps.history, max(found_steps.begin, 0.0)
    if wait <= _WAIT * float(history.duration[0]):
        return replace(history, duration=history.duration + wait * (np.arange(len(history.step)) == 0))
    pause = {"step": -1, "creepage": 0.0, "duration": wait, "revolutions": 0.0, "given_mu": np.nan}
    pause |= {"load_factor": 1.0, "speed_factor": 0.0, "yaw": 0.0}
    longer: dict[str, Any] = {name: np.append(value, getattr(history, name)) for name, value in pause.items()}
    return replace(history, **longer | {"step": longer["step"].astype(np.int64) + 1})


def _own(factor: float) -> float:
    """A factor on the rig's value, 1 where it hardly differs or is not known."""
    return factor if np.isfinite(factor) and abs(factor - 1.0) > _SAME else 1.0


def steps_of_curve(creepage: Floats, label: Ints | None, rig: Rig) -> History:
    """Levels of a curve without time: those that the file names, else groups of nearly equal creepage in rising order.

    The steps are of equal length, which means nothing.
    """
    levels = list(_named_levels(creepage, label)) if label is not None else list(_levels(creepage))
    turn = 2.0 * np.pi * mean_radius(rig.disc1, rig.disc2) / rig.rolling_speed
    ones = np.ones(len(levels))
    return History(
        step=np.arange(len(levels)),
        creepage=np.array(levels),
        duration=_REVOLUTIONS * turn * ones,
        revolutions=_REVOLUTIONS * ones,
        given_mu=np.nan * ones,
    )


def _named_levels(creepage: Floats, label: Ints) -> Iterator[float]:
    for number in range(1, int(label.max()) + 1):
        mine = creepage[label == number]
        yield float(np.mean(mine)) if len(mine) else 0.0


def _levels(creepage: Floats) -> Iterator[float]:
    """Means of groups that reach from their smallest to 1.3 times it, of each sign, and of what is nothing."""
    none = np.abs(creepage) <= _NOTHING * np.max(np.abs(creepage))
    for sign in (-1.0, 1.0):
        sizes = np.sort(np.abs(creepage[~none & (np.sign(creepage) == sign)]))
        results = []
        while len(sizes):
            group = sizes[sizes <= _LEVEL * sizes[0]]
            results.append(sign * float(group.mean()))
            sizes = sizes[len(group) :]
        yield from sorted(results)
        if sign < 0.0 and np.any(none):
            yield 0.0


def history_text(history: History, rig: Rig) -> str:
    """The history as the table of a definition."""
    counts = np.bincount(history.step)
    driven = history.revolutions[history.driven]
    lines = ["[history]", f"revolutions_per_iteration = {np.median(driven):.6g}", "steps = ["]
    for at, count in zip(history.step_begin, counts, strict=True):
        if not history.driven[at]:
            lines.append(f"  {{ pause_s = {history.duration[at] * count:.6g} }},")
            continue
        count = max(1, round(float(history.revolutions[at]) * count / float(np.median(driven))))
        parts = [f"creepage_percent = {100.0 * history.creepage[at]:.4g}", f"iterations = {count}"]
        if history.load_factor[at] != 1.0:
            parts.append(f"normal_load_N = {rig.normal_load * history.load_factor[at]:.4g}")
        if history.speed_factor[at] != 1.0:
            parts.append(f"rolling_speed_m_s = {rig.rolling_speed * history.speed_factor[at]:.4g}")
        lines.append(f"  {{ {', '.join(parts)} }},")
    return "\n".join([*lines, "]"])
