"""Tables with units in their headers: `name [unit]`, any of , ; tab between cells, decimal point or comma; workbooks.

A table keeps what it needs to say where a mistake is, and gathers the mistakes instead of stopping at the first.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from twindisc_cli.errors import MeasurementError, Problem, did_you_mean, nearest
from twindisc_cli.measurement.sheet import UNCLOSED, Floats, Ints, Rows, open_sheet
from twindisc_cli.measurement.units import COUNT, Quantity

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


Place = tuple[int, Column, tuple[float, float]]
"""Where a wanted column stands in the file, what it is, and its factor and offset to SI."""


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
    expected = ", ".join(str(c) for c in wanted if c.required)
    sheet = open_sheet(data, file, expected)
    table = Table(file, {}, {}, {}, np.zeros(0, dtype=np.int64))
    places = _match(table, sheet.header, wanted, sheet.line)
    table.check()
    rows = sheet.rows([place for place, _, _ in places.values()])
    if not len(rows.lines):
        table.note(f"has no rows under its header; expected {expected}")
    table.check()
    _fill(table, rows, list(places), len(sheet.header), sheet.delimiter)
    _convert(table, places)
    return table


def _match(table: Table, header: Sequence[str], wanted: Sequence[Column], line: int) -> dict[str, Place]:
    """Where each wanted column stands and how it converts; what is missing, misspelt or doubled is noted."""
    by_name = {column.name: column for column in wanted}
    places: dict[str, Place] = {}
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


def _fill(table: Table, rows: Rows, names: Sequence[str], width: int, delimiter: str) -> None:
    """Rows whose wanted cells are numbers; those that are short, long or hold what is no number are noted."""
    table.lines = rows.lines
    unclosed, ragged = rows.counts == UNCLOSED, rows.counts != width
    table.flag(unclosed, "", lambda _: "a quote is opened here and not closed; a cell ends with its line")
    comma = " (a decimal comma? put ; between the columns)" if delimiter == "," and np.all(rows.counts > width) else ""
    table.flag(ragged & ~unclosed, "", lambda row: f"{rows.counts[row]} cells where the header has {width}{comma}")
    bad = np.isnan(rows.numbers)
    for place, name in enumerate(names):
        told = lambda row, place=place: _not_a_number(rows.text[row, place])  # noqa: E731
        table.flag(bad[:, place] & ~ragged, name, told)
        table.written[name] = rows.numbers[:, place]
    _keep(table, ~(ragged | bad.any(axis=1)))


def _keep(table: Table, rows: Bools) -> None:
    table.lines = table.lines[rows]
    table.written = {name: values[rows] for name, values in table.written.items()}


def _convert(table: Table, places: Mapping[str, Place]) -> None:
    """The SI columns; a count must be whole."""
    for name, (_, column, _) in places.items():
        if column.quantity is COUNT:
            values = table.written[name]
            broken = values != np.round(values)
            table.flag(broken, name, lambda row, values=values: f"{values[row]:g} is not a whole number")  # type: ignore[misc]
            _keep(table, ~broken)
    for name, (_, _, (factor, offset)) in places.items():
        table.columns[name] = table.written[name] * factor + offset


def _not_a_number(cell: str) -> str:
    text = cell.strip()
    if not text:
        return "is empty; expected a number"
    if text.casefold().strip("+-") in ("nan", "inf", "na", "n/a", "infinity"):
        return f"is {text}; leave the row out where nothing was measured"
    return f'"{text}" is not a number'
