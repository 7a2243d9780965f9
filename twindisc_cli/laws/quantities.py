"""What a learnt law may change, and at which stage of the model."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from twindisc_cli.effects._effect import Channel, Stage
from twindisc_cli.effects._state import Floats, State

Kind = Literal["factor", "shift"]


@dataclass(frozen=True)
class Quantity:
    """A quantity of the model: `apply` takes it times (1 + change), or shifts it by change [SI].

    `unit` of a shift in the definition, `scale` from it to SI; `covariates`: what a law over it is searched over. Power
    and wear index follow from the friction; a law of friction over them would feed on itself. `shapes`: the only
    formulas that are tried, and no curve; none: all. `probes`: the changes of a factor for which the samples' response
    is asked; the one that explains more counts. Where all slides, the slope counts only once it has fallen far.
    """

    stage: Stage
    channel: Channel
    kind: Kind
    label: str
    covariates: tuple[str, ...]
    apply: Callable[[State, Floats], State]
    unit: str = "1"
    scale: float = 1.0
    shapes: tuple[str, ...] = ()
    probes: tuple[float, ...] = (0.01,)

    @property
    def size_key(self) -> str:
        """The key of a formula's size."""
        return {"1": "size", "%": "size_percent", "K": "size_K", "W": "size_W", "um": "size_um"}[self.unit]


def _mu(s: State, change: Floats) -> State:
    return s.replace(mu=s.mu * (1.0 + change))


def _slope(s: State, change: Floats) -> State:
    return s.replace(slope=s.slope * (1.0 + change))


def _creepage(s: State, change: Floats) -> State:
    return s.replace(creepage=s.creepage + change)


def _traction_ratio(s: State, change: Floats) -> State:
    return s.replace(traction_ratio=s.traction_ratio + change)


def _torque_gain(s: State, change: Floats) -> State:
    return s.replace(traction_ratio=s.traction_ratio * (1.0 + change))


def _wear(s: State, change: Floats) -> State:
    return s.replace(wear_factor=s.wear_factor * (1.0 + change))


def _wear_across(s: State, change: Floats) -> State:
    """K is the mean over what was worn; what differs from it across the track is held back by the pressure."""
    if s.surface is None:
        return s
    height = s.surface.height
    mean = np.sum(change * height, axis=-1, keepdims=True) / np.minimum(height.sum(axis=-1, keepdims=True), -1e-300)
    return s.on_surface(height + s.surface.eased(height * (change - mean)))


def _heat(s: State, change: Floats) -> State:
    return s.replace(heat=s.heat * (1.0 + change))


def _bearing_heat(s: State, change: Floats) -> State:
    return s.replace(heat=s.heat + change * (s.rolling_speed > 0.0))


def _convection(s: State, change: Floats) -> State:
    return s.replace(convection=s.convection * (1.0 + change))


def _environment(s: State, change: Floats) -> State:
    return s.replace(environment=s.environment + change)


def _temperature(s: State, change: Floats) -> State:
    return s.replace(disc_temperature=s.disc_temperature + change)


def _profile(s: State, change: Floats) -> State:
    return s if s.surface is None else s.on_surface(s.surface.height + change)


_FRICTION = ("creepage", "time", "energy", "sliding_distance", "temperature", "time_in_step", "time_since_pause",
             "greatest_creepage")  # fmt: skip
_LOADED = ("load", "pressure", "rolling_speed")
_DRIVEN = ("creepage", "time", "energy", "temperature", "power", "wear_index")
QUANTITIES: Mapping[str, Quantity] = {
    "mu": Quantity("friction", "traction", "factor", "the coefficient of friction",
                   (*_FRICTION, "power", *_LOADED, "order", "direction"), _mu),
    "slope": Quantity("traction", "traction", "factor", "the initial slope of the traction",
                      ("creepage", "time", "energy", "temperature", "greatest_creepage", "load"), _slope,
                      probes=(0.01, -0.5, -0.8)),
    "creepage": Quantity("operation", "traction", "shift", "the creepage",
                         ("creepage", "time", "energy", "temperature", "rolling_speed"), _creepage, "%", 1e-2),
    "traction_ratio": Quantity("sensor", "traction", "shift", "the recorded T/N",
                               ("creepage", "time", "temperature", "time_in_step", "load", "order"),
                               _traction_ratio),
    "torque_gain": Quantity("sensor", "traction", "factor", "the gain of the torque meter", ("time",), _torque_gain,
                            shapes=("step", "window")),
    "wear": Quantity("wear", "profile", "factor", "the wear coefficient",
                     (*_DRIVEN, "sliding_distance", "time_since_pause", *_LOADED), _wear),
    "wear_across": Quantity("surface", "profile", "factor", "the wear across the track", ("y_over_edge",),
                            _wear_across),
    "heat": Quantity("heat", "temperature", "factor", "the heat into the disc", (*_DRIVEN[:-1], "time_in_step"),
                     _heat),
    "bearing_heat": Quantity("heat", "temperature", "shift", "the heat from bearings and drag",
                             ("rolling_speed", "load"), _bearing_heat, "W"),
    "convection": Quantity("heat", "temperature", "factor", "the convection",
                           ("creepage", "time", "temperature", "power", "rolling_speed"), _convection),
    "environment": Quantity("heat", "temperature", "shift", "the temperature of the environment",
                            ("time", "energy", "time_in_step"), _environment, "K"),
    "temperature": Quantity("sensor", "temperature", "shift", "the recorded temperature",
                            ("creepage", "time", "temperature", "time_in_step"), _temperature, "K"),
    "profile": Quantity("sensor", "profile", "shift", "the recorded profile", ("y_over_edge",), _profile, "um", 1e-6),
}  # fmt: skip
MULTIPLIED: Mapping[str, str] = {"mu": "mu", "K": "wear", "convection_W_K": "convection"}
"""Which quantity multiplies a base parameter, whose level it then shares."""
