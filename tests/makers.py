"""One test in full sliding at mu = 0.5, written as the logs of twelve makers and laboratories write it.

Every file holds the same: 20 s without load, steps of 2, 4 and 6 % under 72 N on discs of 30 mm, 20 s without load.
Nothing of the program is used.
"""

from __future__ import annotations

import gzip
import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import openpyxl

POUND = 4.4482216152605
MU, LOAD, RADIUS, RPM = 0.5, 72.0, 0.03, np.pi / 30.0
STEPS, SECONDS, IDLE = (0.02, 0.04, 0.06), (168, 168, 84), 20
SPEED = 3000.0 * RPM * RADIUS


def base() -> dict[str, np.ndarray]:
    """What was measured at 1 Hz: time [s], speeds [rpm], torque [N m], load [N], and what follows from them."""
    creepage = np.repeat((STEPS[0], *STEPS, STEPS[-1]), (IDLE, *SECONDS, IDLE))
    time = np.arange(len(creepage), dtype=float)
    loaded = (time >= IDLE) & (time < IDLE + sum(SECONDS))
    load = np.where(loaded, LOAD + 0.2 * np.sin(time), 0.02 * np.sin(time))
    torque = MU * np.where(loaded, load, 0.0) * RADIUS + 1e-3 * np.sin(1.7 * time)
    return {
        "t": time, "n1": 3000.0 * (1 + creepage / 2), "n2": 3000.0 * (1 - creepage / 2), "M": torque, "N": load,
        "slip": 100.0 * creepage, "mu": np.where(loaded, torque / (RADIUS * LOAD), 0.0), "F": torque / RADIUS,
        "v": np.full(len(time), SPEED), "T": 25.0 + 0.01 * time,
        "step": 1.0 + np.searchsorted((IDLE + 168, IDLE + 336), time, side="right"),
    }  # fmt: skip


@dataclass(frozen=True)
class File:
    """A file: its name, its bytes, and whether it is understood without being told; block: what to set in the block."""

    name: str
    data: bytes
    understood: bool = True
    block: tuple[tuple[str, str], ...] = ()


Column = tuple[str, str, str, float]
"""Name, unit, what it holds, and how many of that unit are one of ours."""
Change = Callable[[list[list[str]]], list[list[str]]]
SAME: Change = lambda rows: rows  # noqa: E731


def cells(columns: Sequence[Column], form: str = "{:.6g}") -> list[list[str]]:
    measured = base()
    return [[form.format(measured[key][n] * scale) for _, _, key, scale in columns] for n in range(len(measured["t"]))]


def text(
    columns: Sequence[Column], *, head: str = "{0} [{1}]", units: str = "", delimiter: str = ";", mark: str = ".",
    above: Sequence[str] = (), below: Sequence[str] = (), form: str = "{:.6g}", change: Change = SAME,
    newline: str = "\n", encoding: str = "utf-8",
) -> bytes:  # fmt: skip
    """A table as text; units: the form of a row of them below the header."""
    rows = change([[cell.replace(".", mark) for cell in row] for row in cells(columns, form)])
    header = [[head.format(name, unit) for name, unit, _, _ in columns]]
    header += [[units.format(unit) for _, unit, _, _ in columns]] if units else []
    lines = [*above, *(delimiter.join(row) for row in [*header, *rows]), *below]
    return (newline.join(lines) + newline).encode(encoding)


PLAIN: tuple[Column, ...] = (
    ("Time", "s", "t", 1), ("Speed upper", "rpm", "n1", 1), ("Speed lower", "rpm", "n2", 1), ("Torque", "Nm", "M", 1),
    ("Load", "N", "N", 1),
)  # fmt: skip
GERMAN: tuple[Column, ...] = (
    ("Zeit", "s", "t", 1), ("Drehzahl 1", "1/min", "n1", 1), ("Drehzahl 2", "1/min", "n2", 1),
    ("Drehmoment", "Ncm", "M", 100), ("Normalkraft", "kN", "N", 1e-3), ("Temp. Öl", "°C", "T", 1),
)  # fmt: skip
FRENCH: tuple[Column, ...] = (
    ("Temps", "s", "t", 1), ("Vitesse 1", "tr/min", "n1", 1), ("Vitesse 2", "tr/min", "n2", 1),
    ("Couple", "N.m", "M", 1), ("Force normale", "N", "N", 1),
)  # fmt: skip
AMERICAN: tuple[Column, ...] = (
    ("Elapsed Time", "min", "t", 1 / 60), ("Upper Speed", "rpm", "n1", 1), ("Lower Speed", "rpm", "n2", 1),
    ("Friction Torque", "lbf·in", "M", 1 / (0.0254 * POUND)), ("Normal Load", "lbf", "N", 1 / POUND),
)  # fmt: skip
MTM: tuple[Column, ...] = (
    ("Step Time", "s", "t", 1), ("Traction Coeff", "-", "mu", 1), ("Ball Load", "N", "N", 1),
    ("Rolling Speed", "mm/s", "v", 1e3), ("Sliding Speed", "mm/s", "v", 10), ("SRR", "%", "slip", 1),
)  # fmt: skip
FORCES: tuple[Column, ...] = (
    ("Timestamp", "s", "t", 1), ("Fz", "N", "N", 1), ("Fx", "N", "F", 1), ("Slip", "%", "slip", 1),
    ("Mean speed", "m/s", "v", 1),
)  # fmt: skip
SHORT: tuple[Column, ...] = (
    ("t", "s", "t", 1), ("n1", "rpm", "n1", 1), ("n2", "rpm", "n2", 1), ("Md", "Nm", "M", 1), ("Fn", "N", "N", 1),
)  # fmt: skip


def clock(seconds: float, *, half: bool = False) -> str:
    hour, minute, rest = int(seconds // 3600) % 24, int(seconds // 60) % 60, seconds % 60
    if half:
        return f"{(hour - 1) % 12 + 1}:{minute:02d}:{rest:04.1f} {'AM' if hour < 12 else 'PM'}"
    return f"{hour:02d}:{minute:02d}:{rest:06.3f}"


def stamped(form: Callable[[float], str]) -> Change:
    return lambda rows: [[form(float(row[0].replace(",", "."))), *row[1:]] for row in rows]


def put(rows: Sequence[int], column: int, cell: str) -> Change:
    return lambda table: [
        [cell if n in rows and m == column else old for m, old in enumerate(row)] for n, row in enumerate(table)
    ]


def more(*extra: str) -> Change:
    return lambda rows: [[*row, *extra] for row in rows]


def blocks(header: Sequence[str], above: Callable[[int], Sequence[Sequence[str]]], *, restart: bool) -> Change:
    """Three blocks, each below lines of its own and the header; restart: the time of each begins at 0."""

    def changed(rows: list[list[str]]) -> list[list[str]]:
        ends = (IDLE + 168, IDLE + 336, len(rows))
        out: list[list[str]] = []
        for number, (begin, end) in enumerate(zip((0, *ends[:-1]), ends, strict=True)):
            part = [list(row) for row in rows[begin:end]]
            for row in part:
                row[0] = f"{float(row[0]) - begin * restart:g}"
            out += part if number == 0 else [*(list(line) for line in above(number + 1)), list(header), *part]
        return out

    return changed


def workbook(columns: Sequence[Column], sheets: Sequence[str] = ("Data",), above: Sequence[str] = ()) -> bytes:
    """A workbook; the last of its sheets holds the data, the others remarks."""
    book = openpyxl.Workbook()
    book.remove(book.active)
    for name in sheets:
        sheet = book.create_sheet(name)
        for line in above:
            sheet.append([line])
        if name == sheets[-1]:
            sheet.append([f"{name_} [{unit}]" for name_, unit, _, _ in columns])
            for row in cells(columns):
                sheet.append([float(cell) for cell in row])
        else:
            sheet.append(["Operator", "Meyer"])
    buffer = io.BytesIO()
    book.save(buffer)
    return buffer.getvalue()


def tdms(columns: Sequence[Column]) -> bytes:
    """A .tdms as npTDMS writes it, the time in the increment."""
    from nptdms import ChannelObject, TdmsWriter

    buffer, measured = io.BytesIO(), base()
    with TdmsWriter(buffer) as writer:
        writer.write_segment([
            ChannelObject("Log", name, measured[key] * scale, {"unit_string": unit, "wf_increment": 1.0})
            for name, unit, key, scale in columns[1:]
        ])  # fmt: skip
    return buffer.getvalue()


def matlab(columns: Sequence[Column]) -> bytes:
    """A .mat as scipy writes it: one vector a column, with its unit."""
    from scipy.io import savemat

    buffer, measured = io.BytesIO(), base()
    names = {column: column[0].replace(" ", "_") for column in columns}
    vectors: dict[str, object] = {names[c]: measured[c[2]] * c[3] for c in columns}
    savemat(buffer, {**vectors, "units": {names[c]: c[1] for c in columns}})
    return buffer.getvalue()


def lvm(columns: Sequence[Column], *, comma: bool = False) -> bytes:
    """A .lvm as LabVIEW writes it, with one X column."""
    mark, count = "," if comma else ".", len(columns) - 1
    head = ["LabVIEW Measurement", "Writer_Version\t2", "Reader_Version\t2", "Separator\tTab",
            f"Decimal_Separator\t{mark}", "Multi_Headings\tNo", "X_Columns\tOne", "Time_Pref\tAbsolute",
            "***End_of_Header***", "", f"Channels\t{count}" + "\t" * count, "Samples" + "\t460" * count]  # fmt: skip
    head += ["\t".join(["Y_Unit_Label", *(c[1] for c in columns[1:])]), "X_Dimension" + "\tTime" * count,
             "X0" + f"\t0{mark}0" * count, "Delta_X" + f"\t1{mark}0" * count, "***End_of_Header***",
             "\t".join(["X_Value", *(c[0] for c in columns[1:]), "Comment"])]  # fmt: skip
    return "\n".join([*head, *("\t".join(row).replace(".", mark) for row in cells(columns, "{:.7f}"))]).encode() + b"\n"


def pcs(number: int) -> list[list[str]]:
    return [[""], [f'Step {number} "traction" started at 12/03/2024 10:0{number}'], ["Step type", "TRACTION"]]


PCS_HEAD = ("MTM211 Test Data File", "Profile description:\tTraction", "Number of steps in profile:\t3", "",
            'Step 1 "traction" started at 12/03/2024 10:01', "Step type\tTRACTION")  # fmt: skip
MTM_HEADER = [f"{name} ({unit})" for name, unit, _, _ in MTM]
UMT_HEADER = [f"{name} [{unit}]" for name, unit, _, _ in FORCES]
SURNAMES = ["Prüfer: Müller", "Wälzprüfstand 3"]


def messy() -> dict[str, File]:
    """Every file, by what is special in it."""
    made: dict[str, File] = {}

    def add(what: str, name: str, data: bytes, *, understood: bool = True, **block: str) -> None:
        made[what] = File(name, data, understood, tuple(block.items()))

    add(
        "PCS MTM, three steps",
        "mtm.txt",
        text(MTM, head="{0} ({1})", delimiter="\t", above=PCS_HEAD, change=blocks(MTM_HEADER, pcs, restart=True)),
    )
    add("PCS MTM, one step", "mtm.txt", text(MTM, head="{0} ({1})", delimiter="\t", above=PCS_HEAD, newline="\r\n"))
    etm = ("ETM101 Test Data File", *PCS_HEAD[1:])
    add("PCS ETM", "etm.txt", text(MTM, head="{0} ({1})", delimiter="\t", above=etm, newline="\r\n"))
    add(
        "PCS MTM, empty columns",
        "mtm.txt",
        text(
            (*MTM, ("Pin Load", "N", "N", 1)),
            head="{0} ({1})",
            delimiter="\t",
            above=PCS_HEAD,
            change=lambda rows: [[*row[:-1], ""] for row in rows],
        ),
    )
    add(
        "Bruker UMT, blocks",
        "umt.txt",
        text(
            FORCES,
            delimiter="\t",
            above=("UMT test 12", "Step 1"),
            change=blocks(UMT_HEADER, lambda n: [[""], [f"Step {n}"]], restart=True),
        ),
    )
    add("Bruker UMT, units below", "umt.txt", text(FORCES, head="{0}", units="{0}", delimiter="\t"))
    add("Bruker UMT, columns below each other", "umt.txt", text(FORCES, delimiter="   ", form="{:12.6f}"))
    add("Rtec, commas", "rtec.csv", text(FORCES, delimiter=",", head="{0} ({1})"))
    add(
        "Rtec, AM and PM",
        "rtec.csv",
        text(FORCES, delimiter=",", head="{0} ({1})", change=stamped(lambda t: clock(t + 43000, half=True))),
    )
    add(
        "Rtec, date with AM and PM",
        "rtec.csv",
        text(
            FORCES,
            delimiter=",",
            head="{0} ({1})",
            change=stamped(lambda t: f"3/12/2024 {clock(t + 43000, half=True)}"),
        ),
    )
    add("Optimol, German", "srv.txt", text(GERMAN, delimiter="\t", mark=",", above=SURNAMES, encoding="cp1252"))
    add("Optimol, UTF-16", "srv.txt", text(GERMAN, delimiter="\t", mark=",", above=SURNAMES, encoding="utf-16"))
    add("Optimol, units row", "srv.txt", text(GERMAN, head="{0}", units="[{0}]", mark=",", encoding="cp1252"))
    add(
        "Amsler, thousands",
        "amsler.csv",
        text(
            GERMAN,
            mark=".",
            form="{:,.3f}",
            change=lambda rows: [
                [c.replace(",", "_").replace(".", ",").replace("_", ".") for c in row] for row in rows
            ],
        ),
    )
    add(
        "Amsler, means at the end",
        "amsler.csv",
        text(GERMAN, mark=",", below=("Mittelwert;3000;2900;108;0,072;27", "Ende der Messung"), encoding="cp1252"),
    )
    add("catman, stars", "catman.asc", text(GERMAN, delimiter="\t", mark=",", change=put((50, 51, 300), 3, "******")))
    add(
        "catman, overflow",
        "catman.asc",
        text(GERMAN, delimiter="\t", mark=",", change=put((50, 51, 300), 3, "1,0E+30")),
    )
    add("SUROS, tab", "suros.dat", text(PLAIN, delimiter="\t"))
    add("SUROS, gz", "suros.dat.gz", gzip.compress(text(PLAIN, delimiter="\t")))
    add(
        "SUROS, comments in the middle",
        "suros.dat",
        text(PLAIN, delimiter="\t", change=lambda rows: [*rows[:90], ["# operator left"], *rows[90:]]),
    )
    add(
        "SUROS, header again",
        "suros.csv",
        text(PLAIN, change=lambda rows: [*rows[:200], [f"{n} [{u}]" for n, u, _, _ in PLAIN], *rows[200:]]),
    )
    add("SUROS, cut at the end", "suros.csv", text(PLAIN, form="{:.3f}")[:-4])
    add("SUROS, cut in a row", "suros.csv", text(PLAIN, form="{:.3f}")[:-14])
    add("SUROS, -999 for a load", "suros.csv", text(PLAIN, change=put((3, 4, 99, 100, 300), 4, "-999")))
    add("SUROS, -9999 for a torque", "suros.csv", text(PLAIN, change=put((3, 4, 99, 300), 3, "-9999")))
    add(
        "SUROS, -99.99 everywhere",
        "suros.csv",
        text(PLAIN, change=lambda rows: [row if n % 40 else [row[0], *["-99.99"] * 4] for n, row in enumerate(rows)]),
    )
    add("SUROS, empty cells", "suros.csv", text(PLAIN, change=put((3, 99, 300), 3, "")))
    add("SUROS, zeros for a torque", "suros.csv", text(PLAIN, change=put((60, 99, 100, 160, 300, 400), 3, "0")))
    add(
        "SUROS, a clock that begins anew",
        "suros.csv",
        text(PLAIN, change=lambda rows: [[f"{n if n < 250 else n - 250}", *row[1:]] for n, row in enumerate(rows)]),
    )
    add(
        "SUROS, more columns",
        "suros.csv",
        text((*PLAIN, ("AE RMS", "V", "T", 1), ("Vibration", "g", "T", 0.1)), change=SAME),
    )
    add(
        "SUROS, words beside",
        "suros.csv",
        text((*PLAIN, ("Remark", "", "T", 1)), change=lambda rows: [[*row[:-1], "ok"] for row in rows]),
    )
    add("SUROS, unnamed columns", "suros.csv", text(PLAIN, change=more("3", "")).replace(b"Load [N]", b"Load [N];;"))
    add("SUROS, twice the time", "suros.csv", text((*PLAIN, PLAIN[0])))
    add("LabVIEW, .lvm", "rig.lvm", lvm(PLAIN))
    add("LabVIEW, .lvm with commas", "rig.lvm", lvm(PLAIN, comma=True))
    add("LabVIEW, .tdms", "rig.tdms", tdms(PLAIN))
    add("MATLAB", "rig.mat", matlab(PLAIN))
    add("Excel", "rig.xlsx", workbook(PLAIN))
    add("Excel, second sheet", "rig.xlsx", workbook(PLAIN, ("Info", "Run 3"), above=("Rig 3", "")))
    add("French", "essai.csv", text(FRENCH, mark=",", encoding="cp1252"))
    add("French, UTF-8 with a mark", "essai.csv", text(FRENCH, mark=",", encoding="utf-8-sig", head="{0} ({1})"))
    add("American units", "falex.csv", text(AMERICAN, delimiter=",", head="{0} ({1})", form="{:.9g}"))
    add(
        "American units, quoted thousands",
        "falex.csv",
        text(AMERICAN, delimiter=",", head="{0} ({1})", form='"{:,.4f}"'),
    )
    add(
        "Keysight, ISO time with zone",
        "daq.csv",
        text(
            PLAIN,
            delimiter=",",
            encoding="utf-16",
            change=stamped(
                lambda t: f"2024-10-27T{clock(t + 10700)}+02:00" if t < 200 else f"2024-10-27T{clock(t + 7100)}+01:00"
            ),
        ),
    )
    add("Keysight, past midnight", "daq.csv", text(PLAIN, delimiter=",", change=stamped(lambda t: clock(t + 86300))))
    add(
        "numpy, remark as header",
        "rig.dat",
        text(PLAIN, delimiter=", ", head="{0} [{1}]").replace(b"Time", b"# Time", 1),
    )
    add("short names", "rig.csv", text(SHORT))
    add("short names, underscores", "rig.csv", text(SHORT, head="{0}_{1}"))
    add("Apple, old line ends", "rig.csv", text(PLAIN, newline="\r"))
    add("columns with commas and blanks", "rig.csv", text(PLAIN, delimiter=" ; "))
    add("minus signs", "rig.csv", text(PLAIN).replace(b"-", "−".encode()))
    add(
        "force in place of torque",
        "rig.csv",
        text((PLAIN[0], PLAIN[1], PLAIN[2], ("Friction force", "N", "F", 1), PLAIN[4])),
    )
    # refused, with a block that works
    add("no units", "rig.csv", text(PLAIN, head="{0}"), understood=False)
    add(
        "a load by another name",
        "rig.csv",
        text((*PLAIN[:3], ("Traction coefficient", "1", "mu", 1), ("Anpressung W", "kN", "N", 1e-3))),
        understood=True,
    )
    add("torque by another name", "rig.csv", text((*PLAIN[:3], ("M_R Welle", "", "M", 1), PLAIN[4])), understood=False)
    add(
        "speeds by other names",
        "rig.csv",
        text((PLAIN[0], ("Motor A", "", "n1", 1), ("Motor B", "", "n2", 1), *PLAIN[3:])),
        understood=False,
    )
    add(
        "Russian",
        "rig.csv",
        text(
            (
                ("Время", "s", "t", 1),
                ("Верх", "rpm", "n1", 1),
                ("Низ", "rpm", "n2", 1),
                ("Момент", "N m", "M", 1),
                ("Сила", "N", "N", 1),
            ),
            encoding="utf-8",
        ),
    )
    add("time without a name", "rig.csv", text(PLAIN).replace(b"Time [s]", b"[s]"))
    add("two torques", "rig.csv", text((*PLAIN, ("Torque", "Nm", "T", 1))), understood=False)
    add(
        "slip without a unit",
        "rig.csv",
        text((PLAIN[0], ("Slip", "", "slip", 1), ("Mean speed", "m/s", "v", 1), ("COF", "", "mu", 1), PLAIN[4])),
        understood=False,
    )
    add("two sheets that fit", "rig.xlsx", _twice(), understood=False)
    return made  # fmt: skip


def _twice() -> bytes:
    """A workbook with the same log twice."""
    book = openpyxl.load_workbook(io.BytesIO(workbook(PLAIN, ("Run 1",))))
    book.copy_worksheet(book["Run 1"]).title = "Run 2"
    buffer = io.BytesIO()
    book.save(buffer)
    return buffer.getvalue()
