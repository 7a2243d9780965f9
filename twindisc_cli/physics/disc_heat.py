"""The disc as one body of uniform temperature, heated by the contact and cooled by its environment (Eqs. 18, 19).

    C dT/dt = P - hS (T - T_env) - G (T - T_s),    C_s dT_s/dt = G (T - T_s)

    T      temperature of the disc [K];     T_env  of its environment [K]
    C      heat capacity [J/K], density times specific heat times volume
    hS     convection coefficient times surface [W/K], zero: none
    P      dissipated power that enters the disc [W]
    T_s    temperature of a shaft [K], C_s its heat capacity [J/K], G the conductance to it [W/K], zero: no shaft

The paper steps it implicitly (Eq. 19); between changes of power the exact solution is as simple and needs no step. With
a shaft it is the exponential of the 2 x 2 matrix A of both equations: over an interval t, with T measured from T_env,

    x' = exp(A t) x + f(A) (P / C, 0),    f(z) = (exp(z t) - 1) / z,    x = (T, T_s)

and any function of A is  f(A) = (f(u) + f(v)) / 2 + (f(u) - f(v)) / (u - v) (A - (u + v) / 2),  u, v its eigenvalues,
which are real and not positive.
(The paper's lambda S h_c is hS with h_c = Nu/length; its h_c alone would not have the units.)
Source: section 3.3. Valid for: Biot number h length/conductivity well below 1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg.blas import dtbsv
from scipy.special import exprel

from twindisc_cli.physics._arrays import Floats, arrays

_NO_LOSS = 1e-12  # [W/K] in the place of zero: a disc without losses warms on
_SLOWEST = 1e-30
"""A rate [1/s] at which nothing changes."""


@dataclass(frozen=True)
class Shaft:
    """What a disc sits on: conductance to it [W/K], none at zero, and its heat capacity [J/K]."""

    conductance: ArrayLike = 0.0
    capacity: ArrayLike = 1.0


def temperatures(
    *,
    power: ArrayLike,
    duration: ArrayLike,
    capacity: float,
    convection: ArrayLike,
    environment: ArrayLike,
    initial: float,
    shaft: Shaft = Shaft(),
    begins: ArrayLike = 1.0,
) -> Floats:
    """The temperature [K] at the end of every interval, exact for a power that is constant within each.

    duration [s] (interval,); power, convection, environment and the shaft's values broadcast to (set, interval).
    begins (interval,): not 0 where disc and shaft begin at `initial`, as they always do in the first interval.
    """
    power, duration, convection, environment = arrays(power, duration, convection, environment)
    conductance, shaft_capacity = arrays(shaft.conductance, shaft.capacity)
    shape = np.broadcast(power, duration, convection, environment, conductance, shaft_capacity, np.empty((1, 1))).shape
    loss = np.maximum(convection + conductance, _NO_LOSS)
    gone = -np.expm1(loss * (duration / -capacity))
    level = power / loss + environment * (np.maximum(convection, _NO_LOSS - conductance) / loss)
    if gone.shape != shape or level.shape != shape:
        gone, level = np.broadcast_to(gone, shape), np.broadcast_to(level, shape)
    fresh = np.asarray(begins) != 0.0 if np.size(begins) == shape[-1] else np.arange(shape[-1]) == 0
    if not np.any(conductance):
        return _disc(gone, level, initial, fresh)
    rates = conductance / capacity, conductance / shaft_capacity, convection / capacity
    steps = _Steps.of(*(np.broadcast_to(value, shape) for value in (*rates, duration)))
    return _disc_and_shaft(steps, np.broadcast_to(power / capacity, shape), environment, initial, fresh)


def _disc(gone: Floats, level: Floats, initial: float, fresh: NDArray[np.bool_]) -> Floats:
    """T_i - (1 - gone) T_(i-1) = gone level as one lower banded system, columns by diagonal (set, interval)."""
    bands = np.ones((*gone.shape, 2))
    bands[:, :-1, 1] = np.where(fresh, 0.0, gone - 1.0)[:, 1:]
    bands[:, -1, 1] = 0.0
    known = gone * level + np.where(fresh, initial * (1.0 - gone), 0.0)
    return np.asarray(dtbsv(1, bands.reshape(-1, 2).T, known.ravel(), lower=1, diag=1).reshape(gone.shape))


@dataclass(frozen=True)
class _Steps:
    """What an interval does to disc and shaft, (set, interval).

    kept   exp(A t) [1] by row and column;   gained  first column of f(A) [s]: what 1 K/s into the disc makes of both
    """

    kept: tuple[tuple[Floats, Floats], tuple[Floats, Floats]]
    gained: tuple[Floats, Floats]

    @classmethod
    def of(cls, to_shaft: Floats, from_disc: Floats, lost: Floats, duration: Floats) -> _Steps:
        """Steps for the rates G/C of the disc, G/C_s of the shaft and hS/C [1/s], over durations [s]."""
        mean, half = 0.5 * (to_shaft + lost + from_disc), 0.5 * (to_shaft + lost - from_disc)
        apart = np.maximum(np.sqrt(half**2 + to_shaft * from_disc), _SLOWEST)
        fast = mean + apart
        slow = lost * from_disc / fast
        parts = np.exp(-slow * duration), np.exp(-fast * duration)
        level, pull = 0.5 * (parts[0] + parts[1]), (parts[0] - parts[1]) / (2.0 * apart)
        kept = (level - half * pull, to_shaft * pull), (from_disc * pull, level + half * pull)
        parts = duration * exprel(-slow * duration), duration * exprel(-fast * duration)
        level, pull = 0.5 * (parts[0] + parts[1]), (parts[0] - parts[1]) / (2.0 * apart)
        return cls(kept, (level - half * pull, from_disc * pull))


def _disc_and_shaft(
    steps: _Steps, warming: Floats, environment: Floats, initial: float, fresh: NDArray[np.bool_]
) -> Floats:
    """The disc beside a shaft as one lower banded system: beneath each row of the disc stands that of the shaft.

    T_i - k11 T_(i-1) - k12 T_s(i-1) = c1,   T_s(i) - k21 T_(i-1) - k22 T_s(i-1) = c2;   warming P / C [K/s]
    """
    shape = warming.shape
    bands, known = np.zeros((*shape, 2, 4)), np.empty((*shape, 2))
    for row, (of_disc, of_shaft) in enumerate(steps.kept):
        bands[:, :-1, 0, 2 + row] = np.where(fresh, 0.0, -of_disc)[:, 1:]
        bands[:, :-1, 1, 1 + row] = np.where(fresh, 0.0, -of_shaft)[:, 1:]
        stays = of_disc + of_shaft
        known[..., row] = environment * (1.0 - stays) + steps.gained[row] * warming
        known[..., row] += np.where(fresh, initial * stays, 0.0)
    result = dtbsv(3, bands.reshape(-1, 4).T, known.ravel(), lower=1, diag=1)
    return np.asarray(result.reshape(*shape, 2)[..., 0])


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
