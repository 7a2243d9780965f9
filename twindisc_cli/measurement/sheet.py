"""A measured file as a sheet: a header and rows of cells, from text of any dialect or by a reader of its format.

Text is read block by block: pandas takes a block whose wanted cells are all numbers, any other is read cell by cell. So
a large file needs little more memory than its numbers, and a mistake in it keeps its line.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from io import BytesIO
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twindisc_cli.errors import MeasurementError, Problem
from twindisc_cli.measurement.cells import ANY, Marks, marks_of, number
from twindisc_cli.measurement.content import Content, unpacked

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]
Integers = NDArray[np.integer[Any]]

_BLOCK = 1 << 22  # 4 MiB: parsed at a time, so that memory stays bounded
_HEAD = 1 << 16  # 64 KiB, in which a table has begun
_SHORT = 1 << 17
"""Bytes of a text that are read cell by cell in less time than it takes to load pandas."""
_MARK = b"\xef\xbb\xbf"
_MOST_PREAMBLE = 500  # lines before a header
UNCLOSED = -1  # a count that no row has
BLANKS = " "
"""The delimiter of columns that stand below each other: any number of blanks."""
_REMARK = ("#", "//")
_MOST_UNREAD = 50  # lines after the table, which are shown
_FEWEST_LIKE = 5  # rows that show how long a row is


@dataclass(frozen=True)
class Rows:
    """Wanted cells of some rows: line and count of cells of each row, (row,), and the cells as numbers (row, cell).

    A row with a quote that is not closed counts UNCLOSED cells.
    text: what stands where no number does, by row and cell; numbers are NaN there. heads: the lines on which the
    header stands again. cut: whether the file ends inside its last row, which is not among the rows.
    """

    lines: Integers
    counts: Integers
    numbers: Floats
    text: Mapping[tuple[int, int], str]
    heads: tuple[int, ...] = ()
    cut: bool = False


@dataclass(frozen=True)
class Sheet:
    """The header's cells and its line, and what is below it: text from `start`, cells by line, or numbers (row, cell).

    part: the name of the sheet in a file that has several; notes: what is to be said of how it was read. again: lines
    that are the header where they come again; remark: whether the header is written as a remark.
    """

    header: Sequence[str]
    line: int
    text: bytes = b""
    start: int = 0
    delimiter: str = ","
    cells: Mapping[int, Sequence[str]] | None = None
    numbers: Floats | None = None
    preamble: int = 0
    part: str = ""
    notes: tuple[str, ...] = ()
    again: frozenset[str] = field(default=frozenset())
    remark: bool = False

    def first(self) -> tuple[int, Sequence[str]]:
        """The first line below that holds anything, and its cells; none where there is no such line."""
        return next(iter(self.top(1)), (0, []))

    def top(self, count: int) -> list[tuple[int, Sequence[str]]]:
        """The first lines below that hold anything, each with its cells."""
        if self.numbers is not None:
            rows = ([repr(float(value)) for value in row] for row in self.numbers[:count])
            return list(enumerate(rows, start=self.line + 1))
        if self.cells is not None:
            below = ((line, row) for line, row in self.cells.items() if line > self.line and any(row))
            return list(islice(below, count))
        lines = _decoded(self.text[self.start : self.start + _HEAD]).split("\n")
        result = ((self.line + 1 + n, line) for n, line in enumerate(lines) if _content(line))
        return [(number, _cells(line, self.delimiter)) for number, line in islice(result, count)]

    def below(self, line: int) -> Sheet:
        """The sheet without what is above and in a line, which may come again."""
        if self.cells is not None or self.numbers is not None:
            return replace(self, line=line)
        start = before = self.start
        for _ in range(line - self.line):
            before, start = start, self.text.find(b"\n", start) + 1 or len(self.text)
        return replace(self, line=line, start=start, again=self.again | {_decoded(self.text[before:start]).strip()})

    @cached_property
    def marks(self) -> Marks:
        """How its numbers are written, by its beginning, middle and end."""
        if self.cells is not None or self.numbers is not None:
            return ANY
        length = len(self.text) - self.start
        begins = (0,) if length <= 3 * _HEAD else (0, length // 2, length - _HEAD)
        lines = [
            line
            for begin in begins
            for line in _decoded(self.text[self.start + begin : self.start + begin + _HEAD]).split("\n")[begin > 0 :]
        ]
        return marks_of(cell for line in lines[:4000] for cell in _cells(line, self.delimiter))

    def rows(self, places: Sequence[int]) -> Rows:
        """The rows that hold anything, with the cells at `places`."""
        if self.numbers is not None:
            return _of_numbers(self.numbers[:, list(places)], self.line, len(self.header))
        width = len(self.header)
        if self.cells is not None:
            below = [(line, row) for line, row in self.cells.items() if line > self.line and any(row)]
            heads = tuple(line for line, row in below if list(row) == list(self.header))
            kept = [(line, row) for line, row in below if line not in heads]
            return replace(_cell_by_cell(kept, places, width, ANY), heads=heads)
        return self._of_text(places, width)

    def _of_text(self, places: Sequence[int], width: int) -> Rows:
        """The rows of a text, block by block."""
        marks, cut = self.marks, _cut(self.text, self.start, self.delimiter)
        text_ = self.text[: self.text.rfind(b"\n") + 1] if cut else self.text
        total = text_.count(b"\n", self.start) + text_.count(b"\r", self.start) + 1
        lines, counts = np.empty(total, dtype=np.int32), np.empty(total, dtype=np.int32)
        numbers = np.empty((len(places), total)).T
        text: dict[tuple[int, int], str] = {}
        heads: list[int] = []
        first, filled = self.line + 1, 0
        for block in _blocks(text_, self.start):
            count = block.count(b"\n") + (not block.endswith(b"\n"))
            fast = len(block) > _SHORT
            part = _all_numbers(block, first, count, places, width, self.delimiter, marks) if fast else None
            if part is None:
                split = _split(block, first, self.delimiter, self.again)
                heads += [line for line, row in split if row is None]
                part = _cell_by_cell([(n, row) for n, row in split if row is not None], places, width, marks)
            here = slice(filled, filled + len(part.lines))
            lines[here], counts[here], numbers[here] = part.lines, part.counts, part.numbers
            text |= {(filled + n, m): cell for (n, m), cell in part.text.items()}
            first, filled = first + count, here.stop
        return Rows(lines[:filled], counts[:filled], numbers[:filled], text, tuple(heads), cut)


def open_sheet(content: Content, file: str, expected: str, is_header: Callable[[Sheet], bool]) -> Sheet:
    """The sheet in a file below the first line that `is_header`, else below the first that holds anything.

    `expected` is the header that an empty file lacks. Of a workbook with several such sheets, or a file with
    several such groups, one must be named.
    """
    first, result = None, None
    for sheet in sheets(content, file):
        first = first or (None if sheet.remark else sheet)
        if result and sheet.part == result.part:
            continue
        if is_header(sheet):
            if result:
                fits = f"has several parts that fit, {result.part} and {sheet.part}"
                what = f'{fits}; choose one: {{ file = "...", sheet = "{result.part}" }}'
                raise MeasurementError(Problem(what, file))
            result = sheet
            if not sheet.part:
                break
    opened = result or first
    if opened is None:
        raise MeasurementError(Problem(f"is empty; it needs a header such as {expected}", file))
    return opened


def sheets(content: Content, file: str) -> Iterator[Sheet]:
    """A sheet below each of the first lines of a file that hold anything."""
    from twindisc_cli.measurement.readers import parts_of

    content, file = unpacked(content, file)
    parts = parts_of(content, file)
    if parts is not None:
        for part in parts:
            yield from _grid_heads(part) if part.cells is not None else (part,)
        return
    if content.sheet:
        raise MeasurementError(Problem(f"is a text of one part, and has no part {content.sheet}", file, 0, "sheet"))
    text = _utf8(content.data, file)
    for above, (sheet, end) in enumerate(_text_heads(text)):
        again = frozenset({_decoded(text[text.rfind(b"\n", 0, end) + 1 : end]).strip()})
        yield replace(sheet, text=text, start=end + 1, preamble=above, again=again)
    yield from _without_header(text)


def _grid_heads(part: Sheet) -> Iterator[Sheet]:
    """A sheet below each of the first rows that hold anything."""
    assert part.cells is not None
    first = [(line, row) for line, row in part.cells.items() if any(row)][:_MOST_PREAMBLE]
    for above, (line, row) in enumerate(first):
        yield replace(part, header=row, line=line, preamble=above)
    if first:
        yield replace(part, header=[""] * max(len(row) for _, row in first), line=first[0][0] - 1)


def _text_heads(text: bytes) -> Iterator[tuple[Sheet, int]]:
    """A sheet, still without its body, below each of the first lines that hold anything, and where that line ends.

    A remark may be a header, too.
    """
    for count, _, end, line in _first_lines(text):
        remark = line.lstrip().startswith(_REMARK)
        if _content(line) or remark:
            line = line.lstrip(" \t#/") if remark else line
            delimiter = delimiter_of(line)
            cells = re.split(r"\s{2,}", line.strip()) if delimiter == BLANKS else _cells(line, delimiter)
            if any(cells):
                yield Sheet(cells, count, delimiter=delimiter, remark=remark), end


def _without_header(text: bytes) -> Iterator[Sheet]:
    """The first rows of numbers without a header above them; its cells are empty."""
    for count, begin, _, line in _first_lines(text):
        if _content(line):
            delimiter = delimiter_of(line)
            cells = _cells(line, delimiter)
            if len(cells) > 1 and all(np.isfinite(number(cell, ANY)) for cell in cells):
                yield Sheet([""] * len(cells), count - 1, text, begin, delimiter, preamble=0)
                return


def delimiter_of(line: str) -> str:
    """What stands between the cells of a line."""
    result = next((d for d in ("\t", ";", ",") if d in line), BLANKS)
    if result == "," and re.fullmatch(r"\s*[-+]?\d+,\d+(\s+[-+]?\d+,\d+)+\s*", line):
        return BLANKS
    return result


def _utf8(data: bytes, file: str) -> bytes:
    """A text with line feeds, which `_plain` makes UTF-8 piece by piece: what is UTF-16 is recoded, the rest stays."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        data = data.decode("utf-16", errors="replace").encode()
    elif b"\0" in data[:200] and (order := _wide(data[:200])):
        data = data.decode(order, errors="replace").encode()
    if b"\0" in data:
        raise MeasurementError(Problem("is not a text file; export the data as CSV", file))
    head = data[:_HEAD]
    if b"\r\r\n" in head:
        data = data.replace(b"\r\r\n", b"\n")
    return data.replace(b"\r", b"\n") if b"\r" in head and b"\n" not in head else data


def _plain(piece: bytes) -> bytes:
    """Whole lines in UTF-8 with plain line ends; what is not UTF-8 is Windows-1252, as rigs write it."""
    if not piece.isascii():
        try:
            piece.decode()
        except UnicodeDecodeError:
            piece = piece.decode("cp1252", errors="replace").encode()
    return piece.replace(b"\r\n", b"\n").replace(b"\r", b"\n") if b"\r" in piece else piece


def _decoded(piece: bytes) -> str:
    """The text of a piece; the end of a line that is cut off does not matter."""
    return _plain(piece).decode(errors="replace")


def _wide(head: bytes) -> str:
    """The order of a UTF-16 text without a mark: every second byte of plain letters is zero. Empty for other files."""
    odd, even = head[1::2].count(0), head[::2].count(0)
    half = len(head) // 3
    return "utf-16-le" if odd > half and not even else "utf-16-be" if even > half and not odd else ""


def _first_lines(text: bytes) -> Iterator[tuple[int, int, int, str]]:
    """Number, beginning, end and text of each line in which a table may begin."""
    begin = len(_MARK) if text.startswith(_MARK) else 0
    for count in range(1, _MOST_PREAMBLE + 1):
        if begin >= len(text):
            return
        end = text.find(b"\n", begin)
        end = len(text) if end < 0 else end
        yield count, begin, end, _decoded(text[begin:end])
        begin = end + 1


def _content(line: str) -> bool:
    """Whether a line holds data: not blank, no remark, not the `sep=;` of a spreadsheet."""
    return bool(line.strip(" \t;,")) and not line.lstrip().startswith(_REMARK) and not line.startswith("sep=")


def _cells(line: str, delimiter: str) -> list[str]:
    """The cells of one line; none where a quote is not closed in it, or a line ends inside."""
    if delimiter == BLANKS:
        return line.split()
    try:
        return [] if line.count('"') % 2 else next(csv.reader([line], delimiter=delimiter), [])
    except csv.Error:
        return []


def _blocks(text: bytes, begin: int) -> Iterator[bytes]:
    """The lines from a place on in pieces of a few megabytes."""
    while begin < len(text):
        end = text.find(b"\n", begin + _BLOCK) + 1 or len(text)
        yield _plain(text[begin:end])
        begin = end


def _all_numbers(
    block: bytes, first: int, count: int, places: Sequence[int], width: int, delimiter: str, marks: Marks
) -> Rows | None:
    """The wanted cells of a block where each is a finite number; None where a closer look is needed."""
    import pandas as pd

    line = block.partition(b"\n")[0].decode()
    cells = _cells(line, delimiter)
    if len(cells) < width or any(cells[width:]) or b"true" in block.lower() or b"false" in block.lower():
        return None
    decimal = marks.decimal or ("," if "," in line else ".")
    if delimiter in (decimal, BLANKS):
        decimal = "." if delimiter == "," else decimal
    kinds = {place: np.float64 if place in places else str for place in range(len(cells))}
    try:
        frame = pd.read_csv(
            BytesIO(block), sep=r"\s+" if delimiter == BLANKS else delimiter, decimal=decimal, header=None, dtype=kinds,
            na_filter=False, thousands=marks.thousands,
        )  # fmt: skip
    except ValueError:
        return None
    values = np.asarray(frame[list(places)].to_numpy(), dtype=np.float64)
    if len(values) != count or not np.all(np.isfinite(values)):
        return None
    return Rows(first + np.arange(count), np.full(count, width), values, {})


def _split(block: bytes, first: int, delimiter: str, again: frozenset[str]) -> list[tuple[int, Sequence[str] | None]]:
    """The lines of a block that hold data, cell by cell, each with its number; None for a header that stands again."""
    lines = block.decode().split("\n")
    return [
        (first + n, None if line.strip() in again else _cells(line, delimiter))
        for n, line in enumerate(lines)
        if _content(line)
    ]


def _cell_by_cell(rows: Sequence[tuple[int, Sequence[str]]], places: Sequence[int], width: int, marks: Marks) -> Rows:
    """Rows whose cells may be anything; a row counts as long as the header where only blanks go beyond it."""
    counts = [(len(row) or UNCLOSED) if len(row) < width or any(row[width:]) else width for _, row in rows]
    numbers, text = np.full((len(rows), len(places)), np.nan), {}
    for n, (_, row) in enumerate(rows):
        for m, place in enumerate(places):
            cell = row[place].strip() if place < len(row) else ""
            numbers[n, m] = number(cell, marks)
            if not np.isfinite(numbers[n, m]):
                numbers[n, m], text[n, m] = np.nan, cell
    lines = np.array([line for line, _ in rows], dtype=np.int64)
    return Rows(lines, np.array(counts, dtype=np.int64), numbers, text)


def _of_numbers(numbers: Floats, line: int, width: int) -> Rows:
    """Rows of a file that holds numbers."""
    text = {(int(n), int(m)): "" for n, m in np.argwhere(~np.isfinite(numbers))}
    numbers = np.where(np.isfinite(numbers), numbers, np.nan)
    return Rows(line + 1 + np.arange(len(numbers)), np.full(len(numbers), width), numbers, text)


def _cut(text: bytes, start: int, delimiter: str) -> bool:
    """Whether a text ends inside its last row: without a line end, and with fewer or shorter cells than those before.

    A row that begins with a word is a summary.
    A last cell is shorter where all others have as many characters or decimals, or where its number jumps besides.
    """
    if text.endswith(b"\n") or text.count(b"\n", start) < _FEWEST_LIKE:
        return False
    begin = max(start, len(text) - _HEAD)
    lines = [line for line in _decoded(text[begin:]).split("\n")[begin > start :] if _content(line)][-_MOST_UNREAD:]
    *rows, last = [[cell.strip() for cell in _cells(line, delimiter)] for line in lines]
    if len(rows) < _FEWEST_LIKE or any(len(row) != len(rows[0]) for row in rows):
        return False
    if last and not np.isfinite(number(last[0], ANY)) and np.isfinite(number(rows[0][0], ANY)):
        return False
    if len(last) < len(rows[0]):
        return True
    ends, end = [row[-1] for row in rows], last[-1]
    lengths, decimals = {len(cell) for cell in ends}, {_decimals(cell) for cell in ends}
    if len(end) >= min(lengths):
        return False
    if len(lengths) == 1 or (len(decimals) == 1 and _decimals(end) < min(decimals)):
        return True
    values = np.array([number(cell, ANY) for cell in [*ends, end]])
    return bool(abs(values[-1] - values[-2]) > 5.0 * np.max(np.abs(np.diff(values[:-1]))))


def _decimals(cell: str) -> int:
    """How many characters follow the decimal sign."""
    return max(len(cell.partition(mark)[2]) for mark in ".,")
