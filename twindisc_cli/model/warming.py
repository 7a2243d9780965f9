"""Disc temperature over the operating points (Eq. 18), exact for a power that is constant within each point.

    rho C v dT/dt = P - h S (T - T_env) - G (T - T_s),    C_s dT_s/dt = G (T - T_s)

The shaft (G, T_s, C_s), which an effect may connect, is stepped beside the disc.
"""

from __future__ import annotations

import numpy as np

from twindisc_cli.effects._state import State
from twindisc_cli.model.experiment import Floats, Thermal


def warmed(state: State, thermal: Thermal) -> Floats:
    """Disc temperature at the end of every point [K], (set, point)."""
    shape = state.energy.shape
    convection = np.broadcast_to(state.convection, shape)
    shaft = np.broadcast_to(state.shaft_conductance, shape)
    loss = np.maximum(convection + shaft, 1e-12)
    kept = np.exp(-loss * state.duration / thermal.heat_capacity)
    level = (np.broadcast_to(state.heat, shape) + convection * state.environment) / loss
    pull, follows = shaft / loss, -np.expm1(-shaft * state.duration / np.broadcast_to(state.shaft_capacity, shape))
    connected = bool(np.any(shaft))
    now = np.full(shape[0], thermal.initial_temperature)
    shaft_now = now
    temperature = np.empty(shape)
    for i in range(shape[1]):
        before = now
        target = level[:, i] + pull[:, i] * shaft_now if connected else level[:, i]
        now = target + (before - target) * kept[:, i]
        if connected:
            shaft_now = shaft_now + (0.5 * (before + now) - shaft_now) * follows[:, i]
        temperature[:, i] = now
    return temperature
