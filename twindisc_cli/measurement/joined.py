"""Several logs of one test that follow on each other, as one.

The clock is that of the time stamps where the logs have them. Without, it is one clock where a log begins after the one
before has ended; where it begins anew, it is counted on, and how long was paused between them is not known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from itertools import pairwise
from typing import Any

import numpy as np

from twindisc_cli.measurement.log import Log

_DAY = 86400.0  # [s], by which a clock jumps back at midnight
_ANEW = 5.0
"""A clock begins anew within so many intervals of where the first log's began."""


def joined(logs: Sequence[Log]) -> tuple[Log, Sequence[float]]:
    """The log of all, and what is added to the times of each [s]; MeasurementError where they do not follow."""
    first = logs[0]
    if len(logs) == 1:
        return first, [0.0]
    for log in logs[1:]:
        if (log.kind, log.has_load, log.label is None) != (first.kind, first.has_load, first.label is None):
            log.table.note(f"has other columns than {first.table.file}, which it shall follow")
            log.table.check()
    shifts = _shifts(logs)
    time = np.concatenate([log.time + shift for log, shift in zip(logs, shifts, strict=True)])
    names = [f.name for f in fields(Log) if isinstance(getattr(first, f.name), np.ndarray) and f.name != "time"]
    each: dict[str, Any] = {name: np.concatenate([getattr(log, name) for log in logs]) for name in names}
    others = {name: np.concatenate([log.others[name] for log in logs]) for name in first.others}
    table = first.table
    table.lines = np.concatenate([log.table.lines for log in logs])
    for log in logs[1:]:
        table.left_out = {
            k: table.left_out.get(k, 0) + log.table.left_out.get(k, 0) for k in {**table.left_out, **log.table.left_out}
        }
        table.notes += [note for note in log.table.notes if note not in table.notes]
    return replace(first, time=time, others=others, **each), shifts


def _shifts(logs: Sequence[Log]) -> list[float]:
    """What is added to the times of each log [s]."""
    stamps = [log.table.origin for log in logs]
    if np.isfinite(stamps).all():
        return _by_stamps(logs, stamps)
    shifts, end, anew = [0.0], float(logs[0].time[-1]), 0
    for before, log in pairwise(logs):
        spacing = float(np.median(np.diff(log.time))) if len(log.time) > 1 else 1.0
        begins = float(log.time[0])
        if begins > end:
            shifts.append(0.0)
        elif abs(begins - float(logs[0].time[0])) <= _ANEW * spacing:
            shifts.append(end + spacing - begins)
            anew += 1
        else:
            log.table.note(
                f"begins at {begins:g} s, and {before.table.file} ends at {before.time[-1]:g} s: is the order right?",
                "time",
            )
            log.table.check()
        end = float(log.time[-1]) + shifts[-1]
    if anew:
        message = (
            f"the clock begins anew in {anew} of {len(logs)} files, and is counted on; how long it paused is not known"
        )
        logs[0].table.notes.append(message)
    return shifts


def _by_stamps(logs: Sequence[Log], stamps: Sequence[float]) -> list[float]:
    """By time stamps; those without a date may pass midnight from one log to the next."""
    days, dated = 0.0, stamps[0] >= _DAY
    shifts, end = [0.0], float(logs[0].time[-1])
    for before, log, stamp in zip(logs, logs[1:], stamps[1:], strict=False):
        begins = stamp + days - stamps[0]
        if begins <= end and not dated:
            days, begins = days + _DAY, begins + _DAY
        if begins <= end:
            log.table.note(f"begins before {before.table.file} ends: is the order right?", "time")
            log.table.check()
        shifts.append(begins)
        end = begins + float(log.time[-1])
    return shifts
