"""Measured data: CSV files and rig logs in, SI samples out, every mistake with its file, line and column."""

from __future__ import annotations

from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from twindisc_cli.errors import MeasurementError, Problem
from twindisc_cli.measurement.channels import read_profile, read_temperature, read_traction
from twindisc_cli.measurement.rig_log import read_rig_log
from twindisc_cli.measurement.table import read_bytes
from twindisc_cli.model.experiment import History, Measured, Provenance, Rig

__all__ = ["Sources", "read"]


@dataclass(frozen=True)
class Sources:
    """The files of a test, as its definition names them, relative to `folder`; None where there is none."""

    folder: Path
    traction: str | None = None
    rig_log: str | None = None
    profile: str | None = None
    temperature: str | None = None


def read(
    sources: Sources, *, rig: Rig, history: History, provenance: Provenance, torque_disc: int | None
) -> tuple[Measured, dict[str, str]]:
    """Every measured channel, and the sha256 of each file; MeasurementError holds the mistakes of all files."""
    problems: list[Problem] = []
    hashes: dict[str, str] = {}

    def content(name: str) -> tuple[bytes, str]:
        data = read_bytes(sources.folder / name)
        hashes[name] = sha256(data).hexdigest()
        return data, str(sources.folder / name)

    traction = profile = temperature = None
    try:
        if sources.rig_log and torque_disc:
            data, file = content(sources.rig_log)
            traction = read_rig_log(data, file, rig=rig, history=history, torque_disc=torque_disc)
        elif sources.traction:
            traction = read_traction(*content(sources.traction), history=history)
    except MeasurementError as error:
        problems.extend(error.problems)
    try:
        if sources.profile:
            profile = read_profile(*content(sources.profile), rig=rig, history=history)
    except MeasurementError as error:
        problems.extend(error.problems)
    try:
        if sources.temperature:
            temperature = read_temperature(*content(sources.temperature), history=history)
    except MeasurementError as error:
        problems.extend(error.problems)
    if problems:
        raise MeasurementError(problems)
    return Measured(traction=traction, profile=profile, temperature=temperature, provenance=provenance), hashes
