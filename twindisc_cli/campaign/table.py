"""One row a test: what was asked, what came out, in one table with the units in its headers.

Columns are `name [unit]`. Numbers of a command's JSON become columns by their names, whose ends are their units
(`depth_um` is `depth [um]`); records that carry a `step` or an `effect` get columns of their own for each; what has no
such name (the iterations of a history, the trials of a bisection) stays in the test's own file.
"""

from __future__ import annotations

import csv
import importlib.util
import io
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain, count
from typing import Any

import numpy as np

from twindisc_cli.quantities import split_key
from twindisc_cli.results import Array, Axis, Dataset

Value = float | int | str | bool | None

_KEYED = ("step", "effect", "law")
_LARGEST = 10**300
"""What names a record in a list of records."""
_FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""What a spreadsheet takes a cell for a formula by."""
_HEADER = re.compile(r"(.*) \[([^\]]*)\]")


@dataclass(frozen=True)
class Row:
    """The outcome of one test. `asked` and `found` are columns by header; error is empty where it worked.

    older: whether there was a result that another version of the program had made.
    """

    test: str
    file: str
    exit_code: int
    error: str = ""
    group: str = ""
    provenance: str = ""
    run_key: str = ""
    asked: Mapping[str, Value] = field(default_factory=dict)
    found: Mapping[str, Value] = field(default_factory=dict)
    computed: bool = False
    older: bool = False

    @property
    def failed(self) -> bool:
        """Whether there is no result."""
        return bool(self.error)


def header(name: str, unit: str | None = None) -> str:
    """`depth [um]` for depth_um, `convection std [W/K]` for convection_W_K_std, `mu [1]` for mu; or the unit given."""
    stem, std = (name.removesuffix("_std"), " std") if name.endswith("_std") else (name, "")
    plain, own = split_key(stem)
    return f"{plain.replace('_', ' ')}{std} [{unit or own.solidus}]"


def columns_of(outcome: Mapping[str, Any]) -> dict[str, Value]:
    """The columns of a command's JSON; what is null has none."""
    return {name: value for name, value in _flat(outcome, "") if value is not None}


def _flat(table: Mapping[str, Any], prefix: str) -> Iterator[tuple[str, Value]]:
    """The columns of a table; prefix, the names of the tables that hold it, each with a space behind it."""
    unit = table.get("unit")
    *above, name = prefix.split(" ")[:-1] or [""]
    holder = " ".join([*above, ""])
    for key, value in table.items():
        if key == "unit" or (prefix and key in _KEYED):
            continue
        if isinstance(value, Mapping):
            yield from _flat(value, prefix if key == "parameters" else f"{prefix}{key} ")
        elif isinstance(value, list):
            yield from _listed(prefix, key, value)
        elif isinstance(value, bool | str):
            yield f"{prefix}{key.replace('_', ' ')}", value
        elif key == "value" and prefix:
            yield f"{holder}{header(name, unit)}", value
        elif isinstance(unit, str) and key in ("std", "low", "high"):
            yield f"{holder}{header(name, unit)}".replace(" [", f" {key} ["), value
        else:
            yield f"{prefix}{header(key, unit if isinstance(unit, str) else None)}", value


def _listed(prefix: str, name: str, items: list[Any]) -> Iterator[tuple[str, Value]]:
    """Texts and messages in one cell; named records with columns of their own; the rest is left out."""
    texts = [item["message"] if isinstance(item, Mapping) and "message" in item else item for item in items]
    records = [item for item in items if isinstance(item, Mapping)]
    key = next((key for key in _KEYED if records and all(key in record for record in records)), None)
    if key:
        if key != "step":
            yield f"{prefix}{name}", "; ".join(str(record[key]) for record in records)
        for record in records:
            yield from _flat(record, f"{prefix}{'step ' if key == 'step' else ''}{record[key]} ")
    elif texts and all(isinstance(text, str) for text in texts):
        yield f"{prefix}{name.replace('_', ' ')}", "; ".join(texts)


@dataclass(frozen=True)
class Table:
    """Columns by header, each (row,): numbers with NaN, or texts with "", where a test has none."""

    columns: Mapping[str, np.ndarray[Any, np.dtype[Any]]]

    @property
    def rows(self) -> int:
        """The number of tests."""
        return len(self.columns["test"])

    def numbers(self, name: str) -> np.ndarray[Any, np.dtype[np.float64]]:
        """A column of numbers; NaN where there is no such column."""
        result = self.columns.get(name)
        return np.full(self.rows, np.nan) if result is None or result.dtype == object else result

    def texts(self, name: str) -> list[str]:
        """A column of texts; empty where there is no such column."""
        result = self.columns.get(name)
        return [""] * self.rows if result is None else [str(text) for text in result]


def table_of(rows: Sequence[Row]) -> Table:
    """The rows as columns, in the order in which the tests first have them."""
    records = [_record(row) for row in rows]
    names = dict.fromkeys(name for row in rows for name in row.asked)
    first = ("test", "group", "exit code", "error")
    last = ("data provenance", "run key", "definition")
    names |= dict.fromkeys(name for row in rows for name in row.found)
    ordered = [*first, *(name for name in names if name not in first + last), *last]
    return Table({name: _column([record.get(name) for record in records]) for name in ordered})


def _record(row: Row) -> dict[str, Value]:
    return {
        **row.asked,
        **row.found,
        "test": row.test,
        "group": row.group,
        "exit code": row.exit_code,
        "error": row.error,
        "data provenance": row.provenance,
        "run key": row.run_key,
        "definition": row.file,
    }


def _column(values: Sequence[Value]) -> np.ndarray[Any, np.dtype[Any]]:
    """Numbers as float, whole numbers as int where none is missing, all else as text."""
    if all(_is_number(v) and isinstance(v, int) and abs(v) < 2**63 for v in values):
        return np.array(values, dtype=np.int64)
    if all(v is None or _is_number(v) for v in values):
        return np.array([np.nan if v is None else v for v in values], dtype=float)
    return np.array([_text(v) for v in values], dtype=object)


def _is_number(value: Value) -> bool:
    """Whether it is a number that a floating-point number can hold; a definition may ask for any."""
    if isinstance(value, int):
        return not isinstance(value, bool) and abs(value) < _LARGEST
    return isinstance(value, float)


def _text(value: Value) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return "" if value is None else str(value)


def csv_text(table: Table) -> str:
    """The table as CSV: one header row with units, empty cells where there is nothing."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow([_as_text(name) for name in table.columns])
    for cells in zip(*(column.tolist() for column in table.columns.values()), strict=True):
        writer.writerow([_cell(cell) for cell in cells])
    return buffer.getvalue()


def _cell(cell: Value) -> Value:
    """A cell of the CSV: empty where a number is not known."""
    if isinstance(cell, str):
        return _as_text(cell)
    return "" if isinstance(cell, float) and cell != cell else cell


def _as_text(text: str) -> str:
    """A text that no spreadsheet takes for a formula: with an apostrophe before it where it would."""
    if not text.startswith(_FORMULA):
        return text
    try:
        float(text)
    except ValueError:
        return f"'{text}"
    return text


def dataset_of(table: Table) -> Dataset:
    """The table as arrays over the tests, for the HDF5 file."""
    arrays: dict[str, Array] = {}
    for name, values in table.columns.items():
        if name == "test":
            continue
        stem, unit = match.groups() if (match := _HEADER.fullmatch(name)) else (name, "1")
        short = _distinct((_short(stem), _short(name)), {"test", *arrays})
        arrays[short] = Array(short, ("test",), values, unit, stem, optional=True)
    return Dataset((Axis("test", table.columns["test"], "1", "name of the test"),), tuple(arrays.values()))


def _short(text: str) -> str:
    return re.sub(r"[^A-Za-z0-9]+", "_", text).strip("_") or "_"


def _distinct(names: tuple[str, str], taken: Collection[str]) -> str:
    """The first of these names that is not taken; the last with a number behind it where both are."""
    numbered = (f"{names[-1]}_{number}" for number in count(2))
    return next(name for name in chain(names, numbered) if name not in taken)


def parquet_bytes(table: Table) -> bytes | None:
    """The table as Parquet; None where pyarrow is not installed."""
    if importlib.util.find_spec("pyarrow") is None:
        return None
    import pyarrow
    from pyarrow import parquet

    buffer = io.BytesIO()
    columns = {name: pyarrow.array(values.tolist()) for name, values in table.columns.items()}
    parquet.write_table(pyarrow.table(columns), buffer)
    return buffer.getvalue()
