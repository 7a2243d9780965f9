"""The score's rig against closed forms, CONTACT's numbers and conservation laws; its judge against written answers."""

import dataclasses
import json
import tomllib
from itertools import product

import numpy as np
import pytest
from score.cases import GROUPS, plan
from score.contact import HalfSpace, hertz_ellipse
from score.effects import CATALOGUE
from score.heat import Plant, thermocouple
from score.hidden import NOTHING, Hidden, Moment
from score.hiding import channel_of, draw
from score.histories import GEOMETRIES, draw_rig, off_by_tolerance
from score.judging import judge
from score.making import APART, Case, _attempt, _setting, make, make_test, truth
from score.rig import VICKERS, March, Rig, spreading
from score.scoring import calibration_error, is_right, reliability, table
from score.sensors import CHANNELS, covariates, draw_plan, noise, read, whiten
from score.sizing import Bench, Ruler
from score.traction import equivalent_ellipse, linear_force, saturation
from score.unknowns import STAGES, equivalent, imitations, is_separable, parts
from score.worn_patch import XI, beyond_ellipse
from score.writing import definition

from twindisc_cli.effects import catalogue

MODULUS = 79.3e9 / 0.7  # E* of G = 79.3 GPa, nu = 0.3
# Hertz: CONTACT hzcalc3d and elliptic integrals agree to all digits. a, b [m], p0 [Pa] under 72 N on 30 mm discs.
A, B, P0 = 0.170591303e-3, 0.270524050e-3, 744.9225410e6


@pytest.fixture(scope="module")
def rig():
    return Rig(
        load=72.0, rpm=3000.0, radius=0.03, crown=(np.inf, 0.03), creepage=(0.002, 0.01, 0.05, 0.02),
        iterations=(3, 3, 4, 3), revolutions=4200, capacity=100.0, environment=20.0, contact="half_space",
        law="fastsim", declared_law="fastsim", mu=0.6, wear=1e-4, convection=1.6, creepage_error=(0.0,) * 4,
    )  # fmt: skip


@pytest.fixture(scope="module")
def trace(rig):
    return March(rig).run()


@pytest.fixture(scope="module")
def bench(rig, trace):
    rng = np.random.default_rng(4)
    return Bench(rig, draw_plan(rng, rig, correlated=False, stops=True, discs=(1, 2)), trace)


# ---------------------------------------------------------------------------------------------- contact


def test_hertz_ellipse_of_the_reference_rig():
    found = hertz_ellipse(72.0, MODULUS, 2 / 0.03, 1 / 0.03)
    assert (found.a, found.b) == pytest.approx((A, B), rel=1e-8)
    turned = hertz_ellipse(72.0, MODULUS, 1 / 0.03, 2 / 0.03)
    assert (turned.b, turned.a) == pytest.approx((A, B), rel=1e-8)


def test_hertz_ellipse_of_a_ball_is_a_circle():
    radius = (3 * 72.0 * 0.02 / (4 * MODULUS)) ** (1 / 3)
    found = hertz_ellipse(72.0, MODULUS, 50.0, 50.0)
    assert (found.a, found.b) == pytest.approx((radius, radius), rel=1e-6)


def test_half_space_contact_of_a_sphere_is_hertz():
    y = (np.arange(160) + 0.5) * 5e-6 - 0.4e-3
    solver = HalfSpace(load=72.0, modulus=MODULUS, curvature_x=2 / 0.03, y=y, half_length=0.2e-3, cells=32)
    line_load = solver.solve(y**2 / 0.06)
    assert solver.pressure.max() == pytest.approx(P0, rel=2e-3)
    assert line_load == pytest.approx(0.75 * 72.0 / B * np.maximum(1 - (y / B) ** 2, 0.0), abs=0.005 * 0.75 * 72.0 / B)
    assert solver.half_lengths()[79] == pytest.approx(A, rel=5e-3)


def test_half_space_contact_of_a_worn_profile():
    """CONTACT, open-source release 2025-07-23, rev 2707: a flat 0.6 mm wide, peak 723 MPa at y = 0.296 mm."""
    y = (np.arange(320) + 0.5) * 2.5e-6 - 0.4e-3
    flat, softness = 1.5e-6, 0.15e-6
    gap = softness * np.log1p(np.exp((y**2 / 0.06 - flat) / softness))
    solver = HalfSpace(load=72.0, modulus=MODULUS, curvature_x=2 / 0.03, y=y, half_length=0.15e-3, cells=48)
    line_load = solver.solve(gap)
    assert solver.pressure.max() == pytest.approx(723.2e6, rel=0.01)
    assert abs(y[np.argmax(line_load)]) == pytest.approx(0.295e-3, abs=4e-6)
    assert line_load.max() == pytest.approx(153.26e3, rel=0.01)


@pytest.mark.parametrize(("creepage", "ratio"), [(1e-2, 0.5998), (2e-3, 0.3738), (1e-3, 0.2109)])
def test_traction_of_a_worn_profile(creepage, ratio):
    """CONTACT on its finest grid, at mu = 0.6: a flat of 0.6 mm with smooth shoulders, whose ellipse is 0.017 short."""
    y = (np.arange(60) + 0.5) * 0.9e-3 / 60 - 0.45e-3
    gap = 0.15e-6 * np.logaddexp(0.0, (y**2 / 60e-3 - 1.5e-6) / 0.15e-6)
    contact = HalfSpace(load=72.0, modulus=MODULUS, curvature_x=2.0 / 30e-3, y=y, half_length=0.2e-3, cells=16)
    line_load = contact.solve(gap)
    patch = equivalent_ellipse(contact.half_lengths(), contact.dy)
    beyond = beyond_ellipse(y, contact.half_lengths(), line_load)
    xi = beyond.stiffening * linear_force(patch, 79.3e9, 1.0)[0] * creepage / (0.6 * 72.0)
    assert 0.6 * (saturation(xi, "exact") + np.interp(xi, XI, beyond.departure)) == pytest.approx(ratio, abs=0.004)


def test_an_ellipse_has_nothing_beyond_it():
    y = (np.arange(200) + 0.5) * 2.0 * B / 200 - B
    beyond = beyond_ellipse(y, A * np.sqrt(1.0 - (y / B) ** 2), 1.0 - (y / B) ** 2)
    assert beyond.stiffening == pytest.approx(1.0, abs=1e-3)
    assert np.abs(beyond.departure).max() < 1e-3


def test_implicit_wear_does_not_depend_on_the_size_of_the_steps_beyond_its_error(rig):
    depth = [March(dataclasses.replace(rig, presses=count)).run().profiles[13][1].max() for count in (15, 30, 60)]
    assert abs(depth[1] - depth[2]) < 0.7 * abs(depth[0] - depth[1])
    assert depth[0] == pytest.approx(depth[2], rel=5e-3)


@pytest.mark.parametrize("evenly", [False, True])
def test_a_wander_spreads_by_its_standard_deviation_and_makes_no_wave_grow(evenly):
    y = 5e-6 * np.arange(-60, 61)
    matrix = spreading(y, 40e-6, evenly=evenly)
    row = matrix[60] / matrix[60].sum()
    assert np.sqrt(row @ y**2) == pytest.approx(40e-6, rel=0.01)
    assert np.linalg.eigvalsh(matrix).min() > -1e-12


@pytest.mark.parametrize("hidden", [NOTHING, Hidden(wander=0.1e-3), Hidden(contact="hertz"), Hidden(other_disc=0.3)])
def test_worn_volume_is_the_dissipated_energy_times_k_over_hardness(rig, hidden):
    run = March(rig, [hidden]).run()
    section = sum(depth.sum() for depth in run.profiles[13]) * (run.y[1] - run.y[0])
    assert section * 2 * np.pi * rig.radius * rig.hardness * VICKERS / (rig.wear * run.energy) == pytest.approx(
        1, rel=1e-6
    )
    assert run.profiles[13][0].sum() == pytest.approx(
        hidden.other_disc / (1 - hidden.other_disc) * run.profiles[13][1].sum()
    )


def test_strips_above_their_critical_index_alone_wear_more(rig):
    """In an ellipse that slides all over, the index of a strip falls as a(y) does: the middle is above it first."""
    seen = []

    def severe(index):
        seen.append(index.max())
        return np.where(index > critical, 3.0, 1.0)

    def worn(hidden):
        run = March(dataclasses.replace(rig, contact="hertz", wear=1e-3 * rig.wear), [hidden]).run()
        return run.profiles[13][1], run.wear_index.max()

    plain, largest = worn(NOTHING)
    touched = plain > 1e-6 * plain.max()
    critical = np.inf
    np.testing.assert_allclose(worn(Hidden(wear_locally=severe))[0], plain, rtol=1e-12)
    assert max(seen) == pytest.approx(3 * np.pi / 8 * largest, rel=0.02)
    critical = 0.0
    np.testing.assert_allclose(worn(Hidden(wear_locally=severe))[0][touched], 3 * plain[touched], rtol=0.02)
    critical = 0.8 * max(seen)
    times = worn(Hidden(wear_locally=severe))[0][touched] / plain[touched]
    assert times[times.size // 2] > 1.5
    assert times[[0, -1]] == pytest.approx(1.0, abs=0.03)


@pytest.mark.parametrize("geometry", GEOMETRIES)
def test_rigs_of_every_geometry_slide_all_over_and_wear_their_volume(geometry):
    drawn = draw_rig(
        np.random.default_rng(3), geometry=geometry, kind="rising", contact="half_space", law="fastsim",
        declared_law="fastsim",
    )  # fmt: skip
    run = March(drawn).run()
    section = sum(depth.sum() for depth in run.profiles[sum(drawn.iterations)]) * (run.y[1] - run.y[0])
    removed = section * 2 * np.pi * drawn.radius * drawn.hardness * VICKERS
    assert removed == pytest.approx(drawn.wear * run.energy, rel=1e-6)
    assert run.ratio[-1] == pytest.approx(drawn.mu * drawn.load_tolerance, rel=1e-3)
    assert run.ratio[0] < 0.99 * run.ratio[-1]
    assert 0.5e-6 < run.profiles[sum(drawn.iterations)][1].max() < 12e-6


def test_a_deep_track_is_the_segment_that_its_width_cuts(rig):
    """depth = width^2 / (8 R) for a cylinder that cuts a crown; the elastic patch adds its own width."""
    deep = March(dataclasses.replace(rig, wear=2e-3)).run()
    depth = deep.profiles[13][1]
    width = np.ptp(deep.y[depth > 0.0])
    assert depth.max() == pytest.approx(width**2 / (8 * 0.03), rel=0.12)


@pytest.mark.parametrize("contact", ["hertz", "half_space"])
def test_a_track_that_becomes_wider_than_planned_stays_on_its_strips(rig, contact):
    """An effect wears thirty times as much as was planned, to the same as a wear coefficient thirty times as large."""
    more = March(dataclasses.replace(rig, contact=contact), [Hidden(wear=lambda _: 30.0)])
    planned = March(dataclasses.replace(rig, contact=contact, wear=30.0 * rig.wear))
    one, other = more.run(), planned.run()
    for march in (more, planned):
        patch = march._patch
        edge = patch.ellipse.b if contact == "hertz" else np.abs(patch.y[patch.line_load > 0.0]).max()
        assert edge < patch.y[-1]
    assert one.profiles[13][1].max() == pytest.approx(other.profiles[13][1].max(), rel=0.05)
    assert one.ratio[-1] == pytest.approx(other.ratio[-1], rel=0.01)
    worn = sum(depth.sum() for depth in one.profiles[13]) * (one.y[1] - one.y[0])
    assert worn == pytest.approx(30.0 * rig.wear * one.energy / (700 * VICKERS * 2 * np.pi * 0.03), rel=1e-3)


# ---------------------------------------------------------------------------------------------- traction, heat


@pytest.mark.parametrize(
    ("creepage", "fastsim", "exact"),
    [(1e-4, 0.01984, 0.019823), (0.002, 0.31603, 0.324956), (0.004, 0.49196, 0.513430), (0.007, 0.58931, 0.599026)],
)
def test_traction_laws_against_contact(creepage, fastsim, exact):
    """CONTACT rev 2707 at mu = 0.6: FASTSIM on 240 elements, the exact theory extrapolated."""
    xi = 79.3e9 * A * B * 3.9388 * creepage / (0.6 * 72.0)
    assert 0.6 * saturation(xi, "fastsim") == pytest.approx(fastsim, abs=7e-4)
    assert 0.6 * saturation(xi, "exact") == pytest.approx(exact, abs=1e-5)


def test_sliding_dissipates_friction_times_sliding_speed(rig, trace):
    late = trace.power[-1]
    assert late == pytest.approx(0.6 * 72.0 * 0.02 * rig.speed, rel=1e-9)


def test_heat_of_constant_power_is_the_exponential():
    plant = Plant(capacity=100.0, convection=1.6, hidden=[])
    time = np.arange(0.0, 300.0, 2.5)
    rise = plant.run(time, np.full(time.size - 1, 24.0))
    assert rise == pytest.approx(15.0 * (1 - np.exp(-1.6 * time / 100.0)), abs=1e-6)


def test_heat_without_losses_is_stored_in_disc_and_shaft():
    plant = Plant(capacity=100.0, convection=0.0, hidden=[Hidden(shaft=(0.5, 300.0, 0.0), share=0.5)])
    time = np.arange(0.0, 6000.0, 3.0)
    rise = plant.run(time, np.full(time.size - 1, 8.0))
    # both warm at P / (C + Cs), the shaft behind by Cs dT/dt / G
    late = (rise[-1] - rise[-2]) / 3.0
    assert late == pytest.approx(4.0 / 400.0, rel=1e-6)
    assert 100.0 * rise[-1] + 300.0 * (rise[-1] - 300.0 * late / 0.5) == pytest.approx(4.0 * time[-1], rel=1e-6)


def test_a_thermocouple_follows_a_ramp_behind_by_its_time_constant():
    time = np.arange(0.0, 400.0, 3.0)
    assert thermocouple(time, 0.1 * time, 20.0)[-1] == pytest.approx(0.1 * (time[-1] - 20.0), rel=1e-6)


# ---------------------------------------------------------------------------------------------- sensors, sizes


@pytest.mark.parametrize("channel", CHANNELS)
def test_noise_is_as_planned_and_whitens(bench, channel):
    quiet = dict.fromkeys(CHANNELS, 0.0)
    planned = dataclasses.replace(bench.plan, rho=dict.fromkeys(CHANNELS, 0.7), drift=quiet, outliers=quiet)
    samples = read(bench.rig, bench.trace, [NOTHING], planned)[channel].size
    draws = [noise(np.random.default_rng(i), planned, channel, samples) for i in range(60)]
    assert np.std(draws) == pytest.approx(planned.sigma[channel], rel=0.06)
    white = np.array([whiten(planned, channel, draw) for draw in draws])
    assert np.std(white) == pytest.approx(1.0, rel=0.05)
    assert np.mean(white[:, 1:] * white[:, :-1]) == pytest.approx(0.0, abs=0.05)
    assert np.mean([d[1:] * d[:-1] for d in draws]) / np.var(draws) == pytest.approx(0.7, abs=0.12)


@pytest.mark.parametrize("name", ["falling_friction", "profile_tilt", "thermocouple_lag"])
def test_an_effect_is_made_as_large_as_asked(bench, name):
    ruler, drawn = Ruler(bench), CATALOGUE[name][1](np.random.default_rng(2), bench.rig, bench.trace)
    shown = bench.readings([drawn.at(ruler.amount(drawn, 12.0))])
    assert ruler.size(shown, bench.plan) == pytest.approx(12.0, rel=0.035)
    louder = dataclasses.replace(bench.plan, sigma={k: 2.0 * v for k, v in bench.plan.sigma.items()})
    assert ruler.size(shown, louder) == pytest.approx(6.0, rel=0.035)


def test_beside_itself_nothing_is_left_of_an_effect_and_beside_another_channels_all(bench):
    ruler = Ruler(bench)
    tilt, lag = bench.readings([Hidden(read_profile=lambda y, h: h + 2e-5 * y)]), bench.readings([Hidden(lag=5.0)])
    assert ruler.beside(tilt, [tilt], bench.plan) < 1e-6
    assert ruler.beside(tilt, [lag], bench.plan) == pytest.approx(ruler.size(tilt, bench.plan, steps=1), rel=1e-3)


def test_imitations_of_a_law_add_up_to_a_constant(bench):
    laws = imitations("mu", "creepage", bench.trace)
    for creepage in (0.002, 0.0077, 0.05):
        moment = Moment(creepage=creepage)
        assert sum(law.friction(moment) - 1.0 for law in laws) == pytest.approx(0.05 * STAGES["mu"].largest)


def test_what_the_base_parameters_absorb_has_no_size(bench):
    ruler = Ruler(bench)
    other = dataclasses.replace(bench.rig, mu=0.66, wear=0.7e-4, convection=2.2)
    shown, own = read(other, March(other).run(), [NOTHING], bench.plan), bench.readings([NOTHING])
    length = np.linalg.norm(np.concatenate([whiten(bench.plan, name, shown[name] - own[name]) for name in CHANNELS]))
    assert length > 100.0
    assert ruler.size(shown, bench.plan) < 5e-3 * length


@pytest.mark.parametrize("name", [*CATALOGUE, *(f"{q}_over_{stage.covariates[0]}:sine" for q, stage in STAGES.items())])
def test_every_effect_shows_in_its_channel_and_grows(bench, name):
    rig = dataclasses.replace(bench.rig, contact="hertz") if name == "half_space_contact" else bench.rig
    at = dataclasses.replace(bench, rig=rig, trace=March(rig).run())
    drawn, channel = draw(name, np.random.default_rng(5), rig, at.trace), channel_of(name)
    silent, shown = at.readings([NOTHING]), []
    for size in (0.2 * drawn.largest, 0.5 * drawn.largest):
        reading = at.readings([drawn.at(1.0 if drawn.fixed else size)])
        assert all(np.isfinite(value).all() for value in reading.values())
        shown.append(np.linalg.norm((reading[channel] - silent[channel]) / at.plan.sigma[channel]))
    assert shown[0] > 0.5
    assert shown[1] > shown[0] or drawn.fixed


def test_every_effect_of_the_catalogue_has_a_truth_of_its_own_here():
    """By a formula written from the literature; see "Adding a physical effect" in CONTRIBUTING.

    But the level of one of several tests: the score's are fitted one by one.
    """
    assert {name for name, effect in catalogue().items() if not effect.level_of} == {*CATALOGUE}


def test_a_law_acts_at_its_stage_alone(bench):
    """A shift of the recorded ratio neither heats nor wears; a factor of the heat leaves friction and wear alone."""
    silent = bench.readings([NOTHING])
    for kind, touched in (
        ("traction_ratio_over_time:hump", {"traction"}),
        ("heat_over_creepage:hump", {"temperature"}),
        ("wear_over_time:window", {"profile", "traction", "temperature"}),
    ):
        drawn = draw(kind, np.random.default_rng(1), bench.rig, bench.trace)
        shown = bench.readings([drawn.at(0.3 * drawn.largest)])
        assert {name for name in CHANNELS if not np.allclose(shown[name], silent[name], rtol=1e-9)} <= touched


def test_time_and_creepage_are_one_on_a_ramp_and_two_on_another_history(rig):
    ramp = dataclasses.replace(rig, creepage=(0.002, 0.01, 0.05), iterations=(3, 3, 3), creepage_error=(0.0,) * 3)
    down = dataclasses.replace(ramp, creepage=(0.05, 0.01, 0.002))
    seen, elsewhere = (covariates(trace, trace.time[1:]) for trace in (March(r).run() for r in (ramp, down)))
    up_and_down = covariates(*((lambda t: (t, t.time[1:]))(March(rig).run())))
    assert {"time", "cycles", "energy"} <= {*equivalent("time", seen)}
    assert {"creepage", "greatest_creepage", "sliding_speed"} <= {*equivalent("creepage", seen)}
    assert not is_separable("creepage", seen, elsewhere)
    assert not is_separable("time", seen, elsewhere)
    assert "greatest_creepage" not in equivalent("creepage", up_and_down)
    assert is_separable("creepage", up_and_down, elsewhere)


@pytest.mark.long
def test_a_test_is_written_the_same_for_the_same_seed_and_its_truth_elsewhere(tmp_path, monkeypatch):
    monkeypatch.setattr(Rig, "fine", lambda rig: rig)
    case = Case(3, ("thermocouple_lag",))
    for where in ("one", "two"):
        make_test(case, tmp_path / where / "tests" / "t", tmp_path / where / "truth" / "t.json")
    folder = tmp_path / "one" / "tests" / "t"
    tables = ["profile.csv", "temperature.csv", "traction.csv"]
    files = [*tables, "test.toml", "other.toml", *(f"other_{table}" for table in tables)]
    assert sorted(p.name for p in folder.iterdir()) == sorted(files)
    for path in folder.iterdir():
        assert path.read_bytes() == (tmp_path / "two" / "tests" / "t" / path.name).read_bytes()
        assert b"thermocouple_lag" not in path.read_bytes()
    told = json.loads((tmp_path / "one" / "truth" / "t.json").read_text())
    assert told["truth"] == ["thermocouple_lag"]
    assert told["sizes"][0] == pytest.approx(12.0, rel=0.05)


@pytest.fixture(scope="module")
def nothing_hidden():
    return make(Case(11))


def test_nothing_hidden_is_nothing_but_noise(nothing_hidden):
    for record, name in product((nothing_hidden.own, nothing_hidden.other), CHANNELS):
        rest = record.measured[name] - record.clean[name]
        assert np.median(np.abs(rest)) / 0.6745 == pytest.approx(record.plan.sigma[name], rel=0.25)


@pytest.fixture(scope="module")
def driven(rig):
    """All sliding, each step with a load and a speed of its own."""
    return dataclasses.replace(
        rig, creepage=(0.04, 0.05, 0.06, 0.05), loads=(1.0, 2.0, 0.5, 1.0), speeds=(1.0, 0.5, 1.5, 1.0)
    )


def test_steps_of_their_own_dissipate_what_they_slide(driven):
    trace = March(driven).run()
    lasts = driven.revolutions * 2 * np.pi * 0.03 * np.array(driven.iterations)  # rolled in each step [m]
    energy = 0.6 * 72.0 * np.sum(lasts * np.array(driven.creepage) * driven.loads)
    assert trace.energy == pytest.approx(energy, rel=1e-9)
    assert trace.ratio == pytest.approx(0.6, rel=1e-9)
    worn = sum(depth.sum() for depth in trace.profiles[13]) * (trace.y[1] - trace.y[0])
    assert worn == pytest.approx(1e-4 * energy / (700 * VICKERS * 2 * np.pi * 0.03), rel=1e-6)
    assert trace.time[-1] == pytest.approx(84.0 * (3 + 3 / 0.5 + 4 / 1.5 + 3))
    assert trace.moments["cycles"][-1] == pytest.approx(13 * driven.revolutions)


def test_a_track_under_another_load_keeps_what_is_worn_and_presses_as_hertz(driven):
    trace = March(driven).run()
    before, after = (trace.profiles[done][1] for done in (6, 7))
    assert np.all(after >= before - 1e-12)
    light = March(dataclasses.replace(driven, wear=1e-9, loads=(2.0,) * 4)).run()
    power = light.moments["power"][0] / light.moments["wear_index"][0]  # speed times the area of the patch
    assert power / driven.speed == pytest.approx(np.pi * A * B * 2.0 ** (2 / 3), rel=0.02)


def test_the_other_history_is_the_same_rig_within_the_range_of_its_creepages(nothing_hidden):
    own, other = nothing_hidden.own.rig, nothing_hidden.other.rig
    assert other.creepage != own.creepage
    assert min(own.creepage) <= min(other.creepage) <= max(other.creepage) <= max(own.creepage)
    given = dict.fromkeys(("creepage", "iterations", "creepage_error", "loads", "speeds"), ())
    assert dataclasses.replace(other, **given) == dataclasses.replace(own, **given)


def test_what_is_off_by_its_tolerance_is_not_in_the_definition_and_a_wide_tolerance_is(nothing_hidden):
    rig, plan = nothing_hidden.own.rig, nothing_hidden.own.plan
    narrow, wide = (off_by_tolerance(np.random.default_rng(1), rig, wide=wide) for wide in (False, True))
    for off in (narrow, wide):
        assert off.curvature_y != rig.curvature_y and off.shear_modulus != rig.shear_modulus
    assert narrow.curvature_y == pytest.approx(rig.curvature_y, rel=0.01)
    plain = definition(dataclasses.replace(rig, declared_std=0.0), plan, "a", "")
    assert definition(narrow, plan, "a", "") == plain
    told = tomllib.loads(definition(wide, plan, "a", ""))
    crown, modulus = told["rig"]["disc2"]["transverse_radius_mm"], told["material"]["youngs_modulus_GPa"]
    assert (crown["value"], modulus["value"]) == (1e3 * rig.crown[1], 206.0)
    assert crown["std"] / crown["value"] == pytest.approx(0.03 / 3**0.5, rel=0.01)


def test_a_fault_of_a_sensor_is_nothing_hidden_and_has_no_size(bench, nothing_hidden):
    shift = Hidden(read_traction=lambda t, r: r + 0.05, read_profile=lambda y, h: h + 1e-7 + 1e-4 * y)
    assert Ruler(bench, ("torque_offset", "profile_tilt")).size(bench.readings([shift]), bench.plan) < 1e-6
    draft = nothing_hidden.draft
    faulty = dataclasses.replace(draft, setting=dataclasses.replace(draft.setting, faults=("profile_tilt",)))
    told = truth(dataclasses.replace(nothing_hidden, draft=faulty))
    assert (told["truth"], told["tolerated"][0]) == ([], "profile_tilt")


# ---------------------------------------------------------------------------------------------- judging


def answer(*effects, laws=(), unexplained=(), after=0.0041, elsewhere=None, notes=()):
    given = {
        "effects": [{"effect": e[0], "alternatives": list(e[1:])} for e in effects],
        "laws": [_law(*law) for law in laws],
        "unexplained": [dict(zip(("channel", "covariate"), u.split(":"), strict=True)) for u in unexplained],
        "error": {"traction": {"unit": "1", "noise": 0.004, "held_out_after": after}, "profile": {}},
        "base": {},
        "notes": list(notes),
    }
    if elsewhere:
        before, after = elsewhere
        error = {"noise": 0.004, "before": None, "held_out_before": before, "held_out_after": after}
        given["validation"] = {"test": "other", "error": {"traction": error, "profile": {}}}
    return given


def _law(pair, *alternatives):
    quantity, covariate = pair.split("_over_")
    others = [dict(zip(("quantity", "covariate"), other.split("_over_"), strict=True)) for other in alternatives]
    return {"quantity": quantity, "covariate": covariate, "alternatives": others}


NOTHING_HIDDEN = {"truth": []}
LAG = {
    "truth": ["thermocouple_lag"],
    "iterations": [2, 1],
    "noise": {"traction": [[8, 8 * 0.009**2], [8, 8 * 0.0038**2], [8, 8 * 0.0042**2]]},
}
PAIR = {"truth": ["falling_friction", "lateral_wander"]}
BURST = {
    "truth": "unexplained:traction:time",
    "law": {"quantity": "mu", "covariate": "time", "equivalent": ["time", "cycles"], "quantities": ["mu"]},
}
NEAR = {
    "truth": ["running_in_friction"],
    "law": {"quantity": "mu", "covariate": "cycles", "equivalent": ["time", "cycles", "energy"], "quantities": ["mu"]},
}
OLD_BURST = {"truth": "unexplained:traction:time"}


@pytest.mark.parametrize(
    ("group", "truth", "given", "right"),
    [
        ("null", NOTHING_HIDDEN, answer(), True),
        ("null", NOTHING_HIDDEN, answer(("load_error",)), False),
        ("null", NOTHING_HIDDEN, answer(laws=[("mu_over_time",)]), False),
        ("null", NOTHING_HIDDEN, answer(unexplained=["traction:time"]), False),
        ("null", {"truth": [], "tolerated": ["exact_elasticity"]}, answer(("exact_elasticity",)), True),
        ("null", {"truth": [], "tolerated": ["torque_offset"]}, answer(("creepage_offset", "torque_offset")), True),
        ("null", {"truth": [], "tolerated": ["torque_offset"]}, answer(("creepage_offset", "load_error")), False),
        ("single", LAG | {"tolerated": ["load_error"]}, answer(("thermocouple_lag", "load_error")), True),
        ("single", LAG, answer(("thermocouple_lag",)), True),
        ("single", LAG, answer(("heat_partition", "thermocouple_lag", "shaft_conduction")), True),
        ("single", LAG, answer(("heat_partition", "thermocouple_lag", "shaft_conduction", "load_error")), False),
        ("single", LAG, answer(("heat_partition",)), False),
        ("single", LAG, answer(("thermocouple_lag",), ("load_error",)), False),
        ("single", LAG, answer(("thermocouple_lag",), laws=[("mu_over_time",)]), False),
        ("single", LAG, answer(laws=[("heat_over_time",)]), False),
        ("single", LAG, answer(), False),
        ("pairs", PAIR, answer(("falling_friction",), ("stylus_smoothing", "lateral_wander")), True),
        ("pairs", PAIR, answer(("falling_friction",)), False),
        ("near", NEAR, answer(("running_in_friction",)), True),
        ("near", NEAR, answer(laws=[("mu_over_energy",)]), True),
        ("near", NEAR, answer(laws=[("mu_over_temperature", "mu_over_time")]), False),
        ("near", NEAR, answer(("running_in_friction",), ("load_error",)), False),
        ("near", NEAR, answer(("film_breakdown",)), False),
        ("unknown", BURST, answer(laws=[("mu_over_cycles", "mu_over_energy")]), True),
        ("unknown", BURST, answer(laws=[("mu_over_energy", "mu_over_time")]), True),
        ("unknown", BURST, answer(laws=[("mu_over_energy",)]), False),
        ("unknown", BURST, answer(laws=[("slope_over_time",)]), False),
        ("unknown", BURST, answer(("running_in_friction", "mu_over_time")), True),
        ("unknown", BURST, answer(("running_in_friction", "mu over cycles")), True),
        ("unknown", BURST, answer(("running_in_friction",)), False),
        ("unknown", BURST, answer(("lateral_offset",), laws=[("mu_over_time",)]), False),
        ("unknown", BURST, answer(unexplained=["traction:time"]), False),
        ("unknown", OLD_BURST, answer(laws=[("mu_over_time",)]), True),
        ("unknown", OLD_BURST, answer(laws=[("heat_over_time",)]), False),
        ("null", NOTHING_HIDDEN, {"failed": "exit code 1"}, False),
    ],
)
def test_judge(group, truth, given, right):
    assert is_right({"group": group, "truth": truth, "judged": judge(truth, given)}) is right


def test_judge_tells_stage_from_pair_and_a_wrong_name_from_one_beside_the_law():
    stage = judge(BURST, answer(laws=[("mu_over_creepage",)]))
    assert (stage["stage"], stage["pair"], stage["wrong_name"]) == (True, False, False)
    assert judge(BURST, answer(("running_in_friction",)))["wrong_name"]
    assert judge(BURST, answer(("running_in_friction",)))["stage"]  # friction, as mu
    assert not judge(BURST, answer(("lateral_offset",)))["stage"]
    assert not judge(BURST, answer(laws=[("slope_over_time",)]))["stage"]
    warm = judge({**BURST, "law": {**BURST["law"], "quantities": ["heat"]}}, answer(laws=[("convection_over_time",)]))
    assert (warm["stage"], warm["quantity"]) == (True, False)
    assert not judge(BURST, answer(("running_in_friction", "mu_over_time")))["wrong_name"]


def test_judge_tells_the_noise_floor():
    assert judge(LAG, answer(("thermocouple_lag",)))["at_floor"]
    assert not judge(LAG, answer(("thermocouple_lag",), after=0.0049))["at_floor"]
    whole_step = answer(("thermocouple_lag",), after=0.0066) | {"hold_out_steps": {"test": [1]}}
    assert judge(LAG, whole_step)["at_floor"]
    assert not judge(LAG, answer(("heat_partition", "thermocouple_lag")))["first_0"]


def test_judge_tells_what_holds_on_another_history():
    good = judge(LAG, answer(elsewhere=(0.008, 0.0045)))
    assert good["elsewhere"] == {"traction": pytest.approx([2.0, 1.125])}
    assert good["transferred"] and not good["worse"]
    bad = judge(LAG, answer(elsewhere=(0.008, 0.012)))
    assert bad["worse"] and not bad["transferred"] and not bad["warned"]
    assert judge(LAG, answer(elsewhere=(0.008, 0.012), notes=["mu over time is used outside its range"]))["warned"]
    aside = answer(elsewhere=(0.008, 0.012), notes=["an interval is as wide as its range"])
    assert not judge(LAG, aside)["warned"]
    noisy = LAG | {"noise_other": {"traction": 0.01}}
    assert judge(noisy, answer(elsewhere=(0.008, 0.012)))["transferred"]


def test_table_counts():
    rows = [
        {"group": "null", "truth": NOTHING_HIDDEN, "judged": judge(NOTHING_HIDDEN, given)}
        for given in (answer(), answer(), answer(("load_error",)))
    ]
    assert table(rows)[0][1:3] == (1, 3)


def test_probabilities_told_are_compared_with_how_often_they_are_right():
    told = [(0.9, True)] * 8 + [(0.9, False)] * 2 + [(0.3, True)] * 5 + [(0.3, False)] * 5
    assert reliability(told) == [(pytest.approx(0.3), 0.5, 10), (pytest.approx(0.9), 0.8, 10)]
    assert calibration_error(told) == pytest.approx(0.5 * 0.2 + 0.5 * 0.1)
    given = answer(("running_in_friction",), laws=[("mu_over_energy", "mu_over_creepage", "mu_over_time")])
    given["effects"][0]["probability"] = 0.2
    given["laws"][0]["probability"] = 0.5
    given["laws"][0]["alternatives"][1]["probability"] = 0.3
    assert judge(BURST, given)["told"] == [(0.2, False), (0.5, False), (0.3, True)]
    ramp = BURST | {"same": {name: ["creepage", "energy", "time"] for name in ("creepage", "energy", "time")}}
    assert judge(ramp, given)["told"] == [(0.2, False), (0.8, True)]


def test_what_cannot_be_told_apart_is_one_claim():
    """A mechanism by its name and as a law, and quantities that show alike."""
    near = BURST | {"truth": ["film_breakdown"], "law": {"quantities": ["mu", "slope"], "equivalent": ["creepage"]}}
    given = answer(laws=[("mu_over_creepage", "slope_over_creepage", "mu_over_time")])
    law = given["laws"][0]
    law["alternatives"].append({"effect": "film_breakdown"})
    for part, probability in zip([law, *law["alternatives"]], (0.5, 0.1, 0.15, 0.2), strict=True):
        part["probability"] = probability
    assert judge(near, given)["told"] == [(pytest.approx(0.8), True), (0.15, False)]


def test_intervals_of_what_nothing_hidden_shows_in_are_held_against_the_truth():
    given = answer(("thermocouple_lag",))
    given["base"] = {
        "mu": {"low": 0.59, "high": 0.61},
        "K": {"low": 1e-5, "high": 2e-5},
        "convection_W_K": {"low": 1.0, "high": 2.0},
    }
    values = {"mu": 0.6, "K": 3e-5, "hS": 5.0, "channels": ["temperature"]}
    assert judge(LAG | values, given)["covered"] == [True, False]


def test_plan_has_every_group_and_at_least_two_hundred_tests():
    cases = plan(220, 2)
    assert len(cases) >= 200
    assert {case.group for case in cases} == set(GROUPS)
    assert {case.effects[0] for case in cases if case.group == "single"} == set(CATALOGUE) - {"misalignment"}
    assert {parts(case.effects[0])[0] for case in cases if case.group == "unknown"} == set(STAGES)
    assert len({case.seed for case in cases}) == len(cases)
    assert cases == plan(220, 2)


def test_pairs_share_a_channel_in_some_cases_and_both_can_be_told():
    pairs = [case.effects for case in plan(400, 2, ("pairs",))]
    shared = np.mean([channel_of(one) == channel_of(other) for one, other in pairs])
    assert 0.3 < shared < 0.5
    draft = _attempt(np.random.default_rng(1), Case(1, ("torque_offset", "sensor_drift"), 15.0))
    assert min(draft.apart) >= APART
    assert max(draft.apart) <= 1.05 * max(draft.sizes)


def test_figure_has_a_point_for_every_size():
    pytest.importorskip("matplotlib")
    from score.figure import draw

    rows = [
        {"group": group, "truth": truth | {"target_size": size}, "judged": judge(truth, answer(("thermocouple_lag",)))}
        for group, truth in (("single", LAG), ("sizes", LAG), ("unknown", BURST), ("null", NOTHING_HIDDEN))
        for size in (6.0, 12.0)
    ]
    left, right, told = draw(rows).axes
    named_first = next(c for c in left.containers if c.get_label() == "true effect named first")
    assert named_first.lines[0].get_xdata().tolist() == [6.0, 12.0]
    assert named_first.lines[0].get_ydata().tolist() == [1.0, 1.0]
    assert told.get_xlabel() == "reported probability"
    falsely = next(c for c in right.containers if c.get_label() == "a wrong name")
    assert falsely.lines[0].get_ydata().tolist() == [1.0, 1.0]


def test_the_traction_law_is_no_second_effect_beside_a_hidden_one():
    """With nothing of the catalogue hidden the true law may be the exact one where FASTSIM is declared."""
    laws = {
        effects: [_setting(np.random.default_rng(seed), effects).rig for seed in range(60)]
        for effects in ((), ("falling_friction",))
    }
    assert all(rig.law == rig.declared_law for rig in laws[("falling_friction",)])
    assert {(rig.law, rig.declared_law) for rig in laws[()]} == {
        ("fastsim", "fastsim"),
        ("exact", "exact"),
        ("exact", "fastsim"),
    }
