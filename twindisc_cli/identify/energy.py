"""The energy that a test dissipated by its own measurements, before anything is fitted.

    P = (T/N) N V v                 T/N as measured
    P = V (v T + vy Ty + phi M)     what no T/N shows, with the mu in use: steps that were not measured, lateral
                                    creepage, spin, another creepage

v    longitudinal creepage of the history [1];  vy  lateral creepage [1];  phi  spin [1/m];  V  rolling speed [m/s]
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from twindisc_cli.effects._state import State
from twindisc_cli.errors import MeasurementError, ValidityError
from twindisc_cli.identify.steps import friction_in_use
from twindisc_cli.model.base import BaseParameters
from twindisc_cli.model.experiment import Experiment, Floats
from twindisc_cli.model.forward import ForwardModel, acts_at
from twindisc_cli.physics.half_space import OutOfRangeError

UNKNOWN = (MeasurementError, ValidityError, OutOfRangeError)
"""What keeps the model from saying more than was measured."""


def ratio_and_power(test: Experiment) -> tuple[Floats, Floats]:
    """T/N along the creepage and dissipated power [W] of each iteration, (iteration,); NaN: not known.

    As measured, else by the model.
    """
    ratio, otherwise = _measured_ratio(test), _slides_otherwise(test)
    power, unknown = ratio * _pressed_slip(test), np.isnan(ratio)
    if not (unknown.any() or otherwise):
        return ratio, power
    try:
        of_model, power_of_model = _by_model(test)
    except UNKNOWN:
        return ratio, power
    return np.where(unknown, of_model, ratio), np.where(unknown | otherwise, power_of_model, power)


def measured_energy(test: Experiment) -> float:
    """Dissipated energy [J] of the whole test; steps of which nothing is known take the mean of T/N."""
    power, samples = np.abs(ratio_and_power(test)[1]), test.measured.traction
    if samples is not None:
        power = np.where(np.isnan(power), np.mean(np.abs(samples.ratio)) * _pressed_slip(test), power)
    return max(float(np.sum(power * test.history.duration)), 1e-9)


def wear_factors(model: ForwardModel, mu: Floats, k: float, stops: Sequence[int]) -> Floats:
    """What declared effects multiply K = k by, its mean by the energy up to entries of the history, (stop,), from 1.

    mu: of each step. 1 where nothing was dissipated by then.
    """
    if not acts_at(model.experiment, "wear"):
        return np.ones(len(stops))
    base = replace(BaseParameters.declared(model.experiment, mu[None]), K=np.array([k]))
    state = model.predict(base, profiled=False).state
    return np.array([wear_factor(model, state, stop) for stop in stops])


def wear_factor(model: ForwardModel, state: State, stop: int) -> float:
    """The same of a state, at one entry."""
    test, entry, begin = model.experiment, model.points.iteration, model.experiment.history.begin_time
    own = 1.0 - state.disc1_share if np.isfinite(test.options.disc1_wear_coefficient) else 1.0
    factor, power = (np.broadcast_to(v, state.energy.shape)[0] for v in (state.wear_factor * own, state.power))
    spent = power * state.duration * ((entry < stop) & (begin[entry] == begin[stop - 1]))
    return float(np.average(factor, weights=spent)) if np.any(spent > 0.0) else 1.0


def _measured_ratio(test: Experiment) -> Floats:
    """T/N along the creepage of each iteration as measured, 0 without creepage; NaN: not measured. (iteration,)."""
    history, samples = test.history, test.measured.traction
    ratio = np.where(history.creepage == 0.0, 0.0, np.nan)
    if samples is not None:
        for step in np.unique(samples.step):
            mean = np.mean(samples.ratio[samples.step == step]) * np.sign(history.creepage)
            ratio = np.where(history.step == step, mean, ratio)
    return ratio


def _pressed_slip(test: Experiment) -> Floats:
    """N V |v| of each iteration [W], (iteration,)."""
    history = test.history
    load, speed = test.rig.normal_load * history.load_factor, test.rig.rolling_speed * history.speed_factor
    return np.asarray(load * speed * np.abs(history.creepage))


def _slides_otherwise(test: Experiment) -> bool:
    """Whether the discs slide in another way than by the creepage of the history."""
    return bool(np.any(test.history.yaw)) or acts_at(test, "operation")


def _by_model(test: Experiment) -> tuple[Floats, Floats]:
    """T/N along the creepage and power [W] of each iteration by the model, (iteration,); NaN where no mu is known."""
    model, history = ForwardModel(test), test.history
    mu = friction_in_use(model).mu
    state = model.predict(BaseParameters.declared(test, np.nan_to_num(mu, nan=1.0)[None]), profiled=False).state

    def mean(values: Floats) -> Floats:
        total = (np.broadcast_to(values, state.energy.shape) * state.duration)[0]
        return np.asarray(np.bincount(model.points.iteration, total, minlength=len(history.step)) / history.duration)

    power, ratio = mean(state.power), mean(state.traction_ratio) * np.sign(history.creepage)
    unknown = (power > 0.0) & np.isnan(mu)[history.step]
    return np.where(unknown, np.nan, ratio), np.where(unknown, np.nan, power)
