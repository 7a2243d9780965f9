"""Work that goes wrong, for the processes of a campaign; it imports next to nothing."""

from __future__ import annotations

import os
import signal
import time


def square_or_worse(item: int | str) -> int:
    """A number squared; "hang", "die" and "leave" do that."""
    if item == "hang":
        time.sleep(60.0)
    if item == "die":
        os.kill(os.getpid(), signal.SIGKILL)
    if item == "leave":
        os._exit(3)
    assert isinstance(item, int)
    return item * item


def process_of(_: int) -> int:
    """The process that it runs in."""
    return os.getpid()
