"""The wear coefficient of a test from the mass that its discs lost, weighed at stops.

m_d = rho_d s_d 2 pi R_d S(K)      disc d; S the worn section of both discs, s_d the share of disc d
W   = sum over the discs weighed of m_d / rho_d

K_d = W_d H_d / (E f)              of each disc weighed; f what declared effects multiply K by, its mean by the energy

rho_d   density [kg/m3];  s_2 = 1 - s_1, and s_1 = 0 unless K_1 or an effect says otherwise;  H_d  hardness [Pa]

The wear rate, as railway laboratories give it, is mass lost over distance rolled and area of the patch,
dm_d / (ds A) = rho_d K_d / H_d (T gamma / A), with T gamma = dE / ds the energy dissipated on the distance.

Source: R. Lewis and R. S. Dwyer-Joyce, Proc. IMechE J 218 (2004) 467-478.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.special import chdtrc

from twindisc_cli.errors import MeasurementError, ValidityError
from twindisc_cli.identify.energy import wear_factors
from twindisc_cli.identify.least_squares import fit_positive
from twindisc_cli.model.base import BaseParameters
from twindisc_cli.model.experiment import Floats, Ints, MassSamples
from twindisc_cli.model.forward import ForwardModel, IntegratedSets
from twindisc_cli.model.prediction import Prediction

FACTOR = 1.5
"""Times the volume at K, from which on a weighing contradicts one K: energy and hardness err by less."""
BEYOND, UNSTATED = 3.0, 0.02
"""Standard errors, or where none is stated share of the largest volume, up to which a weighing may be off by chance."""


@dataclass(frozen=True)
class WearRates:
    """Wear from weighing to weighing of each disc: disc, T gamma / A [N/m2], rate [kg/m3], its error; each (row,).

    A is the patch of the unworn discs, under several loads its mean over the distance. error: standard error, NaN where
    no uncertainty was stated.
    """

    disc: Ints
    index: Floats
    rate: Floats
    error: Floats


@dataclass(frozen=True)
class MassFit:
    """K and its standard error [1] (NaN where one weighing has no uncertainty), and what they rest on.

    iteration: how many were completed at each weighing; volume, predicted: worn off the discs weighed by then [m3], as
    weighed and at K; error: standard error of volume [m3], NaN where none was stated; energy: dissipated by then [J];
    each (stop,). of_disc: K of each disc weighed, with its own hardness, and its standard error, NaN where none was
    stated; rates: from weighing to weighing.
    """

    wear_coefficient: float
    std: float
    iteration: Ints
    volume: Floats
    predicted: Floats
    error: Floats
    energy: Floats
    of_disc: Mapping[int, tuple[float, float]]
    rates: WearRates

    @property
    def in_errors(self) -> float:
        """What one K misses of the weighings, root mean square over their uncertainty [1], NaN where none is stated.

        1 is expected of weighings that one K describes: its square times how many there are, less one for K, over
        these degrees of freedom.
        """
        free = len(self.volume) - 1
        return float(np.sqrt(np.sum(((self.volume - self.predicted) / self.error) ** 2) / free)) if free else np.nan

    @property
    def p_value(self) -> float:
        """Probability of misses as large by chance, chi-squared; NaN where no uncertainty is stated."""
        free = len(self.volume) - 1
        return float(chdtrc(free, self.in_errors**2 * free)) if free else np.nan

    @property
    def in_total(self) -> float:
        """What one K misses of the weighings, root mean square over the largest volume [1]; NaN of a single one."""
        missed = np.sqrt(np.mean((self.volume - self.predicted) ** 2)) / np.max(self.volume)
        return float(missed) if len(self.volume) > 1 else np.nan

    @property
    def times_predicted(self) -> Floats:
        """Volume weighed over that at K of each weighing that is beyond its error off it, (some of the stops,)."""
        error = np.where(np.isfinite(self.error), BEYOND * self.error, UNSTATED * np.max(self.volume))
        off = np.abs(self.volume - self.predicted) > error
        known = off & (self.predicted > 0.0)
        return np.asarray(np.maximum(self.volume[known], 0.0) / self.predicted[known])

    @property
    def is_one_k(self) -> bool:
        """Whether one K describes the weighings: none is beyond its error and a factor off it."""
        times = self.times_predicted
        return bool(np.all((times > 1.0 / FACTOR) & (times < FACTOR)))

    def with_energy_error(self, error: float) -> MassFit:
        """Add the standard error of the energy, as a share of it, to those of K."""
        return replace(
            self,
            std=float(np.hypot(self.std, error * self.wear_coefficient)),
            of_disc={disc: (k, float(np.hypot(std, error * k))) for disc, (k, std) in self.of_disc.items()},
        )


def worn_mass(model: ForwardModel, prediction: Prediction) -> Floats:
    """The mass loss [kg] of a prediction at the weighings of its test, (set, sample)."""
    samples = _weighed(model)
    return np.asarray(model.experiment.rig.density_of(samples.disc) * _volume(model, prediction, samples))


def weighed_volume(model: ForwardModel) -> tuple[Ints, Floats, Floats]:
    """Entries of the history that end with a weighing, the volume [m3] lost by then, its standard error; (stop,)."""
    samples = _weighed(model)
    stops, stop = np.unique(samples.iteration, return_inverse=True)
    density = model.experiment.rig.density_of(samples.disc)
    volume = np.asarray(np.bincount(stop, samples.loss / density), dtype=float)
    return stops, volume, np.sqrt(np.bincount(stop, (samples.uncertainty / density) ** 2))


def identify_from_mass(model: ForwardModel, mu: Floats) -> MassFit:
    """Fit K to the weighed mass with mu (step,) in the contact."""
    test, samples = model.experiment, _weighed(model)
    stops, volume, error = weighed_volume(model)
    stop = np.searchsorted(stops, samples.iteration)
    if not volume[-1] > 0.0:
        raise MeasurementError("nothing was worn off by weight: the last mass loss is not positive")

    def volumes(k: Floats, integrated: IntegratedSets = "each") -> Floats:
        base = BaseParameters.declared(test, np.broadcast_to(mu, (len(k), len(mu))))
        prediction = model.predict(replace(base, K=k), integrated=integrated)
        return np.stack([np.bincount(stop, row) for row in _volume(model, prediction, samples)])

    prediction = model.predict(BaseParameters.declared(test, mu[None]))
    energy = prediction.state.energy[0, model.points.of_iteration[stops - 1]]
    if not energy[-1] > 0.0:
        raise ValidityError("nothing slides up to the last weighing: no K can have worn it")
    start = float(volume[-1] * test.rig.disc2.hardness / energy[-1])
    if not volumes(np.array([start]))[0, -1] > 0.0:
        raise ValidityError("only disc 1 was weighed, and by the model it does not wear: declare wear_partition")
    weights = 1.0 / error**2 if np.all(np.isfinite(error)) else np.ones(len(stops))
    rough = partial(volumes, integrated="none")
    fit = fit_positive(volumes, measured=volume, weights=weights, start=start, rough=rough)
    factors = wear_factors(model, mu, fit.value, stops.tolist())
    stated = fit.value / np.sqrt(float(np.sum((fit.predicted / error) ** 2)))
    scatter = fit.std if len(stops) > 1 else np.nan
    known = [std for std in (stated, scatter) if np.isfinite(std)]
    return MassFit(
        wear_coefficient=fit.value,
        std=max(known, default=np.nan),
        iteration=test.history.completed(stops),
        volume=volume,
        predicted=fit.predicted,
        error=error,
        energy=energy,
        of_disc=_of_disc(model, samples, dict(zip(stops, energy * factors, strict=True))),
        rates=_wear_rates(model, prediction, samples),
    )


def _of_disc(model: ForwardModel, samples: MassSamples, energy: Mapping[int, float]) -> dict[int, tuple[float, float]]:
    """K of each disc by its last weighing, and its standard error."""
    results = {}
    for number, disc in ((1, model.experiment.rig.disc1), (2, model.experiment.rig.disc2)):
        mine = samples.disc == number
        if np.any(mine):
            last = int(np.argmax(np.where(mine, samples.iteration, 0)))
            spent = energy[int(samples.iteration[last])]
            per = disc.hardness / (disc.density * spent)
            results[number] = float(samples.loss[last] * per), float(samples.uncertainty[last] * per)
    return results


def _wear_rates(model: ForwardModel, prediction: Prediction, samples: MassSamples) -> WearRates:
    """Mass lost over energy dissipated and area rolled over between the weighings; none where nothing slid."""
    state, at, rig = prediction.state, model.points.of_iteration, model.experiment.rig
    area_ratio = rig.area_ratio(model.experiment.history.load_factor[model.points.iteration])
    rolled = np.cumsum(np.broadcast_to(state.rolling_speed, state.energy.shape)[0] * state.duration * area_ratio)
    rows = []
    for number, mine in samples.of_discs().items():
        place = at[samples.iteration[mine] - 1]
        lost, distance, energy = (
            np.diff(values, prepend=0.0) for values in (samples.loss[mine], rolled[place], state.energy[0, place])
        )
        squared = samples.uncertainty[mine] ** 2
        error = np.sqrt(squared + np.append(0.0, squared[:-1]))
        per = 1.0 / (distance * float(rig.patch.area))
        rows.append(np.stack([np.full(len(mine), number), energy * per, lost * per, error * per])[:, energy > 0.0])
    disc, index, rate, error = np.concatenate(rows, axis=1)
    return WearRates(disc.astype(np.int64), index, rate, error)


def _weighed(model: ForwardModel) -> MassSamples:
    samples = model.experiment.measured.mass
    if samples is None:
        raise MeasurementError("no mass was measured; name its file under [measured]")
    return samples


def _volume(model: ForwardModel, prediction: Prediction, samples: MassSamples) -> Floats:
    """Worn off each weighed disc [m3], (set, sample): 2 pi of its radius times its share of the section."""
    at = model.points.of_iteration[samples.iteration - 1]
    first = np.broadcast_to(prediction.state.disc1_share, prediction.section.shape)[:, at]
    share = np.where(samples.disc == 1, first, 1.0 - first)
    radius = model.experiment.rig.track_radius(samples.disc)
    return np.asarray(2.0 * np.pi * radius * share * prediction.section[:, at])
