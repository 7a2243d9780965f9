"""Separate steps: each is a test of its own, from which nothing is carried over to the next."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from rigs import experiment, history

from twindisc_cli.commands.simulate_wear import run
from twindisc_cli.definition.load import load_text
from twindisc_cli.definition.record import Test
from twindisc_cli.effects._state import summed
from twindisc_cli.errors import DefinitionError
from twindisc_cli.laws.law import Law
from twindisc_cli.model.experiment import Experiment, History, Measured, TemperatureSamples
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.model.prediction import Prediction

CREEPAGE = (0.02, 0.05, 0.03)
KNOWN = {"mu": np.array([0.4, 0.5]), "K": np.array([1e-4, 2e-4]), "convection_W_K": np.array([1.5, 2.0])}
EFFECTS = {
    "running_in_friction": {"excess": 0.5, "settling_cycles": 9000.0},
    "sensor_drift": {"per_hour": 0.2},
    "thermocouple_lag": {"time_constant_s": 60.0},
    "ambient_drift": {"K_per_hour": 30.0},
}
SHAFT = {"shaft_conduction": {"conductance_W_K": 1.0, "shaft_capacity_J_K": 300.0}}
SEEN = (
    "time",
    "cycles",
    "time_in_step",
    "time_since_pause",
    "greatest_creepage",
    "energy",
    "temperature",
    "traction_ratio",
)
SLID = Law("mu", "sliding_distance", "exponential", {"size": 0.3, "scale_m": 200.0, "origin_m": 0.0})


def apart(one: History) -> list[History]:
    """Each step as a history of its own."""
    steps = [one.step == number for number in np.unique(one.step)]
    columns = [f.name for f in fields(one) if isinstance(getattr(one, f.name), np.ndarray)]
    parts = [{column: getattr(one, column)[part] for column in columns} for part in steps]
    return [replace(one, separate=False, **part | {"step": 0 * part["step"]}) for part in parts]


def predicted(test: Experiment) -> Prediction:
    return ForwardModel(test).predict(KNOWN)


@pytest.mark.parametrize("declared", [EFFECTS, SHAFT, {}])
def test_separate_steps_are_the_same_as_tests_of_their_own(declared: dict[str, dict[str, float]]) -> None:
    course = replace(history(CREEPAGE, (2, 3, 1)), separate=True)
    laws = {"slid": SLID} if not declared else {}
    together = predicted(experiment(course, effects=declared, laws=laws))
    alone = [predicted(experiment(own, effects=declared, laws=laws)) for own in apart(course)]
    for name in SEEN:
        parts = [np.broadcast_to(getattr(p.state, name), p.section.shape) for p in alone]
        whole = np.broadcast_to(getattr(together.state, name), together.section.shape)
        np.testing.assert_allclose(whole, np.concatenate(parts, axis=1), rtol=1e-6, err_msg=name)
    np.testing.assert_allclose(
        together.state.disc_temperature, np.concatenate([p.state.disc_temperature for p in alone], axis=1), rtol=1e-6
    )
    np.testing.assert_allclose(together.section, np.concatenate([p.section for p in alone], axis=1), rtol=1e-6)
    carried = predicted(experiment(replace(course, separate=False)))
    assert carried.section[0, -1] > 3.0 * together.section[0, -1]


def test_temperatures_at_the_ends_of_separate_steps_are_each_steps_own() -> None:
    course = replace(history(CREEPAGE, 2), separate=True)
    ends = course.end_time[1::2]
    samples = Measured(temperature=TemperatureSamples(ends, np.full(3, 300.0)))
    read = predicted(experiment(course, measured=samples)).temperature
    alone = [predicted(experiment(own)).state.temperature[:, -1] for own in apart(course)]
    np.testing.assert_allclose(read, np.stack(alone, axis=1), rtol=1e-7)


def test_sums_begin_anew_where_a_test_begins() -> None:
    sums = summed(np.arange(1.0, 7.0), np.array([1.0, 0.0, 0.0, 1.0, 1.0, 0.0]))
    assert sums.tolist() == [1.0, 3.0, 6.0, 4.0, 5.0, 11.0]


TEXT = """
schema = 1
[test]
name = "apart"
[rig]
normal_load_N = 72.0
mean_speed_rpm = 3000.0
disc1 = {{ rolling_radius_mm = 30.0, transverse_radius_mm = inf }}
disc2 = {{ rolling_radius_mm = 30.0, transverse_radius_mm = 30.0 }}
[material]
youngs_modulus_GPa = 206.0
poisson_ratio = 0.30
hardness_HV = 700
[history]
revolutions_per_iteration = 4200
separate = true
steps = [{{ creepage_percent = 0.5 }}{step}]
[model]
friction_coefficient = 0.6
wear_coefficient = 7e-5
{more}
"""


def loaded(tmp_path: Path, *, step: str = "", more: str = "") -> Test:
    return load_text(TEXT.format(step=step, more=more), tmp_path / "apart.toml")


@pytest.mark.parametrize(
    ("step", "more", "key"),
    [
        (", { pause_s = 5.0 }", "", "history.steps[2]"),
        ("", '[measured]\nprofile = "p.csv"', "measured.profile"),
        ("", "[effects.wear_threshold]\nthreshold_N_mm2 = 1.0", "effects.wear_threshold"),
    ],
)
def test_what_joins_separate_steps_is_an_error(tmp_path: Path, step: str, more: str, key: str) -> None:
    with pytest.raises(DefinitionError) as error:
        loaded(tmp_path, step=step, more=more)
    assert key in str(error.value)


def test_there_is_no_profile_of_separate_steps(tmp_path: Path) -> None:
    test = loaded(tmp_path, step=", { creepage_percent = 2.0 }")
    assert test.experiment.history.separate
    with pytest.raises(DefinitionError, match="tests of their own"):
        run(test)
