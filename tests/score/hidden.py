"""What a hidden effect does to the rig, and the moment of the test at which it is asked."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass
class Moment:
    """The state of the running test that a law may depend on.

    time [s], cycles [revolutions], energy [J] dissipated so far, creepage [1] as it is, sliding_speed [m/s],
    rise [K] of the disc over its start, wear_index [N/m2]: power dissipated per length rolled and area of the patch.
    """

    time: float = 0.0
    cycles: float = 0.0
    energy: float = 0.0
    creepage: float = 0.0
    sliding_speed: float = 0.0
    rise: float = 0.0
    wear_index: float = 0.0


@dataclass(frozen=True)
class Hidden:
    """One hidden effect, neutral unless set. Factors multiply and additions add when several act together."""

    # the contact and its wear
    creepage: float = 0.0  # added to the creepage [1]
    lateral: float = 0.0  # lateral creepage [1]
    load: float = 1.0  # true load over the one set [1]
    flexibility: float = 1.0  # of the surface over that of bare steel [1]
    law: str | None = None
    contact: str | None = None
    friction: Callable[[Moment], float] | None = None  # factor of mu
    wear: Callable[[Moment], float] | None = None  # factor of K
    wear_across: Callable[[Floats], Floats] | None = None  # factor of K over y [m]
    wander: float = 0.0  # standard deviation of the lateral position of the contact [m]
    other_disc: float = 0.0  # share of the wear that disc 1 takes [1]
    # the heat
    heat: Callable[[float], float] | None = None  # power added at a time [W]
    share: float = 1.0  # share of the dissipated power that enters the disc [1]
    conductance: Callable[[float], float] | None = None  # factor of h S at a rise over the environment [K]
    environment: Callable[[float], float] | None = None  # change of the environment at a time [K]
    shaft: tuple[float, float, float] | None = None  # disc-shaft [W/K], capacity [J/K], shaft-environment [W/K]
    # the sensors
    lag: float = 0.0  # time constant of the thermocouple [s]
    read_traction: Callable[[Floats, Floats], Floats] | None = None  # (time, ratio) -> ratio
    read_profile: Callable[[Floats, Floats], Floats] | None = None  # (y, height) -> height

    @property
    def marches(self) -> bool:
        """Whether the contact or its wear differs, so that the march through the history must be run again."""
        names = [f.name for f in fields(self)][: [f.name for f in fields(self)].index("heat")]
        return any(getattr(self, name) != getattr(NOTHING, name) for name in names)


NOTHING = Hidden()
