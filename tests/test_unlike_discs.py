"""Discs of unlike material: each with its own elasticity, hardness, density and K."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from definitions import TRACTION, VALID, write

from twindisc_cli.cli import main
from twindisc_cli.commands import contact, fit_k, identify_mu, simulate_wear
from twindisc_cli.definition import Test, load
from twindisc_cli.model.contact_fields import exact_field, hertz_patch
from twindisc_cli.physics.half_space.rolling import Creepage

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
    text = text.replace("mean_speed_rpm = 3000.0", "rolling_speed_m_s = 9.42478") if radius == np.inf else text
    return load(write(folder, text, **data))


def arrays(result) -> dict[str, np.ndarray]:  # type: ignore[no-untyped-def]
    return {array.name: array.values for array in result.dataset.arrays}


@pytest.mark.parametrize("radius", [30.0, 60.0, np.inf])
def test_each_disc_wears_by_its_own_k_and_hardness(tmp_path: Path, radius: float) -> None:
    """W_d = K_d E / H_d, around the rim of its own radius, on a flat disc around a circle of the other's."""
    test = pair(tmp_path, f"wear_coefficient = {K2}\ndisc1_wear_coefficient = {K1}", radius)
    found = simulate_wear.run(test)
    energy = 1e3 * found.json["dissipated_energy_kJ"]
    worn = arrays(found)
    y = found.dataset.axes[1].values
    first = 30.0 if radius == np.inf else radius
    for name, k, hardness, rim in (("disc1_height", K1, 120 * HV, first), ("height", K2, 700 * HV, 30.0)):
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


def test_dundurs_second_constant_acts_in_the_exact_theory_and_its_table(tmp_path: Path) -> None:
    """beta of aluminium on steel, 1/2 [(1 - 2 nu1)/G1 - (1 - 2 nu2)/G2] / [(1 - nu1)/G1 + (1 - nu2)/G2]."""
    test = pair(tmp_path)
    g1, g2 = 70 / 2.66, 206 / 2.6
    beta = 0.5 * (0.34 / g1 - 0.4 / g2) / (0.67 / g1 + 0.7 / g2)
    assert test.experiment.rig.dundurs == pytest.approx(beta)
    found = contact.run(test, step=1)
    assert found.json["dundurs_beta"] == pytest.approx(beta)
    assert any("Dundurs" in line and "FASTSIM takes the combined modulus" in line for line in found.summary)
    assert found.json["exact"]["T_over_N"] == pytest.approx(found.json["exact_table"]["T_over_N"], abs=0.003)
    like = contact.run(load(write(tmp_path)), step=1)
    assert like.json["exact"]["T_over_N"] == pytest.approx(like.json["exact_table"]["T_over_N"], abs=0.001)
    assert not any("Dundurs" in line for line in like.summary)
    assert like.json["exact"]["T_over_N"] > found.json["exact"]["T_over_N"] + 0.001


def test_unlike_discs_along_a_line(tmp_path: Path) -> None:
    """Carter has no beta: the half-space is solved, on the strip with its ends."""
    line = VALID.replace("transverse_radius_mm = 30.0", "transverse_radius_mm = inf, width_mm = 2.0")
    plain = contact.run(load(write(tmp_path, line)), step=1).json
    unlike = contact.run(load(write(tmp_path, line.replace("[thermal]", ALUMINIUM + "\n[thermal]"))), step=1).json
    assert plain["exact"]["T_over_N_error"] == 0.0
    assert unlike["exact"]["T_over_N_error"] > 0.0
    assert 0.0 < unlike["exact"]["T_over_N"] < 0.6


def test_lateral_creepage_between_unlike_discs_is_said_to_be_approximate(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    yawed = "iterations = 1, yaw_mrad = 1.0 }"
    for text, said in ((ALUMINIUM, True), ("", False)):
        text = VALID.replace("[thermal]", text + "\n[thermal]").replace(
            "[model]\n", f"[model]\nwear_coefficient = {K2}\n"
        )
        start, end = text.index("steps = ["), text.index("]", text.index("steps = ["))
        text = text[:start] + f"steps = [{{ creepage_percent = 0.2, mu = 0.4, {yawed}" + text[end:]
        with pytest.raises(SystemExit) as exit_:
            main(["simulate-wear", str(write(tmp_path, text)), "-o", str(tmp_path / "out")])
        assert exit_.value.code == 0
        assert ("unlike elasticity under lateral creepage" in " ".join(capsys.readouterr().out.split())) is said


def test_close_loop_says_that_lateral_creepage_between_unlike_discs_is_approximate(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = VALID.replace("[thermal]", ALUMINIUM + "\n[thermal]").replace(
        "creepage_percent = 2.0 }", "creepage_percent = 2.0, yaw_mrad = 1.0 }"
    )
    with pytest.raises(SystemExit):
        main(["close-loop", "--quick", str(write(tmp_path, text, traction=TRACTION)), "-o", str(tmp_path / "out")])
    assert "unlike elasticity under lateral creepage" in " ".join(capsys.readouterr().out.split())


def test_the_friction_behind_a_traction_is_found_again_between_unlike_discs(tmp_path: Path) -> None:
    """T/N of the solver at mu = 0.3 and both signs of the creepage is inverted by the law."""
    creepages = (0.15, -0.15)
    text = VALID.replace("[thermal]", ALUMINIUM + "\n[thermal]")
    start, end = text.index("steps = ["), text.index("]", text.index("steps = ["))
    steps = ", ".join(f"{{ creepage_percent = {v}, iterations = 1 }}" for v in creepages)
    text = text[:start] + f"steps = [{steps}" + text[end:]
    rig = load(write(tmp_path, text)).experiment.rig
    solved = [
        exact_field(hertz_patch(rig, rig.normal_load), rig, mu=0.3, creepage=Creepage(v / 100.0)) for v in creepages
    ]
    ratio = [field.force_x / rig.normal_load for field in solved]
    assert abs(ratio[0] + ratio[1]) > 0.01
    rows = "".join(f"{v},{t:.9g},{i + 1}\n" for i, (v, t) in enumerate(zip(creepages, ratio, strict=True)))
    text = text.replace("[model]\n", '[model]\ntraction = "exact"\n')
    found = identify_mu.run(load(write(tmp_path, text, traction="creepage [%],traction ratio [1],step\n" + rows)))
    assert [step["mu"] for step in found.json["steps"]] == pytest.approx([0.3, 0.3], rel=0.04)
