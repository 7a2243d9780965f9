"""A rig's log as it was written, row by row: creepage, rolling speed, load and traction, in SI units.

    creepage = (v1 - v2) / ((v1 + v2) / 2)          (Eq. 1), or a slide-roll ratio as recorded
    creepage = 2, rolling speed v / 2, where a sliding speed v is recorded: one body is held still
    T/N      = (signal - zero) / (arm N)            torque (arm: radius of its disc) or traction force (arm: 1)

T/N itself may be recorded, too. A load that is not recorded is the definition's.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from twindisc_cli.measurement.channels import FEWEST, LARGEST_RATIO, RATIOS, SLIP, check_enough
from twindisc_cli.measurement.content import Content
from twindisc_cli.measurement.header import Column, Naming, declared
from twindisc_cli.measurement.held import HELD, no_measurements
from twindisc_cli.measurement.limit import LIMIT
from twindisc_cli.measurement.sheet import Bools, Floats, Ints
from twindisc_cli.measurement.table import NO_NUMBER, Table, read_table
from twindisc_cli.measurement.units import COUNT, FORCE, PERCENTAGE, RATIO, SPEED, TIME, TORQUE, rim_speed
from twindisc_cli.model.experiment import Rig

Codes = NDArray[np.int8]
REASONS = (
    "", NO_NUMBER, "unloaded", "standing still", "turning the other way", "outlier",
    "running up", "running down", "at a change of step", "at the creepage of no step", "no signal under load", HELD,
    LIMIT, "without a signal of the load",
)  # fmt: skip
"""Why a row says nothing of the traction; the first: it does."""
CLOCK = (
    Column("time", TIME, also=("t", "elapsed time", "test time", "x_value")),
    Column("step", COUNT, required=False, also=("sweep",)),
)
"""The columns that tell when a row was written."""
UNLOADED = 0.1
"""Share of the least nominal load below which the discs are not pressed together."""
LARGEST_CREEPAGE = 2.001  # 2 where one disc stands still, and its rounding
_STANDING = 0.02  # of the rolling speed: a motor at rest still counts pulses
_FEWEST_ANEW = 5  # rows after which a clock may begin again
_FEWEST_STUCK = 4  # equal readings in a row: fewer happen by chance
_CHANGING = 0.8  # of the rows: a signal of coarse steps repeats itself without being stuck
_SPREADS = 12.0  # standard deviations of an outlier: far beyond those of a motor that starts
SMALLEST_RATIO = 0.003
"""A T/N below which a unit is more likely wrong than a contact that slippery."""
_MOST_OUTLIERS = 0.01  # of the rows: more are a state of the rig
_MOST_DEAD = 0.2  # of the rows: more are a signal that was never there
_UNIT = {"torque": (1e3, " mN m"), "traction force": (1.0, " N"), "traction ratio": (1.0, "")}


@dataclass(frozen=True)
class Log:
    """The rows of a log that are numbers, each (row,): time [s], creepage [1], speed [m/s], load [N], signal.

    speed is NaN and load the definition's where they were not recorded; signal and others are NaN in rows without a
    number of them, which say how the discs ran. kind: "torque" [N m], "traction force" [N] or "traction ratio" [1]; arm
    [m] of a torque. label: the step that the file names, None where it names none. others: declared columns, by how
    they are declared.
    """

    table: Table
    kind: str
    arm: float
    time: Floats
    creepage: Floats
    speed: Floats
    load: Floats
    signal: Floats
    label: Ints | None
    has_load: bool
    others: Mapping[str, Floats] = field(default_factory=dict)

    @property
    def read(self) -> Bools:
        """Rows (row,) with a number of the signal and of every declared column."""
        return np.asarray(np.isfinite([self.signal, *self.others.values()]).all(axis=0))

    def per_ratio(self, load: Floats | float) -> Floats:
        """The signal of T/N = 1 at a load [N]."""
        return np.ones_like(np.asarray(load)) if self.kind == "traction ratio" else np.asarray(self.arm * load)

    def unit_of(self, value: float) -> tuple[float, str]:
        """The unit in which a signal is written, and the factor to it; torques from 1 N m on are not in mN m."""
        if self.kind == "torque" and abs(value) >= 1.0:
            return 1.0, " N m"
        return _UNIT[self.kind]


def read_log(
    data: bytes | Content, file: str, *, rig: Rig, torque_disc: int | None, naming: Naming | None = None,
    covariates: Sequence[str] = (),
) -> Log:  # fmt: skip
    """The rows of a log; MeasurementError says which columns or rows are wrong."""
    declared_columns = [replace(declared(name), gaps=True) for name in covariates]
    first, *others = ((*way, *declared_columns) for way in _ways(rig))
    table = read_table(data, file, first, naming, gaps=True, instead=others)
    check_enough(table, FEWEST["traction"])
    _leave_out_disordered(table)
    check_time(table)
    table.check()
    columns = table.columns
    kind = next(name for name in _UNIT if name in columns)
    arm = _arm(table, rig, torque_disc) if kind == "torque" else 1.0
    creepage, speed = _motion(columns)
    _check_slip(table, creepage)
    has_load = "normal load" in columns
    if has_load:
        note_stuck(table, "normal load", columns["normal load"][columns["normal load"] != 0.0])
    else:
        table.notes.append(f"no load in it, so that of the definition: {rig.normal_load:g} N")
    log = Log(
        table=table,
        kind=kind,
        arm=arm,
        time=columns["time"],
        creepage=creepage,
        speed=speed,
        load=columns["normal load"] if has_load else np.full(len(table), rig.normal_load),
        signal=columns[kind],
        label=columns["step"].astype(np.int64) if "step" in columns else table.block,
        has_load=has_load,
        others={name: columns[declared(name).name] for name in covariates},
    )
    table.columns = {}
    return log


def _ways(rig: Rig) -> list[Sequence[Column]]:
    """The sets of columns that make a log: a traction signal, and two speeds or a creepage."""
    speeds = tuple(Column(f"speed {n}", rim_speed(disc.rolling_radius)) for n, disc in ((1, rig.disc1), (2, rig.disc2)))
    turning = {disc.rolling_radius for disc in (rig.disc1, rig.disc2) if np.isfinite(disc.rolling_radius)}
    rolling = rim_speed(turning.pop()) if len(turning) == 1 else SPEED
    slip = (
        Column("creepage", PERCENTAGE, also=SLIP),
        Column("rolling speed", rolling, required=False, also=("entrainment speed", "mean speed", "rolling")),
    )
    load = Column("normal load", FORCE, also=("load", "normal force", "fn"))
    optional = Column("normal load", FORCE, required=False, also=load.also)
    signals = (
        (Column("torque", TORQUE, gaps=True), load),
        (Column("traction ratio", RATIO, also=RATIOS, gaps=True), optional),
        (Column("traction force", FORCE, also=("friction force", "tangential force", "ft"), gaps=True), optional),
    )
    held = (Column("sliding speed", SPEED, also=("sliding velocity",)),)
    return [(*CLOCK, *motion, *signal) for signal in signals for motion in (speeds, slip, held)]


def _arm(table: Table, rig: Rig, torque_disc: int | None) -> float:
    """Radius [m] of the disc whose torque was measured; it need not be said where both are equal or only one turns."""
    radii = [rig.disc1.rolling_radius, rig.disc2.rolling_radius]
    if torque_disc is not None and not np.isfinite(radii[torque_disc - 1]):
        table.note(f"disc {torque_disc} does not turn, its rolling radius is inf: torque_disc is the other", "torque")
    elif torque_disc is None and np.isfinite(radii).all() and radii[0] != radii[1]:
        table.note("say with torque_disc = 1 or 2 which disc the torque was measured on: their radii differ", "torque")
    table.check()
    return min(radii) if torque_disc is None else radii[torque_disc - 1]


def _leave_out_disordered(table: Table) -> None:
    """Rows without a number of the signal are no rows of the log's clock where their time does not rise."""
    blank = ~np.isfinite(list(table.columns.values())).all(axis=0)
    stays = np.diff(table.columns["time"]) <= 0.0
    table.keep(~(blank & (np.append(False, stays) | np.append(stays, False))), NO_NUMBER)


def check_time(table: Table) -> None:
    """Times rise; they may begin anew with a step that is named, a header that comes again, or after a pause."""
    if table.problems:
        return
    time = table.columns["time"]
    again = np.flatnonzero(np.diff(time) <= 0.0) + 1
    label = table.columns.get("step", table.block)
    rises = len(again) < len(time) - 1
    if label is not None and len(again) and rises and np.all(label[again] != label[again - 1]):
        _count_on(table, again)
        table.notes.append("the time begins anew with each step, and is counted on")
        return
    if len(again) and _begins_anew(time, again):
        _count_on(table, again)
        table.notes.append(
            f"the time begins anew {len(again)} times, and is counted on; how long it paused is not known"
        )
        return
    rise = np.diff(time, prepend=-np.inf)
    table.flag(rise == 0.0, "time", lambda row: f"time {table.written('time')[row]:g} occurs twice")
    table.flag(rise < 0.0, "time", lambda row: f"time {table.written('time')[row]:g} is earlier than the row before")


def _begins_anew(time: Floats, again: Ints) -> bool:
    """Whether the clock starts where it first did, for some rows each time."""
    spacing = float(np.median(np.diff(time)))
    ends = np.append(again, len(time))
    long_enough = np.all(np.diff(ends) >= _FEWEST_ANEW) and again[0] >= _FEWEST_ANEW
    if not (spacing > 0.0 and long_enough):
        return False
    follows = time[again + 1] - time[again]
    return bool(np.all(np.abs(time[again] - time[0]) <= 2.0 * spacing) and np.all(follows <= 3.0 * spacing))


def _count_on(table: Table, again: Ints) -> None:
    """Times that go on where they begin anew."""
    time = table.columns["time"]
    shift, apart = np.zeros(len(time)), np.diff(time)
    shift[again] = time[again - 1] + float(np.median(apart[apart > 0.0])) - time[again]
    table.columns["time"] = time + np.cumsum(shift)


def note_stuck(table: Table, name: str, values: Floats) -> None:
    """Say where a column that changes from row to row holds one number for many rows: a marker, or a dead channel."""
    if len(values) < _FEWEST_STUCK:
        return
    same = values[1:] == values[:-1]
    if np.mean(same) > 1.0 - _CHANGING or not np.any(same):
        return
    outside = np.zeros(1, dtype=bool)
    ends = np.flatnonzero(np.diff(same, prepend=outside, append=outside)).reshape(-1, 2)
    first, last = ends[np.argmax(ends[:, 1] - ends[:, 0])]
    count = int(last - first) + 1
    if count >= _FEWEST_STUCK:
        factor, offset = table.scales[name]
        written = f"{(values[first] - offset) / factor:g}"
        message = (
            f"{count} rows running hold exactly {written} in {table.headers[name]}, which else changes from row to row"
        )
        table.notes.append(f'{message}; skip = "{written}" leaves them out')


def _check_slip(table: Table, creepage: Floats) -> None:
    """No creepage lies beyond 200 %: one disc held fast."""
    with np.errstate(invalid="ignore"):
        beyond = "creepage" in table.columns and bool(np.any(np.abs(creepage) > LARGEST_CREEPAGE))
    if beyond:
        written = float(np.nanmax(np.abs(table.written("creepage"))))
        cure = ('columns.creepage = { unit = "%" }',)
        table.note(f"a creepage of {written:g} cannot be more than 200 %: is it in %?", "creepage", block=cure)
        table.check()


def _motion(columns: dict[str, Floats]) -> tuple[Floats, Floats]:
    """Creepage [1] and rolling speed [m/s] of each row; NaN where a speed was not recorded."""
    if "creepage" in columns:
        return columns["creepage"], columns.get("rolling speed", np.full(len(columns["time"]), np.nan))
    if "sliding speed" in columns:
        return np.full(len(columns["time"]), 2.0), 0.5 * np.abs(columns["sliding speed"])
    mean = 0.5 * (columns["speed 1"] + columns["speed 2"])
    with np.errstate(divide="ignore", invalid="ignore"):
        return (columns["speed 1"] - columns["speed 2"]) / mean, mean


def idle_rows(log: Log, rig: Rig, lightest: float) -> Codes:
    """Why each row says nothing of the traction, as an index of REASONS (row,); lightest: the least load [N]."""
    reason = np.zeros(len(log.time), dtype=np.int8)
    if log.has_load:
        reason[log.load <= UNLOADED * lightest] = REASONS.index("unloaded")
    with np.errstate(invalid="ignore"):
        standing = np.abs(log.speed) < _STANDING * rig.rolling_speed
        reason[standing & (reason == 0)] = REASONS.index("standing still")
        driven = log.speed[reason == 0]
        sense = np.sign(np.median(driven)) if len(driven) else 1.0
        reason[(sense * log.speed < 0.0) & (reason == 0)] = REASONS.index("turning the other way")
    if not np.any(reason == 0):
        _never_driven(log, rig, reason)
    return reason


def _never_driven(log: Log, rig: Rig, reason: Codes) -> None:
    if np.any(log.load < -UNLOADED * rig.normal_load):
        cure = ("columns.normal_load = { sign = -1 }",)
        log.table.note("the load is negative: what presses the discs together is positive", "normal load", block=cure)
    elif np.all(reason == REASONS.index("unloaded")):
        log.table.note(f"the load never comes near the definition's {rig.normal_load:g} N", "normal load")
    else:
        log.table.note("the discs never turn under the load", "speed 1")
    log.table.check()


def dead_rows(log: Log, reason: Codes) -> None:
    """Mark rows under load whose signal is exactly 0 amid others that are not: a channel that said nothing."""
    driven = reason == 0
    dead = driven & (log.signal == 0.0)
    if not np.any(dead) or dead.sum() > _MOST_DEAD * driven.sum():
        return
    size = np.abs(log.signal[driven & ~dead])
    if np.quantile(size, _MOST_DEAD) > 0.5 * np.median(size):
        reason[dead] = REASONS.index("no signal under load")


def repeats(log: Log, reason: Codes) -> None:
    """Mark rows under load that repeat a signal, which is held or of a dead sensor, and those at a limit of it."""
    driven = np.flatnonzero(reason == 0)
    held, limit = no_measurements(log.signal[driven])
    reason[driven[limit]] = REASONS.index(LIMIT)
    reason[driven[held]] = REASONS.index(HELD)


def outliers(log: Log, ratio: Floats, reason: Codes, *, zero_is_stated: bool) -> None:
    """Mark rows whose T/N (row,) no contact can have; many are a mistake of the file, or of a key of the definition."""
    with np.errstate(invalid="ignore"):
        wild = (reason == 0) & ~(np.abs(ratio) <= LARGEST_RATIO)
    if wild.sum() > _MOST_OUTLIERS * np.sum(reason == 0):
        row = int(np.flatnonzero(wild)[0])
        message = f"T/N of {ratio[row]:.3g} cannot be, and so in {int(wild.sum())} of {len(ratio)} rows"
        suspects = "the units, torque_disc and torque_zero" if zero_is_stated else "the units and torque_disc"
        log.table.note(f"{message}; check {suspects}", log.kind, int(log.table.lines[row]))
        log.table.check()
    reason[wild | _spikes(ratio, reason)] = REASONS.index("outlier")


def _spikes(ratio: Floats, reason: Codes) -> Bools:
    """Single rows far off both their neighbours, by half of the usual T/N and many times the usual scatter."""
    spikes = np.zeros(len(ratio), dtype=bool)
    driven = reason == 0
    inner = driven[1:-1] & driven[:-2] & driven[2:]
    if inner.sum() < _FEWEST_STUCK:
        return spikes
    with np.errstate(invalid="ignore"):
        beside = 0.5 * (ratio[:-2] + ratio[2:])
        off, apart = np.abs(ratio[1:-1] - beside), np.abs(ratio[2:] - ratio[:-2])
        usual, scatter = np.median(np.abs(ratio[1:-1][inner])), np.median(off[inner])
        result = inner & (off > 0.5 * usual) & (off > _SPREADS * scatter) & (off > 4.0 * apart)
    if result.sum() <= _MOST_OUTLIERS * inner.sum() + 1:
        spikes[1:-1] = result
    return spikes
