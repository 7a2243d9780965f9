"""Mass as a channel of the loop, and K of a rig whose discs are only weighed, on tests that other code made."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import suros
from suros import Truth

from twindisc_cli.commands import check, fit_k
from twindisc_cli.definition import load
from twindisc_cli.loop.channels import measured_channels
from twindisc_cli.loop.diagnose import diagnose
from twindisc_cli.loop.diagnosis import Diagnosis
from twindisc_cli.model.experiment import Experiment


def diagnosed(test: Experiment) -> Diagnosis:
    return diagnose([test], validate=None, progress=lambda stage, part: None, quick=True)


def test_what_fastsim_is_off_by_counts_as_an_error_of_the_model(tmp_path: Path) -> None:
    """On Carter's own data (mu = 0.42): no effect in its place, the truth in the interval, and a note."""
    path = suros.write(tmp_path, Truth())
    path.write_text(path.read_text().replace('traction = "exact"', 'traction = "fastsim"'))
    test = load(path).experiment
    found = diagnosed(test)
    assert not found.effects and not found.laws
    assert found.base["mu"].low < 0.42 < found.base["mu"].high
    assert abs(found.base["mu"].value - 0.42) > 0.003  # which the interval of the noise alone would leave out
    assert any("FASTSIM is an approximation" in note for note in found.notes)


@pytest.mark.parametrize(("seed", "k"), [(1, 3.7e-4), (2, 4e-5), (3, 1.2e-4)])
def test_k_from_mass_alone(tmp_path: Path, seed: int, k: float) -> None:
    """Within 2 %, though the radii shrink and the creepage drifts with them."""
    test = load(suros.write(tmp_path, Truth(k=k, balance_mg=0.1), seed))
    found = fit_k.run(test)
    assert found.json["K"] == pytest.approx(k, rel=0.02)
    assert found.json["method"] == "mass"
    assert found.undefined == []


def test_the_loop_uses_mass_as_any_channel(tmp_path: Path) -> None:
    test = load(suros.write(tmp_path, Truth())).experiment
    assert measured_channels(test) == ("traction", "mass")
    found = diagnosed(test)
    assert found.verdict == "no_missing_effect"
    assert found.base["K"].value == pytest.approx(3.7e-4, rel=0.02)
    assert found.errors["mass"].unit == "mg"
    assert found.errors["mass"].after < 3 * 0.3


def test_a_second_disc_that_wears_is_found_by_weight(tmp_path: Path) -> None:
    """Disc 1 bears 2 of 5.7 parts."""
    found = diagnosed(load(suros.write(tmp_path, Truth(k_disc1=2e-4))).experiment)
    (effect,) = found.effects
    assert effect.name == "wear_partition"
    assert effect.parameters["disc1_share"].value == pytest.approx(2 / 5.7, rel=0.02)
    assert found.base["K"].value == pytest.approx(5.7e-4, rel=0.03)
    by_disc = fit_k.run(load(tmp_path / "suros.toml")).json["K_of_discs"]
    assert by_disc["1"] == pytest.approx(2e-4, rel=0.02)
    assert by_disc["2"] == pytest.approx(3.7e-4, rel=0.02)


def test_a_law_of_the_wear_is_found_by_weight_alone(tmp_path: Path) -> None:
    """K goes as a power of the creepage, which rises over the test: over which covariate cannot be separated."""
    found = diagnosed(load(suros.write(tmp_path, Truth(power=-0.7, blocks_weighed=1))).experiment)
    assert not found.effects
    (law,) = found.laws
    assert (law.law.quantity, law.channel) == ("wear", "mass")
    assert found.errors["mass"].after < 0.2 * found.errors["mass"].before


def test_profile_and_mass_share_one_k(tmp_path: Path) -> None:
    test = load(suros.write(tmp_path, Truth(), profile_factor=1.0)).experiment
    found = diagnosed(test)
    assert found.base["K"].value == pytest.approx(3.7e-4, rel=0.02)
    assert {"profile", "mass"} <= set(found.errors)


def test_profile_and_mass_that_contradict_are_told(tmp_path: Path) -> None:
    for discs in (Truth(), Truth(k_disc1=2e-4)):
        test = load(suros.write(tmp_path, discs, profile_factor=2.0))
        (told,) = [f for f in check.findings(test.experiment) if f.rule == "mass and profile"]
        assert not told.ok
        assert any("contradiction: K by weight is 0.5" in line for line in fit_k.run(test).json["findings"])
        assert fit_k.run(test).figure() is not None


def test_the_wear_rate_is_that_of_the_railways(tmp_path: Path) -> None:
    """K rho / H over T gamma / A, in ug/m/mm2 and N/mm2, from weighing to weighing."""
    truth = Truth(balance_mg=1e-3)
    found = fit_k.run(load(suros.write(tmp_path, truth))).json
    index = np.array([row["Tgamma_over_A_N_mm2"] for row in found["wear_rates"]])
    rate = np.array([row["wear_rate_ug_m_mm2"] for row in found["wear_rates"]])
    area = 2e3 * suros.half_length(suros.RADIUS, suros.RADIUS) * 10.0  # mm2
    traction = [
        suros.traction_ratio(truth.mu, c / 100, suros.RADIUS, suros.RADIUS) * suros.LOAD for c in suros.CREEPAGE
    ]
    assert index == pytest.approx(np.array(traction) * np.array(suros.CREEPAGE) / 100 / area, rel=0.02)
    # kg/m3 per Pa is s2/m2; 1 kg/m3 = 1e3 ug/m/mm2, 1 N/mm2 = 1e6 Pa
    assert rate / index == pytest.approx(np.full(5, truth.k * suros.DENSITY / suros.HARDNESS * 1e9), rel=0.05)


def test_regimes_are_marked_where_the_data_show_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """K jumps fivefold at 12 N/mm2."""
    creepage = (0.3, 0.4, 0.5, 0.7, 0.9, 1.2, 1.6, 2.0, 2.5, 3.0, 4.0, 5.0, 6.5, 8.0)
    monkeypatch.setattr(suros, "CREEPAGE", creepage)
    steps = ", ".join(f"{{ creepage_percent = {c}, iterations = 2 }}" for c in creepage)
    lines = [f"steps = [{steps}]" if line.startswith("steps") else line for line in suros.DEFINITION.split("\n")]
    monkeypatch.setattr(suros, "DEFINITION", "\n".join(lines))
    truth = Truth(k=1e-4, severe=5.0, critical=12.0, balance_mg=0.02)
    found = fit_k.run(load(suros.write(tmp_path, truth)))
    (place,) = found.json["regimes_from_N_mm2"]
    assert 10.0 < place < 16.0
    assert any("2 regimes" in line for line in found.summary)
    even = fit_k.run(load(suros.write(tmp_path, replace(truth, severe=1.0))))
    assert even.json["regimes_from_N_mm2"] == []


@pytest.mark.parametrize("debris_mg", [0.0, 9.0])
def test_a_weighing_with_debris_on_the_disc_is_named(tmp_path: Path, debris_mg: float) -> None:
    """The weighing in the middle of the test is too heavy by thirty standard deviations of the balance."""
    test = load(suros.write(tmp_path, Truth(balance_mg=0.3))).experiment
    mass = test.measured.mass
    assert mass is not None
    at = len(mass.loss) // 2
    heavy = replace(mass, loss=mass.loss - 1e-6 * debris_mg * (np.arange(len(mass.loss)) == at))
    found = diagnosed(replace(test, measured=replace(test.measured, mass=heavy)))
    time = test.history.end_time[mass.iteration[at] - 1]
    named = [note for note in found.notes if f"one sample of the mass lost, at {time:.6g} s, lies" in note]
    assert len(named) == (debris_mg > 0.0)
    assert sum("one sample of the mass lost" in note for note in found.notes) == len(named)
