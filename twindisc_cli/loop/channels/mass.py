"""Mass that the discs lost, weighed at stops; it fixes the wear coefficient, as the profile does."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from twindisc_cli.identify.energy import measured_energy
from twindisc_cli.identify.mass import weighed_volume, worn_mass
from twindisc_cli.loop.channels._channel import Channel, Generic, Mask, known, wear_coefficient
from twindisc_cli.loop.generic import smooth
from twindisc_cli.loop.noise import Noise, given
from twindisc_cli.loop.noise_estimate import estimate
from twindisc_cli.loop.trends import polynomials
from twindisc_cli.model.experiment import Experiment, Floats, Ints, MassSamples
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.model.prediction import Prediction
from twindisc_cli.quantities import Quantity

SHAPES, EACH = 2, 3
"""Degree of what is smooth over the energy, and samples of one disc that each degree takes."""


def weighed_stops(test: Experiment) -> int:
    """At how many stops was weighed."""
    return 0 if test.measured.mass is None else len(np.unique(test.measured.mass.iteration))


def _guess(model: ForwardModel) -> float:
    """K from W H / E of the last weighing, with the traction as it was measured."""
    test = model.experiment
    if test.measured.mass is None:
        return np.nan
    volume = max(float(weighed_volume(model)[1][-1]), 1e-15)
    return float(np.clip(volume * test.rig.disc2.hardness / measured_energy(test), 1e-9, 0.5))


def noise(test: Experiment) -> Noise:
    """Noise as stated, else from the scatter of each disc's mass about a smooth course."""
    samples = known(test.measured.mass)
    at = samples.iteration.astype(float)
    if np.isfinite(samples.uncertainty).all():
        return given(samples.uncertainty, at)
    trend = polynomials(at, samples.disc, SHAPES, EACH)
    return estimate(samples.loss, [trend], at, samples.disc, float(np.ptp(samples.loss)), correlated=False)


def _generic(model: ForwardModel, prediction: Prediction) -> Iterator[Generic]:
    samples = known(model.experiment.measured.mass)
    energy = _covariates(model, prediction)["energy"]
    degree = min(SHAPES, len(np.unique(samples.iteration)) // EACH)
    if degree:
        own = samples.loss / max(float(np.abs(samples.loss).max()), 1e-30)
        yield "energy", "smooth", smooth(np.asarray(energy, dtype=float), degree) * own[:, None]


def _predicted(model: ForwardModel, prediction: Prediction) -> Floats:
    if model.experiment.measured.mass is None:
        return np.empty((len(prediction.section), 0))
    return worn_mass(model, prediction)


def _withheld(test: Experiment, steps: tuple[int, ...]) -> Mask:
    """Weighings at the end of the steps that are held out."""
    return np.isin(test.history.step[known(test.measured.mass).iteration - 1], steps)


def _covariates(model: ForwardModel, prediction: Prediction) -> dict[str, Floats | Ints]:
    samples, points, state = known(model.experiment.measured.mass), model.points, prediction.state
    at = points.of_iteration[samples.iteration - 1]
    return {
        "time": points.time[at],
        "energy": state.energy[0, at],
        "cycles": points.cycles[at],
        "disc": samples.disc,
    }


def _planned(test: Experiment, times: Floats, half_width: float) -> MassSamples | None:
    if not np.isfinite(test.rig.disc2.density):
        return None
    stops = np.flatnonzero(np.diff(test.history.step, append=-1) != 0) + 1
    unknown = np.full(len(stops), np.nan)
    return MassSamples(stops, np.zeros(len(stops)), np.full(len(stops), 2, dtype=np.int64), unknown)


CHANNEL = Channel(
    name="mass",
    label="mass lost",
    quantity=Quantity("mass", "m", "mass lost", "mg"),
    order=3,
    assumed_noise=1e-7,
    samples=lambda test: test.measured.mass,
    values=lambda samples: np.asarray(samples.loss),
    predicted=_predicted,
    noise=noise,
    generic=_generic,
    withheld=_withheld,
    covariates=_covariates,
    planned=_planned,
    parameters=(wear_coefficient(_guess),),
    look_at={"energy": "a wear coefficient that changed over the history, or another share of the discs in the wear"},
    stands_for=frozenset({"wear"}),
)
