"""Thermocouple lag: the recorded temperature follows the disc with a delay.

    tau dT_r/dt = T - T_r

    T    disc temperature, T_r recorded temperature [K], (set, point)
    tau  time constant of the sensor [s]; tau = 0 switches the effect off

Leaves behind, when it is missing: a temperature residual after every step of power that fades with the time constant.
Valid for: thermocouples beside the disc or in a slip-ring mount.
"""

from __future__ import annotations

import numpy as np

from twindisc_cli.effects._effect import Effect, Param
from twindisc_cli.effects._state import Floats, State


def follow(s: State, time_constant: Floats) -> Floats:
    """Return the first-order response to the disc's temperature (set, point), linear within each point."""
    temperature, duration, begins = s.disc_temperature, s.duration, s.begins > 0.0
    ratio = duration / np.maximum(time_constant, 1e-9)
    kept = np.exp(-ratio)
    mean = np.where(ratio > 1e-6, -np.expm1(-ratio) / np.maximum(ratio, 1e-300), 1.0)
    before = np.where(begins, s.initial_temperature, np.roll(temperature, 1, axis=1))
    drive = temperature - before * kept - (temperature - before) * mean
    recorded = np.empty_like(temperature)
    for i, first in enumerate(np.broadcast_to(begins, temperature.shape[1:])):
        last = before[:, i] if first else recorded[:, i - 1]
        recorded[:, i] = last * kept[:, i] + drive[:, i]
    return recorded


def apply(s: State, *, time_constant_s: Floats) -> State:
    """Let the recorded temperature follow the disc's."""
    return s.replace(disc_temperature=follow(s, time_constant_s))


EFFECT = Effect(
    stage="sensor",
    channel="temperature",
    params=(
        Param("time_constant_s", "s", off=0.0, start=30.0, lower=0.0, upper=2000.0,
              meaning="time constant of the sensor"),
    ),
    apply=apply,
    source="R. J. Moffat, Experimental Thermal and Fluid Science 1 (1988) 3-17",
)  # fmt: skip
