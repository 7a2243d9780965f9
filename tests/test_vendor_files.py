"""Files of real instruments (tests/vendor/README.md), read against numbers taken from them by eye."""

from __future__ import annotations

import io
import json
import re
import struct
import zipfile
from collections.abc import Callable
from functools import partial
from itertools import takewhile
from pathlib import Path

import makers
import numpy as np
import pytest
from test_import import command

from twindisc_cli.definition import load

HERE = Path(__file__).parent / "vendor"


def imported(name: str, folder: Path, capsys: pytest.CaptureFixture[str], *more: Path) -> tuple[int, str, str]:
    return command("import", HERE / name, *more, "-o", folder, "--json", capsys=capsys)


def table(file: Path) -> np.ndarray:
    return np.loadtxt(file, delimiter=",", skiprows=1, ndmin=2)


PROFILES: dict[str, tuple[int, tuple[float, float], tuple[float, float]]] = {
    # rows, first and last place [mm] and height [um]
    "csv-1.csv": (8, (0.0386e-3, 2.10425), (0.3089e-3, 1.94981)),
    "csv-2.csv": (8, (-99.9583333333333e-3, -1.427432857434913), (-99.375e-3, -1.427432857434913)),
    "csv-3.csv": (8, (-99.9583333333333e-3, -1.42743285743491), (-99.375e-3, -1.42743285743491)),
    "dektak-1.csv": (9600, (0.0, -0.00933), (1.4998, 16.58112)),
    "mitutoyo_mock.xlsx": (960, (0.0005, 0.303327568640866), (0.48, -0.142267785307721)),
    "sdf-1.sdf": (7, (0.5e-3, 0.9933875), (6.5e-3, 0.9933875)),
    "gwyddion-export-english.txt": (4, (5678.9e-6 / 8, 5.5e6 / 3), (5678.9e-6 * 7 / 8, 9e6)),
    "gwyddion-export-german.txt": (4, (5678.9e-6 / 8, 5.5e6 / 3), (5678.9e-6 * 7 / 8, 9e6)),
}


@pytest.mark.parametrize("name", PROFILES)
def test_a_profile_alone_is_a_profile(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows, first, last = PROFILES[name]
    code, out, err = imported(name, tmp_path, capsys)
    assert code == 0, err
    assert [Path(file).name for file in json.loads(out)["tables"]] == ["profile.csv"]
    found = table(tmp_path / "profile.csv")
    assert len(found) == rows
    np.testing.assert_allclose(found[[0, -1]], [first, last], rtol=1e-7, atol=1e-12)


def test_two_columns_without_a_header_are_named_by_the_block(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, _, err = imported("xy-1.txt", tmp_path, capsys)
    assert code == 3
    block = tmp_path / "block.toml"
    block.write_text(err[err.index("[measured]") :].replace('"mm"', '"um"'))
    code, _, err = imported("xy-1.txt", tmp_path, capsys, block)
    assert code == 0, err
    found = table(tmp_path / "profile.csv")
    np.testing.assert_allclose(found[[0, -1]], [(13.381669e-3, 17.854970), (200.5721e-3, 22.442971)])


def test_a_temperature_alone_is_a_temperature(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, _, err = imported("with_comments.lvm", tmp_path, capsys)
    assert code == 0, err
    found = table(tmp_path / "temperature.csv")
    assert len(found) == 9
    np.testing.assert_allclose(found[[0, 1, -1]], [(0.0, 5.479238), (0.328878, 5.310735), (9.723275, 5.407475)])


def test_traction_of_an_mtm(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, out, err = imported("pcs_demo_5.txt", tmp_path, capsys)
    assert code == 0, err
    assert json.loads(out)["rows"][0]["used"] == 1000
    found = table(tmp_path / "traction.csv")  # time, step, creepage, traction ratio
    np.testing.assert_allclose(found[:4, 3], [0.0955, 0.0881, 0.0871, 0.0848])
    np.testing.assert_allclose(found[:3, 2], [100.196, 99.993, 99.696])
    np.testing.assert_allclose(np.diff(found[:, 0]), 10.0)
    text = (tmp_path / "pcs_demo_5.toml").read_text()
    assert "normal_load_N = 19.9" in text or "normal_load_N = 20.0" in text
    assert "rolling_speed_m_s = 0.1" in text


def test_friction_of_a_pin_on_a_disc(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, out, err = imported("te67_PPS30PTFE_60N_1.tsv", tmp_path, capsys)
    assert code == 0, err
    rows = json.loads(out)["rows"][0]
    assert rows["left_out"]["standing still"] == 2
    assert rows["used"] + sum(rows["left_out"].values()) == 3602
    lines = (HERE / "te67_PPS30PTFE_60N_1.tsv").read_text().splitlines()
    cells = [line.split("\t") for line in lines if line.startswith("\t1")]
    mu = np.array([float(row[15].replace(",", ".")) for row in cells])
    found = table(tmp_path / "traction.csv")
    np.testing.assert_allclose(np.median(found[:, 3]), np.median(mu), rtol=1e-4)
    np.testing.assert_allclose(found[100:3500, 3].mean(), mu[107:3507].mean(), rtol=1e-3)
    np.testing.assert_allclose(found[:, 2], 200.0)
    assert "normal_load_N = 59.84" in (tmp_path / "te67_PPS30PTFE_60N_1.toml").read_text()


REAL = ("xy-1.txt", "with_comments.lvm", "pcs_demo_5.txt", "te67_PPS30PTFE_60N_1.tsv")
"""Those with a test of their own, above."""
OTHERS = {
    "pcs_demo_2.txt": "is the thickness of a film over the rolling speed (PCS EHD)",
    "pcs_demo_3.txt": "is the thickness of a film over the rolling speed (PCS EHD)",
    "pcs_demo_12.txt": "is the thickness of a film over the rolling speed (PCS EHD)",
    "pcs_demo_10.txt": "is a map of pixels with the thickness of a film (PCS SLIM mapper)",
    "pcs_demo_11.txt": "is a map of pixels with the thickness of a film (PCS SLIM mapper)",
    "pcs_demo_4.txt": "is a calibration of colours to the thickness of a film (PCS mapper)",
    "pcs_demo_6.txt": "is a calibration of colours to the thickness of a film (PCS mapper)",
    "multi_time_column.lvm": "It holds time [s], Voltage [Volts], Acceleration [g]: nothing",
    "no_decimal_separator.lvm": "It holds time [s], ax [g], ay [g], az [g]: nothing",
    "short.lvm": "It holds time [s], Excitation (Trigger) [Newtons], Response (Trigger) [m/s^2]: nothing",
    "short_new_line_end.lvm": "It holds time [s], Excitation (Trigger) [Newtons], Response (Trigger) [m/s^2]: nothing",
    "with_empty_fields.lvm": "It holds time [s], Dev0/Ai0, Dev0/Ai2, Dev0/Ai0 1: nothing",
}


@pytest.mark.parametrize("name", OTHERS)
def test_what_is_none_of_ours_is_named(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, _, err = imported(name, tmp_path, capsys)
    assert code == 3
    assert OTHERS[name] in err
    assert list(tmp_path.iterdir()) == []


def test_every_real_file_is_tried() -> None:
    tried = {*PROFILES, *OTHERS, *REAL}
    assert tried == {file.name for file in HERE.iterdir()} - {"README.md"}
    assert len(tried) == 24


def groove() -> np.ndarray:
    """A map of heights [um], 5 rows of 40 places, with a track along the rows' direction of change."""
    x = np.arange(40.0)
    return np.tile(-6.0 * np.clip(1.0 - ((x - 20.0) / 8.0) ** 2, 0.0, None), (5, 1)) + 0.01 * np.arange(5)[:, None]


def by_library(suffix: str) -> bytes:
    """The map as surfalize writes it."""
    surfalize, buffer = pytest.importorskip("surfalize"), io.BytesIO()
    surfalize.Surface(groove(), 50.0, 50.0).save(buffer, format=suffix)
    return buffer.getvalue()


def plu() -> bytes:
    """The map as Sensofar's .plu is laid out (Gwyddion, modules/file/sensofar.c): date, remark, axes, settings, map."""
    date = b"Sun Nov 22 10:00:00 2026".ljust(128, b"\0") + struct.pack("<I", 0)
    axes = struct.pack("<IIIfffffff", 5, 40, 0, 0.0, 50.0, 50.0, 0.0, 0.0, 0.0, 0.0)
    settings = struct.pack("<10IdfII8BI", 3, 0, 0, 0, 3, 40, 5, 40, 5, 0, 0.1, 10.0, 1, 0, *[0, 1, 0, 0, 0, 0, 0, 0], 1)
    head = date + b"a comment".ljust(256, b"\0") + axes + settings
    assert len(head) == 500
    return head + struct.pack("<II", 5, 40) + groove().astype("<f4").tobytes() + struct.pack("<ff", -6.0, 0.04)


def opd() -> bytes:
    """The map as Wyko's .opd is laid out (Gwyddion, modules/file/opdfile.c): a directory of blocks, then the blocks.

    Heights are in wavelengths [nm], column by column from below; the pixel is in mm.
    """
    wavelength = 600.0
    columns = (groove()[::-1] * 1e3 / wavelength).T.astype("<f4")
    blocks = {
        "RAW_DATA": (3, struct.pack("<HHH", 40, 5, 4) + columns.tobytes()),
        "Wavelength": (7, struct.pack("<f", wavelength)), "Pixel_size": (7, struct.pack("<f", 0.05)),
        "Aspect": (7, struct.pack("<f", 1.0)), "Title": (5, b"a track".ljust(20, b"\0")),
    }  # fmt: skip

    def entry(name: str, kind: int, size: int) -> bytes:
        return name.encode().ljust(16, b"\0") + struct.pack("<HIH", kind, size, 0xFFFF)

    directory = entry("Directory", 1, 24 * (len(blocks) + 1))
    directory += b"".join(entry(name, kind, len(data)) for name, (kind, data) in blocks.items())
    return b"\x01\x00" + directory + b"".join(data for _, data in blocks.values())


MAPS: dict[str, Callable[[], bytes]] = {
    **{suffix: partial(by_library, suffix) for suffix in (".x3p", ".al3d", ".sur", ".sdf")}, ".plu": plu, ".opd": opd,
}  # fmt: skip


@pytest.mark.parametrize("suffix", MAPS)
def test_maps_of_profilometers(suffix: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Written by their library, or byte by byte after the published layout."""
    pytest.importorskip("surfalize")
    (tmp_path / f"map{suffix}").write_bytes(MAPS[suffix]())
    code, out, err = command("import", tmp_path / f"map{suffix}", "-o", tmp_path / "to", "--json", capsys=capsys)
    assert code == 0, err
    found = table(tmp_path / "to" / "profile.csv")
    np.testing.assert_allclose(found[:, 0], 0.05 * (np.arange(40) + 0.5), rtol=1e-5)
    np.testing.assert_allclose(found[:, 1] - found[0, 1], groove().mean(axis=0) - groove()[:, 0].mean(), atol=2e-3)
    assert "a map of 40 x 5 heights: the mean of its 5 rows" in out


TRACE_MM, TRACE_UM = 0.05 * np.arange(40), groove()[0]


def columns(form: str, x: float = 1.0, z: float = 1.0) -> str:
    """The profile as lines of cells."""
    return "".join(form.format(x * a, z * b) for a, b in zip(TRACE_MM, TRACE_UM, strict=True))


TEXTS: dict[str, tuple[str, float]] = {
    # a profile as text, and where its first place lies [mm]
    "Talysurf, .prf": (
        "1 2\ntrack.MOD 0.000000e+000 PRF\nCX M 4.000000e+001 MM 1.000000e+000 D\n"
        "CZ M 4.000000e+001 MM 1.000000e-006 L\nEOR\nSTYLUS_RADIUS 2.000000e+000 MM\nSPACING CX 5.000000e-002\n"
        "MAP 1.000000e+000 CZ CZ 1.000000e+000 1.000000e+000\nEOR\n"
        + "".join(f"{round(1e3 * z)}\n" for z in TRACE_UM) + "EOR\nEOF\n", 0.025,
    ),
    "Talysurf, columns": ("Form Talysurf Intra\nX (mm);Z (um)\n" + columns("{:.4f};{:.6f}\n"), 0.0),
    "Alicona, along the profile": (
        "Form measurement\n\nPath length l [mm];Depth z [um]\n" + columns("{:.4f};{:.6f}\n"), 0.0,
    ),
    "Alicona, points in m": ("X [m];Y [m];Z [m]\n" + columns("{:.9f};0.0;{:.12f}\n", 1e-3, 1e-6), 0.0),
}  # fmt: skip


@pytest.mark.parametrize("what", TEXTS)
def test_profiles_as_text(what: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The .prf as surfile of INRiM reads it; columns in the manner of the exports."""
    text, first = TEXTS[what]
    (tmp_path / "track.prf").write_text(text)
    code, out, err = command("import", tmp_path / "track.prf", "-o", tmp_path / "to", "--json", capsys=capsys)
    assert code == 0, err
    found = table(tmp_path / "to" / "profile.csv")
    np.testing.assert_allclose(found[:, 0], first + TRACE_MM, atol=1e-9)
    np.testing.assert_allclose(found[:, 1], TRACE_UM, atol=1e-3)
    assert ("not read: Y" in out) == (what == "Alicona, points in m")


COLUMNS = {
    "time": 0.5 * np.arange(200.0), "speed_1": np.full(200, 404.0), "speed_2": np.full(200, 396.0),
    "torque": np.full(200, 9.4), "normal_load": np.full(200, 1000.0),
}  # fmt: skip
UNITS = {"time": "s", "speed_1": "rpm", "speed_2": "rpm", "torque": "N m", "normal_load": "N"}


def check_log(folder: Path) -> None:
    """T/N = 9.4 N m / (23.5 mm 1000 N) at 2 %."""
    (definition,) = folder.glob("*.toml")
    samples = load(definition).experiment.measured.traction
    assert samples is not None
    np.testing.assert_allclose(samples.ratio, 0.4)
    np.testing.assert_allclose(samples.creepage, 0.02)


def matlab_73() -> bytes:
    """A .mat of version 7.3: HDF5 behind 512 bytes."""
    h5py, buffer = pytest.importorskip("h5py"), io.BytesIO()
    with h5py.File(buffer, "w", userblock_size=512) as file:
        for name, values in COLUMNS.items():
            file[name] = values[None, :]
            file[name].attrs["units"] = UNITS[name]
    return buffer.getvalue()


def ods() -> bytes:
    """The smallest .ods: a zip with its type and the cells."""
    text = "urn:oasis:names:tc:opendocument:xmlns:"
    head = "".join(
        f'<table:table-cell office:value-type="string"><text:p>{name.replace("_", " ")} [{unit}]</text:p>'
        "</table:table-cell>"
        for name, unit in UNITS.items()
    )
    rows = "".join(
        "<table:table-row>"
        + "".join(
            f'<table:table-cell office:value-type="float" office:value="{value!r}"/>' for value in map(float, row)
        )
        + "</table:table-row>"
        for row in zip(*COLUMNS.values(), strict=True)
    )
    content = (
        f'<?xml version="1.0" encoding="UTF-8"?><office:document-content xmlns:office="{text}office:1.0" '
        f'xmlns:table="{text}table:1.0" xmlns:text="{text}text:1.0" office:version="1.2"><office:body>'
        f'<office:spreadsheet><table:table table:name="Run 1"><table:table-row>{head}</table:table-row>{rows}'
        "</table:table></office:spreadsheet></office:body></office:document-content>"
    )
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as file:
        file.writestr("mimetype", "application/vnd.oasis.opendocument.spreadsheet")
        file.writestr("content.xml", content)
        file.writestr("META-INF/manifest.xml", "<manifest/>")
    return buffer.getvalue()


def xls() -> bytes:
    """A workbook of Excel 97."""
    xlwt, buffer = pytest.importorskip("xlwt"), io.BytesIO()
    book = xlwt.Workbook()
    sheet = book.add_sheet("Run 1")
    for column, (name, unit) in enumerate(UNITS.items()):
        sheet.write(0, column, f"{name.replace('_', ' ')} [{unit}]")
        for row, value in enumerate(COLUMNS[name], start=1):
            sheet.write(row, column, float(value))
    book.save(buffer)
    return buffer.getvalue()


LOGS: dict[str, Callable[[], bytes]] = {".ods": ods, ".xls": xls, ".mat": matlab_73}


@pytest.mark.parametrize("suffix", LOGS)
def test_a_log_in_another_format(suffix: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("python_calamine")
    (tmp_path / f"rig{suffix}").write_bytes(LOGS[suffix]())
    code, _, err = command("import", tmp_path / f"rig{suffix}", "-o", tmp_path / "to", capsys=capsys)
    assert code == 0, err
    check_log(tmp_path / "to")


MADE = {
    # each thing of the table in docs/formats.md, and the file it is tried with
    "PCS MTM": "pcs_demo_5.txt", "ETM": "PCS ETM", "PCS EHD": "pcs_demo_2.txt", "SLIM": "pcs_demo_10.txt",
    "spacer files": "pcs_demo_4.txt", "Phoenix TE67": "te67_PPS30PTFE_60N_1.tsv", "Bruker UMT": "Bruker UMT, blocks",
    "Rtec": "Rtec, commas", "Optimol": "Optimol, German", "Amsler": "Amsler, thousands", "catman": "catman, stars",
    "Falex": "American units", "SUROS": "SUROS, tab", "LabVIEW .lvm": "LabVIEW, .lvm", ".tdms": "LabVIEW, .tdms",
    "MATLAB .mat": "MATLAB", "its version 7.3": ".mat", ".xlsx": "Excel", ".xls": ".xls", ".ods": ".ods",
    "Dektak": "dektak-1.csv", "Mitutoyo SurfTest": "mitutoyo_mock.xlsx", "columns x and y in µm": "csv-2.csv",
    ".x3p": ".x3p", ".sur": ".sur", ".al3d": ".al3d", ".plu": ".plu", ".opd": ".opd", ".sdf": ".sdf",
    "Gwyddion text": "gwyddion-export-english.txt", "Talysurf .prf": "Talysurf, .prf", "Talysurf": "Talysurf, columns",
    "Alicona": "Alicona, along the profile", "any of them as .gz": "SUROS, gz",
}  # fmt: skip


def test_every_row_of_the_table_of_makers_is_tried() -> None:
    page = Path(__file__).parents[1] / "docs/formats.md"
    if not page.exists():
        pytest.skip("the pages of the documentation are not here")
    rows = page.read_text(encoding="utf-8").partition("| what | known by | what is read |\n")[2].splitlines()[1:]
    firsts = [row.split("|")[1] for row in takewhile(lambda row: row.startswith("|"), rows)]
    named = [name.strip() for first in firsts for name in re.sub(r"\(.*?\)", "", first).split(",")]
    assert sorted(named) == sorted(MADE)
    tried = {*PROFILES, *OTHERS, *MAPS, *TEXTS, *LOGS, *REAL, *makers.messy()}
    assert set(MADE.values()) <= tried
