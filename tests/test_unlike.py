"""Rolling of discs of unlike elasticity: the law against CONTACT, the rolling solver, limits and symmetries."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import rigs
from scipy.optimize import brentq

from twindisc_cli.model.contact_fields import exact_field, hertz_patch
from twindisc_cli.model.experiment import Disc, Experiment, Options, Rig
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.physics import exact, line_contact, unlike
from twindisc_cli.physics.half_space.influence_tangential import strain_by_pressure
from twindisc_cli.physics.half_space.rolling import Creepage

RATIOS = (0.02, 0.3, 1.0, 4.0, 20.0)


def disc(radius: float, crown: float, modulus: float, nu: float, **sizes: float) -> Disc:
    return Disc(radius, crown, youngs_modulus=modulus, poisson_ratio=nu, hardness=rigs.HARDNESS, **sizes)


def pair(*, crown: float = 0.03, load: float = 20.0) -> Rig:
    """Aluminium on steel."""
    discs = disc(0.03, np.inf, 70e9, 0.33), disc(0.03, crown, 206e9, 0.3)
    return Rig(*discs, normal_load=load, rolling_speed=1.0)


def rolled(rig: Rig, mu: float, creepage: float, **history: object) -> tuple[float, float]:
    """T/(mu N) and the power [W] by the forward model."""
    test: Experiment = rigs.experiment(
        replace(rigs.history([creepage], 1), **history),  # type: ignore[arg-type]
        rig=rig,
        options=Options(traction="exact"),
    )
    base = {"mu": np.array([mu]), "K": np.array([np.nan]), "convection_W_K": np.array([1.0])}
    state = ForwardModel(test).predict(base).state
    return float(state.traction_ratio[0, 0]) / mu, float(state.power[0, 0])


@pytest.mark.parametrize(("share", "creepage"), [(0.0, 4.294e-4), (0.75, 5.392e-4), (-0.75, 2.108e-4)])
def test_a_line_contact_is_that_of_bentall_and_johnson(share: float, creepage: float) -> None:
    """CONTACT: aluminium on steel, R = 50 mm both, 16201.9 N/m, mu = 0.05; the soft disc rolls freely as the faster."""
    soft, hard = ((2.0 * (1.0 + nu) * g, nu) for g, nu in ((23e9, 0.31), (82e9, 0.28)))
    rig = Rig(
        disc(0.05, np.inf, *soft, width=1.0), disc(0.05, np.inf, *hard, width=1.0), normal_load=16201.9,
        rolling_speed=1.0,
    )  # fmt: skip
    found = brentq(lambda v: rolled(rig, 0.05, v)[0] - share, 1e-4, 7e-4, xtol=1e-8)
    assert found == pytest.approx(creepage, abs=0.01 * 4.294e-4)
    turned = Rig(rig.disc2, rig.disc1, rig.normal_load, rig.rolling_speed)
    assert rolled(turned, 0.05, -creepage)[0] == pytest.approx(-rolled(rig, 0.05, creepage)[0], abs=1e-12)


@pytest.mark.parametrize("mu", [0.1, 0.6])
@pytest.mark.parametrize("xi", [0.3, -0.3, 1.5, -1.5])
def test_aluminium_on_steel_is_what_the_solver_says(mu: float, xi: float) -> None:
    rig = pair()
    creepage = xi * mu * rig.normal_load / (rig.shear_modulus * float(rig.patch.a * rig.patch.b) * 4.1)
    force, power = rolled(rig, mu, creepage)
    solved = exact_field(hertz_patch(rig, rig.normal_load), rig, mu=mu, creepage=Creepage(creepage))
    full = mu * rig.normal_load
    assert force == pytest.approx(solved.force_x / full, abs=0.01)
    assert power == pytest.approx(solved.power, abs=0.01 * full * abs(creepage) / min(abs(xi), 1.0))


def test_the_solver_and_the_law_know_which_disc_is_the_softer() -> None:
    """Pressure shortens the softer surface, which is the slower one at equal speeds: it is driven."""
    rig = pair()
    solved = exact_field(hertz_patch(rig, rig.normal_load), rig, mu=0.1, creepage=Creepage(0.0))
    assert solved.force_x / (0.1 * rig.normal_load) < -0.3
    assert rolled(rig, 0.1, 1e-12)[0] < -0.3


@pytest.mark.parametrize("ratio", RATIOS)
def test_like_discs_and_reversal(ratio: float) -> None:
    x, slip = np.array([0.1, 1.0, 4.0, 30.0]), np.array([0.3, -2.0, 5.0, -1.0])
    np.testing.assert_array_equal(unlike.quotients(x, 0.0 * x, ratio, 0.3)[0], 1.0)
    there, back = unlike.quotients(x, slip, ratio, 0.3), unlike.quotients(-x, -slip, ratio, 0.3)
    np.testing.assert_allclose(there, np.negative(back), atol=1e-12)
    still = unlike.quotients(np.array([1e-12, -1e-12]), np.ones(2), ratio, 0.3)
    assert float(np.ptp(still[0])) == pytest.approx(0.0, abs=1e-6)
    acts = unlike.acting(np.abs(x), slip, ratio, 0.3)
    for sense in (1.0, -1.0):
        q, m = unlike.quotients(sense * np.abs(x), slip, ratio, 0.3)
        np.testing.assert_allclose(acts.force * sense + acts.own_force, q, atol=1e-12)
        np.testing.assert_allclose(acts.work * sense + acts.own_work, m, atol=1e-12)


@pytest.mark.parametrize("nu", [0.0, 0.25, 0.5])
@pytest.mark.parametrize("ratio", RATIOS)
def test_forces_are_bounded_and_power_is_never_gained(ratio: float, nu: float) -> None:
    x, slip = (v.ravel() for v in np.meshgrid(np.linspace(-9.0, 9.0, 61), np.linspace(-7.0, 7.0, 57)))
    q, m = unlike.quotients(x, slip, ratio, nu)
    level = exact.saturation(np.hypot(x, slip), ratio, nu)
    assert np.abs(level * q).max() < 1.01
    assert (level * (x * q + slip * m)).min() > -0.02


def test_slip_at_the_middle_of_a_patch() -> None:
    """Against the influence of the pressure on elements, where beta / E* = K / G is 1."""
    for ratio in (0.1, 1.0, 5.0):
        n = 201
        at = (2.0 * np.arange(n) + 1.0) / n - 1.0
        pressure = np.sqrt(np.maximum(0.0, 1.0 - at**2 - at[:, None] ** 2))
        strain = strain_by_pressure(pressure, aspect=ratio)[0, n // 2]
        middle = 0.5 * (strain[n // 2] + strain[n // 2 + 1])
        assert float(unlike.slip_of_pressure(1.0, 1.0, 1.0, ratio)) == pytest.approx(middle, rel=5e-3)


def test_full_slip_of_a_strip() -> None:
    """Where B > X > 0 act against each other, the middle slips back: p / p0 = X / B at its ends."""
    x, slip = 1e4 * np.array([1.0, 1.0, 1.0]), -1e4 * np.array([0.5, 1.5, 3.0])
    half = np.sqrt(np.maximum(1.0 - (x / slip) ** 2, 0.0))
    back = 2.0 / np.pi * (half * np.sqrt(1.0 - half**2) + np.arcsin(half))
    q, m = unlike.quotients_of_a_strip(x, slip)
    np.testing.assert_allclose(q, 1.0 - 2.0 * back, atol=0.03)
    assert float(line_contact.saturation(3.0, "exact")) == 1.0
    work = np.hypot(1.0, slip / x) * m
    assert np.all(np.isfinite(work))
