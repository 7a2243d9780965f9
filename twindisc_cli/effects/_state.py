"""What an effect may change: the state of a test at its operating points.

Arrays broadcast to (set, point): `set` counts parameter sets evaluated together, `point` the operating points in
order of time. A parameter reaches an effect as an array of shape (set, 1). What a later stage fills is NaN before.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def _always(value: float) -> Any:
    """Return a field of one value for every set and point."""
    return field(default_factory=lambda: np.full((1, 1), value))


@dataclass(frozen=True)
class Surface:
    """The worn surfaces as the profilometer records them: height (set, stop, strip) [m] over y (strip,) [m].

    edge (set, stop, 1) is the half-width of the worn zone [m], depth (set, stop, 1) its greatest depth [m].
    """

    y: Floats
    height: Floats
    edge: Floats
    depth: Floats


@dataclass(frozen=True)
class State:
    """The operating points of one test, and what the stages have made of them so far.

    Given: time [s] at the end of each point, duration [s], cycles (revolutions so far), all (point,);
    rolling_radius [m] of disc 2; nominal_load [N].

    operation  creepage, lateral_creepage [1], spin [1/m], normal_load [N], rolling_speed [m/s]
    friction   mu, the local coefficient of friction [1]
    traction   slope, factor on the initial slope of the traction curve [1]; exactness, from 0 (the declared law)
               to 1 (the exact theory)
    contact    half_space, from 0 (the updated Hertz ellipse) to 1 (the half-space patch); wander, standard deviation
               of the contact's lateral position [m]
    wear       wear_factor, K over its base value [1]; disc1_share, part of the worn depth that disc 1 bears [1];
               transition_ratio, K over its base value where T gamma / A of a strip exceeds transition_at [N/m2];
               threshold [N/m2], the T gamma / A that must be exceeded before a strip wears
    heat       heat [W] into the disc, convection h S [W/K], environment [K], shaft_conductance [W/K] to a shaft of
               heat capacity shaft_capacity [J/K]
    sensor     traction_ratio [1] and disc_temperature [K] as recorded, surface as recorded

    From the pass before, since the stages feed each other: temperature [K] of the disc, energy [J] dissipated so far.
    """

    time: Floats
    duration: Floats
    cycles: Floats
    rolling_radius: float
    nominal_load: float

    creepage: Floats
    normal_load: Floats
    rolling_speed: Floats
    temperature: Floats
    energy: Floats
    environment: Floats

    mu: Floats = _always(np.nan)
    lateral_creepage: Floats = _always(0.0)
    spin: Floats = _always(0.0)
    slope: Floats = _always(1.0)
    exactness: Floats = _always(0.0)
    half_space: Floats = _always(0.0)
    wander: Floats = _always(0.0)
    wear_factor: Floats = _always(1.0)
    disc1_share: Floats = _always(0.0)
    transition_ratio: Floats = _always(1.0)
    transition_at: Floats = _always(1.0)
    threshold: Floats = _always(0.0)
    power: Floats = _always(np.nan)
    heat: Floats = _always(np.nan)
    convection: Floats = _always(np.nan)
    shaft_conductance: Floats = _always(0.0)
    shaft_capacity: Floats = _always(1.0)
    traction_ratio: Floats = _always(np.nan)
    disc_temperature: Floats = _always(np.nan)
    surface: Surface | None = None

    @property
    def sliding_speed(self) -> Floats:
        """Rigid sliding speed [m/s], lateral creepage included."""
        return np.asarray(self.rolling_speed * np.hypot(self.creepage, self.lateral_creepage))

    @property
    def warming(self) -> Floats:
        """Disc temperature above the environment [K]."""
        return np.asarray(self.temperature - self.environment)

    def replace(self, **changes: Any) -> State:
        """Return this state with some quantities changed."""
        return replace(self, **changes)

    def on_surface(self, height: Floats) -> State:
        """Return this state with another recorded surface height (set, stop, strip) [m]."""
        if self.surface is None:
            return self
        return replace(self, surface=replace(self.surface, height=height))
