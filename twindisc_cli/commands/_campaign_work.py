"""What a worker of a campaign does with one test: read it, skip what is up to date, compute, write, give the row.

On one machine a worker does all of it. On a cluster the test is read, and its files are written, by the command
itself: the test travels to the worker with its data, and the files travel back as bytes.
"""

from __future__ import annotations

import os
import traceback
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from twindisc_cli import effects
from twindisc_cli.campaign.plan import Job, read
from twindisc_cli.campaign.table import Row, Value, columns_of, header
from twindisc_cli.commands import _runner
from twindisc_cli.definition import Test
from twindisc_cli.errors import TwindiscError, bug
from twindisc_cli.identify.track import last_profile
from twindisc_cli.loop import channels
from twindisc_cli.plugins import fault
from twindisc_cli.results.recorded import made_by_another, recorded, up_to_date
from twindisc_cli.results.store import plain, put

PRELOAD = ("twindisc_cli.commands._campaign_work", "h5py", "matplotlib.backends.backend_agg", "matplotlib.font_manager")
"""What every worker needs, imported before the workers are forked off; the command's own module comes to it."""


@dataclass(frozen=True)
class Order:
    """What is done with every test, where its results go, and whether the files of effects it names may be run."""

    command: str
    folder: Path
    force: bool = False
    trusting: bool = False

    @property
    def modules(self) -> tuple[str, ...]:
        """The modules to import before the work begins."""
        return (*PRELOAD, f"twindisc_cli.commands.{self.command.replace('-', '_')}")


@dataclass(frozen=True)
class Task:
    """A test that was read and has to be computed, with all that a worker elsewhere needs."""

    command: str
    folder: Path
    test: Test
    row: Row


@dataclass(frozen=True)
class Work:
    """work(job): one test from its definition to its files, on this machine."""

    order: Order

    def __call__(self, job: Job) -> Row:
        """The row of the test, whatever happens to it."""
        task = prepare(self.order, job)
        return task if isinstance(task, Row) else deliver(task, *compute(task))


def prepare(order: Order, job: Job) -> Task | Row:
    """Read a test: a task, or at once the row of one that is up to date or cannot be read."""
    row = Row(
        test=job.name,
        file=job.path.as_posix(),
        exit_code=0,
        asked={header(key): value for key, value in job.varied.items()},
    )
    try:
        effects.forget_folders()
        channels.forget_folders()
        _runner.know(None, trusting=order.trusting)
        test = read(job)
        origin = _runner.single_origin(order.command, test)
        row = replace(
            row,
            group=str(test.resolved["test"].get("group", "")),
            provenance=origin.provenance if test.inputs else "",
            run_key=origin.run_key(order.command),
            asked={**row.asked, **_operation(test)},
        )
        folder = order.folder / origin.name
        stored = None if order.force else up_to_date(folder / f"{order.command}.h5", row.run_key)
        if stored is None:
            older = made_by_another(recorded(folder / f"{order.command}.h5"))
            return Task(order.command, folder, test, replace(row, older=bool(older)))
        return replace(row, exit_code=stored.exit_code, found=_found(test, stored.json))
    except (Exception, SystemExit) as error:
        return failed(row, error)


def compute(task: Task) -> tuple[Row, Mapping[str, bytes]]:
    """The row of a test and its files by name; no files where it failed."""
    try:
        for kind, add in (("effects", effects.add_folder), ("channels", channels.add_folder)):
            if folder := task.test.resolved.get("loop", {}).get(kind):
                add(task.test.path.parent / folder)
        result, files = _runner.quiet(task.command, task.test, task.folder)
        found = _found(task.test, plain(result.json))
        return replace(task.row, exit_code=result.exit_code, found=found, computed=True), files
    except (Exception, SystemExit) as error:
        return failed(task.row, error), {}


def deliver(task: Task, row: Row, files: Mapping[str, bytes]) -> Row:
    """Write the files of a test; the row, which says so where that was not possible."""
    try:
        if files:
            put(task.folder, files)
    except TwindiscError as error:
        return failed(task.row, error)
    return row


def failed(row: Row, error: Exception | SystemExit) -> Row:
    """The row of a test that gave an error in place of a result."""
    known = error if isinstance(error, TwindiscError) else fault(error)
    if known is not None:
        return replace(row, exit_code=known.exit_code, error="; ".join(str(problem) for problem in known.problems))
    if os.environ.get("TWINDISC_DEBUG"):
        traceback.print_exception(error)
    return replace(row, exit_code=1, error=bug(error))


def _operation(test: Test) -> dict[str, Value]:
    """Load, speed and the largest creepage of a test."""
    experiment = test.experiment
    largest = float(np.abs(experiment.history.creepage).max())
    return {
        "normal load [N]": experiment.rig.normal_load,
        "rolling speed [m/s]": experiment.rig.rolling_speed,
        "largest creepage [%]": largest * 100.0,
        "rolled distance [km]": float(experiment.rolled.sum() * 1e-3),
    }


def _found(test: Test, outcome: Mapping[str, Any]) -> dict[str, Value]:
    return columns_of(outcome) | wear_rate(test, outcome)


def wear_rate(test: Test, outcome: Mapping[str, Any]) -> dict[str, Value]:
    """T gamma / A and the wear rate of a test whose energy and K are known, per area of the unworn discs' patch.

    T gamma = E / s, the energy dissipated on the distance s;  wear rate = W / (s A) with W = K E / H. Under several
    loads A is the mean over the distance; the energy and the distance of fit-k end with the last profile.
    Source: R. Lewis and R. S. Dwyer-Joyce, Proc. IMechE J 218 (2004) 467-478.
    """
    k, energy = outcome.get("K", outcome.get("wear_coefficient")), outcome.get("dissipated_energy_kJ")
    if k is None or energy is None:
        return {}
    rig, history, profile = test.experiment.rig, test.experiment.history, test.experiment.measured.profile
    rolled_over = np.cumsum(test.experiment.rolled * rig.area_ratio(history.load_factor) * rig.patch.area)
    last = int(profile.iteration[last_profile(profile)][0]) if profile and "K" in outcome else len(rolled_over)
    per_area = energy * 1e3 / float(rolled_over[last - 1])
    return {
        "T gamma / A [N/mm2]": per_area * 1e-6,
        "wear rate [um/km]": per_area * k / rig.disc2.hardness * 1e9,
    } | (
        {"wear rate [ug/m/mm2]": per_area * k / rig.disc2.hardness * rig.disc2.density * 1e3}
        if np.isfinite(rig.disc2.density)
        else {}
    )
