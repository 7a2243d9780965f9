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
from twindisc_cli.model.experiment import Floats, History, Measured, Provenance, Rig

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


def read(sources: Sources, *, rig: Rig, history: History | None, provenance: Provenance) -> Recorded:
    """Every measured channel; MeasurementError holds the mistakes of all files. history None: it is found in them."""
    problems: list[Problem] = []
    hashes: dict[str, str] = {}
    rows: list[RowCount] = []

    def content(source: Source) -> tuple[Content, str]:
        data = read_bytes(sources.folder / source.file)
        hashes[source.file] = sha256(data).hexdigest()
        read = Content(data, source.sheet, source.skip, source.ignore)
        return read, str(sources.folder / source.file)

    @contextmanager
    def gathered() -> Iterator[None]:
        try:
            yield
        except MeasurementError as error:
            problems.extend(error.problems)

    traction = profile = place = start = temperature = mass = zero = begin = None
    named, result = sources.columns, history is None
    with gathered():
        if sources.log:
            recorded = read_log(*content(sources.log), rig=rig, torque_disc=sources.torque_disc, naming=named)
            log = log_samples(recorded, rig=rig, history=history, torque_zero=sources.torque_zero)
            traction, history, zero = log.samples, log.history, log.zero
            begin = log.begin if result or _same(sources.temperature, sources.log) else None
            rows.append(replace(log.rows, file=sources.log.file))
        elif sources.traction:
            data = content(sources.traction)
            traction, history, count = read_traction(*data, rig=rig, history=history, naming=named)
            rows.append(replace(count, file=sources.traction.file))
    if history is None:
        raise MeasurementError(problems)
    with gathered():
        if sources.profile:
            profile, place, start, count = read_profile(
                *content(sources.profile),
                rig=rig,
                history=history,
                naming=named,
                as_recorded=sources.profile_place == "as recorded",
            )
            rows.append(replace(count, file=sources.profile.file))
    with gathered():
        if sources.temperature:
            data = content(sources.temperature)
            if begin is None:
                temperature, count = read_temperature(*data, history=history, naming=named)
            else:
                temperature, count = log_temperature(*data, history=history, begin=begin, naming=named)
            rows.append(replace(count, file=sources.temperature.file))
    with gathered():
        if sources.mass:
            mass, count = read_mass(*content(sources.mass), history=history, naming=named)
            rows.append(replace(count, file=sources.mass.file))
    others: dict[str, Any] = {}
    for name, other in sources.others.items():
        with gathered():
            others[name], count = read_other(*content(other.source), other, history=history, naming=named)
            rows.append(replace(count, file=other.source.file))
    if problems:
        raise MeasurementError(problems)
    measured = Measured(
        traction, profile, temperature, mass, provenance, torque_zero=zero, profile_place=place, start=start,
        others=others,
    )  # fmt: skip
    return Recorded(measured, history, hashes, tuple(rows))


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
