"""import: from a rig's own text to a definition that runs, with every guess and the key that overrules it."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from test_found_steps import BALL, LEWIS, MU, rows_of, sweeps, timed_steps
from test_rig_log import LOAD

from twindisc_cli.cli import main
from twindisc_cli.definition import load
from twindisc_cli.measurement import guess as guess_module
from twindisc_cli.measurement.content import Content

PREAMBLE = ["Wälzprüfstand 3", "Bediener: Müller", "Datum: 12.03.2024; Versuch 17", ""]


def vendor() -> str:
    """A German vendor's text: preamble, units row, decimal comma, N cm and kN, a summary; 2 % and 5 % of slip."""
    rows = rows_of([(0.02, 30, 0.0, 1.0), (0.02, 120, LOAD, 1.0), (0.05, 90, LOAD, 1.0), (0.05, 30, 0.0, 1.0)])
    lines = ["Zeit;Drehzahl oben;Drehzahl unten;Drehmoment;Normalkraft;Temp. Scheibe", "s;1/min;1/min;N cm;kN;°C"]
    for time, first, second, torque, load_N in rows:
        cells = (time, first, second, 100.0 * torque, 1e-3 * load_N, 25.0)
        lines.append(";".join(f"{value:.7g}".replace(".", ",") for value in cells))
    return "\r\n".join([*PREAMBLE, *lines, "Mittelwert;3000;2985;1,08;0,072;30"])


def command(*arguments: object, capsys: pytest.CaptureFixture[str]) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as stop:
        main([str(argument) for argument in arguments])
    out, err = capsys.readouterr()
    return int(stop.value.code or 0), out, err


def imported(file: Path, capsys: pytest.CaptureFixture[str], *, refused: bool = True) -> Path:
    """The folder that a file is imported to; where it is refused at first, with the block that the refusal prints."""
    folder, block = file.parent / "mine", file.parent / "block.toml"
    code, _, err = command("import", file, "-o", folder, capsys=capsys)
    assert (code == 3) == refused, err
    if refused:
        block.write_text(err[err.index("[measured]") :], encoding="utf-8")
        code, _, err = command("import", file, block, "-o", folder, capsys=capsys)
    assert code == 0, err
    return folder


def test_from_a_vendors_text_to_mu(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file, folder = tmp_path / "Versuch 17.txt", tmp_path / "mine"
    file.write_bytes(vendor().encode("cp1252"))
    code, out, err = command("import", file, "-o", folder, "--json", capsys=capsys)
    assert code == 0, err
    told = json.loads(out)
    assert told["definition"] == str(folder / "Versuch_17.toml")
    row, _ = told["rows"]
    assert row["read"] == 271
    assert row["left_out"]["unloaded"] == 60
    assert row["left_out"]["summary at the end"] == 1
    keys = {guess["key"] for guess in told["guesses"]}
    assert {"measured.columns.speed_1", "measured.columns.torque", "rig.disc1", "material.hardness_HV"} <= keys
    written = tomllib.loads((folder / "Versuch_17.toml").read_text(encoding="utf-8"))
    for key in keys:
        table = written
        for part in key.split("."):
            table = table[part]
    assert written["rig"]["normal_load_N"] == LOAD
    assert written["rig"]["mean_speed_rpm"] == pytest.approx(3000.0)
    # the rig's own radius in place of the guess
    text = (folder / "Versuch_17.toml").read_text(encoding="utf-8").replace("23.5", "30.0")
    (folder / "Versuch_17.toml").write_text(text, encoding="utf-8")
    code, out, err = command("identify-mu", folder / "Versuch_17.toml", "-o", tmp_path, "--json", capsys=capsys)
    assert code == 0, err
    np.testing.assert_allclose([step["mu"] for step in json.loads(out)["steps"]], MU, rtol=0.005)
    assert (tmp_path / "Versuch_17" / "identify-mu.png").is_file()


def test_the_tidy_table_holds_what_is_read(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "log.csv").write_text(vendor())
    assert command("import", tmp_path / "log.csv", "-o", tmp_path / "to", capsys=capsys)[0] == 0
    samples = load(tmp_path / "to" / "log.toml").experiment.measured.traction
    assert samples is not None
    table = np.genfromtxt(tmp_path / "to" / "traction.csv", delimiter=",", skip_header=1)
    np.testing.assert_allclose(table[:, 0], samples.time, rtol=1e-6)
    np.testing.assert_allclose(table[:, 2:], np.column_stack([100.0 * samples.creepage, samples.ratio]), rtol=1e-6)


@pytest.mark.parametrize(("text", "ratio"), [(sweeps(), [0.05]), (timed_steps(), [0.02, 0.03, 0.04])])
def test_ball_on_disc_rigs(tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str, ratio: list[float]) -> None:
    (tmp_path / "rig.csv").write_text(text)
    code, _, err = command("import", tmp_path / "rig.csv", "-o", tmp_path / "to", capsys=capsys)
    assert code == 0, err
    test = load(tmp_path / "to" / "rig.toml").experiment
    assert test.measured.traction is not None
    np.testing.assert_allclose(np.unique(np.round(test.measured.traction.ratio, 3)), ratio)
    assert test.rig.normal_load == pytest.approx(50.0, abs=0.2)
    assert test.rig.rolling_speed == pytest.approx(0.2, rel=1e-3)
    assert test.rig.disc2.rolling_radius == float(BALL.split("disc2 = { rolling_radius_mm = ")[1].split(",")[0]) * 1e-3


def test_what_cannot_be_imported_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "rig.csv"
    file.write_text("a,b\n1,2\n")
    code, _, err = command("import", file, "-o", tmp_path, capsys=capsys)
    assert (code, "rig.csv: is not a log (time, speeds or creepage" in err) == (3, True)
    file.write_text("slip_percent,traction_coefficient\n0.5,0.3\n1,0.4\n2,0.45\n")
    (tmp_path / "two.csv").write_text(vendor())
    code, _, err = command("import", file, tmp_path / "two.csv", "-o", tmp_path, capsys=capsys)
    assert (code, "import one test at a time" in err) == (2, True)
    code, _, err = command("import", tmp_path / "no.csv", "-o", tmp_path, capsys=capsys)
    assert (code, "no such file" in err) == (3, True)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["rig.csv", "two.csv"]
    file.write_text(vendor())
    assert command("import", file, "-o", tmp_path, capsys=capsys)[0] == 0
    code, _, err = command("import", file, "-o", tmp_path, capsys=capsys)
    assert (code, "exists already" in err) == (2, True)


def test_a_log_without_a_motion_is_said_to_lack_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Ball on disc at one speed, which stands in the head only: what was proposed had dropped the traction."""
    rows = "".join(f"{n},1.3,11.8,24.1,24.2\n" for n in range(20))
    (tmp_path / "pod.csv").write_text(
        f"time [s],friction force [N],load [N],lube temperature [degC],pot temperature [degC]\n{rows}"
    )
    code, _, err = command("import", tmp_path / "pod.csv", "-o", tmp_path / "to", capsys=capsys)
    assert (code, "No column says how the discs move: a log needs two speeds, a creepage" in err) == (3, True), err
    assert "columns.temperature" not in err


def test_a_curve_whose_rows_are_all_broken_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "curve.csv").write_text("creepage [%],traction ratio [1]\n1,2,3\n4\n5\n")
    code, _, err = command("import", tmp_path / "curve.csv", "-o", tmp_path / "to", capsys=capsys)
    assert (code, "curve.csv:2: 3 cells where the header has 2" in err) == (3, True)


def test_a_curve_and_a_profile_go_together(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "curve.csv").write_text("slip_percent,traction_coefficient\n0.5,0.3\n1,0.4\n2,0.45\n")
    y = np.linspace(-3.0, 3.0, 61)
    height = -6.0 * np.clip(1.0 - (y / 0.6) ** 2, 0.0, None)
    (tmp_path / "track.csv").write_text(
        "y [mm],height [um]\n" + "".join(f"{a},{b}\n" for a, b in zip(y, height, strict=True))
    )
    files = (tmp_path / "curve.csv", tmp_path / "track.csv")
    code, _, err = command("import", *files, "-o", tmp_path / "to", capsys=capsys)
    assert code == 0, err
    measured = load(tmp_path / "to" / "curve.toml").experiment.measured
    assert measured.traction is not None
    assert measured.profile is not None
    assert len(measured.profile.y) == 61


def warmed(time: np.ndarray) -> np.ndarray:
    """A disc [degC] of 21 degC that is heated from 30 s on, of 50 s."""
    return 21.0 + 8.0 * -np.expm1(-np.maximum(time - 30.0, 0.0) / 50.0)


def with_temperatures(name: str) -> str:
    """The vendor's text with such a disc in its last column, called so."""
    above, below = vendor().replace("Temp. Scheibe", name).split("°C\r\n")
    *rows, summary = below.split("\r\n")
    cells = [row.split(";") for row in rows]
    values = warmed(np.array([float(row[0].replace(",", ".")) for row in cells]))
    told = [";".join([*row[:-1], f"{value:.6f}".replace(".", ",")]) for row, value in zip(cells, values, strict=True)]
    return f"{above}°C\r\n" + "\r\n".join([*told, summary])


@pytest.mark.parametrize("name", ["Temp. Scheibe", "TC 3"])
def test_a_temperature_in_the_log_is_imported(tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str) -> None:
    (tmp_path / "rig.txt").write_bytes(with_temperatures(name).encode("cp1252"))
    code, out, err = command("import", tmp_path / "rig.txt", "-o", tmp_path / "mine", "--json", capsys=capsys)
    assert code == 0, err
    of_log, of_temperature = json.loads(out)["rows"]
    assert of_temperature["left_out"] == {"summary at the end": 1, "before the history": 30, "after the history": 30}
    assert of_log["read"] == of_temperature["read"] == 271
    assert "measured.columns.temperature" in {guess["key"] for guess in json.loads(out)["guesses"]}
    test = load(tmp_path / "mine" / "rig.toml").experiment
    assert test.thermal is not None
    assert test.thermal.environment_temperature == pytest.approx(273.15 + 21.0)
    warm, traction = test.measured.temperature, test.measured.traction
    assert warm is not None
    assert traction is not None
    np.testing.assert_allclose(warm.temperature, 273.15 + warmed(warm.time + 29.5), atol=1e-5)
    assert warm.time[-1] == pytest.approx(test.history.end_time[-1], abs=1.0)
    header, first = (tmp_path / "mine" / "temperature.csv").read_text().splitlines()[:2]
    assert header == "time [s],temperature [degC]"
    assert float(first.split(",")[1]) == pytest.approx(21.0)
    code, out, err = command("thermal", tmp_path / "mine" / "rig.toml", "-o", tmp_path, "--json", capsys=capsys)
    assert code == 0, err
    assert json.loads(out)["convection_W_K"] > 0.0


def test_a_temperature_file_runs_on_the_clock_of_the_log(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    time = np.arange(0.0, 272.0, 3.0)
    rows = "\n".join(f"{t:g};{value:.6f}" for t, value in zip(time, warmed(time), strict=True))
    (tmp_path / "disc.csv").write_text(f"time;temperature\ns;degC\n{rows}\n")
    (tmp_path / "rig.txt").write_bytes(with_temperatures("Raumtemperatur").encode("cp1252"))
    given = (tmp_path / "rig.txt", tmp_path / "disc.csv")
    code, _, err = command("import", *given, "-o", tmp_path / "mine", capsys=capsys)
    assert code == 0, err
    warm = load(tmp_path / "mine" / "rig.toml").experiment.measured.temperature
    assert warm is not None
    np.testing.assert_allclose(warm.temperature, 273.15 + warmed(warm.time + 29.5), atol=1e-5)
    assert np.all(np.diff(warm.time) == pytest.approx(3.0))


def test_the_temperature_of_the_room_is_not_the_discs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "rig.txt").write_bytes(with_temperatures("Temp. Raum").encode("cp1252"))
    code, _, err = command("import", tmp_path / "rig.txt", "-o", tmp_path / "mine", capsys=capsys)
    assert code == 0, err
    assert load(tmp_path / "mine" / "rig.toml").experiment.measured.temperature is None


def test_a_curve_with_derived_columns_is_imported(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "lewis.csv").write_text(LEWIS)
    code, _, err = command("import", tmp_path / "lewis.csv", "-o", tmp_path / "mine", capsys=capsys)
    assert code == 0, err
    samples = load(tmp_path / "mine" / "lewis.toml").experiment.measured.traction
    assert samples is not None
    np.testing.assert_allclose(samples.ratio, [0.091, 0.258, 0.361, 0.480, 0.461, 0.460, 0.461, 0.512])
    np.testing.assert_allclose(100.0 * samples.creepage, [0.2, 0.5, 1, 3, 7.5, 10, 15, 20])


def test_load_and_speed_of_a_large_log_are_guessed_from_pieces_of_it(tmp_path: Path) -> None:
    """Whole lines from beginning to end; the medians are those of the whole."""
    row = "{:08.2f};404.0000000;396.0000000;9.4000000;{:.7f}\n"
    load = np.where(np.arange(220_000) % 2, 1001.0, 999.0)
    lines = [
        "Time [s];n1 [rpm];n2 [rpm];Torque [Nm];Load [N]\n",
        *(row.format(0.01 * n, N) for n, N in enumerate(load)),
    ]
    content = Content("".join(lines).encode())
    small = guess_module._thinned(content)
    assert len(small.data) < 0.5 * len(content.data)
    assert {line.count(b";") for line in small.data.splitlines()} == {4}
    result = guess_module.guess(content, "rig.csv")
    found, speed, _ = guess_module.typical(content, "rig.csv", result)
    assert found == pytest.approx(1000.0, abs=1.0)
    assert speed == pytest.approx(400.0 * 2.0 * np.pi / 60.0 * 0.0235)


BEGIN = datetime(2024, 3, 12, 11, 58)
STAMPS: dict[str, tuple[str, Callable[[datetime], str]]] = {
    "ISO": ("Time,Temperature [degC]", datetime.isoformat),
    "ISO with zone": ("Timestamp,Disc temperature (°C)", lambda at: f"{at.isoformat()}+01:00"),
    "AM and PM": ("Time,Temp [°C]", lambda at: at.strftime("%I:%M:%S %p")),
    "American, day and AM": ("Date/Time,TC 1 [°C]", lambda at: at.strftime("%m/%d/%Y %I:%M:%S %p")),
    "German": ("Datum Uhrzeit,Temperatur [°C]", lambda at: at.strftime("%d.%m.%Y %H:%M:%S")),
    "day and minute": ("When,Temperature [°C]", lambda at: at.strftime("%d.%m.%Y %H:%M")),
    "two columns": ("Date,Time,Temperature [degC]", lambda at: at.strftime("%Y-%m-%d,%H:%M:%S")),
    "minutes and capitals": ("t / min,T / °C", lambda at: f"{(at - BEGIN).total_seconds() / 60.0:.6f}"),
    "hours and capitals": ("t / h,T / °C", lambda at: f"{(at - BEGIN).total_seconds() / 3600.0:.9f}"),
}


@pytest.mark.parametrize("what", STAMPS)
def test_a_temperature_alone_by_its_time_stamps(what: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Noon lies within; t and T are two columns."""
    header, form = STAMPS[what]
    rows = [f"{form(BEGIN + timedelta(minutes=n))},{22.0 + 0.03 * n:.2f}" for n in range(20)]
    (tmp_path / "disc.csv").write_text("\n".join([header, *rows]) + "\n")
    code, out, err = command("import", tmp_path / "disc.csv", "-o", tmp_path / "mine", "--json", capsys=capsys)
    assert code == 0, err
    assert json.loads(out)["definition"] is None
    found = np.loadtxt(tmp_path / "mine" / "temperature.csv", delimiter=",", skiprows=1)
    np.testing.assert_allclose(found, np.column_stack([60.0 * np.arange(20), 22.0 + 0.03 * np.arange(20)]), atol=1e-6)


def test_a_temperature_of_a_foreign_unit_is_named_by_the_block(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """As a logger of Onset writes it: two digits of the year, its serial number where a unit is expected."""
    rows = [f'{n},"03/12/24 {9 + n // 60:02d}:{n % 60:02d}:00 AM",{22.0 + 0.03 * n:.2f}' for n in range(90)]
    header = '"#","Date Time, GMT+01:00","Temp, °C (LGR S/N: 10000)"'
    (tmp_path / "disc.csv").write_text("\n".join([header, *rows]) + "\n")
    folder = imported(tmp_path / "disc.csv", capsys)
    found = np.loadtxt(folder / "temperature.csv", delimiter=",", skiprows=1)
    np.testing.assert_allclose(found, np.column_stack([60.0 * np.arange(90), 22.0 + 0.03 * np.arange(90)]), atol=1e-6)


def test_a_log_with_t_and_capital_t(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = [f"{20 + n / 100:.2f};{n};404;396;9.4;1000" for n in range(300)]
    (tmp_path / "rig.csv").write_text("\n".join(["T [°C];t [s];n1 [rpm];n2 [rpm];M [Nm];Fn [N]", *rows]) + "\n")
    code, _, err = command("import", tmp_path / "rig.csv", "-o", tmp_path / "mine", capsys=capsys)
    assert code == 0, err
    measured = load(tmp_path / "mine" / "rig.toml").experiment.measured
    assert measured.temperature is not None and measured.traction is not None
    np.testing.assert_allclose(measured.temperature.temperature[[0, -1]], [293.15, 296.14], atol=0.02)
    np.testing.assert_allclose(measured.traction.ratio, 0.4)


MASSES = {
    # a table of weighings alone, what is written of it, and whether a block is needed
    "losses": ("iteration,mass loss [mg]\n1,2.1\n2,4\n", "iteration,mass loss [mg]\n1,2.1\n2,4\n", False),
    "German weights": (
        "Drehungen;Gewicht Scheibe 1 [g];Gewicht Scheibe 2 [g]\n0;174,5181;174,2207\n5000;174,5100;174,2101\n",
        "revolutions,mass 1 [mg],mass 2 [mg]\n0,174518.1,174220.7\n5000,174510,174210.1\n", False,
    ),
    "minutes": (
        "minutes,weight [mg]\n0,1741.1\n10,1740.2\n", "time [s],mass [mg]\n0,1741.1\n600,1740.2\n", False,
    ),
    "kilometres": (
        "distance [km],weight loss (mg)\n1,2.1\n2,4\n", "distance [m],mass loss [mg]\n1000,2.1\n2000,4\n", False,
    ),
    "above and below": (
        "Laufzeit (min);Wägung oben Gewicht [g];Wägung unten Gewicht [g]\n0;17,4;18,2\n10;17,3;18,1\n",
        "time [s],mass 1 [mg],mass 2 [mg]\n0,17400,18200\n600,17300,18100\n", True,
    ),
    "no units": ("N tours;perte masse\n100;1.2\n200;2.2\n", "revolutions,mass loss [mg]\n100,1.2\n200,2.2\n", True),
}  # fmt: skip


@pytest.mark.parametrize("what", MASSES)
def test_weighings_alone(what: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Understood, or refused with a block that makes the same call succeed."""
    text, written, needs_block = MASSES[what]
    (tmp_path / "weights.csv").write_text(text, encoding="utf-8")
    folder = imported(tmp_path / "weights.csv", capsys, refused=needs_block)
    assert (folder / "mass.csv").read_text() == written


def test_a_mean_speed_in_rpm_beside_a_slip(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Of discs of one radius, whatever it is: 400 rpm; and a column Temp, which is no misspelt step."""
    rows = [f"{n};2;400;{0.5 * (30 <= n < 270)};{72 * (30 <= n < 270)};77" for n in range(300)]
    header = "Time [s];Slip [%];Mean speed [rpm];COF [-];Fn [N];Temp [°F]"
    (tmp_path / "rig.csv").write_text("\n".join([header, *rows]) + "\n")
    code, _, err = command("import", tmp_path / "rig.csv", "-o", tmp_path / "mine", capsys=capsys)
    assert code == 0, err
    path = tmp_path / "mine" / "rig.toml"
    path.write_text(path.read_text().replace("23.5", "30.0"))
    test = load(path).experiment
    assert test.measured.traction is not None and test.measured.temperature is not None
    assert test.rig.rolling_speed == pytest.approx(400.0 * 2.0 * np.pi / 60.0 * 0.03)
    assert test.history.speed_factor[test.history.driven] == pytest.approx(1.0)
    np.testing.assert_allclose(test.measured.traction.ratio, 0.5)
    np.testing.assert_allclose(test.measured.temperature.temperature, 298.15)


def test_a_load_in_kg_is_named_by_the_block(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """kgf is proposed, to be checked; of a torque in V nothing is."""
    rows = [f"{n};404;396;{1.08 * (30 <= n < 270):.4f};{7.3419 * (30 <= n < 270)}" for n in range(300)]
    head = "Time [s];Speed 1 [rpm];Speed 2 [rpm];Torque [{}];Load [kg]"
    (tmp_path / "rig.csv").write_text("\n".join([head.format("V"), *rows]) + "\n")
    code, _, err = command("import", tmp_path / "rig.csv", "-o", tmp_path / "mine", capsys=capsys)
    assert code == 3
    assert "columns.torque" not in err
    (tmp_path / "rig.csv").write_text("\n".join([head.format("N m"), *rows]) + "\n")
    folder = imported(tmp_path / "rig.csv", capsys)
    assert load(folder / "rig.toml").experiment.rig.normal_load == pytest.approx(72.0, rel=1e-3)


PLAIN = "time [s],creepage [%],traction ratio [1],normal load [N]\n"
PLAIN += "".join(f"{n},{1 + n // 60},0.4{n % 7},72\n" for n in range(120))


@pytest.mark.parametrize(
    ("block", "says"),
    [
        (
            "[measured]\nskip = -9999",
            'block.toml:2: measured.skip: must be a text, such as "-9999", or a list of texts',
        ),
        ("[measured]\nsheet = 3", "block.toml:2: measured.sheet: must be a text in quotes, not 3"),
        ("[measured]\nlog = { file = 3 }", "block.toml:2: measured.log.file: must be a text in quotes, not 3"),
        ('[measured]\ncolumns.torque = { colum = "M" }', "columns.torque.colum: unknown key, did you mean column?"),
        ("measured = 3\n[rig]\nnormal_load_N = 72.0", "block.toml:1: measured: must be a table, not 3"),
        (f"measured.{'a.' * 60}b = 1", "is nested too deeply"),
        ("[rig]\nnormal_lod_N = 72.0", "block.toml: rig.normal_lod_N: unknown key, did you mean normal_load_N?"),
    ],
)
def test_a_wrong_block_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str], block: str, says: str) -> None:
    (tmp_path / "rig.csv").write_text(PLAIN)
    (tmp_path / "block.toml").write_text(block)
    code, _, err = command(
        "import", tmp_path / "rig.csv", tmp_path / "block.toml", "-o", tmp_path / "to", capsys=capsys
    )
    assert (code, says in err) == (2, True), err


def test_a_table_that_is_there_is_kept(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "rig.csv").write_text(PLAIN)
    (tmp_path / "traction.csv").write_text("mine")
    code, _, err = command("import", tmp_path / "rig.csv", "-o", tmp_path, capsys=capsys)
    assert (code, "traction.csv: exists already" in err) == (2, True)
    assert (tmp_path / "traction.csv").read_text() == "mine"
    assert not (tmp_path / "rig.toml").exists()
    assert command("import", tmp_path / "rig.csv", "-o", tmp_path, "--force", capsys=capsys)[0] == 0


def test_an_imported_definition_finds_its_files(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Through a link, for a file of its own test's name, and for two of one name in different folders."""
    (tmp_path / "run").mkdir()
    (tmp_path / "deep/down").mkdir(parents=True)
    (tmp_path / "run/link").symlink_to(tmp_path / "deep/down")
    monkeypatch.chdir(tmp_path / "run")
    for name in ("rig", "rig.csv"):
        Path(name).write_text(PLAIN)
    Path("../rig.csv").write_text(PLAIN.replace("72\n", "73\n"))
    for files, folder in ((["rig.csv"], "link"), (["rig"], "to"), (["rig.csv", "../rig.csv"], "both")):
        assert command("import", *files, "-o", folder, capsys=capsys)[0] == 0
        written = tomllib.loads(Path(folder, "rig.toml").read_text(encoding="utf-8"))
        assert written["test"]["name"] == "rig"
        named = written["measured"]["log"]
        named = [named] if isinstance(named, str) else named
        found = [(Path(folder).resolve() / name).resolve() for name in named]
        assert found == [Path(file).resolve() for file in files]
        assert load(Path(folder, "rig.toml")).experiment.measured.traction is not None


def test_the_tidy_profile_says_after_which_iteration(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "rig.csv").write_text(PLAIN)
    y = np.linspace(-4.0, 4.0, 101)
    rows = [(v, -d * max(0.0, 1.0 - (v / 1.5) ** 2), n) for n, d in ((50, 3.0), (100, 6.0)) for v in y]
    lines = "".join(f"{v:.3f},{h:.4f},{n}\n" for v, h, n in rows)
    (tmp_path / "prof.csv").write_text(f"y [mm],height [um],iteration\n{lines}")
    code, _, err = command("import", tmp_path / "rig.csv", tmp_path / "prof.csv", "-o", tmp_path / "to", capsys=capsys)
    assert code == 0, err
    table = np.genfromtxt(tmp_path / "to/profile.csv", delimiter=",", names=True)
    assert [table["height_um"][table["iteration"] == n].min() for n in (50, 100)] == pytest.approx(
        [-3.0, -6.0], abs=0.02
    )


@pytest.mark.filterwarnings("error")
def test_a_load_that_is_zero_throughout_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "rig.csv").write_text(PLAIN.replace(",72\n", ",0\n"))
    code, _, err = command("import", tmp_path / "rig.csv", "-o", tmp_path / "to", capsys=capsys)
    assert (code, "rig.csv: normal load: is 0 in every row" in err) == (3, True), err


def test_a_load_that_is_recorded_as_negative_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "rig.csv").write_text(PLAIN.replace(",72\n", ",-72\n"))
    code, _, err = command("import", tmp_path / "rig.csv", "-o", tmp_path / "to", capsys=capsys)
    assert (code, "columns.normal_load = { sign = -1 }" in err) == (3, True), err
    (tmp_path / "BLOCK.TOML").write_text("[measured]\ncolumns.normal_load = { sign = -1 }\n")
    files = (tmp_path / "rig.csv", tmp_path / "BLOCK.TOML")
    code, _, err = command("import", *files, "-o", tmp_path / "to", capsys=capsys)
    assert code == 0, err
    assert load(tmp_path / "to/rig.toml").experiment.rig.normal_load == 72.0
