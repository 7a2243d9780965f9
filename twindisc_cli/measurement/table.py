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
from twindisc_cli.measurement.header import Column, Match, Naming, Place, clock, is_header, match, stamped, units_below
from twindisc_cli.measurement.rows import RowCount
from twindisc_cli.measurement.sheet import UNCLOSED, Floats, Integers, Rows, Sheet, open_sheet
from twindisc_cli.measurement.units import COUNT
from twindisc_cli.reading import read_regular

Bools = NDArray[np.bool_]

_SHOWN = 3
_GAP = re.compile(r"[-*#\s]*|[-+]?(?:nan|inf|infinity|na|n/a|#n/a|null|none|ovl|ol)", re.IGNORECASE)
_MOST_GAPS = 0.5
NO_NUMBER, SUMMARY = "no number", "summary at the end"


@dataclass
class Table:
    """The rows that could be read: SI columns by name, factor and offset to SI, the line of each row."""

    file: str
    columns: dict[str, Floats]
    scales: dict[str, tuple[float, float]]
    headers: dict[str, str]
    lines: Integers
    problems: list[Problem] = field(default_factory=list)
    left_out: dict[str, int] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def written(self, name: str) -> Floats:
        """A column as it is written in the file."""
        factor, offset = self.scales.get(name, (1.0, 0.0))
        return (self.columns[name] - offset) / factor

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

    def count(self, used: int | None = None) -> RowCount:
        """What became of the rows; all that could be read were used unless said."""
        return RowCount(self.file, len(self) if used is None else used, self.left_out, tuple(self.notes))

    def check(self) -> None:
        """Raise what was noted."""
        if self.problems:
            raise MeasurementError(self.problems)


def read_bytes(path: Path) -> bytes:
    """The content of a measured file, or a clear reason why there is none."""
    try:
        return read_regular(path)
    except FileNotFoundError:
        here = sorted(p.name for p in path.parent.glob("*.csv")) if path.parent.is_dir() else []
        raise MeasurementError(Problem(f"no such file{did_you_mean(path.name, here)}", str(path))) from None
    except IsADirectoryError:
        raise MeasurementError(Problem("is a folder; name a CSV file in it", str(path))) from None
    except OSError as error:
        raise MeasurementError(Problem(f"cannot be read: {error.strerror or error}", str(path))) from None


def read_table(
    data: bytes, file: str, wanted: Sequence[Column], naming: Naming | None = None, *, gaps: bool = False,
    instead: Sequence[Sequence[Column]] = (),
) -> Table:  # fmt: skip
    """Read the wanted columns; others are ignored unless they look like a misspelt one.

    naming: what the definition says of columns; gaps: rows without a number are left out and counted, not refused.
    instead: other sets of columns, of which the first that is there is read.
    """
    expected, naming = ", ".join(str(c) for c in wanted if c.required), naming or {}
    ways = (wanted, *instead)
    sheet = open_sheet(data, file, expected, lambda cells: any(is_header(cells, way, naming) for way in ways))
    table = Table(file, {}, {}, {}, np.zeros(0, dtype=np.int64))
    wanted = _way(sheet.header, ways, naming)
    found = match(sheet.header, wanted, naming)
    table.notes += [_taken(name, sheet.header[place.index]) for name, place in found.places.items() if place.guessed]
    sheet, places = _below_units(table, sheet, found.places)
    _check_header(table, sheet, found, places, wanted)
    table.check()
    rows = sheet.rows([place.index for place in places.values()])
    if not len(rows.lines):
        table.note(f"has no rows under its header; expected {expected}")
    table.check()
    _fill(table, rows, places, sheet, gaps=gaps)
    _convert(table, places)
    return table


def _way(header: Sequence[str], ways: Sequence[Sequence[Column]], naming: Naming) -> Sequence[Column]:
    """The first set of columns that is there, else the one of which most are."""
    whole = [way for way in ways if is_header(header, way, naming)]
    return whole[0] if whole else max(ways, key=lambda way: len(match(header, way, naming).places))


def _taken(name: str, cell: str) -> str:
    """What is said of a column that goes by another name."""
    return f"{cell.strip()} taken for {name} (columns.{name.replace(' ', '_')} overrules)"


def _below_units(table: Table, sheet: Sheet, places: Mapping[str, Place]) -> tuple[Sheet, Mapping[str, Place]]:
    """The sheet below a row of units, and the places with these units; times that are time stamps are marked."""
    if sheet.preamble:
        table.notes.append(f"header taken from line {sheet.line}, below {sheet.preamble} others")
    line, row = sheet.first()
    with_units = units_below(row, places) if row and places else None
    if with_units:
        table.notes.append(f"units taken from line {line}")
        sheet, places = sheet.below(line), with_units
        line, row = sheet.first()
    marked = stamped(row, places)
    if marked != dict(places):
        table.notes.append("time stamps, counted from the first")
    return sheet, marked


def _check_header(
    table: Table, sheet: Sheet, found: Match, places: Mapping[str, Place], wanted: Sequence[Column]
) -> None:
    """Note what is missing, misspelt, doubled, or in no known unit."""
    header, by_name = sheet.header, {column.name: column for column in wanted}
    for cell in found.doubled:
        table.note("the column occurs twice", cell, sheet.line)
    for name, place in places.items():
        table.headers[name] = header[place.index].strip()
        try:
            _ = place.conversion
        except ValueError as error:
            table.note(str(error), name, sheet.line)
    absent = {column.name for column in wanted} - set(places)
    for other in found.others:
        if guess := nearest(other, absent):
            table.note(f"unknown column, did you mean {by_name[guess]}?", other, sheet.line)
            absent.discard(guess)
    for column in wanted:
        if column.required and column.name in absent:
            told = f"no column {column}; the header has {', '.join(c.strip() for c in header)}"
            table.note(f"{told}; name it under [measured.columns]", line=sheet.line)


def _fill(table: Table, rows: Rows, places: Mapping[str, Place], sheet: Sheet, *, gaps: bool) -> None:
    """Rows whose wanted cells are numbers; those that are short, long or hold what is no number are noted."""
    width = len(sheet.header)
    table.lines = rows.lines
    _read_stamps(table, rows, places)
    unclosed, ragged = rows.counts == UNCLOSED, rows.counts != width
    bad = np.isnan(rows.numbers)
    tail = _summary(rows, ragged | bad.any(axis=1))
    empty = _gaps(rows, bad) & ~ragged & ~tail if gaps else np.zeros(len(rows.lines), dtype=bool)
    if empty.mean() > _MOST_GAPS:
        table.note(f"{int(empty.sum())} of {len(empty)} rows hold no numbers; are these the right columns?")
    table.flag(unclosed & ~tail, "", lambda _: "a quote is opened here and not closed; a cell ends with its line")
    long = sheet.delimiter == "," and np.mean(rows.counts > width) > 0.5
    comma = " (a decimal comma? put ; between the columns)" if long else ""
    told_ragged = ragged & ~unclosed & ~tail
    table.flag(told_ragged, "", lambda row: f"{rows.counts[row]} cells where the header has {width}{comma}")
    for place, name in enumerate(places):
        told = lambda row, place=place: _not_a_number(rows.text[row, place])  # noqa: E731
        table.flag(bad[:, place] & ~(ragged | tail | empty), name, told)
        table.columns[name] = rows.numbers[:, place]
    for reason, which in ((SUMMARY, tail), (NO_NUMBER, empty)):
        if np.any(which):
            table.left_out[reason] = int(which.sum())
    _keep(table, ~(ragged | bad.any(axis=1) | tail))


def _read_stamps(table: Table, rows: Rows, places: Mapping[str, Place]) -> None:
    """Time stamps as seconds from the first, in place; a clock without a date may pass midnight once a row."""
    for column, place in enumerate(places.values()):
        if place.stamped:
            read = [clock(rows.text.get((row, column), "")) for row in range(len(rows.lines))]
            seconds = np.array([np.nan if value is None else value for value in read])
            known = np.flatnonzero(np.isfinite(seconds))
            wraps = np.cumsum(np.diff(seconds[known], prepend=seconds[known[:1]]) < -43200.0)
            rows.numbers[known, column] = seconds[known] + 86400.0 * wraps - seconds[known[0]]


def _summary(rows: Rows, broken: Bools) -> Bools:
    """Rows at the end that begin with a text in place of a number: what vendors write below their data."""
    sound = np.flatnonzero(~broken)
    tail = np.zeros(len(broken), dtype=bool)
    for row in range(int(sound[-1]) + 1 if len(sound) else len(broken), len(broken)):
        tail[row] = bool(rows.text.get((row, 0), "")) and not _GAP.fullmatch(rows.text[row, 0])
    return tail


def _gaps(rows: Rows, bad: Bools) -> Bools:
    """Rows in which each cell that is no number says that there is none."""
    real = np.zeros_like(bad)
    for (row, column), text in rows.text.items():
        real[row, column] = not _GAP.fullmatch(text)
    return np.asarray((bad & ~real).any(axis=1) & ~(bad & real).any(axis=1))


def _keep(table: Table, rows: Bools) -> None:
    if not rows.all():
        table.lines = table.lines[rows]
        table.columns = {name: values[rows] for name, values in table.columns.items()}


def _convert(table: Table, places: Mapping[str, Place]) -> None:
    """The columns in SI units, in place; a count must be whole."""
    for name, place in places.items():
        if place.column.quantity is COUNT:
            values = table.columns[name]
            broken = values != np.round(values)
            table.flag(broken, name, lambda row, values=values: f"{values[row]:g} is not a whole number")  # type: ignore[misc]
            _keep(table, ~broken)
    for name, place in places.items():
        factor, offset = table.scales[name] = place.conversion
        table.columns[name] *= factor
        table.columns[name] += offset


def _not_a_number(cell: str) -> str:
    text = cell.strip()
    if not text:
        return "is empty; expected a number"
    if text.casefold().strip("+-") in ("nan", "inf", "na", "n/a", "infinity"):
        return f"is {text}; leave the row out where nothing was measured"
    return f'"{text}" is not a number'
