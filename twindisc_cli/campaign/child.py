"""A process of its own beside a worker of a cluster: one item at a time, imports paid once, and it may die or hang.

A Dask worker must not start processes by multiprocessing and does not stop a task that hangs; and neither matplotlib
nor HDF5 is used by two threads at once. So each thread of a worker has a child, which speaks pickle on its pipes.
"""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import threading
from queue import SimpleQueue
from typing import Any

from twindisc_cli.campaign.pool import Lost, cause_of, overrun

_COMMAND = (sys.executable, "-c", "from twindisc_cli.campaign.child import live; live()")
_idle: list[Child] = []


def ask(payload: bytes, limit: float) -> Any:
    """work(item) of a pickled (work, item) by a child that is free, or a new one; lost beyond the limit [s]."""
    child = _idle.pop() if _idle else Child()
    answer = child.ask(payload, limit)
    if not isinstance(answer, Lost):
        _idle.append(child)
    return answer


class Child:
    """A process that answers one item after the other."""

    def __init__(self) -> None:
        """Start the process; it is ready when its imports are made."""
        self.process = subprocess.Popen(_COMMAND, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self.ready = False

    def ask(self, payload: bytes, limit: float) -> Any:
        """Its answer; lost where it dies, or does not answer in time and is killed."""
        asked, answers = self.process.stdin, self.process.stdout
        assert asked is not None  # both are pipes
        assert answers is not None
        late = threading.Event()
        timer = threading.Timer(limit, self._kill, (late,))
        try:
            self.ready = self.ready or pickle.load(answers)
            timer.start()
            pickle.dump(payload, asked)
            asked.flush()
            return pickle.load(answers)
        except (EOFError, OSError, pickle.UnpicklingError):
            self.process.kill()
            code = self.process.wait()
            return overrun(limit) if late.is_set() else Lost(1, f"killed its worker process ({cause_of(code)})")
        finally:
            timer.cancel()

    def _kill(self, late: threading.Event) -> None:
        late.set()
        self.process.kill()


def live() -> None:
    """The life of a child: say that it is ready, answer item after item, and leave when its worker is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    waiting: SimpleQueue[bytes] = SimpleQueue()
    threading.Thread(target=_receive, args=(waiting,), daemon=True).start()
    with os.fdopen(os.dup(1), "wb") as answers:
        os.dup2(2, 1)  # what a command prints must not come between the answers
        answer: Any = True
        while True:
            pickle.dump(answer, answers)
            answers.flush()
            work, item = pickle.loads(waiting.get())
            answer = work(item)


def _receive(waiting: SimpleQueue[bytes]) -> None:
    try:
        while True:
            waiting.put(pickle.load(sys.stdin.buffer))
    except (EOFError, OSError):
        os._exit(0)
