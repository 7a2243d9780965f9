"""The energy that a test dissipated by its own measurements, before anything is fitted.

    P = (T/N) N V v                 T/N as measured, else mu as given or declared
    P = V (v T + vy Ty + phi M)     what no T/N shows, with the mu identified: lateral creepage, spin, another creepage

v    longitudinal creepage of the history [1];  vy  lateral creepage [1];  phi  spin [1/m];  V  rolling speed [m/s]
"""

from __future__ import annotations

import numpy as np

from twindisc_cli.errors import MeasurementError
from twindisc_cli.identify.steps import friction_in_use
from twindisc_cli.model.base import BaseParameters
from twindisc_cli.model.experiment import Experiment, Floats
from twindisc_cli.model.forward import ForwardModel, acts_at


def measured_ratio(test: Experiment) -> Floats:
    """T/N along the creepage of each iteration: measured, else given or declared; NaN: not known. (iteration,)."""
    history, samples = test.history, test.measured.traction
    ratio = np.where(np.isfinite(history.given_mu), history.given_mu, test.options.friction_coefficient)
    if samples is not None:
        for step in np.unique(samples.step):
            mean = np.mean(samples.ratio[samples.step == step]) * np.where(history.creepage < 0.0, -1.0, 1.0)
            ratio = np.where(history.step == step, mean, ratio)
    return np.where(history.creepage == 0.0, 0.0, ratio)


def measured_power(test: Experiment) -> Floats:
    """Dissipated power of each iteration [W], (iteration,); NaN: not known."""
    power = measured_ratio(test) * _pressed_slip(test)
    if not _slides_otherwise(test):
        return power
    try:
        return _power_of_all_forces(test)
    except MeasurementError:
        return power


def measured_energy(test: Experiment) -> float:
    """Dissipated energy [J] of the whole test; steps of which nothing is known take the mean of T/N."""
    power, samples = np.abs(measured_power(test)), test.measured.traction
    if samples is not None:
        power = np.where(np.isnan(power), np.mean(np.abs(samples.ratio)) * _pressed_slip(test), power)
    return max(float(np.sum(power * test.history.duration)), 1e-9)


def _pressed_slip(test: Experiment) -> Floats:
    """N V |v| of each iteration [W], (iteration,)."""
    history = test.history
    load, speed = test.rig.normal_load * history.load_factor, test.rig.rolling_speed * history.speed_factor
    return np.asarray(load * speed * np.abs(history.creepage))


def _slides_otherwise(test: Experiment) -> bool:
    """Whether the discs slide in another way than by the creepage of the history."""
    return bool(np.any(test.history.yaw)) or acts_at(test, "operation")


def _power_of_all_forces(test: Experiment) -> Floats:
    """The model's power of each iteration [W], (iteration,); NaN where something slides with an unknown mu."""
    model, history = ForwardModel(test), test.history
    mu = friction_in_use(model).mu
    state = model.predict(BaseParameters.declared(test, np.nan_to_num(mu, nan=1.0)[None]), profiled=False).state
    spent = (np.broadcast_to(state.power, state.energy.shape) * state.duration)[0]
    power = np.bincount(model.points.iteration, spent, minlength=len(history.step)) / history.duration
    return np.where((power > 0.0) & np.isnan(mu)[history.step], np.nan, power)
