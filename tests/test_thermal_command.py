"""thermal: the paper's temperatures, the closed form, convection found again, and bad input."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from definitions import changed, outcome, shipped, write
from rigs import Instruments, Plant, history

from twindisc_cli.commands import thermal
from twindisc_cli.definition import load
from twindisc_cli.errors import DefinitionError
from twindisc_cli.identify.steps import friction_in_use
from twindisc_cli.model.experiment import TemperatureSamples
from twindisc_cli.model.forward import ForwardModel


@pytest.mark.parametrize("name", ["ambient", "cryogenic"])
def test_the_disc_warms_by_about_ten_degrees(name):
    found = outcome(name, "thermal").json
    assert found["rise_C"] == pytest.approx(10.0, abs=1.0)
    assert found["peak_C"] == pytest.approx(found["rise_C"] + (20.0 if name == "ambient" else -196.0))


def test_temperature_falls_where_friction_falls():
    # the mu in nitrogen falls in step 11, from 4200 to 4620 s; the paper sees a fall near 4500 s
    iterations = outcome("cryogenic", "thermal").json["iterations"]
    temperature = {round(i["time_s"]): i["temperature_C"] for i in iterations}
    assert temperature[4620] < temperature[4536] < temperature[4200]
    rising = [i["temperature_C"] for i in iterations if i["time_s"] <= 4200]
    assert np.all(np.diff(rising) > 0.0)


def test_the_papers_steps_follow_the_exact_disc():
    # both settle on the same temperature well before a step of the history ends; at its start Eq. 19 lags a little
    iterations = outcome("ambient", "thermal").json["iterations"]
    exact = np.array([i["temperature_C"] for i in iterations])
    stepped = np.array([i["temperature_eq19_C"] for i in iterations])
    assert stepped[4::5][:10] == pytest.approx(exact[4::5][:10], abs=0.02)
    assert 0.02 < np.abs(stepped - exact).max() < 0.5


def test_the_contact_is_hotter_than_the_disc():
    found = outcome("cryogenic", "thermal").json
    assert found["flash_C"] > 3 * found["rise_C"]
    assert found["flash_mean_C"] < found["flash_C"]


def test_the_flash_is_that_of_the_worn_patch():
    # wear widens the patch: the same heat over more area
    worn = outcome("ambient", "thermal").json
    new = shipped("ambient")
    new = replace(new, experiment=replace(new.experiment, measured=replace(new.experiment.measured, profile=None)))
    unworn = thermal.run(new).json
    assert "from the measured profile" in worn["patch"]
    assert "unworn" in unworn["patch"]
    assert worn["flash_C"] < 0.7 * unworn["flash_C"]
    assert worn["iterations"][0]["flash_C"] == pytest.approx(unworn["iterations"][0]["flash_C"], rel=0.01)


def test_steady_rise_is_power_over_convection():
    test = shipped("ambient")
    slow = replace(test.experiment.history, duration=test.experiment.history.duration * 100)
    found = thermal.run(replace(test, experiment=replace(test.experiment, history=slow))).json
    last = found["iterations"][-1]
    assert last["temperature_C"] - 20.0 == pytest.approx(last["power_W"] / 3.5, rel=1e-6)
    assert last["power_W"] == pytest.approx(0.6 * 72 * 0.03 * 3000 * 2 * np.pi / 60 * 0.09, rel=2e-3)


def test_convection_is_found_from_a_temperature():
    test = shipped("ambient")
    mu = friction_in_use(ForwardModel(test.experiment)).mu  # given, so that the power has no error
    history = replace(test.experiment.history, given_mu=mu[test.experiment.history.step])
    test = replace(test, experiment=replace(test.experiment, history=history))
    known = thermal.run(test)
    columns = {array.name: array.values for array in known.dataset.arrays}
    time = known.dataset.axes[0].values
    noise = 0.1 * np.random.default_rng(2).standard_normal(len(time))
    samples = TemperatureSamples(time=time, temperature=columns["temperature"] + noise)
    unknown = replace(
        test.experiment,
        thermal=replace(test.experiment.thermal, convection=np.nan),
        measured=replace(test.experiment.measured, temperature=samples),
    )
    found = thermal.run(replace(test, experiment=unknown))
    assert found.json["convection_W_K"] == pytest.approx(3.5, abs=3 * found.json["convection_W_K_std"])
    assert found.json["convection_W_K_std"] < 0.02
    assert found.json["convection_source"] == "from the measured temperature"
    std = found.json["convection_W_K_std"]
    assert found.json["convection_W_K_high"] - found.json["convection_W_K_low"] == pytest.approx(
        2 * 1.645 * std, rel=1e-3
    )
    assert "(one standard deviation; 90 % interval 3." in found.summary[0]
    assert not any("warning" in line for line in found.summary)
    figure = found.figure()
    assert "reconstructed data" in [text.get_text() for text in figure.texts]


def test_a_convection_that_the_data_hardly_fix_is_warned_of():
    # in 300 s at 0.25 % creepage the disc warms by far less than the noise of 5 K
    test = shipped("ambient")
    time = np.linspace(1.0, 300.0, 20)
    noise = 5.0 * np.random.default_rng(5).standard_normal(len(time))
    samples = TemperatureSamples(time=time, temperature=293.25 + noise)
    unknown = replace(
        test.experiment,
        thermal=replace(test.experiment.thermal, convection=np.nan),
        measured=replace(test.experiment.measured, temperature=samples),
    )
    found = thermal.run(replace(test, experiment=unknown))
    wide = found.json["convection_W_K_high"] - found.json["convection_W_K_low"] > found.json["convection_W_K"]
    assert wide
    assert any("as wide as the convection itself" in line for line in found.summary)


def test_what_is_left_of_the_temperature_is_that_of_a_thermometer_with_its_lag():
    # the disc and a thermometer that follows it with 150 s, stepped through every half second
    plant = Plant(history((0.03, 0.08, 0.05), 3), lag=150.0)
    made = Instruments(temperature=0.0, channels=("temperature",)).record(plant, np.random.default_rng(1))

    def left(**effects):
        given = {
            "options": replace(made.options, friction_coefficient=0.6),
            "thermal": replace(made.thermal, convection=plant.convection),
            "effects": effects,
        }
        result = thermal.run(replace(shipped("ambient"), experiment=replace(made, **given)))
        return float(re.search(r"one convection leaves (\S+) K rms", " ".join(result.summary)).group(1))

    assert left(thermocouple_lag={"time_constant_s": 150.0}) < 0.02
    assert left() > 1.0


def test_what_is_missing_is_named(tmp_path):
    with pytest.raises(DefinitionError, match="convection"):
        thermal.run(load(write(tmp_path)))
    text = changed()
    begin, end = text.index("[thermal]"), text.index("[history]")
    with pytest.raises(DefinitionError, match="thermal"):
        thermal.run(load(write(tmp_path, text[:begin] + text[end:])))


@pytest.mark.parametrize(("separate", "warmed"), [("false", True), ("true", False)])
def test_a_jump_of_single_samples_that_only_rise_is_reported(tmp_path, separate, warmed):
    """Nothing is left and no scatter is known: all may be the cause, but a disc that begins as declared each time."""
    creepages, mu = [0.5, 1.0, 2.0, 3.0, 4.0, 5.0], [0.12, 0.13, 0.14, 0.4, 0.41, 0.42]
    text = changed(friction_coefficient="", heat_capacity_J_K="heat_capacity_J_K = 100.0\nconvection_W_K = 3.5")
    begin, end = text.index("steps = ["), text.index("[model]")
    steps = ", ".join(f"{{ creepage_percent = {v} }}" for v in creepages)
    text = f"{text[:begin]}separate = {separate}\nsteps = [{steps}]\n{text[end:]}"
    rows = "\n".join(f"{v},{ratio}" for v, ratio in zip(creepages, mu, strict=True))
    result = thermal.run(load(write(tmp_path, text, traction=f"creepage [%],traction ratio [1]\n{rows}\n")))
    causes = {cause["covariate"]: cause["before_the_jump"] for cause in result.json["friction_jump"]["causes"]}
    assert (causes["temperature of the disc"] > 293.15 + 0.1) == warmed
    named = "creepage, temperature of the disc and flash temperature" if warmed else "creepage and flash temperature"
    assert f": {named} cannot be separated" in " ".join(result.summary)


def test_a_disc_that_only_cools_is_hottest_at_its_start(tmp_path):
    """It had risen by -31 K to 49 °C, which is what is left at the first point of the model."""
    thermometer = "heat_capacity_J_K = 100.0\nconvection_W_K = 3.5\ninitial_temperature_C = 80.0"
    result = thermal.run(load(write(tmp_path, changed(heat_capacity_J_K=thermometer))))
    assert result.json["peak_C"] == pytest.approx(80.0)
    assert result.json["rise_C"] == 0.0
    assert "rises by 0 K to 80 °C, at 0 s" in " ".join(result.summary)


def test_steps_that_are_separate_are_drawn_apart_each_from_its_start(tmp_path):
    """Three steps, of 168 s, 168 s and 84 s: after a gap, each begins at its start with the initial temperature."""
    text = changed(heat_capacity_J_K="heat_capacity_J_K = 100.0\nconvection_W_K = 3.5")
    text = text.replace("[history]\n", "[history]\nseparate = true\n")
    disc = thermal.run(load(write(tmp_path, text))).figure().axes[0].get_lines()[0]
    time, temperature = np.asarray(disc.get_xdata()), np.asarray(disc.get_ydata())
    gaps = np.flatnonzero(np.isnan(temperature))
    assert time[gaps] == pytest.approx([0.0, 168.0, 336.0])
    assert temperature[gaps + 1] == pytest.approx(20.0)
    assert np.nanmax(temperature) > 21.0
