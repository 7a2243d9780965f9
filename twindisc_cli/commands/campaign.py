"""campaign: one command over many tests, on all cores or on a cluster, with one table of all that came out."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

from twindisc_cli import terminal
from twindisc_cli.campaign import pool
from twindisc_cli.campaign.outcome import outcome_of
from twindisc_cli.campaign.plan import Job, plan
from twindisc_cli.campaign.table import Row, csv_text, dataset_of, parquet_bytes, table_of
from twindisc_cli.commands import _runner
from twindisc_cli.commands._campaign_work import Order, Task, Work, compute, deliver, prepare
from twindisc_cli.commands._output import Output
from twindisc_cli.errors import DefinitionError, Problem, did_you_mean
from twindisc_cli.results import Result, or_null
from twindisc_cli.results.origin import Origin
from twindisc_cli.results.recorded import up_to_date, why
from twindisc_cli.results.store import write

if TYPE_CHECKING:
    from twindisc_cli.campaign.shared import Common

COMMANDS = (
    "friction-chart",
    "identify-mu",
    "simulate-wear",
    "fit-k",
    "thermal",
    "contact",
    "check",
    "close-loop",
)
WORST_FIRST = (1, 2, 3, 4, 5)
"""Exit codes by what they say of a campaign: a bug is worse than a wrong definition, a negative finding the least."""


@dataclass(frozen=True)
class Means:
    """How the tests are computed: on worker processes here (None: one a core) or on a Dask scheduler's workers.

    limit: seconds allowed for each test.
    """

    workers: int | None
    limit: float
    scheduler: str | None = None


def run(command: str, given: Sequence[str], means: Means, output: Output) -> int:
    """Run a command on all tests and write their table. The exit code of the worst."""
    if command not in COMMANDS:
        what = f"no command for a campaign{did_you_mean(command, COMMANDS)}; one of {', '.join(COMMANDS)}"
        raise DefinitionError(Problem(what, key=command))
    _runner.know(None, trusting=output.trust_effects)
    jobs, order = plan(given), Order(command, output.folder, output.force, output.trust_effects)
    if output.dry_run:
        return _dry_run(jobs, order, output)
    rows = _rows(jobs, order, means)
    single = len(given) == 1 and jobs[0].base is not None
    name = f"{Path(given[0]).stem if single else 'campaign'}-{command}"
    origin = _origin(name, rows)
    stored = None if output.force else up_to_date(output.folder / f"{name}.h5", origin.run_key(name))
    if stored:
        _tell(stored.summary, stored.json, _count(rows), stored.files, output, "up to date")
        return stored.exit_code
    from twindisc_cli.figures.style import house_style

    shared = _shared(jobs, rows) if command == "close-loop" else []
    result, extra = _result(name, command, rows, shared)
    with house_style():
        files = write(output.folder, result, origin, extra)
    _tell(result.summary, result.json, _count(rows), files, output, "written")
    return result.exit_code


def _dry_run(jobs: Sequence[Job], order: Order, output: Output) -> int:
    """Say of each test whether it would be computed, and why, or that it cannot be read; nothing is computed."""
    ready = [prepare(order, job) for job in jobs]
    made = {task.row.test: _reason(task) for task in ready if isinstance(task, Task)}
    failed = [row for row in ready if isinstance(row, Row) and row.failed]
    current = [row.test for row in ready if isinstance(row, Row) and not row.failed]
    if output.as_json:
        errors = {row.test: row.error for row in failed}
        _runner.tell_json({"would_be_made": made, "up_to_date": current, "failed": errors})
    else:
        terminal.say(
            [
                f"{len(jobs)} tests: {len(made)} would be computed, {len(current)} up to date, {len(failed)} failed",
                *(f"would be computed: {test}: {reason}" for test, reason in made.items()),
                *(f"up to date: {test}" for test in current),
                *(f"failed: {row.test}: {row.error}" for row in failed),
            ]
        )
    return _worst(failed)


def _reason(task: Task) -> str:
    """Why a test would be computed."""
    origin = _runner.single_origin(task.command, task.test)
    return why(task.folder / f"{task.command}.h5", task.command, origin) or "--force"


def _shared(jobs: Sequence[Job], rows: Sequence[Row]) -> list[Common]:
    """What the tests of each group lack together."""
    from twindisc_cli.campaign.shared import common_of

    with _runner.progress_bar() as progress:
        return common_of(jobs, rows, progress)


def _rows(jobs: Sequence[Job], order: Order, means: Means) -> list[Row]:
    """The row of every test, in the order of the plan."""
    place = {job.name: number for number, job in enumerate(jobs)}
    rows: dict[int, Row] = {}
    with _runner.progress_bar() as progress, closing(_finished(jobs, order, means)) as finished:
        failures = 0
        for row in finished:
            rows[place[row.test]] = row
            failures += row.failed
            if row.failed:
                terminal.say([f"failed: {row.test}: {row.error}"], error=True)
            state = f"{len(rows)} of {len(jobs)}{f', {failures} failed' if failures else ''}"
            progress(f"{order.command}: {state}", len(rows) / len(jobs))
    return [rows[number] for number in range(len(jobs))]


def _finished(jobs: Sequence[Job], order: Order, means: Means) -> Generator[Row]:
    """The rows as they come; a test that was lost has one too."""
    if means.scheduler:
        yield from _on_cluster(jobs, order, means.scheduler, means.limit)
        return
    workers = min(means.workers or pool.cores(), len(jobs))
    for job, row in pool.each(Work(order), jobs, workers=workers, limit=means.limit, preload=order.modules):
        yield row if isinstance(row, Row) else lost(job, row)


def _on_cluster(jobs: Sequence[Job], order: Order, address: str, limit: float) -> Generator[Row]:
    """The rows as they come from a cluster: tests are read here and travel, files come back and are written here."""
    from twindisc_cli.campaign import cluster

    ready: list[Row] = []

    def tasks() -> Iterator[Task]:
        for job in jobs:
            task = prepare(order, job)
            if isinstance(task, Row):
                ready.append(task)
            else:
                yield task

    def say(what: str) -> None:
        terminal.say([what], error=True)

    with closing(cluster.each(compute, tasks(), address=address, limit=limit, say=say)) as answers:
        for task, answer in answers:
            yield from ready
            ready.clear()
            if isinstance(answer, pool.Lost):
                yield replace(task.row, exit_code=answer.exit_code, error=answer.reason)
            else:
                yield deliver(task, *answer)
    yield from ready


def lost(job: Job, why: pool.Lost) -> Row:
    """The row of a test that hung or that killed its worker."""
    return Row(test=job.name, file=job.path.as_posix(), exit_code=why.exit_code, error=why.reason)


def _result(name: str, command: str, rows: Sequence[Row], shared: Sequence[Common]) -> tuple[Result, dict[str, bytes]]:
    """The table of a campaign and what it says as a result of its own, and its further files."""
    from twindisc_cli.figures.campaign import figure_of

    columns = {test: found for common in shared for test, found in common.columns.items()}
    table = table_of([replace(row, found={**row.found, **columns.get(row.test, {})}) for row in rows])
    outcome = outcome_of(table)
    extra = {f"{name}.csv": csv_text(table).encode()}
    if parquet := parquet_bytes(table):
        extra[f"{name}.parquet"] = parquet
    result = Result(
        command=name,
        summary=(*(line for common in shared for line in common.summary), *outcome.summary),
        json={
            "tests": len(rows),
            "failed": [
                {"test": row.test, "exit_code": row.exit_code, "error": row.error} for row in rows if row.failed
            ],
            **outcome.json,
            "shared": or_null([common.json for common in shared]),
        },
        dataset=dataset_of(table),
        figure=figure_of(command, table, outcome, shared, _provenance(rows)),
        exit_code=_worst(rows),
    )
    return result, extra


def _worst(rows: Sequence[Row]) -> int:
    """The exit code that says the worst of the tests."""
    return next((code for code in WORST_FIRST if any(row.exit_code == code for row in rows)), 0)


def _provenance(rows: Sequence[Row]) -> str:
    from twindisc_cli.report.words import listed

    return listed(sorted({row.provenance for row in rows} - {""}))


def _origin(name: str, rows: Sequence[Row]) -> Origin:
    """What the table was made from: the run keys of its tests."""
    keys = sha256("\n".join(f"{row.test} {row.run_key} {row.error}" for row in rows).encode()).hexdigest()
    return Origin(name=name, configs=(), inputs={}, provenance=_provenance(rows), options={"run_keys": keys})


def _count(rows: Sequence[Row]) -> str:
    """How many tests were computed, were there already, and failed."""
    computed, broken = sum(row.computed for row in rows), sum(row.failed for row in rows)
    older = sum(row.older for row in rows)
    again = f" ({older} made by another version: made again)" if older else ""
    return f"{len(rows)} tests: {computed} computed{again}, {len(rows) - computed - broken} up to date, {broken} failed"


def _tell(
    summary: Sequence[str], outcome: Mapping[str, Any], count: str, files: Sequence[Path], output: Output, state: str
) -> None:
    """Summary and paths to the terminal; with --json the object to stdout and the rest to stderr."""
    if not output.quiet:
        terminal.say([count, *summary, *(f"{state}: {path}" for path in files)], error=output.as_json)
    if output.as_json:
        table = next(path for path in files if path.suffix == ".csv")
        _runner.tell_json({**outcome, "table": str(table)})
