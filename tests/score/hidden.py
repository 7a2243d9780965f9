"""What a hidden effect does to the rig, and the moment of the test at which it is asked."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Shift = Callable[[Mapping[str, Floats]], Floats]
"""From the covariates of the samples (sample,) each, by their names, to what is added to the readings."""


@dataclass
class Moment:
    """The state of the running test that a law may depend on.

    time [s], cycles [revolutions], energy [J] dissipated so far, creepage [1] as it is, sliding_speed [m/s],
    rise [K] of the disc over its start, power [W] dissipated, wear_index [N/m2]: power per length rolled and area of
    the patch, time_in_step [s] since the creepage was changed, greatest_creepage [1] so far.
    """

    time: float = 0.0
    cycles: float = 0.0
    energy: float = 0.0
    creepage: float = 0.0
    sliding_speed: float = 0.0
    rise: float = 0.0
    power: float = 0.0
    wear_index: float = 0.0
    time_in_step: float = 0.0
    greatest_creepage: float = 0.0


COVARIATES = {
    "creepage": "creepage", "sliding_speed": "sliding_speed", "time": "time", "cycles": "cycles", "energy": "energy",
    "temperature": "rise", "power": "power", "wear_index": "wear_index", "time_in_step": "time_in_step",
    "greatest_creepage": "greatest_creepage",
}  # fmt: skip
"""What a law may depend on, by the name that the program's answers use, and where a moment holds it."""


@dataclass(frozen=True)
class Hidden:
    """One hidden effect, neutral unless set. Factors multiply and additions add when several act together."""

    # the contact and its wear
    creepage: float = 0.0  # added to the creepage [1]
    lateral: float = 0.0  # lateral creepage [1]
    load: float = 1.0  # true load over the one set [1]
    crown: float = 1.0  # true curvature across over the rig's [1]
    flexibility: float = 1.0  # of the surface over that of bare steel [1]
    law: str | None = None
    contact: str | None = None
    slip: Callable[[Moment], float] | None = None  # added to the creepage [1]
    slope: Callable[[Moment], float] | None = None  # factor of the stiffness of the contact
    friction: Callable[[Moment], float] | None = None  # factor of mu
    wear: Callable[[Moment], float] | None = None  # factor of K
    wear_across: Callable[[Floats], Floats] | None = None  # factor of K over y / edge of the track
    wear_locally: Callable[[Floats], Floats] | None = None  # factor of K over the wear index of each strip [N/m2]
    wander: float = 0.0  # standard deviation of the lateral position of the contact [m]
    wanders_evenly: bool = False  # each disc between two ends, instead of normally
    other_disc: float = 0.0  # share of the wear that disc 1 takes [1]
    # the heat as the moment has it
    warming: Callable[[Moment], float] | None = None  # factor of the power that enters the disc
    cooling: Callable[[Moment], float] | None = None  # factor of h S
    room: Callable[[Moment], float] | None = None  # change of the environment [K]
    # the heat alone
    heat: Callable[[float], float] | None = None  # power added at a time [W]
    share: float = 1.0  # share of the dissipated power that enters the disc [1]
    conductance: Callable[[float], float] | None = None  # factor of h S at a rise over the environment [K]
    environment: Callable[[float], float] | None = None  # change of the environment at a time [K]
    shaft: tuple[float, float, float] | None = None  # disc-shaft [W/K], capacity [J/K], shaft-environment [W/K]
    # the sensors
    lag: float = 0.0  # time constant of the thermocouple [s]
    read_temperature: Callable[[Floats, Floats], Floats] | None = None  # (time, rise) -> rise
    read_traction: Callable[[Floats, Floats], Floats] | None = None  # (time, torque) -> torque, over the rig's load
    read_profile: Callable[[Floats, Floats], Floats] | None = None  # (y, height) -> height
    shift_traction: Shift | None = None  # added to the ratio read [1]
    shift_temperature: Shift | None = None  # added to the temperature read [K]
    shift_profile: Callable[[Floats], Floats] | None = None  # added to the height read [m], over y / edge of the track

    @property
    def marches(self) -> bool:
        """Whether the contact or its wear differs, so that the march through the history must be run again."""
        names = [f.name for f in fields(self)][: [f.name for f in fields(self)].index("heat")]
        return any(getattr(self, name) != getattr(NOTHING, name) for name in names)


NOTHING = Hidden()
