"""Contact, wear and heat on cases drawn anew: `python tests/bench.py --seed 7 drawn` draws others.

Each section takes a generator of random numbers and yields the worst of its cases beside a target, against closed
forms, solvers of ordinary differential equations or the exact half-space solver.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.random import Generator

AtMost = Callable[..., object]


def shaft_with_pauses(rng: Generator, at_most: AtMost) -> Iterator[object]:
    """Disc and shaft through drives and pauses, against the exponential of their matrix and an ODE solver."""
    from scipy.integrate import solve_ivp
    from scipy.linalg import expm

    from twindisc_cli.physics import disc_heat

    closed, solved = [], []
    for case in range(200):
        capacity, shaft, joint = np.exp(rng.uniform(np.log([20.0, 20.0, 0.01]), np.log([500.0, 2e4, 20.0])))
        loss = float(rng.choice([0.0, np.exp(rng.uniform(np.log(0.01), np.log(10.0)))], p=[0.1, 0.9]))
        count = 8
        duration = np.exp(rng.uniform(np.log(1.0), np.log(3600.0), count))
        power, room = rng.uniform(0.0, 50.0, count) * (rng.random(count) < 0.6), rng.uniform(280.0, 300.0, count)
        found = disc_heat.temperatures(
            power=power, duration=duration, capacity=capacity, convection=loss, environment=room, initial=293.0,
            shaft_conductance=joint, shaft_capacity=shaft,
        )[0]  # fmt: skip
        rates = np.array([[-(loss + joint), joint], [joint, -joint]]) / [[capacity], [shaft]]
        one = other = np.array([293.0, 293.0])
        for i in range(count):
            drive = np.array([(power[i] + loss * room[i]) / capacity, 0.0])
            both = np.block([[rates, drive[:, None]], [np.zeros((1, 3))]])
            one = (expm(both * duration[i]) @ np.append(one, 1.0))[:2]
            closed.append(abs(found[i] - one[0]))
            if case < 10:
                other = solve_ivp(
                    lambda _, x, drive=drive, rates=rates: rates @ x + drive, (0.0, duration[i]), other,
                    method="LSODA", rtol=1e-11, atol=1e-9,
                ).y[:, -1]  # fmt: skip
                solved.append(abs(found[i] - other[0]))
    yield at_most("shaft with pauses, 200 drawn, against the matrix exponential", max(closed), 1e-6, "K")
    yield at_most("  10 of them against an ODE solver", max(solved), 1e-6, "K")


SECTIONS = {
    "drawn: shaft with pauses": shaft_with_pauses,
}
