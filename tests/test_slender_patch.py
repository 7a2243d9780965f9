"""Patches beyond the tables of the theory: every command says the same of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from definitions import TRACTION, changed, write
from rigs import rig

from twindisc_cli.cli import main
from twindisc_cli.commands import contact, simulate_wear
from twindisc_cli.definition import load
from twindisc_cli.model.wear_path import wear_path
from twindisc_cli.physics.half_space import OutOfRangeError

CROWN = 30.0
"""Transverse radius [m] of a disc that is nearly straight: a/b = 0.01, below the tables."""


def crowned(millimetres: float, **model: str) -> str:
    text = changed(disc2=f"disc2 = {{ rolling_radius_mm = 30.0, transverse_radius_mm = {millimetres} }}", **model)
    return text.replace("[model]\n", "[model]\nwear_coefficient = 1e-6\n")


def test_the_path_keeps_the_ellipse_of_hertz() -> None:
    """b of a slender ellipse is known without tables: a b = 3 N / (2 pi p0), and Hertz is exact at any ratio."""
    path, unworn = wear_path(rig(crown=CROWN), contact="hertz", section=0.0), rig(crown=CROWN).patch
    assert (path.a[0], path.b[0]) == pytest.approx((float(unworn.a), float(unworn.b)), rel=1e-9)
    # a patch this slender is a line contact: C11 = pi^2 / (4 (1 - nu)) within 0.2 %
    stiffness = rig().shear_modulus * float(unworn.a * unworn.b) * np.pi**2 / (4.0 * 0.7)
    assert path.stiffness[0] == pytest.approx(stiffness, rel=2e-3)


def test_commands_agree_on_a_slender_patch(tmp_path: Path) -> None:
    test = load(write(tmp_path, crowned(1e3 * CROWN)))
    unworn = test.experiment.rig.patch
    for found in (simulate_wear.run(test).json["iterations"][0], contact.run(test).json["exact"]):
        assert found["a_mm"] == pytest.approx(float(unworn.a) * 1e3, rel=0.01)
        assert found["b_mm"] == pytest.approx(float(unworn.b) * 1e3, rel=0.01)


@pytest.mark.parametrize("command", ["friction-chart", "identify-mu", "simulate-wear", "thermal", "contact"])
def test_a_patch_longer_than_the_tables_is_refused(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    definition = crowned(0.05).replace("[thermal]\n", "[thermal]\nconvection_W_K = 1.0\n")
    with pytest.raises(SystemExit) as left:
        main([command, str(write(tmp_path, definition, traction=TRACTION)), "-o", str(tmp_path / "results")])
    assert left.value.code == 4
    assert "a/b" in capsys.readouterr().err
    assert not (tmp_path / "results").exists()


def test_the_reason_is_a_contact_error() -> None:
    with pytest.raises(OutOfRangeError, match="34"):
        wear_path(rig(crown=5e-5), contact="hertz", section=0.0)
