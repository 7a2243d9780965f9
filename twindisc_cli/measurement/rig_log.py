"""Raw rig logs: creepage and T/N from two speeds, torque and load, and the steps found in them.

    creepage = (R1 w1 - R2 w2) / ((R1 w1 + R2 w2) / 2)          (Eq. 1)
    T/N = (torque - zero) / (R N),  R of the disc the torque was measured on

The zero is found in the rows without load. The rows under load are averaged over a twentieth of an iteration. The
averages are laid along the history's steps in order, by the cheapest monotone path over |creepage - step's creepage|.
Those that straddle a change of step, and those that belong to no step (running up, idling), are left out, and counted
by what they are. The clock of the log may start anywhere: times are counted from where each step is found. The sign of
the torque is the sensor's; it is taken so that T/N is positive.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from twindisc_cli.measurement.channels import tolerance
from twindisc_cli.measurement.header import Column, Naming
from twindisc_cli.measurement.rows import RowCount
from twindisc_cli.measurement.sheet import Floats, Ints
from twindisc_cli.measurement.table import Table, read_table
from twindisc_cli.measurement.torque_zero import Zero, find_zero
from twindisc_cli.measurement.units import FORCE, TIME, TORQUE, turning
from twindisc_cli.model.experiment import History, Rig, TorqueZero, TractionSamples

Bools = NDArray[np.bool_]
ZeroSetting = Literal["unloaded", "as recorded"] | float | None

_PER_ITERATION = 20
_UNLOADED = 0.1
_STANDING = 0.02
_LONGEST = 1.05
_SHORTEST = 0.5
_WRONG_LOAD = 0.2
_WRONG_SPEED = 0.1


@dataclass(frozen=True)
class RigLog:
    """T/N samples of a log, the zero of its torque where it is known, and what became of its rows."""

    samples: TractionSamples
    zero: TorqueZero | None
    rows: RowCount


def read_rig_log(
    data: bytes,
    file: str,
    *,
    rig: Rig,
    history: History,
    torque_disc: int,
    torque_zero: ZeroSetting = None,
    naming: Naming | None = None,
) -> RigLog:
    """T/N samples from a raw log; MeasurementError says which step is missing or does not fit.

    torque_zero: "unloaded", from the rows without load, which must be there; a torque [N m]; or "as recorded". None
    takes it from the rows without load where there are any.
    """
    wanted = (
        Column("time", TIME),
        Column("speed 1", turning(rig.disc1.rolling_radius)),
        Column("speed 2", turning(rig.disc2.rolling_radius)),
        Column("torque", TORQUE),
        Column("normal load", FORCE),
    )
    table = read_table(data, file, wanted, naming, gaps=True)
    _check_rows(table, rig)
    table.check()
    reasons = _idle(table, rig)
    driven = reasons == ""
    if not driven.any():
        table.note("the discs never turn under the load", "speed 1")
        table.check()
    radius = (rig.disc1 if torque_disc == 1 else rig.disc2).rolling_radius
    columns = table.columns
    found = find_zero(columns["time"], columns["torque"], columns["normal load"], rig.normal_load)
    if torque_zero == "unloaded" and found is None:
        table.note("no rows without load at either end: no torque_zero can be found in this log", "torque")
    offset = _offset(table.columns["time"], found, torque_zero)
    time, creepage, ratio, block = _averages(table, rig, history, driven, (table.columns["torque"] - offset) / radius)
    sense = float(np.sign(np.median(ratio)) or 1.0)
    _check_rig(table, rig, driven)
    step = _align(time, creepage, history)
    kept = _settled(creepage, step, history)
    _check_steps(table, time, step, kept, history)
    table.check()
    reasons[driven] = _left(step, kept)[block]
    samples = TractionSamples(
        time=_history_time(time, step, history)[kept],
        step=step[kept],
        creepage=creepage[kept],
        ratio=sense * ratio[kept],
        uncertainty=np.full(int(kept.sum()), np.nan),
    )
    zero = _zero(found, torque_zero, table.columns["time"][driven], sense * radius * rig.normal_load)
    table.left_out |= _counts(reasons)
    table.notes += _notes(zero, found, time, history)
    return RigLog(samples, zero, table.count(int(np.sum(reasons == ""))))


def _idle(table: Table, rig: Rig) -> NDArray[np.object_]:
    """Why each row says nothing of the traction, empty where it does."""
    speed = table.columns["speed 1"] * rig.disc1.rolling_radius + table.columns["speed 2"] * rig.disc2.rolling_radius
    unloaded = table.columns["normal load"] <= _UNLOADED * rig.normal_load
    standing = np.abs(speed) < 2.0 * _STANDING * rig.rolling_speed
    sense = np.sign(np.median(speed[~unloaded & ~standing])) if np.any(~unloaded & ~standing) else 1.0
    reasons = np.select(
        [unloaded, standing, sense * speed < 0.0], ["unloaded", "standing still", "turning the other way"], ""
    )
    return reasons.astype(object)


def _offset(time: Floats, found: Zero | None, setting: ZeroSetting) -> Floats:
    """What is taken off the torque of each row [N m]."""
    if isinstance(setting, float):
        return np.full(len(time), setting)
    return np.zeros(len(time)) if found is None or setting == "as recorded" else found.at(time)


def _zero(found: Zero | None, setting: ZeroSetting, time: Floats, unit: float) -> TorqueZero | None:
    """What is known of the zero, as T/N; time [s] of the rows under load, unit the torque of T/N = 1 [N m]."""
    if isinstance(setting, float):
        return TorqueZero(setting / unit, np.nan, np.nan, taken_off=True, unit=unit)
    if found is None:
        return None
    mean, off = float(found.at(time).mean()), setting != "as recorded"
    return TorqueZero(mean / unit, found.std / abs(unit), found.drift / unit, taken_off=off, unit=unit)


def _left(step: Ints, kept: Bools) -> NDArray[np.object_]:
    """Why each average was left out, empty where it was not."""
    order, used = np.arange(len(kept)), np.flatnonzero(kept)
    first, last = (used[0], used[-1]) if len(used) else (len(kept), len(kept))
    change = np.flatnonzero(np.diff(step))
    changing = np.isin(order, [*change, *(change + 1)])
    reasons = np.select(
        [kept, order < first, order > last, changing],
        ["", "running up", "running down", "at a change of step"],
        "at the creepage of no step",
    )
    return reasons.astype(object)


def _counts(reasons: NDArray[np.object_]) -> Mapping[str, int]:
    names, counts = np.unique(reasons[reasons != ""].astype(str), return_counts=True)
    return {str(name): int(count) for name, count in zip(names, counts, strict=True)}


def _notes(zero: TorqueZero | None, found: Zero | None, time: Floats, history: History) -> tuple[str, ...]:
    """The zero of the torque, and a log that is much shorter or longer than the history."""
    notes = []
    if zero is not None:
        drift = f", drift {zero.drift * zero.unit * 1e3:.3g}" if np.isfinite(zero.drift) else ""
        error = f" ± {zero.std * abs(zero.unit) * 1e3:.2g}" if np.isfinite(zero.std) else ""
        whence = f"from {found.rows} rows without load" if found and np.isfinite(zero.std) else "as stated"
        taken = "taken off" if zero.taken_off else "left in"
        notes.append(f"torque zero {zero.value * zero.unit * 1e3:.3g}{error} mN m{drift}, {whence}, {taken}")
    span, planned = float(np.ptp(time)), float(history.end_time[-1])
    if not _SHORTEST * planned < span < _LONGEST * planned:
        notes.append(f"lasts {span:.4g} s under load, the history {planned:.4g} s")
    return tuple(notes)


def _check_rows(table: Table, rig: Rig) -> None:
    """What can be judged row by row."""
    if not (np.isfinite(rig.disc1.rolling_radius) and np.isfinite(rig.disc2.rolling_radius)):
        table.note("a rig log needs two discs that turn; one rolling radius is inf")
    rise = np.diff(table.columns["time"], prepend=-np.inf)
    table.flag(rise == 0.0, "time", lambda row: f"time {table.written['time'][row]:g} occurs twice")
    table.flag(rise < 0.0, "time", lambda row: f"time {table.written['time'][row]:g} is earlier than the row before")
    if not np.any(table.columns["normal load"] > _UNLOADED * rig.normal_load) and not table.problems:
        table.note(f"the load never comes near the definition's {rig.normal_load:g} N", "normal load")


def _averages(
    table: Table, rig: Rig, history: History, driven: Bools, force: Floats
) -> tuple[Floats, Floats, Floats, Ints]:
    """Time, creepage and T/N averaged over a twentieth of an iteration, and the average each driven row is in.

    force: T of each row [N].
    """
    columns = {name: values[driven] for name, values in table.columns.items()}
    speed1, speed2 = columns["speed 1"] * rig.disc1.rolling_radius, columns["speed 2"] * rig.disc2.rolling_radius
    values = (
        columns["time"],
        (speed1 - speed2) / (0.5 * (speed1 + speed2)),
        force[driven] / columns["normal load"],
    )
    length = float(history.duration[0]) / _PER_ITERATION
    _, block = np.unique(np.floor((values[0] - values[0][0]) / length), return_inverse=True)
    count = np.bincount(block)
    time, creepage, ratio = (np.bincount(block, weights=v) / count for v in values)
    return time, creepage, ratio, block


def _check_rig(table: Table, rig: Rig, loaded: Bools) -> None:
    """The log's load and speed are the definition's."""
    load = float(np.median(table.columns["normal load"][loaded]))
    if abs(load / rig.normal_load - 1.0) > _WRONG_LOAD:
        table.note(f"the load is {load:.4g} N, the definition says {rig.normal_load:g} N", "normal load")
    speeds = [
        float(np.median(table.columns[name][loaded])) * disc.rolling_radius
        for name, disc in (("speed 1", rig.disc1), ("speed 2", rig.disc2))
    ]
    if abs(np.mean(speeds) / rig.rolling_speed - 1.0) > _WRONG_SPEED:
        what = f"the mean speed is {np.mean(speeds):.4g} m/s, the definition says {rig.rolling_speed:.4g} m/s"
        table.note(f"{what}; check the unit", "speed 1")
    if speeds[0] < speeds[1]:
        table.note("disc 1 is the slower one, so creepage is negative: swapped with speed 2?", "speed 1")


def _align(time: Floats, creepage: Floats, history: History) -> Ints:
    """The step of each average: the cheapest path that never goes back. Time only decides between equal creepages."""
    steps = history.step_creepage
    ends = np.array([history.end_time[history.step == k][-1] for k in range(len(steps))])
    starts = np.concatenate([[0.0], ends[:-1]])
    since = (time - time[0])[:, None]
    late = np.maximum(since - ends, 0.0) + np.maximum(starts - since, 0.0)
    cost = np.minimum(np.abs(creepage[:, None] - steps) / tolerance(history), 3.0) ** 2 + 1e-3 * late / ends[-1]
    came_from = np.empty(cost.shape, dtype=np.int64)
    total = cost[0]
    for row in range(1, len(cost)):
        best = np.minimum.accumulate(total)
        is_new = total <= best
        came_from[row] = np.maximum.accumulate(np.where(is_new, np.arange(len(steps)), 0))
        total = best + cost[row]
    path = np.empty(len(cost), dtype=np.int64)
    path[-1] = int(np.argmin(total))
    for row in range(len(cost) - 1, 0, -1):
        path[row - 1] = came_from[row, path[row]]
    return path


def _settled(creepage: Floats, step: Ints, history: History) -> Bools:
    """Averages at their step's creepage that do not straddle a change of step."""
    steps = history.step_creepage
    settled = np.abs(creepage - steps[step]) <= tolerance(history)[step]
    change = np.flatnonzero(np.diff(step))
    settled[change] = False
    settled[change + 1] = False
    return np.asarray(settled)


def _check_steps(table: Table, time: Floats, step: Ints, kept: Bools, history: History) -> None:
    """Every step is there and as long as the history says."""
    for index, creepage in enumerate(history.step_creepage):
        planned = float(history.duration[history.step == index].sum())
        mine = time[kept & (step == index)]
        if len(mine) == 0:
            table.note(f"no stretch of the log runs at the {creepage * 100:g} % of step {index + 1}", "speed 1")
        elif np.ptp(mine) > _LONGEST * planned:
            table.note(f"step {index + 1} lasts {np.ptp(mine):.4g} s here, {planned:.4g} s in the history", "time")


def _history_time(time: Floats, step: Ints, history: History) -> Floats:
    """Times on the history's clock: those of each step counted from where the log begins it."""
    result = np.empty_like(time)
    for index in np.unique(step):
        mine = step == index
        duration = history.duration[history.step == index].sum()
        end = history.end_time[history.step == index][-1]
        half = 0.5 * history.duration[0] / _PER_ITERATION
        result[mine] = np.minimum(end - duration + half + time[mine] - time[mine][0], end)
    return result
