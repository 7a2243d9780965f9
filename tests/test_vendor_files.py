"""Files of real instruments (tests/vendor/README.md), read against numbers taken from them by eye."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from test_import import command

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
    tried = {*PROFILES, *OTHERS, "xy-1.txt", "with_comments.lvm", "pcs_demo_5.txt", "te67_PPS30PTFE_60N_1.tsv"}
    assert tried == {file.name for file in HERE.iterdir()} - {"README.md"}
    assert len(tried) == 24
