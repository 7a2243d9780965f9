"""Histories read from the data, slip both ways, and the forms in which ball-on-disc and railway rigs write.

The logs are made here in full sliding, where T = mu N, on a history that is known.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from definitions import VALID, write
from hypothesis import given, settings
from hypothesis import strategies as st
from test_rig_log import LOAD, MU, RADIUS

from twindisc_cli.cli import main
from twindisc_cli.definition import Test, load, load_text
from twindisc_cli.errors import DefinitionError, MeasurementError
from twindisc_cli.identify.steps import identify_friction
from twindisc_cli.measurement.found_steps import Seen, find_steps
from twindisc_cli.model.forward import ForwardModel

MEASURED = 'schema = 1\nhistory = "measured"\n' + VALID[VALID.index("\n[test]") : VALID.index("\n[history]")]
RIG = load_text(VALID, Path("small.toml")).experiment.rig
SPEED = RIG.rolling_speed
ZERO = 0.035
Driven = list[tuple[float, float, float, float]]
"""Creepage [1], seconds, load [N] and speed over the rig's; a speed of 0 stands still."""


def rows_of(driven: Driven, *, noise: float = 0.0, ramp: int = 0) -> np.ndarray:
    """Rows at 1 Hz of time [s], both speeds [rpm], torque [N m] with a zero that is off, and load [N]."""
    rng = np.random.default_rng(5)
    parts, last = [], driven[0][0]
    for creepage, seconds, load_N, speed in driven:
        slip = np.full(int(seconds), creepage)
        slip[:ramp] = np.linspace(last, creepage, ramp + 1)[1:] if ramp else slip[:0]
        last = creepage
        torque = MU * np.sign(slip) * load_N * RADIUS * (speed > 0.0) + ZERO
        wobble = 1.0 + noise * rng.standard_normal((len(slip), 2))
        parts.append(np.column_stack([
            3000 * speed * (1 + slip / 2) * wobble[:, 0], 3000 * speed * (1 - slip / 2) * wobble[:, 1],
            torque + 0.004 * rng.standard_normal(len(slip)), np.full(len(slip), load_N),
        ]))  # fmt: skip
    table = np.concatenate(parts)
    return np.column_stack([np.arange(len(table), dtype=float), table])


def log_text(rows: np.ndarray) -> str:
    header = "time [s],speed 1 [rpm],speed 2 [rpm],torque [N m],normal load [N]"
    return "\n".join([header, *(",".join(f"{value:.9g}" for value in row) for row in rows)])


def read(folder: Path, text: str, settings: str = "", head: str = MEASURED) -> Test:
    (folder / "log.csv").write_text(text)
    return load(write(folder, f'{head}\n[measured]\nlog = "log.csv"\n{settings}\n'))


DRIVEN: Driven = [
    (0.02, 0, LOAD, 1.0), (0.02, 120, LOAD, 1.0), (0.05, 90, LOAD, 1.0), (0.05, 60, LOAD, 0.0),
    (0.05, 100, 2 * LOAD, 1.0), (-0.04, 80, LOAD, 0.5),
]  # fmt: skip


@pytest.mark.parametrize("ramp", [0, 3])
def test_steps_loads_speeds_and_pauses_are_read_from_the_log(tmp_path: Path, ramp: int) -> None:
    test = read(tmp_path, log_text(rows_of(DRIVEN[1:], ramp=ramp, noise=1e-5)), 'torque_zero = "as recorded"')
    history = test.experiment.history
    first = np.unique(history.step, return_index=True)[1]
    np.testing.assert_allclose(history.step_creepage, [0.02, 0.05, 0.0, 0.05, -0.04], rtol=0.02)
    np.testing.assert_array_equal(history.step_driven, [True, True, False, True, True])
    lengths = [history.duration[history.step == k].sum() for k in range(5)]
    np.testing.assert_allclose(lengths, [120, 90, 60, 100, 80], atol=ramp + 1.5)
    np.testing.assert_allclose(history.load_factor[first][[0, 1, 3, 4]], [1, 1, 2, 1], rtol=0.02)
    np.testing.assert_allclose(history.speed_factor[first], [1, 1, 0, 1, 0.5], rtol=0.02)
    (count,) = test.rows
    assert count.used + sum(count.left_out.values()) == count.read == 450
    assert count.left_out["standing still"] == 60
    assert "the history found in it:\n[history]\nrevolutions_per_iteration = " in "".join(count.notes)
    assert "pause_s = 6" in "".join(count.notes)
    samples = test.experiment.measured.traction
    assert samples is not None
    off = ZERO / (RADIUS * LOAD * history.load_factor[first][samples.step])
    np.testing.assert_allclose(
        samples.ratio - off, MU * np.sign(history.step_creepage[samples.step]), atol=5 * 0.004 / (RADIUS * LOAD)
    )


def test_the_history_that_is_printed_reads_the_same_log(tmp_path: Path) -> None:
    text = log_text(rows_of(DRIVEN[1:], noise=1e-5))
    found = read(tmp_path, text)
    (told,) = (note.partition("\n")[2] for note in found.rows[0].notes if note.startswith("the history found"))
    again = read(tmp_path, text, head=MEASURED.replace('history = "measured"\n', "") + told)
    mine, other = found.experiment.measured.traction, again.experiment.measured.traction
    assert mine is not None
    assert other is not None
    for step in np.unique(mine.step):
        assert other.ratio[other.step == step].mean() == pytest.approx(mine.ratio[mine.step == step].mean(), rel=0.01)


def test_mu_and_zero_from_both_directions(tmp_path: Path) -> None:
    both: Driven = [(c, 168, LOAD, 1.0) for c in (0.02, 0.04)] + [(-c, 168, LOAD, 1.0) for c in (0.02, 0.04)]
    test = read(tmp_path, log_text(rows_of(both)))
    zero, (count,) = test.experiment.measured.torque_zero, test.rows
    assert zero is not None
    assert abs(zero.value * zero.unit) == pytest.approx(ZERO, abs=2e-3)
    assert 0.0 < zero.std * abs(zero.unit) < 2e-3
    assert zero.taken_off
    assert "from slip both ways, taken off" in "".join(count.notes)
    assert count.read == 672
    assert count.used + sum(count.left_out.values()) == 672
    found = identify_friction(ForwardModel(test.experiment))
    np.testing.assert_allclose(found.mu, MU, rtol=0.005)
    np.testing.assert_allclose(np.sign(found.ratio), [1, 1, -1, -1])
    left_in = read(tmp_path, log_text(rows_of(both)), 'torque_zero = "as recorded"').experiment.measured
    assert left_in.traction is not None
    assert left_in.traction.ratio[left_in.traction.step == 0].mean() == pytest.approx(
        MU + ZERO / (LOAD * RADIUS), rel=0.005
    )
    assert left_in.torque_zero is not None
    assert not left_in.torque_zero.taken_off


@pytest.mark.parametrize(("cell", "setting"), [("", ""), ("NaN", ""), ("1.25", 'skip = "1.25"')])
def test_rows_without_a_torque_that_run_under_load_are_no_pause(tmp_path: Path, cell: str, setting: str) -> None:
    """At a change of step, where neither is known to end; the rest without load at 150 s, in which it lacks too, is."""
    driven: Driven = [(0.02, 80, LOAD, 1.0), (0.05, 70, LOAD, 1.0), (0.05, 40, 0.0, 1.0), (0.03, 90, LOAD, 1.0)]
    head, *rows = log_text(rows_of(driven)).split("\n")
    cells = [row.split(",") for row in rows]
    for row in (*range(65, 95), *range(160, 180)):
        cells[row][3] = cell
    (tmp_path / "log.csv").write_text("\n".join([head, *map(",".join, cells)]))
    source = f'\n[measured]\nlog = {{ file = "log.csv"{setting and ", "}{setting} }}\n'
    test = load(write(tmp_path, MEASURED + source))
    history, samples, (count,) = test.experiment.history, test.experiment.measured.traction, test.rows
    lengths = [history.duration[history.step == k].sum() for k in range(4)]
    np.testing.assert_allclose(lengths, [80, 70, 40, 90])
    np.testing.assert_array_equal(history.step_driven, [True, True, False, True])
    assert count.left_out["no number"] == 50
    assert count.left_out["unloaded"] == 20
    assert count.used + sum(count.left_out.values()) == count.read == 280
    assert samples is not None
    assert np.isfinite(samples.ratio).all()
    assert not np.any((samples.time > 65.0) & (samples.time < 95.0))


def test_a_load_signal_that_drops_out_is_no_pause(tmp_path: Path) -> None:
    """Over the change of creepage between two steps."""
    rows = rows_of([(0.02, 30, 0.0, 1.0), (0.02, 80, LOAD, 1.0), (0.05, 70, LOAD, 1.0)])
    rows[95:130, 4] = 0.0
    history = read(tmp_path, log_text(rows)).experiment.history
    np.testing.assert_allclose([history.duration[history.step == k].sum() for k in range(2)], [80, 70])
    np.testing.assert_array_equal(history.step_driven, [True, True])


def test_rows_without_a_torque_that_stand_out_of_order_are_left_out(tmp_path: Path) -> None:
    head, *rows = log_text(rows_of(DRIVEN[1:3])).split("\n")
    (count,) = read(tmp_path, "\n".join([head, *rows[:50], rows[49].split(",")[0] + ",3030,2970,,72", *rows[50:]])).rows
    assert count.left_out["no number"] == 1
    assert count.used == 210


def test_a_log_without_a_torque_under_load_is_refused(tmp_path: Path) -> None:
    rows = [[*map(str, row)] for row in rows_of([(0.02, 80, 0.0, 1.0), (0.02, 40, LOAD, 1.0)])]
    head = log_text(rows_of(DRIVEN[1:2])).split("\n")[0]
    text = "\n".join([head, *(",".join([*row[:3], "" if float(row[4]) else row[3], row[4]]) for row in rows)])
    with pytest.raises(MeasurementError, match=r"torque \[N m\]: no reading of it is left under load"):
        read(tmp_path, text)


def test_a_step_whose_torque_is_at_the_limit_of_its_instrument_is_in_the_history(tmp_path: Path) -> None:
    rows = rows_of([(0.02, 80, LOAD, 1.0), (0.05, 70, 1.5 * LOAD, 1.0), (0.03, 90, LOAD, 1.0)])
    rows[:, 3] = np.minimum(rows[:, 3], 1.4)
    test = read(tmp_path, log_text(rows))
    history, samples = test.experiment.history, test.experiment.measured.traction
    np.testing.assert_allclose(history.step_creepage, [0.02, 0.05, 0.03], rtol=1e-6)
    np.testing.assert_allclose([history.duration[history.step == k].sum() for k in range(3)], [80, 70, 90])
    assert samples is not None
    assert set(samples.step) == {0, 2}
    assert "no row is left of step 2 (5 %): the torque there is not known" in test.rows[0].notes


def test_a_step_at_another_load_is_found_on_a_given_history(tmp_path: Path) -> None:
    steps = f"steps = [{{ creepage_percent = 5.0 }}, {{ creepage_percent = 5.0, normal_load_N = {2 * LOAD} }}]\n"
    text = VALID[: VALID.index("steps = [")] + steps
    rows = log_text(rows_of([(0.05, 84, LOAD, 1.0), (0.05, 84, 2 * LOAD, 1.0)]))
    samples = read(tmp_path, rows, head=text).experiment.measured.traction
    assert samples is not None
    assert np.bincount(samples.step) == pytest.approx([19, 19], abs=2)
    with pytest.raises(MeasurementError, match="the load in step 2 is 144 N, the definition says 288 N"):
        read(tmp_path, rows, head=text.replace("144", "288"))
    says = r"normal load \[N\]: no stretch of the log runs at the 5 % and 500 N of step 1: at 5 % the load is 108 N"
    with pytest.raises(MeasurementError, match=says):
        read(
            tmp_path,
            rows,
            head=text.replace("{ creepage_percent = 5.0 }", "{ creepage_percent = 5.0, normal_load_N = 500.0 }"),
        )
    slower = text.replace("{ creepage_percent = 5.0 }", "{ creepage_percent = 5.0, mean_speed_rpm = 300.0 }")
    with pytest.raises(MeasurementError, match=r"at the 5 % and 0\.9425 m/s of step 1: at 5 % the mean speed is 9\.42"):
        read(tmp_path, rows, head=slower)


@given(
    levels=st.lists(st.sampled_from([-0.08, -0.04, -0.02, 0.01, 0.02, 0.04, 0.08]), min_size=1, max_size=8),
    lengths=st.lists(st.integers(20, 60), min_size=8, max_size=8),
    pauses=st.lists(st.booleans(), min_size=8, max_size=8),
    seed=st.integers(0, 1000),
)
@settings(max_examples=60, deadline=None)
def test_any_staircase_is_found(levels: list[float], lengths: list[int], pauses: list[bool], seed: int) -> None:
    rng = np.random.default_rng(seed)
    time, creepage, begin = [], [], 0.0
    wanted: list[tuple[float, float]] = []
    for place, level in enumerate(levels):
        length, paused = lengths[place], bool(pauses[place] and place)
        begin += 30.0 if paused else 0.0
        time.append(begin + np.arange(length))
        creepage.append(np.full(length, level))
        begin += length
        same = bool(wanted) and wanted[-1][0] == level and not paused
        wanted[-1:] = [(level, wanted[-1][1] + length)] if same else [*wanted[-1:], (level, length)]
    t, c = np.concatenate(time), np.concatenate(creepage)
    c = c * (1.0 + 0.01 * rng.standard_normal(len(c)))
    seen = Seen(t, c, np.full(len(t), SPEED), np.full(len(t), 72.0), np.zeros(len(t), dtype=np.int64))
    history = find_steps(seen, RIG).history
    driven = history.step_driven
    lengths_found = np.array([history.duration[history.step == k].sum() for k in np.flatnonzero(driven)])
    np.testing.assert_allclose(history.step_creepage[driven], [level for level, _ in wanted], rtol=0.02)
    np.testing.assert_allclose(lengths_found, [length for _, length in wanted], atol=1e-6)
    assert history.end_time[-1] == pytest.approx(begin)


@pytest.mark.parametrize("scatter", [0.0, 0.003])
@pytest.mark.parametrize("falls", [False, True])
def test_a_ramp_is_parted_into_steps_over_which_it_changes_little(scatter: float, falls: bool) -> None:
    """What a step has is its mean: over each twentieth of the ramp the heat of the steps is that of the ramp to 1 %."""
    t = np.arange(900) + 0.5
    ramp = (0.003 + 0.047 * t / 900.0)[:: -1 if falls else 1]
    c = ramp + scatter * 0.01 * np.random.default_rng(0).standard_normal(len(t))
    seen = Seen(t, c, np.full(len(t), SPEED), np.full(len(t), 72.0), np.zeros(len(t), dtype=np.int64))
    history = find_steps(seen, RIG).history
    found = history.creepage[history.iteration_at(t)]
    np.testing.assert_allclose(found[ramp > 0.01], ramp[ramp > 0.01], rtol=0.025)
    parts = [np.array_split(values, 20) for values in (found, ramp)]
    np.testing.assert_allclose(*([part.mean() for part in of] for of in parts), rtol=0.01)


LEWIS = """# Twin-disc, R8T wheel steel on UIC60 900A rail steel, 1500 MPa, 400 rpm, dry; derived from a table
slip_percent,heat_W,T_b_C,T_over_N_derived
0.2,1.3,20.6,0.091
0.5,9.2,22.9,0.258
1,25.7,27.5,0.361
3,102.6,48.6,0.480
7.5,246.0,89.0,0.461
10,327.8,111.9,0.460
15,492.1,136.8,0.461
20,728.4,202.1,0.512
"""


def test_a_curve_without_time_makes_its_steps(tmp_path: Path) -> None:
    named = '\n[measured]\ntraction = "traction.csv"\ncolumns.traction_ratio = { column = "T_over_N_derived" }\n'
    (tmp_path / "traction.csv").write_text(LEWIS)
    test = load(write(tmp_path, MEASURED + named))
    np.testing.assert_allclose(
        100.0 * test.experiment.history.step_creepage, [0.2, 0.5, 1, 3, 7.5, 10, 15, 20], rtol=1e-12
    )
    samples = test.experiment.measured.traction
    assert samples is not None
    np.testing.assert_array_equal(samples.step, np.arange(8))
    assert np.all(np.isnan(samples.time))
    assert "a curve without time" in "".join(test.rows[0].notes)
    assert "slip_percent taken for creepage (columns.creepage overrules)" in test.rows[0].notes


def test_scattered_points_fall_into_levels(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    creepage = np.concatenate([[-0.1, 0.0, 0.0], np.exp(rng.uniform(np.log(0.3), np.log(20.0), 150))])
    rows = "".join(f"{c:.5f},{0.3 * np.sign(c):.3f}\n" for c in creepage)
    test = load(write(tmp_path, MEASURED, traction=f"creepage [%],traction ratio\n{rows}"))
    samples, levels = test.experiment.measured.traction, test.experiment.history.step_creepage
    assert samples is not None
    assert 15 <= len(levels) <= 22
    assert np.all(np.diff(levels) > 0.0)
    assert np.all(np.bincount(samples.step) > 0)
    assert np.sum(levels == 0.0) == 1


BALL = """schema = 1
history = "measured"
[test]
name = "ball"
[rig]
normal_load_N = 50.0
rolling_speed_m_s = 0.2
disc1 = { rolling_radius_mm = inf, transverse_radius_mm = inf }
disc2 = { rolling_radius_mm = 9.525, transverse_radius_mm = 9.525 }
[material]
youngs_modulus_GPa = 207.0
poisson_ratio = 0.29
hardness_HV = 760
[measured]
log = "log.csv"
"""


def sweeps() -> str:
    """Two traction sweeps of a ball on disc in full sliding at T/N = 0.05, minutes between them."""
    lines = ["# sweeps", "sweep,point,time [s],slide-roll ratio [%],traction force [N],load [N],rolling speed [mm/s]"]
    for sweep in (1, 2):
        for point, ratio in enumerate([*np.linspace(20, 5, 16), *np.linspace(5, 20, 16)], start=1):
            time, load_N = 400.0 * (sweep - 1) + 6.0 * point, 50.0 + 0.3 * np.sin(point)
            lines.append(f"{sweep},{point},{time:.1f},{ratio:.3f},{0.05 * load_N:.5f},{load_N:.4f},200.0")
    return "\n".join(lines)


def timed_steps() -> str:
    """Three timed steps at a slide-roll ratio of 100 %, each with a clock of its own; T/N = 0.02 grows by 0.01."""
    lines = ["step,type,zero_N,t_s,mu,T_pot_C,load_ball_N,load_pin_N,rolling_mm_s,sliding_mm_s,SRR_pct,disc_Hz,Ft_N"]
    for step in (2, 4, 6):
        mu = 0.02 + 0.005 * (step - 2)
        lines += [f"{step},TIMED,-0.5,{t}.0,{mu},115.2,49.9,,200.1,200.0,{100 + 0.1 * np.sin(t):.3f},,{50 * mu:.4f}"
                  for t in range(1, 101)]  # fmt: skip
    return "\n".join(lines)


def test_sweeps_of_a_ball_on_disc_are_read_as_they_are(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text(sweeps())
    test = load(write(tmp_path, BALL))
    history, samples, (count,) = test.experiment.history, test.experiment.measured.traction, test.rows
    assert samples is not None
    np.testing.assert_allclose(samples.ratio, 0.05, rtol=1e-4)
    assert count.used == count.read == 64
    pauses = history.duration[~history.driven]
    np.testing.assert_allclose(pauses, [400.0 - 6.0 * 32], rtol=1e-6)
    assert history.step_creepage.max() == pytest.approx(0.2, rel=0.15)


def test_timed_steps_of_a_ball_on_disc_are_read_as_they_are(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text(timed_steps())
    test = load(write(tmp_path, BALL))
    history, samples, notes = test.experiment.history, test.experiment.measured.traction, test.rows[0].notes
    assert samples is not None
    np.testing.assert_allclose(history.step_creepage, [1.0, 1.0, 1.0], rtol=1e-3)
    assert history.end_time[-1] == pytest.approx(300.0)
    np.testing.assert_allclose(samples.ratio, np.array([0.02, 0.03, 0.04])[samples.step], rtol=1e-6)
    assert "the time begins anew with each step, and is counted on" in notes
    assert "no load in it, so that of the definition: 50 N" in notes
    assert "SRR_pct taken for creepage (columns.creepage overrules)" in notes


def test_torque_that_no_contact_has_is_a_mistake_of_the_unit(tmp_path: Path) -> None:
    text = log_text(rows_of(DRIVEN[1:3])).replace("torque [N m]", "torque [kN m]")
    with pytest.raises(MeasurementError, match=r"T/N of .* cannot be, and so in 210 of 210 rows; check the units"):
        read(tmp_path, text)
    with pytest.raises(MeasurementError, match=r"rows; check the units, torque_disc and torque_zero$"):
        read(tmp_path, log_text(rows_of(DRIVEN[1:3])), "torque_zero = 20.0")
    rows = rows_of(DRIVEN[1:3])
    rows[50, 3] = 400.0
    (count,) = read(tmp_path, log_text(rows)).rows
    assert count.left_out["outlier"] == 1


def test_every_command_takes_a_history_that_was_found(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = "[model]\nwear_coefficient = 7e-5\n"
    path = read(tmp_path, log_text(rows_of(DRIVEN[1:])), head=MEASURED + model).path
    for command in ("identify-mu", "friction-chart", "simulate-wear", "check"):
        with pytest.raises(SystemExit) as stop:
            main([command, str(path), "--json", "-o", str(tmp_path)])
        out, err = capsys.readouterr()
        assert stop.value.code == 0, err
        assert "creepage_percent" in json.dumps(json.loads(out)["rows"][0]["notes"])


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (MEASURED, '"measured" needs a log or a traction under [measured]'),
        (MEASURED.replace('"measured"', '"mesured"'), 'history: must be a table, or "measured": read from the log'),
    ],
)
def test_a_history_that_cannot_be_read_is_told(tmp_path: Path, text: str, says: str) -> None:
    with pytest.raises(DefinitionError) as error:
        load(write(tmp_path, text))
    assert says in str(error.value)
    with pytest.raises(DefinitionError, match="there is no step 9; the history found has 2"):
        read(tmp_path, log_text(rows_of(DRIVEN[1:3])), head=MEASURED + "[loop]\nhold_out_steps = [9]\n")
