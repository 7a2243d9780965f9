"""Readings that a recorder holds until the next: a slow instrument beside a fast clock writes each several times.

Rows that repeat a reading are no measurements: as such their noise would be that of the readings, correlated over as
long as these are held, and each would stand at the times of its neighbours. Held readings last about equally long
and differ as far as the instrument scatters; equal neighbours of a number of few digits mostly differ by its last one.
A sensor that is dead for a while repeats one reading far longer than any other is repeated.
"""

from __future__ import annotations

import numpy as np

from twindisc_cli.measurement.limit import FEWEST_EQUAL, LIMIT, OFTEN, at_limit, scatter
from twindisc_cli.measurement.sheet import Bools, Floats, Ints
from twindisc_cli.measurement.table import Table

HELD = "of a reading held since the row before"
"""Why a row was left out."""
FEWEST_READINGS = 12
"""Readings below which equal neighbours say nothing of the recorder."""
REGULAR = 0.9
"""Share of the readings that last a multiple of the usual number of rows, or one more or less."""
FEW_ROWS = 4
"""Usual number of rows below which any number is a multiple of it, or one more or less: they are as a clock has them
that ticks evenly, of two numbers."""
LAST_DIGITS = 1.5
"""Change from one reading to the next, in the smallest one, up to which it is the last digit that changes."""


def _as_before(values: Floats) -> Bools:
    """Rows (row,) that are as the row before."""
    return np.append(False, values[1:] == values[:-1])[: len(values)]


def repeated(values: Floats) -> Bools:
    """Rows (row,) that only repeat the reading of the row before; none where readings are not held."""
    again = _as_before(values)
    begin = np.flatnonzero(~again)
    rows, change = np.diff(begin)[1:], np.abs(np.diff(values[begin]))
    if len(rows) < FEWEST_READINGS or np.median(rows) < 2:
        return np.zeros_like(again)
    is_regular = _regular(rows, int(np.round(np.median(rows)))) >= REGULAR
    return again if is_regular and np.median(change) > LAST_DIGITS * change.min() else np.zeros_like(again)


def _regular(rows: Ints, usual: int) -> float:
    """Share of the readings that last about a multiple of the usual number of rows; few rows, or one more or less."""
    if usual >= FEW_ROWS:
        return float(np.mean(np.abs(rows - usual * np.round(rows / usual)) <= 1.0))
    return float(max(np.mean((rows == least) | (rows == least + 1)) for least in (usual - 1, usual)))


def frozen(values: Floats) -> Bools:
    """Rows (row,) that repeat, for far longer than others are repeated, a reading among others that scatter.

    A reading of 0 is what a rig at rest gives.
    """
    again = _as_before(values)
    begin = np.flatnonzero(~again)
    rows = np.diff(np.append(begin, len(values)))
    usual = int(rows.max(initial=1, where=rows < FEWEST_EQUAL))
    dead = (rows > usual) & (values[begin] != 0.0)
    far = np.all(rows[dead] >= max(OFTEN * usual, FEWEST_EQUAL))
    dead_rows = np.repeat(dead, rows)
    return again & dead_rows if far and scatter(values[~dead_rows]) else np.zeros_like(again)


def no_measurements(readings: Floats) -> tuple[Bools, Bools]:
    """Rows (row,) that repeat a reading, and rows whose reading is at a limit."""
    limit = at_limit(readings)
    return repeated(readings) | (frozen(readings) & ~limit), limit


def keep_readings(table: Table, name: str) -> Bools:
    """Leave out the rows that repeat a reading of this column, or whose reading is at a limit; those kept (row,)."""
    held, limit = no_measurements(table.columns[name])
    table.keep(~held, HELD)
    table.keep(~limit[~held], LIMIT)
    return ~(held | limit)
