"""T/N samples from a rig's log, on a history that is given or that the log shows.

The zero of the signal is found in the rows without load, else from slip both ways. The rows under load are averaged
over a twentieth of an iteration; those whose signal is no measurement say how the discs ran, and no more. On a given
history the averages are laid along the steps in order, by the cheapest
monotone path over what creepage, load and speed are off by. Those that straddle a change of step, and those that belong
to no step (running up, idling), are left out, and counted by what they are. The clock of the log may start anywhere:
times are counted from where each step is found. The sign of the traction is the sensor's; it is taken so that T/N has
the sign of the creepage.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from twindisc_cli.measurement.channels import FEWEST, check_kelvin, tolerance
from twindisc_cli.measurement.content import Content
from twindisc_cli.measurement.found_steps import MOST_AVERAGES, Seen, find_steps, history_text
from twindisc_cli.measurement.header import Column, Naming
from twindisc_cli.measurement.held import keep_readings
from twindisc_cli.measurement.log import (
    CLOCK,
    REASONS,
    SMALLEST_RATIO,
    UNLOADED,
    Codes,
    Log,
    check_time,
    dead_rows,
    idle_rows,
    note_stuck,
    outliers,
    repeats,
)
from twindisc_cli.measurement.rows import RowCount
from twindisc_cli.measurement.sheet import Floats, Ints
from twindisc_cli.measurement.table import NO_NUMBER, read_table
from twindisc_cli.measurement.torque_zero import Zero, find_zero, stretches, without_load_signal, zero_of_both_ways
from twindisc_cli.measurement.units import TEMPERATURE
from twindisc_cli.model.experiment import History, RecordedColumn, Rig, TemperatureSamples, TorqueZero, TractionSamples
from twindisc_cli.model.rounded import is_coarse, middles

Bools = NDArray[np.bool_]
ZeroSetting = Literal["unloaded", "as recorded"] | float | None

_PER_ITERATION = 20  # means an iteration: the change within one is seen, noise is halved
_LONGEST = 1.05  # of the planned time: rigs stop late, not by more
_SHORTEST = 0.5  # of the planned time: a shorter log is of another test
_WRONG_LOAD = 0.2  # of the planned load: another load, not its control
_WRONG_SPEED = 0.1  # of the planned speed: another speed, not its control
_CHANGING, _OTHER = REASONS.index("at a change of step"), REASONS.index("at the creepage of no step")
_NO_LOAD = REASONS.index("without a signal of the load")


@dataclass(frozen=True)
class RigLog:
    """T/N samples of a log on a history, the zero of its signal where it is known, and what became of its rows.

    begin: the time [s] of the log's clock at which the history begins.
    """

    samples: TractionSamples
    history: History
    begin: float
    zero: TorqueZero | None
    rows: RowCount
    columns: Mapping[str, RecordedColumn]


@dataclass(frozen=True)
class _Averages:
    """Means over stretches of time, each (average,), of the rows whose signal is used, else of those that run.

    ratio is NaN where no signal is used; block: the stretch that each running row is in (running row,).
    """

    time: Floats
    creepage: Floats
    speed: Floats
    load: Floats
    ratio: Floats
    label: Ints
    block: Ints
    others: Mapping[str, Floats]

    @property
    def read(self) -> Bools:
        """Stretches in which the signal is used."""
        return np.isfinite(self.ratio)


def log_samples(log: Log, *, rig: Rig, history: History | None, torque_zero: ZeroSetting = None) -> RigLog:
    """T/N samples of a log; MeasurementError says which step is missing or does not fit. history None: it is found.

    torque_zero: "unloaded", from the rows without load, which must be there; a torque [N m]; or "as recorded". None
    takes it from the rows without load where there are any, else from slip both ways.
    """
    table = log.table
    lightest = rig.normal_load * (float(history.load_factor[history.driven].min()) if history else 1.0)
    log, lost = _with_load(log, lightest, torque_zero)
    reason = idle_rows(log, rig, lightest)
    read = log.read
    result = find_zero(log.time[read], log.signal[read], log.load[read], lightest) if log.has_load else None
    if torque_zero == "unloaded" and result is None:
        table.note("no section without load is in it: no torque_zero can be found in this log", log.kind)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = (log.signal - _offset(log.time, result, torque_zero)) / log.per_ratio(log.load)
    runs = reason == 0
    reason[runs & lost] = _NO_LOAD
    used = _used(log, ratio, reason, torque_zero)
    mean = _averages(log, runs, np.where(used, ratio, np.nan), _length(log.time[runs], history))
    sense = float(np.sign(np.nanmedian(mean.ratio * np.sign(mean.creepage))) or 1.0)
    unit = sense * float(log.per_ratio(rig.normal_load))
    placed = _placed(log, rig, history, mean)
    table.check()
    kept, time, step = placed.settled & mean.read, placed.time, placed.step
    steps = _OfSteps(mean.time[kept], step[kept], placed.history)
    zero, ratio = _zero(result, torque_zero, unit, steps), sense * mean.ratio
    if result is None and not isinstance(torque_zero, float):
        zero = _zero_of_both_ways(ratio[kept], torque_zero, unit, steps)
        ratio = ratio - zero.value if zero is not None and zero.taken_off else ratio
    reason[used] = _left(step, placed.settled)[mean.block[used[runs]]]
    unknown = np.full(int(kept.sum()), np.nan)
    samples = TractionSamples(time[kept], step[kept], mean.creepage[kept], ratio[kept], uncertainty=unknown)
    columns = {name: RecordedColumn(time[kept], step[kept], values[kept]) for name, values in mean.others.items()}
    table.notes += (*_notes(log, zero, result, mean.time, placed.history), *_turned(log, sense))
    table.notes += _too_slippery(log, ratio)
    _check_samples(log, steps)
    begin = float(mean.time[kept][0] - time[kept][0])
    return RigLog(samples, placed.history, begin, zero, _accounted(log, reason), columns)


def _accounted(log: Log, reason: Codes) -> RowCount:
    """What became of the rows, those that the file left out among them."""
    left = {REASONS[code]: int(np.sum(reason == code)) for code in np.unique(reason) if code}
    log.table.left_out |= {why: count + log.table.left_out.get(why, 0) for why, count in left.items()}
    return log.table.count(int(np.sum(reason == 0)))


def _with_load(log: Log, lightest: float, setting: ZeroSetting) -> tuple[Log, Bools]:
    """The log with the load nearest in time where its signal dropped out, which is said; and where (row,).

    T/N that was recorded is not looked at: it has no meaning without a load.
    """
    carries, lost = log.load > UNLOADED * lightest, np.zeros(len(log.time), dtype=bool)
    if log.has_load and log.kind != "traction ratio" and np.any(carries):
        stated, read = setting if isinstance(setting, float) else 0.0, np.isfinite(log.signal)
        lost[read] = without_load_signal(log.signal[read] - stated, log.load[read], lightest)
    for rows in stretches(lost):
        size = float(np.median(log.signal[rows]))
        factor, unit = log.unit_of(size)
        log.table.notes.append(
            f"no load from {log.time[rows][0]:.5g} to {log.time[rows][-1]:.5g} s, but a {log.kind} of "
            f"{size * factor:.3g}{unit}: the signal of the load is taken to have dropped out, and the rows neither for "
            "the zero nor for friction (torque_zero overrules)"
        )
    if np.any(lost):
        nearest = np.round(np.interp(log.time, log.time[carries], np.arange(carries.sum()))).astype(np.int64)
        log = replace(log, load=np.where(lost, log.load[carries][nearest], log.load))
    return log, lost


def _used(log: Log, ratio: Floats, reason: Codes, setting: ZeroSetting) -> Bools:
    """Rows (row,) that run and whose signal is a measurement; of the others is marked why not, and one must be left."""
    reason[~log.read] = REASONS.index(NO_NUMBER)
    dead_rows(log, reason)
    outliers(log, ratio, reason, zero_is_stated=isinstance(setting, float))
    repeats(log, reason)
    used: Bools = reason == 0
    note_stuck(log.table, log.kind, log.signal[used])
    if not np.any(used):
        log.table.note("no reading of it is left under load", log.kind)
        log.table.check()
    return used


@dataclass(frozen=True)
class _Placed:
    """Averages on a history, each (average,): step, time [s] on its clock, and whether all of it is of the step."""

    history: History
    step: Ints
    time: Floats
    settled: Bools


def _placed(log: Log, rig: Rig, history: History | None, mean: _Averages) -> _Placed:
    """The averages of a log on the history, which is found where it is None."""
    if history is None:
        result = find_steps(Seen(mean.time, mean.creepage, mean.speed, mean.load, mean.label), rig)
        log.table.notes.append(f"the history found in it:\n{history_text(result.history, rig)}")
        return _Placed(result.history, result.step, mean.time - result.begin, result.step >= 0)
    step = _align(mean, history, rig)
    settled = _settled(mean.creepage, step, history)
    _check_rig(log, rig, history, mean, step)
    _check_steps(log, rig, mean, step, settled, history)
    return _Placed(history, step, _history_time(mean.time, step, history), settled)


def log_temperature(
    data: bytes | Content, file: str, *, history: History, begin: float, naming: Naming | None = None
) -> tuple[TemperatureSamples, RowCount]:
    """Disc temperature on the clock of a log, means of short stretches of time; begin: as of RigLog.

    What lies before and after the history is left out, and so are rows without a temperature.
    """
    table = read_table(data, file, (*CLOCK, Column("temperature", TEMPERATURE)), naming, gaps=True)
    check_time(table)
    check_kelvin(table)
    table.check()
    keep_readings(table, "temperature")
    time, kelvin, end = table.columns["time"] - begin, table.columns["temperature"], float(history.end_time[-1])
    inside = (time >= 0.0) & (time <= end)
    for reason, outside in (("before the history", time < 0.0), ("after the history", time > end)):
        if np.any(outside):
            table.left_out[reason] = int(outside.sum())
    table.notes.append(f"temperatures on the clock of the log; the history begins at its {begin:.4g} s")
    if inside.sum() < FEWEST["temperature"]:
        table.note(f"{inside.sum()} temperatures lie in the history, 0 to {end:g} s after its begin", "temperature")
        table.check()
    block = _blocks(time[inside], _length(time[inside], None))
    if is_coarse(kelvin[inside]):
        table.notes.append("the temperatures are rounded too far to be averaged: one of each stretch of time is taken")
        at = np.flatnonzero(inside)[middles(block)]
        return TemperatureSamples(time[at], kelvin[at]), table.count(int(inside.sum()))
    samples = TemperatureSamples(*(_means(values[inside], block) for values in (time, kelvin)))
    return samples, table.count(int(inside.sum()))


def _too_slippery(log: Log, ratio: Floats) -> tuple[str, ...]:
    """A T/N that no dry contact has."""
    typical = float(np.nanmedian(np.abs(ratio)))
    if log.kind == "traction ratio" or typical >= SMALLEST_RATIO:
        return ()
    return (f"T/N is {typical:.2g}, less than any dry contact has: check the units of {log.kind} and load",)


def _turned(log: Log, sense: float) -> tuple[str, ...]:
    """A sign that is the sensor's."""
    if sense > 0.0:
        return ()
    key = f"columns.{log.kind.replace(' ', '_')}"
    return (f"{log.kind} opposed to the creepage: taken with the other sign (that of {key} states it)",)


def _offset(time: Floats, zero: Zero | None, setting: ZeroSetting) -> Floats | float:
    """What is taken off the signal of each row."""
    if isinstance(setting, float):
        return setting
    return 0.0 if zero is None or setting == "as recorded" else zero.at(time)


@dataclass(frozen=True)
class _OfSteps:
    """Times [s] on the clock of the log at which was measured and their steps, each (average,); the history."""

    time: Floats
    step: Ints
    history: History

    @property
    def load_factor(self) -> Floats:
        """Load of each step over the rig's (step,)."""
        return self.history.load_factor[self.history.step_begin]

    def mean(self, values: Floats) -> Floats:
        """The mean of values (average,) in each step (step,); NaN where nothing was measured."""
        count = len(self.load_factor)
        with np.errstate(invalid="ignore"):
            return np.asarray(np.bincount(self.step, values, count) / np.bincount(self.step, minlength=count))


def _zero(zero: Zero | None, setting: ZeroSetting, unit: float, steps: _OfSteps) -> TorqueZero | None:
    """What is known of the zero, as T/N; unit: the signal of T/N = 1."""
    if isinstance(setting, float):
        unknown = np.full(len(steps.load_factor), np.nan)
        return TorqueZero(setting / unit, np.nan, np.nan, taken_off=True, unit=unit, of_step=unknown)
    if zero is None:
        return None
    std, off = zero.std_at(steps.time), setting != "as recorded"
    of_step = steps.mean(std) / abs(unit) / steps.load_factor
    value, mean_std = (float(values.mean()) if len(values) else np.nan for values in (zero.at(steps.time), std))
    return TorqueZero(value / unit, mean_std / abs(unit), zero.drift / unit, taken_off=off, unit=unit, of_step=of_step)


def _zero_of_both_ways(ratio: Floats, setting: ZeroSetting, unit: float, steps: _OfSteps) -> TorqueZero | None:
    """The zero that slip both ways shows in T/N (average,); None where nothing was driven both ways."""
    both = zero_of_both_ways(steps.history.step_creepage, ratio, steps.step)
    if both is None:
        return None
    of_step = both[1] / steps.load_factor
    return TorqueZero(*both, np.nan, taken_off=setting != "as recorded", unit=unit, of_step=of_step)


def _length(time: Floats, history: History | None) -> float:
    """How long a stretch of time is averaged over [s]."""
    if history is not None:
        return float(history.duration[history.driven].min()) / _PER_ITERATION
    spacing = float(np.median(np.diff(time))) if len(time) > 1 else 1.0
    return max(spacing, float(np.ptp(time)) / MOST_AVERAGES)


def _averages(log: Log, runs: Bools, ratio: Floats, length: float) -> _Averages:
    """Means of the rows that run over stretches of time of a length [s]; ratio: NaN where the signal is not used."""
    block, used = _blocks(log.time[runs], length), np.isfinite(ratio[runs])
    taken = used | (np.bincount(block, weights=used) == 0.0)[block]
    rows, own = np.flatnonzero(runs)[taken], block[taken]
    label = np.zeros(int(block[-1]) + 1, dtype=np.int64)
    if log.label is not None:
        label[own] = log.label[rows]
    return _Averages(
        time=_means(log.time[rows], own),
        creepage=_means(log.creepage[rows], own),
        speed=_means(log.speed[rows], own),
        load=_means(log.load[rows], own),
        ratio=_means(ratio[rows], own),
        label=label,
        block=block,
        others={name: _means(values[rows], own) for name, values in log.others.items()},
    )


def _blocks(time: Floats, length: float) -> Ints:
    """The stretch of a length [s] in which each time is, numbered from 0 without gaps."""
    block = np.floor((time - time[0]) / length * (1.0 + 1e-9)).astype(np.int64)
    return np.asarray(np.cumsum(np.diff(block, prepend=block[:1]) != 0))


def _means(values: Floats, block: Ints) -> Floats:
    """The mean of each stretch."""
    return np.asarray(np.bincount(block, weights=values) / np.bincount(block))


def _left(step: Ints, settled: Bools) -> Codes:
    """Why each average was left out, as an index of REASONS; 0 where it was not."""
    order, used = np.arange(len(settled)), np.flatnonzero(settled)
    first, last = (used[0], used[-1]) if len(used) else (len(settled), len(settled))
    change = np.flatnonzero(np.diff(step))
    changing = np.isin(order, [*change, *(change + 1)]) | (step < 0)
    up, down = REASONS.index("running up"), REASONS.index("running down")
    reasons = np.select([settled, order < first, order > last, changing], [0, up, down, _CHANGING], _OTHER)
    return reasons.astype(np.int8)


def _notes(log: Log, zero: TorqueZero | None, result: Zero | None, time: Floats, history: History) -> tuple[str, ...]:
    """The zero of the signal, or how to know it, and a log that is much shorter or longer than the history."""
    notes = []
    if zero is not None:
        factor, unit = log.unit_of(zero.value * zero.unit)
        value, size = zero.value * zero.unit * factor, abs(zero.unit) * factor
        drift = f", {zero.drift * zero.unit * factor:.3g}{unit} from first to last" if np.isfinite(zero.drift) else ""
        error = f" ± {zero.std * size:.2g}" if np.isfinite(zero.std) else ""
        kind = f" ({result.kind}{drift})" if result and drift else ""
        whence = (
            f"from {result.rows} rows without load in {len(result.time)} sections{kind}"
            if result
            else "from slip both ways"
        )
        whence = whence if np.isfinite(zero.std) else "as stated"
        taken = "taken off" if zero.taken_off else "left in"
        level = " (one standard deviation)" if error else ""
        notes.append(f"{log.kind} zero {value:.3g}{error}{unit}{level}, {whence}, {taken}")
    elif log.kind != "traction ratio":
        how = "run some seconds without load before and after, or slip both ways"
        notes.append(f"the zero of the {log.kind} is not known: {how}")
    span, planned = float(np.ptp(time)), float(history.duration[history.driven].sum())
    if not _SHORTEST * planned < span < _LONGEST * float(history.end_time[-1]):
        notes.append(f"lasts {span:.4g} s under load, the history {planned:.4g} s")
    return tuple(notes)


def _check_rig(log: Log, rig: Rig, history: History, mean: _Averages, step: Ints) -> None:
    """The log's loads and speeds are the definition's, and slip goes the way it says."""
    table, planned = log.table, history.step_creepage[history.step_driven]
    where = [("", slice(None), 1.0, 1.0)]
    if not history.is_constant:
        first = history.step_begin
        where = [
            (f" in step {k + 1}", step == k, history.load_factor[first[k]], history.speed_factor[first[k]])
            for k in np.unique(step)
        ]
    for where_in_it, mine, load_factor, speed_factor in where:
        load, wanted = float(np.median(mean.load[mine])), rig.normal_load * load_factor
        if abs(load / wanted - 1.0) > _WRONG_LOAD:
            table.note(f"the load{where_in_it} is {load:.4g} N, the definition says {wanted:g} N", "normal load")
        speed, wanted = float(np.median(np.abs(mean.speed[mine]))), rig.rolling_speed * speed_factor
        if abs(speed / wanted - 1.0) > _WRONG_SPEED:
            what = f"the mean speed{where_in_it} is {speed:.4g} m/s, the definition says {wanted:.4g} m/s"
            table.note(f"{what}; check the unit", "speed 1")
    slip = float(np.median(mean.creepage))
    if slip < 0.0 <= planned.min():
        table.note("disc 1 is the slower one, so creepage is negative: swapped with speed 2?", "speed 1")
    elif planned.max() <= 0.0 < slip:
        table.note("disc 1 is the faster one, so creepage is positive: swapped with speed 2?", "speed 1")


def _align(mean: _Averages, history: History, rig: Rig) -> Ints:
    """The step of each average: the cheapest path that never goes back.

    Time decides between steps that are the same, or whose creepages differ by less than the averages scatter, and
    counts as one tolerance of the creepage at most where they differ by more.
    """
    driven = np.flatnonzero(history.step_driven)
    ends = np.array([history.end_time[history.step == k][-1] for k in driven])
    lasts = np.array([history.duration[history.step == k].sum() for k in driven])
    since = (mean.time - mean.time[0])[:, None]
    late = np.maximum(since - ends, 0.0) + np.maximum(ends - lasts - since, 0.0)
    too_late = np.minimum(late / ((_LONGEST - 1.0) * lasts), 1.0)
    cost = _misfit(mean, history, rig, driven) + too_late**2 + 1e-3 * late / ends[-1]
    came_from = np.empty(cost.shape, dtype=np.int32)
    total, steps = cost[0], np.arange(len(driven), dtype=np.int32)
    for row in range(1, len(cost)):
        best = np.minimum.accumulate(total)
        came_from[row] = np.maximum.accumulate(np.where(total <= best, steps, 0))
        total = best + cost[row]
    path = np.empty(len(cost), dtype=np.int64)
    path[-1] = int(np.argmin(total))
    for row in range(len(cost) - 1, 0, -1):
        path[row - 1] = came_from[row, path[row]]
    return np.asarray(driven[path])


def _misfit(mean: _Averages, history: History, rig: Rig, driven: Ints) -> Floats:
    """By how much each average is off each step, in tolerances, squared: (average, driven step)."""
    first, change = history.step_begin[driven], np.abs(np.diff(mean.creepage))
    like = _like(history.creepage[first], float(np.median(change)) if len(change) else 0.0)
    off = np.abs(mean.creepage[:, None] - history.creepage[first][like]) / tolerance(history)[driven][like]
    cost = np.minimum(off, 3.0) ** 2
    if not history.is_constant:
        load = rig.normal_load * history.load_factor[first]
        speed = rig.rolling_speed * history.speed_factor[first]
        for values, planned, share in ((mean.load, load, _WRONG_LOAD), (np.abs(mean.speed), speed, _WRONG_SPEED)):
            cost += np.nan_to_num(np.minimum(np.abs(values[:, None] / planned - 1.0) / share, 3.0) ** 2)
    return np.asarray(cost)


def _like(planned: Floats, scatter: float) -> Ints:
    """For each step the first of a row of steps that differ from that one by less than a scatter (step,)."""
    like = np.arange(len(planned))
    for step in range(1, len(planned)):
        if abs(planned[step] - planned[like[step - 1]]) < scatter:
            like[step] = like[step - 1]
    return like


def _settled(creepage: Floats, step: Ints, history: History) -> Bools:
    """Averages at their step's creepage that do not straddle a change of step."""
    settled = np.abs(creepage - history.step_creepage[step]) <= tolerance(history)[step]
    change = np.flatnonzero(np.diff(step))
    settled[change] = False
    settled[change + 1] = False
    return np.asarray(settled)


def _check_steps(log: Log, rig: Rig, mean: _Averages, step: Ints, settled: Bools, history: History) -> None:
    """Every step is there and as long as the history says."""
    for index in np.flatnonzero(history.step_driven):
        planned = float(history.duration[history.step == index].sum())
        mine = mean.time[settled & (step == index)]
        if len(mine) == 0:
            _note_missing(log, rig, mean, int(index), history)
        elif np.ptp(mine) > _LONGEST * planned:
            note = f"step {index + 1} lasts {np.ptp(mine):.4g} s here, {planned:.4g} s in the history"
            log.table.note(note, "time")


def _note_missing(log: Log, rig: Rig, mean: _Averages, index: int, history: History) -> None:
    """Say of a step that it is not there, and of load and speed where these are others at its creepage."""
    creepage, first = history.step_creepage[index], history.step_begin[index]
    level = f"{creepage * 100:g} %"
    near = np.abs(mean.creepage - creepage) <= tolerance(history)[index]
    load, speed = rig.normal_load * history.load_factor[first], rig.rolling_speed * history.speed_factor[first]
    for name, column, unit, values, wanted, share in (
        ("load", "normal load", "N", mean.load[near], load, _WRONG_LOAD),
        ("mean speed", "speed 1", "m/s", np.abs(mean.speed[near]), speed, _WRONG_SPEED),
    ):
        if np.any(near) and np.all(np.abs(values / wanted - 1.0) > share):
            there = f"at {level} the {name} is {np.median(values):.4g} {unit}"
            what = f"no stretch of the log runs at the {level} and {wanted:.4g} {unit} of step {index + 1}: {there}"
            log.table.note(what, column)
            return
    log.table.note(f"no stretch of the log runs at the {level} of step {index + 1}", "speed 1")


def _check_samples(log: Log, steps: _OfSteps) -> None:
    """Name the steps of which no row is left; one must be."""
    history, missing = steps.history, np.setdiff1d(np.flatnonzero(steps.history.step_driven), steps.step)
    names = ", ".join(f"step {k + 1} ({history.step_creepage[k] * 100:.4g} %)" for k in missing)
    if not len(steps.step):
        log.table.note(f"no reading of it is left in {names}", log.kind)
        log.table.check()
    if len(missing):
        log.table.notes.append(f"no row is left of {names}: the {log.kind} there is not known")


def _history_time(time: Floats, step: Ints, history: History) -> Floats:
    """Times on the history's clock: those of each step counted from where the log begins it."""
    result = np.empty_like(time)
    for index in np.unique(step):
        mine = step == index
        duration = history.duration[history.step == index].sum()
        end = history.end_time[history.step == index][-1]
        half = 0.5 * history.duration[history.driven].min() / _PER_ITERATION
        result[mine] = np.minimum(end - duration + half + time[mine] - time[mine][0], end)
    return result
