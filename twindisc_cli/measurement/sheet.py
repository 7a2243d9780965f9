"""A measured file as a sheet: a header and rows of cells, from text of any dialect or from a workbook.

Text is read block by block: pandas takes a block whose wanted cells are all numbers, any other is read cell by cell. So
a large file needs little more memory than its numbers, and a mistake in it keeps its line.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from io import BytesIO
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twindisc_cli.errors import MeasurementError, Problem

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Integers = NDArray[np.integer[Any]]

_BLOCK = 1 << 23
_HEAD = 1 << 16
_MARK = b"\xef\xbb\xbf"
_MOST_PREAMBLE = 500
UNCLOSED = -1
_WORKBOOK = b"PK\x03\x04"


@dataclass(frozen=True)
class Rows:
    """Wanted cells of some rows: line and count of cells of each row, (row,), and the cells as numbers (row, cell).

    A row with a quote that is not closed counts UNCLOSED cells.
    text: what stands where no number does, by row and cell; numbers are NaN there.
    """

    lines: Integers
    counts: Integers
    numbers: Floats
    text: Mapping[tuple[int, int], str]


@dataclass(frozen=True)
class Sheet:
    """The header's cells and its line, and what is below it: text from `start`, or the cells of a workbook by line."""

    header: Sequence[str]
    line: int
    text: bytes = b""
    start: int = 0
    delimiter: str = ","
    cells: Mapping[int, Sequence[str]] | None = None
    preamble: int = 0

    def first(self) -> tuple[int, Sequence[str]]:
        """The first line below that holds anything, and its cells; none where there is no such line."""
        if self.cells is not None:
            return next(((line, row) for line, row in self.cells.items() if line > self.line and any(row)), (0, []))
        lines = _decoded(self.text[self.start : self.start + _HEAD]).split("\n")
        found = ((self.line + 1 + n, line) for n, line in enumerate(lines) if _content(line))
        line, text = next(found, (0, ""))
        return line, _cells(text, self.delimiter)

    def below(self, line: int) -> Sheet:
        """The sheet without what is above and in a line."""
        start = self.start
        for _ in range(line - self.line):
            start = self.text.find(b"\n", start) + 1 or len(self.text)
        return replace(self, line=line, start=start)

    def rows(self, places: Sequence[int]) -> Rows:
        """The rows that hold anything, with the cells at `places`."""
        width = len(self.header)
        if self.cells is not None:
            below = [(line, row) for line, row in self.cells.items() if line > self.line and any(row)]
            return _cell_by_cell(below, places, width)
        total = self.text.count(b"\n", self.start) + self.text.count(b"\r", self.start) + 1
        lines, counts = np.empty(total, dtype=np.int32), np.empty(total, dtype=np.int32)
        numbers = np.empty((len(places), total)).T
        text: dict[tuple[int, int], str] = {}
        first, filled = self.line + 1, 0
        for block in _blocks(self.text, self.start):
            count = block.count(b"\n") + (not block.endswith(b"\n"))
            part = _all_numbers(block, first, count, places, width, self.delimiter)
            if part is None:
                part = _cell_by_cell(_split(block, first, self.delimiter), places, width)
            here = slice(filled, filled + len(part.lines))
            lines[here], counts[here], numbers[here] = part.lines, part.counts, part.numbers
            text |= {(filled + n, m): cell for (n, m), cell in part.text.items()}
            first, filled = first + count, here.stop
        return Rows(lines[:filled], counts[:filled], numbers[:filled], text)


def open_sheet(data: bytes, file: str, expected: str, is_header: Callable[[Sequence[str]], bool]) -> Sheet:
    """The sheet in a file's bytes, below the first line that `is_header`, else below the first that holds anything.

    `expected` is the header that an empty file is told to have.
    """
    first = None
    for sheet in sheets(data, file):
        first = first or sheet
        if is_header(sheet.header):
            return sheet
    if first is None:
        raise MeasurementError(Problem(f"is empty; it needs a header such as {expected}", file))
    return first


def sheets(data: bytes, file: str) -> Iterator[Sheet]:
    """A sheet below each of the first lines of a file's bytes that hold anything."""
    book = data.startswith(_WORKBOOK)
    text = b"" if book else _utf8(data, file)
    for above, (sheet, end) in enumerate(_workbook_heads(data, file) if book else _text_heads(text)):
        yield replace(sheet, text=text, start=end + 1, preamble=above)


def _workbook_heads(data: bytes, file: str) -> Iterator[tuple[Sheet, int]]:
    """A sheet below each of the first rows that hold anything."""
    cells = _workbook(data, file)
    first = list(cells.items())[:_MOST_PREAMBLE]
    return ((Sheet(row, line, cells=cells), 0) for line, row in first if any(row))


def _text_heads(text: bytes) -> Iterator[tuple[Sheet, int]]:
    """A sheet, still without its body, below each of the first lines that hold anything, and where that line ends."""
    begin = len(_MARK) if text.startswith(_MARK) else 0
    for number, end in enumerate(_line_ends(text), start=1):
        line = _decoded(text[begin:end])
        if _content(line):
            delimiter = next((d for d in ("\t", ";") if d in line), ",")
            yield Sheet(_cells(line, delimiter), number, delimiter=delimiter), end
        begin = end + 1
        if number >= _MOST_PREAMBLE:
            return


def _utf8(data: bytes, file: str) -> bytes:
    """A text with line feeds, which `_plain` makes UTF-8 piece by piece: what is UTF-16 is recoded, the rest stays."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        data = data.decode("utf-16", errors="replace").encode()
    elif b"\0" in data[:200] and (order := _wide(data[:200])):
        data = data.decode(order, errors="replace").encode()
    if b"\0" in data:
        raise MeasurementError(Problem("is not a text file; export the data as CSV", file))
    head = data[:_HEAD]
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


def _line_ends(text: bytes) -> Iterator[int]:
    begin = 0
    while begin < len(text):
        end = text.find(b"\n", begin)
        end = len(text) if end < 0 else end
        yield end
        begin = end + 1


def _content(line: str) -> bool:
    """Whether a line holds data: not blank, no comment, not the `sep=;` of a spreadsheet."""
    return bool(line.strip(" \t;,")) and not line.lstrip().startswith("#") and not line.startswith("sep=")


def _cells(line: str, delimiter: str) -> list[str]:
    """The cells of one line; none where a quote is not closed in it, or a line ends inside."""
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
    block: bytes, first: int, count: int, places: Sequence[int], width: int, delimiter: str
) -> Rows | None:
    """The wanted cells of a block where each is a finite number; None where a closer look is needed."""
    import pandas as pd

    line = block.partition(b"\n")[0].decode()
    cells = _cells(line, delimiter)
    if len(cells) < width or any(cells[width:]) or b"true" in block.lower() or b"false" in block.lower():
        return None
    decimal = "," if delimiter != "," and "," in line else "."
    kinds = {place: np.float64 if place in places else str for place in range(len(cells))}
    try:
        frame = pd.read_csv(BytesIO(block), sep=delimiter, decimal=decimal, header=None, dtype=kinds, na_filter=False)
    except ValueError:
        return None
    values = np.asarray(frame[list(places)].to_numpy(), dtype=np.float64)
    if len(values) != count or not np.all(np.isfinite(values)):
        return None
    return Rows(first + np.arange(count), np.full(count, width), values, {})


def _split(block: bytes, first: int, delimiter: str) -> list[tuple[int, Sequence[str]]]:
    """The lines of a block that hold data, cell by cell, each with its number."""
    lines = block.decode().split("\n")
    return [(first + n, _cells(line, delimiter)) for n, line in enumerate(lines) if _content(line)]


def _cell_by_cell(rows: Sequence[tuple[int, Sequence[str]]], places: Sequence[int], width: int) -> Rows:
    """Rows whose cells may be anything; a row counts as long as the header where only blanks go beyond it."""
    counts = [(len(row) or UNCLOSED) if len(row) < width or any(row[width:]) else width for _, row in rows]
    numbers, text = np.full((len(rows), len(places)), np.nan), {}
    for n, (_, row) in enumerate(rows):
        for m, place in enumerate(places):
            cell = row[place].strip() if place < len(row) else ""
            numbers[n, m] = _number(cell)
            if not np.isfinite(numbers[n, m]):
                numbers[n, m], text[n, m] = np.nan, cell
    lines = np.array([line for line, _ in rows], dtype=np.int64)
    return Rows(lines, np.array(counts, dtype=np.int64), numbers, text)


def _number(cell: str) -> float:
    try:
        return float(cell.replace(",", "."))
    except ValueError:
        return np.nan


def _workbook(data: bytes, file: str) -> dict[int, list[str]]:
    """The cells of a workbook's first sheet as text, by row number."""
    import pandas as pd

    try:
        frame = pd.read_excel(BytesIO(data), sheet_name=0, header=None, dtype=object, na_filter=False)
    except ImportError:
        what = "is a workbook: install twindisc with [xlsx] to read it, or export the data as CSV"
        raise MeasurementError(Problem(what, file)) from None
    except Exception as error:
        raise MeasurementError(
            Problem(f"is not a text file and no workbook: {error}; export the data as CSV", file)
        ) from None
    return {int(n) + 1: [_text(cell) for cell in row] for n, row in zip(frame.index, frame.to_numpy(), strict=True)}


def _text(cell: Any) -> str:
    return repr(float(cell)) if isinstance(cell, (int, float)) and not isinstance(cell, bool) else str(cell).strip()
