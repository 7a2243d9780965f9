"""One machine's processes: each pays its imports once, works on one item at a time, and may die without harm.

An item that hangs beyond the limit or kills its worker is lost, with the reason; its worker is replaced, the others go
on. Workers leave at once when the process that started them is gone, however it went.
"""

from __future__ import annotations

import gc
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Generator, Iterable, Sequence
from dataclasses import dataclass
from math import inf
from multiprocessing.connection import Connection, wait
from queue import SimpleQueue
from typing import Any, Generic, TypeVar

Item = TypeVar("Item")
Outcome = TypeVar("Outcome")


@dataclass(frozen=True)
class Lost:
    """An item without an outcome: the exit code and the reason."""

    exit_code: int
    reason: str


def overrun(limit: float) -> Lost:
    """What is lost to the time limit [s]."""
    return Lost(4, f"took longer than {limit:g} s and was stopped; --limit allows more")


def cores() -> int:
    """The cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def each(
    work: Callable[[Item], Outcome], items: Iterable[Item], *, workers: int, limit: float, preload: Sequence[str]
) -> Generator[tuple[Item, Outcome | Lost]]:
    """work(item) of every item with its item, in the order in which they finish.

    limit [s] for one item. preload: modules that are imported once, before the workers are forked off.
    """
    context = _context(preload)
    waiting = iter(items)
    team: list[_Worker[Item, Outcome]] = []
    try:
        while True:
            for worker in team:
                if not worker.busy and (item := next(waiting, None)) is not None:
                    worker.give(item, limit)
            while len(team) < workers and (item := next(waiting, None)) is not None:
                team.append(_Worker(context, work))
                team[-1].give(item, limit)
            busy = [worker for worker in team if worker.busy]
            if not busy:
                return
            soonest = min(worker.deadline for worker in busy) - time.monotonic()
            answered = wait([worker.pipe for worker in busy], timeout=max(soonest, 0.0) if soonest < inf else None)
            for worker in busy:
                if worker.pipe in answered and worker.begins(limit):
                    continue
                if worker.pipe in answered or time.monotonic() > worker.deadline:
                    item, outcome = worker.answer(limit)
                    if isinstance(outcome, Lost):
                        team.remove(worker)
                        worker.stop()
                    yield item, outcome
    finally:
        for worker in team:
            worker.stop()


def _context(preload: Sequence[str]) -> Any:
    """Workers forked from a process that has made the imports and nothing else; where none can be, fresh ones."""
    if "forkserver" not in multiprocessing.get_all_start_methods():
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(list(preload))
    return context


class _Worker(Generic[Item, Outcome]):
    """A process with the item it works on and the time by which it must have answered."""

    def __init__(self, context: Any, work: Callable[[Item], Outcome]) -> None:
        self.pipe: Connection[Any, Any]
        self.pipe, there = context.Pipe()
        self.process = context.Process(target=_serve, args=(there, work), daemon=True)
        self.process.start()
        there.close()
        self.item: Item | None = None
        self.ready = False
        self.deadline = inf

    @property
    def busy(self) -> bool:
        return self.item is not None

    def give(self, item: Item, limit: float) -> None:
        self.item, self.deadline = item, time.monotonic() + limit if self.ready else inf
        try:
            self.pipe.send(item)
        except OSError:
            return  # it died between two items: its answer will say so

    def begins(self, limit: float) -> bool:
        """Whether it has just said that its imports are made: from now on its item takes time."""
        try:
            begins = not self.ready and self.pipe.recv() is None
        except (EOFError, OSError):
            return False
        self.ready, self.deadline = True, time.monotonic() + limit if begins else self.deadline
        return begins

    def answer(self, limit: float) -> tuple[Item, Outcome | Lost]:
        """Its item and the outcome; lost where the worker died or did not answer in time."""
        assert self.item is not None  # only the busy are asked
        item, self.item = self.item, None
        try:
            return item, self.pipe.recv() if self.pipe.poll() else overrun(limit)
        except (EOFError, OSError):
            self.process.join()
            return item, Lost(1, f"killed its worker process ({cause_of(self.process.exitcode)})")

    def stop(self) -> None:
        self.process.kill()
        self.process.join()
        self.pipe.close()


def cause_of(exit_code: int) -> str:
    """What an exit code says of a process that died."""
    if exit_code >= 0:
        return f"exit code {exit_code}"
    memory = "; is there memory enough?" if exit_code == -signal.SIGKILL else ""
    return f"{signal.Signals(-exit_code).name}{memory}"


def _serve(pipe: Connection[Any, Any], work: Callable[[Any], Any]) -> None:
    """The life of a worker: say that it is ready, answer item after item, and leave when the other end is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    gc.freeze()  # what was imported stays: not to be looked through again, and its pages remain shared
    waiting: SimpleQueue[Any] = SimpleQueue()
    threading.Thread(target=_receive, args=(pipe, waiting), daemon=True).start()
    try:
        pipe.send(None)
        while True:
            pipe.send(work(waiting.get()))
    except OSError:
        os._exit(0)


def _receive(pipe: Connection[Any, Any], waiting: SimpleQueue[Any]) -> None:
    try:
        while True:
            waiting.put(pipe.recv())
    except (EOFError, OSError):
        os._exit(0)
