"""Generic functions: what an effect that nobody has catalogued could look like, as smooth functions of one covariate.

Each group holds columns over the samples of one channel. They stand beside the physical effects in the search: where a
generic function says more than any effect, or where one is still significant after an effect was added, the cause is
not in the catalogue. Covariates: creepage, time, cycles, energy, temperature, y.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from twindisc_cli.effects._effect import Channel
from twindisc_cli.loop.problem import Case
from twindisc_cli.model.experiment import Floats, Ints
from twindisc_cli.model.forward import Prediction
from twindisc_cli.physics.disc_heat import temperatures

SMOOTH = 5
WAVES = 24
RIPPLES = 12
SPANS = ("iterations", "heat by iteration")


@dataclass(frozen=True)
class Group:
    """Columns (sample, column) over a channel of one test, functions of one covariate.

    `spans`: the columns follow each other along the covariate, and sums of neighbours, one at a time, are a group too.
    """

    channel: Channel
    covariate: str
    kind: str
    columns: Floats
    spans: bool = False


def groups(case: Case, channel: Channel, prediction: Prediction) -> Iterator[Group]:
    """Every generic function of a channel; the prediction tells energy, temperature and power at the samples."""
    makers = {"traction": _traction, "profile": _profile, "temperature": _temperature}
    for covariate, kind, columns in makers[channel](case, prediction):
        varied = columns[:, np.ptp(columns, axis=0) > 1e-9]
        if varied.shape[1]:
            yield Group(channel, covariate, kind, varied, spans=kind in SPANS)


def _traction(case: Case, prediction: Prediction) -> Iterator[tuple[str, str, Floats]]:
    points, samples = case.model.points, case.test.measured.traction
    assert samples is not None
    at, state = points.of_traction, prediction.state
    time, creepage = points.time[at], samples.creepage
    yield "creepage", "smooth", smooth(np.log(np.maximum(np.abs(creepage), 1e-7)), SMOOTH)
    yield "creepage", "levels", levels(_level_of(samples.creepage, case.test.history.step_creepage))
    if np.isnan(samples.time).any():
        return
    yield "time", "smooth", smooth(time, SMOOTH)
    yield "time", "iterations", levels(points.iteration[at]) * prediction.traction.T
    for wave in waves(time, max(WAVES, len(case.test.history.step) // 2)):
        yield "time", "wave", wave
    yield "energy", "smooth", smooth(state.energy[0, at], SMOOTH)
    if case.test.thermal is not None:
        yield "temperature", "smooth", smooth(state.temperature[0, at], SMOOTH - 1)
    yield "time", "position in the step", _in_step(case, time, samples.step)


def _temperature(case: Case, prediction: Prediction) -> Iterator[tuple[str, str, Floats]]:
    points, state = case.model.points, prediction.state
    at = points.of_temperature
    time = points.time[at]
    yield "time", "smooth", smooth(time, SMOOTH)
    yield "time", "iterations", levels(points.iteration[at])
    yield "time", "heat by iteration", _heated(case, prediction)[:, at].T
    for wave in waves(time, 2 * WAVES):
        yield "time", "wave", wave
    yield "temperature", "smooth", smooth(state.temperature[0, at], SMOOTH)
    yield "energy", "smooth", smooth(state.energy[0, at], SMOOTH)
    yield "creepage", "levels", levels(case.test.history.step[points.iteration[at]])
    yield "time", "position in the step", _in_step(case, time, case.test.history.step[points.iteration[at]])


def _profile(case: Case, prediction: Prediction) -> Iterator[tuple[str, str, Floats]]:
    samples = case.test.measured.profile
    assert samples is not None
    surface = prediction.state.surface
    edge = float(surface.edge.max()) if surface is not None else 0.5 * float(np.abs(samples.y).max())
    unit = samples.y / max(1.3 * edge, 1e-9)
    inside = np.abs(unit) <= 1.0
    legendre = np.asarray(np.polynomial.legendre.legvander(np.clip(unit, -1.0, 1.0), 10) * inside[:, None], dtype=float)
    yield "y", "even", legendre[:, 0::2]
    yield "y", "odd", legendre[:, 1::2]
    for centre in np.linspace(-1.0, 1.0, 17):
        yield "y", "bump", np.exp(-0.5 * ((unit - centre) / 0.08) ** 2)[:, None]
    for wave in waves(np.clip(unit, -1.0, 1.0), RIPPLES):
        yield "y", "wave", wave * inside[:, None]
    outside = np.stack([np.ones_like(unit), samples.y / np.abs(samples.y).max()], axis=1)
    yield "y", "line", outside
    stops = np.unique(np.stack([samples.disc, samples.iteration]), axis=1, return_inverse=True)[1].ravel()
    if stops.max() > 0:
        shape = -prediction.profile[0]
        yield "time", "stops", levels(stops) * (shape / max(float(np.ptp(shape)), 1e-30))[:, None]


def _heated(case: Case, prediction: Prediction) -> Floats:
    """Warming of the disc by one watt in one iteration after the other (iteration, point) [K]."""
    thermal, points = case.test.thermal, case.model.points
    assert thermal is not None
    return temperatures(
        power=levels(points.iteration).T,
        duration=points.duration,
        capacity=thermal.heat_capacity,
        convection=float(np.mean(prediction.state.convection[0])),
        environment=0.0,
        initial=0.0,
    )


def smooth(covariate: Floats, degree: int) -> Floats:
    """Legendre polynomials of a covariate, without the constant (sample, degree)."""
    span = float(np.ptp(covariate))
    unit = 2.0 * (covariate - covariate.min()) / max(span, 1e-300) - 1.0
    distinct = len(np.unique(np.round(unit, 9)))
    return np.polynomial.legendre.legvander(unit, max(1, min(degree, distinct - 1)))[:, 1:]


def levels(number: Ints) -> Floats:
    """One indicator for every level (sample, level)."""
    return np.asarray(number[:, None] == np.unique(number), dtype=float)


def waves(time: Floats, count: int) -> Iterator[Floats]:
    """Pairs of cosine and sine of `count` periods and fewer over the test, each (sample, 2)."""
    phase = 2.0 * np.pi * (time - time.min()) / max(float(np.ptp(time)), 1e-300)
    for order in range(1, count + 1):
        yield np.stack([np.cos(order * phase), np.sin(order * phase)], axis=1)


def _level_of(creepage: Floats, nominal: Floats) -> Ints:
    """Nearest nominal creepage of each sample."""
    distinct = np.unique(nominal)
    return np.asarray(np.argmin(np.abs(creepage[:, None] - distinct), axis=1), dtype=np.int64)


def _in_step(case: Case, time: Floats, step: Ints) -> Floats:
    """Position in the running step, from -1 to 1, and the square and a decay at its start (sample, 3)."""
    history = case.test.history
    ends = np.array([history.end_time[history.step == s][-1] for s in np.unique(history.step)])
    begins = np.concatenate([[0.0], ends[:-1]])
    part = np.clip((time - begins[step]) / (ends - begins)[step], 0.0, 1.0)
    return np.stack([2.0 * part - 1.0, 1.5 * (2.0 * part - 1.0) ** 2 - 0.5, np.exp(-12.0 * part)], axis=1)
