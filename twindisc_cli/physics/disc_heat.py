"""The disc as one body of uniform temperature, heated by the contact and cooled by its environment (Eqs. 18, 19).

    C dT/dt = P - hS (T - T_env)

    T      temperature of the disc [K];     T_env  of its environment [K]
    C      heat capacity rho c v [J/K];     hS     convection coefficient times surface [W/K], zero: none
    P      dissipated power that enters the disc [W]

The paper steps it implicitly (Eq. 19); between changes of power the exact solution is as simple and needs no step.
(The paper's lambda S h_c is hS with h_c = Nu/length; its h_c alone would not have the units.)
Source: section 3.3. Valid for: Biot number h length/conductivity well below 1.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import exprel

from twindisc_cli.physics._arrays import Floats, arrays


def advance(
    temperature: ArrayLike,
    *,
    power: ArrayLike,
    duration: ArrayLike,
    capacity: ArrayLike,
    convection: ArrayLike,
    environment: ArrayLike,
) -> Floats:
    """The temperature [K] after `duration` [s] at constant power, exactly; all broadcast."""
    now, power, duration, capacity = arrays(temperature, power, duration, capacity)
    convection, environment = arrays(convection, environment)
    imbalance = power - convection * (now - environment)
    relaxed: Floats = exprel(-convection * duration / capacity)
    return now + imbalance * duration / capacity * relaxed


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


def respond(
    time: ArrayLike,
    *,
    power: ArrayLike,
    duration: ArrayLike,
    capacity: ArrayLike,
    convection: ArrayLike,
    environment: ArrayLike,
    initial: ArrayLike,
) -> Floats:
    """The temperature [K] at each `time` [s] (sample,) under a power [W] constant over each interval, (..., interval).

    duration [s] (interval,); capacity, convection, environment and initial temperature are (...), one a parameter set.
    Before time 0 the disc has its initial temperature; after the last interval it cools without power.
    """
    time, duration, power, capacity = arrays(time, duration, power, capacity)
    convection, environment, initial = arrays(convection, environment, initial)
    shape = np.broadcast_shapes(power.shape[:-1], capacity.shape, convection.shape, environment.shape, initial.shape)
    power = np.concatenate([np.broadcast_to(power, (*shape, duration.size)), np.zeros((*shape, 1))], axis=-1)
    starts = np.empty_like(power)
    starts[..., 0] = initial
    for i, interval in enumerate(duration):
        starts[..., i + 1] = advance(
            starts[..., i],
            power=power[..., i],
            duration=interval,
            capacity=capacity,
            convection=convection,
            environment=environment,
        )
    began = np.concatenate([[0.0], np.cumsum(duration)])
    at = np.clip(np.searchsorted(began, time, side="right") - 1, 0, duration.size)
    return advance(
        starts[..., at],
        power=power[..., at],
        duration=np.maximum(time - began[at], 0.0),
        capacity=capacity[..., None],
        convection=convection[..., None],
        environment=environment[..., None],
    )
