"""The campaign on a Dask cluster of processes of their own: the same bytes, whatever joins, dies or does not fit."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest
from accidents import square_or_worse
from definitions import TRACTION, VALID, write
from test_campaign import exit_code, named, tree

from twindisc_cli import __version__
from twindisc_cli.campaign import pool

pytest.importorskip("distributed", reason="dask.distributed is not installed (extra `cluster`)")
from twindisc_cli.campaign import cluster

TESTS = Path(__file__).parent


class Machines:
    """A scheduler and its workers, each a process on the loopback."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.processes: list[subprocess.Popen[bytes]] = []
        file = folder / "scheduler.json"
        self.scheduler = self._start("scheduler", "--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(file))
        until(file.is_file)
        self.address: str = json.loads(file.read_text())["address"]

    def worker(self, *options: str, path: Path = TESTS) -> subprocess.Popen[bytes]:
        return self._start("worker", self.address, "--nthreads", "1", *options, PYTHONPATH=str(path))

    def _start(self, *arguments: str, **settings: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", "dask", *arguments, "--no-dashboard"]
        with (self.folder / f"{len(self.processes)}.log").open("wb") as log:
            process = subprocess.Popen(
                command, cwd=self.folder, stdout=log, stderr=log, env={**os.environ, **settings}, start_new_session=True
            )
        self.processes.append(process)
        return process

    def stop(self) -> None:
        for process in reversed(self.processes):
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()


def until(happened: object, seconds: float = 300.0) -> None:
    assert callable(happened)
    deadline = time.monotonic() + seconds
    while not happened():
        assert time.monotonic() < deadline, "nothing happened"
        time.sleep(0.02)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def machines(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Machines]:
    cluster_of = Machines(tmp_path_factory.mktemp("cluster"))
    yield cluster_of
    cluster_of.stop()


def campaign(folder: Path, *options: str) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "twindisc_cli", "campaign", "identify-mu", "t*.toml", *options]
    return subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE)


def results(folder: Path) -> int:
    return len(list(folder.glob("results/*/identify-mu.h5")))


@pytest.mark.long
def test_one_dies_one_joins_late_and_one_does_not_fit(folder: Path, machines: Machines) -> None:
    named(folder, *(f"t{i}" for i in range(6)))
    other = machines.folder / "other/twindisc_cli"
    shutil.copytree(TESTS.parent / "twindisc_cli", other, ignore=shutil.ignore_patterns("__pycache__"))
    with (other / "physics/hertz.py").open("a") as file:
        file.write("# a worker of the same version whose files differ\n")
    dying = machines.worker("--no-nanny")
    machines.worker("--no-nanny", path=other.parent)
    running = campaign(folder, "--scheduler", machines.address)
    until(lambda: results(folder) >= 2)
    dying.kill()
    assert running.poll() is None
    machines.worker("--no-nanny")
    told, refused = running.communicate(timeout=300)
    assert running.returncode == 0, refused.decode()
    assert "6 tests: 6 computed, 0 up to date, 0 failed" in told.decode()
    assert f"is not used: it has twindisc {__version__} of files" in refused.decode()
    campaign(folder, "-o", "here").communicate()
    assert tree(folder / "results") == tree(folder / "here")


@pytest.mark.long
def test_when_the_scheduler_dies_the_rest_is_computed_by_the_next_call(folder: Path, machines: Machines) -> None:
    named(folder, *(f"t{i}" for i in range(8)))
    machines.worker("--no-nanny")
    running = campaign(folder, "--scheduler", machines.address)
    until(lambda: results(folder) >= 1)
    machines.scheduler.kill()
    _, told = running.communicate(timeout=300)
    if running.returncode == 0:
        pytest.skip("the run had ended before the scheduler was gone")
    assert running.returncode == 2, told.decode()
    assert "is gone; what was computed is there" in told.decode().splitlines()[-1]
    there = results(folder)
    assert 1 <= there < 8
    last, _ = campaign(folder).communicate()
    assert f"{8 - there} computed, {there} up to date, 0 failed" in last.decode()


def test_what_hangs_or_kills_its_worker_is_lost_and_the_others_are_not(machines: Machines) -> None:
    machines.worker("--no-nanny", "--nthreads", "2")
    items: Sequence[int | str] = [1, "hang", 2, "die", 3, 4]
    said: list[str] = []
    found = dict(cluster.each(square_or_worse, items, address=machines.address, limit=5.0, say=said.append))
    assert {item: found[item] for item in items if isinstance(item, int)} == {1: 1, 2: 4, 3: 9, 4: 16}
    assert found["hang"] == pool.overrun(5.0)
    die = found["die"]
    assert isinstance(die, pool.Lost)
    assert die.reason == "killed its worker process (SIGKILL; is there memory enough?)"
    assert not said


def test_without_a_scheduler_or_dask_a_sentence_says_so(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    write(folder, VALID, "a.toml", traction=TRACTION)
    monkeypatch.setattr(cluster, "PATIENCE", 0.5)
    assert exit_code("campaign", "identify-mu", "a.toml", "--scheduler", "tcp://127.0.0.1:9") == 2
    assert "no scheduler answers at tcp://127.0.0.1:9" in capsys.readouterr().err
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert exit_code("campaign", "identify-mu", "a.toml", "--scheduler", "tcp://127.0.0.1:9") == 2
    assert "pip install 'twindisc[cluster]'" in capsys.readouterr().err
