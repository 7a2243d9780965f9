"""Clock offset: the clock of the temperature log is late or early.

    T_r(t) = T(t - t_0)

    T    disc temperature, T_r recorded temperature [K], (set, point)
    t_0  offset of the clock [s], positive where it is late; t_0 = 0 switches the effect off

T is linear within each point. Before a test begins it is the initial temperature; after the last point it stays.
Leaves behind, when it is missing: a temperature residual after every step of power, as long as the offset.
Valid for: temperatures from a logger with a clock of its own, put together with the test afterwards.
"""

from __future__ import annotations

import numpy as np

from twindisc_cli.effects._effect import Effect, Param
from twindisc_cli.effects._state import Floats, State


def apply(s: State, *, offset_s: Floats) -> State:
    """Record the disc's temperature at another time."""
    first = np.flatnonzero(s.begins > 0.0)
    tests = np.split(np.arange(s.time.size), first[1:])
    temperature, offset = np.broadcast_arrays(s.disc_temperature, offset_s)
    recorded = np.array(temperature)
    for points in tests:
        time = np.r_[s.time[points[0]] - s.duration[points[0]], s.time[points]]
        for i in np.flatnonzero(offset[:, 0]):
            known = np.r_[s.initial_temperature, temperature[i, points]]
            recorded[i, points] = np.interp(time[1:] - offset[i, 0], time, known)
    return s.replace(disc_temperature=recorded)


EFFECT = Effect(
    stage="sensor",
    channel="temperature",
    params=(
        Param("offset_s", "s", off=0.0, start=30.0, lower=-600.0, upper=600.0,
              meaning="offset of the clock, positive where it is late"),
    ),
    apply=apply,
    needs_time=True,
    source="D. L. Mills, IEEE Transactions on Communications 39 (1991) 1482-1493",
)  # fmt: skip
