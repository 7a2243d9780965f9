"""Flash temperature against Jaeger's integrals, its fast and slow limits, and CONTACT."""

import numpy as np
import pytest
from rigs import LOAD, ROOM, SPEED, experiment, history, rig
from scipy.integrate import quad
from scipy.optimize import minimize_scalar
from scipy.special import ellipk

from twindisc_cli.laws.law import Law
from twindisc_cli.model.experiment import Thermal
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.physics.flash import Solid, flash_temperature

UNIT = {"creepage": 0.0, "solid": Solid(1.0, 1.0, 1.0)}
ONE_FLUX = 2.0 * np.pi / 3.0  # the power that makes the peak flux 1 on the unit disc


def moving_source(x, peclet, rays=1200, nodes=60):
    """Jaeger's point source summed over a semi-ellipsoid of flux on the unit disc, at (x, 0), for k = 1; V = 2 Pe."""
    angle = (np.arange(rays) + 0.5) / rays * 2 * np.pi
    node, weight = np.polynomial.legendre.leggauss(nodes)
    u, weight = 0.5 * (node + 1), 0.5 * weight
    reach = -x * np.cos(angle) + np.sqrt((x * np.cos(angle)) ** 2 + 1 - x**2)
    distance = reach[:, None] * u**2
    flux = np.sqrt(np.maximum(1 - x**2 - 2 * x * distance * np.cos(angle)[:, None] - distance**2, 0))
    decay = np.exp(-peclet * distance * (1 - np.cos(angle)[:, None]))
    return float(np.sum(flux * decay * 2 * u * reach[:, None] * weight)) / rays


@pytest.mark.parametrize("peclet", [0.01, 0.3, 1.0, 5.0, 30.0])
def test_hottest_point_of_a_moving_circle(peclet):
    hottest = -minimize_scalar(lambda x: -moving_source(x, peclet), bounds=(-0.95, 0.05), method="bounded").fun
    shared = flash_temperature(power=ONE_FLUX, a=1.0, b=1.0, speed=2.0 * peclet, **UNIT)
    assert 2.0 * float(shared.maximum) == pytest.approx(hottest, rel=0.015)


def rises(ratio, peclet, rays=3000, nodes=40):
    """Largest rise and mean of Jaeger's point sources over an ellipse of semi-axes 1, 1 / ratio; k = 1, V = 2 Pe.

    Around each of 48 places in half the ellipse (by Gauss in radius and angle) the sources are summed along rays.
    """
    b = 1.0 / ratio
    node, weight = np.polynomial.legendre.leggauss(nodes)
    u, weight = 0.5 * (node + 1.0), 0.5 * weight
    angle = np.pi * (2.0 * (np.arange(rays) + 0.5) / rays - 1.0)
    angle, stretch = np.pi * (angle / np.pi) ** 3, 3.0 * (angle / np.pi) ** 2  # denser where the heat comes from

    def at(x, y):
        c, s = np.cos(angle), np.sin(angle) / b
        p, q, r = c**2 + s**2, x * c + y / b * s, 1.0 - x**2 - (y / b) ** 2
        reach = (-q + np.sqrt(q**2 + p * r)) / p
        distance = reach[:, None] * u**2
        flux = np.sqrt(np.maximum(r - 2.0 * q[:, None] * distance - p[:, None] * distance**2, 0.0))
        decay = np.exp(-peclet * distance * (1.0 - c[:, None]))
        return float(np.sum(flux * decay * 2.0 * u * (reach * stretch)[:, None] * weight)) / rays

    hottest = max(at(x, 0.0) for x in np.linspace(-0.95, 0.0, 20))
    radius, share = np.polynomial.legendre.leggauss(6)
    mean = sum(
        0.5 * w * np.mean([at(np.sqrt(0.5 * (1 + r)) * np.cos(t), b * np.sqrt(0.5 * (1 + r)) * np.sin(t))
                           for t in np.pi * (np.arange(8) + 0.5) / 8])
        for r, w in zip(radius, share, strict=True)
    )  # fmt: skip
    return hottest, mean


@pytest.mark.parametrize(("ratio", "peclet"), [(0.1, 0.3), (0.3, 2.0), (2.0, 0.1), (5.0, 3.0), (5.0, 100.0)])
def test_between_the_limits_an_ellipse_is_the_sum_of_moving_sources(ratio, peclet):
    hottest, mean = rises(ratio, peclet)
    found = flash_temperature(power=ONE_FLUX / ratio, a=1.0, b=1.0 / ratio, speed=2.0 * peclet, **UNIT)
    assert 2.0 * float(found.maximum) == pytest.approx(hottest, rel=0.015)
    assert 2.0 * float(found.mean) == pytest.approx(mean, rel=0.02)


def test_fast_limit_is_jaegers_band_integral():
    def behind(x):
        return quad(lambda v: 2 * np.sqrt(max((1 - x - v * v) * (1 + x + v * v), 0)), 0, np.sqrt(1 - x))[0]

    greatest = -minimize_scalar(lambda x: -behind(x), bounds=(-0.9, -0.4), method="bounded").fun
    a, b, speed = 2e-4, 5e-4, 1e13
    found = flash_temperature(power=np.pi * a * b / 1.5, a=a, b=b, speed=speed, **UNIT)
    assert 2 * float(found.maximum) == pytest.approx(greatest * np.sqrt(a / np.pi / speed), rel=1e-6)
    strips = quad(behind, -1, 1)[0] * quad(lambda eta: (1 - eta**2) ** 1.25, -1, 1)[0] / np.pi
    assert float(found.mean / found.maximum) == pytest.approx(strips / greatest, rel=1e-6)


def test_slow_limit_is_the_stationary_ellipse():
    a, b = 3e-4, 1e-4
    found = flash_temperature(power=np.pi * a * b / 1.5, a=a, b=b, speed=1e-12, **UNIT)
    assert 2 * float(found.maximum) == pytest.approx(0.5 * b * ellipk(1 - (b / a) ** 2), rel=1e-6)
    assert float(found.mean / found.maximum) == pytest.approx(0.75, rel=1e-6)


def test_uniform_square_of_equal_power_is_not_far():
    # J. C. Jaeger (1942), fast square source: mean rise 2/3 of the largest, 2 q sqrt(side)/(sqrt(pi) e sqrt(V))
    side, speed, power = 1e-3, 1e4, 7.0
    mean = 2 / 3 * 2 * power / side**2 * np.sqrt(side / (np.pi * speed)) / 2
    found = flash_temperature(power=power, a=side / np.sqrt(np.pi), b=side / np.sqrt(np.pi), speed=speed, **UNIT)
    assert float(found.mean) == pytest.approx(mean, rel=0.2)


def test_locomotive_wheel_of_contact():
    # CONTACT open-source release 2025-07-23, rev 2707, example of a locomotive wheel at 25 % creepage: 688.0 K on 44
    # cells along rolling. Its rule counts half a cell too much of the heat of the point itself, sqrt(dx/2) q: 11 %.
    found = flash_temperature(
        power=35210.0 * 2.5,
        creepage=0.0,
        a=6.304e-3,
        b=12.61e-3,
        speed=10.0,
        solid=Solid(50.0, 7850.0, 450.0),
    )
    peak_flux = 1.5 * 35210.0 * 2.5 / (np.pi * 6.304e-3 * 12.61e-3)
    cell = 2 * 6.304e-3 / 43.6
    surplus = 0.75 * peak_flux * np.sqrt(cell / 2) / np.sqrt(np.pi * 10.0 * 50.0 * 7850.0 * 450.0)
    assert float(found.maximum) + surplus == pytest.approx(688.0, rel=0.015)


def test_no_power_is_no_rise_and_arrays_broadcast():
    found = flash_temperature(power=[0.0, 10.0], a=1e-4, b=[[1e-4], [2e-4]], speed=5.0, **UNIT)
    assert found.maximum.shape == (2, 2)
    assert np.all(found.maximum[:, 0] == 0.0)
    assert np.all(found.maximum[:, 1] > found.mean[:, 1])


def test_the_faster_surface_carries_more_heat_away():
    # at 100 % creepage the surfaces move at half the speed and at one and a half; both meet at one temperature
    slow, fast = (flash_temperature(power=2.0, a=1.0, b=2.0, speed=v, **UNIT).maximum for v in (3.5, 10.5))
    both = flash_temperature(power=1.0, a=1.0, b=2.0, speed=7.0, **{**UNIT, "creepage": 1.0}).maximum
    assert float(both) == pytest.approx(1.0 / (1.0 / slow + 1.0 / fast), rel=1e-9)


def sliding(thermal: Thermal | None, laws: dict[str, Law]) -> ForwardModel:
    """Full sliding at 2 % on discs that do not wear."""
    return ForwardModel(experiment(history([0.02], 2), thermal=thermal, laws=laws))


def test_friction_that_falls_with_the_flash_temperature_finds_its_own() -> None:
    """dT = F mu, and mu = mu0 (1 - 0.4 dT / 40 K) gives mu = mu0 / (1 + 0.4 mu0 F / 40 K); the disc stays cold."""
    law = Law("mu", "flash_temperature", "linear", {"size": -0.4, "begin_K": 0.0, "end_K": 40.0})
    cold, patch = Thermal(ROOM, 1e12, ROOM), rig().patch
    per_mu = flash_temperature(
        power=LOAD * 0.02 * SPEED,
        creepage=0.02,
        a=patch.a,
        b=patch.b,
        speed=SPEED,
        solid=Solid(cold.conductivity, cold.density, cold.specific_heat),
    ).mean
    base = {"mu": np.array([0.5]), "convection_W_K": np.array([1.0])}
    found = sliding(cold, {"hot": law}).predict(base)
    mu = 0.5 / (1.0 + 0.4 * 0.5 * per_mu / 40.0)
    assert 0.3 < mu < 0.48
    assert found.state.mu[0, -1] == pytest.approx(mu, rel=1e-4)
    assert found.state.flash[0, -1] == pytest.approx(per_mu * mu, rel=2e-3)
    assert found.state.temperature[0, -1] == pytest.approx(ROOM, abs=1e-3)


def test_where_nothing_is_said_of_heat_no_law_of_the_flash_acts() -> None:
    law = Law("mu", "flash_temperature", "linear", {"size": -0.4, "begin_K": 0.0, "end_K": 40.0})
    base = {"mu": np.array([0.5])}
    found = sliding(None, {"hot": law}).predict(base).state
    assert np.isnan(found.flash).all()
    assert found.mu == pytest.approx(np.full_like(found.mu, 0.5))
