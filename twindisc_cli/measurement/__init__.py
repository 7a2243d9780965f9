"""Measured data: CSV files and rig logs in, SI samples out, every mistake with its file, line and column."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from hashlib import sha256
from itertools import zip_longest
from pathlib import Path
from typing import Any, Literal

import numpy as np

from twindisc_cli.errors import MeasurementError, Problem
from twindisc_cli.measurement.channels import check_enough, check_time, read_temperature, read_traction
from twindisc_cli.measurement.content import Content, read_bytes
from twindisc_cli.measurement.creepage_noise import steadied
from twindisc_cli.measurement.found_steps import counted
from twindisc_cli.measurement.header import Column, Named, Naming
from twindisc_cli.measurement.joined import joined
from twindisc_cli.measurement.log import read_log
from twindisc_cli.measurement.profile import read_profile
from twindisc_cli.measurement.rig_log import ZeroSetting, log_samples, log_temperature
from twindisc_cli.measurement.rows import RowCount
from twindisc_cli.measurement.table import read_table
from twindisc_cli.measurement.units import kind_of
from twindisc_cli.measurement.weighings import read_mass
from twindisc_cli.model.experiment import (
    Floats,
    History,
    Measured,
    Provenance,
    RecordedColumn,
    Rig,
    TemperatureSamples,
    TorqueZero,
    TractionSamples,
)
from twindisc_cli.quantities import UNITS

__all__ = ["Named", "Other", "Recorded", "RowCount", "Source", "Sources", "ZeroSetting", "column", "read"]


@dataclass(frozen=True)
class Source:
    """A file relative to the definition, and how it is read, as of Content."""

    file: str
    sheet: str | None = None
    skip: tuple[str, ...] | None = None
    ignore: tuple[str, ...] = ()


@dataclass(frozen=True)
class Other:
    """The file of a further channel: its columns with their ranges [SI], and what makes samples of them."""

    source: Source
    columns: Sequence[Column]
    ranges: Mapping[str, tuple[float, float]]
    samples: Callable[[Mapping[str, Floats], History], Any]
    fewest: int


def column(name: str, unit: str, *, required: bool = True) -> Column:
    """A column in any unit of the same kind as `unit`."""
    return Column(name, kind_of(unit), required)


@dataclass(frozen=True)
class Sources:
    """The files of a test, as its definition names them, relative to `folder`; None where there is none.

    torque_disc: the disc whose torque the rig log holds; torque_zero: how its zero is known; profile_place: whether
    profiles stay where they are; balance_mg: standard error of a weighing, NaN where it is not stated; per_iteration:
    revolutions of an iteration of a history that is found, NaN likewise. columns: what is said of columns in the files.
    others: files of further channels, by the channel. covariates: declared columns of the traction or the logs.
    """

    folder: Path
    traction: Source | None = None
    log: tuple[Source, ...] = ()
    profile: Source | None = None
    temperature: tuple[Source, ...] = ()
    mass: Source | None = None
    torque_disc: int | None = None
    torque_zero: ZeroSetting = None
    profile_place: Literal["as recorded"] | None = None
    balance_mg: float = math.nan
    per_iteration: float = math.nan
    columns: Naming = field(default_factory=dict)
    others: Mapping[str, Other] = field(default_factory=dict)
    covariates: tuple[str, ...] = ()


@dataclass(frozen=True)
class Recorded:
    """What the files of a test hold: the channels, sha256 by the name of each file, and what became of its rows.

    history: as it was given, or found in the file of the traction.
    """

    measured: Measured
    history: History
    hashes: dict[str, str]
    rows: tuple[RowCount, ...]


@dataclass
class _Reading:
    """The files of a test as they are read: mistakes, sha256 by file and counts of rows gather in it."""

    sources: Sources
    rig: Rig
    problems: list[Problem] = field(default_factory=list)
    hashes: dict[str, str] = field(default_factory=dict)
    rows: list[RowCount] = field(default_factory=list)

    def content(self, source: Source) -> tuple[Content, str]:
        """What is in a file and how it is read, and its path."""
        data = read_bytes(self.sources.folder / source.file)
        self.hashes[source.file] = sha256(data).hexdigest()
        content = Content(data, source.sheet, source.skip, source.ignore)
        return content, str(self.sources.folder / source.file)

    @contextmanager
    def gathered(self) -> Iterator[None]:
        """Mistakes of a file do not keep those of the next from being seen."""
        try:
            yield
        except MeasurementError as error:
            self.problems.extend(error.problems)

    def counted(self, count: RowCount, *sources: Source) -> None:
        """What became of the rows of a file."""
        more = f" and {len(sources) - 1} more" if len(sources) > 1 else ""
        self.rows.append(replace(count, file=f"{sources[0].file}{more}"))


@dataclass(frozen=True)
class _Traction:
    """Samples of the traction and the history; zero, begin and shifts of the clock are known of a log.

    creepage_noise: what was taken off the creepages, its standard deviation [1].
    """

    samples: TractionSamples | None = None
    history: History | None = None
    zero: TorqueZero | None = None
    begin: float | None = None
    shifts: Sequence[float] = ()
    columns: Mapping[str, RecordedColumn] = field(default_factory=dict)
    creepage_noise: float = 0.0


def read(
    sources: Sources, *, rig: Rig, history: History | None, provenance: Provenance, as_recorded: bool = False
) -> Recorded:
    """Every measured channel; MeasurementError holds the mistakes of all files. history None: it is found in them.

    as_recorded: the creepages keep the noise of their measurement, see creepage_noise.
    """
    reading = _Reading(sources, rig)
    traction, named = _Traction(history=history), sources.columns
    with reading.gathered():
        traction = _traction(reading, history)
        if not as_recorded:
            traction = _without_creepage_noise(traction, reading)
    if traction.history is None:
        raise MeasurementError(reading.problems)
    history = counted(traction.history, sources.per_iteration) if history is None else traction.history
    profile = place = start = temperature = mass = None
    with reading.gathered():
        if sources.mass:
            data, balance = reading.content(sources.mass), sources.balance_mg * UNITS["mg"].factor
            mass, history, count = read_mass(*data, rig=rig, history=history, naming=named, balance=balance)
            reading.counted(count, sources.mass)
    with reading.gathered():
        if sources.profile:
            data, as_recorded = reading.content(sources.profile), sources.profile_place == "as recorded"
            profile, place, start, count = read_profile(
                *data, rig=rig, history=history, naming=named, as_recorded=as_recorded
            )
            reading.counted(count, sources.profile)
    with reading.gathered():
        if sources.temperature:
            temperature = _temperature(reading, history, traction)
    others: dict[str, Any] = {}
    for name, other in sources.others.items():
        with reading.gathered():
            others[name], count = read_other(*reading.content(other.source), other, history=history, naming=named)
            reading.counted(count, other.source)
    if reading.problems:
        raise MeasurementError(reading.problems)
    measured = Measured(
        traction.samples, profile, temperature, mass, provenance, torque_zero=traction.zero, profile_place=place,
        start=start, creepage_noise=traction.creepage_noise, others=others, columns=traction.columns,
    )  # fmt: skip
    return Recorded(measured, history, reading.hashes, tuple(reading.rows))


def _traction(reading: _Reading, history: History | None) -> _Traction:
    """The traction of a table or of the logs, and the history, which is found where it is None."""
    sources, rig = reading.sources, reading.rig
    if sources.log:
        disc, naming = sources.torque_disc, sources.columns
        logs = [
            read_log(*reading.content(log), rig=rig, torque_disc=disc, naming=naming, covariates=sources.covariates)
            for log in sources.log
        ]
        if not sources.temperature and any(name.startswith("temperature") for name in logs[0].table.unread):
            key = f'temperature = "{sources.log[0].file}"'
            logs[0].table.notes.append(f"its temperature is not read: {key} under [measured] reads it")
        recorded, shifts = joined(logs)
        log = log_samples(recorded, rig=rig, history=history, torque_zero=sources.torque_zero)
        reading.counted(log.rows, *sources.log)
        same = [source.file for source in sources.temperature] == [source.file for source in sources.log]
        begin = log.begin if history is None or same else None
        return _Traction(log.samples, log.history, log.zero, begin, shifts if same else (), log.columns)
    if sources.traction:
        data = reading.content(sources.traction)
        samples, columns, history, count = read_traction(
            *data, rig=rig, history=history, naming=sources.columns, covariates=sources.covariates
        )
        reading.counted(count, sources.traction)
        return _Traction(samples, history, columns=columns)
    return _Traction(history=history)


def _without_creepage_noise(traction: _Traction, reading: _Reading) -> _Traction:
    """Traction over time without the noise of its creepages; what was left out is a note of the file."""
    samples = traction.samples
    if samples is None or not np.isfinite(samples.time).all():
        return traction
    steady = steadied(samples.creepage, samples.ratio, samples.time, samples.step)
    if steady.note:
        reading.rows[-1] = replace(reading.rows[-1], notes=(steady.note, *reading.rows[-1].notes))
    return replace(traction, samples=replace(samples, creepage=steady.creepage), creepage_noise=steady.std)


def _temperature(reading: _Reading, history: History, traction: _Traction) -> TemperatureSamples:
    """The temperatures of a file or of the logs, on the clock of these where the history begins somewhere on it."""
    naming = reading.sources.columns
    parts: list[TemperatureSamples] = []
    for source, shift in zip_longest(reading.sources.temperature, traction.shifts, fillvalue=0.0):
        assert isinstance(source, Source)  # shifts are of the same files
        data = reading.content(source)
        if traction.begin is None:
            part, count = read_temperature(*data, history=history, naming=naming)
        else:
            begin = traction.begin - float(shift)
            part, count = log_temperature(*data, history=history, begin=begin, naming=naming)
        if parts and part.time[0] <= parts[-1].time[-1]:
            what = f"begins at {part.time[0]:g} s of the history, and the file before ends at {parts[-1].time[-1]:g} s"
            raise MeasurementError(Problem(f"{what}: is the order right?", data[1], 0, "time"))
        parts.append(part)
        reading.counted(count, source)
    time, temperature = (np.concatenate([getattr(p, name) for p in parts]) for name in ("time", "temperature"))
    return TemperatureSamples(time, temperature)


def _out_of_range(written: Floats, row: int) -> str:
    return f"{written[row]:g} lies outside the range of it; check the unit"


def read_other(data: Content, file: str, other: Other, *, history: History, naming: Naming) -> tuple[Any, RowCount]:
    """The samples of a further channel; a column `time` must rise inside the history."""
    table = read_table(data, file, other.columns, naming)
    check_enough(table, other.fewest)
    if "time" in table.columns:
        partner = next((c.name for c in other.columns if c.name != "time" and c.name in table.columns), "time")
        check_time(table, history, partner=partner)
    for name, (lower, upper) in other.ranges.items():
        if name in table.columns:
            values = table.columns[name]
            table.flag((values < lower) | (values > upper), name, partial(_out_of_range, table.written(name)))
    table.check()
    return other.samples(table.columns, history), table.count()
