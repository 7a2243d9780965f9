"""The zero of the torque by its sections without load, and its error in the interval of mu."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import suros
from rigs import Floats
from suros import Truth
from test_import import command
from test_weighings import BLOCK

from twindisc_cli.commands import identify_mu
from twindisc_cli.definition import load
from twindisc_cli.measurement.torque_zero import Zero, find_zero, without_load_signal

NOISE, SECTION = 0.02, 12
COURSES = {
    "level": lambda t: 2.0 + 0.0 * t,
    "drift": lambda t: 2.0 - 1.2e-4 * t,
    "step": lambda t: np.where(t < 2600.0, 2.0, 2.6),
}


def recorded(course: Callable[[Floats], Floats], seed: int, sections: int = 5) -> tuple[Floats, Floats, Floats]:
    """Time, torque and load of blocks of 1000 s under load with rows without it before, between and after."""
    rng, time = np.random.default_rng(seed), np.arange(0.0, max(1000.0 * (sections - 1) + 120.0, 500.0), 10.0)
    load = np.where(time % 1000.0 < 10.0 * SECTION, 0.0, 100.0)
    return time, course(time) + NOISE * rng.standard_normal(len(time)) + 0.4 * load, load


def zero_of(course: Callable[[Floats], Floats], seed: int, sections: int = 5) -> Zero:
    zero = find_zero(*recorded(course, seed, sections), 100.0)
    assert zero is not None
    return zero


@pytest.mark.parametrize("kind", COURSES)
def test_the_zero_is_what_the_sections_show(kind: str) -> None:
    kinds = [zero_of(COURSES[kind], seed).kind for seed in range(40)]
    assert kinds.count(kind) >= 36


@pytest.mark.parametrize("kind", ["level", "drift"])
def test_the_error_is_that_of_the_zero(kind: str) -> None:
    """Distances from the truth, in standard errors, have a variance near 1."""
    at = np.array([300.0, 1500.0, 3700.0])
    zeros = [zero_of(COURSES[kind], seed) for seed in range(200)]
    off = np.array([(zero.at(at) - COURSES[kind](at)) / zero.std_at(at) for zero in zeros])
    assert 0.7 < float(np.sqrt(np.mean(off**2))) < 1.5


def test_a_step_at_an_unknown_time_is_uncertain_where_it_was() -> None:
    zero = zero_of(COURSES["step"], 1)
    assert zero.at(np.array([500.0, 3500.0])) == pytest.approx([2.0, 2.6], abs=0.03)
    assert float(zero.std_at(np.array([2500.0]))[0]) == pytest.approx(0.6 / np.sqrt(12.0), rel=0.1)
    assert float(zero.std_at(np.array([500.0]))[0]) < NOISE


def test_from_the_first_section_alone_and_the_last_of_two() -> None:
    one = zero_of(COURSES["level"], 1, sections=1)
    assert (one.kind, len(one.time), np.isnan(one.drift)) == ("level", 1, True)
    two = zero_of(COURSES["drift"], 1, sections=2)
    assert two.kind == "drift"
    assert two.between == pytest.approx(abs(two.drift) / 6.0)


@pytest.mark.parametrize("kind", COURSES)
@pytest.mark.parametrize("sections", [1, 2, 5])
def test_a_section_in_which_the_torque_stays_is_one_without_a_signal_of_the_load(kind: str, sections: int) -> None:
    """Either way, beside sections without load or as the only one; a zero that is off is none."""
    for way in (1.0, -1.0):
        _, torque, load = recorded(COURSES[kind], 1, sections)
        torque = torque * way
        assert not without_load_signal(torque, load, 100.0).any()
        lost = np.zeros(len(load), dtype=bool)
        lost[30:38] = True
        without = np.where(lost, 0.5, load)
        np.testing.assert_array_equal(without_load_signal(torque, without, 100.0), lost)
        alone = np.where(load == 0.0, 100.0, without)
        under_load = np.where(load == 0.0, torque + way * 40.0, torque)
        np.testing.assert_array_equal(without_load_signal(under_load, alone, 100.0), lost)


def test_sections_that_agree_are_a_zero_whatever_the_torque_under_load() -> None:
    """A friction of a third of the zero."""
    time, torque, load = recorded(lambda t: 120.0 + 0.0 * t, 1)
    assert not without_load_signal(torque, load, 100.0).any()
    zero = find_zero(time, torque, load, 100.0)
    assert zero is not None
    assert zero.torque == pytest.approx(np.full(5, 120.0), abs=0.02)


def test_the_error_of_the_zero_is_in_every_interval_of_mu(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Without it, it would be the scatter of the samples alone."""
    blocks = suros.raw_log(suros.run(Truth(), np.random.default_rng(1))[0])
    (tmp_path / "rig.txt").write_text(suros.raw_text([row for rows in blocks for row in rows]))
    (tmp_path / "block.toml").write_text(BLOCK)
    code, out, err = command("import", tmp_path / "rig.txt", tmp_path / "block.toml", "-o", tmp_path, capsys=capsys)
    assert code == 0, err
    assert " N m (one standard deviation), from 88 rows without load in 11 sections (" in out
    test = load(tmp_path / "rig.toml")
    result, zero = identify_mu.run(test), test.experiment.measured.torque_zero
    assert zero is not None
    assert zero.of_step[::2] == pytest.approx(np.full(10, zero.std), rel=0.6)
    half = result.dataset.arrays[2].values
    scatter = [np.std(test.experiment.measured.traction.ratio[test.experiment.measured.traction.step == s], ddof=1)
               / 5.0 * 1.711 for s in range(0, 19, 2)]  # fmt: skip
    np.testing.assert_allclose(half[::2], np.hypot(scatter, 1.645 * zero.of_step[::2]), rtol=2e-3)
    assert result.json["zero_std"] == pytest.approx(zero.of_step[::2].max())
    assert any("which is in every interval" in line for line in result.summary)
    for setting, said in (('"as recorded"', "is in no interval"), ("2.0", "as stated: its error is in no interval")):
        text = (tmp_path / "rig.toml").read_text().replace("[measured]\n", f"[measured]\ntorque_zero = {setting}\n")
        (tmp_path / "other.toml").write_text(text)
        other = identify_mu.run(load(tmp_path / "other.toml"))
        np.testing.assert_allclose(other.dataset.arrays[2].values[::2], scatter, rtol=0.2)
        assert other.json["zero_std"] is None
        assert any(said in line for line in other.summary)


def test_two_cylinders_go_by_the_exact_law_and_fastsim_by_its_error(tmp_path: Path) -> None:
    """Carter's data of mu = 0.42: exact by default; FASTSIM gives 0.51 at 0.5 %, and says that it may be 0.42."""
    path = suros.write(tmp_path, Truth(torque=0.001))
    text = path.read_text()
    path.write_text(text.replace('traction = "exact"\n', ""))
    default = load(path)
    assert default.experiment.options.traction == "exact"
    assert default.resolved["model"]["traction"] == "exact"
    mu = identify_mu.run(default).json["steps"]
    assert [step["mu"] for step in mu] == pytest.approx([0.42] * 5, abs=0.004)
    path.write_text(text.replace('"exact"', '"fastsim"'))
    named = identify_mu.run(load(path))
    first = named.json["steps"][0]
    assert first["mu"] > 0.5
    for step in named.json["steps"]:
        assert step["mu_low"] - 0.002 < 0.42 < step["mu_high"] + 0.002
    assert any("FASTSIM is an approximation on two cylinders" in line for line in named.summary)
    assert not any("FASTSIM" in line for line in identify_mu.run(default).summary)
