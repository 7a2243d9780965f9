"""A third-body layer in the exact theory and in the law: CONTACT, closed forms and the rolling solver."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import rigs
from definitions import VALID, write
from rigs import one_of, solve_rolling

from twindisc_cli.commands import contact
from twindisc_cli.definition import load
from twindisc_cli.errors import DefinitionError
from twindisc_cli.identify.chart import friction_chart
from twindisc_cli.model.contact_fields import exact_field, fastsim_field, hertz_patch
from twindisc_cli.model.experiment import Disc, Options, Rig
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.physics import exact, kalker, line_contact, third_body
from twindisc_cli.physics.half_space import rolling
from twindisc_cli.physics.half_space.rolling import Creepage

CONTACT = (
    (0.001, 6425.0), (0.004, 21480.0), (0.008, 30470.0), (0.012, 32890.0),
    (0.018, 33200.0), (0.04, 31240.0), (0.1, 26620.0), (0.25, 20020.0),
)  # fmt: skip
"""Creepage [1], longitudinal force [N] of CONTACT's example `tractcurv`, second curve (release 2025-07-23): 106.7 kN,
a 6.304 mm, b 12.61 mm, G 82 GPa, nu 0.28, 10 m/s; layer of 1.25 mm and 8.2 GPa; mu = 0.14 + 0.19 2^(-s / 1.25 m/s)."""
LOAD, A, B, G, NU, LAYER = 106.7e3, 6.304e-3, 12.61e-3, 82e9, 0.28, 1.25e-3 / 8.2e9
SOFT = 1e-11
"""Compliance [m/Pa] of a layer 180 times as soft as the discs."""


def falling(slip: np.ndarray) -> np.ndarray:
    return np.asarray(0.14 + 0.19 * 2.0 ** (-10.0 * slip / 1.25))


def ellipse(n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    at = (2.0 * np.arange(n) + 1.0) / n - 1.0
    p0 = 1.5 * LOAD / (np.pi * A * B)
    return A * at, B * at, p0 * np.sqrt(np.maximum(0.0, 1.0 - at**2 - at[:, None] ** 2))


@pytest.mark.parametrize(("creepage", "force"), CONTACT)
def test_a_locomotive_wheel_on_a_layer_is_that_of_contact(creepage: float, force: float) -> None:
    """Slope and maximum by the layer and by the local slip: the solver, and the law with the slip of all."""
    x, y, pressure = ellipse(42)
    found = solve_rolling(
        x=x, y=y, pressure=pressure, mu=falling, shear_modulus=G, poisson=NU, creepage_x=creepage,
        layer_compliance=LAYER,
    )  # fmt: skip
    assert found.force_x / LOAD == pytest.approx(force / LOAD, abs=0.0025)
    stiffness = G * A * B * np.asarray(kalker.coefficients(A / B, NU).c11)
    layer = third_body.compliance_ratio(LAYER, stiffness=stiffness, a=np.asarray(A), b=np.asarray(B))
    mu = float(falling(np.asarray(creepage)))
    xi = third_body.slope_factor(layer) * stiffness * creepage / (mu * LOAD)
    law = mu * third_body.saturation(xi, layer, exact.saturation(xi, A / B, NU))
    assert float(law) == pytest.approx(force / LOAD, abs=0.007)


@pytest.mark.parametrize("ratio", [0.15, 1.0, 5.0])
@pytest.mark.parametrize("layer", one_of([1.0, 0.2, 5.0]))
def test_the_law_of_a_layer_is_that_of_the_solver(ratio: float, layer: float) -> None:
    """By the forward model; the force of two grids carried to the limit."""
    crown = {0.15: 0.6, 1.0: 0.03, 5.0: 0.0026}[ratio]
    rig = rigs.rig(crown=crown)
    rig = replace(
        rig, disc1=replace(rig.disc1, transverse_radius=np.inf), disc2=replace(rig.disc2, rolling_radius=np.inf)
    )
    a, b = rig.patch.a, rig.patch.b
    stiffness = rig.shear_modulus * a * b * kalker.coefficients(a / b, 0.3).c11
    compliance = layer * float(8.0 / 3.0 * a**2 * b / stiffness)
    mu = 0.3
    for xi in (0.5, 1.5, 3.0):
        creepage = xi * mu * rig.normal_load / float(stiffness) * (1.0 + layer)
        test = rigs.experiment(
            rigs.history([creepage], 1), rig=rig, options=Options(traction="exact", layer_compliance=compliance)
        )
        base = {"mu": np.array([mu]), "K": np.array([np.nan]), "convection_W_K": np.array([1.0])}
        law = float(ForwardModel(test).predict(base).state.traction_ratio[0, 0])
        solved = exact_field(
            hertz_patch(rig, rig.normal_load), rig, mu=mu, creepage=Creepage(creepage),
            layer_compliance=compliance,
        )  # fmt: skip
        assert law / mu == pytest.approx(solved.force_x / (mu * rig.normal_load), abs=0.015)


def test_a_layer_far_softer_than_the_discs_is_a_bed_of_springs() -> None:
    """Each strip: traction v s / L up to the bound; integrated here, by the law, and by the solver."""
    for xi in (0.3, 1.0, 3.0):
        e, s = 0.25 * np.pi * xi, (np.arange(20000) + 0.5) / 10000.0
        strip = np.minimum(e * s, np.sqrt(np.maximum(0.0, s * (2.0 - s)))).sum() * 1e-4 / (0.5 * np.pi)
        soft = third_body.saturation(np.asarray(xi), np.asarray(1e9), np.asarray(0.0))
        assert float(soft) == pytest.approx(strip, abs=1e-6)
        discs = 1.0 / (G * A * B * float(kalker.coefficients(A / B, NU).c11))
        creepage = xi * 0.3 * LOAD * (3.0 * SOFT / (8.0 * A**2 * B) + discs)
        coarse, fine = (_share_on_springs(n, creepage) for n in (40, 80))
        assert float(rolling.limit(coarse, fine)[0]) == pytest.approx(strip, abs=0.005)


def _share_on_springs(n: int, creepage: float) -> float:
    x, y, pressure = ellipse(n)
    found = solve_rolling(
        x=x, y=y, pressure=pressure, mu=0.3, shear_modulus=G, poisson=NU, creepage_x=creepage, layer_compliance=SOFT
    )
    return found.force_x / (0.3 * float(pressure.sum()) * found.element_area)


def test_no_layer_is_as_before() -> None:
    zero, xi = np.zeros(3), np.array([0.1, 1.0, 5.0])
    np.testing.assert_array_equal(third_body.slope_factor(zero), 1.0)
    np.testing.assert_array_equal(third_body.saturation(xi, zero, xi), xi)


def test_a_layer_between_straight_discs() -> None:
    """A strip: 4 a^2 b / L in series with the discs in FASTSIM; the solver between them and the springs."""
    straight = Disc(0.03, np.inf, youngs_modulus=206e9, poisson_ratio=0.3, hardness=7e9, width=0.02)
    rig = Rig(straight, straight, normal_load=2000.0, rolling_speed=1.0)
    patch, creepage, compliance = hertz_patch(rig, 2000.0), 1e-5, 2e-14
    given = {"mu": 0.3, "creepage": Creepage(creepage), "layer_compliance": compliance}
    series = 1.0 / (1.0 / (rig.shear_modulus * patch.a * patch.b * line_contact.coefficients(0.3)[0])
                    + compliance / (4.0 * patch.a**2 * patch.b))  # fmt: skip
    found = fastsim_field(patch, rig, **given)
    xi = series * creepage / 600.0
    assert found.force_x / 600.0 == pytest.approx(float(line_contact.saturation(xi, "fastsim")), rel=1e-6)
    solved = exact_field(patch, rig, **given)
    assert solved.force_x == pytest.approx(series * creepage, rel=0.06)


def test_a_layer_is_declared_under_model(tmp_path: Path) -> None:
    """In contact by both theories and the table; every command by the law."""
    text = VALID.replace("[model]\n", "[model]\nlayer_compliance_mm3_N = 2e-5\n")
    plain, soft = (contact.run(load(write(tmp_path, t)), step=1).json for t in (VALID, text))
    for theory in ("exact", "exact_table", "fastsim"):
        assert soft[theory]["T_over_N"] < 0.9 * plain[theory]["T_over_N"]
    assert soft["exact_table"]["T_over_N"] == pytest.approx(soft["exact"]["T_over_N"], abs=0.01)
    assert load(write(tmp_path, text)).experiment.options.layer_compliance == pytest.approx(2e-14)


def test_a_declared_initial_slope_is_the_layer_that_lowers_it(tmp_path: Path) -> None:
    """T/N over the creepage of a rig with 0.4 of Kalker's slope is that of the effect third_body_layer at 0.4."""
    text = VALID.replace("[rig]\n", "[rig]\ninitial_slope = { value = 0.4, std = 0.1 }\n")
    of_rig = load(write(tmp_path, text)).experiment
    of_effect = load(write(tmp_path, VALID + "\n[effects.third_body_layer]\nslope_ratio = 0.4\n")).experiment
    assert of_rig.tolerances["initial_slope"] == pytest.approx(0.25)
    mu, creepage = np.array([0.3, 0.6]), np.geomspace(1e-4, 0.05, 12)
    charts = [friction_chart(test, mu=mu, creepage=creepage).apparent for test in (of_rig, of_effect)]
    assert charts[0] == pytest.approx(charts[1], rel=1e-12)
    plain = friction_chart(load(write(tmp_path, VALID)).experiment, mu=mu, creepage=creepage).apparent
    assert charts[0][:, 0] == pytest.approx(0.4 * plain[:, 0], rel=0.05), "linear theory at small creepage"
    with pytest.raises(DefinitionError, match="initial_slope"):
        load(write(tmp_path, VALID.replace("[rig]\n", "[rig]\ninitial_slope = 0.0\n")))
