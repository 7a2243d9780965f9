"""Tables with units in their headers: `name [unit]`, any of , ; tab between cells, decimal point or comma; workbooks.

A table keeps what it needs to say where a mistake is, and gathers the mistakes instead of stopping at the first.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from twindisc_cli.errors import MeasurementError, Problem, did_you_mean, nearest
from twindisc_cli.measurement import markers
from twindisc_cli.measurement.cells import ANY, number
from twindisc_cli.measurement.content import Content
from twindisc_cli.measurement.header import (
    SHARED,
    Column,
    Match,
    Naming,
    Place,
    clock,
    is_header,
    match,
    parts,
    plain,
    stamped,
    units_below,
)
from twindisc_cli.measurement.rows import RowCount
from twindisc_cli.measurement.sheet import UNCLOSED, Bools, Floats, Integers, Ints, Rows, Sheet, open_sheet
from twindisc_cli.measurement.units import COUNT

_SHOWN = 3  # rows named one by one
_GAP = re.compile(r"[-*#\s]*|[-+]?(?:nan|inf|infinity|na|n/a|#n/a|null|none|ovl|ol)", re.IGNORECASE)
_LARGEST_COUNT = 2.0**53  # beyond it a float is no count
_MOST_GAPS = 0.5  # of a column: more is no column of this table
NO_NUMBER, SUMMARY, CUT = "no number", "summary at the end", "cut off at the end"
AGAIN, HEAD = "header again", "head of a block"
_SAME = 1e-3
"""Columns of one name are one where they differ by no more than this of the largest number in them."""


@dataclass
class Table:
    """The rows that could be read: SI columns by name, factor and offset to SI, the line of each row.

    block: which of the blocks each row is in where the header stands again, None where it does not. origin: the time
    stamp [s] from which times are counted, NaN where they are no stamps. unread: names of columns that nobody wanted.
    """

    file: str
    columns: dict[str, Floats]
    scales: dict[str, tuple[float, float]]
    headers: dict[str, str]
    lines: Integers
    block: Ints | None = None
    origin: float = np.nan
    problems: list[Problem] = field(default_factory=list)
    left_out: dict[str, int] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    unread: Sequence[str] = ()

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

    def note(self, what: str, name: str = "", line: int = 0, block: tuple[str, ...] = ()) -> None:
        """Note a problem of the file, of a column, or of a cell; block: lines of a definition that cure it."""
        self.problems.append(Problem(what, self.file, line, self.headers.get(name, name), block))

    def keep(self, kept: Bools, reason: str) -> None:
        """Leave out the other rows, for a reason that is counted."""
        if np.all(kept):
            return
        self.left_out[reason] = self.left_out.get(reason, 0) + int(np.sum(~kept))
        self.columns = {name: values[kept] for name, values in self.columns.items()}
        self.lines = self.lines[kept]
        self.block = None if self.block is None else self.block[kept]

    def count(self, used: int | None = None) -> RowCount:
        """What became of the rows; all that could be read were used unless said."""
        return RowCount(self.file, len(self) if used is None else used, self.left_out, tuple(self.notes))

    def check(self) -> None:
        """Raise what was noted."""
        if self.problems:
            raise MeasurementError(self.problems)


def read_table(
    data: bytes | Content, file: str, wanted: Sequence[Column], naming: Naming | None = None, *, gaps: bool = False,
    instead: Sequence[Sequence[Column]] = (),
) -> Table:  # fmt: skip
    """Read the wanted columns; others are ignored unless they look like a misspelt one.

    naming: what the definition says of columns; gaps: rows without a number are left out and counted, not refused, and
    kept where only columns are without one that may be.
    instead: other sets of columns, of which the first that is there is read.
    """
    content = data if isinstance(data, Content) else Content(data)
    expected, naming = ", ".join(str(c) for c in wanted if c.required), naming or {}
    ways, ignored = (wanted, *instead), content.ignore
    sheet = open_sheet(
        content,
        file,
        expected,
        lambda sheet: any(is_header(_heard(sheet.header, ignored), way, naming) for way in ways),
    )
    header = _heard(sheet.header, ignored)
    table = Table(file, {}, {}, {}, np.zeros(0, dtype=np.int64), notes=[*sheet.notes])
    table.notes += _ignored_in_vain(sheet.header, ignored)
    wanted = _way(header, ways, naming)
    result = match(header, wanted, naming)
    table.unread = result.others
    table.notes += [
        f"{header[place.index].strip()} taken for {name} (columns.{name.replace(' ', '_')} overrules)"
        for name, place in result.places.items()
        if place.guessed
    ]
    sheet, places = _below_units(table, sheet, result.places)
    _check_header(table, sheet, result, places, wanted, naming)
    if table.problems:
        for _, index in result.doubled:
            table.note("the column occurs twice", header[index], sheet.line)
    table.check()
    rows = sheet.rows([place.index for place in places.values()])
    _check_doubled(table, sheet, result, places, rows)
    if not len(rows.lines):
        table.note(f"has no rows under its header; expected {expected}")
    table.check()
    gaps = gaps or content.skip is not None
    rows = _mark(table, rows, places, content, gaps=gaps)
    _fill(table, rows, places, sheet, gaps=gaps)
    _convert(table, places)
    return table


def _heard(header: Sequence[str], ignored: Sequence[str]) -> Sequence[str]:
    """A header without the names of columns that are ignored."""
    names = {plain(name) for name in ignored}
    return [
        "" if plain(cell) in names or plain(parts(cell)[0]) in names or f"#{n}" in names else cell
        for n, cell in enumerate(header, start=1)
    ]


def _ignored_in_vain(header: Sequence[str], ignored: Sequence[str]) -> list[str]:
    """A note for each column that is to be ignored and is not there."""
    names = [parts(cell)[0] for cell in header]
    there = {plain(cell) for cell in (*header, *names)} | {f"#{n}" for n in range(1, len(header) + 1)}
    return [f"no column {name} to ignore{did_you_mean(name, names)}" for name in ignored if plain(name) not in there]


def _check_doubled(table: Table, sheet: Sheet, result: Match, places: Mapping[str, Place], rows: Rows) -> None:
    """Columns of one name must hold the same numbers; otherwise one of them is to be chosen."""
    for name, index in result.doubled:
        other = sheet.rows([index]).numbers[:, 0]
        first = rows.numbers[:, list(places).index(name)]
        with np.errstate(invalid="ignore"):
            same = np.abs(first - other) <= _SAME * np.nanmax(np.abs(first), initial=0.0)
        cell = sheet.header[index].strip()
        if len(same) and np.all(same | (np.isnan(first) & np.isnan(other))):
            table.notes.append(f"{cell} stands there twice with the same numbers; the first is read")
            continue
        key = f"columns.{name.replace(' ', '_')}"
        lines = [f'{key} = {{ column = "#{n + 1}" }}' for n in (places[name].index, index)]
        block = (lines[0], f"# or {lines[1]}")
        table.note("the column occurs twice, with other numbers; say which", cell, sheet.line, block)


def _mark(table: Table, rows: Rows, places: Mapping[str, Place], content: Content, *, gaps: bool) -> Rows:
    """The rows in which numbers that stand for no measurement are none: those declared, else those that stand apart.

    gaps: whether such rows are left out, without having been declared.
    """
    text, declared = dict(rows.text), content.skip is not None
    for (row, at), cell in rows.text.items():
        if declared and cell in (content.skip or ()):
            text[row, at] = ""
    for column, (name, place) in enumerate(places.items()):
        if place.stamped or place.column.quantity is COUNT:
            continue
        values = rows.numbers[:, column]
        known = ((marker, values == marker) for marker in content.markers)
        for marker, mine in known if declared else markers.found(values, place.column.quantity.name):
            values[mine] = np.nan
            text |= dict.fromkeys(((int(row), column) for row in np.flatnonzero(mine)), "" if gaps else f"{marker:g}")
            why = "as declared" if declared else "skip = [] reads it as a number"
            if gaps and np.any(mine):
                cell = table.headers.get(name, name)
                table.notes.append(f"{int(mine.sum())} rows hold {marker:g} in {cell}, taken for no number ({why})")
    return replace(rows, text=text)


def _way(header: Sequence[str], ways: Sequence[Sequence[Column]], naming: Naming) -> Sequence[Column]:
    """The first set of columns that is there, else the one of which most are there or declared."""
    whole = [way for way in ways if is_header(header, way, naming)]
    declared = {name for name, named in naming.items() if named.column}

    def known(way: Sequence[Column]) -> int:
        return len(declared & {column.name for column in way} | set(match(header, way, naming).places))

    return whole[0] if whole else max(ways, key=known)


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
    if cell := sheet.marks.either:
        read = f"{number(cell, ANY):g}"
        table.notes.append(f"{cell} is read as {read}, with decimals: if its comma parts thousands, take it out")
    return sheet, marked


def _unit_line(name: str, place: Place) -> tuple[str, ...]:
    """The line that would say the unit of a column without one, or of one in kg that is meant as a force."""
    units = [unit for unit in place.column.quantity.units if unit.startswith(place.unit or "")]
    if not units:
        return ()
    return (f'columns.{name.replace(" ", "_")} = {{ unit = "{units[0]}" }}  # check the unit',)


def _check_header(
    table: Table, sheet: Sheet, result: Match, places: Mapping[str, Place], wanted: Sequence[Column], naming: Naming
) -> None:
    """Note what is missing, misspelt, doubled, or in no known unit."""
    header, by_name = sheet.header, {column.name: column for column in wanted}
    for name, place in places.items():
        table.headers[name] = header[place.index].strip()
        try:
            _ = place.conversion
        except ValueError as error:
            table.note(str(error), name, sheet.line, _unit_line(name, place))
    absent = {column.name for column in wanted} - set(places)
    declared = {name: named.column for name, named in naming.items() if named.column}
    for other in result.others:
        guess = nearest(other, absent - set(declared))
        if guess and guess[0] == other[0]:  # temp is no step
            if asked := by_name[guess].asked_by:
                table.note(f"no column {guess}, which {asked} names; did you mean {other}?", line=sheet.line)
            else:
                table.note(f"unknown column, did you mean {by_name[guess]}?", other, sheet.line)
            absent.discard(guess)
    there = f"the header has {', '.join(c.strip() for c in header)}"
    for column in wanted:
        if column.name not in absent:
            continue
        if column.name in declared and (column.required or column.name not in SHARED):
            key = f"columns.{column.name.replace(' ', '_')}"
            table.note(f"no column {declared[column.name]}, as {key} names it; {there}", line=sheet.line)
        elif column.required:
            table.note(f"no column {column}; {there}; name it under [measured.columns]", line=sheet.line)


def _fill(table: Table, rows: Rows, places: Mapping[str, Place], sheet: Sheet, *, gaps: bool) -> None:
    """Rows whose wanted cells are numbers; those that are short, long or hold what is no number are noted."""
    width = len(sheet.header)
    table.lines = rows.lines
    _read_stamps(table, rows, places)
    unclosed, ragged = rows.counts == UNCLOSED, rows.counts != width
    bad = np.isnan(rows.numbers)
    head = _heads(rows, ragged | bad.any(axis=1))
    tail = _summary(rows, ragged | bad.any(axis=1)) & ~head
    apart = tail | head
    empty = _gaps(rows, bad) & ~ragged & ~apart if gaps else np.zeros(len(rows.lines), dtype=bool)
    if empty.mean() > _MOST_GAPS:
        table.note(f"{int(empty.sum())} of {len(empty)} rows hold no numbers; are these the right columns?")
    table.flag(unclosed & ~apart, "", lambda _: "a quote is opened here and not closed; a cell ends with its line")
    long = sheet.delimiter == "," and np.mean(rows.counts > width) > 0.5
    comma = " (a decimal comma? put ; between the columns)" if long else ""
    reported = ragged & ~unclosed & ~apart
    table.flag(reported, "", lambda row: f"{rows.counts[row]} cells where the header has {width}{comma}")
    needed = [not place.column.gaps for place in places.values()]
    kept = empty & ~bad[:, needed].any(axis=1)
    for place, name in enumerate(places):
        message = lambda row, place=place: _not_a_number(rows.text[row, place])  # noqa: E731
        table.flag(bad[:, place] & ~(ragged | apart | empty), name, message)
        table.columns[name] = rows.numbers[:, place]
    lost = empty & ~kept
    counts = {SUMMARY: tail.sum(), NO_NUMBER: lost.sum(), HEAD: head.sum(), AGAIN: len(rows.heads), CUT: rows.cut}
    table.left_out |= {reason: int(count) for reason, count in counts.items() if count}
    if rows.heads:
        table.block = np.searchsorted(rows.heads, rows.lines).astype(np.int64)
    _keep(table, ~(ragged | bad.any(axis=1) | tail) | kept)


def _read_stamps(table: Table, rows: Rows, places: Mapping[str, Place]) -> None:
    """Time stamps as seconds from the first, in place; a clock without a date may pass midnight once a row."""
    for column, place in enumerate(places.values()):
        if place.stamped:
            read = [clock(rows.text.get((row, column), "")) for row in range(len(rows.lines))]
            seconds = np.array([np.nan if value is None else value for value in read])
            known = np.flatnonzero(np.isfinite(seconds))
            wraps = np.cumsum(np.diff(seconds[known], prepend=seconds[known[:1]]) < -43200.0)
            table.origin = float(seconds[known[0]]) if len(known) else np.nan
            rows.numbers[known, column] = seconds[known] + 86400.0 * wraps - table.origin


def _summary(rows: Rows, broken: Bools) -> Bools:
    """Rows at the end that begin with a text in place of a number, or are short and hold none: what is below data."""
    sound = np.flatnonzero(~broken)
    tail = np.zeros(len(broken), dtype=bool)
    for row in range(int(sound[-1]) + 1 if len(sound) else len(broken), len(broken)):
        named = bool(rows.text.get((row, 0), "")) and not _GAP.fullmatch(rows.text[row, 0])
        short = 0 < rows.counts[row] < np.max(rows.counts) and np.all(np.isnan(rows.numbers[row]))
        tail[row] = named or short
    return tail


def _heads(rows: Rows, broken: Bools) -> Bools:
    """Rows between data and a header that stands again: what is written above each block."""
    lines, sound = np.asarray(rows.lines), np.flatnonzero(~broken)
    above = np.zeros(len(broken), dtype=bool)
    for line in rows.heads:
        before = sound[lines[sound] < line]
        first = int(before[-1]) + 1 if len(before) else 0
        above |= broken & (lines < line) & (np.arange(len(lines)) >= first)
    return above


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
        table.block = None if table.block is None else table.block[rows]


def _convert(table: Table, places: Mapping[str, Place]) -> None:
    """The columns in SI units, in place; a count must be whole."""
    for name, place in places.items():
        if place.column.quantity is COUNT:
            values = table.columns[name]
            broken = (values != np.round(values)) | (np.abs(values) >= _LARGEST_COUNT)
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
        return f'is {text}; leave the row out where nothing was measured, or say skip = "{text}"'
    if np.isfinite(number(text, ANY)):
        return f'is {text}, which looks like a marker for no number: skip = "{text}" leaves such rows out'
    return f'"{text}" is not a number'
