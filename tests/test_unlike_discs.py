"""Discs of unlike material: each with its own elasticity, hardness, density and K."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from definitions import VALID, write

from twindisc_cli.cli import main
from twindisc_cli.commands import contact, fit_k, simulate_wear
from twindisc_cli.definition import Test, load

K1, K2, HV = 3e-5, 8e-5, 9.80665e6
ALUMINIUM = """
[material.disc1]
youngs_modulus_GPa = 70.0
poisson_ratio = 0.33
hardness_HV = 120
density_kg_m3 = 2700
[material.disc2]
density_kg_m3 = 7850
"""


def pair(folder: Path, model: str = "", radius: float = 30.0, **data: str) -> Test:
    text = VALID.replace("[thermal]", ALUMINIUM + "\n[thermal]").replace("[model]\n", f"[model]\n{model}\n")
    text = text.replace("disc1 = { rolling_radius_mm = 30.0", f"disc1 = {{ rolling_radius_mm = {radius}")
    return load(write(folder, text, **data))


def arrays(result) -> dict[str, np.ndarray]:  # type: ignore[no-untyped-def]
    return {array.name: array.values for array in result.dataset.arrays}


@pytest.mark.parametrize("radius", [30.0, 60.0])
def test_each_disc_wears_by_its_own_k_and_hardness(tmp_path: Path, radius: float) -> None:
    """W_d = K_d E / H_d, around the rim of its own radius."""
    test = pair(tmp_path, f"wear_coefficient = {K2}\ndisc1_wear_coefficient = {K1}", radius)
    found = simulate_wear.run(test)
    energy = 1e3 * found.json["dissipated_energy_kJ"]
    worn = arrays(found)
    y = found.dataset.axes[1].values
    for name, k, hardness, rim in (("disc1_height", K1, 120 * HV, radius), ("height", K2, 700 * HV, 30.0)):
        volume = -2 * np.pi * rim * 1e-3 * np.trapezoid(worn[name][-1], y)
        assert volume == pytest.approx(k * energy / hardness, rel=1e-3)
    both = K1 * energy / (120 * HV) + K2 * energy / (700 * HV)
    assert found.json["worn_volume_mm3"] == pytest.approx(1e9 * both, rel=1e-3)


def test_k_of_each_disc_from_its_mass(tmp_path: Path) -> None:
    """Weighed against the energy of mu N v V t in the two steps that slide all over; densities differ."""
    known = pair(tmp_path, f"wear_coefficient = {K2}\ndisc1_wear_coefficient = {K1}")
    energy = 1e3 * simulate_wear.run(known).json["dissipated_energy_kJ"]
    lost = {1: 2700 * K1 * energy / (120 * HV) * 1e6, 2: 7850 * K2 * energy / (700 * HV) * 1e6}
    mass = "iteration,disc,mass loss [mg]\n" + "".join(f"5,{disc},{mg:.9g}\n" for disc, mg in lost.items())
    found = fit_k.run(pair(tmp_path, f"disc1_wear_coefficient = {K1}", mass=mass)).json
    assert found["K"] == pytest.approx(K2, rel=0.01)
    assert found["K_of_discs"]["1"] == pytest.approx(K1, rel=0.01)
    assert found["K_of_discs"]["2"] == pytest.approx(K2, rel=0.01)


def test_dundurs_second_constant_acts_in_the_exact_theory_and_is_told(tmp_path: Path) -> None:
    """beta of aluminium on steel, 1/2 [(1 - 2 nu1)/G1 - (1 - 2 nu2)/G2] / [(1 - nu1)/G1 + (1 - nu2)/G2]."""
    test = pair(tmp_path)
    g1, g2 = 70 / 2.66, 206 / 2.6
    beta = 0.5 * (0.34 / g1 - 0.4 / g2) / (0.67 / g1 + 0.7 / g2)
    assert test.experiment.rig.dundurs == pytest.approx(beta)
    found = contact.run(test, step=1)
    assert found.json["dundurs_beta"] == pytest.approx(beta)
    assert any("Dundurs" in line and "combined modulus" in line for line in found.summary)
    off = found.json["exact"]["T_over_N"] - found.json["exact_table"]["T_over_N"]
    assert 0.001 < abs(off) < 0.05
    like = contact.run(load(write(tmp_path)), step=1)
    assert like.json["exact"]["T_over_N"] == pytest.approx(like.json["exact_table"]["T_over_N"], abs=0.001)
    assert not any("Dundurs" in line for line in like.summary)


def test_unlike_discs_along_a_line(tmp_path: Path) -> None:
    """Carter has no beta: the half-space is solved, on the strip with its ends."""
    line = VALID.replace("transverse_radius_mm = 30.0", "transverse_radius_mm = inf, width_mm = 2.0")
    plain = contact.run(load(write(tmp_path, line)), step=1).json
    unlike = contact.run(load(write(tmp_path, line.replace("[thermal]", ALUMINIUM + "\n[thermal]"))), step=1).json
    assert plain["exact"]["T_over_N_error"] == 0.0
    assert unlike["exact"]["T_over_N_error"] > 0.0
    assert 0.0 < unlike["exact"]["T_over_N"] < 0.6


def test_every_command_with_a_law_says_what_it_leaves_out_of_unlike_discs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Dundurs' second constant of aluminium on steel, from its definition; discs of one material say nothing."""
    shear = [E / (2.0 * (1.0 + nu)) for E, nu in ((70e9, 0.33), (206e9, 0.3))]
    one, two = ((1.0 - 2.0 * nu) / g for nu, g in zip((0.33, 0.3), shear, strict=True))
    three, four = ((2.0 - 2.0 * nu) / g for nu, g in zip((0.33, 0.3), shear, strict=True))
    beta = (one - two) / (three + four)
    unlike = tmp_path / "unlike"
    unlike.mkdir()
    path = pair(unlike, f"wear_coefficient = {K2}").path
    for command in ("friction-chart", "simulate-wear"):
        with pytest.raises(SystemExit) as exit_:
            main([command, str(path), "-o", str(tmp_path / "out")])
        assert exit_.value.code == 0
        said = " ".join(capsys.readouterr().out.split())
        assert f"Dundurs' second constant {beta:.2g}" in said
        assert f"0.7 x {beta:.2g} / mu" in said
    with pytest.raises(SystemExit):
        main(["simulate-wear", str(write(tmp_path, VALID)), "-o", str(tmp_path / "like")])
    assert "Dundurs" not in capsys.readouterr().out
