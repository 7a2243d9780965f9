"""The energy that a test dissipated by its own measurements, before anything is fitted."""

from __future__ import annotations

import numpy as np

from twindisc_cli.model.experiment import Experiment


def measured_energy(test: Experiment) -> float:
    """Dissipated energy [J], from the traction as measured (or the friction coefficient given)."""
    history = test.history
    mu = np.full(len(history.step), test.options.friction_coefficient)
    mu = np.where(np.isfinite(history.given_mu), history.given_mu, mu)
    if test.measured.traction is not None:
        samples = test.measured.traction
        level = {s: abs(float(np.mean(samples.ratio[samples.step == s]))) for s in np.unique(samples.step)}
        mean = float(np.mean(np.abs(samples.ratio)))
        mu = np.array([level.get(int(s), mean) for s in history.step])
    load, speed = test.rig.normal_load * history.load_factor, test.rig.rolling_speed * history.speed_factor
    power = mu * load * np.abs(history.creepage) * speed
    return max(float(np.sum(power * history.duration)), 1e-9)
