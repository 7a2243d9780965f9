"""Temperature of the score's disc: one heat capacity, its surroundings, its shaft and the thermocouple on it.

    C dT/dt  = P - hS f(T - Te) (T - Te) - G (T - Ts),    Cs dTs/dt = G (T - Ts) - Gs Ts
    tau dr/dt = T - r                                      reading of the thermocouple

Temperatures are rises over the nominal environment [K]. Classical Runge-Kutta steps of a few seconds.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import exp

import numpy as np
from numpy.typing import NDArray

from .hidden import Hidden

Floats = NDArray[np.float64]
State = tuple[float, float]


class Plant:
    """The thermal balance with everything that is hidden in it."""

    def __init__(self, *, capacity: float, convection: float, hidden: Sequence[Hidden]) -> None:
        """`capacity` [J/K], `convection` h S [W/K]."""
        self._capacity, self._convection = capacity, convection
        self._sources = [h.heat for h in hidden if h.heat]
        self._share = float(np.prod([h.share for h in hidden]))
        self._factors = [h.conductance for h in hidden if h.conductance]
        self._drifts = [h.environment for h in hidden if h.environment]
        self._shafts = [h.shaft for h in hidden if h.shaft]

    def _rate(self, time: float, state: State, power: float, cooling: float, room: float) -> State:
        disc, shaft = state
        over = disc - room - sum(drift(time) for drift in self._drifts)
        flow = cooling * self._convection * over
        for factor in self._factors:
            flow *= factor(over)
        gain = self._share * power + sum(source(time) for source in self._sources) - flow
        shaft_rate = 0.0
        for joint, capacity, to_room in self._shafts:
            gain -= joint * (disc - shaft)
            shaft_rate += (joint * (disc - shaft) - to_room * shaft) / capacity
        return gain / self._capacity, shaft_rate

    def advance(
        self, time: float, state: State, power: float, step: float, cooling: float = 1.0, room: float = 0.0
    ) -> State:
        """The state one `step` [s] later under constant `power` [W], factor of h S and change of the `room` [K]."""
        given = (power, cooling, room)
        k1 = self._rate(time, state, *given)
        k2 = self._rate(time + step / 2, _moved(state, k1, step / 2), *given)
        k3 = self._rate(time + step / 2, _moved(state, k2, step / 2), *given)
        k4 = self._rate(time + step, _moved(state, k3, step), *given)
        mean = [(a + 2 * b + 2 * c + d) / 6 for a, b, c, d in zip(k1, k2, k3, k4, strict=True)]
        return _moved(state, (mean[0], mean[1]), step)

    def run(self, time: Floats, power: Floats) -> Floats:
        """The rise [K] at the ends of the steps that begin at `time` (step + 1,), under `power` [W] (step,)."""
        state, rise = (0.0, 0.0), np.zeros(time.size)
        for i in range(power.size):
            state = self.advance(float(time[i]), state, float(power[i]), float(time[i + 1] - time[i]))
            rise[i + 1] = state[0]
        return rise


def _moved(state: State, rate: State, step: float) -> State:
    return state[0] + step * rate[0], state[1] + step * rate[1]


def thermocouple(time: Floats, rise: Floats, lag: float) -> Floats:
    """The reading [K] of a thermocouple of time constant `lag` [s], exact for a rise linear within the steps."""
    if lag == 0.0:
        return rise
    reading = np.zeros_like(rise)
    for i in range(1, rise.size):
        step = float(time[i] - time[i - 1])
        slope, fade = (rise[i] - rise[i - 1]) / step, exp(-step / lag)
        reading[i] = rise[i] - slope * lag + fade * (reading[i - 1] - rise[i - 1] + slope * lag)
    return reading
