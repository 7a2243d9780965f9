"""simulate-wear and fit-k: conservation, the paper's story, recovery of a known K, and bad input."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from definitions import TRACTION, VALID, changed, outcome, shipped, write

from twindisc_cli.commands import contact, fit_k, simulate_wear
from twindisc_cli.definition import Test, load
from twindisc_cli.errors import DefinitionError, MeasurementError
from twindisc_cli.identify.wear_history import wear_history
from twindisc_cli.model.experiment import Experiment, ProfileSamples
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.model.wear_path import grid

DISCS = """\
schema = 1
[test]
name = "t"
[rig]
normal_load_N = 72.0
mean_speed_rpm = 3000.0
disc1 = { rolling_radius_mm = 30.0, transverse_radius_mm = inf }
disc2 = { rolling_radius_mm = 30.0, transverse_radius_mm = 30.0 }
[material]
youngs_modulus_GPa = 206.0
poisson_ratio = 0.30
hardness_HV = 700
[model]
"""
HARDNESS = 700 * 9.80665e6


def with_k(test: Test, k: float, **model: object) -> Test:
    options = replace(test.experiment.options, wear_coefficient=k, **model)
    return replace(test, experiment=replace(test.experiment, options=options))


@pytest.fixture(scope="module")
def ambient() -> Test:
    return shipped("ambient")


@pytest.fixture(scope="module")
def fitted():
    return outcome("ambient", "fit-k").json


@pytest.mark.parametrize("contact", ["hertz", "half_space"])
def test_worn_volume_is_the_energy_of_every_iteration(ambient, contact):
    found = simulate_wear.run(with_k(ambient, 6e-5, contact=contact)).json["iterations"]
    volume = np.array([i["worn_volume_mm3"] for i in found]) * 1e-9
    energy = np.array([i["dissipated_energy_kJ"] for i in found]) * 1e3
    assert volume * HARDNESS / 6e-5 == pytest.approx(energy, rel=1e-6)


def test_dissipated_energy_of_full_sliding_is_friction_times_way(ambient):
    options = replace(ambient.experiment.options, wear_coefficient=6e-5, friction_coefficient=0.5)
    history = replace(ambient.experiment.history, given_mu=np.full_like(ambient.experiment.history.creepage, 0.5))
    test = replace(ambient, experiment=replace(ambient.experiment, options=options, history=history))
    found = simulate_wear.run(test).json["iterations"]
    steps = np.diff([i["dissipated_energy_kJ"] for i in found]) * 1e3
    speed = 0.03 * 3000 * 2 * np.pi / 60
    way = speed * history.creepage * history.duration
    sliding = history.creepage[1:] >= 0.01
    assert steps[sliding] == pytest.approx((0.5 * 72.0 * way[1:])[sliding], rel=1e-6)


def test_a_pause_has_no_friction(tmp_path):
    """The identified mu of the steps beside it (0.5 of 2 %), none in the pause."""
    steps = "steps = [{ creepage_percent = 2.0 }, { pause_s = 60.0 }, { creepage_percent = 2.0 }]"
    (tmp_path / "t.csv").write_text("step,creepage [%],traction ratio [1]\n1,2.0,0.5\n3,2.0,0.5\n")
    more = f"wear_coefficient = 6e-4\n[history]\nrevolutions_per_iteration = 4200\n{steps}\n"
    (tmp_path / "t.toml").write_text(f'{DISCS}{more}[measured]\ntraction = "t.csv"\n')
    found = simulate_wear.run(load(tmp_path / "t.toml"))
    assert [i["mu"] for i in found.json["iterations"]] == [pytest.approx(0.5), None, pytest.approx(0.5)]
    friction = found.figure().axes[1]
    assert friction.get_ylim()[1] < 0.6


def test_a_history_that_only_rolls_is_drawn_without_a_mu(tmp_path):
    history = "[history]\nrevolutions_per_iteration = 4200\nsteps = [{ creepage_percent = 0.0 }]\n"
    (tmp_path / "t.toml").write_text(f"{DISCS}wear_coefficient = 6e-4\n{history}")
    found = simulate_wear.run(load(tmp_path / "t.toml"))
    assert found.json["iterations"][0]["mu"] is None
    assert found.figure().axes[1].get_ylim()[0] == 0.0


def test_wear_flattens_the_disc_and_widens_the_patch(ambient):
    found = simulate_wear.run(with_k(ambient, 6e-5)).json
    first, last = found["iterations"][0], found["iterations"][-1]
    assert first["radius_mm"] == pytest.approx(30.0, rel=0.02)
    assert found["final_radius_mm"] > 100.0
    assert last["a_mm"] < first["a_mm"]
    assert last["b_mm"] > first["b_mm"]
    assert last["p0_MPa"] < first["p0_MPa"] == pytest.approx(744.6, rel=0.02)
    for key in ("depth_um", "width_mm", "worn_volume_mm3", "dissipated_energy_kJ"):
        assert found[key] == last[key]
        assert np.all(np.diff([i[key] for i in found["iterations"]]) >= 0.0)


def test_the_error_of_the_steps_is_told_and_small(ambient):
    found = simulate_wear.run(with_k(ambient, 6e-5)).json
    assert 0.0 < found["error_estimate_percent"] < 0.5


@pytest.mark.parametrize("contact", ["hertz", "half_space"])
def test_halving_the_steps_changes_next_to_nothing(ambient, contact, monkeypatch):
    test = with_k(ambient, 6e-5, contact=contact)
    before = simulate_wear.run(test).json
    monkeypatch.setattr(grid, "GROWTH", 0.5 * grid.GROWTH)
    rig = replace(test.experiment.rig, normal_load=72.0 * (1 + 1e-12))  # another rig to what remembers its paths
    after = simulate_wear.run(replace(test, experiment=replace(test.experiment, rig=rig))).json
    assert after["depth_um"] != before["depth_um"]
    assert after["depth_um"] == pytest.approx(before["depth_um"], rel=0.005)
    assert after["width_mm"] == pytest.approx(before["width_mm"], rel=0.005)


def test_a_flat_facet_obeys_depth_and_chord(ambient):
    # worn far beyond the patch the track is the facet of a sphere on a cylinder: depth = width^2 / (8 R)
    found = simulate_wear.run(with_k(ambient, 1e-3, contact="half_space")).json
    facet = np.sqrt(8 * 0.95 * found["depth_um"] * 1e-3 * 30.0)
    assert found["width_mm"] == pytest.approx(facet, rel=0.05)


def test_the_papers_story(ambient, fitted):
    """One K, from the test in air, gives the depth in nitrogen; there, wear begins when friction rises."""
    assert fitted["K"] == pytest.approx(6e-5, rel=0.15)
    assert fitted["depth_um"] == pytest.approx(6.0, rel=0.01)
    assert fitted["width_mm"] < 0.75 * fitted["measured_width_mm"]
    nitrogen = simulate_wear.run(with_k(shipped("cryogenic"), fitted["K"])).json
    assert nitrogen["depth_um"] == pytest.approx(4.4, rel=0.10)
    early = [i for i in nitrogen["iterations"] if i["time_s"] <= 2000.0]
    assert early[-1]["worn_volume_mm3"] < 0.1 * nitrogen["worn_volume_mm3"]
    assert early[-1]["depth_um"] < 0.1 * nitrogen["depth_um"]


def test_where_the_shapes_differ_the_error_takes_in_both_methods(fitted):
    apart = fitted["K_least_squares"] - fitted["K_bisection"]
    assert fitted["method"] == "bisection"
    assert fitted["K_std"] == pytest.approx(np.hypot(fitted["K_least_squares_std"], apart))


def test_one_k_is_to_be_used_and_the_others_say_why_they_differ(fitted):
    known = {k["name"]: k for k in fitted["K_known"]}
    assert [name for name, k in known.items() if k["use"]] == ["bisection"]
    assert known["bisection"]["K"] == fitted["K"]
    half = 1.6449 * fitted["K_std"]
    assert [fitted["K_low"], fitted["K_high"]] == pytest.approx([fitted["K"] - half, fitted["K"] + half], rel=1e-3)
    # Archard's law conserves the volume: W H = K E whatever the shape of the track
    share = float(re.search(r"wears (\d+) %", known["W H / E"]["why"])[1])
    assert share == pytest.approx(100.0 * fitted["K"] / known["W H / E"]["K"], abs=0.5)
    assert not known["reported"]["from_data"]
    told = outcome("ambient", "fit-k").summary
    assert told[0].startswith("use K = (5.7 ± 2.9)e-5 (one standard deviation), by bisection")
    assert any(line.startswith("warning: the 90 % interval of K is as wide as K") for line in told)
    assert all(any(line.strip().startswith(name) for line in told) for name in known if name != "bisection")


def test_the_printed_k_is_impossible(fitted):
    assert fitted["stated"]["reported"]["K"] == 9.89e-4
    assert 5.0 < fitted["stated"]["reported"]["times_allowed"] < 20.0
    assert len(fitted["findings"]) == 1
    assert "impossible" in fitted["findings"][0]


def test_bisection_is_the_papers(fitted):
    trail = fitted["bisection"]
    assert abs(trail[-1]["Er_percent"]) < 1.0
    assert fitted["K"] == trail[-1]["K"] == fitted["K_bisection"]
    depth = fitted["depth_um"]
    assert trail[-1]["Er_percent"] == pytest.approx(
        (fitted["measured_depth_um"] - depth) / fitted["measured_depth_um"] * 100
    )


def measured_after(test: Experiment, k: float, *, noise: float, seed: int) -> Experiment:
    """The test with the profile that K makes of it, and white noise [m]."""
    mu = np.full(len(test.history.step_creepage), 0.55)
    model = ForwardModel(replace(test, options=replace(test.options, wear_coefficient=k)))
    worn = wear_history(model, mu=mu, wear_coefficient=k)
    y = np.linspace(-2e-3, 2e-3, 401)
    height = np.interp(y, worn.y, worn.height[-1], left=0.0, right=0.0)
    height = height + noise * np.random.default_rng(seed).standard_normal(len(y))
    last = np.full(len(y), len(test.history.step))
    profile = ProfileSamples(y=y, height=height, disc=np.full(len(y), 2), iteration=last)
    return replace(
        test,
        options=replace(test.options, friction_coefficient=0.55),
        measured=replace(test.measured, profile=profile, traction=None),
    )


@pytest.mark.long
def test_a_known_k_is_found_again_with_an_honest_error(ambient):
    misses = []
    for seed in range(8):
        test = measured_after(ambient.experiment, 7e-5, noise=0.1e-6, seed=seed)
        found = fit_k.run(replace(ambient, experiment=test)).json
        misses.append((found["K_least_squares"] - 7e-5) / found["K_least_squares_std"])
        assert found["K"] == pytest.approx(7e-5, rel=0.05)
        assert found["width_mm"] == pytest.approx(found["measured_width_mm"], rel=0.05)
    assert np.sqrt(np.mean(np.square(misses))) < 2.0


def test_a_smooth_profile_gives_k_by_least_squares(ambient):
    test = measured_after(ambient.experiment, 7e-5, noise=0.0, seed=0)
    found = fit_k.run(replace(ambient, experiment=test)).json
    assert found["method"] == "least squares"
    assert found["K"] == pytest.approx(7e-5, rel=1e-3)
    assert found["K_from_volume_and_energy"] == pytest.approx(7e-5, rel=1e-3)


def test_simulate_wear_takes_k_from_the_profile_where_none_is_given(ambient, fitted):
    found = outcome("ambient", "simulate-wear").json
    assert found["wear_coefficient"] == pytest.approx(fitted["K"], rel=1e-12)
    assert "profile" in found["wear_coefficient_source"]


def test_wear_is_shared_between_the_discs(ambient):
    test = with_k(ambient, 6e-5)
    shared = replace(test, experiment=replace(test.experiment, effects={"wear_partition": {"disc1_share": 0.25}}))
    alone, both = simulate_wear.run(test), simulate_wear.run(shared)
    assert both.json["worn_volume_mm3"] == pytest.approx(alone.json["worn_volume_mm3"], rel=1e-3)
    assert both.json["depth_um"] == pytest.approx(0.75 * alone.json["depth_um"], rel=1e-2)
    heights = {array.name: array.values for array in both.dataset.arrays}
    assert heights["disc1_height"][-1] == pytest.approx(heights["height"][-1] / 3.0, rel=1e-9, abs=1e-15)


@pytest.mark.parametrize("command", ["simulate-wear", "fit-k"])
@pytest.mark.parametrize("name", ["ambient", "cryogenic"])
def test_figures_say_that_the_data_are_reconstructed(command, name):
    figure = outcome(name, command).figure()
    assert "reconstructed data" in [text.get_text() for text in figure.texts]


def test_what_is_missing_is_named(tmp_path):
    with pytest.raises(DefinitionError, match="wear coefficient"):
        simulate_wear.run(load(write(tmp_path)))
    with pytest.raises(MeasurementError, match="profile"):
        fit_k.run(load(write(tmp_path)))
    nothing = changed(friction_coefficient="wear_coefficient = 7e-5")
    with pytest.raises(DefinitionError, match="friction is known for step 1, 2, 3"):
        simulate_wear.run(load(write(tmp_path, nothing)))
    beyond = TRACTION.replace("0.55", "2.5")
    with pytest.raises(DefinitionError, match="step 2"):
        simulate_wear.run(load(write(tmp_path, nothing, traction=beyond)))


@pytest.mark.parametrize("lift", [0.0, 1e-6])
def test_a_profile_in_which_nothing_is_worn_gives_no_k(ambient, lift):
    profile = ambient.experiment.measured.profile
    flat = replace(profile, height=np.full_like(profile.height, lift))
    test = replace(ambient.experiment, measured=replace(ambient.experiment.measured, profile=flat))
    for command in (fit_k, simulate_wear):
        with pytest.raises(MeasurementError, match="nothing is worn off in the last measured profile"):
            command.run(replace(ambient, experiment=test))


def test_a_profile_upside_down_is_asked_about(ambient):
    profile = ambient.experiment.measured.profile
    turned = replace(profile, height=-profile.height)
    test = replace(ambient.experiment, measured=replace(ambient.experiment.measured, profile=turned))
    with pytest.raises(MeasurementError, match=r"^profile: nothing is worn off .* stands up by 6 µm .*sign = -1"):
        fit_k.run(replace(ambient, experiment=test))


def test_the_written_profile_has_the_same_peak_pressure_in_contact(tmp_path: Path) -> None:
    """Of a track 1.5 times as wide as the new patch; a wider one is said not to resolve its shoulders."""
    text = VALID.replace("[model]\n", '[model]\ncontact = "half_space"\nwear_coefficient = 6e-4\n')
    worn = load(write(tmp_path, text))
    result = simulate_wear.run(worn)
    wide = result.json["width_mm"] / (2e3 * float(worn.experiment.rig.patch.b))
    assert 1.3 < wide < simulate_wear.RESOLVED
    assert not any("shoulders" in line for line in result.summary)
    y = next(axis.values for axis in result.dataset.axes if axis.name == "y")
    height = next(array.values for array in result.dataset.arrays if array.name == "height")[-1]
    rows = "".join(f"{1e3 * place:.9g},{1e6 * high:.9g}\n" for place, high in zip(y, height, strict=True))
    (tmp_path / "written.csv").write_text(f"y [mm],height [um]\n{rows}")
    read = load(write(tmp_path, f'{text}\n[measured]\nprofile = "written.csv"\n'))
    assert contact.run(read, step=1).json["exact"]["p0_MPa"] == pytest.approx(result.json["p0_MPa"], rel=0.02)
    deeper = simulate_wear.run(load(write(tmp_path, text.replace("6e-4", "8e-3"))))
    assert any("shoulders" in line for line in deeper.summary)
