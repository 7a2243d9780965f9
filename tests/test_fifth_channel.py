"""From an empty folder: a channel of vibration, and friction that falls with the distance slid, by one file each.

    a = g P,   P = mu N v V,   mu = 0.6 [1 - 0.3 (1 - exp(-s / 100 m))]

The two files below are all that the program is given of them; every command is run as a user runs it.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np
import pytest
from rigs import LOAD, SPEED, Plant, history, running, spread

from twindisc_cli import effects, plugins
from twindisc_cli.cli import main
from twindisc_cli.commands import close_loop
from twindisc_cli.definition import load
from twindisc_cli.loop import channels

VIBRATION = '''"""Vibration: RMS of the acceleration of the housing, in proportion to the dissipated power."""

from dataclasses import dataclass

import numpy as np

from twindisc_cli.loop.channels._channel import Base, Channel, File, FileColumn
from twindisc_cli.loop.channels._held_out import held_out_samples
from twindisc_cli.loop.generic import smooth
from twindisc_cli.loop.noise_estimate import estimate
from twindisc_cli.loop.trends import polynomials
from twindisc_cli.identify.energy import measured_energy
from twindisc_cli.quantities import Quantity


@dataclass(frozen=True)
class Vibration:
    time: np.ndarray
    rms: np.ndarray


def samples(test):
    return test.measured.others.get("vibration")


def step(test):
    return test.history.step[test.history.iteration_at(samples(test).time)]


def noise(test):
    of = samples(test)
    trends = [polynomials(of.time, step(test), 2, 4)]
    return estimate(of.rms, trends, of.time, np.zeros_like(step(test)), float(np.ptp(of.rms)), correlated=False)


def guess(model):
    test = model.experiment
    power = measured_energy(test) / test.history.end_time[-1]
    return np.nan if samples(test) is None else float(samples(test).rms.mean() / power)


def predicted(model, prediction):
    return prediction.own["gain"] * model.read_at(samples(model.experiment).time, prediction.state.power)


CHANNEL = Channel(
    name="vibration",
    label="vibration",
    quantity=Quantity("vibration", "a", "vibration RMS", "m s-2"),
    order=4,
    assumed_noise=0.5,
    file=File(
        (FileColumn("time", "s"), FileColumn("vibration RMS", "m s-2", lower=0.0)),
        lambda columns, history: Vibration(columns["time"], columns["vibration RMS"]),
    ),
    parameters=(Base("gain", "m s-2 W-1", 1e-4, 1e3, guess, meaning="vibration per power"),),
    samples=samples,
    values=lambda of: of.rms,
    predicted=predicted,
    noise=noise,
    generic=lambda model, prediction: iter([("time", "smooth", smooth(samples(model.experiment).time, 5))]),
    withheld=lambda test, steps: held_out_samples(test, step(test), samples(test).time, steps),
    covariates=lambda model, prediction: {"time": samples(model.experiment).time},
    planned=lambda test, times, half_width: Vibration(times, np.zeros(len(times))),
)
'''
SOFTENING = '''"""Softening by sliding: the coefficient of friction falls with the distance slid.

    mu(s) = mu_0 [1 - d (1 - exp(-s / s_0))]

    s    distance slid so far [m], (set, point)
    d    relative fall of mu [1]; d = 0 switches the effect off
    s_0  distance of the fall [m]

Leaves behind, when it is missing: a traction residual that falls with the distance slid.
Valid for: surfaces that are smoothed by sliding.
"""

import numpy as np

from twindisc_cli.effects._effect import Effect, Param


def apply(s, *, fall, distance_m):
    return s.replace(mu=s.mu * (1.0 + fall * np.expm1(-s.sliding_distance / distance_m)))


EFFECT = Effect(
    stage="friction",
    params=(
        Param("fall", "1", off=0.0, start=0.2, lower=-2.0, upper=0.95, meaning="relative fall of mu"),
        Param("distance_m", "m", start=50.0, lower=1.0, upper=1e4, meaning="distance of the fall", log=True),
    ),
    apply=apply,
    over="sliding_distance",
    source="made up for a test, 2026",
)
'''
DEFINITION = """\
schema = 1

[test]
name = "small"

[rig]
normal_load_N = 72.0
rolling_speed_m_s = 9.42
disc1 = { rolling_radius_mm = 30.0, transverse_radius_mm = inf }
disc2 = { rolling_radius_mm = 30.0, transverse_radius_mm = 30.0 }

[material]
youngs_modulus_GPa = 206.0
poisson_ratio = 0.30
hardness_HV = 700

[history]
revolutions_per_iteration = 4199.0
steps = [
  { creepage_percent = 3.0, iterations = 2 },
  { creepage_percent = 9.0, iterations = 2 },
  { creepage_percent = 1.5, iterations = 2 },
  { creepage_percent = 6.0, iterations = 2 },
  { creepage_percent = 2.0, iterations = 2 },
]

[model]
wear_coefficient = 1e-6

[measured]
traction = "traction.csv"
vibration = "vibration.csv"
provenance = "synthetic"

[loop]
channels = "channels"
"""
GAIN, FALL, DISTANCE = 0.5, 0.3, 100.0
SIGMA = 0.2
CREEPAGES = (0.03, 0.09, 0.015, 0.06, 0.02)


def recorded(fall: float) -> dict[str, str]:
    """The files of a test in which friction falls with the distance slid, by the simulator of the tests."""
    course = history(CREEPAGES, 2, duration=4199.0 * 2.0 * np.pi * 0.03 / SPEED)
    slid = np.cumsum(course.creepage * SPEED * course.duration)

    def mu(time: np.ndarray, creepage: np.ndarray, cycles: np.ndarray) -> np.ndarray:
        way = np.interp(time, [0.0, *course.end_time], [0.0, *slid])
        return np.asarray(0.6 * (1.0 + fall * np.expm1(-way / DISTANCE)))

    rng, time = np.random.default_rng(11), spread(course, 8)
    at, ratio = running(course, time), Plant(course, mu=mu).traction(time)
    power = ratio * LOAD * SPEED * course.creepage[at]
    ratio = ratio + 0.003 * rng.standard_normal(len(time))
    vibration = GAIN * power + SIGMA * rng.standard_normal(len(time))
    rows = zip(time, 100.0 * course.creepage[at], ratio, strict=True)
    traction = "".join(f"{t:.6f},{v:g},{r:.9f}\n" for t, v, r in rows)
    millimetres = "".join(f"{t:.6f},{1e3 * a:.6f}\n" for t, a in zip(time, vibration, strict=True))
    return {
        "traction.csv": f"time [s],creepage [%],traction ratio [1]\n{traction}",
        "vibration.csv": f"time [s],vibration RMS [mm/s2]\n{millimetres}",
    }


def exit_code(*arguments: object) -> int:
    with pytest.raises(SystemExit) as left:
        main([*(str(a) for a in arguments), "--trust-effects"])
    assert isinstance(left.value.code, int)
    return left.value.code


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """An empty folder, with the definition, its data and the file of the channel."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "channels").mkdir()
    (tmp_path / "channels/vibration.py").write_text(VIBRATION)
    (tmp_path / "small.toml").write_text(DEFINITION)
    for name, text in recorded(0.0).items():
        (tmp_path / name).write_text(text)
    plugins.trust()
    yield tmp_path
    plugins.forget_trust()
    channels.forget_folders()
    effects.forget_folders()


def told(capsys: pytest.CaptureFixture[str]) -> dict[str, object]:
    found: dict[str, object] = json.loads(capsys.readouterr().out)
    return found


@pytest.mark.parametrize("command", ["check", "identify-mu", "friction-chart", "simulate-wear", "contact"])
def test_every_command_reads_it(folder: Path, command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert exit_code(command, "small.toml", "--json") in (0, 5)
    out = told(capsys)
    assert {row["file"]: row["used"] for row in out["rows"] if "vib" in row["file"]} == {"vibration.csv": 80}  # type: ignore[attr-defined]
    if command == "check":
        shown = out["measured"]["vibration"]  # type: ignore[index]
        assert (shown["samples"], shown["range"]["unit"]) == (80, "m s-2")
        assert shown["range"]["high"] == pytest.approx(GAIN * 0.6 * LOAD * SPEED * 0.09, rel=0.03)


def test_close_loop_has_it_from_the_file_to_the_figure(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Nothing is missing here: its gain is found, and stands in every file with its unit."""
    assert exit_code("close-loop", "small.toml", "--quick", "--json") == 0
    out = told(capsys)
    assert out["verdict"] == "no_missing_effect"
    error, gain = out["error"]["vibration"], out["base"]["gain"]  # type: ignore[index]
    assert error["unit"] == "m s-2"
    assert error["after"] == pytest.approx(SIGMA, rel=0.3)
    assert gain["low"] < GAIN < gain["high"]
    assert gain["high"] - gain["low"] < 0.05 * GAIN
    results = folder / "results/small"
    with h5py.File(results / "close-loop.h5") as file:
        assert file["base_gain"][0] == pytest.approx(gain["value"])
        assert file["base_gain"].attrs["units"] == "m s-2 W-1"
        assert file["vibration_measured"].shape == (80,)
        assert file["vibration_measured"].attrs["units"] == "m s-2"
    assert "vibration per power" in (results / "close-loop.html").read_text()
    assert (results / "close-loop.png").stat().st_size > 20_000
    revised = load(results / "revised.toml").experiment
    assert revised.own_parameters["gain"] == pytest.approx(gain["value"], rel=1e-6)
    assert revised.measured.others["vibration"].rms.max() < 100.0


def test_its_panel_is_drawn(folder: Path) -> None:
    result = close_loop.run([load(folder / "small.toml")], None, lambda stage, part: None, quick=True)
    assert result.figure is not None
    labels = {axes.get_ylabel() for axes in result.figure().axes}
    assert {"vibration RMS [m s⁻²]", "synthetic\n− model [m s⁻²]"} <= labels


def test_friction_over_the_distance_slid_is_one_file(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "mine").mkdir()
    (folder / "mine/softening.py").write_text(SOFTENING)
    for name, text in recorded(FALL).items():
        (folder / name).write_text(text)
    (folder / "small.toml").write_text(DEFINITION + 'effects = "mine"\n')
    assert exit_code("close-loop", "small.toml", "--quick", "--json") == 0
    out = told(capsys)
    (found,) = out["effects"]  # type: ignore[misc]
    assert found["effect"] == "softening"
    assert found["parameters"]["fall"]["value"] == pytest.approx(FALL, abs=0.03)
    assert found["parameters"]["distance_m"]["value"] == pytest.approx(DISTANCE, rel=0.25)
    assert out["base"]["gain"]["value"] == pytest.approx(GAIN, rel=0.03)  # type: ignore[index]


def test_a_campaign_has_its_columns(folder: Path) -> None:
    assert exit_code("campaign", "check", "small.toml", "-o", "all") in (0, 5)
    with next((folder / "all").glob("campaign*.csv")).open(encoding="utf-8") as file:
        (row,) = csv.DictReader(file)
    assert float(row["measured vibration samples [1]"]) == 80
    assert float(row["measured vibration range high [m s-2]"]) == pytest.approx(18.3, rel=0.03)


def test_a_parameter_that_nothing_reads_is_told(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = folder / "channels/vibration.py"
    unread = VIBRATION.replace('prediction.own["gain"] *', "0.5 *")
    path.write_text(unread)
    assert exit_code("close-loop", "small.toml", "--quick") == 2
    assert "the channel vibration declares gain, which nothing reads" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("file", "old", "new", "says"),
    [
        ("vibration.csv", "[mm/s2]", "[N]", "unknown unit [N]"),
        ("vibration.csv", "vibration RMS", "vibration RNS", "did you mean vibration RMS"),
        ("vibration.csv", ",6", ",-6", "lies outside the range of it"),
        ("small.toml", "vibration =", "vibrations =", "did you mean vibration?"),
        ("small.toml", '"channels"', '"nowhere"', "loop.channels: nowhere is not a folder of channel files"),
        ("channels/vibration.py", "CHANNEL =", "OTHER =", "declares no channel: CHANNEL = Channel(...) is missing"),
    ],
)
def test_a_mistake_is_told(
    folder: Path, capsys: pytest.CaptureFixture[str], file: str, old: str, new: str, says: str
) -> None:
    text = (folder / file).read_text()
    assert old in text
    (folder / file).write_text(text.replace(old, new, 1))
    assert exit_code("check", "small.toml") in (2, 3)
    assert says in capsys.readouterr().err
