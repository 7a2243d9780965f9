"""Numbers that stand for no measurement: what loggers write where a sensor said nothing.

A known marker (-999, 1e30, the 1372 degC of an open thermocouple, ...) is one where it lies outside of all other values
of its column. Any other number is one where it comes back again and again, never for long, far outside of the others.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from twindisc_cli.measurement.sheet import Bools, Floats

_NINES = frozenset(
    (99.99, 999.0, 999.9, 999.99, 9999.0, 9999.9, 9999.99, 99999.0, 999999.0, 8888.0, 32767.0, 32768.0, 3276.7, 3276.8,
     6553.5, 65535.0, 2147483647.0, 2147483648.0)
)  # fmt: skip
"""Nines, eights and integers that overflowed; with either sign."""
_OPEN = frozenset((850.0, 1200.0, 1370.0, 1371.0, 1372.0, 1372.4, 1768.0, 1820.0, 2320.0))
"""Temperatures [degC] where the tables of sensors end: an open thermocouple or resistor."""
_LARGEST = 1e29  # floats of four bytes end at 3e38; 1e30 is LabVIEW's marker
_APART = 0.01  # of the scale: a marker stands clear of the values
_FAR = 10.0  # times the scale: no reading jumps so far and back
_MOST = 0.1  # of the rows: more are a state
_PASSES = 8  # markers of one column, at the most
_FEWEST = 5  # rows that are left to tell the scale from


def found(values: Floats, quantity: str) -> Iterator[tuple[float, Bools]]:
    """Each marker in a column as written (row,), and the rows that hold it; quantity: what the column is."""
    left = np.isfinite(values)
    for _ in range(_PASSES):
        if left.sum() < _FEWEST:
            return
        ends = [float(np.min(values, where=left, initial=np.inf)), float(np.max(values, where=left, initial=-np.inf))]
        marker = next((end for end in ends if _stands_apart(values, left, end, quantity)), None)
        if marker is None:
            return
        rows = values == marker
        left &= ~rows
        yield marker, rows


def _stands_apart(values: Floats, left: Bools, end: float, quantity: str) -> bool:
    """Whether an extreme value is a marker, by how far it lies from the rest and how it comes back."""
    if abs(end) >= _LARGEST:
        return True
    known = _is_known(end, quantity)
    if quantity == "time" and not known:
        return False
    mine = values == end
    rest = left & ~mine
    if not np.any(rest):
        return False
    low, high = float(np.min(values, where=rest, initial=np.inf)), float(np.max(values, where=rest, initial=-np.inf))
    gap, scale = max(low - end, end - high), max(high - low, abs(low), abs(high))
    if known:
        return gap > _APART * scale
    count, runs = int(mine.sum()), int(mine[0]) + int(np.sum(mine[1:] & ~mine[:-1]))
    return runs > 1 and count <= _MOST * left.sum() and gap > _FAR * scale


def _is_known(value: float, quantity: str) -> bool:
    if abs(value) in _NINES:
        return value < 0.0 or quantity != "time"
    return quantity == "temperature" and value in _OPEN
