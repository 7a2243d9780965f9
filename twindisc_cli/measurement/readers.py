"""Readers of the formats that are no plain text: workbooks, LabVIEW, MATLAB, profilometers, through their libraries.

Each gives the parts of a file (sheets, groups, variables), one of which is chosen by `sheet` of the definition.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from io import BytesIO
from pathlib import PurePath
from typing import Any

import numpy as np

from twindisc_cli.errors import MeasurementError, Problem, did_you_mean
from twindisc_cli.measurement.content import Content
from twindisc_cli.measurement.profilometers import across, profilometer
from twindisc_cli.measurement.sheet import Floats, Sheet

_ZIP, _OLE, _TDMS, _MAT = b"PK\x03\x04", b"\xd0\xcf\x11\xe0", b"TDSm", b"MATLAB 5.0 MAT-file"
_HDF5 = b"\x89HDF\r\n\x1a\n"
_LVM = b"LabVIEW Measurement"
_TIME = re.compile(r"\s*(time|zeit|temps|tiempo|tempo|x_value)\b", re.IGNORECASE)


def parts_of(content: Content, file: str) -> Sequence[Sheet] | None:
    """The parts of a file that is no plain text, of several that which is named; None for plain text.

    MeasurementError where the file is damaged, its reader is not installed, or there is no part of the name.
    """
    reader = _reader(content.data, PurePath(file).suffix.casefold())
    if reader is None:
        return None
    what, read = reader
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            parts = list(read(content.data))
    except ImportError as error:
        message = (
            f"is {what}: install twindisc with [rigs] to read it ({error.name} is missing), or export the data as CSV"
        )
        raise MeasurementError(Problem(message, file)) from None
    except MemoryError:
        raise
    except Exception as error:  # a library's own errors are of any kind
        message = f"is {what} that cannot be read: {str(error)[:200] or type(error).__name__}; export the data as CSV"
        raise MeasurementError(Problem(message, file)) from None
    if not parts:
        raise MeasurementError(Problem(f"is {what} without any data", file))
    return _chosen(parts, content.sheet, file)


def _chosen(parts: Sequence[Sheet], name: str | None, file: str) -> Sequence[Sheet]:
    """The part of a name; a file of a single part needs none."""
    if name is None:
        return parts
    mine = [part for part in parts if part.part == name]
    if not mine:
        names = list(dict.fromkeys(part.part for part in parts))
        message = f"has no part {name}{did_you_mean(name, names)}; it has {', '.join(names)}"
        raise MeasurementError(Problem(message, file, 0, "sheet"))
    return mine


def _reader(data: bytes, suffix: str) -> tuple[str, Callable[[bytes], Iterable[Sheet]]] | None:
    """What a file is and who reads it, by its first bytes, of profilometers by its name."""
    if data.startswith(_ZIP) and b"main.xml" in data[:4096]:
        suffix = ".x3p"
    if read := profilometer(data, suffix):
        return "the file of a profilometer", lambda data: [_grid(*across(*read(data)))]
    if data.startswith((_ZIP, _OLE)):
        return "a workbook", _workbook
    if data.startswith(_TDMS):
        return "a LabVIEW .tdms file", _tdms
    if data.startswith(_MAT):
        return "a MATLAB file", _matlab
    if data.startswith(_HDF5) or data[512:520] == _HDF5:
        return "a MATLAB file of version 7.3", _matlab_73
    if data.startswith(_LVM):
        return "a LabVIEW .lvm file", _lvm
    return None


def _workbook(data: bytes) -> Iterator[Sheet]:
    """The sheets of .xlsx, .xls, .xlsb and .ods."""
    from python_calamine import CalamineWorkbook

    book = CalamineWorkbook.from_filelike(BytesIO(data))
    for name in book.sheet_names:
        rows = book.get_sheet_by_name(name).to_python(skip_empty_area=False)
        cells = {n: [_text(cell) for cell in row] for n, row in enumerate(rows, start=1)}
        if any(any(row) for row in cells.values()):
            yield Sheet([], 0, cells=cells, part=name)


def _text(cell: Any) -> str:
    """A cell as it would stand in a text; whole numbers without decimals, as a logger writes them."""
    if isinstance(cell, bool):
        return str(cell)
    if isinstance(cell, (int, float)):
        return str(int(cell)) if float(cell).is_integer() and abs(cell) < 1e15 else repr(float(cell))
    if hasattr(cell, "total_seconds"):
        return _clock(cell.total_seconds())
    return cell.isoformat(sep=" ") if hasattr(cell, "date") else str(cell).strip()


def _clock(seconds: float) -> str:
    minutes, rest = divmod(seconds, 60.0)
    return f"{int(minutes // 60):02d}:{int(minutes % 60):02d}:{rest:09.6f}"


def _tdms(data: bytes) -> Iterator[Sheet]:
    """The groups of a LabVIEW .tdms file; where no channel is a time, it is that of the first one's increment."""
    from nptdms import TdmsFile

    with TdmsFile.open(BytesIO(data)) as file:
        for group in file.groups():
            channels = [channel for channel in group.channels() if len(channel)]
            columns = {_named(c.name, str(c.properties.get("unit_string", ""))): _plain(c[:]) for c in channels}
            lengths = {len(values) for values in columns.values()}
            has_time = any(_TIME.match(name) for name in columns)
            if channels and not has_time and "wf_increment" in channels[0].properties:
                step, start = (float(channels[0].properties.get(k, 0.0)) for k in ("wf_increment", "wf_start_offset"))
                columns = {"time [s]": _steady(start, step, max(lengths)), **columns}
            if columns:
                yield _grid(columns, part=group.name)


def _plain(values: Any) -> Floats:
    """Numbers; time stamps as seconds from the first."""
    values = np.asarray(values)
    if values.dtype.kind == "M":
        return np.asarray((values - values[0]) / np.timedelta64(1, "s"), dtype=np.float64)
    return np.asarray(values, dtype=np.float64) if values.dtype.kind in "biuf" else np.full(len(values), np.nan)


def _steady(start: float, step: float, count: int) -> Floats:
    """The times of samples of one rate [s]."""
    return np.asarray(start + step * np.arange(count), dtype=np.float64)


def _named(name: str, unit: str) -> str:
    """A header cell; the unit is put behind a name that has none."""
    unit = unit.strip()
    written = re.search(r"[\[(]([^\])]*)[\])]\s*$", name)
    return f"{name} [{unit}]" if unit and not (written and written[1].strip() == unit) else name


def _grid(columns: Mapping[str, Floats], notes: tuple[str, ...] = (), part: str = "") -> Sheet:
    """Columns of numbers beside each other; shorter ones end in gaps."""
    length = max(len(values) for values in columns.values())
    numbers = np.full((length, len(columns)), np.nan)
    for place, values in enumerate(columns.values()):
        numbers[: len(values), place] = values
    return Sheet(list(columns), 0, numbers=numbers, part=part, notes=notes)


def _matlab(data: bytes) -> Iterator[Sheet]:
    """The variables of a MATLAB file: vectors of one length beside each other, each structure a part of its own."""
    from scipy.io import loadmat

    stream: Any = BytesIO(data)
    content = loadmat(stream, squeeze_me=True, struct_as_record=True)
    yield from _variables({name: value for name, value in content.items() if not name.startswith("__")}, "")


def _variables(content: Mapping[str, Any], part: str) -> Iterator[Sheet]:
    """Vectors by name; a matrix with its names beside it in `names`, `header` or `labels`."""
    vectors: dict[str, Floats] = {}
    labels = next((value for name, value in content.items() if name.casefold() in ("names", "header", "labels")), None)
    units = _units(content)
    for name, value in content.items():
        array = np.asarray(value)
        if array.dtype.names and array.ndim == 0:
            yield from _variables({field: array[field].item() for field in array.dtype.names}, name)
        elif array.ndim == 1 and array.dtype.kind in "biuf" and len(array) > 1:
            vectors[_named(name, units.get(name, ""))] = array.astype(np.float64)
        elif (
            array.ndim == 2 and array.dtype.kind in "biuf" and labels is not None and np.size(labels) == array.shape[1]
        ):
            cells = [str(label).strip() for label in np.ravel(labels)]
            yield Sheet(cells, 0, numbers=array.astype(np.float64), part=part or name)
    if vectors:
        yield _grid(vectors, part=part)


def _units(content: Mapping[str, Any]) -> Mapping[str, str]:
    """Units by variable where a structure `units` names them."""
    value = content.get("units", content.get("unit"))
    array = np.asarray(value)
    return {field: str(array[field].item()) for field in array.dtype.names or ()} if value is not None else {}


def _matlab_73(data: bytes) -> Iterator[Sheet]:
    """The variables of a MATLAB file of version 7.3, which is HDF5."""
    import h5py

    stream: Any = BytesIO(data)
    with h5py.File(stream) as file:
        yield from _group(file, "")


def _group(group: Any, part: str) -> Iterator[Sheet]:
    vectors = {}
    for name, item in group.items():
        if name.startswith("#"):
            continue
        if hasattr(item, "items"):
            yield from _group(item, name)
        elif item.dtype.kind in "biuf" and max(item.shape, default=0) == item.size > 1:
            vectors[_named(name, str(item.attrs.get("units", "")))] = np.ravel(item[()]).astype(np.float64)
    if vectors:
        yield _grid(vectors, part=part)


def _lvm(data: bytes) -> Iterator[Sheet]:
    """The segments of a LabVIEW .lvm file; the time of one without is that of its increment."""
    import lvm_read

    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("cp1252", errors="replace")
    if "Decimal_Separator" not in text[:2000] and re.search(r"\n[-+]?\d*,\d+(\t|\s*\n)", text):
        text = text.replace("\n", "\nDecimal_Separator\t,\n", 1)
    content = lvm_read.read_str(text)
    count = content["Segments"]
    for n in range(count):
        yield _segment(content[n], content, f"segment {n + 1}" if count > 1 else "")


def _segment(segment: Mapping[str, Any], head: Mapping[str, Any], part: str) -> Sheet:
    names, numbers = [str(name).strip() for name in segment["Channel names"]], segment["data"]
    units = list(segment.get("Y_Unit_Label", ()))
    with_x = head.get("X_Columns", "One") != "No"
    columns: dict[str, Floats] = {}
    dimension = next(iter(segment.get("X_Dimension", ())), "Time")
    clock = "time [s]" if dimension in ("Time", "") else dimension
    for place, name in enumerate(names[: numbers.shape[1]]):
        values = numbers[:, place]
        if name == "X_Value":
            if clock in columns and not np.array_equal(columns[clock], values, equal_nan=True):
                raise ValueError("its channels have clocks of their own; write one X column")
            columns[clock] = values
        elif name != "Comment":
            label = place - with_x
            columns[_unique(_named(name, units[label] if 0 <= label < len(units) else ""), columns)] = values
    if clock not in columns:
        start, step = (float(segment.get(key, [0.0])[0] or 0.0) for key in ("X0", "Delta_X"))
        columns = {clock: _steady(start, step, len(numbers)), **columns}
    return _grid(columns, part=part)


def _unique(name: str, there: Mapping[str, Floats]) -> str:
    return next(n for n in (name, *(f"{name} {k}" for k in range(2, 10_000))) if n not in there)
