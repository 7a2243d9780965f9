"""Measured data: CSV files and rig logs in, SI samples out, every mistake with its file, line and column."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import Any, Literal

from twindisc_cli.errors import MeasurementError, Problem
from twindisc_cli.measurement.channels import check_enough, check_time, read_mass, read_temperature, read_traction
from twindisc_cli.measurement.content import Content, read_bytes
from twindisc_cli.measurement.header import Column, Named, Naming
from twindisc_cli.measurement.log import read_log
from twindisc_cli.measurement.profile import read_profile
from twindisc_cli.measurement.rig_log import ZeroSetting, log_samples, log_temperature
from twindisc_cli.measurement.rows import RowCount
from twindisc_cli.measurement.table import read_table
from twindisc_cli.measurement.units import kind_of
from twindisc_cli.model.experiment import Floats, History, Measured, Provenance, Rig, TorqueZero, TractionSamples

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
    profiles stay where they are. columns: what is said
    of columns in the files. others: files of further channels, by the channel.
    """

    folder: Path
    traction: Source | None = None
    log: Source | None = None
    profile: Source | None = None
    temperature: Source | None = None
    mass: Source | None = None
    torque_disc: int | None = None
    torque_zero: ZeroSetting = None
    profile_place: Literal["as recorded"] | None = None
    columns: Naming = field(default_factory=dict)
    others: Mapping[str, Other] = field(default_factory=dict)


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
    """Files that are read one after another: their digests, rows and mistakes."""

    sources: Sources
    problems: list[Problem] = field(default_factory=list)
    hashes: dict[str, str] = field(default_factory=dict)
    rows: list[RowCount] = field(default_factory=list)

    def content(self, source: Source) -> tuple[Content, str]:
        """What a file holds, and its path."""
        path = self.sources.folder / source.file
        data = read_bytes(path)
        self.hashes[source.file] = sha256(data).hexdigest()
        return Content(data, source.sheet, source.skip, source.ignore), str(path)

    @contextmanager
    def of(self, source: Source | None) -> Iterator[list[RowCount]]:
        """Keep the mistakes of a file, and what became of its rows."""
        counts: list[RowCount] = []
        try:
            yield counts
        except MeasurementError as error:
            self.problems.extend(error.problems)
        self.rows.extend(replace(count, file=source.file) for count in counts if source is not None)

    def driven(
        self, rig: Rig, history: History | None
    ) -> tuple[TractionSamples | None, History | None, TorqueZero | None, float | None]:
        """What was driven: traction, history, zero of the torque, and when a log of the history's times began [s]."""
        sources, named = self.sources, self.sources.columns
        traction = zero = begin = None
        with self.of(sources.log or sources.traction) as counts:
            if sources.log:
                recorded = read_log(*self.content(sources.log), rig=rig, torque_disc=sources.torque_disc, naming=named)
                log = log_samples(recorded, rig=rig, history=history, torque_zero=sources.torque_zero)
                begin = log.begin if history is None or _same(sources.temperature, sources.log) else None
                traction, history, zero = log.samples, log.history, log.zero
                counts.append(log.rows)
            elif sources.traction:
                data = self.content(sources.traction)
                traction, history, count = read_traction(*data, rig=rig, history=history, naming=named)
                counts.append(count)
        return traction, history, zero, begin


def read(sources: Sources, *, rig: Rig, history: History | None, provenance: Provenance) -> Recorded:
    """Every measured channel; MeasurementError holds the mistakes of all files. history None: it is found in them."""
    reading, own, named = _Reading(sources), dict[str, Any](), sources.columns
    traction, driven, zero, begin = reading.driven(rig, history)
    if driven is None:
        raise MeasurementError(reading.problems)
    history, profile, place, start, temperature, mass = driven, None, None, None, None, None
    with reading.of(sources.profile) as counts:
        if sources.profile:
            data, as_recorded = reading.content(sources.profile), sources.profile_place == "as recorded"
            profile, place, start, count = read_profile(
                *data, rig=rig, history=history, naming=named, as_recorded=as_recorded
            )
            counts.append(count)
    with reading.of(sources.temperature) as counts:
        if sources.temperature:
            data = reading.content(sources.temperature)
            if begin is None:
                temperature, count = read_temperature(*data, history=history, naming=named)
            else:
                temperature, count = log_temperature(*data, history=history, begin=begin, naming=named)
            counts.append(count)
    with reading.of(sources.mass) as counts:
        if sources.mass:
            mass, count = read_mass(*reading.content(sources.mass), history=history, naming=named)
            counts.append(count)
    for name, other in sources.others.items():
        with reading.of(other.source) as counts:
            own[name], count = read_other(*reading.content(other.source), other, history=history, naming=named)
            counts.append(count)
    if reading.problems:
        raise MeasurementError(reading.problems)
    measured = Measured(
        traction, profile, temperature, mass, provenance, torque_zero=zero, profile_place=place, start=start, others=own
    )
    return Recorded(measured, history, reading.hashes, tuple(reading.rows))


def _same(one: Source | None, other: Source | None) -> bool:
    return one is not None and other is not None and one.file == other.file


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
