"""Thermocouple lag: the recorded temperature follows the disc with a delay.

    tau dT_r/dt = T - T_r

    T    disc temperature, T_r recorded temperature [K], (set, point)
    tau  time constant of the sensor [s]; tau = 0 switches the effect off

Leaves behind, when it is missing: a temperature residual after every step of power that fades with the time constant.
Valid for: thermocouples beside the disc or in a slip-ring mount.
"""

from __future__ import annotations

import numpy as np

from twindisc_cli.effects._effect import Effect, Param, seen
from twindisc_cli.effects._state import Floats, State


def follow(temperature: Floats, duration: Floats, time_constant: Floats, initial: float) -> Floats:
    """Return the first-order response to a temperature (set, point), linear within each point, from `initial` [K]."""
    ratio = duration / np.maximum(time_constant, 1e-9)
    kept = np.exp(-ratio)
    mean = np.where(ratio > 1e-6, -np.expm1(-ratio) / np.maximum(ratio, 1e-300), 1.0)
    start = np.full((len(temperature), 1), initial)
    before = np.concatenate([start, temperature[:, :-1]], axis=1)
    drive = temperature - before * kept - (temperature - before) * mean
    recorded = np.empty_like(temperature)
    last = start[:, 0]
    for i in range(temperature.shape[1]):
        last = last * kept[:, i] + drive[:, i]
        recorded[:, i] = last
    return recorded


def apply(s: State, *, time_constant_s: Floats) -> State:
    """Let the recorded temperature follow the disc's."""
    return s.replace(disc_temperature=follow(s.disc_temperature, s.duration, time_constant_s, s.initial_temperature))


EFFECT = Effect(
    stage="sensor",
    channel="temperature",
    seen_in=seen("temperature"),
    params=(
        Param(
            "time_constant_s", "s", off=0.0, start=30.0, lower=0.0, upper=2000.0, meaning="time constant of the sensor"
        ),
    ),
    apply=apply,
    source="R. J. Moffat, Experimental Thermal and Fluid Science 1 (1988) 3-17",
)
