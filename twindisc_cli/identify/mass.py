"""The wear coefficient of a test from the mass that its discs lost, weighed at stops.

m_d = rho_d s_d 2 pi R S(K)        disc d; S the worn section of both discs, s_d the share of disc d
W   = sum over the discs weighed of m_d / rho_d

rho_d   density [kg/m3];  s_2 = 1 - s_1, and s_1 = 0 unless an effect says otherwise
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from twindisc_cli.errors import MeasurementError, ValidityError
from twindisc_cli.identify.least_squares import fit_positive
from twindisc_cli.model.base import BaseParameters
from twindisc_cli.model.experiment import Floats, Ints, MassSamples
from twindisc_cli.model.forward import ForwardModel, Prediction


@dataclass(frozen=True)
class MassFit:
    """K and its standard error [1] (NaN where one weighing has no uncertainty), and what they rest on.

    iteration: those after which was weighed; volume, predicted: worn off the discs weighed by then [m3], as weighed and
    at K; error: standard error of volume [m3], NaN where none was stated; energy: dissipated by then [J]; each (stop,).
    """

    wear_coefficient: float
    std: float
    iteration: Ints
    volume: Floats
    predicted: Floats
    error: Floats
    energy: Floats


def worn_mass(model: ForwardModel, prediction: Prediction) -> Floats:
    """The mass loss [kg] of a prediction at the weighings of its test, (set, sample)."""
    samples = _weighed(model)
    volume, shares = _volume(model, prediction, samples.iteration), _share(model, prediction, samples)
    return np.asarray(_density(model, samples) * shares * volume)


def identify_from_mass(model: ForwardModel, mu: Floats) -> MassFit:
    """Fit K to the weighed mass with mu (step,) in the contact."""
    test, samples = model.experiment, _weighed(model)
    stops, stop = np.unique(samples.iteration, return_inverse=True)
    density = _density(model, samples)
    volume = np.asarray(np.bincount(stop, samples.loss / density), dtype=float)
    error = np.sqrt(np.bincount(stop, (samples.uncertainty / density) ** 2))
    if not volume[-1] > 0.0:
        raise MeasurementError("nothing was worn off by weight: the last mass loss is not positive")

    def volumes(k: Floats) -> Floats:
        base = BaseParameters.declared(test, np.broadcast_to(mu, (len(k), len(mu))))
        prediction = model.predict(replace(base, K=k))
        each = _share(model, prediction, samples) * _volume(model, prediction, samples.iteration)
        return np.stack([np.bincount(stop, row) for row in each])

    energy = model.predict(BaseParameters.declared(test, mu[None])).state.energy[
        0, model.points.of_iteration[stops - 1]
    ]
    if not energy[-1] > 0.0:
        raise ValidityError("nothing slides up to the last weighing: no K can have worn it")
    hardness = model.circumference_hardness / (2.0 * np.pi * model.radius)
    start = float(volume[-1] * hardness / energy[-1])
    if not volumes(np.array([start]))[0, -1] > 0.0:
        raise ValidityError("only disc 1 was weighed, and by the model it does not wear: declare wear_partition")
    weights = 1.0 / error**2 if np.all(np.isfinite(error)) else np.ones(len(stops))
    fit = fit_positive(volumes, measured=volume, weights=weights, start=start)
    stated = fit.value / np.sqrt(float(np.sum((fit.predicted / error) ** 2)))
    scatter = fit.std if len(stops) > 1 else np.nan
    known = [std for std in (stated, scatter) if np.isfinite(std)]
    return MassFit(fit.value, max(known, default=np.nan), stops, volume, fit.predicted, error, energy)


def _weighed(model: ForwardModel) -> MassSamples:
    samples = model.experiment.measured.mass
    if samples is None:
        raise MeasurementError("no mass was measured; name its file under [measured]")
    return samples


def _density(model: ForwardModel, samples: MassSamples) -> Floats:
    rig = model.experiment.rig
    return np.where(samples.disc == 1, rig.disc1.density, rig.disc2.density)


def _volume(model: ForwardModel, prediction: Prediction, iteration: Ints) -> Floats:
    """Worn off both discs by the end of iterations (sample,) [m3], (set, sample)."""
    at = model.points.of_iteration[iteration - 1]
    return np.asarray(2.0 * np.pi * model.radius * prediction.section[:, at])


def _share(model: ForwardModel, prediction: Prediction, samples: MassSamples) -> Floats:
    """The share of each weighed disc in what is worn, (set, sample)."""
    at = model.points.of_iteration[samples.iteration - 1]
    first = np.broadcast_to(prediction.state.disc1_share, prediction.section.shape)[:, at]
    return np.where(samples.disc == 1, first, 1.0 - first)
