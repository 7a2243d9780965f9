"""Straight discs: a line contact in every command, against Hertz, Carter and Jaeger."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from definitions import changed, write
from rigs import solve_rolling
from scipy.integrate import dblquad, quad

from twindisc_cli.cli import main
from twindisc_cli.commands import check, contact, fit_k, friction_chart, identify_mu, simulate_wear, thermal
from twindisc_cli.definition import Test, load
from twindisc_cli.errors import DefinitionError, MeasurementError
from twindisc_cli.identify.law import unworn_law
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.physics import exact, fastsim, hertz, kalker, line_contact
from twindisc_cli.physics.flash import Solid, flash_temperature
from twindisc_cli.physics.half_space import OutOfRangeError

RADIUS, WIDTH, LOAD, MODULUS, NU, SPEED = 0.0235, 0.01, 7233.0, 209e9, 0.3, 400 / 60 * 2 * np.pi * 0.0235
HARDNESS, K, MU, CONVECTION = 280 * 9.80665e6, 1.2e-3, 0.45, 3.0
PLANE = MODULUS / (1 - NU**2) / 2  # E* of two like discs
HALF_LENGTH = np.sqrt(4 * LOAD / WIDTH / (np.pi * PLANE * 2 / RADIUS))
FULL = MU * HALF_LENGTH * 2 / RADIUS  # Carter: the creepage from which on all slides
SUROS = """\
schema = 1
[test]
name = "suros"
[rig]
normal_load_N = 7233.0
mean_speed_rpm = 400.0
disc1 = { rolling_radius_mm = 23.5, transverse_radius_mm = inf, width_mm = 10.0 }
disc2 = { rolling_radius_mm = 23.5, transverse_radius_mm = inf, width_mm = 12.0 }
[material]
youngs_modulus_GPa = 209.0
poisson_ratio = 0.30
hardness_HV = 280
density_kg_m3 = 7850
[thermal]
environment_temperature_C = 20.0
heat_capacity_J_K = 300.0
[history]
revolutions_per_iteration = 2000
steps = [
  { creepage_percent = 0.5, iterations = 3 },
  { creepage_percent = 1.0, iterations = 3 },
  { creepage_percent = 3.0, iterations = 3 },
]
[model]
traction = "exact"
"""
CREEPAGE = np.repeat([0.005, 0.01, 0.03], 3)
DURATION = 2000 / 400 * 60.0


def carter(creepage: np.ndarray) -> np.ndarray:
    """T/N = mu [1 - (1 - v / (mu a kappa))^2]."""
    return np.asarray(MU * (1 - (1 - np.minimum(creepage / FULL, 1)) ** 2))


def energy() -> np.ndarray:
    """By the end of each iteration [J]."""
    return np.cumsum(carter(CREEPAGE) * LOAD * SPEED * CREEPAGE * DURATION)


def recorded(
    folder: Path, text: str = SUROS, channels: tuple[str, ...] = ("traction", "profile", "temperature")
) -> Test:
    """A test by closed forms: Carter, even wear of disc 2, a disc that warms towards P / hS."""
    rng = np.random.default_rng(8)
    time = np.arange(30.0, DURATION * len(CREEPAGE), 60.0)
    at = np.minimum((time / DURATION).astype(int), len(CREEPAGE) - 1)
    ratio = carter(CREEPAGE[at]) + 0.003 * rng.standard_normal(len(time))
    y = np.linspace(-7.0, 7.0, 561)
    y = y[np.abs(np.abs(y) - 5.0) > 0.06]  # a stylus sees no vertical wall
    depth = 1e6 * K * energy()[-1] / (HARDNESS * 2 * np.pi * RADIUS * WIDTH)
    height = np.where(np.abs(y) < 5.0, -depth, 0.0) + 0.1 * rng.standard_normal(len(y))
    warm, celsius = 0.0, []
    for creepage in CREEPAGE:
        level = float(carter(creepage) * LOAD * SPEED * creepage) / CONVECTION
        warm = level + (warm - level) * np.exp(-CONVECTION * DURATION / 300.0)
        celsius.append(20 + warm)
    end = DURATION * np.arange(1, len(CREEPAGE) + 1)
    tables = {
        "traction": ("time [s],creepage [%],traction ratio [1]", (time, 100 * CREEPAGE[at], ratio)),
        "profile": ("y [mm],height [um]", (y, height)),
        "temperature": ("time [s],temperature [degC]", (end, celsius)),
    }
    texts = {
        name: header + "\n" + "".join(",".join(f"{v:.6f}" for v in row) + "\n" for row in zip(*columns, strict=True))
        for name, (header, columns) in tables.items()
        if name in channels
    }
    return load(write(folder, text, **texts))


@pytest.fixture(scope="module")
def suros(tmp_path_factory: pytest.TempPathFactory) -> Test:
    return recorded(tmp_path_factory.mktemp("suros"))


def test_pressure_of_hertz(suros: Test) -> None:
    """1500 MPa of two 47 mm discs over 10 mm, the narrower one: p0 = sqrt(N E* kappa / (pi w))."""
    patch = suros.experiment.rig.patch
    assert float(patch.p0) == pytest.approx(np.sqrt(LOAD / WIDTH * PLANE * 2 / RADIUS / np.pi), rel=1e-12)
    assert float(patch.p0) == pytest.approx(1500e6, rel=1e-3)
    assert (float(patch.a), float(patch.b)) == pytest.approx((HALF_LENGTH, 0.005))
    assert float(patch.p0) * np.pi / 4 * float(patch.area) == pytest.approx(LOAD)


def test_traction_is_carters(suros: Test) -> None:
    creepage = np.array([1e-5, 1e-3, 5e-3, 0.9 * FULL, FULL, 0.03])
    law = unworn_law(suros.experiment)
    assert law.apparent(np.full(6, MU), creepage) == pytest.approx(carter(creepage), abs=1e-12)
    assert MU / law.slope * law.full_slip == pytest.approx(FULL)
    found = friction_chart.run(suros).json
    place = list(found["mu"]).index(0.4)
    chart = np.array(found["apparent_friction"][place])
    full = FULL * 0.4 / MU
    carters = 0.4 * (1 - (1 - np.minimum(np.array(found["creepage_percent"]) / 100 / full, 1)) ** 2)
    assert chart == pytest.approx(carters, abs=1e-12)
    assert [step["mu"] for step in identify_mu.run(suros).json["steps"]] == pytest.approx([MU] * 3, rel=0.01)


@pytest.mark.parametrize("stiff", [1e-290, 1e297])
def test_a_strip_of_any_modulus_is_similar(stiff: float) -> None:
    """a ~ E*^(-1/2), p0 ~ E*^(1/2)."""
    steel, other = (
        line_contact.line_contact(curvature=85.0, normal_load=LOAD, width=WIDTH, effective_modulus=115e9 * times)
        for times in (1.0, stiff)
    )
    assert float(other.a) == pytest.approx(float(steel.a) / np.sqrt(stiff), rel=1e-12)
    assert float(other.p0) == pytest.approx(float(steel.p0) * np.sqrt(stiff), rel=1e-12)


@pytest.mark.parametrize("revolutions", [40_000, 40_000_000])
def test_discs_that_would_be_worn_through_are_refused(tmp_path: Path, revolutions: int) -> None:
    text = SUROS.replace("revolutions_per_iteration = 2000", f"revolutions_per_iteration = {revolutions}")
    text += "wear_coefficient = 0.1\nfriction_coefficient = 0.4\n"
    with pytest.raises(OutOfRangeError, match=r"mm deep on a radius of 23\.5 mm; it is followed to 0\.5 of the radius"):
        simulate_wear.run(load(write(tmp_path, text)))


@pytest.mark.parametrize("theory", ["exact", "fastsim"])
@pytest.mark.parametrize("share", [0.1, 0.4, 0.8, 1.5])
def test_the_patch_balances_force_and_power(theory: line_contact.Theory, share: float) -> None:
    """What the strip transmits is the law, what it dissipates is force times creepage, and it holds the bound."""
    a, bound, stiffness = 3e-4, 3e5, 5e7
    full = line_contact.ORDER[theory] * bound / stiffness
    turn = (np.arange(4000) + 0.5) / 4000 * np.pi
    x, dx = a * np.cos(turn), a * np.sin(turn) * np.pi / 4000
    found = line_contact.along_the_patch(x, a=a, bound=bound, stiffness=stiffness, creepage=share * full, theory=theory)
    force = float(found.traction @ dx)
    assert force == pytest.approx(bound * line_contact.saturation(stiffness * share * full / bound, theory), rel=1e-4)
    assert float((found.traction * found.slip) @ dx) == pytest.approx(force * share * full, rel=3e-3)
    assert float(found.bound @ dx) == pytest.approx(bound, rel=1e-5)
    assert np.all(found.traction <= found.bound * (1 + 1e-12))
    assert np.all(found.traction[found.slip > 0] == pytest.approx(found.bound[found.slip > 0]))
    assert float(found.sticks @ dx) / (2 * a) == pytest.approx(max(1 - share, 0), abs=1e-3)


def test_strips_of_fastsim_on_a_line() -> None:
    """The middle strip of Kalker's algorithm on an ellipse, whose strips do not know of each other."""
    xi = 1.1
    rate = xi / 3.0  # d tau / ds of the unit strip over its bound 1 - x^2; in full slip at 1 the rate is 2
    force = sum(float(tx[0, 0]) for _, tx, _, _ in fastsim.march(
        (np.array([2 * rate]), np.zeros(1), np.zeros(1), np.zeros(1)), y=np.zeros(1), nx=4000)) * 2 / 4000  # fmt: skip
    assert force / (4 / 3) == pytest.approx(float(line_contact.saturation(xi, "fastsim")), abs=1e-6)
    assert line_contact.unsaturation(line_contact.saturation(xi, "fastsim"), "fastsim") == pytest.approx(xi)


def test_the_solver_finds_carter_in_the_middle_of_a_long_strip() -> None:
    """Plane strain is what is left of the half-space far from the ends; the rest is the grid's."""
    n, half = 48, 16.0
    x = (2 * np.arange(n) + 1) / n - 1
    y = half * ((2 * np.arange(33) + 1) / 33 - 1)
    pressure = np.sqrt(1 - x**2) * np.ones((33, 1))
    for share in (0.3, 0.7):
        # unit G and a: T' = (pi/2) v / (1 - nu), mu N' = pi/2 mu p0
        creepage = 2 * share * 1e-3 * (1 - NU)
        found = solve_rolling(
            x=x, y=y, pressure=1e-3 * pressure, mu=1.0, shear_modulus=1.0, poisson=NU, creepage_x=creepage
        )
        middle = float(found.traction[0, 16].sum() / (1e-3 * pressure[16]).sum())
        assert middle == pytest.approx(1 - (1 - share) ** 2, abs=8e-3)


def test_a_crowned_pair_goes_over_into_the_line() -> None:
    """At a/b = 0.02: the line's patch under the load of the middle, and Carter strip by strip, within 1 %."""
    crown = brent(lambda c: ratio_of(c) - 0.02, 1e-6, 1.0)
    found = hertz.contact_ellipse(curvature_x=85.1, curvature_y=crown, normal_load=LOAD, effective_modulus=PLANE)
    line = line_contact.line_contact(curvature=85.1, normal_load=0.75 * LOAD, width=found.b, effective_modulus=PLANE)
    assert float(found.a) == pytest.approx(float(line.a), rel=0.01)
    assert float(found.p0) == pytest.approx(float(line.p0), rel=0.01)
    shear = MODULUS / 2 / (1 + NU)
    for share in (0.1, 0.5, 0.9, 1.2):  # of the creepage at which the middle slides all over
        creepage = share * MU * float(line.a) * 85.1
        local = np.sqrt(1 - ((np.arange(4000) + 0.5) / 4000) ** 2)  # a(y) / a, and sqrt(q(y) / q(0))
        strips = float(np.sum(local**2 * (1 - (1 - np.minimum(share / local, 1)) ** 2)) / np.sum(local**2))
        c11 = float(kalker.coefficients(0.02, NU).c11)
        xi = shear * float(found.a * found.b) * c11 * creepage / (MU * LOAD)
        assert float(exact.saturation(xi, 0.02, NU)) == pytest.approx(strips, rel=0.01)


def ratio_of(crown: float) -> float:
    found = hertz.contact_ellipse(curvature_x=85.1, curvature_y=crown, normal_load=LOAD, effective_modulus=PLANE)
    return float(found.a / found.b)


def brent(function, low: float, high: float) -> float:  # type: ignore[no-untyped-def]
    from scipy.optimize import brentq

    return float(np.exp(brentq(lambda log: function(np.exp(log)), np.log(low), np.log(high))))


def test_wear_is_even_and_the_radius_shrinks(suros: Test) -> None:
    """Depth S / w over the width of the narrower disc; had the speeds been left, creepage would shift by dR / R."""
    found = fit_k.run(suros).json
    depth = 1e6 * K * energy()[-1] / (HARDNESS * 2 * np.pi * RADIUS * WIDTH)
    assert found["K"] == pytest.approx(K, rel=0.01)
    assert found["measured_width_mm"] == pytest.approx(10.0, abs=0.5)  # a measured profile is smoothed
    worn = simulate_wear.run(suros).json
    assert worn["depth_um"] == pytest.approx(depth, rel=0.01)
    assert worn["width_mm"] == pytest.approx(10.0, abs=0.03)
    assert worn["worn_volume_mm3"] == pytest.approx(1e9 * K * energy()[-1] / HARDNESS, rel=0.01)
    assert worn["dissipated_energy_kJ"] == pytest.approx(1e-3 * energy()[-1], rel=0.01)
    assert worn["rolling_radius_mm"] == pytest.approx([23.5, 23.5 - 1e-3 * worn["depth_um"]])
    assert worn["creepage_shift_percent"] == pytest.approx(worn["depth_um"] * 1e-4 / 23.5 * 1e3, rel=1e-6)
    assert worn["final_radius_mm"] is None
    shrunk = np.sqrt(2 / (1 + 23.5 / (23.5 - 1e-3 * depth)))  # a goes with 1 / sqrt(kappa)
    assert worn["a_mm"] == pytest.approx(HALF_LENGTH * 1e3 * shrunk, rel=1e-4)


def test_another_load_makes_the_strip_longer_not_wider(tmp_path: Path) -> None:
    """a goes with the root of the load, wear with the load, wherever on the width."""
    heavy = SUROS.replace('traction = "exact"', f"wear_coefficient = {K}\nfriction_coefficient = 0.45")
    plain = simulate_wear.run(load(write(tmp_path, heavy))).json
    loaded = heavy + "[effects.load_error]\nerror_percent = 21.0\n"
    found = simulate_wear.run(load(write(tmp_path, loaded))).json
    assert found["a_mm"] == pytest.approx(1.1 * plain["a_mm"], rel=1e-3)
    assert found["p0_MPa"] == pytest.approx(1.1 * plain["p0_MPa"], rel=1e-3)
    assert (found["b_mm"], found["width_mm"]) == pytest.approx((5.0, plain["width_mm"]))
    assert found["iterations"][-1]["depth_um"] / found["dissipated_energy_kJ"] == pytest.approx(
        plain["iterations"][-1]["depth_um"] / plain["dissipated_energy_kJ"], rel=1e-6
    )


def test_play_softens_the_ends(tmp_path: Path) -> None:
    """A strip spread over a normal distribution of 0.2 mm: half the depth at the ends, all volume kept."""
    text = SUROS.replace('traction = "exact"', f"wear_coefficient = {K}\nfriction_coefficient = 0.45")
    plain = simulate_wear.run(load(write(tmp_path, text))).json
    found = simulate_wear.run(load(write(tmp_path, text + "[effects.lateral_wander]\nstd_mm = 0.2\n")))
    assert found.json["worn_volume_mm3"] == pytest.approx(plain["worn_volume_mm3"], rel=1e-3)
    arrays = {array.name: array.values for array in found.dataset.arrays}
    y = found.dataset.axes[1].values
    at = np.interp([0.0, 4.8e-3, 5e-3, 5.4e-3], y, arrays["height"][-1]) / arrays["height"][-1].min()
    assert at == pytest.approx([1.0, 0.841, 0.5, 0.023], abs=0.02)


def test_heat_and_flash_of_a_line(suros: Test) -> None:
    found = thermal.run(suros).json
    assert found["convection_W_K"] == pytest.approx(CONVECTION, rel=0.01)
    power = float(carter(np.array(0.03))) * LOAD * SPEED * 0.03
    # Jaeger's band source on each of two discs that share the heat
    fast = power / (np.pi * HALF_LENGTH * 0.005) * np.sqrt(HALF_LENGTH / np.pi / SPEED / (24.2 * 7650 * 460)) / 2
    assert found["flash_C"] == pytest.approx(2.18831 * fast, rel=0.02)
    assert found["flash_mean_C"] == pytest.approx(1.50849 * fast, rel=0.02)


def test_flash_limits_are_jaegers_integrals() -> None:
    unit = {"creepage": 0.0, "solid": Solid(1.0, 1.0, 1.0), "line": True}
    a, b = 2e-4, 5e-3

    def behind(x: float) -> float:
        return float(quad(lambda v: 2 * np.sqrt(max((1 - x - v * v) * (1 + x + v * v), 0)), 0, np.sqrt(1 - x))[0])

    fast = flash_temperature(power=np.pi * a * b, a=a, b=b, speed=1e13, **unit)
    scale = np.sqrt(a / np.pi / 1e13) / 2
    assert float(fast.maximum) / scale == pytest.approx(max(behind(x) for x in np.linspace(-0.8, -0.4, 81)), rel=1e-4)
    assert float(fast.mean) / scale == pytest.approx(quad(behind, -1, 1)[0] / 2, rel=1e-6)
    slow = flash_temperature(power=np.pi * a * b, a=a, b=b, speed=1e-12, **unit)
    # the stationary source in the middle: integral of q / (2 pi k r) over the strip
    middle = dblquad(lambda y, u: np.sqrt(1 - u**2) / np.hypot(u, y), 0, 1, 0, b / a)[0] * 4 * a / (2 * np.pi)
    assert 2 * float(slow.maximum) == pytest.approx(middle, rel=1e-3)


def test_contact_shows_both_theories(suros: Test) -> None:
    result = contact.run(suros, step=2)
    assert result.json["patch"] == "the unworn discs (Hertz, along a line)"
    assert result.json["exact"]["T_over_N"] == pytest.approx(
        float(carter(np.array(0.01))) * result.json["operating_point"]["mu"] / MU, rel=0.01
    )
    assert result.json["fastsim"]["T_over_N"] < result.json["exact"]["T_over_N"]
    assert result.json["exact"]["p0_MPa"] == pytest.approx(1500, rel=2e-3)
    assert result.undefined == []
    assert result.figure() is not None


def test_a_yawed_line_slides_into_the_direction_of_slip(tmp_path: Path) -> None:
    text = SUROS.replace('traction = "exact"', "friction_coefficient = 0.45")
    found = contact.run(load(write(tmp_path, text + "[effects.misalignment]\nyaw_mrad = 40.0\n")), step=3).json
    for theory in ("exact", "fastsim"):
        total = np.hypot(found[theory]["T_over_N"], found[theory]["lateral_T_over_N"])
        assert total == pytest.approx(MU, rel=0.01)
        assert found[theory]["T_over_N"] == pytest.approx(MU * 0.6, abs=0.01)  # 3 % along, 4 % across


def test_measured_ends_carry_no_line(tmp_path: Path) -> None:
    """Rounded ends: the patch of the half-space ends where they leave, and its middle is the line's."""
    y = np.linspace(-5.0, 5.0, 401)
    ends = 1e3 * np.maximum(np.abs(y) - 4.0, 0.0) ** 2 / (2 * 20.0)
    profile = "y [mm],height [um]\n" + "".join(f"{a:.4f},{-b:.6f}\n" for a, b in zip(y, ends, strict=True))
    text = SUROS.replace('traction = "exact"', 'contact = "half_space"\nfriction_coefficient = 0.45')
    test = load(write(tmp_path, text, profile=profile))
    found = contact.run(test, step=2).json["exact"]
    assert 4.0 < found["b_mm"] < 4.95
    assert found["p0_MPa"] > 1500.0


@pytest.mark.parametrize("command", ["friction-chart", "identify-mu", "simulate-wear", "fit-k", "thermal", "contact"])
def test_every_command_ends_in_results(command: str, tmp_path: Path) -> None:
    recorded(tmp_path)
    with pytest.raises(SystemExit) as left:
        main([command, str(tmp_path / "small.toml"), "-o", str(tmp_path / "results")])
    assert left.value.code == 0
    assert (tmp_path / "results" / "suros" / f"{command}.png").stat().st_size > 10_000


def test_check_finds_nothing_wrong_but_plastic_flow(suros: Test) -> None:
    """1500 MPa on 280 HV, k = H / (3 sqrt 3), at T/N = 0.45: the surface flows from p0 = k / 0.45 on."""
    (finding,) = [finding for finding in check.findings(suros.experiment) if not finding.ok]
    assert finding.rule == "shakedown"
    assert finding.value == pytest.approx(1500e6 * 3 * np.sqrt(3) / HARDNESS, rel=1e-3)
    assert finding.high == pytest.approx(1 / MU, rel=0.02)


def test_check_holds_the_width(tmp_path: Path) -> None:
    wide = recorded(tmp_path, SUROS.replace("width_mm = 10.0", "width_mm = 8.0"), ("profile",)).experiment
    (found,) = [f for f in check.findings(wide) if f.rule == "chord and depth"]
    assert not found.ok
    assert found.high == pytest.approx(8.0 * 1.15)


def test_the_loop_finds_nothing_missing(tmp_path: Path) -> None:
    recorded(tmp_path)
    with pytest.raises(SystemExit) as left:
        main(["close-loop", str(tmp_path / "small.toml"), "--quick", "-o", str(tmp_path / "results")])
    assert left.value.code == 0


def test_straight_discs_need_a_width(tmp_path: Path) -> None:
    straight = changed(disc2="disc2 = { rolling_radius_mm = 30.0, transverse_radius_mm = inf }")
    with pytest.raises(DefinitionError, match="both are straight: give width_mm"):
        load(write(tmp_path, straight))
    narrow = straight.replace("transverse_radius_mm = inf }", "transverse_radius_mm = inf, width_mm = 4.0 }", 1)
    assert load(write(tmp_path, narrow)).experiment.rig.width == pytest.approx(0.004)


def test_a_profile_narrower_than_the_line_is_refused(tmp_path: Path) -> None:
    profile = "y [mm],height [um]\n" + "".join(f"{y:.3f},{-1.0 + 0.01 * y:.3f}\n" for y in np.linspace(-3, 3, 60))
    with pytest.raises(MeasurementError, match="the profile spans 6 mm, the contact is 10 mm wide"):
        load(write(tmp_path, SUROS, profile=profile))


def strips_of_carter(creepage: float, spin: float, capacity: float, stiffness: float) -> float:
    """T [N] of many strips, each by Carter at its own creepage v - phi y, under an even load."""
    y = 0.5 * WIDTH * ((2.0 * np.arange(4001) + 1.0) / 4001 - 1.0)
    xi = stiffness * (creepage - spin * y) / capacity
    k = np.minimum(np.abs(xi) / 2.0, 1.0)
    return float(capacity * np.mean(np.sign(xi) * (1.0 - (1.0 - k) ** 2)))


@pytest.mark.parametrize("tilt", [0.0, 2.0, 6.0, 20.0])
@pytest.mark.parametrize("creepage", [0.0005, 0.005])
def test_tilted_cylinders_are_strips_of_carter_with_their_own_creepage(
    tmp_path: Path, tilt: float, creepage: float
) -> None:
    text = SUROS.replace("normal_load_N = 7233.0", "normal_load_N = 1000.0").replace("= 0.5,", f"= {100 * creepage},")
    test = load(write(tmp_path, text + f"[effects.misalignment]\ntilt_mrad = {tilt}\nyaw_mrad = 0.0\n"))
    mu, spin = 0.1, 1e-3 * tilt / RADIUS
    base = {"mu": np.array([mu]), "K": np.array([np.nan]), "convection_W_K": np.array([CONVECTION])}
    found = ForwardModel(test.experiment).predict(base)
    a = np.sqrt(4 * 1000.0 / WIDTH / (np.pi * PLANE * 2 / RADIUS))
    stiffness = MODULUS / (2 * (1 + NU)) * a * 0.5 * WIDTH * np.pi / (1 - NU)
    expected = strips_of_carter(creepage, spin, mu * 1000.0, stiffness) / 1000.0
    assert found.state.traction_ratio[0, 0] == pytest.approx(expected, abs=3e-4)
    field = contact.run(test, step=1, mu=mu).json
    assert field["exact"]["T_over_N"] == pytest.approx(expected, abs=1e-3)
