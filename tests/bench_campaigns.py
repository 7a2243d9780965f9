"""Campaigns measured: workers, memory, a cluster, and kills at random moments. `python tests/bench.py campaigns`.

Beside the time on the wall stands processor time, which other work on the machine does not disturb: what two workers
would take alone is that of the busier one, and of the command before and after them.
"""

from __future__ import annotations

import os
import random
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter, process_time, sleep

import numpy as np

from twindisc_cli.campaign import pool
from twindisc_cli.campaign.plan import Job, plan
from twindisc_cli.commands._campaign_work import Order, compute, deliver, prepare

CONFIGS = Path(__file__).parents[1] / "configs"
WEAR_TESTS, FEW_CHARTS, MANY_CHARTS, CLUSTER_TESTS, KILLED_TESTS, KILLS = 200, 200, 2000, 60, 6, 20
PARTED_TESTS = 40
TICK = os.sysconf("SC_CLK_TCK")


@dataclass(frozen=True)
class Run:
    """Seconds on the wall, processor seconds of the command and of each of its workers, peak memory [MB]."""

    wall: float
    command: float
    workers: tuple[float, ...]
    memory: float

    @property
    def processor(self) -> float:
        """All processor time [s]."""
        return self.command + sum(self.workers)

    @property
    def alone(self) -> float:
        """What it would take on a machine that does nothing else [s]."""
        return self.command + max(self.workers, default=0.0)


def load_map(folder: Path, count: int) -> Path:
    """A campaign file: the test in air at so many loads."""
    path = folder / f"loads{count}.toml"
    span = f"{{ from = 20.0, to = 200.0, count = {count} }}"
    base = (CONFIGS / "ambient.toml").as_posix()
    path.write_text(f'base = "{base}"\n[vary]\nrig.normal_load_N = {span}\nmodel.wear_coefficient = [6e-5]\n')
    return path


@dataclass(frozen=True)
class Parted:
    """What a worker does, with the processor seconds of computing and drawing, and of the worker in all so far."""

    order: Order

    def __call__(self, job: Job) -> tuple[float, float]:
        """One test from its definition to its files."""
        task = prepare(self.order, job)
        start = process_time()
        row, files = compute(task)
        computed = process_time() - start
        deliver(task, row, files)
        return computed, process_time()


def parted(folder: Path, command: str, loads: Path) -> tuple[float, float]:
    """Processor seconds of a test in a worker but its first: computed and drawn; read, looked up and written."""
    order = Order(command, folder)
    given = {"workers": 1, "limit": 900.0, "preload": order.modules}
    computed, spent = np.array([times for _, times in pool.each(Parted(order), plan([str(loads)]), **given)]).T
    each = float(computed[1:].mean())
    return each, float(spent[-1] - spent[0]) / (len(spent) - 1) - each


def campaign(folder: Path, command: str, loads: Path, *options: str) -> Run:
    """One call of a campaign, watched five times a second."""
    arguments = ["campaign", command, str(loads), "-o", str(folder), *options]
    start, peak, spent = perf_counter(), 0.0, dict[int, float]()
    running = subprocess.Popen(
        [sys.executable, "-m", "twindisc_cli", *arguments], stdout=subprocess.DEVNULL, start_new_session=True
    )
    while running.poll() is None:
        memory = 0.0
        for process, seconds, megabytes in session(running.pid):
            spent[process] = max(seconds, spent.get(process, 0.0))
            memory += megabytes
        peak = max(peak, memory)
        sleep(0.2)
    if running.returncode:
        raise RuntimeError(f"exit {running.returncode} of {' '.join(arguments)}")
    own = spent.pop(running.pid, 0.0)
    return Run(perf_counter() - start, own, tuple(s for s in spent.values() if s > 0.1), peak)


def session(leader: int) -> Iterator[tuple[int, float, float]]:
    """Each process of a session: processor time [s], proportional set size [MB]."""
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            fields = (folder / "stat").read_text().rpartition(")")[2].split()
            if int(fields[3]) != leader:
                continue
            seconds = (int(fields[11]) + int(fields[12])) / TICK
            found = re.search(r"Pss:\s*(\d+)", (folder / "smaps_rollup").read_text())
            yield int(folder.name), seconds, int(found[1]) / 1024.0 if found else 0.0
        except OSError:
            continue  # it has just ended


def workers(at_most: Callable[..., object], row: Callable[..., object]) -> Iterator[object]:
    """Two workers against one, and the overhead beside the same work in one process."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        loads = load_map(folder, WEAR_TESTS)
        computed, beside = parted(folder / "parted", "simulate-wear", load_map(folder, PARTED_TESTS))
        yield row("a wear test in a worker, computed and drawn", f"{1e3 * computed:.0f} ms")
        start = campaign(folder / "start", "simulate-wear", load_map(folder, 2), "--workers", "1")
        yield row("start-up of a campaign with one worker", f"{start.processor - 2 * computed:.1f} s")
        two = campaign(folder / "two", "simulate-wear", loads, "--workers", "2")
        yield row(f"{WEAR_TESTS} wear tests, two workers", f"{two.wall:.0f} s")
        one = campaign(folder / "one", "simulate-wear", loads, "--workers", "1")
        yield row(f"{WEAR_TESTS} wear tests, one worker", f"{one.wall:.0f} s")
        gain = one.wall / two.wall
        yield row("  two workers against one, on the wall", f"{gain:.2f} times", ">= 1.8", gain >= 1.8)
        yield row("  by processor time of the busiest", f"{one.alone / two.alone:.2f} times")
        overhead = beside + (one.command - start.command) / (WEAR_TESTS - 2)
        yield at_most("  overhead of a test: read, planned, looked up, written, told", 1e3 * overhead, 20.0, "ms")


def charts(at_most: Callable[..., object], row: Callable[..., object]) -> Iterator[object]:
    """Processor time and memory over the number of tests."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        few = campaign(folder / "few", "friction-chart", load_map(folder, FEW_CHARTS), "--workers", "2")
        yield row(f"{FEW_CHARTS} charts", f"{few.wall:.0f} s, {few.memory:.0f} MB")
        many = campaign(folder / "many", "friction-chart", load_map(folder, MANY_CHARTS), "--workers", "2")
        growth = (many.processor / MANY_CHARTS) / (few.processor / FEW_CHARTS)
        yield at_most(f"{MANY_CHARTS} charts: processor time of a test, to that of {FEW_CHARTS}", growth, 1.1, "times")
        yield at_most("  peak memory of all", many.memory, 400.0, "MB", ".0f")


def on_cluster(at_most: Callable[..., object], row: Callable[..., object]) -> Iterator[object]:
    """A cluster of 2 workers of 1 thread, and of 1 worker of 2 threads, against no cluster."""
    from test_campaign import tree
    from test_campaign_cluster import Machines

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        loads = load_map(folder, CLUSTER_TESTS)
        plain = campaign(folder / "plain", "identify-mu", loads, "--workers", "2")
        for crew, threads in ((2, 1), (1, 2)):
            machines = Machines(_made(folder / f"machines{crew}"))
            started = [machines.worker("--no-nanny", "--nthreads", str(threads)) for _ in range(crew)]
            campaign(folder / "warm", "identify-mu", load_map(folder, 4), "--scheduler", machines.address)
            before = _spent(started)
            run = campaign(folder / f"on{crew}", "identify-mu", loads, "--scheduler", machines.address)
            spent = run.processor + _spent(started) - before
            machines.stop()
            same = tree(folder / f"on{crew}") == tree(folder / "plain")
            what = f"{CLUSTER_TESTS} tests, cluster of {crew} x {threads}"
            yield row(f"{what}: bytes", "the same" if same else "others", "the same", same)
            yield row(f"{what}: wall against none", f"{run.wall / plain.wall:.2f} times")
            yield at_most(f"{what}: processor time against none", spent / plain.processor, 1.1, "times")


def _spent(processes: list[subprocess.Popen[bytes]]) -> float:
    return sum(seconds for process in processes for _, seconds, _ in session(process.pid))


def _made(folder: Path) -> Path:
    folder.mkdir()
    return folder


def kills(whom: str, at_most: Callable[..., object], row: Callable[..., object]) -> Iterator[object]:
    """kill -9 of a worker, of the scheduler or of the command at random moments, then the same call again."""
    from test_campaign import tree

    kill = {"worker": _kill_worker, "scheduler": _kill_scheduler, "command": _kill_command}[whom]
    rng = random.Random(5)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        loads = load_map(folder, KILLED_TESTS)
        campaign(folder / "whole", "identify-mu", loads, "--workers", "2")
        whole = tree(folder / "whole")
        lasted = campaign(folder / "timed", "identify-mu", loads, "--workers", "2").wall
        good, repeated, cut = 0, 0, 0
        for number in range(KILLS):
            out = folder / f"{whom}{number}"
            kill(out, loads, rng.uniform(0.3, 1.0) * lasted)
            there = len(list(out.glob("*/identify-mu.h5")))
            cut += there < KILLED_TESTS
            again = _call(out, loads, "--workers", "2").communicate()[0].decode()
            found = re.search(r"(\d+) computed", again)
            good += tree(out) == whole
            repeated = max(repeated, (int(found[1]) if found else 99) - (KILLED_TESTS - there))
        yield row(f"kill -9 of the {whom}: whole and equal again", f"{good} of {KILLS}", "all", good == KILLS)
        yield row("  of these, cut short", f"{cut}")
        yield at_most("  tests computed again that were there", repeated, 0, "", ".0f")


def _call(folder: Path, loads: Path, *options: str) -> subprocess.Popen[bytes]:
    arguments = ["campaign", "identify-mu", str(loads), "-o", str(folder), *options]
    return subprocess.Popen(
        [sys.executable, "-m", "twindisc_cli", *arguments],
        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, start_new_session=True,
    )  # fmt: skip


def _kill_command(folder: Path, loads: Path, after: float) -> None:
    running = _call(folder, loads, "--workers", "2")
    sleep(after)
    running.kill()
    running.communicate()
    sleep(0.3)  # its workers see that it is gone


def _kill_worker(folder: Path, loads: Path, after: float) -> None:
    running = _call(folder, loads, "--workers", "2")
    sleep(after)
    others = [process for process, _, _ in session(running.pid) if process != running.pid]
    if others:
        with suppress(ProcessLookupError):  # it had just ended
            os.kill(random.Random(after).choice(others), 9)
    running.communicate()


def _kill_scheduler(folder: Path, loads: Path, after: float) -> None:
    from test_campaign_cluster import Machines

    machines = Machines(_made(folder.with_name(f"{folder.name}-machines")))
    try:
        machines.worker("--no-nanny")
        machines.worker("--no-nanny")
        running = _call(folder, loads, "--scheduler", machines.address)
        sleep(2.0 + after)
        machines.scheduler.kill()
        running.communicate()
    finally:
        machines.stop()
