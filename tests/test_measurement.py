import math
from pathlib import Path

import numpy as np
import openpyxl
import pytest
from definitions import TRACTION, VALID, changed, write
from hypothesis import given, settings
from hypothesis import strategies as st

from twindisc_cli.definition import load
from twindisc_cli.errors import MeasurementError
from twindisc_cli.measurement import sheet
from twindisc_cli.measurement.content import Content
from twindisc_cli.measurement.header import Column
from twindisc_cli.measurement.table import read_table
from twindisc_cli.measurement.units import FORCE, LENGTH, RATIO, TEMPERATURE, TIME, TORQUE, Quantity, rim_speed
from twindisc_cli.model.experiment import Experiment

PROFILE = "y [mm],height [um]\n" + "".join(f"{y / 10:.1f},{-1.0 if abs(y) < 5 else 0.0}\n" for y in range(-10, 11))
TEMPERATURES = "time [s],temperature [degC]\n10,20\n100,21\n200,22\n300,22.5\n"


def loaded(folder: Path, text: str = VALID, **data: str) -> Experiment:
    return load(write(folder, text, **data)).experiment


def messages(folder: Path, text: str = VALID, **data: str) -> list[str]:
    with pytest.raises(MeasurementError) as error:
        load(write(folder, text, **data))
    return [str(p).removeprefix(f"{folder}/") for p in error.value.problems]


@pytest.mark.parametrize(("second", "said"), [(1.0, False), (1.02, False), (1.1, True)])
def test_a_creepage_that_is_not_the_historys_is_said_and_used(tmp_path: Path, second: float, said: bool) -> None:
    rows = f"step,creepage [%],traction ratio [1]\n1,0.5,0.49\n2,{second},0.55\n3,2,0.58\n"
    test = load(write(tmp_path, traction=rows))
    assert test.experiment.measured.traction.creepage[1] == pytest.approx(second / 100.0)
    what = f"creepages are not those of the history: {second:.3g} % in step 2 (1 %); T/N is read at what was recorded"
    assert (what in test.rows[0].notes) == said


# The table: separators, decimal marks, units


@pytest.mark.parametrize(
    ("cells", "said"),
    [(("3,030", "2,970"), ["3,030 is read as 3.03"]), (("3,030", "0,970"), []), (("3,030", "2,97"), [])],
)
def test_a_comma_that_may_part_thousands_is_pointed_out(cells: tuple[str, str], said: list[str]) -> None:
    rows = "".join(f"{time};{cell}\n" for time, cell in enumerate(cells))
    content = Content(f"time [s];normal load [N]\n{rows}".encode(), skip=())
    table = read_table(content, "f.csv", (Column("time", TIME), Column("normal load", FORCE)))
    assert table.columns["normal load"][0] == 3.03
    assert [note[:21] for note in table.notes] == said


@given(
    values=st.lists(st.tuples(*[st.floats(-1e6, 1e6).map(lambda v: round(v, 4))] * 2), min_size=1, max_size=20),
    dialect=st.sampled_from([(",", "."), (";", "."), ("\t", "."), (";", ","), ("\t", ",")]),
    units=st.tuples(st.sampled_from(["s", "min", "h", "ms"]), st.sampled_from(["N", "kN"])),
    quoted=st.booleans(),
    swap=st.booleans(),
    newline=st.sampled_from(["\n", "\r\n"]),
    encoding=st.sampled_from(["utf-8", "utf-8-sig", "utf-16"]),
    comment=st.booleans(),
)
@settings(max_examples=200, deadline=None)
def test_any_dialect_reads_the_same_numbers(
    values: list[tuple[float, float]],
    dialect: tuple[str, str],
    units: tuple[str, str],
    quoted: bool,
    swap: bool,
    newline: str,
    encoding: str,
    comment: bool,
) -> None:
    separator, mark = dialect
    cells = [(f"time [{units[0]}]", f"Normal  Load [{units[1]}]")]
    cells += [(str(t).replace(".", mark), str(f).replace(".", mark)) for t, f in values]
    rows = [row[::-1] if swap else row for row in cells]
    quote = '"' if quoted else ""
    lines = [separator.join(f"{quote}{cell}{quote}" for cell in row) for row in rows]
    if comment:
        lines[1:1] = ["# a remark; with, signs", ""]
    content = Content((newline.join(lines) + newline).encode(encoding), skip=())
    table = read_table(content, "f.csv", (Column("time", TIME), Column("normal load", FORCE)))
    factors = {"s": 1.0, "min": 60.0, "h": 3600.0, "ms": 1e-3, "N": 1.0, "kN": 1e3}
    expected = np.array(values) * [factors[units[0]], factors[units[1]]]
    np.testing.assert_allclose(table.columns["time"], expected[:, 0], rtol=1e-14, atol=0)
    np.testing.assert_allclose(table.columns["normal load"], expected[:, 1], rtol=1e-14, atol=0)
    np.testing.assert_array_equal(table.lines, np.arange(len(values)) + (4 if comment else 2))
    assert not table.problems


@pytest.mark.parametrize(
    ("quantity", "unit", "value", "expected"),
    [
        (TIME, "min", 2.0, 120.0),
        (LENGTH, "µm", 5.0, 5e-6),
        (LENGTH, "μm", 5.0, 5e-6),
        (LENGTH, "nm", 5.0, 5e-9),
        (RATIO, "%", 5.0, 0.05),
        (RATIO, None, 0.5, 0.5),
        (FORCE, "kN", 2.0, 2000.0),
        (TORQUE, "Nm", 2.0, 2.0),
        (TORQUE, "N·m", 2.0, 2.0),
        (TORQUE, "N*mm", 2.0, 2e-3),
        (rim_speed(0.5), "rpm", 60.0, math.pi),
        (rim_speed(0.5), "1/min", 60.0, math.pi),
        (rim_speed(0.5), "rad/s", 3.0, 1.5),
        (TEMPERATURE, "degC", 0.0, 273.15),
        (TEMPERATURE, "°C", 20.0, 293.15),
        (TEMPERATURE, "K", 77.0, 77.0),
        (TEMPERATURE, "degF", 32.0, 273.15),
    ],
)
def test_units(quantity: Quantity, unit: str | None, value: float, expected: float) -> None:
    factor, offset = quantity.conversion(unit)
    assert value * factor + offset == pytest.approx(expected, rel=1e-12)


def test_degrees_from_software_that_writes_windows_encoding(tmp_path: Path) -> None:
    path = write(tmp_path, temperature=TEMPERATURES)
    (tmp_path / "temperature.csv").write_bytes(TEMPERATURES.replace("degC", "°C").encode("cp1252"))
    samples = load(path).experiment.measured.temperature
    assert samples is not None
    np.testing.assert_allclose(samples.temperature, [293.15, 294.15, 295.15, 295.65])


# Samples: what they become


def test_rows_find_their_step_by_number_time_or_creepage(tmp_path: Path) -> None:
    rows = ["creepage [%],traction ratio [1]", "0.5,0.1", "0.52,0.2", "1,0.3", "2,0.4"]
    by_creepage = loaded(tmp_path, traction="\n".join(rows)).measured.traction
    # steps of the small test end at 168, 336 and 420 s; an end belongs to its step
    by_time = loaded(
        tmp_path, traction="\n".join(f"{row},{t}" for row, t in zip(rows, ["time [s]", 10, 168, 169, 420], strict=True))
    ).measured.traction
    by_number = loaded(
        tmp_path, traction="\n".join(f"{row},{n}" for row, n in zip(rows, ["step", 1, 1, 2, 3], strict=True))
    ).measured.traction
    for samples in (by_creepage, by_time, by_number):
        assert samples is not None
        np.testing.assert_array_equal(samples.step, [0, 0, 1, 2])
        np.testing.assert_allclose(samples.creepage, [0.005, 0.0052, 0.01, 0.02])
        assert np.all(np.isnan(samples.uncertainty))
    assert by_time is not None
    np.testing.assert_allclose(by_time.time, [10, 168, 169, 420])


def test_the_same_creepage_may_come_again(tmp_path: Path) -> None:
    text = VALID.replace("creepage_percent = 2.0", "creepage_percent = 0.5")
    samples = loaded(tmp_path, text, traction=TRACTION.replace("\n2,", "\n0.5,")).measured.traction
    assert samples is not None
    np.testing.assert_array_equal(samples.step, [0, 1, 2])


def test_a_profile_belongs_to_disc_2_and_the_end_unless_said_otherwise(tmp_path: Path) -> None:
    samples = loaded(tmp_path, profile=PROFILE).measured.profile
    assert samples is not None
    assert set(samples.disc) == {2}
    assert set(samples.iteration) == {5}
    assert samples.height.min() == pytest.approx(-1e-6)
    rows = PROFILE.splitlines()
    stops = [f"{rows[0]},disc,iteration", *(f"{row},1,2" for row in rows[1:]), *(f"{row},2,5" for row in rows[:0:-1])]
    samples = loaded(tmp_path, profile="\n".join(stops)).measured.profile
    assert samples is not None
    assert set(zip(samples.disc, samples.iteration, strict=True)) == {(1, 2), (2, 5)}


def test_hashes_are_of_the_files(tmp_path: Path) -> None:
    import hashlib

    test = load(write(tmp_path, traction=TRACTION, profile=PROFILE))
    expected = {"traction.csv": TRACTION, "profile.csv": PROFILE}
    assert test.inputs == {name: hashlib.sha256(text.encode()).hexdigest() for name, text in expected.items()}


# Bad input


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "traction.csv: is empty"),
        ("# only a remark\n", "traction.csv: is empty"),
        ("creepage [%],traction ratio [1]\n", "traction.csv: has no rows"),
        ("creepage [%],traction ratio [1]\n0.5,0.49\n", "traction.csv:2: too few points: 1, at least 2"),
        ("0.5,0.49\n1,0.55\n", "traction.csv:1: no column creepage [%]; the header has 0.5, 0.49"),
        ("creepage [%],traction ration [1]\n0.5,0.49\n", "did you mean traction ratio [1]?"),
        ("creepage [deg],traction ratio [1]\n0.5,0.49\n", "unknown unit [deg] for a ratio; known: %, 1"),
        ("creepage,traction ratio\n0.5,0.49\n", "traction.csv:1: creepage: has no unit; write one of [%, 1]"),
        ("creepage [%],creepage [%],traction ratio [1]\n0.5,0.6,0.5\n", "the column occurs twice"),
        (TRACTION.replace("0.55", "nan"), "traction.csv:3: traction ratio [1]: is nan; leave the row out"),
        (TRACTION.replace("0.55", ""), "traction.csv:3: traction ratio [1]: is empty; expected a number"),
        (TRACTION.replace("0.55", "inf"), "traction.csv:3: traction ratio [1]: is inf"),
        (TRACTION.replace("0.55", "abc"), 'traction.csv:3: traction ratio [1]: "abc" is not a number'),
        (TRACTION.replace("0.55", "0.55,7"), "traction.csv:3: 3 cells where the header has 2"),
        (TRACTION.replace("0.55", '"0.55'), "traction.csv:3: a quote is opened here and not closed"),
        (
            'creepage [%],traction ratio [1],note\n0.5,0.49,"two\nlines"\n1,0.55,\n2,0.58,\n',
            "traction.csv:2: a quote is opened here and not closed",
        ),
        (TRACTION.replace("0.55", "True"), 'traction.csv:3: traction ratio [1]: "True" is not a number'),
        (TRACTION.replace("0.55", "0_55"), 'traction.csv:3: traction ratio [1]: "0_55" is not a number'),
        (TRACTION.replace("0.55", "1e999"), 'traction.csv:3: traction ratio [1]: "1e999" is not a number'),
        ("creepage [%],traction ratio [1]\n0,5,0,49\n1,0,0,55\n", "a decimal comma? put ; between the columns"),
        (
            TRACTION.replace("\n1,", "\n1.5,"),
            "traction.csv:3: creepage [%]: 1.5 % is not the history's: step 2 has 1 %",
        ),
        (TRACTION.replace("[%]", "[1]"), "creepage [1]: 50 % is not the history's: step 3 has 2 %"),
        (TRACTION.replace("[%]", "[1]"), "step 3 has 2 %; is it creepage [%]?"),
        (
            "creepage [%],traction ratio [1]\n0.005,0.49\n0.01,0.55\n0.02,0.58\n",
            "0.005 % is not the history's: step 1 has 0.5 %; is it creepage [1]?",
        ),
        (
            "creepage [%],traction ratio [1]\n-0.5,0.49\n-1,0.55\n-2,0.58\n",
            "-0.5 % is not the history's: step 1 has 0.5 %; is its sign the other one?",
        ),
        (
            "creepage [%],traction ratio [1]\n50,0.49\n100,0.55\n200,0.58\n",
            "50 % is not the history's: step 3 has 2 %; is creepage_percent in the definition a fraction?",
        ),
        (TRACTION.replace("0.58", "58"), "traction.csv:4: traction ratio [1]: T/N of 58 cannot be; is it in %"),
        ("creepage [%],traction ratio [1]\n0.49,0.5\n0.55,1\n0.58,2\n", "swapped with creepage [%]?"),
        ("creepage [%],traction ratio [1]\n0.30,0.5\n0.31,1\n0.32,2\n", "swapped with creepage [%]?"),
        (
            "creepage [%],traction ratio [1],step\n0.5,0.49,4\n1,0.55,2\n2,0.58,3\n",
            "there is no step 4; the history has 1",
        ),
        (
            "creepage [%],traction ratio [1],step,time [s]\n0.5,0.49,1,9\n1,0.55,2,200\n2,0.58,3,290\n",
            "step 3 runs from 336 to 420 s in the history, not at 290 s",
        ),
    ],
)
def test_a_bad_traction_is_told(tmp_path: Path, text: str, says: str) -> None:
    found = messages(tmp_path, traction=text)
    assert any(says in message for message in found), found


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (TEMPERATURES.replace("\n100,", "\n5,"), "temperature.csv:3: time [s]: time 5 is earlier than the row before"),
        (TEMPERATURES.replace("\n100,", "\n10,"), "temperature.csv:3: time [s]: time 10 occurs twice"),
        (
            TEMPERATURES.replace("\n300,", "\n421,"),
            "temperature.csv:5: time [s]: 421 s lies outside the history, 0 to 420",
        ),
        (TEMPERATURES.replace("\n10,", "\n-1,"), "temperature.csv:2: time [s]: -1 s lies outside the history"),
        (TEMPERATURES.replace("[s]", "[h]"), "check the unit"),
        (TEMPERATURES.replace("degC", "K").replace(",20\n", ",-20\n"), "below absolute zero"),
        (TEMPERATURES.replace("degC", "R"), "unknown unit [R] for temperature; known: degC, K, degF"),
        ("time [s],temperature [degC]\n10,20\n20,21\n", "too few points: 2, at least 3"),
        ("time [s],temperature [degC]\n20,10\n20,100\n21,200\n22,300\n", "swapped with temperature [degC]?"),
    ],
)
def test_a_bad_temperature_is_told(tmp_path: Path, text: str, says: str) -> None:
    found = messages(tmp_path, temperature=text)
    assert any(says in message for message in found), found


def test_files_of_temperatures_follow_on_each_other(tmp_path: Path) -> None:
    later = TEMPERATURES.replace("\n10,", "\n310,").replace("\n100,", "\n350,")
    later = later.replace("\n200,", "\n380,").replace("\n300,", "\n400,")
    (tmp_path / "later.csv").write_text(later)
    (tmp_path / "first.csv").write_text(TEMPERATURES)
    files = '\n[measured]\ntemperature = ["{}.csv", "{}.csv"]\n'
    samples = loaded(tmp_path, VALID + files.format("first", "later")).measured.temperature
    assert samples is not None
    assert np.all(np.diff(samples.time) > 0.0)
    for one, other in (("later", "first"), ("first", "first")):
        [message] = messages(tmp_path, VALID + files.format(one, other))
        assert message.startswith("first.csv: time: begins at 10 s of the history, and the file before ends at ")


def test_a_column_that_is_ignored_in_vain_is_said(tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text(TRACTION.replace("\n", ",1\n").replace("[1],1", "[1],AE RMS [V]"))
    for ignored, note in (
        ("ae rms", ()),
        ("#3", ()),
        ("AE RSM", ("no column AE RSM to ignore, did you mean AE RMS?",)),
    ):
        text = f'{VALID}\n[measured]\ntraction = {{ file = "t.csv", ignore = "{ignored}" }}\n'
        assert load(write(tmp_path, text)).rows[0].notes == note


def test_a_text_has_no_sheet_to_choose(tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text(TRACTION)
    text = f'{VALID}\n[measured]\ntraction = {{ file = "t.csv", sheet = "Run 2" }}\n'
    assert messages(tmp_path, text) == ["t.csv: sheet: is a text of one part, and has no part Run 2"]


@pytest.mark.parametrize(("name", "key"), [("lod", "normal_load"), ("M", "traction_ratio")])
def test_a_declared_column_that_is_not_there_is_named(tmp_path: Path, name: str, key: str) -> None:
    (tmp_path / "log.csv").write_text("time [s],creepage [%],traction ratio [1],load [N]\n1,0.5,0.4,72\n2,0.5,0.4,72\n")
    text = f'{VALID}\n[measured]\nlog = "log.csv"\ncolumns.{key} = {{ column = "{name}" }}\n'
    found = messages(tmp_path, text)
    assert any(f"log.csv:1: no column {name}, as columns.{key} names it; the header has time" in m for m in found), (
        found
    )


def _narrow(half_width: float) -> str:
    y = np.linspace(-half_width, half_width, 21)
    return "y [mm],height [um]\n" + "".join(f"{v:.6f},{-1.0 + abs(v):.6f}\n" for v in y)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        # Hertz: b = 0.2705 mm (reference rig of CONTACT rev 2707 at G = 79.3 GPa), so 2b = 0.541 mm
        (_narrow(0.26), "profile.csv:2: y [mm]: the profile spans 0.52 mm, the contact is 0.5412 mm wide"),
        (PROFILE.replace("[mm]", "[um]"), "check the unit"),
        (PROFILE.replace("[um]", "[cm]"), "10 mm is not a wear depth; check the unit"),
        # a facet that deep is a chord of the 30 mm circle: sqrt(8 d R) = 15.5 mm for 1 mm, 21.9 mm for 2 mm
        (
            PROFILE.replace("[um]", "[mm]"),
            "profile.csv:8: height [mm]: a track 1 mm deep is 15.5 mm wide on these discs",
        ),
        (PROFILE.replace("\n0.3,", "\n0.2,"), "occurs twice or out of order"),
        ("y [mm],height [um]\n-1,0\n0,-1\n1,0\n", "too few points: 3, at least 8"),
        ("height [um],y [mm]\n" + "".join(f"{y / 10},{abs(y)}\n" for y in range(-10, 11)), "swapped with height [um]?"),
        (PROFILE.replace("\n", ",disc\n", 1).replace("0\n", "0,3\n"), "there is no disc 3; it is 1 or 2"),
        (PROFILE.replace("\n", ",iteration\n", 1).replace("0\n", "0,6\n"), "the history has iterations 1 to 5, not 6"),
        (PROFILE.replace("\n", ",iteration\n", 1).replace("0\n", "0,1.5\n"), "1.5 is not a whole number"),
    ],
)
def test_a_bad_profile_is_told(tmp_path: Path, text: str, says: str) -> None:
    found = messages(tmp_path, profile=text)
    assert any(says in message for message in found), found


def test_a_profile_as_deep_as_it_may_be_is_read(tmp_path: Path) -> None:
    # the chord of 2 mm on a circle of 30 mm is 16.7 um deep
    assert loaded(tmp_path, profile=PROFILE.replace("-1.0", "-16.0")).measured.profile is not None


def test_a_profile_just_wide_enough_is_read(tmp_path: Path) -> None:
    assert loaded(tmp_path, profile=_narrow(0.28)).measured.profile is not None


def test_a_workbook_reads_like_its_text(tmp_path: Path) -> None:
    rows = [line.split(",") for line in TEMPERATURES.strip().split("\n")]
    book = openpyxl.Workbook()
    for row in [rows[0], *[[float(cell) for cell in row] for row in rows[1:]]]:
        book.active.append(row)
    path = write(tmp_path, temperature=TEMPERATURES)
    expected = load(path).experiment.measured.temperature
    book.save(tmp_path / "temperature.csv")
    found = load(path).experiment.measured.temperature
    assert found is not None
    assert expected is not None
    np.testing.assert_array_equal(found.temperature, expected.temperature)
    np.testing.assert_array_equal(found.time, expected.time)
    book.active["B3"] = "broken"
    book.save(tmp_path / "temperature.csv")
    with pytest.raises(MeasurementError, match=r'temperature.csv:3: temperature \[degC\]: "broken" is not a number'):
        load(path)


def test_many_mistakes_of_one_kind_are_counted(tmp_path: Path) -> None:
    rows = "".join(f"{c},x\n" for c in [0.5] * 50)
    found = messages(tmp_path, traction="creepage [%],traction ratio [1]\n" + rows)
    assert len(found) == 4
    assert found[-1].startswith("traction.csv:5: traction ratio [1]: the same in 47 more rows, down to line 51")


def test_mistakes_of_all_files_come_in_one_go(tmp_path: Path) -> None:
    found = messages(
        tmp_path, traction=TRACTION.replace("0.55", "x"), profile="", temperature=TEMPERATURES.replace("\n100,", "\n5,")
    )
    assert [message.split(":")[0] for message in found] == ["traction.csv", "profile.csv", "temperature.csv"]


def test_what_is_no_file(tmp_path: Path) -> None:
    path = write(tmp_path, traction=TRACTION)
    (tmp_path / "traction.csv").rename(tmp_path / "tractions.csv")
    with pytest.raises(MeasurementError, match=r"traction.csv: no such file, did you mean tractions.csv\?"):
        load(path)
    (tmp_path / "traction.csv").mkdir()
    with pytest.raises(MeasurementError, match=r"traction.csv: is a folder; name a CSV file in it"):
        load(path)
    (tmp_path / "traction.csv").rmdir()
    (tmp_path / "traction.csv").write_bytes(b"PK\x03\x04\0\0\0")
    with pytest.raises(MeasurementError, match=r"traction.csv: is a workbook that cannot be read"):
        load(path)


# Raw rig logs


def rig_log(*, lead: float = 0.0, disc: int = 2, scale: float = 1.0, speeds: tuple[str, str] = ("1", "2")) -> str:
    """A log of the small test at 1 Hz: both speeds 3000 rpm on average, T/N = 0.1, 0.2, 0.3 in its steps, 3 s ramps."""
    ends, creepages = [168, 336, 420], [0.005, 0.01, 0.02]
    lines = [f"time [s];speed {speeds[0]} [rpm];speed {speeds[1]} [rpm];torque [N m];normal load [kN]"]
    time = np.arange(0.0, lead + 420.0)
    at = np.clip(time - lead, 0, 419.9)
    creepage = np.interp(at, [0, 168, 171, 336, 339, 420], np.repeat(creepages, 2))
    ratio = np.select([at < ends[0], at < ends[1]], [0.1, 0.2], 0.3)
    load_N = np.where(time < lead, 0.0, 72.0)
    torque = (-1.0 if disc == 1 else 1.0) * ratio * 0.03 * load_N * scale
    rows = zip(time, 3000 * (1 + creepage / 2), 3000 * (1 - creepage / 2), torque, load_N * 1e-3, strict=True)
    lines.extend(";".join(f"{value:.8g}".replace(".", ",") for value in row) for row in rows)
    return "\n".join(lines)


def with_log(folder: Path, log: str, text: str = VALID, disc: int = 2) -> Path:
    (folder / "log.csv").write_text(log)
    return write(folder, f'{text}\n[measured]\nlog = "log.csv"\ntorque_disc = {disc}\n')


@pytest.mark.parametrize(("lead", "disc"), [(0.0, 2), (37.0, 1)])
def test_a_rig_log_becomes_samples(tmp_path: Path, lead: float, disc: int) -> None:
    samples = load(with_log(tmp_path, rig_log(lead=lead, disc=disc), disc=disc)).experiment.measured.traction
    assert samples is not None
    assert np.all(np.diff(samples.time) > 0)
    expected = np.array([0.1, 0.2, 0.3])[samples.step]
    np.testing.assert_allclose(samples.ratio, expected, rtol=1e-6)
    np.testing.assert_allclose(samples.creepage, np.array([0.005, 0.01, 0.02])[samples.step], rtol=0.01)
    assert np.all(np.bincount(samples.step) >= [36, 36, 16])  # of 40, 40 and 20 averages
    ends = np.array([168.0, 336.0, 420.0])
    assert np.all(samples.time <= ends[samples.step])
    assert np.all(samples.time >= np.array([0.0, 168.0, 336.0])[samples.step])


def test_a_rig_log_of_two_equal_steps_is_cut_by_time(tmp_path: Path) -> None:
    text = VALID.replace("creepage_percent = 1.0", "creepage_percent = 0.5")
    rows = rig_log().split("\n")
    flat = [rows[0], *(rows[1 + min(n, 160)].replace(f"{min(n, 160)};", f"{n};", 1) for n in range(330)), *rows[340:]]
    samples = load(with_log(tmp_path, "\n".join(flat), text)).experiment.measured.traction
    assert samples is not None
    assert np.bincount(samples.step)[:2] == pytest.approx([39, 39], abs=3)


@pytest.mark.parametrize(
    ("log", "text", "says"),
    [
        (rig_log(speeds=("2", "1")), VALID, "disc 1 is the slower one, so creepage is negative: swapped with speed 2?"),
        (rig_log(), VALID.replace("creepage_percent = 1.0", "creepage_percent = 7.0"), "at the 7 % of step 2"),
        (rig_log(), changed(normal_load_N="normal_load_N = 100"), "the load is 72 N, the definition says 100 N"),
        (rig_log().replace("[kN]", "[N]"), VALID, "the load never comes near"),
        (rig_log().replace("[rpm]", "[rad/s]"), VALID, "the definition says 9.425 m/s; check the unit"),
        (rig_log(), VALID.replace("= 1.0, iterations = 2", "= 1.0, iterations = 1"), "step 2 lasts"),
        (rig_log().replace("\n7;", "\n6;"), VALID, "time 6 occurs twice"),
        ("\n".join(rig_log().split("\n")[:2]), VALID, "log.csv:2: too few points: 1, at least 2 are needed"),
        ("\n".join(rig_log().split("\n")[:3]), VALID, "no stretch of the log runs at the 1 % of step 2"),
        (rig_log().replace(";0,072", ";-0,072"), VALID, "the load is negative: what presses the discs together is"),
    ],
)
def test_a_bad_rig_log_is_told(tmp_path: Path, log: str, text: str, says: str) -> None:
    with pytest.raises(MeasurementError) as error:
        load(with_log(tmp_path, log, text))
    assert says in str(error.value)


def test_a_log_says_whose_torque_it_holds_where_the_radii_differ(tmp_path: Path) -> None:
    path = with_log(
        tmp_path, rig_log(), changed(disc1="disc1 = { rolling_radius_mm = 31.0, transverse_radius_mm = inf }")
    )
    path.write_text(path.read_text().replace("torque_disc = 2", ""))
    with pytest.raises(MeasurementError, match="say with torque_disc = 1 or 2"):
        load(path)


def test_mistakes_in_a_large_file_keep_their_lines(monkeypatch: pytest.MonkeyPatch) -> None:
    # several blocks, with a mistake in one and a blank line in another
    monkeypatch.setattr(sheet, "_BLOCK", 1 << 12)
    lines = [f"{n / 100},{72 + n % 7}" for n in range(1600)]
    lines[900] = "9000,72,7"
    lines[1100] = ""
    data = "\n".join(["time [s],normal load [N]", *lines]).encode()
    table = read_table(data, "log.csv", (Column("time", TIME), Column("normal load", FORCE)))
    assert [str(problem) for problem in table.problems] == ["log.csv:902: 3 cells where the header has 2"]
    assert len(table) == 1598
    kept = np.delete(np.arange(1600), [900, 1100])
    np.testing.assert_array_equal(table.lines, kept + 2)
    np.testing.assert_array_equal(table.columns["time"], kept / 100)


def test_a_step_that_no_count_reaches_is_refused(tmp_path: Path) -> None:
    """1e19 is a whole number and none that fits into 64 bits."""
    path = write(tmp_path, traction="step,creepage [%],traction ratio [1]\n1e19,0.25,0.3\n2,0.5,0.4\n")
    with pytest.raises(MeasurementError, match="is not a whole number"):
        load(path)
