"""Files as rigs write them: each is read right, or one message says what to set. None gives a wrong number silently.

One log in full sliding at mu = 0.5, unloaded at both ends, written in the manners of several makers of rigs.
"""

from __future__ import annotations

import gzip
import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import openpyxl
import pytest
from definitions import write
from test_rig_log import LOAD, MU, RADIUS, SLIDING, STEPS

from twindisc_cli.definition import load
from twindisc_cli.errors import MeasurementError

EVERY, IDLE = 2.0, 10
NAMES = ("time", "speed 1", "speed 2", "torque", "normal load")
UNITS = ("s", "rpm", "rpm", "N m", "N")
GERMAN = ("Zeit", "Drehzahl oben", "Drehzahl unten", "Drehmoment", "Normalkraft")
RENAMED = "\n".join(
    f'columns.{key.replace(" ", "_")} = {{ column = "{name}" }}' for key, name in zip(NAMES, GERMAN, strict=True)
)
RPM = np.pi / 30.0


def numbers() -> np.ndarray:
    """Rows of time [s], both speeds [rpm], torque [N m] and load [N]."""
    creepage = np.repeat(STEPS, (84, 84, 42))
    creepage = np.concatenate([np.full(IDLE, STEPS[0]), creepage, np.full(IDLE, STEPS[-1])])
    load_N = np.where((np.arange(len(creepage)) < IDLE) | (np.arange(len(creepage)) >= IDLE + 210), 0.0, LOAD)
    torque = MU * load_N * RADIUS + 1e-3 * np.sin(np.arange(len(creepage)))
    time = EVERY * np.arange(len(creepage))
    return np.column_stack([time, 3000 * (1 + creepage / 2), 3000 * (1 - creepage / 2), torque, load_N])


Cells = list[list[str]]


@dataclass(frozen=True)
class Manner:
    """How a maker writes: header, what is above and below, cells, signs and encoding."""

    header: Sequence[str] = tuple(f"{name} [{unit}]" for name, unit in zip(NAMES, UNITS, strict=True))
    above: Sequence[str] = ()
    units: Sequence[str] = ()
    below: Sequence[str] = ()
    scale: Sequence[float] = (1.0,) * 5
    change: Callable[[Cells], Cells] = lambda rows: rows
    delimiter: str = ";"
    mark: str = "."
    quote: str = ""
    newline: str = "\n"
    encoding: str = "utf-8"
    settings: str = ""
    file: str = '"log.csv"'
    rows: int = 230
    left: dict[str, int] = field(default_factory=dict)

    def cells(self) -> Cells:
        """The cells of the rows, as text."""
        rows = [[f"{value:.9g}" for value in row] for row in numbers() * self.scale]
        return self.change([[cell.replace(".", self.mark) for cell in row] for row in rows])

    def data(self) -> bytes:
        """The file."""
        table = [list(self.header), *([list(self.units)] if self.units else []), *self.cells()]
        lines = [self.delimiter.join(f"{self.quote}{cell}{self.quote}" for cell in row) for row in table]
        return self.newline.join([*self.above, *lines, *self.below]).encode(self.encoding)


@dataclass(frozen=True)
class Workbook(Manner):
    """The same as .xlsx, numbers as numbers."""

    def data(self) -> bytes:
        book = openpyxl.Workbook()
        for line in self.above:
            book.active.append([line])
        for row in [list(self.header), *([list(self.units)] if self.units else []), *self.cells()]:
            book.active.append([_value(cell) for cell in row])
        for line in self.below:
            book.active.append([line])
        buffer = io.BytesIO()
        book.save(buffer)
        return buffer.getvalue()


@dataclass(frozen=True)
class Packed(Manner):
    """The same as .gz."""

    def data(self) -> bytes:
        return gzip.compress(super().data())


def _value(cell: str) -> float | str:
    try:
        return float(cell)
    except ValueError:
        return cell


def stamps(form: Callable[[float], str]) -> Callable[[Cells], Cells]:
    return lambda rows: [[form(float(row[0])), *row[1:]] for row in rows]


def clock(seconds: float) -> str:
    return f"{int(seconds // 3600) % 24:02d}:{int(seconds // 60) % 60:02d}:{seconds % 60:04.1f}"


def at(rows: Sequence[int], column: int, text: str) -> Callable[[Cells], Cells]:
    return lambda cells: [
        [text if n in rows and m == column else cell for m, cell in enumerate(row)] for n, row in enumerate(cells)
    ]


def grouped(point: str, between: str) -> Callable[[Cells], Cells]:
    """Numbers with a sign between their thousands."""
    swap = str.maketrans({",": between, ".": point})
    return lambda rows: [[f"{float(cell):,.4f}".translate(swap) for cell in row] for row in rows]


def again(rows: Cells) -> Cells:
    """The header stands again above each block, with a line of its own."""
    head = [list(Manner().header)]
    return [*rows[:80], ["Block 2"], *head, *rows[80:150], [""], ["Block 3"], *head, *rows[150:]]


def cut(rows: Cells) -> Cells:
    """The last row ends inside its last number."""
    return [*([*row[:-1], f"{float(row[-1]):.2f}"] for row in rows[:-1]), [*rows[-1][:-1], "7"]]


def plus(*extra: str) -> Callable[[Cells], Cells]:
    return lambda rows: [[*row, *extra] for row in rows]


BARE = {"header": NAMES, "units": UNITS}
PREAMBLE = ("Wälzprüfstand 3", "Bediener: Müller", "Datum: 12.03.2024; Versuch 17", "")
READ: dict[str, Manner] = {
    "plain": Manner(),
    "comma": Manner(delimiter=","),
    "tab": Manner(delimiter="\t"),
    "decimal comma": Manner(mark=","),
    "decimal comma and tab": Manner(mark=",", delimiter="\t"),
    "quoted": Manner(quote='"'),
    "quoted decimal comma": Manner(quote='"', mark=","),
    "line ends of Windows": Manner(newline="\r\n"),
    "line ends of an old Mac": Manner(newline="\r"),
    "byte-order mark": Manner(encoding="utf-8-sig"),
    "UTF-16": Manner(encoding="utf-16"),
    "UTF-16 without a mark": Manner(encoding="utf-16-le"),
    "Windows-1252": Manner(above=PREAMBLE, encoding="cp1252"),
    "preamble": Manner(above=PREAMBLE),
    "preamble of a hundred lines": Manner(above=[f"Channel {n};gain {n / 7:.3f};offset 0" for n in range(100)]),
    "preamble in commas": Manner(above=["Test,17", "Load [N],72", "time,12:00"], delimiter=","),
    "sep=": Manner(above=["sep=;"]),
    "remarks": Manner(above=["# written by a logger", "#", ""], below=["# end"]),
    "units row": Manner(**BARE),
    "units row in brackets": Manner(header=NAMES, units=[f"[{unit}]" for unit in UNITS]),
    "units row in parentheses": Manner(header=NAMES, units=[f"({unit})" for unit in UNITS]),
    "preamble and units row": Manner(above=PREAMBLE, mark=",", **BARE),
    "name (unit)": Manner(header=[f"{n} ({u})" for n, u in zip(NAMES, UNITS, strict=True)]),
    "name / unit": Manner(header=[f"{n} / {u}" for n, u in zip(NAMES, UNITS, strict=True)]),
    "capitals and underscores": Manner(
        header=["TIME [s]", "Speed_1 [RPM]", "Speed_2 [1/min]", "Torque [Nm]", "Normal_Load [N]"]
    ),
    "kN, mN m, min": Manner(
        header=["time [min]", "speed 1 [rpm]", "speed 2 [rpm]", "torque [mN m]", "normal load [kN]"],
        scale=(1 / 60, 1, 1, 1e3, 1e-3),
    ),
    "N cm, Hz, ms": Manner(
        header=["time [ms]", "speed 1 [Hz]", "speed 2 [Hz]", "torque [Ncm]", "normal load [N]"],
        scale=(1e3, 1 / 60, 1 / 60, 1e2, 1),
    ),
    "speeds of the rims": Manner(
        header=["time [s]", "speed 1 [m/s]", "speed 2 [mm/s]", "torque [N mm]", "normal load [N]"],
        scale=(1, RPM * RADIUS, RPM * RADIUS * 1e3, 1e3, 1),
    ),
    "kilograms of force": Manner(
        header=["time [s]", "speed 1 [rpm]", "speed 2 [rpm]", "torque [N m]", "normal load [kgf]"],
        scale=(1, 1, 1, 1, 1 / 9.80665),
    ),
    "American units": Manner(
        header=["time [s]", "speed 1 [deg/s]", "speed 2 [ft/min]", "torque [lbf·in]", "normal load [lbf]"],
        scale=(1, 6, RPM * RADIUS / 0.00508, 1 / (0.0254 * 4.4482216152605), 1 / 4.4482216152605),
    ),
    "time of day": Manner(
        header=["time", *(f"{n} [{u}]" for n, u in zip(NAMES[1:], UNITS[1:], strict=True))],
        change=stamps(lambda t: clock(t + 36000)),
    ),
    "past midnight": Manner(change=stamps(lambda t: clock(t + 86300))),
    "date and time": Manner(change=stamps(lambda t: f"2024-03-{12 + int(t >= 100)} {clock((t + 86300) % 86400)}")),
    "German date": Manner(change=stamps(lambda t: f"12.03.2024 {clock(t + 3600).replace('.', ',')}"), mark=","),
    "German names": Manner(header=[f"{n} [{u}]" for n, u in zip(GERMAN, UNITS, strict=True)], settings=RENAMED),
    "German names without units": Manner(header=GERMAN, units=UNITS, mark=",", settings=RENAMED),
    "a unit to be said": Manner(
        header=[*Manner().header[:3], "torque", "normal load [N]"], scale=(1, 1, 1, 1e3, 1),
        settings='columns.torque = { unit = "N mm" }',
    ),
    "a sign to be said": Manner(scale=(1, 1, 1, -1, 1), settings="columns.torque = { sign = -1 }"),
    "more columns": Manner(header=[*Manner().header, "note", "ok"], change=plus("run 3, second", "True")),
    "trailing delimiters": Manner(change=plus("")),
    "blank lines": Manner(change=lambda rows: [cells for row in rows for cells in (row, [""])]),
    "stars for gaps": Manner(change=at((40, 41, 150), 3, "***"), left={"no number": 3}),
    "blanks for gaps": Manner(change=at((40, 41), 3, ""), left={"no number": 2}),
    "nan for gaps": Manner(change=at((40,), 3, "NaN"), left={"no number": 1}),
    "-999 for a load": Manner(change=at((5, 40, 41, 150), 4, "-999"), left={"no number": 4}),
    "-9999 for a torque": Manner(change=at((3, 40, 41), 3, "-9999"), left={"no number": 3}),
    "-99.99 for a speed": Manner(change=at((40, 41), 1, "-99.99"), left={"no number": 2}),
    "1e30 for a torque": Manner(change=at((40,), 3, "1e30"), left={"no number": 1}),
    "a marker of its own": Manner(change=at((40, 90, 91), 4, "77777"), left={"no number": 3}),
    "a declared marker": Manner(
        change=at((40, 90), 4, "-70"), left={"no number": 2}, file='{ file = "log.csv", skip = "-70" }'
    ),
    "a cut last line": Manner(change=cut, left={"cut off at the end": 1}),
    "a short last line": Manner(change=lambda rows: [*rows, ["470", "3"]], rows=231, left={"cut off at the end": 1}),
    "thousands in points": Manner(change=grouped(",", ".")),
    "thousands in commas": Manner(change=grouped(".", ",")),
    "thousands in apostrophes": Manner(change=grouped(".", "'")),
    "header again": Manner(change=again, left={"header again": 2, "head of a block": 2}, rows=234),
    "a header as a remark": Manner(header=["# time [s]", *Manner().header[1:]]),
    "packed": Packed(),
    "named by their place": Manner(
        header=["a", "b", "c", "d", "e"], units=UNITS,
        settings="\n".join(f'columns.{k.replace(" ", "_")} = {{ column = "#{n}" }}' for n, k in enumerate(NAMES, 1)),
    ),
    "ignored": Manner(
        header=[*Manner().header, "torque [N m]"], change=plus("3"),
        file='{ file = "log.csv", ignore = "#6" }',
    ),
    "twice the same": Manner(
        header=[*Manner().header, "torque [N m]"], change=lambda rows: [[*row, row[3]] for row in rows]
    ),
    "summary": Manner(below=["Mittelwert;3000;2985;1.08;72", "Ende"], rows=232, left={"summary at the end": 2}),
    "workbook": Workbook(),
    "workbook with all": Workbook(
        above=PREAMBLE[:3], below=["Ende der Messung"], rows=231, left={"summary at the end": 1}, **BARE
    ),
}  # fmt: skip
REFUSED: dict[str, tuple[Manner, str]] = {
    "unknown unit": (
        Manner(header=[*Manner().header[:3], "torque [slug V]", "normal load [N]"]),
        "log.csv:1: torque [slug V]: unknown unit [slug V] for torque; known: N m, N cm, N mm, mN m, kN m",
    ),
    "no units": (Manner(header=NAMES), "log.csv:1: torque: has no unit; write one of [N m, N cm, N mm, mN m, kN m]"),
    "other names": (
        Manner(header=[f"{n} [{u}]" for n, u in zip(GERMAN, UNITS, strict=True)]),
        "no column torque [N m]; the header has Zeit [s], Drehzahl oben [rpm], Drehzahl unten [rpm], Drehmoment [N m], "
        "Normalkraft [N]; name it under [measured.columns]",
    ),
    "decimal comma and commas": (Manner(delimiter=",", mark=","), "a decimal comma? put ; between the columns"),
    "mostly gaps": (Manner(change=at(range(20, 200), 3, "---")), "180 of 230 rows hold no numbers"),
    "a word for a number": (Manner(change=at((40,), 3, "low")), 'log.csv:42: torque [N m]: "low" is not a number'),
    "an open quote": (Manner(change=at((40,), 3, '"1.08')), "log.csv:42: a quote is opened here and not closed"),
    "twice": (Manner(header=[*Manner().header[:4], "torque [N m]"]), "torque [N m]: the column occurs twice"),
    "short rows": (Manner(change=lambda rows: [*rows[:9], rows[9][:3], *rows[10:]]), "log.csv:11: 3 cells where"),
    "times going back": (Manner(change=at((40,), 0, "3")), "log.csv:42: time [s]: time 3 is earlier"),
    "another magnitude": (
        Manner(header=[*Manner().header[:4], "normal load [kN]"]), "the load is 7.2e+04 N, the definition says 72 N"
    ),
}  # fmt: skip


def read(folder: Path, manner: Manner):  # type: ignore[no-untyped-def]
    (folder / "log.csv").write_bytes(manner.data())
    extra = f"\n[measured]\nlog = {manner.file}\ntorque_disc = 2\n{manner.settings}\n"
    return load(write(folder, SLIDING + extra))


@pytest.mark.parametrize("name", READ)
def test_a_messy_file_is_read_right(tmp_path: Path, name: str) -> None:
    manner = READ[name]
    test = read(tmp_path, manner)
    samples, (count,) = test.experiment.measured.traction, test.rows
    assert samples is not None
    np.testing.assert_allclose(samples.ratio, MU, rtol=2e-3)
    np.testing.assert_allclose(samples.creepage, np.array(STEPS)[samples.step], rtol=1e-6)
    assert np.all(np.bincount(samples.step) >= [38, 38, 18])
    assert count.read == manner.rows
    assert count.used + sum(count.left_out.values()) == count.read
    assert 2 * IDLE - 1 <= count.left_out["unloaded"] <= 2 * IDLE
    assert {reason: count.left_out[reason] for reason in manner.left} == manner.left
    zero = test.experiment.measured.torque_zero
    assert zero is not None
    assert abs(zero.value * zero.unit) < 1e-3


@pytest.mark.parametrize("name", REFUSED)
def test_a_messy_file_that_cannot_be_read_says_why(tmp_path: Path, name: str) -> None:
    manner, says = REFUSED[name]
    with pytest.raises(MeasurementError) as error:
        read(tmp_path, manner)
    assert says in str(error.value)


def test_guesses_are_said(tmp_path: Path) -> None:
    notes = read(tmp_path, READ["preamble and units row"]).rows[0].notes
    assert "header taken from line 5, below 3 others" in notes
    assert "units taken from line 6" in notes
    assert "time stamps, counted from the first" in read(tmp_path, READ["time of day"]).rows[0].notes
