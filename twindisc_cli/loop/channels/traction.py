"""Traction: T/N over the history; it fixes the coefficient of friction, and its power drives all else."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from twindisc_cli.loop.channels._channel import Base, Channel, Generic, Mask, known
from twindisc_cli.loop.channels._held_out import held_out_samples
from twindisc_cli.loop.creep_curve import Curve, creepage_error
from twindisc_cli.loop.generic import SMOOTH, WAVES, in_step, levels, smooth, waves
from twindisc_cli.loop.noise import Noise, given
from twindisc_cli.loop.noise_estimate import GROWS, detrended, estimate, growth, likelier, louder
from twindisc_cli.loop.rounding import with_rounding
from twindisc_cli.loop.trends import polynomials, with_drift, with_recurring
from twindisc_cli.model.experiment import Experiment, Floats, Ints, TractionSamples
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.model.points import knows_times, sample_times
from twindisc_cli.model.prediction import Prediction
from twindisc_cli.quantities import Quantity

STEPS_THAT_WANDER = 5
"""Steps in which a memory of the noise is weighed against trends: in fewer, levels leave in it what the discs do over
the record."""
LEAST_LEVEL = 0.05
"""Level, over the root mean square, below which noise that grows with T/N is taken to be that of the meter at rest."""


def friction_is_given(test: Experiment) -> bool:
    """Whether the definition says mu at every iteration."""
    return bool(np.isfinite(test.options.friction_coefficient) or np.isfinite(test.history.given_mu).all())


def _guess(model: ForwardModel) -> float:
    """The level that nine of ten samples stay below."""
    samples = model.experiment.measured.traction
    if samples is None:
        return np.nan
    return float(np.clip(np.quantile(np.abs(samples.ratio), 0.9), 1e-3, 2.0))


def _given(test: Experiment) -> float:
    """A definition that says mu in every step leaves nothing to be fitted."""
    if np.isfinite(test.options.friction_coefficient):
        return test.options.friction_coefficient
    return float(np.mean(test.history.given_mu)) if friction_is_given(test) else np.nan


def noises(tests: Sequence[Experiment]) -> list[Noise]:
    """Noise of the traction of several tests; how much the creepage errs in swept curves, all of a rig tell."""
    curves = [_curve(test) for test in tests]
    rigs = [replace(test.rig, normal_load=0.0, rolling_speed=0.0) for test in tests]
    results = []
    for test, curve, rig in zip(tests, curves, rigs, strict=True):
        same_rig = [other for other, its in zip(curves, rigs, strict=True) if other is not None and its == rig]
        error = creepage_error(same_rig) if curve is not None else 0
        times = sample_times(test.history, known(test.measured.traction))
        results.append(curve.noise(error, times) if curve is not None and error else noise(test))
    return results


def _curve(test: Experiment) -> Curve | None:
    """The samples of a curve without time whose creepages were recorded and are not those of the steps."""
    samples = known(test.measured.traction)
    varied = np.ptp(samples.creepage - test.history.step_creepage[samples.step]) > 1e-9
    if not varied or np.isfinite(samples.time).all() or np.isfinite(samples.uncertainty).all():
        return None
    return Curve(np.abs(samples.creepage), samples.ratio)


def noise(test: Experiment) -> Noise:
    """Noise of the traction ratio, from the scatter inside the steps and the rounding of its readings."""
    samples = known(test.measured.traction)
    timed = bool(np.isfinite(samples.time).all())
    times = sample_times(test.history, samples)
    if np.isfinite(samples.uncertainty).all():
        return given(samples.uncertainty, times)
    if _curve(test) is not None:
        way = (samples.creepage < 0.0).astype(np.int64)
        trends = [polynomials(np.log(np.maximum(np.abs(samples.creepage), 1e-9)), way, 8, 10)]
    else:
        # a curve without time: equal conditions in different steps are repeats
        group = samples.step if timed else test.history.step_conditions[samples.step]
        trends = [polynomials(times, group, degree, 6) for degree in range(4)]
        trends = with_recurring(trends, times, samples.step) if timed else with_drift(trends, times)
    size = float(np.sqrt(np.mean(samples.ratio**2)))
    series = samples.step if test.history.separate else np.zeros_like(samples.step)
    wanders = timed and len(np.unique(samples.step)) >= STEPS_THAT_WANDER
    estimated = partial(estimate, at=times, series=series, size=size, correlated=timed, wanders=wanders)
    result = estimated(samples.ratio, trends)
    left = detrended(samples.ratio, trends[-1], result.kept)
    load = np.log(test.history.load_factor[test.history.iteration_at(times)])
    level = np.log(np.maximum(np.abs(samples.ratio - left), LEAST_LEVEL * size))
    grows = growth(result, left, [load, level, *([times] if timed else [])])
    by_step = louder(result, samples.ratio, samples.step) if timed else None
    best = result
    for sizes, by in ((grows, GROWS), (by_step, 0.0)):  # that of steps has been shown to be no few outliers
        if sizes is not None:
            grown = estimated(samples.ratio / sizes, [trend / sizes[:, None] for trend in trends]).grown(sizes)
            best = grown if grown.estimated and likelier(grown, best, left, by) else best
    return with_rounding(result, samples.ratio, trends[-1], samples.step) if timed and best is result else best


def _generic(model: ForwardModel, prediction: Prediction) -> Iterator[Generic]:
    test, points, samples = model.experiment, model.points, known(model.experiment.measured.traction)
    at, state = points.of_traction, prediction.state
    time, creepage = points.time[at], samples.creepage
    yield "creepage", "smooth", smooth(np.log(np.maximum(np.abs(creepage), 1e-7)), SMOOTH)
    yield "creepage", "levels", levels(_level_of(samples.creepage, test.history.step_creepage))
    for name, values in points.columns.items():
        if np.ptp(values[at]) > 0.0:
            yield name, "smooth", smooth(values[at], SMOOTH)
    if test.history.separate or not knows_times(test.history, samples):
        return
    yield "time", "smooth", smooth(time, SMOOTH)
    yield "time", "iterations", levels(points.iteration[at]) * prediction.traction.T
    for wave in waves(time, max(WAVES, len(test.history.step) // 2)):
        yield "time", "wave", wave
    yield "energy", "smooth", smooth(state.energy[0, at], SMOOTH)
    if np.isfinite(state.temperature[0, at]).all():
        yield "temperature", "smooth", smooth(state.temperature[0, at], SMOOTH - 1)
    yield "time", "position in the step", in_step(test.history, time, samples.step)


def _level_of(creepage: Floats, nominal: Floats) -> Ints:
    """Nearest nominal creepage of each sample."""
    distinct = np.unique(nominal)
    return np.asarray(np.argmin(np.abs(creepage[:, None] - distinct), axis=1), dtype=np.int64)


def _withheld(test: Experiment, steps: tuple[int, ...]) -> Mask:
    samples = known(test.measured.traction)
    return held_out_samples(test, samples.step, samples.time, steps)


def _covariates(model: ForwardModel, prediction: Prediction) -> dict[str, Floats | Ints]:
    samples, points, state = known(model.experiment.measured.traction), model.points, prediction.state
    at = points.of_traction
    return {
        "time": sample_times(model.experiment.history, samples),
        "creepage": samples.creepage,
        "cycles": points.cycles[at],
        "energy": state.energy[0, at],
        "temperature": state.temperature[0, at],
        **{name: values[at] for name, values in points.columns.items()},
    }


def _planned(test: Experiment, times: Floats, half_width: float) -> TractionSamples:
    at = test.history.iteration_at(times)
    unknown = np.full_like(times, np.nan)
    return TractionSamples(times, test.history.step[at], test.history.creepage[at], np.zeros_like(times), unknown)


BASE = Base(
    "mu",
    "1",
    1e-3,
    3.0,
    _guess,
    _given,
    meaning="coefficient of friction of the base model",
    place=("model", "friction_coefficient"),
)
CHANNEL = Channel(
    name="traction",
    label="traction",
    quantity=Quantity("traction", "T/N", "traction ratio T/N", "1"),
    order=0,
    assumed_noise=0.005,
    samples=lambda test: test.measured.traction,
    values=lambda samples: np.asarray(samples.ratio),
    predicted=lambda model, prediction: prediction.traction,
    noise=noise,
    together=noises,
    generic=_generic,
    withheld=_withheld,
    steps=lambda test: np.asarray(known(test.measured.traction).step),
    covariates=_covariates,
    planned=_planned,
    parameters=(BASE,),
    look_at={
        "creepage": "what changes with sliding: the friction law, films and third bodies, compliant layers",
        "time": "what changes as the test goes on: running-in, contamination, the zero of the torque meter",
        "cycles": "what changes from revolution to revolution: running-in, transfer layers",
        "energy": "what the dissipated energy changes: roughness, oxides, hardened or softened surfaces",
        "temperature": "what warms up: the surfaces, a lubricant, the torque meter",
    },
)
