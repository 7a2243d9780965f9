"""The measured channels traction and temperature, checked against the rig and its history."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from twindisc_cli.measurement.content import Content
from twindisc_cli.measurement.found_steps import Seen, begun_at_zero, find_steps, history_text, steps_of_curve
from twindisc_cli.measurement.header import Column, Naming, declared
from twindisc_cli.measurement.held import keep_readings
from twindisc_cli.measurement.rows import RowCount
from twindisc_cli.measurement.sheet import Floats, Ints
from twindisc_cli.measurement.table import Table, read_table
from twindisc_cli.measurement.units import COUNT, PERCENTAGE, RATIO, TEMPERATURE, TIME
from twindisc_cli.model.experiment import History, RecordedColumn, Rig, TemperatureSamples, TractionSamples
from twindisc_cli.model.points import sample_times

CREEPAGE_TOLERANCE = (0.25, 2e-4)
"""How far a creepage may lie from its step's: relative, of a step without creepage to the smallest; plus absolute."""
SAME_CREEPAGE = (0.05, 2e-4)
"""How far the mean creepage of a step may lie from the history's without a word: relative, plus absolute."""
_LISTED = 3  # steps that are named
LARGEST_RATIO = 3.0  # no dry contact transmits thrice its load: the units are wrong
SLIP = ("slide-roll ratio", "slide roll ratio", "srr", "slip", "slip ratio")
RATIOS = ("traction coefficient", "friction coefficient", "mu", "cof", "t/n", "t over n")
"""Other names of creepage and of T/N in the files of rigs."""
FEWEST = {"traction": 2, "temperature": 3}


def read_traction(
    data: bytes | Content, file: str, *, rig: Rig, history: History | None, naming: Naming | None = None,
    covariates: Sequence[str] = (),
) -> tuple[TractionSamples, Mapping[str, RecordedColumn], History, RowCount]:  # fmt: skip
    """T/N against creepage, one row a sample or one a step, and declared columns; history None: it is found."""
    wanted = (
        Column("creepage", PERCENTAGE, also=SLIP),
        Column("traction ratio", RATIO, also=RATIOS),
        Column("time", TIME, required=False),
        Column("step", COUNT, required=False),
        Column("uncertainty", RATIO, required=False),
        *map(declared, covariates),
    )
    table = read_table(data, file, wanted, naming)
    columns = table.columns
    check_enough(table, FEWEST["traction"])
    if history is None:
        history = _found_history(table, rig)
    if "time" in columns:
        check_time(table, history, partner="traction ratio")
    step = _steps(table, history)
    if not _swapped(table, history):
        _check_creepage(table, history, step)
        wild = np.abs(columns["traction ratio"]) > LARGEST_RATIO
        ratio = columns["traction ratio"]
        table.flag(wild, "traction ratio", lambda row: f"T/N of {ratio[row]:g} cannot be; is it in %, or a force?")
    if "uncertainty" in columns:
        table.flag(columns["uncertainty"] <= 0.0, "uncertainty", lambda _: "must be greater than 0")
    table.check()
    if "time" in columns:
        kept = keep_readings(table, "traction ratio")
        columns, step = table.columns, step[kept]
    unknown = np.full(len(table), np.nan)
    samples = TractionSamples(
        time=columns.get("time", unknown),
        step=step,
        creepage=columns["creepage"],
        ratio=columns["traction ratio"],
        uncertainty=columns.get("uncertainty", unknown),
    )
    time = sample_times(history, samples)
    others = {name: RecordedColumn(time, step, columns[declared(name).name]) for name in covariates}
    return samples, others, history, table.count()


def _found_history(table: Table, rig: Rig) -> History:
    """The history that a table of traction shows; it begins at time 0."""
    table.check()
    columns, unknown = table.columns, np.full(len(table), np.nan)
    label = columns["step"].astype(np.int64) if "step" in columns else np.zeros(len(table), dtype=np.int64)
    if "time" not in columns:
        history = steps_of_curve(columns["creepage"], label if "step" in columns else None, rig)
        table.notes.append("a curve without time: its steps are levels of creepage, and their length means nothing")
    else:
        table.flag(np.diff(columns["time"], prepend=-np.inf) <= 0.0, "time", lambda _: "is not after the row before")
        table.check()
        seen = Seen(columns["time"], columns["creepage"], unknown, np.full(len(table), rig.normal_load), label)
        found_steps = find_steps(seen, rig)
        history = begun_at_zero(found_steps)
    table.notes.append(f"the history found in it:\n{history_text(history, rig)}")
    return history


def read_temperature(
    data: bytes | Content, file: str, *, history: History, naming: Naming | None = None
) -> tuple[TemperatureSamples, RowCount]:
    """Disc temperature over time."""
    table = read_table(data, file, (Column("time", TIME), Column("temperature", TEMPERATURE)), naming)
    check_enough(table, FEWEST["temperature"])
    check_time(table, history, partner="temperature")
    check_kelvin(table)
    table.check()
    keep_readings(table, "temperature")
    return TemperatureSamples(time=table.columns["time"], temperature=table.columns["temperature"]), table.count()


def check_kelvin(table: Table) -> None:
    """No temperature lies below absolute zero."""
    kelvin = table.columns["temperature"]
    table.flag(kelvin < 0.0, "temperature", lambda row: f"{kelvin[row]:g} K is below absolute zero; check the unit")


def step_at(history: History, time: Floats) -> Ints:
    """The step that runs at each time; the end of a step belongs to it."""
    return history.step[history.iteration_at(time)]


def with_iterations(table: Table, history: History) -> History:
    """A history that was found, on which the iterations that a table names are counted; one that was given as it is.

    Where nobody said how long an iteration is, the last that the table names ends where the history does.
    """
    if history.per_iteration is None or np.isfinite(history.per_iteration):
        return history
    named = table.columns.get("iteration", np.ones(1))
    last = max(float(np.max(named, initial=1.0)), 1.0)
    length = float(history.revolutions.sum()) / last
    if "iteration" in table.columns:
        table.notes.append(
            f"iteration {last:g}, the last in it, is taken for the end of the history: {length:.6g} revolutions each; "
            '[history] with revolutions_per_iteration and steps = "measured" overrules'
        )
    return replace(history, per_iteration=length)


def check_place(table: Table, disc: Ints, iteration: Ints, last: int, first: int = 1) -> None:
    """Discs are 1 or 2, iterations those of the history."""
    table.flag((disc != 1) & (disc != 2), "disc", lambda row: f"there is no disc {disc[row]}; it is 1 or 2")
    outside = (iteration < first) | (iteration > last)
    table.flag(outside, "iteration", lambda row: f"the history has iterations 1 to {last}, not {iteration[row]}")


def tolerance(history: History) -> Floats:
    """How far from each step's creepage a measured one may lie [1], (step,)."""
    relative, absolute = CREEPAGE_TOLERANCE
    size = np.abs(history.step_creepage)
    smallest = float(np.min(size[size > 0.0], initial=np.inf))
    return np.asarray(relative * np.where(size > 0.0, size, smallest if np.isfinite(smallest) else 0.0) + absolute)


def check_enough(table: Table, fewest: int) -> None:
    """As many rows as a channel needs."""
    if len(table) < fewest and not table.problems:
        table.note(f"too few points: {len(table)}, at least {fewest} are needed", line=int(table.lines[-1]))


def check_time(table: Table, history: History, *, partner: str) -> None:
    """Times rise, without doubles, inside the history."""
    time, end = table.columns["time"], float(history.end_time[-1])
    rise = np.diff(time, prepend=-np.inf)
    rises_instead = np.all(np.diff(table.columns[partner]) > 0.0)
    hint = f"; swapped with {table.headers[partner]}?" if rises_instead else ""
    written = table.written("time")
    table.flag(rise == 0.0, "time", lambda row: f"time {written[row]:g} occurs twice{hint}")
    table.flag(rise < 0.0, "time", lambda row: f"time {written[row]:g} is earlier than the row before{hint}")
    outside = (time < 0.0) | (time > end * 1.001)
    table.flag(outside, "time", lambda row: f"{time[row]:g} s lies outside the history, 0 to {end:g} s; check the unit")


def _steps(table: Table, history: History) -> Ints:
    """The step of each row, from 0: as the file says, else by time, else the one nearest in creepage."""
    creepage, steps, driven = table.columns["creepage"], history.step_creepage, np.flatnonzero(history.step_driven)
    if "step" in table.columns:
        given = table.columns["step"].astype(np.int64)
        unknown = (given < 1) | (given > len(steps))
        table.flag(unknown, "step", lambda row: f"there is no step {given[row]}; the history has 1 to {len(steps)}")
        step = np.clip(given, 1, len(steps)) - 1
        table.flag(~history.step_driven[step], "step", lambda row: f"step {given[row]} of the history is a pause")
        if "time" in table.columns:
            _check_step_times(table, history, step)
        return step
    if "time" in table.columns:
        return step_at(history, table.columns["time"])
    if len(creepage) == len(driven) and np.all(np.abs(creepage - steps[driven]) <= tolerance(history)[driven]):
        return driven
    return _nearest(creepage, history)


def _nearest(values: Floats, history: History) -> Ints:
    """The step whose creepage is nearest to each value, the first of several."""
    driven = np.flatnonzero(history.step_driven)
    distinct, first = np.unique(history.step_creepage[driven], return_index=True)
    above = np.minimum(np.searchsorted(distinct, values), len(distinct) - 1)
    below = np.maximum(above - 1, 0)
    lower = values - distinct[below] <= np.abs(distinct[above] - values)
    return np.asarray(driven[first[np.where(lower, below, above)]], dtype=np.int64)


def _check_step_times(table: Table, history: History, step: Ints) -> None:
    """A row's step runs at the row's time, give or take half an iteration."""
    time, end = table.columns["time"], history.end_time
    ends = np.array([end[history.step == k][-1] for k in range(len(history.step_creepage))])
    starts, slack = np.concatenate([[0.0], ends[:-1]]), 0.5 * float(history.duration[0])
    early_or_late = (time < starts[step] - slack) | (time > ends[step] + slack)

    def what(row: int) -> str:
        runs = f"{starts[step[row]]:g} to {ends[step[row]]:g} s"
        return f"step {step[row] + 1} runs from {runs} in the history, not at {time[row]:g} s"

    table.flag(early_or_late, "step", what)


def _check_creepage(table: Table, history: History, step: Ints) -> None:
    """Creepages are those of the history."""
    creepage, steps, allowed = table.columns["creepage"], history.step_creepage, tolerance(history)
    expected = steps[step]
    hint = _other_creepage(table, history)

    def what(row: int) -> str:
        other = int(np.argmin(np.abs(steps - creepage[row])))
        text = f"{creepage[row] * 100:g} % is not the history's: step {step[row] + 1} has {expected[row] * 100:g} %"
        near = abs(steps[other] - creepage[row]) <= allowed[other]
        return f"{text}, step {other + 1} has {steps[other] * 100:g} %" if near and other != step[row] else text + hint

    table.flag(np.abs(creepage - expected) > allowed[step], "creepage", what)
    if {"step", "time"} & set(table.columns):
        _note_other_creepages(table, history, step)


def _other_creepage(table: Table, history: History) -> str:
    """What else creepages that are not those of the history may be, as a question behind what is wrong with them."""
    is_percent = table.scales["creepage"][0] < 1.0
    meant = {
        100.0: "is it creepage [1]?",
        0.01: "is creepage_percent in the definition a fraction? It is in %" if is_percent else "is it creepage [%]?",
        -1.0: "is its sign the other one? Then columns.creepage = { sign = -1 } under [measured] turns it, or "
        "creepage_percent in the definition has the wrong sign",
    }
    creepage = table.columns["creepage"]
    return "".join(f"; {what}" for factor, what in meant.items() if _matched(factor * creepage, history)[0])


def _note_other_creepages(table: Table, history: History, step: Ints) -> None:
    """Say where the creepage of a step is another than the history has, which is taken for what was set."""
    (relative, absolute), count = SAME_CREEPAGE, np.bincount(step)
    mean = np.bincount(step, table.columns["creepage"]) / np.maximum(count, 1)
    planned = history.step_creepage[: len(mean)]
    other = np.flatnonzero((count > 0) & (np.abs(mean - planned) > relative * np.abs(planned) + absolute))
    if len(other):
        listed = ", ".join(f"{mean[k] * 100:.3g} % in step {k + 1} ({planned[k] * 100:g} %)" for k in other[:_LISTED])
        more = f" and {len(other) - _LISTED} more" if len(other) > _LISTED else ""
        table.notes.append(f"creepages are not those of the history: {listed}{more}; T/N is read at what was recorded")


def _matched(values: Floats, history: History) -> tuple[bool, int]:
    """Whether all values are creepages of the history's steps, and how many of these occur among them."""
    steps, nearest = history.step_creepage, _nearest(values, history)
    fits = np.abs(values - steps[nearest]) <= tolerance(history)[nearest]
    return bool(np.all(fits)), len(np.unique(steps[nearest[fits]]))


def _swapped(table: Table, history: History) -> bool:
    """Whether the traction ratios look like the history's creepages, and better than the creepages do."""
    creepage, (factor, _) = table.columns["creepage"], table.scales["creepage"]
    ratio = table.written("traction ratio") * factor
    (fits, many), (_, few) = _matched(ratio, history), _matched(creepage, history)
    if len(ratio) and fits and many > max(1, few):
        table.note(
            f"these look like the history's creepages: swapped with {table.headers['creepage']}?",
            "traction ratio",
            int(table.lines[0]),
        )
        return True
    return False
