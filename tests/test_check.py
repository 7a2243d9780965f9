import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from definitions import TRACTION, VALID, changed, outcome, shipped, write

from twindisc_cli.commands.check import run
from twindisc_cli.consistency import findings
from twindisc_cli.consistency.finding import Finding
from twindisc_cli.consistency.wear import facet_depth
from twindisc_cli.definition import load
from twindisc_cli.identify.energy import measured_energy
from twindisc_cli.identify.wear_history import wear_history
from twindisc_cli.model.base import BaseParameters
from twindisc_cli.model.forward import ForwardModel

CURVATURE = 1 / 0.03
SPEED = 0.03 * 100 * np.pi
HARDNESS = 700 * 9.80665e6


def found(folder: Path, text: str = VALID, **data: str) -> dict[str, Finding]:
    return {f.subject: f for f in findings(load(write(folder, text, **data)).experiment)}


def facet(depth_um: float, width_mm: float) -> str:
    y = np.linspace(-1.5, 1.5, 301)
    height = -depth_um * np.clip(1 - (2 * y / width_mm) ** 2, 0, None)
    return "y [mm],height [um]\n" + "".join(f"{a:.4f},{b:.5f}\n" for a, b in zip(y, height, strict=True))


@pytest.mark.parametrize(
    ("scale", "says"),
    [
        ((1.0, -1.0), "where a track would be cut in"),
        ((1.0, 1e-3), "is the column height of the profile in the unit"),
        ((1e3, 1.0), "is the column y of the profile in the unit"),
    ],
)
def test_a_profile_upside_down_or_in_another_unit_contradicts(
    tmp_path: Path, scale: tuple[float, float], says: str
) -> None:
    header, *rows = facet(6.0, 1.2).splitlines()
    scaled = [",".join(f"{float(v) * s:.8g}" for v, s in zip(row.split(","), scale, strict=True)) for row in rows]
    results = found(tmp_path, profile="\n".join([header, *scaled]) + "\n").values()
    (message,) = [f.message for f in results if f.rule in ("upside down", "unit of the track", "chord and depth")]
    assert says in message
    upright = found(tmp_path, profile=facet(6.0, 1.2)).values()
    assert not any(f.rule in ("upside down", "unit of the track") for f in upright)


def test_minutes_under_seconds_are_asked_about(tmp_path: Path) -> None:
    end = float(load(write(tmp_path, VALID)).experiment.history.end_time[-1])

    def temperature(factor: float) -> str:
        rows = (f"{t * factor:.4f},{20.0 + 5.0 * t / end:.3f}\n" for t in np.linspace(0.0, end, 30))
        return "time [s],temperature [degC]\n" + "".join(rows)

    name = "the time of the last sample of the temperature"
    assert "are they minutes" in found(tmp_path, VALID, temperature=temperature(1 / 60))[name].message
    assert name not in found(tmp_path, VALID, temperature=temperature(1.0))


def with_reported(**reported: float) -> str:
    return VALID + "[reported]\n" + "".join(f"{key} = {value}\n" for key, value in reported.items())


@pytest.mark.parametrize(
    ("width", "depth"),
    # the chord of a circle of 30 mm: 1.8 and 1.51 mm by w^2 / 8R, 18 mm by the exact sagitta 30 - sqrt(30^2 - 9^2)
    [(1.8e-3, 13.5e-6), (1.51e-3, 9.5e-6), (18e-3, 1.3818e-3)],
)
def test_depth_of_a_facet(width: float, depth: float) -> None:
    assert facet_depth(width, CURVATURE) == pytest.approx(depth, rel=2e-3)


def test_no_chord_is_longer_than_the_circle() -> None:
    assert facet_depth(61e-3, CURVATURE) == np.inf


@pytest.mark.parametrize(
    ("width", "ok"),
    # 6 um on 30 mm is a chord of 1.2 mm; the elastic patch 2b = 0.541 mm widens it to at most 1.316 mm; margin 15 %
    [(1.2, True), (1.3, True), (1.8, False), (0.9, False)],
)
def test_width_against_depth(tmp_path: Path, width: float, ok: bool) -> None:
    assert found(tmp_path, profile=facet(6.0, width))["the measured width"].ok is ok
    assert found(tmp_path, with_reported(depth_um=6.0, width_mm=width))["the reported width"].ok is ok


def test_the_width_of_a_rough_profile_is_not_its_flanks(tmp_path: Path) -> None:
    rows = facet(6.0, 1.2).splitlines()
    noise = np.random.default_rng(1).normal(0.0, 0.25, len(rows) - 1)
    rough = [
        rows[0],
        *(f"{r.split(',')[0]},{float(r.split(',')[1]) + n}" for r, n in zip(rows[1:], noise, strict=True)),
    ]
    assert found(tmp_path, profile="\n".join(rough))["the measured width"].value == pytest.approx(1.17, abs=0.08)


@pytest.mark.parametrize("name", ["ambient", "cryogenic"])
def test_depth_and_width_of_a_profile_are_the_same_in_every_command(name: str) -> None:
    test = shipped(name)
    width = {f.subject: f for f in findings(test.experiment)}["the reconstructed width"].value
    assert width == outcome(name, "fit-k").json["measured_width_mm"]


def test_wear_coefficient_against_the_energy(tmp_path: Path) -> None:
    # E = N V sum(T/N creepage t) = 72 x 9.42478 x (0.49 x 0.5 % x 168 + 0.55 x 1 % x 168 + 0.58 x 2 % x 84) J
    energy = 72 * 0.03 * 100 * np.pi * (0.49 * 0.005 * 168 + 0.55 * 0.01 * 168 + 0.58 * 0.02 * 84)
    volume = 2 * np.pi * 0.03 * 2 / 3 * 1.2e-3 * 6e-6
    k = volume * 700 * 9.80665e6 / energy
    for factor, ok in ((1.0, True), (2.0, False), (0.5, False)):
        text = changed(friction_coefficient=f"wear_coefficient = {k * factor}")
        finding = found(tmp_path, text, traction=TRACTION, profile=facet(6.0, 1.2))["the declared wear coefficient K"]
        assert finding.ok is ok
        assert finding.low == pytest.approx(k / 1.5, rel=1e-3)
        assert finding.high == pytest.approx(k * 1.5, rel=1e-3)


def weighed(*rows: tuple[int, int, float]) -> str:
    """Weighings: iteration, disc, mass loss [mg]."""
    return "iteration,disc,mass loss [mg]\n" + "".join(f"{stop},{disc},{loss:.9f}\n" for stop, disc, loss in rows)


def with_density(text: str, more: str = "") -> str:
    return text.replace("hardness_HV = 700", f"hardness_HV = 700\ndensity_kg_m3 = 7850.0\n{more}")


def test_a_volume_goes_with_the_energy_by_its_stop_and_the_hardness_of_its_disc(tmp_path: Path) -> None:
    """Full slip: E by iteration 3 of 5 is mu N V (2 x 0.5 % + 1 x 1 %) t; m = rho K E / H with each disc's H."""
    energy, k = 0.1 * 72 * SPEED * (2 * 0.005 + 0.01) * 84, 7e-5
    loss = 7850.0 * k * energy / HARDNESS * 1e6
    text = changed(friction_coefficient=f"friction_coefficient = 0.1\nwear_coefficient = {k}")
    soft = with_density(text, "[material.disc1]\nhardness_HV = 70\n")
    for which, masses in ((with_density(text), weighed((3, 2, loss))), (soft, weighed((3, 1, 10.0 * loss)))):
        finding = found(tmp_path, which, mass=masses)["the declared wear coefficient K"]
        assert finding.low == pytest.approx(k / 1.5, rel=1e-6)
        assert finding.high == pytest.approx(k * 1.5, rel=1e-6)


def test_each_disc_with_a_coefficient_of_its_own_is_judged_by_its_own_mass(tmp_path: Path) -> None:
    energy = 0.1 * 72 * SPEED * (2 * 0.005 + 2 * 0.01 + 0.02) * 84
    masses = weighed((5, 1, 3e-5 * 7850.0 * energy / HARDNESS * 1e6), (5, 2, 7e-5 * 7850.0 * energy / HARDNESS * 1e6))
    keys = "friction_coefficient = 0.1\nwear_coefficient = 7e-5\ndisc1_wear_coefficient = 3e-5"
    outcome = found(tmp_path, with_density(changed(friction_coefficient=keys)), mass=masses)
    assert outcome["the declared wear coefficient K"].low == pytest.approx(7e-5 / 1.5, rel=1e-6)
    assert outcome["the declared wear coefficient K of disc 1"].low == pytest.approx(3e-5 / 1.5, rel=1e-6)


@pytest.mark.parametrize("own", ["", "disc1_wear_coefficient = 7e-5\n"])
def test_a_declared_change_of_the_wear_counts(tmp_path: Path, own: str) -> None:
    energy = 0.1 * 72 * SPEED * (2 * 0.005 + 2 * 0.01 + 0.02) * 84
    text = changed(friction_coefficient=f"friction_coefficient = 0.1\nwear_coefficient = 7e-5\n{own}")
    text = with_density(text + "[effects.wear_level]\nfactor = 2.0\n")
    mass = weighed((5, 2, 2.0 * 7e-5 * 7850.0 * energy / HARDNESS * 1e6))
    assert found(tmp_path, text, mass=mass)["the declared wear coefficient K"].low == pytest.approx(7e-5 / 1.5)


def test_a_disc_that_bears_half_the_wear_shows_half_the_depth(tmp_path: Path) -> None:
    """6 um together cut a chord of 1.2 mm, of which each disc shows 3 um; K is that of both volumes."""
    energy = 0.1 * 72 * SPEED * (2 * 0.005 + 2 * 0.01 + 0.02) * 84
    k = 2 * np.pi * 0.03 * 2 / 3 * 1.2e-3 * 6e-6 * HARDNESS / energy
    text = changed(friction_coefficient=f"friction_coefficient = 0.1\nwear_coefficient = {k}")
    shared = text + "[effects.wear_partition]\ndisc1_share = 0.5\n"
    outcome = found(tmp_path, shared, profile=facet(3.0, 1.2))
    assert outcome["the measured width"].low == pytest.approx(1.2 / 1.15, rel=2e-3)
    assert outcome["the declared wear coefficient K"].high == pytest.approx(1.5 * k, rel=2e-3)
    assert not found(tmp_path, text, profile=facet(3.0, 1.2))["the measured width"].ok
    wandered = text + "[effects.lateral_wander]\nstd_mm = 0.3\n"
    assert "the measured width" not in found(tmp_path, wandered, profile=facet(3.0, 1.2))


def test_a_track_on_a_flat_disc_has_the_radius_of_the_other(tmp_path: Path) -> None:
    text = with_density(VALID).replace("disc1 = { rolling_radius_mm = 30.0", "disc1 = { rolling_radius_mm = inf")
    text = text.replace("mean_speed_rpm = 3000.0", "rolling_speed_m_s = 9.42478")
    profile = facet(6.0, 1.2).replace("\n", ",1\n").replace("[um],1", "[um],disc", 1)
    loss = 7850.0 * 2 * np.pi * 0.03 * 2 / 3 * 1.2e-3 * 6e-6 * 1e6
    finding = found(tmp_path, text, profile=profile, mass=weighed((5, 1, loss)))["the mass loss of disc 1"]
    assert finding.ok
    assert finding.high == pytest.approx(1.2 * loss, rel=2e-3)


def temperatures(top: float) -> str:
    return f"time [s],temperature [degC]\n10,20\n200,{20 + top / 2}\n400,{20 + top}\n"


def test_a_rise_is_paid_for_by_heat(tmp_path: Path) -> None:
    # the last step dissipates 0.58 x 72 N x 2 % x 9.42478 m/s = 7.87 W, so at most 9.84 K at 0.8 W/K
    text = changed(heat_capacity_J_K="heat_capacity_J_K = 100\nconvection_W_K = 0.8")
    limit = 0.58 * 72 * 0.02 * 0.03 * 100 * np.pi / 0.8
    for rise, ok in ((0.99 * limit, True), (1.2 * limit, False)):
        test = load(write(tmp_path, text, traction=TRACTION, temperature=temperatures(rise))).experiment
        outcomes = [f for f in findings(test) if f.subject == "the measured temperature rise"]
        assert [f.ok for f in outcomes] == [True, ok]
        assert outcomes[1].high == pytest.approx(1.05 * limit)


def test_a_rise_under_declared_heat_is_not_paid_for_by_friction_alone(tmp_path: Path) -> None:
    text = changed(heat_capacity_J_K="heat_capacity_J_K = 100\nconvection_W_K = 0.8")
    data = {"traction": TRACTION, "temperature": temperatures(15.0)}
    assert not found(tmp_path, text, **data)["the measured temperature rise"].ok
    for declared in (
        "[effects.parasitic_heat]\npower_W = 8.0\n",
        '[laws.warm]\nquantity = "bearing_heat"\ncovariate = "rolling_speed"\nat = [9.0, 10.0]\nshift = [8.0, 8.0]\n',
    ):
        assert "the measured temperature rise" not in found(tmp_path, text + declared, **data)


@pytest.mark.parametrize("declared", ["step", "misalignment"])
def test_what_slides_sideways_heats_too(tmp_path: Path, declared: str) -> None:
    """In full slip at 4 % and 30 mrad T is 0.8 of mu N, and mu N V 5 % is dissipated."""
    yaw = ", yaw_mrad = 30.0" if declared == "step" else ""
    text = changed(heat_capacity_J_K="heat_capacity_J_K = 100\nconvection_W_K = 0.8")
    text = text.replace("{ creepage_percent = 2.0 }", f"{{ creepage_percent = 4.0{yaw} }}")
    text += "[effects.misalignment]\nyaw_mrad = 30.0\n" if declared == "misalignment" else ""
    traction = "creepage [%],traction ratio [1]\n" + "".join(
        f"{v},{0.58 * v / np.hypot(v, 3.0)}\n" for v in (0.5, 1, 4)
    )
    test = load(write(tmp_path, text, traction=traction, temperature=temperatures(15.0))).experiment
    (_, by_convection) = (f for f in findings(test) if f.subject == "the measured temperature rise")
    assert by_convection.high == pytest.approx(1.05 * 0.58 * 72 * 0.05 * SPEED / 0.8, rel=2e-3)


def test_no_disc_gets_colder_than_its_environment(tmp_path: Path) -> None:
    cold = temperatures(5.0).replace("10,20", "10,15")
    assert not found(tmp_path, traction=TRACTION, temperature=cold)["the disc below its environment"].ok
    assert found(tmp_path, traction=TRACTION, temperature=temperatures(5.0))["the disc below its environment"].ok


@pytest.mark.parametrize(("coldest", "ok"), [(20.0, True), (5.0, False)])
def test_a_noisy_thermometer_may_read_less_than_the_disc_has(tmp_path: Path, coldest: float, ok: bool) -> None:
    """Of 40 readings that scatter by 2 K the coldest lies 4 to 6 K below a disc that stays at its environment."""
    readings = coldest + 2.0 * np.random.default_rng(1).standard_normal(40)
    text = "time [s],temperature [degC]\n" + "\n".join(f"{10 * i + 10},{v}" for i, v in enumerate(readings))
    assert found(tmp_path, traction=TRACTION, temperature=text)["the disc below its environment"].ok == ok


@pytest.mark.parametrize(
    ("course", "ok"),
    [
        (lambda t: 20.0 + 25.0 * np.exp(-t / 60.0), False),  # a warm disc cools
        (lambda t: 45.0 + 0.0 * t, False),  # it and its room are warm
        (lambda t: 20.0 + 40.0 * (1.0 - np.exp(-t / 12.0)), True),  # a heat that is not known warms a disc that was not
        (lambda t: 24.0 + 0.0 * t, True),  # a zero of the thermometer
        (lambda t: 20.0 - 12.0 * (1.0 - np.exp(-t / 12.0)), True),  # a colder room than declared
    ],
)
def test_the_first_readings_are_of_the_disc_at_the_start(
    tmp_path: Path, course: Callable[[np.ndarray], np.ndarray], ok: bool
) -> None:
    """Readings every 2 s of a test of 420 s whose definition says 20 degC."""
    time = np.arange(2.0, 420.0, 2.0)
    text = "time [s],temperature [degC]\n" + "\n".join(f"{t},{v:.3f}" for t, v in zip(time, course(time), strict=True))
    (finding,) = [
        f for f in found(tmp_path, traction=TRACTION, temperature=text).values() if f.rule.startswith("start")
    ]
    assert finding.ok == ok


def test_a_thermometer_in_fahrenheit_is_asked_for(tmp_path: Path) -> None:
    """A disc of 20 degC reads 68; who heats it to 60 before the test is asked for the key alone."""
    for reading, asked in ((68.0, True), (60.0, False)):
        rows = "".join(f"{t},{reading}\n" for t in range(4, 400, 4))
        data = {"traction": TRACTION, "temperature": f"time [s],temperature [degC]\n{rows}"}
        (finding,) = [f for f in found(tmp_path, **data).values() if f.rule == "start temperature"]
        assert f"the disc at the start is {reading:g} °C, the definition says 20 °C" in finding.message
        assert "declare initial_temperature_C under [thermal]" in finding.message
        assert ("degF" in finding.message) == asked


@pytest.mark.parametrize(("ratio", "ok"), [(0.47, True), (0.56, False)])
def test_no_friction_explains_more_than_the_elastic_limit(tmp_path: Path, ratio: float, ok: bool) -> None:
    # CONTACT rev 2707: a = 0.170591 mm, b = 0.270524 mm, C11 = 3.9388 at G = 79.3 GPa (79.23 here)
    slope = 206e9 / 2.6 * 0.170591e-3 * 0.270524e-3 * 3.9388 / 72
    text = VALID.replace("creepage_percent = 0.5", "creepage_percent = 0.25")
    traction = TRACTION.replace("\n0.5,0.49", f"\n0.25,{ratio}")
    finding = found(tmp_path, text, traction=traction)["T/N of step 1"]
    assert finding.high == pytest.approx(1.05 * slope * 0.0025, rel=0.01)
    assert finding.ok is ok


def test_a_step_of_another_load_has_a_limit_of_its_own(tmp_path: Path) -> None:
    """G a b C11 v / N goes as N^(-1/3): under an eighth of the load it is twice as large."""
    lighter = ", normal_load_N = 9.0"
    text = VALID.replace("creepage_percent = 0.5", "creepage_percent = 0.05")
    traction = TRACTION.replace("\n0.5,0.49", "\n0.05,0.16")
    whole = found(tmp_path, text, traction=traction)["T/N of step 1"]
    text = text.replace("creepage_percent = 0.05,", f"creepage_percent = 0.05{lighter},")
    part = found(tmp_path, text, traction=traction)["T/N of step 1"]
    assert (whole.ok, part.ok) == (False, True)
    assert part.high == pytest.approx(2.0 * whole.high, rel=1e-6)


@pytest.mark.parametrize("known", [True, False])
def test_worn_discs_are_stiffer_than_new_ones(tmp_path: Path, known: bool) -> None:
    """T/N of the model on a worn track lies above the limit of new discs."""
    steps = "steps = [{ creepage_percent = 5.0, iterations = 5 }, { creepage_percent = 0.02, iterations = 2 }]"
    start, end = VALID.index("steps = ["), VALID.index("[model]")
    text = f"{VALID[:start]}{steps}\n\n{VALID[end:]}".replace("friction_coefficient = 0.6", "wear_coefficient = 2e-3")
    traction = "creepage [%],traction ratio [1]\n5,0.6\n0.02,{}\n"
    test = load(write(tmp_path, text, traction=traction.format(0.02))).experiment
    ratio = ForwardModel(test).predict(BaseParameters.declared(test, np.full((1, 2), 0.6))).traction[0, 1]
    if not known:
        text = text.replace("wear_coefficient = 2e-3", "")
    outcome = found(tmp_path, text, traction=traction.format(ratio))
    assert all(finding.ok for finding in outcome.values())
    assert ("T/N of step 2" in outcome) is known
    hard = found(tmp_path, text.replace("2e-3", "1e-9"), traction=traction.format(ratio))
    assert all(finding.ok for finding in hard.values()) is not known


def test_the_greatest_load_presses_hardest(tmp_path: Path) -> None:
    """p0 goes as N^(1/3); shakedown goes by load and T/N of the same step."""
    text = VALID.replace("creepage_percent = 1.0", "creepage_percent = 1.0, normal_load_N = 576.0")
    traction = TRACTION.replace("\n1,0.55", "\n1,0.10").replace("\n2,0.58", "\n2,0.30")
    plain, heavy = found(tmp_path, traction=traction), found(tmp_path, text, traction=traction)
    for subject in ("Hertz's peak pressure", "the patch over its radius"):
        assert heavy[subject].value == pytest.approx(2.0 * plain[subject].value, rel=1e-6)
    (by_load,) = (finding for subject, finding in heavy.items() if subject.startswith("p0 / k"))
    assert by_load.subject.endswith("T/N = 0.1")
    assert by_load.value == pytest.approx(2.0 * 744.9e6 * 3.0 * np.sqrt(3.0) / HARDNESS, rel=2e-3)


def test_what_agrees_asks_nothing(tmp_path: Path) -> None:
    outcome = found(tmp_path, traction=TRACTION)
    share = outcome["the share of samples with T/N opposed to the creepage"]
    assert share.message == "0 % of the samples have T/N opposed to the creepage"
    against = found(tmp_path, traction=TRACTION.replace(",0.", ",-0."))[share.subject]
    assert against.message.startswith("100 % of the samples have T/N opposed to the creepage; ")
    assert all(finding.hint not in finding.message for finding in outcome.values() if finding.hint)


@pytest.mark.parametrize("readings", [[0.55] * 12, [0.55] * 11 + [0.551], [0.55] * 11])
def test_a_sensor_that_gives_one_reading_all_the_time_is_asked_about(tmp_path: Path, readings: list[float]) -> None:
    levels = (0.5, 1.0, 2.0)
    rows = "".join(f"{1 + i % 3},{levels[i % 3]},{reading}\n" for i, reading in enumerate(readings))
    outcome = found(tmp_path, traction=f"step,creepage [%],traction_ratio [1]\n{rows}")
    dead = [finding for subject, finding in outcome.items() if subject.startswith("the number of different readings")]
    if len(set(readings)) == 1 and len(readings) == 12:
        assert dead[0].message.startswith("all 12 readings of the traction are 0.55; is the sensor dead")
        assert not dead[0].ok
    else:
        assert not dead


def worn_track_of(y: np.ndarray) -> np.ndarray:
    """A parabola of 1.8 µm over 0.8 mm between flanks that are rough by 20 nm [µm], y [mm]."""
    rough = 0.02 * np.random.default_rng(8).standard_normal(len(y))
    return np.asarray(rough - 1.8 * np.maximum(1.0 - (y / 0.4) ** 2, 0.0))


def profile_file(y: np.ndarray, height: np.ndarray) -> str:
    return "y [mm],height [um]\n" + "".join(f"{a:.4f},{b:.4f}\n" for a, b in zip(y, height, strict=True))


@pytest.mark.parametrize(
    ("spoilt", "says"),
    [
        (lambda y, height: (y, height), ""),
        (lambda y, height: (y, np.maximum(height, -1.0)), "no height was recorded over 0.5"),
        (
            lambda y, height: (y[np.abs(y) > 0.1], height[np.abs(y) > 0.1]),
            "no height was recorded over 0.22 mm deep in the",
        ),
        (
            lambda y, height: (y, np.where(np.abs(y) < 1e-9, -50.0, height)),
            "one height is 50 µm deep, and no other deeper than 1.8",
        ),
        (lambda y, height: (y[::10], height[::10]), ""),
    ],
)
def test_a_track_that_was_not_recorded_whole_is_asked_about(
    tmp_path: Path, spoilt: Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]], says: str
) -> None:
    """A stylus at its limit, a gap where the track is deepest, a spike; points that are few, but even, are a track."""
    y = np.linspace(-1.5, 1.5, 151)
    outcome = found(tmp_path, traction=TRACTION, profile=profile_file(*spoilt(y, worn_track_of(y))))
    said = [f.message for f in outcome.values() if f.rule in ("hole in the track", "lone height") and not f.ok]
    assert [line[: len(says)] for line in said] == ([says] if says else [])


@pytest.mark.parametrize(("loss", "ok"), [(0.4, True), (400.0, False)])
def test_a_mass_in_the_wrong_unit_wears_faster_than_metals_do(tmp_path: Path, loss: float, ok: bool) -> None:
    text = VALID.replace("hardness_HV = 700", "hardness_HV = 700\ndensity_kg_m3 = 7800.0")
    outcome = found(tmp_path, text, traction=TRACTION, mass=f"iteration,disc,mass loss [mg]\n5,2,{loss}\n")
    fast = [finding for finding in outcome.values() if finding.rule == "wears too fast"]
    assert [finding.ok for finding in fast] == ([] if ok else [False])


def test_a_negative_traction_and_a_soft_disc(tmp_path: Path) -> None:
    traction = TRACTION.replace(",0.", ",-0.")
    text = VALID + "[material.disc1]\nhardness_HV = 70\n"
    outcome = found(tmp_path, text, traction=traction)
    assert not outcome["the share of samples with T/N opposed to the creepage"].ok
    # Hertz: 745 MPa against 70 HV = 686 MPa
    assert not outcome["Hertz's peak pressure"].ok
    assert outcome["Hertz's peak pressure"].value == pytest.approx(744.9, rel=2e-3)


def test_a_patch_beyond_the_theory_is_told(tmp_path: Path) -> None:
    text = changed(disc2="disc2 = { rolling_radius_mm = 30.0, transverse_radius_mm = 0.05 }")
    assert not found(tmp_path, text)["the axis ratio a/b"].ok


def test_a_consistent_test_passes(tmp_path: Path) -> None:
    result = run(load(write(tmp_path, traction=TRACTION, profile=facet(6.0, 1.2), temperature=temperatures(5.0))))
    assert result.exit_code == 0
    assert result.json["problems"] == []
    assert len(result.json["findings"]) >= 6


@pytest.mark.parametrize(
    ("name", "energy", "needed", "printed"),
    [("ambient", 92.9, "12.9 µm", "1.38e+03 µm"), ("cryogenic", 64.3, "9.2 µm", "966 µm")],
)
def test_the_papers_own_numbers_contradict_each_other(name: str, energy: float, needed: str, printed: str) -> None:
    result = outcome(name, "check")
    assert result.exit_code == 5
    problems = {p["subject"]: p for p in result.json["problems"]}
    assert set(problems) == {"the reconstructed width", "the reported width", "the reported wear coefficient K"}
    assert needed in problems["the reconstructed width"]["message"]
    assert printed in problems["the reported width"]["message"]
    k = problems["the reported wear coefficient K"]
    assert f"{energy:g} kJ" in k["message"]
    # the printed K is 14 to 20 times what the depth allows
    assert 14 <= 9.89e-4 / (k["low"] * 1.5) <= 20
    json.dumps(result.json)


@pytest.mark.parametrize("name", ["eurosprinter", "mtm_running_in"])
def test_the_measured_tests_do_not(name: str) -> None:
    result = outcome(name, "check")
    assert result.exit_code == 0, result.summary


@pytest.mark.parametrize(
    ("losses", "uncertainty", "ok"),
    [
        ((1.0, 2.0, 3.0), 0.1, True),
        ((1.0, 0.6, 3.0), 0.1, True),  # 0.4 mg: 2.8 standard errors of a difference
        ((1.0, 0.2, 3.0), 0.1, False),  # 0.8 mg: 5.7 of them
        ((1.0, 0.9, 3.0), None, True),  # within 5 % of the mass lost
        ((1.1, 0.9, 1.0), None, False),  # step by step and not from the beginning
    ],
)
def test_a_disc_gains_no_mass(tmp_path: Path, losses: tuple[float, ...], uncertainty: float | None, ok: bool) -> None:
    own = "" if uncertainty is None else f",{uncertainty}"
    head = "iteration,disc,mass loss [mg]" + ("" if uncertainty is None else ",uncertainty [mg]")
    rows = "".join(f"{stop},2,{loss}{own}\n" for stop, loss in zip((2, 4, 5), losses, strict=True))
    text = VALID.replace("hardness_HV = 700", "hardness_HV = 700\ndensity_kg_m3 = 7850.0")
    every = found(tmp_path, text, mass=f"{head}\n{rows}")
    (weighed,) = [finding for subject, finding in every.items() if "gained" in subject]
    assert weighed.ok is ok


@pytest.mark.parametrize(
    "creepage, more", [(0.05, ""), (2.0, "[effects.falling_friction]\nratio = 0.1\ndecay_s_m = 30")]
)
def test_exact_wear_by_a_given_mu_is_no_contradiction(tmp_path: Path, creepage: float, more: str) -> None:
    """Where T/N was not measured, a given mu is not T/N: part of the patch may stick, and an effect may act."""
    text = changed(friction_coefficient="friction_coefficient = 0.6\nwear_coefficient = 1e-3") + more
    begin, end = text.index("steps = ["), text.index("[model]")
    text = f"{text[:begin]}steps = [{{ creepage_percent = {creepage}, iterations = 8 }}]\n{text[end:]}"
    worn = wear_history(ForwardModel(load(write(tmp_path, text)).experiment), mu=np.array([0.6]), wear_coefficient=1e-3)
    rows = [f"{y * 1e3},{z * 1e6}" for y, z in zip(worn.y, worn.height[-1], strict=True)]
    test = load(write(tmp_path, text, profile="\n".join(["y [mm],height [um]", *rows])))
    assert measured_energy(test.experiment) == pytest.approx(worn.energy[-1], rel=1e-6)
    assert not run(test).json["problems"]
