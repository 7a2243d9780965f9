"""CSV tables with units in their headers: `name [unit]`, any of , ; tab between cells, decimal point or comma.

A table keeps what it needs to say where a mistake is, and gathers the mistakes instead of stopping at the first.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from twindisc_cli.errors import MeasurementError, Problem, did_you_mean, nearest
from twindisc_cli.measurement.units import COUNT, Quantity

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

_HEADER = re.compile(r"^\s*(.*?)\s*(?:\[(.*)\]\s*)?$")
_SHOWN = 3


@dataclass(frozen=True)
class Column:
    """A column a file may have."""

    name: str
    quantity: Quantity
    required: bool = True

    def __str__(self) -> str:
        """The header cell to write."""
        unit = next(iter(self.quantity.units))
        return self.name if self.quantity is COUNT else f"{self.name} [{unit}]"


@dataclass
class Table:
    """The rows that could be read: SI columns by name, the numbers as written, the line of each row."""

    file: str
    columns: dict[str, Floats]
    written: dict[str, Floats]
    headers: dict[str, str]
    lines: Ints
    problems: list[Problem] = field(default_factory=list)

    def __len__(self) -> int:
        """Number of rows."""
        return len(self.lines)

    def flag(self, bad: Bools, name: str, what: Callable[[int], str]) -> None:
        """Note a problem at each row where `bad`; many of a kind end in a count."""
        rows = np.flatnonzero(bad)
        for row in rows[:_SHOWN]:
            self.note(what(int(row)), name, int(self.lines[row]))
        if len(rows) > _SHOWN:
            line = int(self.lines[rows[_SHOWN]])
            self.note(f"the same in {len(rows) - _SHOWN} more rows, down to line {self.lines[rows[-1]]}", name, line)

    def note(self, what: str, name: str = "", line: int = 0) -> None:
        """Note a problem of the file, of a column, or of a cell."""
        self.problems.append(Problem(what, self.file, line, self.headers.get(name, name)))

    def check(self) -> None:
        """Raise what was noted."""
        if self.problems:
            raise MeasurementError(self.problems)


def decode(data: bytes, file: str) -> str:
    """The text of a file: UTF-8 or UTF-16 with a byte-order mark, else Windows-1252, as rig software writes it."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        return data.decode("utf-16", errors="replace")
    if b"\0" in data:
        raise MeasurementError(Problem("is not a text file; export the data as CSV", file))
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp1252", errors="replace")


def read_bytes(path: Path) -> bytes:
    """The content of a measured file, or a clear reason why there is none."""
    try:
        return path.read_bytes()
    except FileNotFoundError:
        here = sorted(p.name for p in path.parent.glob("*.csv")) if path.parent.is_dir() else []
        raise MeasurementError(Problem(f"no such file{did_you_mean(path.name, here)}", str(path))) from None
    except IsADirectoryError:
        raise MeasurementError(Problem("is a folder; name a CSV file in it", str(path))) from None
    except OSError as error:
        raise MeasurementError(Problem(f"cannot be read: {error.strerror}", str(path))) from None


def read_table(data: bytes, file: str, wanted: Sequence[Column]) -> Table:
    """Read the wanted columns; others are ignored unless they look like a misspelt one."""
    lines = decode(data, file).splitlines()
    start = next((n for n, line in enumerate(lines) if _content(line)), None)
    expected = ", ".join(str(c) for c in wanted if c.required)
    if start is None:
        raise MeasurementError(Problem(f"is empty; it needs a header such as {expected}", file))
    delimiter = next((d for d in ("\t", ";") if d in lines[start]), ",")
    header = next(csv.reader([lines[start]], delimiter=delimiter))
    table = Table(file, {}, {}, {}, np.zeros(0, dtype=np.int64))
    places = _match(table, header, wanted, start + 1)
    body = [(n + 1, line) for n, line in enumerate(lines) if n > start and _content(line)]
    if not body:
        table.note(f"has no rows under its header; expected {expected}")
    table.check()
    rows = list(csv.reader([line for _, line in body], delimiter=delimiter))
    _fill(table, rows, [number for number, _ in body], places, len(header), delimiter)
    return table


def _content(line: str) -> bool:
    """Whether a line holds data: not blank, no comment, not the `sep=;` of a spreadsheet."""
    return bool(line.strip(" \t;,")) and not line.lstrip().startswith("#") and not line.startswith("sep=")


def _match(
    table: Table, header: Sequence[str], wanted: Sequence[Column], line: int
) -> dict[str, tuple[int, Column, tuple[float, float]]]:
    """Where each wanted column stands and how it converts; what is missing, misspelt or doubled is noted."""
    by_name = {column.name: column for column in wanted}
    places: dict[str, tuple[int, Column, tuple[float, float]]] = {}
    others: list[str] = []
    for place, cell in enumerate(header):
        match = _HEADER.match(cell)
        name, unit = (" ".join(match[1].casefold().split()), match[2]) if match else (cell, None)
        if name not in by_name:
            others.append(name)
        elif name in places:
            table.note("the column occurs twice", cell, line)
        else:
            table.headers[name] = cell.strip()
            try:
                places[name] = (place, by_name[name], by_name[name].quantity.conversion(unit))
            except ValueError as error:
                places[name] = (place, by_name[name], (1.0, 0.0))
                table.note(str(error), name, line)
    absent = {column.name for column in wanted} - set(places)
    for other in others:
        if guess := nearest(other, absent):
            table.note(f"unknown column, did you mean {by_name[guess]}?", other, line)
            absent.discard(guess)
    for column in wanted:
        if column.required and column.name in absent:
            table.note(f"no column {column}; the header has {', '.join(c.strip() for c in header)}", line=line)
    return places


def _fill(
    table: Table,
    rows: Sequence[Sequence[str]],
    lines: Sequence[int],
    places: Mapping[str, tuple[int, Column, tuple[float, float]]],
    width: int,
    delimiter: str,
) -> None:
    """Convert the cells; rows that are short, long or hold what is no number are noted and left out."""
    table.lines = np.asarray(lines, dtype=np.int64)
    counts = np.array([len(row) if any(row[width:]) or len(row) < width else width for row in rows])
    ragged = counts != width
    comma = " (a decimal comma? put ; between the columns)" if delimiter == "," and np.all(counts > width) else ""
    table.flag(ragged, "", lambda row: f"{counts[row]} cells where the header has {width}{comma}")
    keep = ~ragged
    padded = [row if good else [""] * width for row, good in zip(rows, keep, strict=True)]
    raw: dict[str, Floats] = {}
    for name, (place, _, _) in places.items():
        cells = [row[place].strip().replace(",", ".") for row in padded]
        raw[name] = _numbers(cells)
        bad = ~np.isfinite(raw[name])
        table.flag(bad & ~ragged, name, lambda row, place=place: _not_a_number(padded[row][place]))  # type: ignore[misc]
        keep &= ~bad
    for name, (_, column, (factor, offset)) in places.items():
        if column.quantity is COUNT:
            fraction = keep & (raw[name] != np.round(raw[name]))
            table.flag(fraction, name, lambda row, name=name: f"{raw[name][row]:g} is not a whole number")  # type: ignore[misc]
            keep = keep & ~fraction
        table.columns[name] = raw[name] * factor + offset
    table.lines = table.lines[keep]
    table.columns = {name: values[keep] for name, values in table.columns.items()}
    table.written = {name: values[keep] for name, values in raw.items()}


def _numbers(cells: list[str]) -> Floats:
    """Cells as numbers, NaN where one is none."""
    try:
        return np.asarray(cells).astype(np.float64)
    except ValueError:
        return np.array([_number(cell) for cell in cells])


def _number(cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        return np.nan


def _not_a_number(cell: str) -> str:
    text = cell.strip()
    if not text:
        return "is empty; expected a number"
    if text.casefold().strip("+-") in ("nan", "inf", "na", "n/a", "infinity"):
        return f"is {text}; leave the row out where nothing was measured"
    return f'"{text}" is not a number'
