"""The disc as one body of uniform temperature, heated by the contact and cooled by its environment (Eqs. 18, 19).

    C dT/dt = P - hS (T - T_env) - G (T - T_s),    C_s dT_s/dt = G (T - T_s)

    T      temperature of the disc [K];     T_env  of its environment [K]
    C      heat capacity rho c v [J/K];     hS     convection coefficient times surface [W/K], zero: none
    P      dissipated power that enters the disc [W]
    T_s    temperature of a shaft [K], C_s its heat capacity [J/K], G the conductance to it [W/K], zero: no shaft

The paper steps it implicitly (Eq. 19); between changes of power the exact solution is as simple and needs no step. The
shaft, which changes slowly, is stepped beside the disc: it sees the disc's mean temperature over each interval.
(The paper's lambda S h_c is hS with h_c = Nu/length; its h_c alone would not have the units.)
Source: section 3.3. Valid for: Biot number h length/conductivity well below 1.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg.blas import dtbsv

from twindisc_cli.physics._arrays import Floats, arrays

_NO_LOSS = 1e-12


def temperatures(
    *,
    power: ArrayLike,
    duration: ArrayLike,
    capacity: float,
    convection: ArrayLike,
    environment: ArrayLike,
    initial: float,
    shaft_conductance: ArrayLike = 0.0,
    shaft_capacity: ArrayLike = 1.0,
) -> Floats:
    """The temperature [K] at the end of every interval, exact for a power that is constant within each.

    duration [s] (interval,); power, convection, environment and the shaft's values broadcast to (set, interval).
    """
    power, duration, convection, environment = arrays(power, duration, convection, environment)
    conductance, shaft_capacity = arrays(shaft_conductance, shaft_capacity)
    everything = (power, duration, convection, environment, conductance, shaft_capacity, np.empty((1, 1)))
    shape = np.broadcast_shapes(*(np.shape(value) for value in everything))
    loss = np.broadcast_to(np.maximum(convection + conductance, _NO_LOSS), shape)
    gone = -np.expm1(-loss * duration / capacity)
    level = (power + convection * environment + _NO_LOSS * environment * (convection + conductance == 0.0)) / loss
    level = np.broadcast_to(level, shape)
    if not np.any(conductance):
        return _disc(gone, level, initial)
    pull = np.broadcast_to(conductance / loss, shape)
    follows = np.broadcast_to(-np.expm1(-conductance * duration / shaft_capacity), shape)
    return _disc_and_shaft(gone, level, pull, follows, initial)


def _disc(gone: Floats, level: Floats, initial: float) -> Floats:
    """T_i - (1 - gone) T_(i-1) = gone level as one lower banded system, columns by diagonal (set, interval)."""
    bands = np.ones((*gone.shape, 2))
    bands[:, :-1, 1] = gone[:, 1:] - 1.0
    bands[:, -1, 1] = 0.0
    known = gone * level
    known[:, 0] += initial * (1.0 - gone[:, 0])
    return np.asarray(dtbsv(1, bands.reshape(-1, 2).T, known.ravel(), lower=1, diag=1).reshape(gone.shape))


def _disc_and_shaft(gone: Floats, level: Floats, pull: Floats, follows: Floats, initial: float) -> Floats:
    """The same beside a shaft: beneath each row of the disc stands that of the shaft (set, interval).

    T_i - (1 - gone) T_(i-1) - gone pull T_s(i-1) = gone level,   T_s(i) - (1 - follows) T_s(i-1) - ... = 0
    """
    shape = gone.shape
    bands = np.zeros((*shape, 2, 4))
    bands[:, :-1, 0, 2] = gone[:, 1:] - 1.0
    bands[:, :-1, 1, 1] = -(gone * pull)[:, 1:]
    bands[:, :, 0, 1] = -0.5 * follows
    bands[:, :-1, 0, 3] = -0.5 * follows[:, 1:]
    bands[:, :-1, 1, 2] = follows[:, 1:] - 1.0
    known = np.zeros((*shape, 2))
    known[..., 0] = gone * level
    known[:, 0, 0] += initial * (1.0 - gone + gone * pull)[:, 0]
    known[:, 0, 1] = initial * (1.0 - 0.5 * follows)[:, 0]
    found = dtbsv(3, bands.reshape(-1, 4).T, known.ravel(), lower=1, diag=1)
    return np.asarray(found.reshape(*shape, 2)[..., 0])


def implicit_step(
    temperature: ArrayLike,
    *,
    power: ArrayLike,
    duration: ArrayLike,
    capacity: ArrayLike,
    convection: ArrayLike,
    environment: ArrayLike,
) -> Floats:
    """The temperature [K] after one implicit step of Eq. 19, the paper's way: first order in `duration` [s]."""
    now, power, duration, capacity = arrays(temperature, power, duration, capacity)
    convection, environment = arrays(convection, environment)
    return now + (power - convection * (now - environment)) * duration / (capacity + convection * duration)
