"""Disc temperature over time; it fixes the convection, where the test knows the heat capacity."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from twindisc_cli.identify.energy import measured_energy
from twindisc_cli.loop.channels._channel import Base, Channel, Generic, Mask, known
from twindisc_cli.loop.channels._held_out import held_out_samples
from twindisc_cli.loop.generic import SMOOTH, WAVES, in_step, levels, smooth, waves
from twindisc_cli.loop.noise import Noise
from twindisc_cli.loop.noise_estimate import estimate
from twindisc_cli.loop.rounding import with_rounding
from twindisc_cli.loop.trends import relaxations, with_recurring
from twindisc_cli.model.experiment import Experiment, Floats, Ints, TemperatureSamples
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.model.prediction import Prediction
from twindisc_cli.physics.disc_heat import temperatures
from twindisc_cli.quantities import Quantity


def _step(test: Experiment) -> Ints:
    """Step in which each sample was taken (sample,)."""
    return test.history.step[test.history.iteration_at(known(test.measured.temperature).time)]


def _given(test: Experiment) -> float:
    return test.thermal.convection if test.thermal else np.nan


def _guess(model: ForwardModel) -> float:
    """Mean power, with the traction as it was measured, over the mean warming [W/K]."""
    test = model.experiment
    if test.measured.temperature is None or test.thermal is None:
        return np.nan
    warming = float(np.mean(known(test.measured.temperature).temperature - test.thermal.environment_temperature))
    power = measured_energy(test) / float(test.history.end_time[-1])
    return float(np.clip(power / max(abs(warming), 1e-3), 1e-3, 1e4))


def noise(test: Experiment) -> Noise:
    """Noise of the temperature, from the scatter about a smooth course in every step."""
    return noise_about(test, known(test.measured.temperature).temperature)


def noise_about(test: Experiment, left: Floats) -> Noise:
    """The same of what a model leaves of the temperature [K] (sample,): a disc that warms between two samples is none.

    Where discs settle faster than they are recorded, no smooth course follows the temperature itself.
    """
    samples, step = known(test.measured.temperature), _step(test)
    trends = [relaxations(samples.time, step, shapes, 4) for shapes in range(1, 6)]
    if len(np.unique(step)) > 1:
        trends = with_recurring(trends, samples.time, step)
    size = float(np.ptp(samples.temperature))
    series = step if test.history.separate else np.zeros_like(step)
    result = estimate(left, trends, samples.time, series, size, correlated=True)
    return with_rounding(result, samples.temperature, trends[-1], step)


def _generic(model: ForwardModel, prediction: Prediction) -> Iterator[Generic]:
    test, points, state = model.experiment, model.points, prediction.state
    at = points.of_temperature
    time, step = points.time[at], test.history.step[points.iteration[at]]
    yield "temperature", "smooth", smooth(state.temperature[0, at], SMOOTH)
    yield "energy", "smooth", smooth(state.energy[0, at], SMOOTH)
    yield "creepage", "levels", levels(step)
    if test.history.separate:
        return
    yield "time", "smooth", smooth(time, SMOOTH)
    yield "time", "iterations", levels(points.iteration[at])
    yield "time", "heat by iteration", _heated(model, prediction)[:, at].T
    for wave in waves(time, 2 * WAVES):
        yield "time", "wave", wave
    yield "time", "position in the step", in_step(test.history, time, step)


def _heated(model: ForwardModel, prediction: Prediction) -> Floats:
    """Warming of the disc by one watt in one iteration after the other (iteration, point) [K]."""
    thermal, points = model.experiment.thermal, model.points
    assert thermal is not None
    return temperatures(
        power=levels(points.iteration).T,
        duration=points.duration,
        capacity=thermal.heat_capacity,
        convection=float(np.mean(prediction.state.convection[0])),
        environment=0.0,
        initial=0.0,
        begins=points.begins,
    )


def _withheld(test: Experiment, steps: tuple[int, ...]) -> Mask:
    return held_out_samples(test, _step(test), known(test.measured.temperature).time, steps)


def _covariates(model: ForwardModel, prediction: Prediction) -> dict[str, Floats | Ints]:
    points, state = model.points, prediction.state
    at = points.of_temperature
    return {
        "time": known(model.experiment.measured.temperature).time,
        "creepage": points.creepage[at],
        "cycles": points.cycles[at],
        "energy": state.energy[0, at],
        "temperature": state.temperature[0, at],
    }


def _planned(test: Experiment, times: Floats, half_width: float) -> TemperatureSamples | None:
    return TemperatureSamples(times, np.full_like(times, 293.0)) if test.thermal is not None else None


BASE = Base(
    "convection_W_K",
    "W K-1",
    1e-5,
    1e6,
    _guess,
    _given,
    meaning="convection h S of the disc",
    place=("thermal", "convection_W_K"),
)
CHANNEL = Channel(
    name="temperature",
    label="disc temperature",
    quantity=Quantity("temperature", "T", "disc temperature", "degC"),
    order=1,
    assumed_noise=0.2,
    samples=lambda test: test.measured.temperature if test.thermal is not None else None,
    values=lambda samples: np.asarray(samples.temperature),
    predicted=lambda model, prediction: prediction.temperature,
    noise=noise,
    noise_about=noise_about,
    generic=_generic,
    withheld=_withheld,
    covariates=_covariates,
    planned=_planned,
    parameters=(BASE,),
    look_at={
        "time": "heat sources and cooling that change with time, and the environment",
        "temperature": "how the cooling depends on the temperature itself: radiation, boiling",
        "energy": "where the dissipated heat goes: debris, the other disc, the shaft",
        "creepage": "heat that depends on speed or power: drag, partition, the contact of the sensor",
    },
)
