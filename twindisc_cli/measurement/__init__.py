"""Measured data: CSV files and rig logs in, SI samples out, every mistake with its file, line and column."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from hashlib import sha256
from pathlib import Path
from typing import Literal

from twindisc_cli.errors import MeasurementError, Problem
from twindisc_cli.measurement.channels import read_mass, read_temperature, read_traction
from twindisc_cli.measurement.content import Content, read_bytes
from twindisc_cli.measurement.header import Named, Naming
from twindisc_cli.measurement.log import read_log
from twindisc_cli.measurement.profile import read_profile
from twindisc_cli.measurement.rig_log import ZeroSetting, log_samples, log_temperature
from twindisc_cli.measurement.rows import RowCount
from twindisc_cli.model.experiment import History, Measured, Provenance, Rig

__all__ = ["Named", "Recorded", "RowCount", "Source", "Sources", "ZeroSetting", "read"]


@dataclass(frozen=True)
class Source:
    """A file relative to the definition, and how it is read, as of Content."""

    file: str
    sheet: str | None = None
    skip: tuple[str, ...] | None = None
    ignore: tuple[str, ...] = ()


@dataclass(frozen=True)
class Sources:
    """The files of a test, as its definition names them, relative to `folder`; None where there is none.

    torque_disc: the disc whose torque the rig log holds; torque_zero: how its zero is known; profile_place: whether
    profiles stay where they are. columns: what is said
    of columns in the files.
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
    named, found = sources.columns, history is None
    with gathered():
        if sources.log:
            recorded = read_log(*content(sources.log), rig=rig, torque_disc=sources.torque_disc, naming=named)
            log = log_samples(recorded, rig=rig, history=history, torque_zero=sources.torque_zero)
            traction, history, zero = log.samples, log.history, log.zero
            begin = log.begin if found or _same(sources.temperature, sources.log) else None
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
    if problems:
        raise MeasurementError(problems)
    measured = Measured(
        traction, profile, temperature, mass, provenance, torque_zero=zero, profile_place=place, start=start
    )
    return Recorded(measured, history, hashes, tuple(rows))


def _same(one: Source | None, other: Source | None) -> bool:
    return one is not None and other is not None and one.file == other.file
