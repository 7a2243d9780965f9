"""A made-up channel, an energy meter: one file in the folder of the channels, and the loop has it throughout.

    E(t) = integral of mu N v V dt,   in full sliding

The file below is all there is to it; what it finds, the rest of the program has never heard of.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from rigs import LOAD, SPEED, Instruments, Plant, history, spread

import twindisc_cli.loop.channels
from twindisc_cli.loop.channels import channels, measured_channels
from twindisc_cli.loop.diagnose import diagnose
from twindisc_cli.loop.diagnosis import Diagnosis
from twindisc_cli.loop.fit import plain_fit
from twindisc_cli.loop.problem import problem_of
from twindisc_cli.loop.screen import unexplained_residual
from twindisc_cli.model.experiment import Experiment

METER = '''"""Energy meter: what was dissipated up to each time; it fixes no base parameter."""

from dataclasses import dataclass

import numpy as np

from twindisc_cli.loop.channels._channel import Channel
from twindisc_cli.loop.channels._held_out import held_out_samples
from twindisc_cli.loop.generic import smooth
from twindisc_cli.loop.noise_estimate import estimate
from twindisc_cli.loop.trends import polynomials
from twindisc_cli.quantities import Quantity


@dataclass(frozen=True)
class Meter:
    time: np.ndarray
    energy: np.ndarray


def samples(test):
    return test.measured.others.get("meter")


def step(test):
    return test.history.step[test.history.iteration_at(samples(test).time)]


def noise(test):
    of = samples(test)
    trends = [polynomials(of.time, step(test), 2, 4)]
    return estimate(of.energy, trends, of.time, np.zeros_like(step(test)), float(np.ptp(of.energy)), correlated=False)


def predicted(model, prediction):
    state, time = prediction.state, samples(model.experiment).time
    every = np.broadcast_to(state.energy, (len(prediction.traction), len(state.time)))
    return np.array([np.interp(time, [0.0, *state.time], [0.0, *row]) for row in every])


CHANNEL = Channel(
    name="meter", label="energy meter", quantity=Quantity("meter", "E", "energy", "kJ"), order=4, assumed_noise=10.0,
    samples=samples, values=lambda of: of.energy, predicted=predicted, noise=noise,
    generic=lambda model, prediction: iter([("time", "smooth", smooth(samples(model.experiment).time, 5))]),
    withheld=lambda test, steps: held_out_samples(test, step(test), samples(test).time, steps),
    covariates=lambda model, prediction: {"time": samples(model.experiment).time},
    planned=lambda test, times, half_width: Meter(times, np.zeros(len(times))),
)
'''
COURSE = history((0.03, 0.09, 0.015, 0.06, 0.02), 2)
TIME = spread(COURSE, 6)
SIGMA = 20.0


@pytest.fixture(scope="module", autouse=True)
def meter(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """The file put into the folder of the channels."""
    folder = tmp_path_factory.mktemp("channels")
    (folder / "meter.py").write_text(METER, encoding="utf-8")
    twindisc_cli.loop.channels.__path__.append(str(folder))
    channels.cache_clear()
    channels()
    yield
    twindisc_cli.loop.channels.__path__.remove(str(folder))
    sys.modules.pop("twindisc_cli.loop.channels.meter", None)
    channels.cache_clear()


def settling(time: np.ndarray, creepage: np.ndarray, cycles: np.ndarray) -> np.ndarray:
    return np.asarray(0.6 * (1.0 - 0.25 * np.exp(-cycles / 12000.0)))


def recorded(plant: Plant, fault: float = 0.0) -> Experiment:
    """Traction and meter; fault: what the meter shows beyond the truth, as a share at the end that came in square."""
    rng = np.random.default_rng(5)
    test = Instruments(channels=("traction",)).record(plant, rng)
    energy = np.interp(TIME, plant.instants + 0.25, np.cumsum(plant.power) * 0.5)
    energy *= 1.0 + fault * (TIME / TIME[-1]) ** 2
    of = sys.modules["twindisc_cli.loop.channels.meter"].Meter(TIME, energy + SIGMA * rng.standard_normal(len(TIME)))
    return replace(test, measured=test.measured.with_samples("meter", of))


@pytest.fixture(scope="module")
def found(meter: None) -> Diagnosis:
    test = recorded(Plant(COURSE, mu=settling))
    return diagnose([test], validate=None, progress=lambda stage, part: None)


def test_it_is_found_by_the_registry() -> None:
    assert list(channels()) == ["traction", "temperature", "profile", "mass", "meter"]
    assert measured_channels(recorded(Plant(COURSE))) == ("traction", "meter")


def test_what_it_measures_is_predicted() -> None:
    """E of constant friction: mu N v V t."""
    test = recorded(Plant(COURSE))
    problem = problem_of([test])
    fitted = plain_fit(problem)
    energy = channels()["meter"].predicted(problem.cases[0].model, problem.predict(fitted.theta[None])[0])[0]
    slid = np.interp(TIME, [0.0, *COURSE.end_time], [0.0, *np.cumsum(COURSE.creepage * COURSE.duration)])
    assert energy == pytest.approx(0.6 * LOAD * SPEED * slid, rel=0.01)


@pytest.mark.parametrize(("fault", "seen"), [(0.0, False), (0.05, True)])
def test_it_is_screened(fault: float, seen: bool) -> None:
    fitted = plain_fit(problem_of([recorded(Plant(COURSE), fault)]))
    assert unexplained_residual(fitted, "meter").significant(0.002) == seen


def test_it_is_fitted_judged_and_reported(found: Diagnosis) -> None:
    """Friction that runs in shows in the traction; what the meter says follows, also where it was held out."""
    assert [effect.name for effect in found.effects] == ["running_in_friction"]
    error = found.errors["meter"]
    assert error.unit == "kJ"
    assert error.noise == pytest.approx(1e-3 * SIGMA, rel=0.3)
    assert error.before > 2.0 * error.after
    assert error.after == pytest.approx(error.noise, rel=0.3)
    assert error.held_out_after == pytest.approx(error.noise, rel=0.6)
    assert found.p_values["meter"] < 1e-3


def test_its_curves_are_there(found: Diagnosis) -> None:
    (curve,) = [curve for curve in found.curves if curve.channel == "meter"]
    assert np.array_equal(curve.covariates["time"], TIME)
    assert np.sqrt(np.mean((curve.measured - curve.after) ** 2)) < 0.5 * np.sqrt(
        np.mean((curve.measured - curve.before) ** 2)
    )
    assert curve.held_out.any()
