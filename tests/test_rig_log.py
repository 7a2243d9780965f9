"""Rig logs as rigs write them: torque that was not zeroed, rows that say nothing, and every row accounted for.

The logs are made here from a closed form: all creepages are in full sliding, where T = mu N.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
from definitions import VALID, write

from twindisc_cli.cli import main
from twindisc_cli.definition import Test, load
from twindisc_cli.errors import DefinitionError, MeasurementError
from twindisc_cli.measurement.held import HELD
from twindisc_cli.measurement.limit import LIMIT

MU, LOAD, RADIUS, OFFSET = 0.5, 72.0, 0.03, 0.035
STEPS = (0.02, 0.04, 0.06)
HISTORY = """steps = [
  { creepage_percent = 2.0, iterations = 2 },
  { creepage_percent = 4.0, iterations = 2 },
  { creepage_percent = 6.0 },
]"""
SLIDING = VALID[: VALID.index("steps = [")] + HISTORY + VALID[VALID.index("\n\n[model]") :]


def log(
    *, idle: tuple[int, int] = (60, 60), drift: float = 0.0, noise: float = 0.004, standing: int = 0, back: int = 0,
    offset: float = OFFSET, sense: float = 1.0,
) -> str:  # fmt: skip
    """A log of 420 s at 1 Hz in full sliding at mu = 0.5, unloaded for some seconds at both ends.

    offset and drift [N m] of the torque's zero over the log; noise [N m]; rows that stand still under load at the
    start, and rows that turn backwards at the end, each `standing`, `back`.
    """
    rng = np.random.default_rng(7)
    creepage = np.repeat(STEPS, (168, 168, 84))
    lead, tail = idle
    parts = {
        "load": [np.zeros(lead), np.full(standing + 420 + back, LOAD), np.zeros(tail)],
        "creepage": [np.full(lead + standing, STEPS[0]), creepage, np.full(back + tail, STEPS[-1])],
        "turns": [np.ones(lead), np.zeros(standing), np.ones(420), -np.ones(back), np.ones(tail)],
    }
    load, creep, turns = (np.concatenate(part) for part in parts.values())
    time = np.arange(len(load), dtype=float)
    zero = offset + drift * (time / time[-1] - 0.5)
    torque = sense * MU * load * RADIUS * np.sign(turns) + zero + noise * rng.standard_normal(len(time))
    speeds = [3000 * turns * (1 + sign * creep / 2) for sign in (1, -1)]
    rows = zip(time, *speeds, torque * 1e3, load, strict=True)
    lines = ["time [s];speed 1 [rpm];speed 2 [rpm];torque [N mm];normal load [N]"]
    return "\n".join([*lines, *(";".join(f"{value:.8g}" for value in row) for row in rows)])


def changed(text: str, column: int, change: Callable[[int, float], object]) -> str:
    """The log with other cells in a column, by their row and number."""
    head, *rows = text.split("\n")
    cells = [row.split(";") for row in rows]
    for n, row in enumerate(cells):
        row[column] = str(change(n, float(row[column])))
    return "\n".join([head, *(";".join(row) for row in cells)])


def read(folder: Path, text: str, setting: str = "") -> Test:
    (folder / "log.csv").write_text(text)
    return load(write(folder, f'{SLIDING}\n[measured]\nlog = "log.csv"\ntorque_disc = 2\n{setting}\n'))


@pytest.mark.parametrize("sense", [1.0, -1.0])
@pytest.mark.parametrize("drift", [0.0, 0.02])
def test_a_torque_that_was_not_zeroed_is(tmp_path: Path, drift: float, sense: float) -> None:
    measured = read(tmp_path, log(drift=drift, sense=sense)).experiment.measured
    assert measured.traction is not None
    assert measured.torque_zero is not None
    zero = measured.torque_zero
    assert zero.unit == pytest.approx(sense * LOAD * RADIUS)
    assert zero.value * zero.unit == pytest.approx(OFFSET, abs=2e-3)
    assert zero.drift * zero.unit == pytest.approx(drift * 480 / 539, abs=3 * 0.004 * np.sqrt(np.pi / 2 / 60 * 2))
    assert 0.0 < zero.std < 0.1 * OFFSET / (LOAD * RADIUS) + drift / (LOAD * RADIUS) / 5
    assert zero.taken_off
    for step in range(3):
        mine = measured.traction.step == step
        assert measured.traction.ratio[mine].mean() == pytest.approx(MU, rel=0.005)


def test_a_torque_that_the_recorder_holds_is_taken_once(tmp_path: Path) -> None:
    head, *rows = log().split("\n")
    cells = [row.split(";") for row in rows]
    held = [";".join([*mine[:3], cells[i - i % 5][3], mine[4]]) for i, mine in enumerate(cells)]
    test = read(tmp_path, "\n".join([head, *held]))
    (count,) = test.rows
    assert count.left_out["of a reading held since the row before"] == pytest.approx(420 * 4 / 5, abs=2)
    assert test.experiment.measured.traction is not None
    assert test.experiment.measured.traction.ratio.mean() == pytest.approx(MU, rel=0.005)


@pytest.mark.parametrize(
    ("header", "size"),
    [("torque [N mm]", 1.0), ("traction force [N]", 1e-3 / RADIUS), ("traction ratio [1]", 1e-3 / RADIUS / LOAD)],
)
def test_a_signal_at_the_limit_of_its_instrument_is_no_friction(tmp_path: Path, header: str, size: float) -> None:
    """Of a second step with a torque half as large again, of which all is beyond the range."""
    text = changed(log(), 3, lambda n, torque: size * min(torque * (1.5 if 228 <= n < 396 else 1.0), 1400.0))
    test = read(tmp_path, text.replace("torque [N mm]", header))
    traction, (count,) = test.experiment.measured.traction, test.rows
    assert traction is not None
    assert count.left_out[LIMIT] == 168
    assert count.used + sum(count.left_out.values()) == count.read
    assert count.lines[0].endswith(f"168 {LIMIT}")
    assert f"no row is left of step 2 (4 %): the {header.split(' [')[0]} there is not known" in count.notes
    assert set(traction.step) == {0, 2}
    assert traction.ratio.mean() == pytest.approx(MU, rel=0.005)
    assert traction.time[traction.step == 2].min() > 336.0


@pytest.mark.parametrize(("noise", "digit"), [(0.0, 1e-3), (0.004, 4.0), (0.004, 20.0)])
def test_a_signal_without_noise_or_of_coarse_digits_is_at_no_limit(tmp_path: Path, noise: float, digit: float) -> None:
    text = changed(log(noise=noise), 3, lambda _, torque: digit * round(torque / digit))
    (count,) = read(tmp_path, text).rows
    assert LIMIT not in count.left_out
    assert count.used >= 400


def test_what_a_dead_sensor_repeats_is_left_out(tmp_path: Path) -> None:
    text = log()
    stuck = text.split("\n")[151].split(";")[3]
    (count,) = read(tmp_path, changed(text, 3, lambda n, torque: stuck if 150 <= n < 200 else torque)).rows
    assert count.left_out[HELD] == 49
    assert not any("rows running hold" in note for note in count.notes)


@pytest.mark.parametrize("column", [3, 4])
def test_a_number_that_stands_for_none_is_pointed_out(tmp_path: Path, column: int) -> None:
    """Of four rows, too few to be those of a dead sensor."""
    text = changed(log(), 4, lambda n, load: load * (1.0 + 1e-3 * np.sin(n)))
    marked = changed(text, column, lambda n, value: {3: 900.0, 4: 70.0}[column] if 150 <= n < 154 else value)
    (count,) = read(tmp_path, marked).rows
    assert any("4 rows running hold exactly" in note for note in count.notes)


@pytest.mark.parametrize("named", [False, True])
def test_a_temperature_in_a_log_that_is_not_read_is_said(tmp_path: Path, named: bool) -> None:
    header, *rows = log().split("\n")
    text = "\n".join([f"{header};temperature [degC]", *(f"{row};{20 + n / 90:.2f}" for n, row in enumerate(rows))])
    test = read(tmp_path, text, 'temperature = "log.csv"' if named else "")
    (count, *_) = test.rows
    said = 'its temperature is not read: temperature = "log.csv" under [measured] reads it'
    assert (said in count.notes) != named
    assert (test.experiment.measured.temperature is not None) == named


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_a_sign_that_is_turned_is_said(tmp_path: Path, sense: float) -> None:
    said = "torque opposed to the creepage: taken with the other sign (that of columns.torque states it)"
    (count,) = read(tmp_path, log(sense=sense)).rows
    assert (said in count.notes) == (sense < 0.0)
    stated = read(tmp_path, log(sense=sense), f"columns.torque = {{ sign = {sense:.0f} }}")
    assert said not in stated.rows[0].notes
    assert stated.experiment.measured.traction is not None
    assert stated.experiment.measured.traction.ratio.mean() == pytest.approx(MU, rel=0.005)


@pytest.mark.parametrize(("idle", "setting"), [((60, 60), ""), ((0, 0), ""), ((0, 0), "torque_zero = 0.035")])
def test_a_load_signal_that_drops_out_makes_neither_a_zero_nor_friction(
    tmp_path: Path, idle: tuple[int, int], setting: str
) -> None:
    test = read(tmp_path, changed(log(idle=idle), 4, lambda n, load: 0.3 if 150 <= n < 180 else load), setting)
    measured, (count,) = test.experiment.measured, test.rows
    assert measured.traction is not None
    assert count.left_out["without a signal of the load"] == 30
    assert count.left_out.get("unloaded", 0) == sum(idle)
    said = (
        "no load from 150 to 179 s, but a torque of 1.1[12] N m: the signal of the load is taken to have dropped out, "
        r"and the rows neither for the zero nor for friction \(torque_zero overrules\)"
    )
    assert any(re.fullmatch(said, note) for note in count.notes)
    assert not np.any((measured.traction.time > 150.0 - idle[0]) & (measured.traction.time < 180.0 - idle[0]))
    if idle == (0, 0) and not setting:
        assert measured.torque_zero is None
        assert any("the zero of the torque is not known" in note for note in count.notes)
        return
    assert measured.torque_zero is not None
    assert measured.torque_zero.value * measured.torque_zero.unit == pytest.approx(OFFSET, abs=2e-3)
    assert measured.traction.ratio.mean() == pytest.approx(MU, rel=0.005)


def test_the_error_of_the_zero_is_the_scatter_of_its_rows(tmp_path: Path) -> None:
    # the median of n Gaussian rows scatters by sqrt(pi / 2n) of their noise; two ends halve the variance
    errors = [read(tmp_path, log(offset=o)).experiment.measured.torque_zero for o in (0.0, 0.01)]
    for zero in errors:
        assert zero is not None
        assert zero.std * zero.unit == pytest.approx(0.004 / np.sqrt(120), rel=0.4)


@pytest.mark.parametrize(
    ("setting", "offset", "taken"),
    [('torque_zero = "as recorded"', OFFSET / (LOAD * RADIUS), False), ("torque_zero = 0.035", 0.0, True)],
)
def test_the_zero_can_be_overruled(tmp_path: Path, setting: str, offset: float, taken: bool) -> None:
    measured = read(tmp_path, log(), setting).experiment.measured
    assert measured.traction is not None
    assert measured.torque_zero is not None
    assert measured.traction.ratio.mean() == pytest.approx(MU + offset, rel=0.003)
    assert measured.torque_zero.value == pytest.approx(OFFSET / (LOAD * RADIUS), rel=0.05)
    assert measured.torque_zero.taken_off is taken


def test_a_zero_that_was_not_recorded_is_not_made_up(tmp_path: Path) -> None:
    test = read(tmp_path, log(idle=(0, 0)))
    measured = test.experiment.measured
    assert "the zero of the torque is not known: run some seconds without load" in "".join(test.rows[0].notes)
    assert measured.torque_zero is None
    assert measured.traction is not None
    assert measured.traction.ratio.mean() == pytest.approx(MU + OFFSET / (LOAD * RADIUS), rel=0.003)
    with pytest.raises(MeasurementError, match=r"torque \[N mm\]: no section without load is in it"):
        read(tmp_path, log(idle=(0, 0)), 'torque_zero = "unloaded"')
    with pytest.raises(DefinitionError, match='must be "unloaded", "as recorded" or a torque in N m, not "zero"'):
        read(tmp_path, log(), 'torque_zero = "zero"')


def test_every_row_is_accounted_for(tmp_path: Path) -> None:
    (count,) = read(tmp_path, log(idle=(40, 50), standing=12, back=9)).rows
    assert count.read == 40 + 12 + 420 + 9 + 50
    assert count.used + sum(count.left_out.values()) == count.read
    left = dict(count.left_out)
    assert left.pop("unloaded") == 90
    assert left.pop("standing still") == 12
    assert left.pop("turning the other way") == 9
    # what is averaged over a twentieth of an iteration, 4.2 s, and straddles one of two changes of step
    assert set(left) <= {"at a change of step", "running up", "running down"}
    assert 8 <= left["at a change of step"] <= 20
    assert count.used >= 400


def test_rows_are_told_by_every_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = read(tmp_path, log()).path
    for command in ("identify-mu", "check", "friction-chart"):
        with pytest.raises(SystemExit):
            main([command, str(path), "--json", "--no-figure", "-o", str(tmp_path)])
        out, err = capsys.readouterr()
        (row,) = json.loads(out)["rows"]
        assert row["file"] == "log.csv"
        assert row["read"] == 540
        assert row["left_out"]["unloaded"] == 120
        assert f"log.csv: {row['used']} of 540 rows taken; left out: " in err
        assert "120 unloaded" in err
        zero = (
            r"torque zero 3[45](\.\d)? ± 0\.\d+ mN m \(one standard deviation\), from 120 rows without load in 2 "
            r"sections \((level|drift), -?\d\S* mN m from first to last\), taken off"
        )
        assert re.search(zero, err)
        assert "torque zero" in row["notes"][0]
        with h5py.File(str(tmp_path / "small" / f"{command}.h5")) as file:
            reasons = list(file["reason"].asstr()[()])
            assert file["rows_left_out"][0, reasons.index("unloaded")] == 120
            assert file["rows_used"][0] == row["used"]


def test_time_decides_between_steps_that_the_tachometers_cannot_tell_apart(tmp_path: Path) -> None:
    """2 and 2.002 %, each off by half a per cent of it, with errors of a ten-thousandth: both last as long as set."""
    near = SLIDING.replace("creepage_percent = 4.0", "creepage_percent = 2.002")
    rng = np.random.default_rng(3)
    time = np.arange(420.0)
    creepage = np.repeat((0.0201, 0.0199, 0.06), (168, 168, 84)) + 1e-4 * rng.standard_normal(420)
    rows = [f"{t:g},{3000 * (1 + c / 2):.4f},{3000 * (1 - c / 2):.4f},0.5" for t, c in zip(time, creepage, strict=True)]
    head = "time [s],speed 1 [rpm],speed 2 [rpm],traction ratio [1]"
    (tmp_path / "log.csv").write_text("\n".join([head, *rows]))
    traction = load(write(tmp_path, f'{near}\n[measured]\nlog = "log.csv"\n')).experiment.measured.traction
    assert traction is not None
    assert [int(np.sum(traction.time < end)) for end in (168.0, 336.0)] == pytest.approx(
        [len(traction.time) * share for share in (0.4, 0.8)], abs=2
    )


def test_a_log_that_outlasts_the_history_or_is_much_shorter_is_said(tmp_path: Path) -> None:
    whole = read(tmp_path, log()).rows[0].notes
    assert not any("under load" in note for note in whole)
    rows = log().split("\n")
    fast = [rows[0], *rows[1:62], *rows[62:482:12], *rows[482:]]
    (count,) = read(tmp_path, "\n".join([fast[0], *(f"{n};{r.split(';', 1)[1]}" for n, r in enumerate(fast[1:]))])).rows
    assert any("under load, the history 420 s" in note for note in count.notes)
